"""The two production walkers in Python integers: what `csrc/raster/walk.h` does, row by row, for reading.

In: vertices in pixels.  Out: counts.  Both walk E' = (2E + bias) >> (bits + 1), bias -1 on edges that are neither top
nor left: the floor keeps its sign at every sample, and E' changes by -dy a column and dx a row.

Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (`edge`);
J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965 (`scanline`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft.methods.twins._picture import Pixel, Record, Span, corners_of, new_picture


class Walk(NamedTuple):
    """A triangle that is set up: half-open columns and rows, and E' of the three edges."""

    columns: tuple[int, int]
    rows: tuple[int, int]
    value: list[int]  # at the first sample, >= 0 inside
    dx: list[int]
    dy: list[int]
    corners: list[Pixel]  # clockwise as seen, in sub-pixels
    is_top_left: list[bool]


def set_up(corners: list[tuple[float, float]], size: Pixel, bits: int) -> Walk | None:
    """Return a snapped triangle as it is walked, or None when it covers no sample."""
    a, b, c = ((round(x * 2.0**bits), round(y * 2.0**bits)) for x, y in corners)
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if area < 0:
        b, c = c, b
    points = [a, b, c]
    before_center = max(0, (1 << bits) // 2 - 1)  # centres at or right of the lowest, and left of the highest
    columns, rows = (
        (
            max(0, (min(p[k] for p in points) + before_center) >> bits),
            min(size[k], (max(p[k] for p in points) + before_center) >> bits),
        )
        for k in range(2)
    )
    if area == 0 or columns[0] >= columns[1] or rows[0] >= rows[1]:
        return None
    ends = list(zip(points, points[1:] + points[:1], strict=True))
    dx, dy = ([q[k] - p[k] for p, q in ends] for k in range(2))
    is_top_left = [dy[k] < 0 or (dy[k] == 0 and dx[k] > 0) for k in range(3)]
    px, py = ((2 * first + 1) << bits for first in (columns[0], rows[0]))
    doubled = [dx[k] * (py - 2 * points[k][1]) - dy[k] * (px - 2 * points[k][0]) for k in range(3)]
    value = [(doubled[k] - (not is_top_left[k])) >> (bits + 1) for k in range(3)]
    return Walk(columns, rows, value, dx, dy, points, is_top_left)


def walk_edge(t: Walk, span: Span, record: Record | None) -> None:
    """Draw by edge functions that are stepped by additions, one test a sample."""
    of_row = t.value
    for y in range(*t.rows):
        e, x, first = of_row, t.columns[0], None
        while x < t.columns[1]:
            is_inside = min(e) >= 0
            if record:
                record("test", x, y, is_inside=is_inside, E0=e[0], E1=e[1], E2=e[2])
            if is_inside and first is None:
                first = x
            if first is not None and not is_inside:
                break  # a row of a triangle is one run
            x, e = x + 1, [value - dy for value, dy in zip(e, t.dy, strict=True)]
        if first is not None:
            span(y, first, x - 1)
        of_row = [value + dx for value, dx in zip(of_row, t.dx, strict=True)]


def walk_scanline(t: Walk, span: Span, record: Record | None) -> None:
    """Draw by row ends: one floor division an edge, then quotient and remainder are stepped from row to row."""
    slanted = [k for k in range(3) if t.dy[k] != 0]
    divisor = {k: abs(t.dy[k]) for k in slanted}
    at = {k: divmod(t.value[k], divisor[k]) for k in slanted}
    step = {k: divmod(t.dx[k], divisor[k]) for k in slanted}
    for y in range(*t.rows):
        first = max([0, *(-at[k][0] for k in slanted if t.dy[k] < 0)])
        end = min([t.columns[1] - t.columns[0], *(at[k][0] + 1 for k in slanted if t.dy[k] > 0)])
        if record:
            values = {f"q{k} r{k}": list(at[k]) for k in slanted}
            record("row", t.columns[0] + first, y, first=t.columns[0] + first, end=t.columns[0] + end, **values)
        if first < end:
            span(y, t.columns[0] + first, t.columns[0] + end - 1)
        for k in slanted:
            carry, rest = divmod(at[k][1] + step[k][1], divisor[k])  # 0 or 1: both remainders are below the divisor
            at[k] = at[k][0] + step[k][0] + carry, rest


WALKS = {"edge": walk_edge, "scanline": walk_scanline}


def overdraw(
    vertices: Any,
    triangles: Any,
    size: Pixel,
    variant: str = "edge",
    record: Record | None = None,
    *,
    subpixel_bits: int = 8,
) -> NDArray[np.int32]:
    """Return how often each pixel is drawn: int32, shape (H, W); `variant`: "edge" or "scanline"."""
    counts, span = new_picture(size, record)
    for corners in corners_of(vertices, triangles):
        t = set_up(corners, size, subpixel_bits)
        if t is None:
            continue
        if record:
            a, b, c = t.corners
            record(
                "triangle", t.columns[0], t.rows[0], a=a, b=b, c=c, columns=t.columns, rows=t.rows, dx=t.dx, dy=t.dy,
                is_top_left=t.is_top_left,
            )  # fmt: skip
        WALKS[variant](t, span, record)
    return counts
