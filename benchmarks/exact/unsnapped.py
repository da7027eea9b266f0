"""The exact picture of float64 vertices as they are: nothing is snapped, and no sign is rounded.

In: vertices in pixels, triangles, the size of the frame. Out: which triangle each pixel centre belongs to under the
top-left rule, how many cover it, and which pixels an edge meets. The sign of an edge function is taken from float64
where its error bound allows that, and from fractions everywhere else.

Based on: J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997;
J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from topleft.methods.reference.integers import ExactPicture

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
BOOL = NDArray[np.bool_]

CHUNK = 1 << 18
"""Pixels looked at together; their temporaries stay in the cache."""

HALF_ULP = 2.0**-53
ERROR_BOUND = (3 + 16 * HALF_ULP) * HALF_ULP
"""Shewchuk's bound A: times the sum of the two products, what the float64 edge function is off by at most."""


def draw_unsnapped(vertices: F64, triangles: NDArray[np.int32], size: tuple[int, int]) -> ExactPicture:
    """Return the exact picture of triangles in pixels."""
    width, height = size
    corners = vertices[:, :2].astype(np.float64)[triangles]
    turn = edge_sign(corners[:, 0], corners[:, 1], corners[:, 2])
    corners[turn < 0] = corners[turn < 0][:, [0, 2, 1]]  # now edge functions are positive inside
    ids = np.full(height * width, -1, np.int32)
    count = np.zeros(height * width, np.int32)
    is_edge = np.zeros(height * width, bool)
    for i_triangle, column, row in box_pixels(corners, size):
        pixel = row * width + column
        center = np.stack([column + 0.5, row + 0.5], axis=-1)
        is_inside = turn[i_triangle] != 0
        is_met = np.zeros(len(pixel), bool)
        for k in range(3):
            p, q = corners[i_triangle, k], corners[i_triangle, (k + 1) % 3]
            sign = edge_sign(p, q, center)
            is_inside &= (sign > 0) | ((sign == 0) & is_top_left(p, q))
            is_met |= meets_pixel(p, q, column, row)
        np.maximum.at(ids, pixel[is_inside], i_triangle[is_inside].astype(np.int32))
        np.add.at(count, pixel[is_inside], 1)
        is_edge[pixel[is_met]] = True
    shape = (height, width)
    return ExactPicture(ids.reshape(shape), count.reshape(shape), is_edge.reshape(shape))


def edge_sign(p: F64, q: F64, s: F64) -> NDArray[np.int8]:
    """Return the sign of the edge function of p to q at s, all (N, 2): never a wrong one."""
    left = (p[:, 0] - s[:, 0]) * (q[:, 1] - s[:, 1])
    right = (p[:, 1] - s[:, 1]) * (q[:, 0] - s[:, 0])
    value, bound = left - right, ERROR_BOUND * (np.abs(left) + np.abs(right))
    sign = (value > bound).astype(np.int8) - (value < -bound).astype(np.int8)
    for i in np.flatnonzero(np.abs(value) <= bound):
        (px, py), (qx, qy), (sx, sy) = (map(Fraction, point[i].tolist()) for point in (p, q, s))
        exact = (qx - px) * (sy - py) - (qy - py) * (sx - px)
        sign[i] = (exact > 0) - (exact < 0)
    return sign


def is_top_left(p: F64, q: F64) -> BOOL:
    """Tell for edges of triangles of positive area: top edges run right, left edges run up."""
    return ((p[:, 1] == q[:, 1]) & (q[:, 0] > p[:, 0])) | (q[:, 1] < p[:, 1])


def meets_pixel(p: F64, q: F64, column: I64, row: I64) -> BOOL:
    """Return whether the edges meet the squares of the pixels, borders included.

    They do where their boxes overlap and the corners of the square do not all lie on one side.
    """
    result = np.zeros(len(column), bool)
    found = np.flatnonzero(
        (np.minimum(p[:, 0], q[:, 0]) <= column + 1) & (np.maximum(p[:, 0], q[:, 0]) >= column)
        & (np.minimum(p[:, 1], q[:, 1]) <= row + 1) & (np.maximum(p[:, 1], q[:, 1]) >= row)
    )  # fmt: skip
    p, q, column, row = p[found], q[found], column[found], row[found]
    is_right, is_left = q[:, 0] > p[:, 0], q[:, 0] < p[:, 0]
    is_down, is_up = q[:, 1] > p[:, 1], q[:, 1] < p[:, 1]
    largest = np.stack([column + is_up, row + is_right], axis=-1).astype(np.float64)  # grows to the right going up
    smallest = np.stack([column + is_down, row + is_left], axis=-1).astype(np.float64)
    result[found] = (edge_sign(p, q, largest) >= 0) & (edge_sign(p, q, smallest) <= 0)
    return result


def box_pixels(corners: F64, size: tuple[int, int]) -> Iterator[tuple[I64, I64, I64]]:
    """Yield triangle, column and row of the pixels that the box of each triangle (T, 3, 2) meets, in that order."""
    low = np.maximum(np.ceil(corners.min(axis=1)) - 1, 0).astype(np.int64)
    high = np.minimum(np.floor(corners.max(axis=1)), np.array(size) - 1).astype(np.int64)
    extent = np.maximum(high - low + 1, 0)
    n_pixels = extent.prod(axis=1)
    ends = np.cumsum(n_pixels)
    first = 0
    while first < len(corners):
        done = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, done + CHUNK, side="right")), first + 1)
        counts = n_pixels[first:last]
        i_triangle = np.repeat(np.arange(first, last), counts)
        offset = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        across = extent[i_triangle, 0]
        yield i_triangle, low[i_triangle, 0] + offset % across, low[i_triangle, 1] + offset // across
        first = last
