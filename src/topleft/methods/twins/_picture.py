"""What the pure twins share: a picture of counts, spans that are clamped to it, and what a recorder is told.

A twin is its kernel's method written for reading: NumPy where whole rows or boxes are one expression, Python elsewhere.
A recorder hears of each step with the numbers that decided it; without one a twin does nothing for it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pixel = tuple[int, int]
#: Draw the pixels of a row from the first to the last column, both included: ``span(y, first, last)``.
Span = Callable[[int, int, int], None]
#: Hears what a twin does: ``record(kind, x, y, **values)``. "triangle": it is set up, (x, y) the first of its pixels;
#: "row": a row begins; "line": a line passes a pixel; "test": a pixel is asked, ``is_drawn`` when it is drawn at once;
#: "box": the same of all pixels of a box from (x, y) on, as arrays; "span": x to ``last`` of row y are drawn.
Record = Callable[..., None]


def new_picture(size: Pixel, record: Record | None = None) -> tuple[NDArray[np.int32], Span]:
    """Return counts of shape (H, W), and what draws into them."""
    counts = np.zeros((size[1], size[0]), np.int32)

    def span(y: int, first: int, last: int) -> None:
        if 0 <= y < size[1] and first <= last and last >= 0:
            counts[y, max(first, 0) : last + 1] += 1
            if record and first < size[0]:
                record("span", max(first, 0), y, last=min(last, size[0] - 1))

    return counts, span


def corners_of(vertices: Any, triangles: Any) -> list[list[tuple[float, float]]]:
    """Return the three (x, y) of each triangle."""
    points = [(float(p[0]), float(p[1])) for p in np.asarray(vertices).tolist()]
    return [[points[i] for i in row] for row in np.asarray(triangles).tolist()]


def to_pixels(corners: list[tuple[float, float]]) -> list[Pixel]:
    """Return vertices truncated to whole pixels."""
    return [(int(x), int(y)) for x, y in corners]
