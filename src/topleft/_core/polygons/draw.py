"""Masks, labels and shares of snapped polygons, in bands of rows.

In: `Prepared` polygons. Out: pixels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.memory import SCRATCH
from topleft._core.base.threads import run_parts
from topleft._core.polygons.prepared import Prepared

#: Bytes of labels of a band of rows, which is drawn in the L2 cache.
BAND_BYTES = 1 << 20

#: Pixels a polygon, from its box. Below, the order of the bands itself misses the caches, and spans are buffered
#: instead: 200,000 cells of 84 px in random order, 20,000 of 800 px.
MIN_PIXELS_FOR_BANDS = 600

#: The most bits and cells in memory: more rows are drawn in several passes over the edges.
MAX_BITS = 1 << 30
MAX_CELLS = 1 << 24
MAX_LISTED_CROSSINGS = 1 << 22

TESTS = {"center": 0, "outer": 1, "inner": 2}  # tl_polygon_test in csrc/polygons/polygons.h


def draw_mask(
    prepared: Prepared, out: npt.NDArray[np.uint8], *, polygon: int = 0, rows: tuple[int, int] | None = None
) -> None:
    """Write the mask of a polygon, or rows of it, over contiguous (H, W) bytes."""
    compiled, (width, height) = prepared.compiled, prepared.frame.size
    begin, stop = (0, height) if rows is None else rows
    height = stop - begin
    stride = engine.polygon_stride(width)
    n_threads = prepared.n_threads
    if compiled.is_nonzero(polygon):
        n_listed = max(prepared.most_edges, min(MAX_LISTED_CROSSINGS, prepared.most_edges * height)) + 1

        def draw_rows(top: int, bottom: int) -> None:
            at = np.empty(bottom - top + 1, np.uint32)
            room = np.empty(n_listed, np.int32), np.zeros(stride, np.int32), np.empty(stride // 64, np.uint64)
            compiled.mask_nonzero(polygon, out, begin + top, begin + bottom, at, *room)

        run_parts(draw_rows, height, n_threads)
        return
    words = stride // 32
    rows_at_once = max(1, min(height, MAX_BITS // stride))
    bits = SCRATCH.constant("polygon bits", words * rows_at_once, 0)
    for first in range(begin, stop, rows_at_once):
        n_rows = min(rows_at_once, stop - first)

        def draw_bits(top: int, bottom: int, first: int = first) -> None:
            compiled.mask_even_odd(polygon, out, first + top, first + bottom, bits[words * top : words * bottom])

        run_parts(draw_bits, n_rows, n_threads)


def sort_bands(prepared: Prepared, band_rows: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Return where the list of each band of rows begins, and the polygons of all bands."""
    height = prepared.frame.size[1]
    n_bands = -(-height // band_rows)
    starts = np.empty(n_bands + 2, np.int64)
    prepared.compiled.sort(band_rows, n_bands, starts, None)
    listed: npt.NDArray[np.int32] = SCRATCH.scratch("bands", (int(starts[-1]) + 1,), np.int32)
    prepared.compiled.sort(band_rows, n_bands, starts, listed)
    return starts, listed


def draw_labels(
    prepared: Prepared,
    pixels: npt.NDArray[Any],
    values: npt.NDArray[np.int32] | None,
    background: int,
    sampling: str = "center",
) -> None:
    """Write the values of polygons, or their numbers, over contiguous (H, W) pixels of 1 or 4 bytes."""
    compiled, (width, height) = prepared.compiled, prepared.frame.size
    n_bytes = pixels.itemsize
    n_threads = prepared.n_threads if sampling == "center" else prepared.threads_with_pieces()
    flat = engine.as_bytes(pixels)
    boxes = compiled.boxes_px
    sides = boxes[:, 2:].astype(np.int64) - boxes[:, :2]
    n_covered = int((sides[:, 0] * sides[:, 1]).sum())
    is_banded = n_covered > MIN_PIXELS_FOR_BANDS * len(prepared) or sampling != "center"
    band_rows = max(16, BAND_BYTES // (n_bytes * width))
    if not is_banded:
        band_rows = -(-height // n_threads)
    elif height < 2 * n_threads * band_rows:
        band_rows = max(1, -(-height // (2 * n_threads)))
    n_bands = -(-height // band_rows)
    starts, listed = sort_bands(prepared, band_rows) if n_bands > 1 else (None, None)

    def draw_part(first: int, end: int) -> None:
        cells = np.zeros(engine.CELL_ROWS * engine.polygon_stride(width), np.int32)
        scratch = np.empty(engine.LABEL_SCRATCH_BYTES, np.uint8)
        pieces = None if sampling == "center" else prepared.piece_scratch()
        how = n_bytes, values, background, TESTS[sampling], not is_banded, band_rows
        compiled.label(flat, *how, starts, listed, first, end, cells, scratch, pieces)

    run_parts(draw_part, n_bands, n_threads)


def add_shares(prepared: Prepared, pixels: npt.NDArray[np.float32], colors: npt.NDArray[np.float32] | None) -> None:
    """Write the shares of polygons, their sum up to 1, over contiguous (H, W) pixels, or blend colours (H, W, C)."""
    is_alone = colors is None and len(prepared) == 1
    if colors is None and not is_alone:
        pixels.fill(0)
    height, n_threads = prepared.frame.size[1], prepared.threads_with_pieces()
    n_bands = min(height, n_threads if len(prepared) < 64 else 4 * n_threads)
    band_rows = -(-height // n_bands)
    starts, listed = sort_bands(prepared, band_rows)
    n_cells = cells_for(prepared, band_rows)
    flat = pixels.reshape(-1)
    cells = SCRATCH.constant("cells", n_cells * n_threads, engine.CELL_CLEAR)
    parts = list(range(n_threads))

    def draw_part(first: int, end: int) -> None:
        i = parts.pop()
        cells_of_thread = cells[i * n_cells : (i + 1) * n_cells]
        how = band_rows, starts, listed, first, end
        prepared.compiled.add_shares(flat, colors, *how, cells_of_thread, prepared.piece_scratch(), is_alone)

    run_parts(draw_part, -(-height // band_rows), n_threads)


def cells_for(prepared: Prepared, n_rows: int) -> int:
    """Return how many cells the largest box needs, of up to n_rows rows, at least a row of the widest box."""
    boxes = prepared.compiled.boxes_px.astype(np.int64)
    if not len(boxes):
        return engine.LEAST_SHARE_CELLS
    width, height = boxes[:, 2] - boxes[:, 0], np.minimum(boxes[:, 3] - boxes[:, 1], n_rows)
    stride = (width + 63) // 16 * 16
    largest = int((stride * np.maximum(height, 1)).max()) + 64
    return max(min(largest, MAX_CELLS), int(stride.max()) + 64, engine.LEAST_SHARE_CELLS)
