"""Writes all windows of a raster, and levels of half the size, each window once.

Input: a raster, and a store for its blocks of pixels. Output: the chunks. A block is a window at level 0,
and as many pixels at the coarser levels; those are made of the blocks below them, as they were written. The chunks
themselves show which blocks are there, so a run that was killed goes on where it stopped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._apps.tiles.store import Step, TileStore, Writing
from topleft._core.base.array_types import Array
from topleft.annex.windows import WindowedRaster
from topleft.errors import MissingPackageError

Submit = Callable[[int, int, int], "Future[None]"]
"""Begins to make a block of a level, by its row and column."""


@dataclass(frozen=True)
class Written:
    """The numbers of windows that were drawn, kept and left blank.

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


def halved(pixels: Array, nodata: float | None, *, is_mean: bool) -> Array:
    """Return pixels of half the size: the mean of four pixels, except pixels without data; or the upper left pixel.

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


def blocks_with_pixels(raster: WindowedRaster, n_levels: int) -> list[npt.NDArray[np.bool_]]:
    """Return a mask (rows, columns) for each level: the blocks that hold more than background, to be written."""
    there = [raster.index.counts > 0]
    for _ in range(1, n_levels):
        below = there[-1]
        even = np.pad(below, [(0, below.shape[0] % 2), (0, below.shape[1] % 2)])
        quads = even.reshape(even.shape[0] // 2, 2, even.shape[1] // 2, 2)
        there.append(np.asarray(quads.any(axis=(1, 3))))
    return there


def write_levels(
    raster: WindowedRaster,
    store: TileStore,
    writing: Writing,
    *,
    halve: Callable[[Array], Array] | None = None,
    prepare: Callable[[Array], Array] | None = None,
) -> Written:
    """Write all blocks that are not there yet, level by level.

    `halve` makes the level above, instead of `halved`; `prepare` converts the pixels of a window to those of the file.
    The workers of an executor draw and write the windows; this process makes the levels of them.
    """
    there = blocks_with_pixels(raster, store.n_levels)
    n_blocks = int(sum(level.sum() for level in there))
    bar = _bar(n_blocks) if writing.progress is True else None
    n_done = n_drawn = n_kept = 0

    def make(level: int, row: int, column: int) -> None:
        if level == 0:
            pixels = raster.draw_window(row, column, threads=1 if n_threads > 1 else None)
            store.write(0, row, column, pixels if prepare is None else prepare(pixels))
            return
        below = together(level - 1, row, column)
        small = halved(below, raster.painter.nodata, is_mean=raster.has_means) if halve is None else halve(below)
        store.write(level, row, column, small)

    def together(level: int, row: int, column: int) -> Array:
        """The four blocks of a level that lie below a block of the next level."""
        rows = range(2 * row, min(2 * row + 2, there[level].shape[0]))
        columns = range(2 * column, min(2 * column + 2, there[level].shape[1]))
        height = sum(store.shape_of(level, r, columns[0])[0] for r in rows)
        width = sum(store.shape_of(level, rows[0], c)[1] for c in columns)
        pixels = np.empty((height, width, *store.channels), store.dtype)
        pixels[...] = store.empty
        w, h = raster.window_size
        for r in rows:
            for c in columns:
                if there[level][r, c]:
                    y, x = (r - rows[0]) * h, (c - columns[0]) * w
                    block = store.read(level, r, c)
                    pixels[y : y + block.shape[0], x : x + block.shape[1]] = block
        return pixels

    n_threads = raster.n_threads
    try:
        with ThreadPoolExecutor(n_threads, thread_name_prefix="topleft-tiles") as pool:
            begin: Callable[..., Future[None]] = pool.submit
            for level, blocks in enumerate(there):
                listed = [(level, row, column) for row, column in np.argwhere(blocks).tolist()]
                kept: set[tuple[int, int, int]] = set()
                for _ in _in_turn(partial(begin, note_whole, store, kept), iter(listed), n_threads):
                    pass
                waiting = [block for block in listed if block not in kept]
                n_kept, n_done = n_kept + len(kept) * (level == 0), n_done + len(kept)
                if bar is not None:
                    bar.update(n_done - bar.n)
                submit: Submit
                submit, n_most = partial(begin, make), n_threads
                if writing.executor is not None and level == 0:
                    submit, n_most = _submitter(writing.executor, raster, store, prepare)
                for done in _in_turn(submit, iter(waiting), n_most):
                    n_drawn, n_done = n_drawn + (level == 0), n_done + 1
                    if bar is not None:
                        bar.update()
                    elif callable(writing.progress):
                        writing.progress(Step(*done, n_done, n_blocks))
        check_whole(store, there)
    finally:
        if bar is not None:
            bar.close()
    return Written(n_drawn, n_kept, int(there[0].size - there[0].sum()))


def note_whole(store: TileStore, kept: set[tuple[int, int, int]], level: int, row: int, column: int) -> None:
    """Add a block that is there and whole to others."""
    if store.is_whole(level, row, column):
        kept.add((level, row, column))


def check_whole(store: TileStore, there: list[npt.NDArray[np.bool_]]) -> None:
    """Raise an error if a tile that was written to a disk is not there any more."""
    if not store.folder.is_on_disk:
        return
    for level, blocks in enumerate(there):
        for row, column in np.argwhere(blocks).tolist():
            name = store.missing(level, row, column)
            if name is not None:
                raise store.gone(name)


def _submitter(
    client: Any, raster: WindowedRaster, store: TileStore, prepare: Callable[[Array], Array] | None
) -> tuple[Submit, int]:
    """A function that submits a window to workers of a cluster, and how many it takes at a time."""
    from topleft._apps.tiles.cluster import ClusterWriters, WriteJob
    from topleft._apps.tiles.dask_array import WindowJob

    seen, writers = replace(store, folder=store.folder.absolute()), ClusterWriters(client)

    def submit(_: int, row: int, column: int) -> Future[None]:
        return writers.submit(WriteJob(seen, WindowJob(raster, row, column), row, column, prepare))

    return submit, writers.n_most


def _in_turn(submit: Submit, blocks: Iterator[tuple[int, int, int]], n_most: int) -> Iterator[tuple[int, int, int]]:
    """Make blocks, so many at a time; yield each when it is there."""
    running: dict[Future[None], tuple[int, int, int]] = {}
    try:
        while True:
            while len(running) < n_most and (block := next(blocks, None)) is not None:
                running[submit(*block)] = block
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                block = running.pop(future)
                future.result()
                yield block
    finally:
        for future in running:
            future.cancel()
        wait(running)


def _bar(n_blocks: int) -> Any:
    """A bar with rate and remaining time."""
    try:
        from tqdm import tqdm
    except ImportError:
        raise MissingPackageError("progress=True needs the package tqdm: pip install tqdm") from None
    return tqdm(total=n_blocks, unit=" windows")
