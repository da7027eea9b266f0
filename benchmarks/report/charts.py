"""Charts: how they look, and how they become files. Needs matplotlib.

Shapes tell families of methods apart as well as colours, which are those of M. Okabe and K. Ito, Color Universal
Design, 2008; both survive print and colour-blindness.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl

mpl.use("Agg")

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

Style = Mapping[str, Any]

STYLE = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "topleft",
         "axes.titlesize": 10, "legend.frameon": False, "figure.dpi": 100}  # fmt: skip


class Look(NamedTuple):
    """How the points of a method look."""

    label: str
    color: str
    marker: str


LOOKS = {
    "auto": Look("topleft (auto)", "#000000", "o"),
    "edge": Look("topleft, edge", "#0072B2", "s"),
    "scanline": Look("topleft, scanline", "#56B4E9", "D"),
    "edge_increment": Look("edge_increment", "#009E73", "^"),
    "zigzag": Look("zigzag", "#009E73", "v"),
    "point_in_triangle": Look("point_in_triangle", "#D55E00", "P"),
    "bresenham_scanline": Look("bresenham_scanline", "#CC79A7", "X"),
    "lerp_scanline": Look("lerp_scanline", "#E69F00", "<"),
    "row_crossing": Look("row_crossing", "#F0E442", ">"),
    "float_barycentric": Look("float_barycentric", "#999999", "*"),
}
"""By the first part of the name; variants look alike, with a hollow marker."""


def write_chart(
    make: Callable[[], Figure], folder: Path, name: str, suffix: str = "svg", style: Style = STYLE, dpi: int = 100
) -> Path:
    """Write a chart, return where it is; the same record gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.{suffix}"
    with plt.rc_context(dict(style)):
        figure = make()
        figure.savefig(path, format=suffix, dpi=dpi, metadata={"Date": None} if suffix == "svg" else {})
        plt.close(figure)
    return path


def duration(ns: float) -> str:
    """A round number of nanoseconds in the unit that fits."""
    for unit, size in (("s", 1e9), ("ms", 1e6), ("µs", 1e3)):
        if ns >= size:
            return f"{ns / size:g} {unit}"
    return f"{ns:g} ns"


def count_text(value: float) -> str:
    """A number that is not too long, with commas."""
    return f"{value:,.0f}" if value >= 10 else f"{value:,.2g}"


def draw_grid(axis: Axes) -> None:
    """Draw the common parts of charts."""
    axis.grid(which="major", color="0.88", lw=0.6)
    axis.set_axisbelow(True)
