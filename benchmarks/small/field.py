"""Time a field on 200,000 triangles at 1920x1080, beside matplotlib, datashader and SciPy in one run, on one core.

Rounds go round the contestants, so that what slows the machine slows all of them; the fastest and the median round are
printed. Also `height_map` of 2,000 faces on 400x400, two hundred times in a row. Each is asked for an array, or a
canvas, of the whole frame; meshes, tables and triangulations are made before.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.harness.arguments import add_out
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.report.study import Study

SIZE = (1920, 1080)
N_POINTS = 100_100
N_ROUNDS, N_HEIGHT_MAPS = 7, 200
HEIGHT_MAP = "topleft height_map"
Draw = Callable[[], object]


def mesh() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    from topleft import scenes

    points, triangles = scenes.planar_mesh(N_POINTS, *SIZE)
    return points, triangles, np.sin(points[:, 0] / 100) * np.cos(points[:, 1] / 80)


def topleft_field(points: np.ndarray, triangles: np.ndarray, values: np.ndarray) -> Draw:
    import topleft as tl

    grid = tl.Grid(SIZE, (0, SIZE[0], 0, SIZE[1]), "down")
    return lambda: tl.field((points, triangles), values, grid, threads=1)


def matplotlib_tripcolor(points: np.ndarray, triangles: np.ndarray, values: np.ndarray) -> Draw:
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.tri import Triangulation

    triangulation = Triangulation(points[:, 0], points[:, 1], triangles)

    def draw() -> object:
        figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100)
        canvas = FigureCanvasAgg(figure)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        axes.set_xlim(0, SIZE[0])
        axes.set_ylim(0, SIZE[1])
        axes.tripcolor(triangulation, values, shading="gouraud")
        canvas.draw()
        return canvas.buffer_rgba()

    return draw


def datashader_trimesh(points: np.ndarray, triangles: np.ndarray, values: np.ndarray) -> Draw:
    import datashader as ds
    import pandas as pd

    vertices = pd.DataFrame({"x": points[:, 0], "y": points[:, 1], "z": values})
    simplices = pd.DataFrame(triangles.astype(np.int64), columns=["v0", "v1", "v2"])
    table = ds.utils.mesh(vertices, simplices)
    canvas = ds.Canvas(*SIZE, x_range=(0, SIZE[0]), y_range=(0, SIZE[1]))
    return lambda: canvas.trimesh(vertices, simplices, mesh=table, agg=ds.mean("z"), interpolate="linear").data


def scipy_interpolator(points: np.ndarray, triangles: np.ndarray, values: np.ndarray) -> Draw:  # noqa: ARG001
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import Delaunay

    ask = LinearNDInterpolator(Delaunay(points), values)
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    return lambda: ask(x, y)


def height_map() -> Draw:
    import topleft as tl

    x, y = np.meshgrid(np.linspace(0, 200, 41), np.linspace(0, 200, 26))
    points = np.column_stack([x.ravel(), y.ravel(), 5 * np.sin(x / 20).ravel() * np.cos(y / 25).ravel()])
    corner = (np.arange(25)[:, None] * 41 + np.arange(40)).reshape(-1, 1)
    triangles = np.concatenate([corner + [0, 1, 41], corner + [1, 42, 41]]).astype(np.int32)
    return lambda: tl.height_map((points, triangles), 0.5, threads=1)


CONTESTANTS = {
    "topleft field": topleft_field,
    "matplotlib tripcolor": matplotlib_tripcolor,
    "datashader trimesh": datashader_trimesh,
    "scipy LinearNDInterpolator": scipy_interpolator,
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_out(parser)


def run(_: argparse.Namespace, __: Save) -> Record:
    """Measure milliseconds of each call, on one core."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    scene = mesh()
    draws: dict[str, Draw] = {}
    for name, prepare in CONTESTANTS.items():
        try:
            draws[name] = prepare(*scene)
        except ImportError as error:
            print(f"{name}: {error}", file=sys.stderr)
    times = take_turns([turn_of(draw, time.perf_counter) for draw in draws.values()], N_ROUNDS, 0.0)
    times += take_turns([turn_of(height_map(), time.perf_counter)], N_HEIGHT_MAPS, 0.0)
    rows = [{"name": name, "ms": took.tolist()} for name, took in zip([*draws, HEIGHT_MAP], times, strict=True)]
    return {"kind": "field"} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """Least and median of each, and the least over that of the first."""
    ours = min(record["rows"][0]["ms"])
    for row in record["rows"]:
        least, median = min(row["ms"]), statistics.median(row["ms"])
        yield f"{row['name']:32} {least:9.2f} ms least {median:9.2f} ms median {least / ours:7.1f} times"


STUDY = Study("field", "time a field beside matplotlib, datashader and SciPy", add_arguments, run, lines)
