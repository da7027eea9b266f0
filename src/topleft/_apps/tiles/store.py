"""Blocks of pixels as tiles, each a separate chunk: the common part of writing GeoTIFF, Zarr and Deep Zoom.

Input: a block, which is a window at level 0 and as many pixels at the coarser levels. Output: its tiles, as the format
encodes them. The chunks themselves show the tiles of an earlier run: a tile is there and can be read, or it is not.
"""

from __future__ import annotations

import struct
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from topleft._apps.cluster import is_client
from topleft._apps.tiles.folders import Folder, check_space
from topleft._core.base.array_types import Array
from topleft._core.base.arrays import check_progress, shown
from topleft.annex.windows import WindowedRaster

DAMAGES = (ValueError, OSError, RuntimeError, SyntaxError, EOFError, zlib.error, struct.error)
"""Errors of zlib, NumPy, numcodecs and Pillow for a damaged tile."""

LARGE_BYTES = 1 << 28
"""Smaller rasters count as large as their pixels; for larger ones tiles of a window are compressed to estimate."""

MOST_SAMPLES = 16
"""How many tiles of a window are compressed to estimate."""


@dataclass(frozen=True)
class Step:
    """A block that is written.

    Attributes
    ----------
    level, row, column : int
        Which one; level 0 are the windows.
    n_done, n_blocks : int
        How many are there now, and how many there will be; blank ones are not counted.
    """

    level: int
    row: int
    column: int
    n_done: int
    n_blocks: int


Progress = Callable[[Step], object]


@dataclass(frozen=True)
class Writing:
    """How a raster is written: whether it resumes or replaces an older raster, who is told of each block, who draws."""

    resume: bool
    overwrite: bool
    progress: Progress | bool | None
    executor: Any

    def __post_init__(self) -> None:
        check_progress(self.progress)
        if not (self.executor is None or is_client(self.executor)):
            raise TypeError(f"executor must be a dask.distributed.Client or None, got {shown(self.executor)}")


def n_levels_to(size: tuple[int, int], side: int) -> int:
    """The number of levels, down to a level that fits a square."""
    n = 1
    while max(size) > side << (n - 1):
        n += 1
    return n


def level_size(size: tuple[int, int], level: int) -> tuple[int, int]:
    """The size of a level, half of the one below, rounded up."""
    return -(-size[0] >> level), -(-size[1] >> level)


