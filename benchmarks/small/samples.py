"""Time ids and depth of several samples a pixel beside one sample, and what is made of them when it is asked for.

One thread, `Rasterizer`, 1920x1080; in turns of several calls, after the first of which caches hold what is its own.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

from benchmarks.harness.arguments import add_out, positive
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.report.study import Study
from benchmarks.report.tables import table
from benchmarks.scenes.arrays import blob_arrays, strewn_arrays

SIZE = (1920, 1080)
N_ROUNDS, SECONDS = 9, 0.2

WAYS: dict[str, tuple[str, str | None]] = {
    "center": ("center", None),
    "msaa4": ("msaa4", None),
    "msaa8": ("msaa8", None),
    "msaa4, ids of samples": ("msaa4", "samples_triangle"),
    "msaa4, and depths": ("msaa4", "samples_depth"),
}
"""The sampling, and what is asked for of the result, by name."""


def scenes() -> dict[str, dict[str, Any]]:
    """Arguments of `rasterize` by name: meshes whose back faces are culled, and soup."""
    import topleft as tl

    found: dict[str, dict[str, Any]] = {}
    for n in (10_000, 100_000, 1_000_000):
        vertices, triangles = blob_arrays(n)
        matrix = tl.Camera.framing(tl.Mesh(vertices, triangles)).clip_from_world(SIZE)
        found[f"blob, {n:,}"] = {"vertices": vertices, "triangles": triangles, "transform": matrix, "cull": "back"}
    for n, px in ((1_000, 300), (20_000, 40), (200_000, 8)):
        vertices, triangles = strewn_arrays(n, px, SIZE)
        found[f"{n:,} of {px} px"] = {"vertices": vertices, "triangles": triangles}
    return found


def contestants(scene: dict[str, Any]) -> list[Callable[[], object]]:
    """A call for each of `WAYS`, with memory of its own."""
    import topleft as tl

    def call(sampling: str, name: str | None) -> Callable[[], object]:
        kept = tl.Rasterizer(SIZE, threads=1)

        def draw() -> object:
            frags = kept.rasterize(**scene, sampling=sampling)
            return frags if name is None else getattr(frags, name)

        return draw

    return [call(*way) for way in WAYS.values()]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=positive, default=N_ROUNDS, metavar="N", help="(%(default)s)")
    add_out(parser)


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure milliseconds of each way, round by round."""
    rows = []
    for name, scene in scenes().items():
        times = take_turns([turn_of(call, time.perf_counter) for call in contestants(scene)], arguments.rounds, SECONDS)
        rows.append({"scene": name, "ms": [own.tolist() for own in times]})
    return {"kind": "samples"} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The table: a row a scene, milliseconds and how many times those of one sample."""
    rows = []
    for row in record["rows"]:
        one, *others = map(min, row["ms"])
        spread = statistics.median(row["ms"][0]) / one
        cells = [f"{ms:.2f}, {ms / one:.2f} x" for ms in others]
        rows.append([row["scene"], f"{one:.2f} ({spread:.2f})", *cells])
    first, *names = WAYS
    yield from table(["scene", f"{first}: least, ms (median over least)", *names], rows)


STUDY = Study("samples", "time several samples a pixel beside one", add_arguments, run, lines)
