"""Row crossing in NumPy: all rows of a triangle ask an edge at once.

In: vertices, truncated to pixels.  Out: counts.  Source: see row_crossing.h.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft.methods.twins._picture import Pixel, corners_of, new_picture, to_pixels


def crossings(a: Pixel, b: Pixel, y: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the pixel at which an edge crosses each row: float32, NaN where it does not."""
    if a[1] == b[1]:
        return np.full(y.shape, np.nan, np.float32)
    dx, dy = np.float32(b[0] - a[0]), np.float32(b[1] - a[1])
    x = np.floor(np.float32(a[0]) + (y - a[1]).astype(np.float32) * dx / dy + np.float32(0.5))
    return np.where((y < min(a[1], b[1])) | (y > max(a[1], b[1])), np.float32(np.nan), x)


def overdraw(vertices: Any, triangles: Any, size: Pixel, variant: str = "") -> NDArray[np.int32]:
    """Return how often each pixel is drawn: int32, shape (H, W)."""
    counts, span = new_picture(size)
    for corners in corners_of(vertices, triangles):
        a, b, c = to_pixels(corners)
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        is_left_out = {
            "": False, "zero-area-test": area == 0, "cull-back": area >= 0, "cull-front": area <= 0
        }[variant]  # fmt: skip
        if is_left_out or a[1] == b[1] == c[1]:
            continue
        y = np.arange(min(a[1], b[1], c[1]), max(a[1], b[1], c[1]) + 1)
        x = np.stack([crossings(a, b, y), crossings(b, c, y), crossings(c, a, y)])
        for row, first, last in zip(y.tolist(), np.nanmin(x, axis=0), np.nanmax(x, axis=0), strict=True):
            span(row, int(first), int(last))
    return counts
