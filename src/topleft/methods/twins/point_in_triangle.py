"""Point in triangle in NumPy: the whole bounding box is three expressions, which is why Python programs like it.

In: vertices, truncated to pixels.  Out: counts.  Source: see point_in_triangle.h.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft.methods.twins._picture import Pixel, corners_of, new_picture, to_pixels


def cross(a: Pixel, b: Pixel, x: Any, y: Any) -> Any:
    """Return twice the signed area of a, b and (x, y)."""
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])


def bias(a: Pixel, b: Pixel) -> int:
    """Return 0 for a top or left edge of a triangle that turns clockwise as seen, -1 for the others."""
    return 0 if b[1] < a[1] or (b[1] == a[1] and b[0] > a[0]) else -1


def overdraw(vertices: Any, triangles: Any, size: Pixel, variant: str = "") -> NDArray[np.int32]:
    """Return how often each pixel is drawn: int32, shape (H, W)."""
    counts, _ = new_picture(size)
    for corners in corners_of(vertices, triangles):
        a, b, c = to_pixels(corners)
        if variant == "top-left" and cross(a, b, *c) < 0:
            b, c = c, b
        first_x, first_y = (max(0, min(p[k] for p in (a, b, c))) for k in range(2))
        last_x, last_y = (min(size[k] - 1, max(p[k] for p in (a, b, c))) for k in range(2))
        x = np.arange(first_x, last_x + 1)
        y = np.arange(first_y, last_y + 1)[:, None]
        w = np.stack([cross(p, q, x, y) for p, q in ((a, b), (b, c), (c, a))])
        if variant == "top-left":
            w += np.array([bias(a, b), bias(b, c), bias(c, a)])[:, None, None]
        is_inside = (w >= 0).all(axis=0)
        if not variant:
            is_inside |= (w <= 0).all(axis=0)
        counts[first_y : first_y + len(y), first_x : first_x + len(x)] += is_inside
    return counts
