"""The exact reference of polygons: which pixels lie inside of rings, and how much of each, in integers and fractions.

In: rings of points in pixels, and the rule.  Out: masks, and the area of each pixel inside as a fraction.

A sample is inside by its winding number: each edge that passes its row on the left counts 1 downwards and -1 upwards.
An edge includes its upper end, not its lower end, and a sample on an edge lies right of it: the top-left rule.
Areas: between the heights at which edges end, cross or pass from column to column, their order does not change; the
trapezoid between two neighbours is inside or not.

Based on: D. Alciatore, R. Miranda, A Winding Number and Point-in-Polygon Algorithm, 1995.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations, pairwise
from math import floor
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ring = list[tuple[Fraction, Fraction]]
Edge = tuple[Fraction, Fraction, Fraction, Fraction, int]  # upper end, lower end, direction

RULES = {"evenodd": lambda winding: winding % 2 != 0, "nonzero": lambda winding: winding != 0}


def snap_rings(rings: Sequence[Any], subpixel_bits: int = 8, origin: tuple[int, int] = (0, 0)) -> list[Ring]:
    """Return the points of rings on the grid of sub-pixels, ties to even, from the window's corner.

    Examples
    --------
    >>> snap_rings([[(0.5, 1.25), (2, 0), (0, 0)]], subpixel_bits=0)[0][0]
    (Fraction(0, 1), Fraction(1, 1))
    """
    unit = 2**subpixel_bits

    def snap(ring: Any) -> Ring:
        return [
            (
                Fraction(round(Fraction(x) * unit), unit) - origin[0],
                Fraction(round(Fraction(y) * unit), unit) - origin[1],
            )
            for x, y in np.asarray(ring).tolist()
        ]

    return [snap(ring) for ring in rings]


def edges_of(rings: Sequence[Ring]) -> list[Edge]:
    """Return the edges that are not level, from the upper end to the lower end."""
    edges: list[Edge] = []
    for ring in rings:
        for (ax, ay), (bx, by) in pairwise([*ring, *ring[:1]]):
            if ay < by:
                edges.append((ax, ay, bx, by, 1))
            elif by < ay:
                edges.append((bx, by, ax, ay, -1))
    return edges


def x_at(edge: Edge, y: Fraction) -> Fraction:
    """Return where an edge is at a height between its ends."""
    ax, ay, bx, by, _ = edge
    return ax + (bx - ax) * (y - ay) / (by - ay)


def polygon_mask(
    rings: Sequence[Any],
    size: tuple[int, int],
    rule: str = "evenodd",
    *,
    origin: tuple[int, int] = (0, 0),
    subpixel_bits: int = 8,
    sample: tuple[int, int] = (0, 0),
) -> NDArray[np.bool_]:
    """Return the pixels with their sample inside: the centre, or so many sixteenths of a pixel right of and below it.

    Examples
    --------
    >>> polygon_mask([[(0, 0), (4, 0), (0, 4)]], (4, 3)).astype(int).tolist()
    [[1, 1, 1, 0], [1, 1, 0, 0], [1, 0, 0, 0]]
    """
    width, height = size
    edges = edges_of(snap_rings(rings, subpixel_bits, origin))
    x_sample, y_sample = (Fraction(8 + s, 16) for s in sample)
    mask = np.zeros((height, width), bool)
    for row in range(height):
        y = row + y_sample
        passed = [(x_at(edge, y), edge[4]) for edge in edges if edge[1] <= y < edge[3]]
        for column in range(width):
            mask[row, column] = RULES[rule](sum(sign for x, sign in passed if x <= column + x_sample))
    return mask


def polygon_areas(
    rings: Sequence[Any],
    size: tuple[int, int],
    rule: str = "evenodd",
    *,
    origin: tuple[int, int] = (0, 0),
    subpixel_bits: int = 8,
) -> list[list[Fraction]]:
    """Return the area of each pixel that lies inside.

    Examples
    --------
    >>> [float(a) for a in polygon_areas([[(0, 0), (4, 0), (0, 4)]], (4, 1))[0]]
    [1.0, 1.0, 1.0, 0.5]
    """
    width, height = size
    edges = edges_of(snap_rings(rings, subpixel_bits, origin))
    areas = [[Fraction(0)] * width for _ in range(height)]
    for row in range(height):
        passing = [edge for edge in edges if edge[1] < row + 1 and edge[3] > row]
        for top, bottom in pairwise(_heights(passing, row, width)):
            middle = (top + bottom) / 2
            ordered = sorted((x_at(edge, middle), edge[4]) for edge in passing if edge[1] < middle < edge[3])
            winding = 0
            for (left, sign), (right, _) in pairwise([*ordered, (Fraction(width), 0)]):
                winding += sign
                if RULES[rule](winding):
                    _add_interval(areas[row], max(left, Fraction(0)), min(right, Fraction(width)), bottom - top)
    return areas


def _heights(edges: Sequence[Edge], row: int, width: int) -> list[Fraction]:
    """Return the heights of a row between which no edge ends, crosses another or passes the side of a pixel."""
    heights = {Fraction(row), Fraction(row + 1)}
    for edge in edges:
        ax, ay, bx, by, _ = edge
        heights |= {ay, by}
        if ax != bx:
            ends = sorted(x_at(edge, min(max(Fraction(y), ay), by)) for y in (row, row + 1))
            for x in range(max(0, floor(ends[0])), min(width, floor(ends[1]) + 1) + 1):
                heights.add(ay + (x - ax) * (by - ay) / (bx - ax))
    for a, b in combinations(edges, 2):
        slopes = [(e[2] - e[0]) / (e[3] - e[1]) for e in (a, b)]
        if slopes[0] != slopes[1]:  # where x is equal on both lines
            heights.add((b[0] - slopes[1] * b[1] - a[0] + slopes[0] * a[1]) / (slopes[0] - slopes[1]))
    return sorted(y for y in heights if row <= y <= row + 1)


def _add_interval(areas: list[Fraction], left: Fraction, right: Fraction, height: Fraction) -> None:
    """Add the columns from left to right, of some height, to the areas of a row of pixels."""
    for column in range(floor(left), len(areas)):
        if column >= right:
            break
        areas[column] += max(Fraction(0), min(right, Fraction(column + 1)) - max(left, Fraction(column))) * height
