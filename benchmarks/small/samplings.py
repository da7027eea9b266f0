"""One small scene in every sampling, magnified, with the numbers in the pixels. Needs matplotlib."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import topleft as tl
from benchmarks.harness.arguments import option
from benchmarks.harness.machine import IMAGES
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study
from topleft._core.base.options import Sampling
from topleft._core.raster.sampling import POSITIONS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE = (9, 7)
VERTICES = np.array(
    [(0.6, 0.7), (6.3, 1.4), (2.2, 6.4), (7.6, 5.2)]
    + [(8.5, 0.3), (8.7, 6.6), (8.4, 6.6), (5.2, 5.9), (5.8, 6.1), (5.3, 6.4)]
)
TRIANGLES = np.array([(0, 1, 2), (1, 3, 2), (4, 5, 6), (7, 8, 9)])
"""Two that share an edge, a sliver thinner than a pixel, and one that lies inside a pixel."""

ORDER = ("center", "msaa2", "msaa4", "msaa8", "msaa16", "area", "outer", "inner")
PAPER, INK = np.array([255, 255, 255]), np.array([86, 180, 233])


def chart_samplings() -> Figure:
    """Return a panel for each sampling: coverage as colour and as number, triangles as lines, samples as dots."""
    from matplotlib import pyplot as plt

    figure, grid = plt.subplots(4, 2, figsize=(6.6, 11.2), layout="constrained")
    for axis, sampling in zip(grid.flat, ORDER, strict=True):
        draw_panel(axis, sampling)
    return figure


def draw_panel(axis: Axes, sampling: str) -> None:
    """Draw the scene in one sampling."""
    from matplotlib.collections import PolyCollection

    width, height = SIZE
    coverage = tl.coverage(VERTICES, TRIANGLES, SIZE, sampling=sampling).astype(float)
    axis.imshow((PAPER + coverage[..., None] * (INK - PAPER)).astype(np.uint8), extent=(0, width, height, 0))
    axis.add_collection(PolyCollection(list(VERTICES[TRIANGLES]), facecolors="none", edgecolors="black", lw=0.8))
    dots = np.array(POSITIONS.get(Sampling(sampling).n_samples, ((0, 0),))) / 16
    if sampling.startswith(("center", "msaa")):
        rows, cols = np.divmod(np.arange(width * height), width)
        at = np.stack([cols, rows], -1)[:, None] + 0.5 + dots
        axis.plot(*at.reshape(-1, 2).T, ".", color="#D55E00", ms=2.2, mew=0)
    for row, col in np.argwhere(coverage > 0):
        axis.text(col + 0.5, row + 0.5, number(coverage[row, col], sampling), ha="center", va="center", fontsize=6.5,
                  bbox={"boxstyle": "square,pad=0.05", "fc": (1, 1, 1, 0.55), "ec": "none"})  # fmt: skip
    axis.set(xticks=range(width + 1), yticks=range(height + 1), xticklabels=[], yticklabels=[])
    axis.tick_params(length=0)
    axis.grid(color="0.75", lw=0.5)
    axis.set_title(f'"{sampling}": {coverage.sum():.4g} pixels', loc="left", fontsize=9)


def number(value: float, sampling: str) -> str:
    """The text of a pixel: 1, the covered samples of all, or the area, cut off after three digits."""
    n = Sampling(sampling).n_samples
    if value == 1:
        return "1"
    if n > 1:
        return f"{round(value * n)}/{n}"
    return "<.001" if value < 0.001 else f".{int(1000 * value):03d}"


@dataclass(frozen=True)
class SamplingOptions:
    """Where the picture goes."""

    out: Path = option(IMAGES, "-o --out", type=Path, metavar="FOLDER")


def run(options: SamplingOptions, _: Save) -> Record:
    """Draw; the record is where the picture is."""
    from benchmarks.report.charts import write_chart

    path = write_chart(chart_samplings, options.out, "samplings", "png", {"font.size": 8}, 130)
    return {"kind": "samplings", "path": str(path)}


STUDY = Study(
    "samplings", "draw one small scene in every sampling, PNG", SamplingOptions, run, lambda record: [record["path"]]
)
