"""Charts of an accuracy record: time against error. The only module that needs matplotlib.

Shapes tell families of methods apart as well as colours, which are those of M. Okabe and K. Ito, Color Universal
Design, 2008; both survive print and colour-blindness.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl

mpl.use("Agg")

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator


class Look(NamedTuple):
    """How the points of a method look."""

    label: str
    color: str
    marker: str


LOOKS = {
    "auto": Look("engine (auto)", "#000000", "o"),
    "edge": Look("engine, edge", "#0072B2", "s"),
    "scanline": Look("engine, scanline", "#56B4E9", "D"),
    "edge_increment": Look("edge_increment", "#009E73", "^"),
    "zigzag": Look("zigzag", "#009E73", "v"),
    "point_in_triangle": Look("point_in_triangle", "#D55E00", "P"),
    "bresenham_scanline": Look("bresenham_scanline", "#CC79A7", "X"),
    "lerp_scanline": Look("lerp_scanline", "#E69F00", "<"),
    "row_crossing": Look("row_crossing", "#F0E442", ">"),
    "float_barycentric": Look("float_barycentric", "#999999", "*"),
}
"""By the first part of the name; variants look alike, with a hollow marker."""

SAMPLING_MARKERS = "osD^vP<>X*"
STYLE = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "topleft",
         "axes.titlesize": 10, "legend.frameon": False, "figure.dpi": 100}  # fmt: skip

FAR_AWAY = 1e12
"""Beyond every axis: where the ends of a front go."""

Point = tuple[float, float]


def draw_charts(record: dict[str, Any], folder: Path) -> list[Path]:
    """Write the charts as PNG and SVG, return where they are."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    with plt.rc_context(STYLE):
        for name, figure in (("coverage", chart_coverage(record)), ("antialiasing", chart_antialiasing(record))):
            for suffix in ("png", "svg"):
                paths.append(folder / f"accuracy-{name}.{suffix}")
                metadata = {"Date": None} if suffix == "svg" else {}
                figure.savefig(paths[-1], dpi=160, metadata=metadata)
            plt.close(figure)
    return paths


def chart_coverage(record: dict[str, Any]) -> Figure:
    """Return chart (a): a panel for each family, a point for each method and precision, the Pareto front."""
    figure, axes = panels(record)
    for axis, family in zip(axes, record["families"], strict=True):
        n_edge_px = family["n_edge_px"]
        none_wrong = 0.3e6 / n_edge_px  # where zero stands on a logarithmic axis
        rows = [row for row in record["coverage"] if row["family"] == family["name"]]
        points = [(row["ns_triangle"], 1e6 * row["wrong_px"] / n_edge_px or none_wrong) for row in rows]
        draw_front(axis, points)
        for row, point in zip(rows, points, strict=True):
            family_name, _, variant = row["method"].partition("/")
            look = LOOKS.get(family_name, Look(family_name, "#999999", "h"))
            axis.plot(*point, look.marker, ms=8 if look.marker == "*" else 6, mec="black", mew=0.6,
                      mfc="white" if variant else look.color, zorder=3)  # fmt: skip
        for row, (_, y) in zip(rows, points, strict=True):
            if row["method"] == "auto":
                axis.text(0.015, y, f"{row['precision']} bits", transform=axis.get_yaxis_transform(), va="center",
                          fontsize=8, color="0.25")  # fmt: skip
        axis.set(xscale="log", yscale="log", ylim=(none_wrong / 3, 3e6))
        axis.axhspan(none_wrong / 3, none_wrong * 1.8, color="0.93", zorder=0)
        axis.text(0.99, none_wrong * 0.42, f"none wrong of {n_edge_px:,}", transform=axis.get_yaxis_transform(),
                  ha="right", fontsize=7, color="0.35")  # fmt: skip
        low, high = min(x for x, _ in points), max(x for x, _ in points)
        axis.set_xlim(low / (high / low) ** 0.22, high * (high / low) ** 0.05)
    finish(figure, axes, "wrong pixels per million edge pixels")
    seen = {row["method"].partition("/")[0] for row in record["coverage"]}
    handles = [
        Line2D([], [], color=look.color, marker=look.marker, mec="black", mew=0.6, ls="", ms=7, label=look.label)
        for name, look in LOOKS.items()
        if name in seen
    ]
    handles += [
        Line2D([], [], color="white", marker="o", mec="black", mew=0.6, ls="", ms=7, label="hollow: a variant"),
        Line2D([], [], color="0.45", ls="--", lw=1, label="Pareto front"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8.5, columnspacing=1.2)
    return figure


def chart_antialiasing(record: dict[str, Any]) -> Figure:
    """Return chart (b): a panel for each family, a point for each way to sample."""
    figure, axes = panels(record)
    ways = list(dict.fromkeys(row["sampling"] for row in record["antialiasing"]))
    colors = [look.color for look in LOOKS.values()]
    for axis, family in zip(axes, record["families"], strict=True):
        rows = [row for row in record["antialiasing"] if row["family"] == family["name"]]
        draw_front(axis, [(row["ns_triangle"], row["rms"]) for row in rows])
        for row in rows:
            i = ways.index(row["sampling"])
            axis.plot(row["ns_triangle"], row["rms"], SAMPLING_MARKERS[i % 10], color=colors[i % 10], mec="black",
                      ms=7, zorder=3)  # fmt: skip
            axis.annotate(row["sampling"], (row["ns_triangle"], row["rms"]), (7, 4), textcoords="offset points")
        axis.set(xscale="log", yscale="log", ylim=(min(row["rms"] for row in rows) / 3, 1))
        low, high = (of(row["ns_triangle"] for row in rows) for of in (min, max))
        axis.set_xlim(low / 1.5, high * 2)
    finish(figure, axes, "RMS error of coverage, edge pixels")
    return figure


def panels(record: dict[str, Any]) -> tuple[Figure, list[Axes]]:
    """Return a figure of two columns, a panel for each family of triangles."""
    families = record["families"]
    figure, grid = plt.subplots((len(families) + 1) // 2, 2, figsize=(8, 7.6), squeeze=False, layout="constrained")
    axes = list(grid.flat)
    for axis in axes[len(families) :]:
        axis.set_axis_off()
    for axis, family in zip(axes, families, strict=False):
        axis.set_title(f"{family['name']}: {family['what']}", loc="left")
        axis.grid(which="major", color="0.88", lw=0.6)
        axis.set_axisbelow(True)
    return figure, axes[: len(families)]


def finish(figure: Figure, axes: list[Axes], y_label: str) -> None:
    """Name the axes once a row or column, ticks without exponents on x."""
    for i, axis in enumerate(axes):
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.xaxis.set_major_formatter(lambda value, _: f"{value / 1000:g}k" if value >= 10_000 else f"{value:,.0f}")
        if i >= len(axes) - 2:
            axis.set_xlabel("time per triangle, ns")
    figure.supylabel(y_label, fontsize=9)


def draw_front(axis: Axes, points: list[Point]) -> None:
    """Draw the border of what no method does better: faster to the left, more exact below."""
    front = list(pareto_front(points))
    if not front:
        return
    corners = [(front[0][0], FAR_AWAY), *front, (FAR_AWAY, front[-1][1])]
    axis.step(*zip(*corners, strict=True), where="post", color="0.45", ls="--", lw=1, zorder=1)


def pareto_front(points: list[Point]) -> Iterator[Point]:
    """Yield the points that no other beats in one figure without losing in the other, from the left."""
    best = float("inf")
    for x, y in sorted(points):
        if y < best:
            best = y
            yield x, y
