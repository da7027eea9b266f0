"""Bresenham scanline in Python, where the generator of the line is a generator.

In: vertices, truncated to pixels.  Out: counts.  Source: see bresenham_scanline.h.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft.methods.twins._picture import Pixel, Span, corners_of, new_picture, to_pixels


def line(a: Pixel, b: Pixel) -> Iterator[Pixel]:
    """Yield the pixels of a line from its upper end down."""
    (x, y), (x_end, y_end) = (a, b) if a[1] <= b[1] else (b, a)
    dx, dy, x_step = abs(x_end - x), y_end - y, 1 if x_end > x else -1
    major, minor = max(dx, dy), min(dx, dy)
    error = 2 * minor - major
    for _ in range(major + 1):
        yield x, y
        is_diagonal = error >= 0
        error += 2 * minor - 2 * major * is_diagonal
        x += x_step * (is_diagonal or dy < dx)
        y += is_diagonal or dy >= dx


def runs(a: Pixel, b: Pixel) -> Iterator[tuple[int, int, int]]:
    """Yield row, first column and last column of each row of a line, in the order of the line."""
    for y, run in groupby(line(a, b), lambda pixel: pixel[1]):
        columns = [x for x, _ in run]
        yield y, columns[0], columns[-1]


FLAT_TOP, FLAT_BOTTOM = 0, 1  # which ends of the lines the flat side connects


def fill_basic(span: Span, left: tuple[Pixel, Pixel], right: tuple[Pixel, Pixel], flat: int, variant: str) -> None:
    """Draw the pixels between two lines, from the top down, that begin and end in equal rows."""
    if variant == "wireframe":
        for x, y in chain(line(*left), line(*right)):
            span(y, x, x)
        span(left[flat][1], left[flat][0], right[flat][0])
        return
    # A line that runs outwards has its outermost pixel last, a line that runs inwards has it first.
    left_end = 2 if left[1][0] <= left[0][0] else 1
    right_end = 1 if right[1][0] <= right[0][0] else 2
    for of_left, of_right in zip(runs(*left), runs(*right), strict=True):
        y = of_left[0]
        if variant != "top-left":
            span(y, of_left[left_end], of_right[right_end])
        elif y < left[1][1]:
            span(y, of_left[1], of_right[1] - 1)


def fill_triangle(span: Span, corners: list[Pixel], variant: str) -> None:
    """Sort, split at mid height and draw the parts, or a line when there is nothing to fill."""
    a, b, c = sorted(corners, key=lambda p: (p[1], p[0]))
    n_dropped = 1 if variant == "top-left" else 0
    if a[1] == c[1]:
        span(a[1], a[0], c[0] - n_dropped)
        return
    if a[0] == b[0] == c[0]:
        for y in range(a[1], c[1] + 1 - n_dropped):
            span(y, a[0], a[0])
        return
    if (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) <= 0:
        b, c = c, b  # now clockwise as seen
    if a[1] == b[1]:
        fill_basic(span, (a, c), (b, c), FLAT_TOP, variant)
    elif b[1] == c[1]:
        fill_basic(span, (a, c), (a, b), FLAT_BOTTOM, variant)
    elif b[1] > c[1]:
        split = (int(a[0] + (b[0] - a[0]) * ((c[1] - a[1]) / (b[1] - a[1]))), c[1])
        fill_basic(span, (a, c), (a, split), FLAT_BOTTOM, variant)
        fill_basic(span, (c, b), (split, b), FLAT_TOP, variant)
    else:
        split = (int(a[0] + (c[0] - a[0]) * ((b[1] - a[1]) / (c[1] - a[1]))), b[1])
        fill_basic(span, (a, split), (a, b), FLAT_BOTTOM, variant)
        fill_basic(span, (split, c), (b, c), FLAT_TOP, variant)


def overdraw(vertices: Any, triangles: Any, size: Pixel, variant: str = "") -> NDArray[np.int32]:
    """Return how often each pixel is drawn: int32, shape (H, W)."""
    counts, span = new_picture(size)
    for corners in corners_of(vertices, triangles):
        fill_triangle(span, to_pixels(corners), variant)
    return counts
