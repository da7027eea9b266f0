"""Lerp scanline in Python, with float32 where the lesson has it.

In: vertices, truncated to pixels.  Out: counts.  Source: see lerp_scanline.h.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft.methods.twins._picture import Pixel, corners_of, new_picture, to_pixels


def lerp(a: int, b: int, i: int, height: int) -> int:
    """Return where an edge is, `i` of `height` rows below its upper end."""
    return a + int(np.float32(b - a) * (np.float32(i) / np.float32(height)))


def overdraw(vertices: Any, triangles: Any, size: Pixel, variant: str = "") -> NDArray[np.int32]:
    """Return how often each pixel is drawn: int32, shape (H, W)."""
    counts, span = new_picture(size)
    extra = 1 if variant == "plus-one" else 0
    for corners in corners_of(vertices, triangles):
        a, b, c = to_pixels(corners)
        if a[1] > b[1]:
            a, b = b, a
        if a[1] > c[1]:
            a, c = c, a
        if b[1] > c[1]:
            b, c = c, b
        if a[1] == c[1]:
            continue
        # The middle row: drawn by both halves, or by the upper half unless that has no height.
        if variant == "plus-one":
            upper, lower = range(a[1], b[1] + 1), range(b[1], c[1] + 1)
        elif a[1] == b[1]:
            upper, lower = range(0), range(b[1], c[1])
        else:
            upper, lower = range(a[1], min(b[1] + 1, c[1])), range(b[1] + 1, c[1])
        for top, bottom, rows in ((a, b, upper), (b, c, lower)):
            for y in rows:
                long_x = lerp(a[0], c[0], y - a[1], c[1] - a[1])
                short_x = lerp(top[0], bottom[0], y - top[1], bottom[1] - top[1] + extra)
                span(y, min(long_x, short_x), max(long_x, short_x))
    return counts
