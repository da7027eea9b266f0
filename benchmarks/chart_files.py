"""Charts as files or as text for a report, and those of an accuracy record. Needs matplotlib."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
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
    """Write the charts as SVG, return where they are."""
    return [write_chart(partial(make, record), folder, name) for name, make in CHARTS.items()]


def write_chart(make: Callable[[], Figure], folder: Path, name: str) -> Path:
    """Write a chart as SVG, return where it is."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.svg"
    path.write_bytes(figure_svg(make))
    return path


def chart_svg(record: dict[str, Any], name: str) -> bytes:
    """Return a chart of an accuracy record as SVG."""
    return figure_svg(partial(CHARTS[name], record))


def figure_svg(make: Callable[[], Figure]) -> bytes:
    """Return a chart as SVG; the same record gives the same bytes."""
    with plt.rc_context(STYLE):
        figure = make()
        target = io.BytesIO()
        figure.savefig(target, format="svg", metadata={"Date": None})
        plt.close(figure)
    return target.getvalue()
