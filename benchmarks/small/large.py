"""Time one triangle of half a 4K frame beside NumPy's fill of the same array, verb by verb, in turns.

One thread, `Rasterizer` with `out=`. The inside of a shape is a fill of memory: ratios tell how much more a verb takes.
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

SIZE = (3840, 2160)
N_ROUNDS = 60

Pair = tuple[Callable[[], object], Callable[[], object]]


def contestants() -> dict[str, Pair]:
    """Each verb, and the fill of what it writes."""
    import topleft as tl

    vertices, triangles, *_ = tl.scenes.large_triangle(*SIZE)
    colors, kept = np.array([[200, 100, 50, 255]], np.uint8), tl.Rasterizer(SIZE, threads=1)
    mask, share = np.zeros(SIZE[::-1], bool), np.zeros(SIZE[::-1], np.float32)
    picture = np.zeros((*SIZE[::-1], 4), np.uint8)

    def cover(verb: str, out: np.ndarray, sampling: str) -> Pair:
        draw = getattr(kept, verb)
        return lambda: draw(vertices, triangles, sampling=sampling, out=out), lambda: out.fill(1)

    def fill(sampling: str, blend: str) -> Pair:
        options = {"sampling": sampling, "blend": blend, "background": 0, "out": picture}
        return lambda: kept.fill(vertices, triangles, colors, **options), lambda: picture.fill(7)

    return {
        "coverage": cover("coverage", mask, "center"),
        "coverage, area": cover("coverage", share, "area"),
        "overdraw, area": cover("overdraw", share, "area"),
        "coverage, msaa4": cover("coverage", share, "msaa4"),
        "fill RGBA8": fill("center", "replace"),
        "fill RGBA8, area": fill("area", "over"),
        "fill RGBA8, msaa4": fill("msaa4", "replace"),
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=positive, default=N_ROUNDS, metavar="N", help="(%(default)s)")
    add_out(parser)


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure milliseconds of each pair, round by round."""
    rows = []
    for verb, pair in contestants().items():
        times = take_turns([turn_of(draw, time.perf_counter) for draw in pair], arguments.rounds, 0.0)
        rows.append({"verb": verb, "drawn": times[0].tolist(), "filled": times[1].tolist()})
    return {"kind": "large"} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The table: a row a verb."""
    rows = []
    for row in record["rows"]:
        ratio = statistics.median(a / b for a, b in zip(row["drawn"], row["filled"], strict=False))
        least = min(row["drawn"]), min(row["filled"])
        rows.append([row["verb"], *(f"{ms:.3f}" for ms in least), f"{least[0] / least[1]:.2f}", f"{ratio:.2f}"])
    yield from table(["verb", "least, ms", "fill of the array, ms", "ratio", "median ratio"], rows)


STUDY = Study("large", "time one large triangle beside a fill of the same memory", add_arguments, run, lines)
