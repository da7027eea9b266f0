"""The exact reference of points: discs and squares by their rule, in fractions.

In: positions in pixels.  Out: the point that shows in each pixel, and its depth.
"""

from __future__ import annotations

from fractions import Fraction
from math import inf
from typing import Any

import numpy as np

from topleft.methods.reference import Point, round_to_float32, snap


def covers(size: Fraction, shape: str, dx: Fraction, dy: Fraction) -> bool:
    """Return whether a point covers a sample that is (dx, dy) pixels off its centre.

    Examples
    --------
    >>> half = Fraction(1, 2)
    >>> covers(Fraction(1), "square", -half, -half), covers(Fraction(1), "square", half, -half)
    (True, False)
    >>> covers(Fraction(2), "disc", Fraction(1), Fraction(0)), covers(Fraction(2), "disc", Fraction(1), half)
    (True, False)
    """
    in_pixel = all(-1 <= 2 * off < 1 for off in (dx, dy))
    if shape == "disc":
        return in_pixel or 4 * (dx * dx + dy * dy) <= size * size
    return in_pixel or all(-size <= 2 * off < size for off in (dx, dy))


def points(
    positions: Any,
    size: Point,
    *,
    point_size: Any = 1.0,
    shape: str = "square",
    depth_test: str = "less",
    subpixel_bits: int = 8,
    origin: Point = (0, 0),
    sample: tuple[Fraction, Fraction] = (Fraction(0), Fraction(0)),
) -> tuple[np.ndarray, np.ndarray]:
    """Return ids, int32 (H, W), and depths, float32 (H, W), of points at a sample of each pixel.

    Sizes are rounded to whole sub-pixels, ties to even; `sample`: pixels from the centre.

    Examples
    --------
    >>> points([[1.5, 0.5], [2.5, 0.5]], (4, 1), point_size=2)[0].tolist()
    [[0, 0, 1, -1]]
    """
    sign, unit = (-1 if depth_test == "greater" else 1), 1 << subpixel_bits
    ids = np.full(size[::-1], -1, np.int32)
    depths = np.full(size[::-1], sign * inf, np.float32)
    sizes = np.broadcast_to(np.asarray(point_size, np.float64), len(positions)).tolist()
    centers = snap(np.asarray(positions)[:, :2], subpixel_bits)
    for i, ((x_fx, y_fx), size_px) in enumerate(zip(centers, sizes, strict=True)):
        side = Fraction(round(Fraction(size_px) * unit), unit)
        z = round_to_float32(Fraction(float(positions[i][2]))) if len(positions[i]) > 2 else 0.0
        for row in range(size[1]):
            dy = row + origin[1] + Fraction(1, 2) + sample[1] - Fraction(y_fx, unit)
            for column in range(size[0]):
                dx = column + origin[0] + Fraction(1, 2) + sample[0] - Fraction(x_fx, unit)
                if covers(side, shape, dx, dy) and sign * z < sign * depths[row, column]:
                    ids[row, column], depths[row, column] = i, z
    return ids, depths
