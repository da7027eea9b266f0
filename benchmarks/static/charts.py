"""The chart of a record of static scenes: times faster than without clusters. Needs matplotlib."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.report.charts import write_chart
from benchmarks.static.tables import faster, is_whole, label_of

LOOKS = (("#000000", "o"), ("#0072B2", "s"), ("#009E73", "D"), ("#D55E00", "^"), ("#CC79A7", "v"))
"""Of the views of a mesh, in their order."""

KIND_COLORS = {"instances": "#0072B2", "file": "#009E73", "hills": "#E69F00", "soup": "#CC79A7", "blob": "#000000"}
KIND_NAMES = {
    "instances": "many instances",
    "file": "a scanned mesh",
    "hills": "hills, an open mesh",
    "soup": "soup",
    "blob": "lit by render",
}
TICKS = (0.5, 1, 2, 5, 10, 20, 50, 100, 200)


def draw_charts(record: dict[str, Any], folder: Path) -> list[Path]:
    """Write the chart as SVG, return where it is."""
    return [write_chart(partial(chart_static, record), folder, "static")]


def chart_static(record: dict[str, Any]) -> Figure:
    """Return a panel for each way to cull, a line for each view of the blob, and a dot for each of the other scenes."""
    others = [row for row in record["rows"] if is_shown(row)]
    others.sort(key=lambda row: (list(KIND_COLORS).index(row["kind"]), row["model"], -faster(row)))
    height = 0.9 + 0.17 * len(others)
    figure = plt.figure(figsize=(4.6, 5.6 + height), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=[5.6, height])
    first, second = upper.subplots(2, 1)
    draw_blobs(first, record, "none")
    draw_blobs(second, record, "back")
    first.legend(fontsize=8, loc="upper left")
    draw_others(third := lower.subplots(), others)
    lower.legend(*third.get_legend_handles_labels(), fontsize=8, ncols=3, loc="outside lower center")
    return figure


def is_shown(row: dict[str, Any]) -> bool:
    """Tell whether a row has a dot: other scenes than blobs by the plain call, and lit blobs."""
    if row["kind"] == "blob":
        return bool(row["verb"] == "render")
    return bool((row["cull"], row["sampling"], row["verb"]) == ("none", "center", "rasterize"))


def draw_blobs(axis: Axes, record: dict[str, Any], cull: str) -> None:
    """Draw the lines of one way to cull; hollow where the planner keeps the mesh whole."""
    own = [
        row
        for row in record["rows"]
        if row["kind"] == "blob" and row["verb"] == "rasterize" and row["cull"] == cull and row["size"][0] != 512
    ]
    for i, view in enumerate(dict.fromkeys(row["view"] for row in own)):
        color, marker = LOOKS[i % len(LOOKS)]
        points = sorted((row["n_triangles"], faster(row), is_whole(row)) for row in own if row["view"] == view)
        axis.plot([n for n, _, _ in points], [y for _, y, _ in points], color=color, lw=1.2, zorder=2)
        for n, y, is_hollow in points:
            axis.plot(n, y, marker, color=color, mfc="white" if is_hollow else color, ms=5, zorder=3)
        axis.plot([], [], color=color, marker=marker, ms=5, lw=1.2, label=view)
    axis.axhline(1, color="0.4", lw=1, zorder=1)
    axis.set(xscale="log", yscale="log", xlabel="triangles of the blob, 1920x1080", ylabel="times as fast as whole")
    axis.set_title("no culling" if cull == "none" else "back faces culled", loc="left")
    label_ticks(axis, "y")
    axis.grid(color="0.92", lw=0.6)
    axis.set_axisbelow(True)


def draw_others(axis: Axes, rows: list[dict[str, Any]]) -> None:
    """Draw a row for each scene, with its quartiles."""
    named: set[str] = set()
    for i, row in enumerate(rows):
        low, middle, high = row["faster"]
        kind = row["kind"]
        color, label = KIND_COLORS[kind], KIND_NAMES[kind] if kind not in named else None
        named.add(kind)
        axis.plot([low, high], [i, i], color=color, lw=1.5, zorder=2)
        inside = "white" if is_whole(row) else color
        axis.plot(middle, i, "o", color=color, mfc=inside, ms=5, label=label, zorder=3)
    axis.axvline(1, color="0.4", lw=1, zorder=1)
    axis.set(xscale="log", ylim=(len(rows) - 0.4, -0.6), xlabel="times as fast as whole")
    axis.set_yticks(range(len(rows)), [label_of(row) for row in rows], fontsize=8)
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="x", color="0.92", lw=0.6)
    axis.set_axisbelow(True)
    label_ticks(axis, "x")


def label_ticks(axis: Axes, which: str) -> None:
    """Label a logarithmic axis with round numbers."""
    low, high = axis.get_ylim() if which == "y" else axis.get_xlim()
    ticks = [tick for tick in TICKS if min(low, 0.95) <= tick <= max(high, 1.05)]
    getattr(axis, f"set_{which}ticks")(ticks, [f"{tick:g}" for tick in ticks])
    getattr(axis, f"set_{which}ticks")([], minor=True)
