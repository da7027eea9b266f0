"""Charts (c) to (e) of an accuracy record: depth, time by size, pictures a second.

Needs matplotlib.
"""

from __future__ import annotations

from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator

from benchmarks.accuracy.tutorial import QUOTED
from benchmarks.harness.records import Record
from benchmarks.report.charts import LOOKS, count_text, draw_grid, duration

FORMAT_LOOKS = {
    "topleft, reversed": ("#000000", "-", "o", "float32, 1 near to 0 far (topleft)"),
    "topleft": ("#0072B2", "-", "s", "float32, 0 near to 1 far (topleft)"),
    "24-bit integer": ("#D55E00", "--", "^", "24-bit integer"),
    "float32 arithmetic": ("#009E73", ":", "v", "float32, and calculated in float32"),
    "16-bit integer": ("#999999", "-", "D", "16-bit integer"),
}


def chart_depth(record: Record) -> Figure:
    """Return chart (c): a panel for each near/far ratio, a line for each format."""
    ratios = list(dict.fromkeys(row["ratio"] for row in record["depth"]))
    n = len(ratios)
    figure, axes = plt.subplots(n, 1, figsize=(4.6, 2.6 * n + 1), sharex=True, layout="constrained", squeeze=False)
    for axis, ratio in zip(axes.flat, ratios, strict=True):
        for name, (color, line, marker, label) in FORMAT_LOOKS.items():
            rows = [row for row in record["depth"] if (row["format"], row["ratio"]) == (name, ratio)]
            shares = [100 * row["wrong_px"] / row["n_px"] for row in rows]
            axis.plot([row["bits"] for row in rows], shares, color=color, ls=line, marker=marker, ms=3.5, lw=1.4,
                      markevery=2, label=label)  # fmt: skip
        bits = [row["bits"] for row in record["depth"]]
        axis.set(xlim=(min(bits), max(bits)), ylim=(-1, 53))
        axis.set_title(f"far plane {ratio:,} x near plane", loc="left")
        axis.set_xticks(range(4, max(bits) + 1, 4), [f"$2^{{-{tick}}}$" for tick in range(4, max(bits) + 1, 4)])
        draw_grid(axis)
    figure.supylabel("pixels that show the sheet behind, %", fontsize=9)
    axes[-1, 0].set_xlabel("gap between the sheets, as a part of their distance")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", fontsize=8)
    return figure


def chart_sizes(record: Record) -> Figure:
    """Return chart (d): time per triangle by its area, a line for each method, and the time of memory."""
    figure, axis = plt.subplots(figsize=(4.6, 5.6), layout="constrained")
    rows = [row for row in record["sizes"] if "/" not in row["method"]]
    for name in dict.fromkeys(row["method"] for row in rows):
        own = [row for row in rows if row["method"] == name and row["ns_triangle"] > 0]
        look = LOOKS[name]
        axis.plot([row["area_px"] for row in own], [row["ns_triangle"] for row in own], color=look.color,
                  marker=look.marker, ms=5.5, mec="black", mew=0.5, lw=1.3, label=look.label)  # fmt: skip
        if name == "auto":
            middle = own[len(own) // 3]
            axis.annotate("topleft", (middle["area_px"], middle["ns_triangle"]), (4, -12), textcoords="offset points")
    areas = [row["area_px"] for row in rows]
    memory = record["memory"]
    floors = (("frame", "--", "memset of the area, in the cache"), ("stream", ":", "the same, in memory"))
    for key, line, label in floors:
        rate = memory[f"{key}_ns_byte"]
        ends = [min(areas), max(areas)]
        axis.plot(ends, [area * rate for area in ends], color="0.4", ls=line, lw=1.2, label=label)
    lowest = min((row["ns_triangle"] for row in rows if row["ns_triangle"] > 0), default=1.0)
    axis.set(xscale="log", yscale="log", ylim=(lowest / 3, None))
    axis.set(xlabel="area of the triangle, pixels", ylabel="time per triangle")
    axis.yaxis.set_major_formatter(lambda value, _: duration(value))
    axis.xaxis.set_major_locator(LogLocator(base=100))
    axis.xaxis.set_major_formatter(lambda value, _: count_text(value))
    draw_grid(axis)
    figure.legend(loc="outside lower center", fontsize=8, ncols=2)
    return figure


def chart_tutorial(record: Record) -> Figure:
    """Return chart (e): pictures of eleven triangles a second, fills alone, and by calls."""
    rows = sorted(record["tutorial"], key=lambda row: row["fills"])
    figure, axis = plt.subplots(figsize=(4.6, 0.25 * len(rows) + 2.1), layout="constrained")
    for i, row in enumerate(rows):
        color = "#FFFFFF" if row["is_pure"] else LOOKS[row["method"].partition("/")[0]].color
        axis.barh(i, row["fills"], color=color, height=0.62, edgecolor="black", lw=0.5,
                  hatch="////" if row["is_pure"] else "")  # fmt: skip
        if not row["is_pure"]:
            axis.plot(row["calls"], i, "D", color="white", mec="black", ms=5)
        axis.text(row["fills"] * 1.1, i, count_text(row["fills"]), va="center", fontsize=8)
        if row["method"] in QUOTED:
            axis.plot(QUOTED[row["method"]], i, "*", color="white", mec="black", ms=11, zorder=4)
    names = [row["method"] for row in rows]
    axis.set_yticks(range(len(rows)), [LOOKS[name].label if name in LOOKS else name for name in names])
    low, high = (of(row["fills"] for row in rows) for of in (min, max))
    axis.set(xscale="log", xlim=(low / 2, high * 3), ylim=(-0.6, len(rows) - 0.4))
    axis.set_xlabel("pictures a second, 640x400")
    axis.xaxis.set_major_locator(LogLocator(base=100))
    axis.xaxis.set_major_formatter(lambda value, _: count_text(value))
    axis.grid(axis="x", color="0.88", lw=0.6)
    axis.set_axisbelow(True)
    handles = [
        Patch(facecolor="0.75", edgecolor="black", lw=0.5, label="fills alone"),
        Patch(facecolor="white", edgecolor="black", lw=0.5, hatch="////", label="pure Python and NumPy"),
        Line2D([], [], marker="D", color="white", mec="black", ms=5, ls="", label="whole calls, with checks and clear"),
        Line2D([], [], marker="*", color="white", mec="black", ms=11, ls="", label="what a tutorial reports"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8)
    return figure
