"""Shared by the pure twins: a picture of counts, and spans that are clamped to it.

A twin is a kernel's method, written to be read: NumPy where an expression computes rows or boxes, Python elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pixel = tuple[int, int]
#: Draw the pixels of a row from the first to the last column, both included: ``span(y, first, last)``.
Span = Callable[[int, int, int], None]


def new_picture(size: Pixel) -> tuple[NDArray[np.int32], Span]:
    """Return counts of shape (H, W), and the function that draws spans into them."""
    counts = np.zeros((size[1], size[0]), np.int32)

    def span(y: int, first: int, last: int) -> None:
        if 0 <= y < size[1] and first <= last and last >= 0:
            counts[y, max(first, 0) : last + 1] += 1

    return counts, span


def corners_of(vertices: Any, triangles: Any) -> list[list[tuple[float, float]]]:
    """Return the three (x, y) of each triangle."""
    points = [(float(p[0]), float(p[1])) for p in np.asarray(vertices).tolist()]
    return [[points[i] for i in row] for row in np.asarray(triangles).tolist()]


def to_pixels(corners: list[tuple[float, float]]) -> list[Pixel]:
    """Return vertices truncated to whole pixels."""
    return [(int(x), int(y)) for x, y in corners]
