"""Time views of a mesh with `tolerance=` beside the same without it.

One thread, a torus knot and a blob of 65,000 triangles, framed in pictures of several sizes; the two take turns, call
by call. Levels are made before.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Iterator
from functools import partial

from benchmarks.harness.arguments import add_out, positive
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.report.study import Study
from benchmarks.report.tables import table

SIDES = (20, 50, 100, 200, 400)
N_ROUNDS = 31
TOLERANCE = 0.5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=positive, default=N_ROUNDS, metavar="N", help="(%(default)s)")
    parser.add_argument("--sides", type=positive, nargs="+", default=list(SIDES), metavar="N", help="(%(default)s)")
    add_out(parser)


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure milliseconds of CPU time of each pair, round by round."""
    import topleft as tl

    rows = []
    for name, arrays in {"torus-knot": tl.scenes.shape("torus-knot"), "blob": tl.scenes.blob(65000)}.items():
        mesh = tl.Mesh(*arrays)
        camera = tl.Camera.framing(mesh)
        for side in arguments.sides:
            size = (side, side)
            level = tl.choose_detail(mesh, camera, size, tolerance=TOLERANCE).level
            for verb in (tl.rasterize_mesh, tl.render):
                calls = [partial(verb, mesh, camera, size, threads=1, tolerance=own)
                         for own in (0.0, TOLERANCE)]  # fmt: skip
                times = take_turns([turn_of(call) for call in calls], arguments.rounds, 0.0)
                rows.append({"mesh": name, "side": side, "level": level, "verb": verb.__name__,
                             "without": times[0].tolist(), "with": times[1].tolist()})  # fmt: skip
    return {"kind": "tolerance"} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The table: a row a mesh, size and verb."""
    rows = []
    for row in record["rows"]:
        ratio = statistics.median(a / b for a, b in zip(row["without"], row["with"], strict=True))
        rows.append([row["mesh"], row["verb"], str(row["side"]), str(row["level"]), f"{min(row['without']):.3f}",
                     f"{min(row['with']):.3f}", f"{ratio:.2f}x"])  # fmt: skip
    yield from table(["mesh", "verb", "pixels", "level", "without, ms", "with, ms", "faster, median"], rows)


STUDY = Study("tolerance", "time views with `tolerance=` beside the same without", add_arguments, run, lines)
