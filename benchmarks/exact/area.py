"""How much of each pixel triangles cover, of float64 vertices as they are: nothing is snapped.

In: vertices in pixels, triangles, the size of the frame. Out: the areas in each pixel, added up, in float64; closed
forms whose rounding stays below 1e-9 of a pixel: `tests/studies/test_accuracy.py` compares with fractions.

Based on: R. Levien, font-rs, 2015 (an edge adds what lies to the right of it).
"""

from __future__ import annotations

import numpy as np

from benchmarks.exact.unsnapped import F64, box_pixels


def draw_area(vertices: F64, triangles: np.ndarray, size: tuple[int, int]) -> F64:
    """Return the area of the triangles in each pixel, (H, W)."""
    width, height = size
    corners = vertices[:, :2].astype(np.float64)[triangles]
    total = np.zeros(height * width)
    for i_triangle, column, row in box_pixels(corners, size):
        area = np.zeros(len(column))
        for k in range(3):
            area += area_to_the_right(corners[i_triangle, k], corners[i_triangle, (k + 1) % 3], column, row)
        np.add.at(total, row * width + column, np.abs(area))
    return total.reshape(height, width)


def area_to_the_right(p: F64, q: F64, column: np.ndarray, row: np.ndarray) -> F64:
    """Return the area of each pixel to the right of its edge, negative where the edge runs up.

    That is the height of the edge in the row times the mean of what it leaves of the pixel's width, which is a ramp
    from 0 to 1 along the edge.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.where(p[:, 1] == q[:, 1], 0.0, (q[:, 0] - p[:, 0]) / (q[:, 1] - p[:, 1]))
    y0, y1 = np.clip(p[:, 1], row, row + 1), np.clip(q[:, 1], row, row + 1)
    u0, u1 = (column + 1 - at_row(p, q, slope, y) for y in (y0, y1))
    low, high = np.minimum(u0, u1), np.maximum(u0, u1)
    low_in, high_in = np.clip(low, 0, 1), np.clip(high, 0, 1)
    spread = high - low
    is_steep = spread <= 0
    spread[is_steep] = 1
    mean = ((high_in - low_in) * (high_in + low_in) / 2 + np.maximum(high - np.maximum(low, 1), 0)) / spread
    return (y1 - y0) * np.where(is_steep, low_in, mean)


def at_row(p: F64, q: F64, slope: F64, y: F64) -> F64:
    """Return x of the edge at y, between its ends."""
    x = np.where(y == q[:, 1], q[:, 0], p[:, 0] + slope * (y - p[:, 1]))
    return np.clip(x, np.minimum(p[:, 0], q[:, 0]), np.maximum(p[:, 0], q[:, 0]))