@dataclass(frozen=True)
class TileStore(ABC):
    """Where the tiles of a raster go, and how a format encodes them."""

    folder: Folder
    size: tuple[int, int]  # (width, height) of level 0, pixels
    window: tuple[int, int]  # of a block
    tile: tuple[int, int]  # of a tile
    channels: tuple[int, ...]
    dtype: np.dtype[Any]  # as stored
    empty: Any  # the value of pixels without a triangle
    n_levels: int

    #: Whether tiles of the border are filled up to the size of others.
    is_filled: ClassVar[bool] = True

    @abstractmethod
    def name(self, level: int, row: int, column: int) -> str:
        """The name of a tile, by its row and column among tiles."""

    @abstractmethod
    def encoded(self, pixels: Array) -> bytes:
        """Return a tile as it is stored."""

    @abstractmethod
    def decoded(self, content: bytes) -> Array:
        """Return the pixels of a tile."""

    def n_tiles(self, level: int) -> tuple[int, int]:
        """Columns and rows of tiles of a level."""
        width, height = level_size(self.size, level)
        return -(-width // self.tile[0]), -(-height // self.tile[1])

    def n_tiles_of_block(self) -> tuple[int, int]:
        """Columns and rows of tiles of a block, as if it did not end with the level."""
        return -(-self.window[0] // self.tile[0]), -(-self.window[1] // self.tile[1])

    def tiles_of(self, level: int, row: int, column: int) -> list[tuple[int, int]]:
        """Rows and columns of the tiles of a block that lie in the level."""
        (n_columns, n_rows), (columns, rows) = self.n_tiles_of_block(), self.n_tiles(level)
        row_range = range(row * n_rows, min((row + 1) * n_rows, rows))
        return [(r, c) for r in row_range for c in range(column * n_columns, min((column + 1) * n_columns, columns))]

    def shape_of(self, level: int, row: int, column: int) -> tuple[int, ...]:
        """The shape of a block."""
        (w, h), (width, height) = self.window, level_size(self.size, level)
        return (min(h, height - row * h), min(w, width - column * w), *self.channels)

    def missing(self, level: int, row: int, column: int) -> str | None:
        """The name of a tile of a block that is not there; None if all are."""
        names = (self.name(level, r, c) for r, c in self.tiles_of(level, row, column))
        return next((name for name in names if not self.folder.has(name)), None)

    def is_whole(self, level: int, row: int, column: int) -> bool:
        """Whether all tiles of a block are there; on a disk also whether they can be read."""
        if self.missing(level, row, column) is not None:
            return False
        try:
            if self.folder.is_on_disk:
                self.read(level, row, column)
        except OSError:
            return False
        return True

    def write(self, level: int, row: int, column: int, pixels: Array) -> None:
        """Write the tiles of a block."""
        for r, c in self.tiles_of(level, row, column):
            part = pixels[self.location_of(r, c, row, column)]
            self.folder.put(self.name(level, r, c), self.encoded(self.filled(part)))

    def filled(self, part: Array) -> Array:
        """Return the pixels of a tile, as many as others have."""
        width, height = self.tile
        if not self.is_filled or part.shape[:2] == (height, width):
            return np.asarray(part, self.dtype)
        whole = np.empty((height, width, *self.channels), self.dtype)
        whole[...] = self.empty
        whole[: part.shape[0], : part.shape[1]] = part
        return whole

    def read(self, level: int, row: int, column: int) -> Array:
        """Return the pixels of a block that was written."""
        pixels = np.empty(self.shape_of(level, row, column), self.dtype)
        for r, c in self.tiles_of(level, row, column):
            part = pixels[self.location_of(r, c, row, column)]
            height, width = self.tile[::-1] if self.is_filled else part.shape[:2]
            name = self.name(level, r, c)
            content = self.content(name)
            try:
                tile = self.decoded(content)
                if tile.shape != (height, width, *self.channels):
                    raise ValueError(f"it holds pixels of shape {tile.shape}")
            except DAMAGES as error:
                raise OSError(f"{self.folder.place(name)} is damaged ({error}): resume=True writes it again") from error
            part[...] = tile[: part.shape[0], : part.shape[1]]
        return pixels

    def content(self, name: str) -> bytes:
        """Return a tile as it is stored."""
        content = self.folder.get(name)
        if content is None:
            raise self.gone(name)
        return content

    def gone(self, name: str) -> FileNotFoundError:
        """The error of a tile that has been removed."""
        place = self.folder.place(name)
        return FileNotFoundError(f"{place} has gone while the raster was written: resume=True writes it again")

    def location_of(self, r: int, c: int, row: int, column: int) -> tuple[slice, slice]:
        """Where a tile lies in its block."""
        (w, h), (width, height) = self.window, self.tile
        y, x = r * height - row * h, c * width - column * w
        return slice(y, y + height), slice(x, x + width)


def begin(
    raster: WindowedRaster,
    store: TileStore,
    there: list[tuple[object, str | None]],
    fingerprint: str,
    writing: Writing,
    *,
    n_copies: int = 1,
    prepare: Callable[[Array], Array] = np.asarray,
) -> bool:
    """Resume the raster that is there, or make room for a new raster; return whether it resumes.

    `there`: files and folders at the place of the raster, and their fingerprints, None if topleft did not write them.
    `n_copies`: of all tiles, on the disk at a time. `prepare` converts the pixels of a window to those of the file.
    """
    resume, overwrite = writing.resume, writing.overwrite
    if resume and overwrite:
        raise ValueError("resume=True continues the store, overwrite=True replaces it: give one of them")
    for place, kept in there:
        if kept is None:
            raise FileExistsError(f"{place} was not written by topleft: move it, or write elsewhere")
    if there and not (resume or overwrite):
        raise FileExistsError(
            f"{there[0][0]} exists: resume=True goes on with it, if it is of this raster; overwrite=True replaces it; "
            "else remove it"
        )
    if resume and there and there[0][1] != fingerprint:
        raise ValueError(
            f"{there[0][0]} is not of this raster: the mesh, an option or the size of windows differs; "
            "overwrite=True replaces it, or write elsewhere"
        )
    folder = store.folder
    if resume and there:
        if folder.is_on_disk:
            folder.sweep()
        return True
    if isinstance(folder.location, Path):
        check_space(folder.location, n_copies * bytes_of(raster, store, prepare), f"a raster of {raster.shape}")
    if there:
        folder.check_own()
        folder.remove()
    return False


def bytes_of(raster: WindowedRaster, store: TileStore, prepare: Callable[[Array], Array]) -> int:
    """The most bytes of a raster on disk; of a large raster the fullest window gives the rate of compression."""
    counts = raster.index.counts
    w, h = raster.window_size
    n = int((counts > 0).sum()) * w * h * store.dtype.itemsize * int(np.prod(store.channels, dtype=int))
    if n > LARGE_BYTES:
        row, column = map(int, np.unravel_index(int(np.argmax(counts)), counts.shape))
        places = [store.location_of(r, c, row, column) for r, c in store.tiles_of(0, row, column)[:MOST_SAMPLES]]
        pixels = prepare(raster.draw_window(row, column))
        tiles = [store.filled(pixels[place]) for place in places]
        share = sum(len(store.encoded(tile)) for tile in tiles) / sum(tile.nbytes for tile in tiles)
        n = int(n * min(1.0, 1.25 * share))
    return n + (n // 3 if store.n_levels > 1 else 0)
