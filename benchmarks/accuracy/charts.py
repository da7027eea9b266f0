"""Charts of an accuracy record, time against error, and the list of all charts. Needs matplotlib."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from benchmarks.accuracy import speed_charts
from benchmarks.accuracy.tables import with_no_snap
from benchmarks.report.charts import LOOKS, Look, draw_grid, duration, write_chart
from benchmarks.scenes.families import NO_SNAP

FAR_AWAY = 1e12
"""Beyond every axis: where the ends of a front go."""

Point = tuple[float, float]


PEER_LETTERS = {
    "llvmpipe": "Ll", "opencv": "Cv", "pillow": "Pi", "deodr": "De", "datashader": "Da", "skia": "Sk", "cairo": "Ca",
    "skimage": "Si", "agg": "Ag", "aggdraw": "Ad", "blend2d": "Bl",
}  # fmt: skip
"""The text in the marker of a peer."""
PEER_NAMES = {"opencv": "OpenCV", "pillow": "Pillow", "skimage": "scikit-image"}
PEER_LOOK: dict[str, Any] = {"marker": "s", "ms": 12, "mfc": "#FFFBE6", "mec": "#8A1C1C", "mew": 1}
SAMPLING_LABELS = {"center": "1", "msaa2": "2", "msaa4": "4", "msaa8": "8", "msaa16": "16", "area": "topleft, area"}


def chart_peers(record: dict[str, Any]) -> Figure:
    """Return the chart of topleft beside other programs alone: the second family, a name beside each mark."""
    family = record["families"][:2][-1]
    none_wrong = 0.3e6 / family["n_edge_px"]  # where zero stands on a logarithmic axis
    rows = [row for row in with_no_snap(record) if (row["family"], row["method"]) == (family["name"], "auto")]
    figure, axis = plt.subplots(figsize=(4.6, 3.9), layout="constrained")
    draw_grid(axis)
    for row in rows + rows_of(record, "peers", family):
        x, y = row["ns_triangle"], 1e6 * row["wrong_px"] / family["n_edge_px"] or none_wrong
        if "peer" in row:
            axis.plot(x, y, "s", color="#8A1C1C", ms=6)
            is_low = row["peer"] in ("datashader", "pillow")  # whose neighbour has its name above the mark
            axis.annotate(PEER_NAMES.get(row["peer"], row["peer"]), (x, y), (0, -13 if is_low else 7),
                          textcoords="offset points", ha="center", color="#8A1C1C")  # fmt: skip
        else:
            bits = "exact" if row["precision"] == NO_SNAP else f"{row['precision']} bits"
            axis.plot(x, y, "o", color="black", ms=7)
            axis.annotate(f"topleft, {bits}", (x, y), (-7, 0), textcoords="offset points", ha="right", va="center")
    axis.axhspan(none_wrong / 3, none_wrong * 1.8, color="0.93", zorder=0)
    axis.set(xscale="log", yscale="log", xlim=(1.5, 3e5), ylim=(none_wrong / 3, 3e6))
    axis.set_title(family["what"], loc="left")
    axis.set(xlabel="time per triangle", ylabel="wrong of a million edge pixels (grey: none)")
    axis.xaxis.set_major_formatter(lambda value, _: duration(value))
    axis.xaxis.set_minor_locator(NullLocator())
    return figure


def chart_coverage(record: dict[str, Any]) -> Figure:
    """Return chart (a): a panel for each family, a point for each method and precision, the Pareto front."""
    figure, axes = panels(record)
    for axis, family in zip(axes, record["families"], strict=True):
        n_edge_px = family["n_edge_px"]
        none_wrong = 0.3e6 / n_edge_px  # where zero stands on a logarithmic axis

        def place(row: dict[str, Any], n_edge_px: int = n_edge_px, none_wrong: float = none_wrong) -> Point:
            return row["ns_triangle"], 1e6 * row["wrong_px"] / n_edge_px or none_wrong

        twins, peers = (rows_of(record, name, family) for name in ("pure", "peers"))
        rows = [row for row in with_no_snap(record) if row["family"] == family["name"]]
        points = [place(row) for row in rows]
        draw_front(axis, points + [place(row) for row in twins + peers])
        for row, point in zip(rows, points, strict=True):
            family_name, _, variant = row["method"].partition("/")
            look = LOOKS.get(family_name, Look(family_name, "#999999", "h"))
            axis.plot(*point, look.marker, ms=8 if look.marker == "*" else 6, mec="black", mew=0.6,
                      mfc="white" if variant else look.color, zorder=3)  # fmt: skip
        for row in twins:
            look = LOOKS[row["method"].partition("/")[0]]
            axis.plot(*place(row), "h", ms=9, mec=look.color, mfc="white", mew=2, zorder=4)
        for row in peers:
            draw_peer(axis, row["peer"], place(row))
        for row, (_, y) in zip(rows, points, strict=True):
            if row["method"] == "auto":
                bits = "exact" if row["precision"] == NO_SNAP else f"{row['precision']} bits"
                axis.text(0.015, y, f"topleft, {bits}", transform=axis.get_yaxis_transform(), va="center",
                          fontsize=8, color="0.25")  # fmt: skip
        axis.set(xscale="log", yscale="log", ylim=(none_wrong / 3, 3e6))
        axis.axhspan(none_wrong / 3, none_wrong * 1.8, color="0.93", zorder=0)
        axis.text(0.99, none_wrong * 0.42, f"none wrong of {n_edge_px:,}", transform=axis.get_yaxis_transform(),
                  ha="right", fontsize=8, color="0.35")  # fmt: skip
        times = [row["ns_triangle"] for row in rows + twins + peers]
        low, high = min(times), max(times)
        axis.set_xlim(low / (high / low) ** 0.38, high * (high / low) ** 0.06)
    finish(figure, axes, "wrong pixels per million edge pixels")
    seen = {row["method"].partition("/")[0] for row in record["coverage"]}
    handles = [
        Line2D([], [], color=look.color, marker=look.marker, mec="black", mew=0.6, ls="", ms=7, label=look.label)
        for name, look in LOOKS.items()
        if name in seen
    ]
    handles += [
        Line2D([], [], color="white", marker="o", mec="black", mew=0.6, ls="", ms=7, label="hollow: a variant"),
        Line2D([], [], color="white", marker="h", mec="black", mew=2, ls="", ms=8, label="hexagon: pure Python"),
        front_handle(),
        *peer_handles(record["peers"]),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, labelspacing=0.5, columnspacing=1)
    return figure


def chart_antialiasing(record: dict[str, Any]) -> Figure:
    """Return chart (b): a panel for each family, a point for each way to sample and each peer."""
    figure, axes = panels(record)
    for axis, family in zip(axes, record["families"], strict=True):
        rows = rows_of(record, "antialiasing", family)
        points = [(row["ns_triangle"], row["rms"]) for row in rows]
        draw_front(axis, points)
        own = [(row, point) for row, point in zip(rows, points, strict=True) if "sampling" in row]
        samples = [point for row, point in own if row["sampling"] != "area"]
        axis.plot(*zip(*samples, strict=True), color="black", lw=0.8, zorder=2)
        for row, point in own:
            axis.plot(*point, "o", color="black", ms=6, zorder=3)
            axis.annotate(SAMPLING_LABELS.get(row["sampling"], row["sampling"]), point, (0, -12),
                          textcoords="offset points", ha="center", fontsize=8)  # fmt: skip
        for row, point in zip(rows, points, strict=True):
            if "peer" in row:
                draw_peer(axis, row["peer"], point)
        axis.set(xscale="log", yscale="log", ylim=(min(row["rms"] for row in rows) / 3, 1))
        low, high = (of(row["ns_triangle"] for row in rows) for of in (min, max))
        axis.set_xlim(low / 1.5, high * 2)
    finish(figure, axes, "RMS error of coverage, edge pixels")
    label = "topleft: samples a pixel, or exact area"
    handles = [Line2D([], [], color="black", marker="o", lw=0.8, ms=6, label=label), front_handle()]
    handles += peer_handles(record["antialiasing"])
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, columnspacing=1)
    return figure


def rows_of(record: dict[str, Any], name: str, family: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of a list that belong to the family and have figures."""
    return [row for row in record[name] if row["family"] == family["name"] and "skipped" not in row]


