"""Exact areas: the cells between edges and pixels, and what is done when 32 bits do not hold a sum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from topleft import _engine
from topleft._base.memory import Memory
from topleft._base.threads import run_parts

__all__ = ["sum_areas"]

#: Cells that are held at a time; a larger picture is drawn in several passes over the scene.
MAX_CELLS = 1 << 28


def sum_areas(
    memory: Memory, scene: _engine.Scene, pixels: NDArray[np.float32], n_threads: int, *, is_clamped: bool
) -> bool:
    """Write the area that triangles cover of each pixel; returns whether a triangle has an index outside the vertices.

    Sums are taken in 32 bits. Rows in which these might not do are drawn again in 64 bits, with the same result
    wherever both are right.
    """
    height, width = pixels.shape
    if not pixels.size:
        return False
    stride = _engine.area_stride(width)
    rows_at_once = min(height, max(1, MAX_CELLS // stride))
    cells = memory.constant("cells", rows_at_once * stride, _engine.CELL_CLEAR)

    def draw_rows(first: int, end: int) -> int:
        own = _engine.as_bytes(cells[(first - top) * stride : (end - top) * stride])
        status = scene.draw_area(pixels, own, first, end - first, False, is_clamped)
        if status != _engine.AREA_OVERFLOW:
            return status
        wide = _engine.as_bytes(np.zeros((end - first) * stride, np.int64))
        return scene.draw_area(pixels, wide, first, end - first, True, is_clamped)

    bad_rows = []
    for top in range(0, height, rows_at_once):
        n_rows = min(rows_at_once, height - top)
        bad_rows += run_parts(lambda first, end: draw_rows(top + first, top + end), n_rows, n_threads)  # noqa: B023
    return max(bad_rows) >= 0
