"""Writes all windows of a raster, and levels of half the size, each window once.

Input: a raster, and a layout: how a block of pixels becomes chunks. Output: the chunks. A block is a window at level 0,
and as many pixels at the coarser levels; those are made of the blocks below them, as they were written. Which blocks
are there is read off the chunks themselves, so a run that was killed goes on where it stopped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from topleft._core.base.arrays import check_progress, shown
from topleft._core.base.cluster import is_client
from topleft.errors import MissingPackageError

if TYPE_CHECKING:
    from topleft._apps.tiles.tiles import Tiles

__all__ = ["Layout", "Progress", "Step", "Written", "check_executor", "halved", "n_levels_to", "write_levels"]

Array = npt.NDArray[Any]


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
class Written:
    """What writing a raster did.

    Attributes
    ----------
    n_drawn : int
        Windows that were drawn.
    n_kept : int
        Windows that an earlier run had written.
    n_blank : int
        Windows without triangles, which are not drawn.
    """

    n_drawn: int
    n_kept: int
    n_blank: int


class Layout(Protocol):
    """How blocks of pixels become chunks of a format."""

    @property
    def n_levels(self) -> int:
        """How many resolutions there are."""

    def seen_from_elsewhere(self) -> Layout:
        """The same layout for processes that run in other folders."""

    def is_there(self, level: int, row: int, column: int) -> bool:
        """Whether all chunks of a block are there."""

    def write(self, level: int, row: int, column: int, pixels: Array) -> None:
        """Write the chunks of a block."""

    def read(self, level: int, row: int, column: int, shape: tuple[int, ...]) -> Array:
        """Return the pixels of a block that is there."""


def n_levels_to(size: tuple[int, int], side: int) -> int:
    """How many levels there are down to one that fits a square."""
    n = 1
    while max(size) > side << (n - 1):
        n += 1
    return n


def level_size(size: tuple[int, int], level: int) -> tuple[int, int]:
    """The size of a level, half of the one below, rounded up."""
    return -(-size[0] >> level), -(-size[1] >> level)


def halved(pixels: Array, nodata: float | None, *, is_mean: bool) -> Array:
    """Return pixels of half the size: the mean of four, those without data left out, or the upper left of them.

    A last row or column without a partner counts twice.
    """
    if not is_mean:
        return np.ascontiguousarray(pixels[::2, ::2])
    height, width = pixels.shape[:2]
    pads = [(0, height % 2), (0, width % 2)] + [(0, 0)] * (pixels.ndim - 2)
    even = np.pad(pixels, pads, "edge") if height % 2 or width % 2 else pixels
    quads = [even[y::2, x::2] for y in (0, 1) for x in (0, 1)]
    if pixels.dtype.kind in "iub":
        total = np.sum(quads, axis=0, dtype=np.int64)
        return ((total + 2) >> 2).astype(pixels.dtype)
    wide = [quad.astype(np.float64) for quad in quads]
    if nodata is None:
        return (((wide[0] + wide[1]) + (wide[2] + wide[3])) / 4).astype(pixels.dtype)
    empty = np.float64(pixels.dtype.type(nodata))
    is_there = [~np.isnan(quad) if np.isnan(empty) else quad != empty for quad in wide]
    n = np.sum(is_there, axis=0)
    parts = [np.where(has, quad, 0.0) for has, quad in zip(is_there, wide, strict=True)]
    total = (parts[0] + parts[1]) + (parts[2] + parts[3])
    return np.where(n > 0, total / np.maximum(n, 1), empty).astype(pixels.dtype)


def write_levels(
    raster: Tiles,
    layout: Layout,
    *,
    dtype: Any,
    blank: Any,
    halve: Callable[[Array], Array],
    prepare: Callable[[Array], Array] | None = None,
    progress: Progress | bool | None = None,
    executor: Any = None,
) -> Written:
    """Write all blocks that are not there yet, level by level.

    Parameters
    ----------
    dtype, blank
        Of the pixels as they are written, and what stands where no triangle is.
    halve : function of an array
        Makes the level above.
    prepare : function of an array, optional
        Makes what is written of the pixels of a window.
    executor : dask.distributed.Client, optional
        Whose workers draw and write the windows; levels are made of these here.
    """
    there: list[npt.NDArray[Any]] = [raster.index.counts > 0]  # which blocks hold more than background
    for _ in range(1, layout.n_levels):
        below = there[-1]
        even = np.pad(below, [(0, below.shape[0] % 2), (0, below.shape[1] % 2)])
        quads = even.reshape(even.shape[0] // 2, 2, even.shape[1] // 2, 2)
        there.append(np.asarray(quads.any(axis=(1, 3))))
    n_blocks = int(sum(level.sum() for level in there))
    channels = () if prepare is None else prepare(raster.painter.blank((1, 1))).shape[2:]
    channels = channels or (raster.painter.channels if prepare is None else ())
    check_progress(progress)
    bar = _bar(n_blocks) if progress is True else None
    tell = bar.tell if bar is not None else progress if callable(progress) else None
    n_done = n_drawn = n_kept = 0

    def shape_of(level: int, row: int, column: int) -> tuple[int, ...]:
        (w, h), (width, height) = raster.window_size, level_size(raster.size, level)
        return (min(h, height - row * h), min(w, width - column * w), *channels)

    def make(level: int, row: int, column: int) -> None:
        if level == 0:
            pixels = raster.draw_window(row, column, threads=1 if n_threads > 1 else None)
            layout.write(0, row, column, pixels if prepare is None else prepare(pixels))
            return
        layout.write(level, row, column, halve(together(level - 1, row, column)))

    def together(level: int, row: int, column: int) -> Array:
        """The four blocks of a level that lie below one of the next."""
        rows = range(2 * row, min(2 * row + 2, there[level].shape[0]))
        columns = range(2 * column, min(2 * column + 2, there[level].shape[1]))
        height = sum(shape_of(level, r, columns[0])[0] for r in rows)
        width = sum(shape_of(level, rows[0], c)[1] for c in columns)
        pixels = np.empty((height, width, *channels), dtype)
        pixels[...] = blank
        w, h = raster.window_size
        for r in rows:
            for c in columns:
                if there[level][r, c]:
                    y, x = (r - rows[0]) * h, (c - columns[0]) * w
                    shape = shape_of(level, r, c)
                    pixels[y : y + shape[0], x : x + shape[1]] = layout.read(level, r, c, shape)
        return pixels

    n_threads = raster.n_threads
    try:
        with ThreadPoolExecutor(n_threads, thread_name_prefix="topleft-tiles") as pool:
            for level, blocks in enumerate(there):
                waiting: list[tuple[int, int, int]] = []
                for row, column in np.argwhere(blocks).tolist():
                    if layout.is_there(level, row, column):
                        n_kept, n_done = n_kept + (level == 0), n_done + 1
                    else:
                        waiting.append((level, row, column))
                if bar is not None:
                    bar.begin(n_done)
                for done in (
                    _in_turn(pool, make, iter(waiting), n_threads)
                    if executor is None or level
                    else _on_workers(executor, raster, layout, prepare, iter(waiting))
                ):
                    n_drawn, n_done = n_drawn + (level == 0), n_done + 1
                    if tell is not None:
                        tell(Step(*done, n_done, n_blocks))
    finally:
        if bar is not None:
            bar.close()
    return Written(n_drawn, n_kept, int(there[0].size - there[0].sum()))


def check_executor(executor: Any) -> None:
    """Raise an error for what is no client of Dask."""
    if not (executor is None or is_client(executor)):
        raise TypeError(f"executor must be a dask.distributed.Client or None, got {shown(executor)}")


def _on_workers(
    client: Any,
    raster: Tiles,
    layout: Layout,
    prepare: Callable[[Array], Array] | None,
    blocks: Iterator[tuple[int, int, int]],
) -> Iterator[tuple[int, int, int]]:
    """Let workers of a cluster draw and write windows; yield each when it is there."""
    from topleft._apps.tiles.cluster import WriteJob, write_on_cluster
    from topleft._apps.tiles.dask_array import WindowJob

    seen = layout.seen_from_elsewhere()

    def make(block: tuple[int, int, int]) -> WriteJob:
        _, row, column = block
        return WriteJob(seen, WindowJob(raster, row, column), row, column, prepare)

    return write_on_cluster(client, make, blocks)


def _in_turn(
    pool: ThreadPoolExecutor,
    make: Callable[[int, int, int], None],
    blocks: Iterator[tuple[int, int, int]],
    n_threads: int,
) -> Iterator[tuple[int, int, int]]:
    """Make blocks, so many at a time as there are threads; yield each when it is there."""
    running: dict[Future[None], tuple[int, int, int]] = {}
    try:
        while True:
            while len(running) < n_threads and (block := next(blocks, None)) is not None:
                running[pool.submit(make, *block)] = block
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                block = running.pop(future)
                future.result()
                yield block
    finally:
        wait(running)


class _LevelBar:
    """A bar with rate and remaining time."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar

    def begin(self, n_done: int) -> None:
        """Count what an earlier run has done."""
        self._bar.update(n_done - self._bar.n)

    def tell(self, step: Step) -> None:
        """Go on by one."""
        self._bar.update(step.n_done - self._bar.n)

    def close(self) -> None:
        """Leave it on the screen as it is."""
        self._bar.close()


def _bar(n_blocks: int) -> _LevelBar:
    try:
        from tqdm import tqdm
    except ImportError:
        raise MissingPackageError("progress=True needs the package tqdm: pip install 'topleft[render]'") from None
    return _LevelBar(tqdm(total=n_blocks, unit=" windows"))
