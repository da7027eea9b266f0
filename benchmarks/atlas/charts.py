"""Charts of an atlas: heat maps of faults by method and parameter. Needs matplotlib.

Colour goes from light to dark with the logarithm of the share, so it survives print and colour-blindness; the share is
written in the cell as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from benchmarks.atlas.depth import DEPTH_FAMILIES
from benchmarks.atlas.magnified import sheets
from benchmarks.atlas.tables import steps_of
from benchmarks.harness.records import Record
from benchmarks.report.charts import write_chart

STYLE = {"font.size": 8, "axes.titlesize": 9, "svg.hashsalt": "topleft", "figure.dpi": 100,
         "hatch.linewidth": 0.5, "hatch.color": "0.6"}  # fmt: skip
COLORS = "YlGnBu"
NORM = LogNorm(1e-4, 1, clip=True)
DARK = 0.03
"""Share from which text is white."""
WITHOUT = "white: none; dot: with gaps; hatched: refuses to draw; % of edge pixels"

Row = dict[str, Any]


def draw_charts(record: Record, folder: Path) -> list[Path]:
    """Write the charts as SVG, the magnified scenes as PNG, return where they are."""
    drawn = [write_chart(make, folder, f"atlas-{name}", "svg", STYLE, 120) for name, make in charts(record)]
    return drawn + [write_chart(make, folder, f"atlas-{name}", "png", STYLE, 120) for name, make in sheets()]


def charts(record: Record) -> Iterator[tuple[str, Callable[[], Figure]]]:
    """Yield the function that draws a figure for each family of pixels, and one for those with depth."""
    for facts in record["families"]:
        if facts["name"] not in DEPTH_FAMILIES:
            yield facts["name"], partial(chart_family if len(facts["axes"]) == 1 else chart_pair, record, facts)
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
    n_steps = len(facts["n_px"])
    (what,) = facts["axes"]
    figure, axes = plt.subplots(1, 2, figsize=(2.4 + 0.72 * n_steps, 1.4 + 0.21 * len(rows)), layout="constrained",
                                sharey=True)  # fmt: skip
    panels: list[tuple[str, Callable[[Row], NDArray[np.float64]]]] = [
        ("shows the wrong triangle", lambda row: shares(row, facts, "wrong")),
        ("not drawn once", lambda row: shares(row, facts, "gaps", "overdrawn")),
    ]
    for axis, (title, values_of) in zip(axes, panels, strict=True):
        draw_map(axis, np.array([values_of(row) for row in rows]))
        axis.set_title(title, loc="left")
        axis.set_xticks(range(n_steps), steps_of(facts), rotation=0 if n_steps < 12 else 45, fontsize=7)
        axis.set_yticks(range(len(rows)), [row["entry"] for row in rows])
        axis.set_xlabel(what)
    mark_gaps(axes[1], rows)
    figure.suptitle(f"{facts['name']}: {facts['what']}\n{WITHOUT}", fontsize=8, x=0.01, ha="left")
    return figure


def chart_pair(record: Record, facts: Row) -> Figure:
    """Return a small heat map for each method of a family with two parameters: pixels not drawn once, or wrong."""
    rows = maps_of(record, facts)
    (what_y, values_y), (what_x, values_x) = facts["axes"].items()
    n_columns = 7
    figure, grid = plt.subplots(-(-len(rows) // n_columns), n_columns, figsize=(11, 6.2), layout="constrained",
                                sharex=True, sharey=True)  # fmt: skip
    for axis in grid.flat[len(rows) :]:
        axis.set_axis_off()
    for axis, row in zip(grid.flat, rows, strict=False):
        shape = len(values_y), len(values_x)
        wrong, broken = shares(row, facts, "wrong"), shares(row, facts, "gaps", "overdrawn")
        draw_map(axis, np.maximum(wrong, broken).reshape(shape), size=5)
        for step in np.flatnonzero([bool(n) for n in row["gaps"]]):
            axis.plot(step % shape[1] + 0.36, step // shape[1] - 0.34, "o", ms=1.8, color="#D55E00")
        axis.set_title(row["entry"].replace("/", "\n/"), fontsize=7, loc="left")
        axis.set_xticks(range(len(values_x)), values_x, rotation=90, fontsize=6)
        axis.set_yticks(range(len(values_y)), values_y, fontsize=6)
    figure.supxlabel(what_x, fontsize=8)
    figure.supylabel(what_y, fontsize=8)
    figure.suptitle(f"{facts['name']}: {facts['what']}, wrong or not drawn once, the larger   ({WITHOUT})", fontsize=9,
                    x=0.01, ha="left")  # fmt: skip
    return figure


def chart_depth(record: Record, deep: list[Row]) -> Figure:
    """Return heat maps of wrong pixels of the production methods, a panel for each family with clip space or depth."""
    figure, grid = plt.subplots((len(deep) + 1) // 2, 2, figsize=(10, 1.95 * ((len(deep) + 1) // 2)),
                                layout="constrained", squeeze=False)  # fmt: skip
    for axis in grid.flat[len(deep) :]:
        axis.set_axis_off()
    for axis, facts in zip(grid.flat, deep, strict=False):
        rows = maps_of(record, facts)
        draw_map(axis, np.array([shares(row, facts, "wrong") for row in rows]))
        mark_gaps(axis, rows)
        steps = steps_of(facts)
        axis.set_xticks(range(len(steps)), steps, rotation=90 if len(facts["axes"]) > 1 else 0, fontsize=6.5)
        axis.set_yticks(range(len(rows)), [row["entry"] for row in rows], fontsize=7)
        axis.set_title(f"{facts['name']}: {facts['what']}", loc="left", fontsize=7.5)
        axis.set_xlabel(", ".join(facts["axes"]), fontsize=7)
    figure.suptitle(f"shows the wrong triangle   ({WITHOUT.replace('edge pixels', 'pixels')})", fontsize=9, x=0.01,
                    ha="left")  # fmt: skip
    return figure


def draw_map(axis: Axes, values: NDArray[np.float64], size: float = 6) -> None:
    """Draw shares as colours and numbers; zeros white, refusals hatched."""
    colors = plt.get_cmap(COLORS)(NORM(np.where(values > 0, values, np.nan)).filled(0))
    colors[~(values > 0)] = 1
    axis.imshow(colors, aspect="auto", interpolation="none")
    for (i, j), value in np.ndenumerate(values):
        if np.isnan(value):
            axis.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, hatch="////", fill=False, lw=0))
        elif value > 0:
            axis.text(j, i, share_text(value), ha="center", va="center", fontsize=size,
                      color="white" if value > DARK else "black")  # fmt: skip
    height, width = values.shape
    axis.set_xticks(np.arange(width + 1) - 0.5, minor=True)
    axis.set_yticks(np.arange(height + 1) - 0.5, minor=True)
    axis.grid(which="minor", color="0.85", lw=0.5)
    axis.tick_params(which="both", length=0)
    axis.spines[:].set_color("0.7")


def mark_gaps(axis: Axes, rows: list[Row]) -> None:
    """Put a dot where there are gaps."""
    for i, row in enumerate(rows):
        steps = np.flatnonzero([bool(n) for n in row["gaps"]])
        axis.plot(steps + 0.38, np.full(len(steps), i - 0.3), "o", ms=2, color="#D55E00")


def share_text(value: float) -> str:
    """Two digits of a percentage."""
    percent = 100 * value
    if percent >= 9.95:
        return f"{percent:.0f}"
    if percent >= 0.0995:
        return f"{percent:.1f}"
    return f"{percent:.2f}".lstrip("0") if percent >= 0.005 else "<.01"
