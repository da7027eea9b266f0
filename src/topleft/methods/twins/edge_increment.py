"""Edge increment in Python: edge functions of whole numbers, set up once a triangle, then stepped by additions.

In: vertices.  Out: counts.  Source: see edge_increment.h.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft.methods.twins._picture import Pixel, corners_of, new_picture, to_pixels

Triple = tuple[int, int, int]


class Edges(NamedTuple):
    """The box of a triangle, first to last pixel, and its edge functions; a sample is inside where all are >= 0."""

    columns: tuple[int, int]
    rows: tuple[int, int]
    value: Triple  # at the centre of the first pixel, with the bias
    step_x: Triple  # one pixel to the right
    step_y: Triple  # one pixel down


def set_up(corners: list[tuple[float, float]], size: Pixel, variant: str, subpixel_bits: int) -> Edges | None:
    """Return the edge functions of a triangle in units of a sub-pixel, or None when it draws nothing."""
    if variant == "integer":  # pixels are sampled at their corner
        (a, b, c), unit, half = to_pixels(corners), 1, 0
    else:
        bits = max(subpixel_bits, 1)  # so that a pixel centre is a whole number
        spread = 1 << (bits - subpixel_bits)
        a, b, c = ((spread * round(x * 2.0**subpixel_bits), spread * round(y * 2.0**subpixel_bits)) for x, y in corners)
        unit, half = 1 << bits, 1 << (bits - 1)
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if area < 0:
        b, c = c, b
    points = (a, b, c)
    columns, rows = (
        (max(0, min(p[k] for p in points) // unit), min(size[k] - 1, max(p[k] for p in points) // unit))
        for k in range(2)
    )
    if area == 0 or columns[0] > columns[1] or rows[0] > rows[1]:
        return None
    value, step_x, step_y = [], [], []
    for p, q in ((b, c), (c, a), (a, b)):  # opposite the first, second and third corner
        dx, dy = q[0] - p[0], q[1] - p[1]
        is_top_left = dy < 0 or (dy == 0 and dx > 0)
        is_bottom_right = dy > 0 or (dy == 0 and dx < 0)
        bias = 0 if (is_bottom_right if variant == "bottom-right" else is_top_left) else -1
        value.append(dx * (rows[0] * unit + half - p[1]) - dy * (columns[0] * unit + half - p[0]) + bias)
        step_x.append(-dy * unit)
        step_y.append(dx * unit)
    return Edges(columns, rows, triple(value), triple(step_x), triple(step_y))


def triple(values: list[int]) -> Triple:
    """Return the three numbers of the three edges."""
    e0, e1, e2 = values
    return e0, e1, e2


def add(values: Triple, steps: Triple, n: int = 1) -> Triple:
    """Return the edge functions `n` steps further."""
    return values[0] + n * steps[0], values[1] + n * steps[1], values[2] + n * steps[2]


def overdraw(
    vertices: Any, triangles: Any, size: Pixel, variant: str = "", *, subpixel_bits: int = 8
) -> NDArray[np.int32]:
    """Return how often each pixel is drawn: int32, shape (H, W)."""
    counts, _ = new_picture(size)
    for corners in corners_of(vertices, triangles):
        e = set_up(corners, size, variant, subpixel_bits)
        if e is None:
            continue
        of_row = e.value
        for y in range(e.rows[0], e.rows[1] + 1):
            w = of_row
            for x in range(e.columns[0], e.columns[1] + 1):
                is_inside = min(w) >= 0
                counts[y, x] += is_inside
                w = add(w, e.step_x)
            of_row = add(of_row, e.step_y)
    return counts
