"""Time verbs that return arrays of their own beside `Rasterizer`, which overwrites its own.

1,000 triangles, one thread. The two take turns, call by call; the fastest of each is printed, and the median of
the ratios of the rounds.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.harness.arguments import add_out, positive
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.report.study import Study
from benchmarks.report.tables import table

SIDES = (64, 256, 640, 1024, 2048, 4096)
N_TRIANGLES = 1000
N_ROUNDS = 30

Pair = tuple[Callable[[], object], Callable[[], object]]


def contestants(side: int) -> dict[str, Pair]:
    """Each verb, and the same of a `Rasterizer`."""
    import topleft as tl

    rng = np.random.default_rng(0)
    middles = np.repeat(rng.uniform(0, side, (N_TRIANGLES, 2)), 3, axis=0)
    corners = (middles + rng.normal(0, side / 50, (3 * N_TRIANGLES, 2))).astype(np.float32)
    deep = np.column_stack([corners, rng.random(len(corners), np.float32)])
    triangles = np.arange(3 * N_TRIANGLES, dtype=np.int32).reshape(-1, 3)
    colors = rng.integers(0, 256, (N_TRIANGLES, 4)).astype(np.uint8)
    size, kept = (side, side), tl.Rasterizer((side, side), threads=1)
    calls = {
        "coverage": ("coverage", (corners, triangles), {}),
        "coverage, area": ("coverage", (corners, triangles), {"sampling": "area"}),
        "overdraw": ("overdraw", (corners, triangles), {}),
        "fill": ("fill", (corners, triangles, colors), {}),
        "rasterize": ("rasterize", (deep, triangles), {}),
        "rasterize, msaa4": ("rasterize", (deep, triangles), {"sampling": "msaa4"}),
        "wireframe": ("wireframe", (corners, triangles), {}),
    }

    def pair(verb: str, arrays: tuple[object, ...], options: dict[str, str]) -> Pair:
        fresh, own = getattr(tl, verb), getattr(kept, verb)
        return lambda: fresh(*arrays, size, threads=1, **options), lambda: own(*arrays, **options)

    return {name: pair(*call) for name, call in calls.items()}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=positive, default=N_ROUNDS, metavar="N", help="(%(default)s)")
    parser.add_argument("--sides", type=positive, nargs="+", default=list(SIDES), metavar="N", help="(%(default)s)")
    add_out(parser)


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure milliseconds of each pair, round by round."""
    rows = []
    for side in arguments.sides:
        for verb, pair in contestants(side).items():
            times = take_turns([turn_of(draw, time.perf_counter) for draw in pair], arguments.rounds, 0.0)
            rows.append({"side": side, "verb": verb, "fresh": times[0].tolist(), "kept": times[1].tolist()})
    return {"kind": "fresh"} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The table: a row a verb and size."""
    rows = []
    for row in record["rows"]:
        ratio = statistics.median(a / b for a, b in zip(row["fresh"], row["kept"], strict=False))
        rows.append(
            [f"{row['side']}x{row['side']}", row["verb"], f"{min(row['fresh']):.3f}", f"{min(row['kept']):.3f}"]
            + [f"{ratio:.2f}"]
        )
    yield from table(["size", "verb", "arrays of its own, ms", "`Rasterizer`, ms", "median ratio"], rows)


STUDY = Study("fresh", "time verbs that return arrays of their own beside `Rasterizer`", add_arguments, run, lines)