def draw_peer(axis: Axes, name: str, point: Point) -> None:
    """Draw the marker that only peers have, a square with a letter."""
    axis.plot(*point, **PEER_LOOK, zorder=5)
    axis.annotate(PEER_LETTERS.get(name, "?"), point, (0, -0.4), textcoords="offset points", ha="center", va="center",
                  fontsize=8, color="#8A1C1C", fontweight="bold", zorder=6)  # fmt: skip


def peer_handles(rows: list[dict[str, Any]]) -> list[Line2D]:
    """Return the entries of a legend for the peers that have figures."""
    names = dict.fromkeys(row["peer"] for row in rows if "peer" in row and "skipped" not in row)
    return [Line2D([], [], **PEER_LOOK, ls="", label=f"{PEER_LETTERS.get(name, '?')}: {name}") for name in names]


def front_handle() -> Line2D:
    """Return the entry of a legend for the Pareto front."""
    return Line2D([], [], color="0.45", ls="--", lw=1, label="Pareto front")


def panels(record: dict[str, Any]) -> tuple[Figure, list[Axes]]:
    """Return a figure that a phone can show, a panel below the other for each family of triangles."""
    families = record["families"]
    n = len(families)
    figure, grid = plt.subplots(n, 1, figsize=(4.6, 3.1 * n + 1.6), squeeze=False, layout="constrained")
    for axis, family in zip(grid.flat, families, strict=True):
        axis.set_title(f"{family['name']}: {family['what']}", loc="left")
        draw_grid(axis)
    return figure, list(grid.flat)


def finish(figure: Figure, axes: list[Axes], y_label: str) -> None:
    """Name the axes once, ticks with units on x."""
    for axis in axes:
        low, high = axis.get_xlim()
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 300 * low else (1,)))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.xaxis.set_major_formatter(lambda value, _: duration(value))
    axes[-1].set_xlabel("time per triangle")
    figure.supylabel(y_label, fontsize=9)


def draw_front(axis: Axes, points: list[Point]) -> None:
    """Draw the border that no method passes: faster to the left, more exact below."""
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


CHARTS: Mapping[str, Callable[[dict[str, Any]], Figure]] = {
    "accuracy-peers": chart_peers,
    "accuracy-coverage": chart_coverage,
    "accuracy-antialiasing": chart_antialiasing,
    "accuracy-depth": speed_charts.chart_depth,
    "speed-sizes": speed_charts.chart_sizes,
    "speed-tutorial": speed_charts.chart_tutorial,
}
"""By the name of the file."""


def draw_charts(record: dict[str, Any], folder: Path) -> list[Path]:
    """Write the charts as SVG, return where they are."""
    return [write_chart(partial(make, record), folder, name) for name, make in CHARTS.items()]
