"""The exact reference for areas: each triangle cut to each pixel square, in fractions.

In: vertices, triangles and options, as in the public calls, taken to be valid.  Out: the sum of areas in each pixel.

Based on: I. E. Sutherland, G. W. Hodgman, Reentrant Polygon Clipping, 1974.
"""

from __future__ import annotations

from fractions import Fraction
from math import ceil, floor
from typing import Any

import numpy as np

from topleft.methods.reference import Point, pieces

Polygon = list[tuple[Fraction, Fraction]]


def area(vertices: Any, triangles: Any, size: Point, *, origin: Point = (0, 0), **view: Any) -> np.ndarray:
    """Return the area that triangles cover of each pixel, their sum: Fraction, shape (H, W); options as for `pieces`.

    Examples
    --------
    >>> area([[0, 0], [2, 0], [0, 1]], [[0, 1, 2]], (2, 1)).tolist()
    [[Fraction(3, 4), Fraction(1, 4)]]
    """
    unit = 2 ** view.get("subpixel_bits", 8)
    total = np.full((size[1], size[0]), Fraction(0), object)
    for piece in pieces(vertices, triangles, size, **view):
        polygon = [
            (Fraction(x, unit) - origin[0], Fraction(y, unit) - origin[1]) for x, y in (v.xy_fx for v in piece.vertices)
        ]
        for row in _pixels(polygon, 1, size[1]):
            band = _cut(_cut(polygon, 1, row, 1), 1, row + 1, -1)
            for column in _pixels(band, 0, size[0]):
                total[row, column] += _area(_cut(_cut(band, 0, column, 1), 0, column + 1, -1))
    return total


def _pixels(polygon: Polygon, axis: int, n: int) -> range:
    """Return the pixels of [0, n) that a polygon meets along an axis."""
    if not polygon:
        return range(0)
    along = [p[axis] for p in polygon]
    return range(max(0, floor(min(along))), min(n, ceil(max(along))))


def _cut(polygon: Polygon, axis: int, limit: int, side: int) -> Polygon:
    """Return the part of a convex polygon above (side 1) or below (side -1) a limit on one axis."""
    kept: Polygon = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        da, db = (side * (p[axis] - limit) for p in (a, b))
        if da >= 0:
            kept.append(a)
        if da * db < 0:
            t = da / (da - db)
            kept.append((a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t))
    return kept


def _area(polygon: Polygon) -> Fraction:
    """Return the area of a polygon, whichever way it turns."""
    pairs = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return abs(sum((a[0] * b[1] - a[1] * b[0] for a, b in pairs), Fraction(0))) / 2
