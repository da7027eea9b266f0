"""Writes pyramids of Deep Zoom: tiles of PNG, down to one pixel, for viewers of large pictures.

Input: a raster, and how its numbers become colours. Output: NAME.dzi and the folder NAME_files.

Based on: Deep Zoom File Format Overview, Microsoft, 2008.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from topleft._apps.tiles.folders import DiskFolder, check_space
from topleft._apps.tiles.levels import Progress, Written, check_executor, halved, level_size, n_levels_to, write_levels
from topleft._core.base.arrays import as_count, check_progress, shown
from topleft._core.base.color import id_colors
from topleft._core.base.remote import as_place
from topleft._meshes.io.png import encode

if TYPE_CHECKING:
    from topleft._apps.tiles.tiles import Tiles

__all__ = ["write_deepzoom"]

Array = npt.NDArray[Any]
U8 = npt.NDArray[np.uint8]

FINGERPRINT = "topleft.txt"


@dataclass(frozen=True)
class DeepZoomLayout:
    """Blocks of pixels as tiles of PNG. Deep Zoom counts levels from one pixel on."""

    folder: DiskFolder
    size: tuple[int, int]
    window: tuple[int, int]
    tile: int
    channels: tuple[int, ...]
    n_levels: int

    def name(self, level: int, row: int, column: int) -> str:
        """The name of a tile, by its row and column among tiles."""
        return f"{self.n_levels - 1 - level}/{column}_{row}.png"

    def tiles_of(self, level: int, row: int, column: int) -> list[tuple[int, int]]:
        """The tiles of a block that lie in the level."""
        (w, h), (width, height), t = self.window, level_size(self.size, level), self.tile
        k_rows, k_columns = -(-h // t), -(-w // t)
        rows = range(row * k_rows, min((row + 1) * k_rows, -(-height // t)))
        columns = range(column * k_columns, min((column + 1) * k_columns, -(-width // t)))
        return [(r, c) for r in rows for c in columns]

    def seen_from_elsewhere(self) -> DeepZoomLayout:
        """The same layout for processes that run in other folders."""
        return replace(self, folder=self.folder.absolute())

    def is_there(self, level: int, row: int, column: int) -> bool:
        """Whether all tiles of a block are there."""
        return all(self.folder.has(self.name(level, r, c)) for r, c in self.tiles_of(level, row, column))

    def write(self, level: int, row: int, column: int, pixels: Array) -> None:
        """Write the tiles of a block."""
        (w, h), t = self.window, self.tile
        for r, c in self.tiles_of(level, row, column):
            y, x = r * t - row * h, c * t - column * w
            self.folder.put(self.name(level, r, c), encode(pixels[y : y + t, x : x + t]))

    def read(self, level: int, row: int, column: int, shape: tuple[int, ...]) -> Array:
        """Return the pixels of a block that is there."""
        from PIL import Image

        (w, h), t = self.window, self.tile
        pixels = np.empty(shape, np.uint8)
        for r, c in self.tiles_of(level, row, column):
            content = self.folder.get(self.name(level, r, c))
            if content is None:
                raise OSError(f"tile {self.name(level, r, c)} has gone while the raster was written")
            y, x = r * t - row * h, c * t - column * w
            with Image.open(io.BytesIO(content)) as image:
                pixels[y : y + t, x : x + t] = np.asarray(image)
        return pixels


def write_deepzoom(
    raster: Tiles,
    path: str | os.PathLike[str],
    tile: int,
    colors: Callable[[Array], U8] | None,
    resume: bool,
    progress: Progress | bool | None,
    executor: Any,
) -> Written:
    """`Tiles.to_deepzoom`."""
    check_executor(executor)
    file = as_place("path", path)
    if not isinstance(file, Path):
        raise ValueError(f"path must be on this machine, got {path!r}: to_zarr writes to URLs")
    if file.suffix != ".dzi":
        raise ValueError(f"path must end in .dzi, got {file.name!r}")
    side, window = as_count("tile", tile), raster.window_size
    if side & (side - 1):
        raise ValueError(f"tile must be a power of 2, got {side}")
    if any(w % (2 * side) and w < length for w, length in zip(window, raster.size, strict=True)):
        raise ValueError(f"window must have sides of whole pairs of tiles, of {2 * side} pixels, got {window}")
    if not (raster.size[0] and raster.size[1]):
        raise ValueError(f"Deep Zoom has pixels, got a raster of {raster.size[0]} x {raster.size[1]}")
    if not (colors is None or callable(colors)):
        raise TypeError(f"colors must be a function of an array, got {shown(colors)}")
    check_progress(progress)
    paint = painting(raster) if colors is None else colors
    ground = checked(paint(raster.painter.blank((1, 1))), (1, 1))
    n_levels = n_levels_to(raster.size, 1)
    folder = DiskFolder(file.with_name(f"{file.stem}_files"))
    layout = DeepZoomLayout(folder, raster.size, window, side, ground.shape[2:], n_levels)
    begin(raster, layout, f"{raster.fingerprint} deepzoom 2 {side} {ground.tolist()}", file, resume)
    written = write_levels(
        raster,
        layout,
        dtype=np.uint8,
        blank=ground[0, 0],
        halve=halved_colors,
        prepare=lambda pixels: checked(paint(pixels), pixels.shape[:2]),
        progress=progress,
        executor=executor,
    )
    fill_blanks(layout, ground)
    width, height = raster.size
    description = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<Image xmlns="http://schemas.microsoft.com/deepzoom/2008" '
        f'Format="png" Overlap="0" TileSize="{side}"><Size Width="{width}" Height="{height}"/></Image>\n'
    )
    DiskFolder(file.parent).put(file.name, description.encode())
    return written


def begin(raster: Tiles, layout: DeepZoomLayout, fingerprint: str, file: Path, resume: bool) -> None:
    """Make the folder, or take the one that an earlier run of the same raster has left."""
    folder = layout.folder
    found = folder.get(FINGERPRINT)
    if found is not None and resume:
        if found.decode(errors="replace") != fingerprint:
            raise ValueError(
                f"{folder.path} is not of this raster: the mesh, an option or the size of windows differs; "
                "write elsewhere"
            )
        folder.sweep()
        return
    if folder.exists() or file.exists():
        what = file if file.exists() else folder.path
        raise FileExistsError(f"{what} exists: resume=True goes on with it, if it is of this raster; else remove it")
    w, h = raster.window_size
    n = int((raster.index.counts > 0).sum()) * w * h * int(np.prod(layout.channels, dtype=int))
    check_space(file.absolute().parent, n // 4, f"a raster of {raster.shape}")  # rendered pictures shrink to less
    folder.put(FINGERPRINT, fingerprint.encode())


def fill_blanks(layout: DeepZoomLayout, ground: U8) -> None:
    """Write the tiles that no triangle touches: viewers ask for all."""
    contents: dict[tuple[int, int], bytes] = {}
    t = layout.tile
    for level in range(layout.n_levels):
        width, height = level_size(layout.size, level)
        for r in range(-(-height // t)):
            for c in range(-(-width // t)):
                name = layout.name(level, r, c)
                if layout.folder.has(name):
                    continue
                size = min(t, height - r * t), min(t, width - c * t)
                if size not in contents:
                    contents[size] = encode(np.broadcast_to(ground[0, 0], (*size, *ground.shape[2:])))
                layout.folder.put(name, contents[size])


def painting(raster: Tiles) -> Callable[[Array], U8]:
    """How the pixels of a kind become colours.

    Raises
    ------
    ValueError
        If there is no way that goes without saying.
    """
    if raster.kind == "labels":
        return label_colors
    if raster.dtype == bool:
        return lambda mask: mask.view(np.uint8) * np.uint8(255)
    if raster.kind == "coverage":
        return lambda share: np.rint(share * np.float32(255)).astype(np.uint8)
    if raster.kind == "overdraw":
        return lambda counts: np.rint(np.minimum(counts, 255)).astype(np.uint8)
    if raster.kind in ("depth", "field", "height_map"):
        low, high = raster.range_of_values
        return lambda values: greys(values, raster.painter.empty, low, high)
    if raster.dtype == np.uint8 and raster.shape[2:] in ((), (2,), (3,), (4,)):
        return lambda pixels: pixels
    raise ValueError(f"colors must say how {raster.dtype} of kind {raster.kind!r} becomes uint8")


def greys(values: Array, empty: Any, low: float, high: float) -> U8:
    """Greys (H, W, 2) from black at the lowest value to white at the highest, transparent where there is none."""
    is_there = ~np.isnan(values) if values.dtype.kind == "f" and np.isnan(empty) else values != empty
    numbers = np.where(is_there, values, low).astype(np.float64)
    shade = (numbers - low) * (255 / (high - low)) if high > low else np.full(values.shape, 128.0)
    return np.stack([np.rint(shade.clip(0, 255)) * is_there, is_there * 255], axis=-1).astype(np.uint8)


def halved_colors(pixels: U8) -> U8:
    """Return colours of half the size: the mean of four, as much of each as it is opaque."""
    if pixels.shape[2:] not in ((2,), (4,)):
        return halved(pixels, None, is_mean=True)
    height, width = pixels.shape[:2]
    even = np.pad(pixels, [(0, height % 2), (0, width % 2), (0, 0)], "edge").astype(np.uint32)
    even[..., :-1] *= even[..., -1:]
    total = even[::2, ::2] + even[::2, 1::2] + even[1::2, ::2] + even[1::2, 1::2]
    alpha = np.maximum(total[..., -1:], 1)
    return np.concatenate([(total[..., :-1] + alpha // 2) // alpha, (total[..., -1:] + 2) >> 2], axis=-1).astype(
        np.uint8
    )


def label_colors(labels: Array) -> U8:
    """A colour (H, W, 4) for each label, transparent for nothing."""
    names, at = np.unique(labels, return_inverse=True)
    palette = np.zeros((len(names), 4), np.uint8)
    palette[:, :3] = id_colors(names)
    palette[:, 3] = 255
    palette[names < 0] = 0
    return palette[at.reshape(labels.shape)]


def checked(pixels: Any, size: tuple[int, ...]) -> U8:
    """Return what a function has made of pixels, if it is a picture."""
    array = np.asarray(pixels)
    if array.dtype != np.uint8 or array.shape[:2] != size or array.shape[2:] not in ((), (1,), (2,), (3,), (4,)):
        raise ValueError(f"colors must give uint8 {(*size, 3)}, say, got {array.dtype} {array.shape}")
    return array[..., 0] if array.shape[2:] == (1,) else array
