"""The chart of a record of choices: a dot for each scene. Needs matplotlib."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from benchmarks.choices.tables import FAR, NEAR, by_choice, mean
from benchmarks.report.charts import write_chart

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999", "#8A1C1C", "#7A6A00")
MARKERS = "osD^vPX<>h"


def draw_charts(record: dict[str, Any], folder: Path) -> list[Path]:
    """Write the chart as SVG, return where it is."""
    return [write_chart(partial(chart_choices, record), folder, "choices")]


def chart_choices(record: dict[str, Any]) -> Figure:
    """Return a row for each choice: time of the planner's way by that of the best, a dot a scene, a bar the mean."""
    rows = by_choice(record)
    kinds = list(dict.fromkeys(row["kind"] for row in record["rows"]))
    figure, axis = plt.subplots(figsize=(4.6, 2.6 + 0.42 * len(rows)), layout="constrained")
    rng = np.random.default_rng(1)
    for i, own in enumerate(rows.values()):
        lift = rng.uniform(-0.28, 0.28, len(own))
        for k, kind in enumerate(kinds):
            at = [j for j, row in enumerate(own) if row["kind"] == kind]
            axis.plot([own[j]["ratio"] for j in at], i + lift[at], MARKERS[k % 10], color=COLORS[k % 10], ms=4,
                      mec="white", mew=0.4, zorder=3)  # fmt: skip
        axis.plot([mean(own)] * 2, [i - 0.4, i + 0.4], color="black", lw=2, zorder=4)
    worst = max(row["ratio"] for row in record["rows"])
    for line, style in ((NEAR, "--"), (FAR, "-")):
        axis.axvline(line, color="#8A1C1C", lw=1, ls=style, zorder=1)
        axis.text(line, -1.1, f"{line:g}", color="#8A1C1C", ha="center", va="bottom", fontsize=8)
    axis.set(xscale="log", xlim=(0.985, max(1.7, worst * 1.05)), ylim=(len(rows) - 0.4, -1.0))
    ticks = [tick for tick in (1, 1.1, 1.2, 1.3, 1.5, 2, 3, 5, 10) if tick < max(1.7, worst * 1.05)]
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_xticks([], minor=True)
    axis.set_yticks(range(len(rows)), list(rows))
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="x", color="0.9", lw=0.6)
    axis.set_axisbelow(True)
    axis.set_xlabel("time of what is chosen, by that of the best way\n(black: mean over the scenes)")
    handles = [
        plt.Line2D([], [], ls="", marker=MARKERS[k % 10], color=COLORS[k % 10], mec="white", mew=0.4, ms=6, label=kind)
        for k, kind in enumerate(kinds)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8)
    return figure
