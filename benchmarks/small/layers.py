"""Time each layer of a view beside its picture: a mesh of 70,000 triangles at 512x512, shaded, on one thread.

Every round asks for each layer alone, so the visibility buffer is drawn for each of them; the fastest and the median
round are printed, and the median over that of the picture.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from benchmarks.harness.arguments import add_out, positive
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.report.study import Study
from benchmarks.report.tables import facts_text, table

SIZE = (512, 512)
N_TRIANGLES = 70_000
N_ROUNDS = 40


def contestants() -> dict[str, Callable[[], object]]:
    """A call for each layer, the picture first."""
    import topleft as tl
    from topleft._meshes.picture.layers import LAYERS

    vertices, triangles = tl.scenes.blob(N_TRIANGLES)
    uv = np.random.default_rng(0).random((len(vertices), 2), np.float32)
    mesh = tl.Mesh(vertices, triangles, uv=uv)
    camera = tl.Camera.framing(mesh, aspect=1.0)
    end = replace(camera, view=tl.Camera.framing(mesh, aspect=1.0, azimuth_deg=40).view)
    rasterizer = tl.Rasterizer(SIZE, threads=1)
    options = {"cull": "back", "threads": 1, "rasterizer": rasterizer, "camera_to": end}
    made: dict[str, Callable[[], object]] = {
        name: lambda name=name: tl.render_layers(mesh, camera, SIZE, layers=(name,), **options) for name in LAYERS
    }
    values = vertices.astype(np.float32)
    made["attribute of 3"] = lambda: tl.render_layers(
        mesh, camera, SIZE, layers=(), attributes={"own": values}, **options
    )
    return made


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=positive, default=N_ROUNDS, metavar="N", help="(%(default)s)")
    add_out(parser)


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure milliseconds of each call, round by round."""
    draws = contestants()
    times = take_turns([turn_of(draw, time.perf_counter) for draw in draws.values()], arguments.rounds, 0.0)
    rows = [{"layer": name, "ms": took.tolist()} for name, took in zip(draws, times, strict=True)]
    return {"kind": "layers"} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The table: fastest and median round, and the median over that of the picture."""
    medians = {row["layer"]: statistics.median(row["ms"]) for row in record["rows"]}
    rows = []
    for row in record["rows"]:
        median = medians[row["layer"]]
        figures = min(row["ms"]), median, median / medians["color"]
        rows.append([row["layer"], *(f"{figure:.2f}" for figure in figures)])
    yield from table(["layer", "fastest, ms", "median, ms", "over the picture"], rows)


PARTS: dict[str, Callable[[Record], str | None]] = {
    "layers-facts": facts_text,
    "layers": lambda record: "\n".join(lines(record)),
}
"""What the markers `<!-- table: NAME -->` of the page stand for."""

STUDY = Study("layers", "time each layer of a view beside its picture", add_arguments, run, lines, PARTS)
