"""Zigzag in Python: stepped edge functions, and a walk that turns round at the sides of the triangle.

In: vertices.  Out: counts.  Source: see zigzag.h.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft.methods.twins._picture import Pixel, corners_of, new_picture
from topleft.methods.twins.edge_increment import Edges, Triple, add, set_up


def is_behind(w: Triple, step_x: Triple, step_y: Triple | None, way: int) -> bool:
    """Return whether no later sample is covered, neither in this row nor in the next (without step_y: in this)."""
    outward = [k for k in range(3) if step_x[k] * way <= 0]
    here = any(w[k] < 0 for k in outward)
    return here and (step_y is None or any(w[k] + step_y[k] < 0 for k in outward))


def start(e: Edges, corners: list[tuple[float, float]]) -> tuple[int, Triple]:
    """Return a column below the topmost vertex from which the first row lies to the right, and the values there."""
    a, b, c = corners
    top = a if a[1] <= min(b[1], c[1]) else b if b[1] <= c[1] else c
    x = min(max(int(np.floor(top[0])), e.columns[0]), e.columns[1])
    w = add(e.value, e.step_x, x - e.columns[0])
    while x > e.columns[0] and not is_behind(w, e.step_x, None, -1):
        x, w = x - 1, add(w, e.step_x, -1)
    return x, w


def overdraw(
    vertices: Any, triangles: Any, size: Pixel, variant: str = "", *, subpixel_bits: int = 8
) -> NDArray[np.int32]:
    """Return how often each pixel is drawn: int32, shape (H, W)."""
    counts, _ = new_picture(size)
    for corners in corners_of(vertices, triangles):
        e = set_up(corners, size, variant, subpixel_bits)
        if e is None:
            continue
        x, w = start(e, corners)
        way = 1
        for y in range(e.rows[0], e.rows[1] + 1):
            while True:
                is_inside = min(w) >= 0
                counts[y, x] += is_inside
                if x == e.columns[way > 0] or is_behind(w, e.step_x, e.step_y, way):
                    break
                x, w = x + way, add(w, e.step_x, way)
            way, w = -way, add(w, e.step_y)
    return counts
