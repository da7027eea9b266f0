"""The exact picture of triangles anywhere: vertices as Python integers, edge functions as wide as they need to be.

In: vertices in units of 2**-bits pixels, as the atlas takes them from float64 (`true_points`) or as a method snaps them
(`snapped_points`). Out: which triangle each pixel centre of a window shows, how many cover it, which pixels an edge
meets. Edge functions are sums of a row and a column term, in int64 where these fit and in Python integers where not.

Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Point = tuple[int, int]

INT64_SAFE = 2**61


@dataclass(frozen=True)
class ExactPicture:
    """What the frame must hold."""

    triangle: NDArray[np.int32]
    """(H, W): the last triangle that covers the centre, -1 for none."""
    count: NDArray[np.int32]
    """(H, W): how many triangles cover the centre."""
    is_edge: NDArray[np.bool_]
    """(H, W): whether an edge of a triangle meets the pixel's square, its border included."""


class WidePoints(NamedTuple):
    """Vertices in units of 2**-bits pixels; bits >= 1, so that pixel centres are whole numbers of units."""

    xy: list[Point]
    bits: int


def true_points(vertices: NDArray[np.float64]) -> WidePoints:
    """Return float64 vertices in pixels as they are."""
    ratios = [[x.as_integer_ratio() for x in row] for row in np.asarray(vertices, np.float64)[:, :2].tolist()]
    bits = max([1, *(denominator.bit_length() - 1 for row in ratios for _, denominator in row)])
    return WidePoints([(*(n * (2**bits // d) for n, d in row),) for row in ratios], bits)


def snapped_points(vertices: NDArray[np.float64], snap: str) -> WidePoints:
    """Return vertices in pixels after a snap: "px" to the middle of their pixel, "float32", or to a number of bits.

    Truncation is towards zero, the rounding to bits to nearest with ties to even.
    """
    if snap == "true":
        return true_points(vertices)
    if snap == "float32":
        return true_points(np.asarray(vertices).astype(np.float32).astype(np.float64))
    rows = [[Fraction(x) for x in row] for row in np.asarray(vertices, np.float64)[:, :2].tolist()]
    if snap == "px":
        return WidePoints([(2 * int(x) + 1, 2 * int(y) + 1) for x, y in rows], 1)
    scale = 2 ** int(snap)
    return WidePoints([(2 * round(x * scale), 2 * round(y * scale)) for x, y in rows], int(snap) + 1)


def signed_area(points: WidePoints, triangle: list[int]) -> int:
    """Return twice the area in square units, positive clockwise as seen (y down)."""
    (ax, ay), (bx, by), (cx, cy) = (points.xy[i] for i in triangle)
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def draw_points(
    points: WidePoints, triangles: NDArray[np.int32], size: Point, origin: Point = (0, 0), rule: str = "top-left"
) -> ExactPicture:
    """Return the exact picture of a window; `rule` says which edges own the centres on them: or "bottom-right"."""
    width, height = size
    bits = points.bits
    ids = np.full((height, width), -1, np.int32)
    count = np.zeros((height, width), np.int32)
    is_edge = np.zeros((height, width), bool)
    here = [(x - (origin[0] << bits), y - (origin[1] << bits)) for x, y in points.xy]
    for i, triangle in enumerate(triangles.tolist()):
        corners = [here[k] for k in triangle]
        area = signed_area(points, triangle)
        if area < 0:
            corners = [corners[0], corners[2], corners[1]]
        columns, rows = (box_side(corners, k, size[k], bits) for k in range(2))
        if not (len(columns) and len(rows)):
            continue
        window = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        is_inside = np.full((len(rows), len(columns)), area != 0)
        for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
            value, reach = edge_values(p, q, columns, rows, bits)
            is_owner = ((p[1] == q[1] and q[0] > p[0]) or q[1] < p[1]) == (rule == "top-left")
            is_inside &= np.asarray(value >= 0 if is_owner else value > 0, bool)
            near = np.asarray((value <= reach) & (value >= -reach), bool)
            is_edge[window] |= near & in_box(p, q, columns, rows, bits)
        ids[window][is_inside] = i
        count[window] += is_inside
    return ExactPicture(ids, count, is_edge)


def box_side(corners: list[Point], k: int, n: int, bits: int) -> range:
    """Return the columns (k = 0) or rows whose squares the box of a triangle meets, borders included."""
    low, high = min(p[k] for p in corners), max(p[k] for p in corners)
    return range(max(0, (low - 1) >> bits), min(n, (high >> bits) + 1))


def edge_values(p: Point, q: Point, columns: range, rows: range, bits: int) -> tuple[NDArray[Any], int]:
    """Return the edge function at pixel centres, and how much it changes from there to the corners of the square."""
    half = 1 << (bits - 1)
    dx, dy = q[0] - p[0], q[1] - p[1]
    of_column = [-dy * (((2 * j + 1) << (bits - 1)) - p[0]) for j in columns]
    of_row = [dx * (((2 * i + 1) << (bits - 1)) - p[1]) for i in rows]
    reach = half * (abs(dx) + abs(dy))
    largest = max(map(abs, (of_column[0], of_column[-1]))) + max(map(abs, (of_row[0], of_row[-1]))) + reach
    dtype = np.int64 if largest < INT64_SAFE else object
    return np.add.outer(np.array(of_row, dtype), np.array(of_column, dtype)), reach


def in_box(p: Point, q: Point, columns: range, rows: range, bits: int) -> NDArray[np.bool_]:
    """Return which squares the box of the edge meets."""
    is_column = [min(p[0], q[0]) <= (j + 1) << bits and max(p[0], q[0]) >= j << bits for j in columns]
    is_row = [min(p[1], q[1]) <= (i + 1) << bits and max(p[1], q[1]) >= i << bits for i in rows]
    return np.logical_and.outer(np.array(is_row), np.array(is_column))
