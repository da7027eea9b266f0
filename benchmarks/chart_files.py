"""Charts as files or as text for a report, and those of an accuracy record. Needs matplotlib."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from benchmarks import speed_charts
from benchmarks.charts import STYLE, chart_antialiasing, chart_coverage

CHARTS: Mapping[str, Callable[[dict[str, Any]], Figure]] = {
    "accuracy-coverage": chart_coverage,
    "accuracy-antialiasing": chart_antialiasing,
    "accuracy-depth": speed_charts.chart_depth,
    "speed-sizes": speed_charts.chart_sizes,
    "speed-scaling": speed_charts.chart_scaling,
    "speed-tutorial": speed_charts.chart_tutorial,
}
"""By the name of the file."""


def draw_charts(record: dict[str, Any], folder: Path) -> list[Path]:
    """Write the charts as PNG and SVG, return where they are."""
    return [path for name, make in CHARTS.items() for path in write_chart(partial(make, record), folder, name)]


def write_chart(make: Callable[[], Figure], folder: Path, name: str) -> list[Path]:
    """Write a chart as PNG and SVG, return where they are."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for suffix, data in figure_bytes(make, ("png", "svg")).items():
        paths.append(folder / f"{name}.{suffix}")
        paths[-1].write_bytes(data)
    return paths


def chart_bytes(record: dict[str, Any], name: str, suffixes: Sequence[str]) -> dict[str, bytes]:
    """Return a chart of an accuracy record as PNG or SVG."""
    return figure_bytes(partial(CHARTS[name], record), suffixes)


def figure_bytes(make: Callable[[], Figure], suffixes: Sequence[str]) -> dict[str, bytes]:
    """Return a chart as PNG or SVG; the same record gives the same bytes."""
    found = {}
    with plt.rc_context(STYLE):
        figure = make()
        for suffix in suffixes:
            target = io.BytesIO()
            metadata = {"Date": None} if suffix == "svg" else {}
            figure.savefig(target, format=suffix, dpi=160, metadata=metadata)
            found[suffix] = target.getvalue()
        plt.close(figure)
    return found
