"""Magnified pictures of `topleft.failure_scenes`: expected, got, and the difference, side by side. Needs matplotlib."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from topleft.failure_scenes import FAILURE_SCENES, FailureScene, picture

SHEETS = {
    "scenes-any": ("any",),
    "scenes-far": ("far", "large"),
    "scenes-shape": ("sliver", "dense", "fan", "hub", "edge", "layers"),
}
"""Sheets and the families on them."""

COUNT_COLORS = ("#FFFFFF", "#BBD6EA", "#4C8BBF", "#1F4E79", "#0B2239")
LABEL_COLORS = ("#BBD6EA", "#F3D9A4", "#BFE0C8", "#E3C6DC", "#DDDDDD", "#C9D3F2")
GAP, EXTRA, OTHER = "#D55E00", "#0072B2", "#CC79A7"
MARGIN_PX = 1.0

Segment = tuple[tuple[float, float], tuple[float, float]]


class Triptych(NamedTuple):
    """A scene and one wrong picture of it."""

    scene: FailureScene
    rows: str
    methods: list[str]


def sheets() -> Iterator[tuple[str, Callable[[], Figure]]]:
    """Yield the function that draws a sheet of scenes for each group of families."""
    for name, families in SHEETS.items():
        found = [own for scene in FAILURE_SCENES.values() if scene.family in families for own in triptychs(scene)]
        if found:
            yield name, partial(draw_sheet, found)


def triptychs(scene: FailureScene) -> Iterator[Triptych]:
    """Yield every wrong picture of a scene once, with all who draw it."""
    for rows in dict.fromkeys(got.rows for got in scene.got):
        methods = [
            got.method + ("" if got.subpixel_bits == 8 else f", {got.subpixel_bits} bits")
            for got in scene.got
            if got.rows == rows
        ]
        yield Triptych(scene, rows, methods)


def draw_sheet(found: list[Triptych]) -> Figure:
    """Return a scene a row, three pictures each."""
    titles = [title_of(own) for own in found]
    heights = [1.8 + 0.13 * title.count("\n") for title in titles]
    figure = plt.figure(figsize=(4.6, sum(heights)), layout="constrained")
    parts = figure.subfigures(len(found), 1, squeeze=False, height_ratios=heights).flat
    for part, own, title in zip(parts, found, titles, strict=True):
        draw_triptych(part, own, title)
    return figure


def title_of(own: Triptych) -> str:
    """The scene, and the methods that draw this picture of it."""
    return textwrap.fill(f"{own.scene.name}: {', '.join(own.methods)}", 66)


def draw_triptych(part: Any, own: Triptych, title: str) -> None:
    """Draw expected, got, difference."""
    scene = own.scene
    expected, got = picture(scene.expected), picture(own.rows)
    axes = part.subplots(1, 3)
    part.suptitle(title, fontsize=8, x=0.02, ha="left")
    for axis, what, values in zip(axes, ("expected", "got", "difference"), (expected, got, None), strict=True):
        frame(axis, scene, what)
        if values is not None:
            draw_values(axis, values, scene.kind)
    draw_difference(axes[2], expected, got, scene.kind)


def frame(axis: Axes, scene: FailureScene, title: str) -> None:
    """Set up the window: pixel squares, their centres, the edges of the triangles."""
    width, height = scene.size
    axis.set(xlim=(-MARGIN_PX, width + MARGIN_PX), ylim=(height + MARGIN_PX, -MARGIN_PX), aspect="equal")
    axis.set_axis_off()
    axis.set_title(title, fontsize=8, pad=2)
    for i in range(width + 1):
        axis.plot([i, i], [0, height], color="0.85", lw=0.5, zorder=1)
    for i in range(height + 1):
        axis.plot([0, width], [i, i], color="0.85", lw=0.5, zorder=1)
    y, x = np.mgrid[0:height, 0:width]
    axis.plot(x.ravel() + 0.5, y.ravel() + 0.5, ".", color="0.55", ms=1, zorder=3)
    for segment in edges_in_window(scene):
        axis.plot(*zip(*segment, strict=True), color="black", lw=0.8, zorder=4)


def draw_values(axis: Axes, values: NDArray[np.int32], kind: str) -> None:
    """Fill squares by count, or by triangle."""
    for (i, j), value in np.ndenumerate(values):
        if value < 0 or (kind != "wrong" and value == 0):
            continue
        color = LABEL_COLORS[value % len(LABEL_COLORS)] if kind == "wrong" else COUNT_COLORS[min(int(value), 4)]
        axis.fill([j, j + 1, j + 1, j], [i, i, i + 1, i + 1], color=color, lw=0, zorder=0)
        if kind != "wrong" and value > 1:
            axis.text(j + 0.5, i + 0.5, str(value), color="white", fontsize=8, ha="center", va="center", zorder=5)


def draw_difference(axis: Axes, expected: NDArray[np.int32], got: NDArray[np.int32], kind: str) -> None:
    """Mark missing pixels with a minus, surplus ones with a plus, other triangles with a cross."""
    for i, j in np.argwhere(expected != got).tolist():
        if kind == "wrong" and expected[i, j] >= 0 and got[i, j] >= 0:
            color, sign = OTHER, "x"
        else:
            color, sign = (GAP, "\N{MINUS SIGN}") if got[i, j] < expected[i, j] else (EXTRA, "+")
        axis.fill([j, j + 1, j + 1, j], [i, i, i + 1, i + 1], color=color, lw=0, zorder=2)
        axis.text(j + 0.5, i + 0.5, sign, color="white", fontsize=8, fontweight="bold", ha="center",
                  va="center", zorder=5)  # fmt: skip


def edges_in_window(scene: FailureScene) -> Iterator[Segment]:
    """Yield the parts of edges in the window and its margin, by Liang and Barsky's cut in fractions."""
    points = [[Fraction(c) - o for c, o in zip(p, scene.origin, strict=True)] for p in scene.points]
    edges = {tuple(sorted((t[k], t[(k + 1) % 3]))) for t in scene.triangles for k in range(3)}
    for a, b in sorted(edges):
        start, end = points[a], points[b]
        first, last = Fraction(0), Fraction(1)
        for k in range(2):
            low, high = Fraction(-MARGIN_PX), scene.size[k] + Fraction(MARGIN_PX)
            if start[k] == end[k]:
                if not low <= start[k] <= high:
                    last = first - 1
                continue
            cuts = sorted((bound - start[k]) / (end[k] - start[k]) for bound in (low, high))
            first, last = max(first, cuts[0]), min(last, cuts[1])
        if first < last:
            ends = [[float(start[k] + t * (end[k] - start[k])) for k in range(2)] for t in (first, last)]
            yield (ends[0][0], ends[0][1]), (ends[1][0], ends[1][1])
