"""Charts of an atlas: heat maps of faults by method and parameter. Needs matplotlib.

Colour goes from light to dark with the logarithm of the share, so it survives print and colour-blindness.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from benchmarks.atlas.depth import DEPTH_FAMILIES
from benchmarks.atlas.magnified import sheets
from benchmarks.atlas.tables import steps_of
from benchmarks.harness.records import Record
from benchmarks.report.charts import write_chart

STYLE = {"font.size": 8, "axes.titlesize": 9, "svg.hashsalt": "topleft", "figure.dpi": 100,
         "hatch.linewidth": 0.5, "hatch.color": "0.6"}  # fmt: skip
CLASSES = ((1e-3, "#C7E9B4", "below 0.1 %"), (1e-2, "#41B6C4", "below 1 %"), (1e-1, "#225EA8", "below 10 %"),
           (np.inf, "#081D58", "10 % and more"))  # fmt: skip
"""Shares of pixels, their colours from light to dark, and their names."""
WIDTH = 4.6
"""Inches of a chart that a phone shows with letters of 9 px."""

GAP = "#D55E00"
BROKEN = ("gaps", "overdrawn")

Row = dict[str, Any]


def draw_charts(record: Record, folder: Path) -> list[Path]:
    """Write the charts as SVG, the magnified scenes as PNG, return where they are."""
    drawn = [write_chart(make, folder, f"atlas-{name}", "svg", STYLE, 120) for name, make in charts(record)]
    return drawn + [write_chart(make, folder, f"atlas-{name}", "png", STYLE, 120) for name, make in sheets()]


def charts(record: Record) -> Iterator[tuple[str, Callable[[], Figure]]]:
    """Yield the function that draws a figure for each family of pixels with one parameter, and one for depth."""
    for facts in record["families"]:
        if facts["name"] not in DEPTH_FAMILIES and len(facts["axes"]) == 1:
            yield facts["name"], partial(chart_family, record, facts)
    if deep := [facts for facts in record["families"] if facts["name"] in DEPTH_FAMILIES]:
        yield "depth", partial(chart_depth, record, deep)


def shares(row: Row, facts: Row, *fields: str) -> NDArray[np.float64]:
    """Return the share of pixels of each step, NaN where the method refuses."""
    n_px = np.array(facts["n_px"], float)
    counts = [np.array([np.nan if n is None else n for n in row[field]], float) for field in fields]
    return np.sum(counts, axis=0) / n_px


def maps_of(record: Record, facts: Row) -> list[Row]:
    """Return the rows of a family."""
    return [row for row in record["maps"] if row["family"] == facts["name"]]


def chart_family(record: Record, facts: Row) -> Figure:
    """Return the heat maps of a family with one parameter: wrong triangles, and pixels not drawn once."""
    rows = maps_of(record, facts)
    (what,) = facts["axes"]
    figure, axes = plt.subplots(2, 1, figsize=(WIDTH, 1.9 + 0.3 * len(rows)), layout="constrained", sharex=True)
    for axis, title, fields in zip(
        axes, ("shows the wrong triangle", "not drawn once"), (("wrong",), BROKEN), strict=True
    ):
        draw_map(axis, rows, facts, *fields)
        axis.set_title(title, loc="left")
    mark_gaps(axes[1], rows)
    axes[1].set_xlabel(what)
    return name_colors(figure, "edge pixels")


def chart_depth(record: Record, deep: list[Row]) -> Figure:
    """Return heat maps of wrong pixels of the production methods, a panel for each family with clip space or depth."""
    figure, axes = plt.subplots(len(deep), 1, figsize=(WIDTH, 1.8 * len(deep) + 0.6), layout="constrained",
                                squeeze=False)  # fmt: skip
    for axis, facts in zip(axes.flat, deep, strict=True):
        rows = maps_of(record, facts)
        draw_map(axis, rows, facts, "wrong")
        mark_gaps(axis, rows)
        axis.set_title(f"{facts['name']}: {facts['what']}", loc="left")
        axis.set_xlabel(", ".join(facts["axes"]))
    return name_colors(figure, "pixels that show the wrong triangle")


def draw_map(axis: Axes, rows: list[Row], facts: Row, *fields: str) -> None:
    """Draw shares as colours; zeros white, refusals hatched."""
    values = np.array([shares(row, facts, *fields) for row in rows])
    colors = np.ones((*values.shape, 3))
    for limit, color, _ in reversed(CLASSES):
        colors[(values > 0) & (values < limit)] = to_rgb(color)
    axis.imshow(colors, aspect="auto", interpolation="none")
    for i, j in np.argwhere(np.isnan(values)):
        axis.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, hatch="////", fill=False, lw=0))
    height, width = values.shape
    axis.set_xticks(range(width), steps_of(facts), rotation=90)
    axis.set_yticks(range(height), [row["entry"] for row in rows])
    axis.set_xticks(np.arange(width + 1) - 0.5, minor=True)
    axis.set_yticks(np.arange(height + 1) - 0.5, minor=True)
    axis.grid(which="minor", color="0.85", lw=0.5)
    axis.tick_params(which="both", length=0)
    axis.spines[:].set_color("0.7")


def name_colors(figure: Figure, of: str) -> Figure:
    """Put the names of colours and marks under the figure; return it."""
    handles: list[Any] = [Patch(facecolor=color, label=label) for _, color, label in CLASSES]
    handles += [Line2D([], [], ls="", marker="o", ms=4, color=GAP, label="with gaps"),
                Patch(facecolor="white", hatch="////", label="refuses")]  # fmt: skip
    figure.legend(handles=handles, title=f"share of the {of}; white: none", loc="outside lower center", ncols=3,
                  frameon=False)  # fmt: skip
    return figure


def mark_gaps(axis: Axes, rows: list[Row]) -> None:
    """Put a dot where there are gaps."""
    for i, row in enumerate(rows):
        steps = np.flatnonzero([bool(n) for n in row["gaps"]])
        axis.plot(steps, np.full(len(steps), i), "o", ms=4, color=GAP)
