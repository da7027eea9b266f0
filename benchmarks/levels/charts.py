"""The chart of levels of detail: error in pixels against time, a panel a mesh. Needs matplotlib."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from benchmarks.report.charts import STYLE, write_chart

COLORS = ("#000000", "#0072B2", "#009E73", "#E69F00", "#D55E00")
"""By height, near to far: M. Okabe and K. Ito, Color Universal Design, 2008."""

SMALLEST_PX = 0.02
"""Where errors stand that are nothing, on a logarithmic axis."""


def draw_charts(record: dict[str, Any], folder: Path) -> list[Path]:
    """Write the chart as PNG, return where it is."""
    return [write_chart(partial(chart_levels, record), folder, "levels", "png", STYLE, 140)]


def chart_levels(record: dict[str, Any]) -> Figure:
    """Return a panel for each mesh."""
    meshes = record["meshes"]
    n = len(meshes)
    figure, panels = plt.subplots(n, 1, figsize=(4.6, 2.9 * n + 0.8), squeeze=False, sharex=True, layout="constrained")
    for panel, mesh in zip(panels.flat, meshes, strict=True):
        draw_mesh(panel, mesh, record["tolerance"])
        panel.set_ylabel("rasterize, one thread, ms")
    panels[-1, 0].set_xlabel("outlines are off by, px (measured)")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def draw_mesh(panel: Any, mesh: dict[str, Any], tolerance: float) -> None:
    """Draw a line for each height: its levels, the full mesh on the left."""
    for color, view in zip(COLORS, mesh["views"], strict=False):
        errors = [max(row["error_px"], SMALLEST_PX) for row in view["levels"]]
        times = [min(row["turns_ms"]) for row in view["levels"]]
        label = f"{view['height_px']} px high"
        panel.plot(errors, times, "o-", color=color, mfc="white", ms=4, lw=1, label=label)
        panel.plot(errors[view["level"]], times[view["level"]], "o", color=color, ms=6)
    panel.axvline(tolerance, color="#888888", lw=0.8, ls=":")
    panel.annotate(f"{tolerance:g} px", (tolerance, 1), xycoords=("data", "axes fraction"), xytext=(3, -9),
                   textcoords="offset points", fontsize=8, color="#666666")  # fmt: skip
    panel.set_xscale("log")
    panel.set_yscale("log")
    ticks = [SMALLEST_PX, 0.1, 0.5, 1, 10, 100]
    panel.set_xticks(ticks, ["0", *(f"{tick:g}" for tick in ticks[1:])])
    panel.yaxis.set_major_locator(LogLocator(subs=(1, 3)))
    panel.yaxis.set_major_formatter("{x:g}")
    panel.minorticks_off()
    panel.set_title(f"{mesh['name']}, {mesh['n_triangles']:,} triangles")
    panel.grid(visible=True, color="#eeeeee", lw=0.6)
