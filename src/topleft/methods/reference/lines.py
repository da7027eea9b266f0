"""The exact reference of lines: the edges of a scene, pixel by pixel, in Python integers.

In: scenes, as in `reference`.  Out: which pixels the lines hold, and how far centres are from edges.

Based on: J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965 (lines);
S. Gupta, R. F. Sproull, Filtering Edges for Gray-Scale Displays, 1981 (intensity by distance).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from topleft.methods import reference
from topleft.methods.reference import Point, Position, Projection


class End(NamedTuple):
    """A snapped end of a line, and its depth."""

    xy_fx: Point
    z: float


Line = tuple[End, End]  # from the upper end to the lower, of a level line from left to right


def lines(
    vertices: Any, triangles: Any, size: Point, *, transform: Any = None, viewport: Point | None = None,
    subpixel_bits: int = 8, cull: str = "none", clip_depth: str = "minus_one_to_one", near_clip: bool = True,
    far_clip: bool = True,
) -> list[Line]:  # fmt: skip
    """Return the clipped edges of triangles that are not culled, each once."""
    points = np.asarray(vertices).tolist() if transform is None else reference.transform_to_clip(vertices, transform)
    width, height = viewport or size
    view = Projection((width / 2.0, height / 2.0), subpixel_bits, clip_depth == "zero_to_one", near_clip, far_clip)
    indices = np.asarray(triangles).tolist()
    if cull != "none":
        drawn = reference.pieces(
            vertices, triangles, size, transform=transform, viewport=viewport, subpixel_bits=subpixel_bits, cull=cull,
            clip_depth=clip_depth, near_clip=near_clip, far_clip=far_clip,
        )  # fmt: skip
        indices = [indices[i] for i in sorted({piece.triangle for piece in drawn})]
    edges = {(min(a, b), max(a, b)) for i, j, k in indices for a, b in ((i, j), (j, k), (k, i))}
    clipped = []
    for edge in sorted(edges):
        if len(points[edge[0]]) == 4:
            first, last = ((*map(float, points[i]), 0.0, 0.0, 0.0) for i in edge)
            ends = _cut_line(first, last, view)
        else:
            ends = [End(reference.snap([points[i]], subpixel_bits)[0], (*points[i], 0)[2]) for i in edge]
        if ends:
            upper, lower = sorted(ends, key=lambda end: (end.xy_fx[1], end.xy_fx[0]))
            clipped.append((upper, lower))
    return clipped


def _cut_line(p: Position, q: Position, view: Projection) -> list[End]:
    outside = [[d < 0 for d in view.distances(end)] for end in (p, q)]
    for k, (p_out, q_out) in enumerate(zip(*outside, strict=True)):
        if p_out and q_out:
            return []
        if p_out or q_out:
            dp, dq = view.distances(p)[k], view.distances(q)[k]
            if dp < 0 and dq < 0:
                return []
            if dp < 0:
                p = view.cut(q, p, k)
            elif dq < 0:
                q = view.cut(p, q, k)
    vertices = [view.vertex(p), view.vertex(q)]
    return [End(v.xy_fx, v.z) for v in vertices if v] if all(vertices) else []


def line_pixels(a: Point, b: Point, first: int = 0, last: int | None = None) -> Iterator[tuple[int, Point]]:
    """Yield steps and pixels ``(k, (x, y))`` of the line from pixel a to pixel b: Bresenham's loop, or a part of it.

    Examples
    --------
    >>> [pixel for _, pixel in line_pixels((0, 0), (4, 2))]
    [(0, 0), (1, 1), (2, 1), (3, 2), (4, 2)]
    """
    dx, dy = abs(b[0] - a[0]), abs(b[1] - a[1])
    right, down = 1 if b[0] >= a[0] else -1, 1 if b[1] >= a[1] else -1
    steps, across = max(dx, dy), min(dx, dy)
    aside, error = divmod(2 * across * first + steps, 2 * steps) if steps else (0, 0)
    for k in range(first, (steps if last is None else last) + 1):
        if dx >= dy:
            yield k, (a[0] + right * k, a[1] + down * aside)
        else:
            yield k, (a[0] + right * aside, a[1] + down * k)
        error += 2 * across
        if error >= 2 * steps:
            error -= 2 * steps
            aside += 1


def wireframe(
    vertices: Any, triangles: Any, size: Point, *, origin: Point = (0, 0), depth: Any = None, depth_test: str = "less",
    depth_bias: float = 2.0**-10, **view: Any,
) -> np.ndarray:  # fmt: skip
    """Return which pixels lines hold and ``depth`` does not hide: bool, shape (H, W).

    Examples
    --------
    >>> wireframe([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], (3, 3)).astype(int)
    array([[1, 1, 1],
           [1, 1, 0],
           [1, 0, 0]])
    """
    bits = view.get("subpixel_bits", 8)
    picture = np.zeros((size[1], size[0]), bool)
    for a, b in lines(vertices, triangles, size, **view):
        start, end = (tuple((e.xy_fx[i] >> bits) - origin[i] for i in range(2)) for e in (a, b))
        steps = max(abs(end[0] - start[0]), end[1] - start[1])
        along = 0 if abs(end[0] - start[0]) >= end[1] - start[1] else 1
        inside = sorted(abs(edge - start[along]) for edge in (0, size[along] - 1))
        is_in = 0 <= start[along] < size[along]  # otherwise the window begins some steps away, or never
        for k, (x, y) in line_pixels(start, end, 0 if is_in else min(inside[0], steps), min(inside[1], steps)):
            if 0 <= x < size[0] and 0 <= y < size[1]:
                z = np.float32(a.z + k * ((b.z - a.z) / steps)) if steps else np.float32(a.z)
                picture[y, x] |= depth is None or _shows(z, depth[y, x], depth_test, depth_bias)
    return picture


def smooth_wireframe(
    vertices: Any, triangles: Any, size: Point, *, origin: Point = (0, 0), depth: Any = None, depth_test: str = "less",
    depth_bias: float = 2.0**-10, **view: Any,
) -> np.ndarray:  # fmt: skip
    """Return ``max(0, 1 - distance)`` of each centre from the nearest edge that shows there: float64, shape (H, W)."""
    unit = 2 ** view.get("subpixel_bits", 8)
    picture: np.ndarray = np.zeros((size[1], size[0]))
    for a, b in lines(vertices, triangles, size, **view):
        (ax, ay), dx, dy = a.xy_fx, b.xy_fx[0] - a.xy_fx[0], b.xy_fx[1] - a.xy_fx[1]
        for row, column in np.ndindex(picture.shape):
            x, y = (Fraction(2 * (i + o) + 1, 2) * unit for i, o in zip((column, row), origin, strict=True))
            along, length2 = (x - ax) * dx + (y - ay) * dy, dx * dx + dy * dy
            share = min(max(along / length2, Fraction(0)), Fraction(1)) if length2 else Fraction(0)
            distance = sqrt(((x - ax - share * dx) ** 2 + (y - ay - share * dy) ** 2) / unit**2)
            z = np.float32(a.z + float(share) * (b.z - a.z))
            if distance < 1 and (depth is None or _shows(z, depth[row, column], depth_test, depth_bias)):
                picture[row, column] = max(float(picture[row, column]), 1 - distance)
    return picture


def _shows(z: np.float32, there: np.float32, depth_test: str, bias: float) -> bool:
    return float(z) >= float(there) - bias if depth_test == "greater" else float(z) <= float(there) + bias
