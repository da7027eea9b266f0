"""Vertices that are not snapped beside snapped ones: what each verb takes, and what two threads do, in turns.

The time is that of the threads on their CPUs, so that other processes do not count; of two threads it is the sum, and
twice the time of one over it is how much faster two free cores draw.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.harness.arguments import add_out, positive
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.report.study import Study
from benchmarks.report.tables import table
from benchmarks.scenes.families import NO_SNAP

FRAME_PX = 1024
SIZES = {"200,000 of 1.5 px": (200_000, 1.5), "100,000 of 4 px": (100_000, 4.0), "50,000 of 12 px": (50_000, 12.0),
         "5,000 of 60 px": (5_000, 60.0)}  # fmt: skip
N_BLOB = 1_000_000
BITS = (8, NO_SNAP)

Calls = Iterator[tuple[str, str, Callable[..., object]]]


def verbs() -> Calls:
    """Yield scene, verb, and a call that takes options; one thread."""
    import topleft as tl

    rng = np.random.default_rng(1)
    rasterizer = tl.Rasterizer((FRAME_PX, FRAME_PX), threads=1)
    for name, (n, side) in SIZES.items():
        corners = rng.uniform(0, FRAME_PX, (n, 1, 2)) + rng.uniform(-0.5, 0.5, (n, 3, 2)) * side
        scene: tuple[Any, Any] = corners.reshape(-1, 2), np.arange(3 * n, dtype=np.int32).reshape(-1, 3)
        flat, smooth = (rng.integers(0, 255, (rows, 4)).astype(np.uint8) for rows in (n, 3 * n))
        values = rng.uniform(0, 1, (3 * n, 3)).astype(np.float32)
        yield name, "overdraw", lambda scene=scene, **view: rasterizer.overdraw(*scene, **view)
        yield name, "outer squares", lambda scene=scene, **view: rasterizer.overdraw(*scene, sampling="outer", **view)
        yield name, "blend", lambda scene=scene, c=flat, **view: rasterizer.fill(*scene, c, blend="over", **view)
        yield name, "colours of vertices", lambda scene=scene, c=smooth, **view: rasterizer.fill(*scene, c, **view)
        yield (
            name, "rasterize, interpolate",
            lambda scene=scene, v=values, **view: rasterizer.rasterize(*scene, **view).interpolate(v),
        )  # fmt: skip


def threaded() -> Calls:
    """Yield the same of a mesh behind a transform, and of triangles in random order, on threads that view names."""
    import topleft as tl

    vertices, triangles = tl.scenes.blob(N_BLOB)
    mesh = tl.Mesh(vertices, triangles)
    matrix = tl.Camera.framing(mesh, aspect=4 / 3).clip_from_world((1024, 768))
    rasterizer = tl.Rasterizer((1024, 768))
    points = mesh.vertices.astype(np.float32)
    options: dict[str, Any] = {"transform": matrix}
    yield "blob of a million", "rasterize", lambda **view: rasterizer.rasterize(points, triangles, **options, **view)
    rng = np.random.default_rng(2)
    corners = (rng.uniform(0, 2048, (N_BLOB, 1, 2)) + rng.uniform(-0.7, 0.7, (N_BLOB, 3, 2))).reshape(-1, 2)
    large, rows = tl.Rasterizer((2048, 2048)), np.arange(3 * N_BLOB, dtype=np.int32).reshape(-1, 3)
    yield "a million of 1 px, in any order", "overdraw", lambda **view: large.overdraw(corners, rows, **view)


def compare(calls: list[Callable[[], object]], rounds: int) -> list[float]:
    """Return the least milliseconds of each call, in turns."""
    times = take_turns([turn_of(call, time.process_time) for call in calls], rounds, 0.0)
    return [float(f"{took.min():.4g}") for took in times]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=positive, default=10, metavar="N", help="(%(default)s)")
    add_out(parser)


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure each verb on one thread, and two scenes on one and on two."""
    rows: list[dict[str, Any]] = []
    for scene, verb, call in verbs():
        pair = [lambda bits=bits, call=call: call(subpixel_bits=bits) for bits in BITS]
        snapped, exact = compare(pair, arguments.rounds)
        rows.append({"scene": scene, "verb": verb, "snapped_ms": snapped, "exact_ms": exact})
    for scene, verb, call in threaded():
        four = [lambda bits=bits, n=n, call=call: call(subpixel_bits=bits, threads=n) for bits in BITS for n in (1, 2)]
        one, two, exact_one, exact_two = compare(four, arguments.rounds)
        gains = {"snapped_gain": 2 * one / two, "exact_gain": 2 * exact_one / exact_two}
        rows.append({"scene": scene, "verb": verb, "snapped_ms": one, "exact_ms": exact_one} | gains)
    return {"kind": "no-snap"} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The table: milliseconds, ratio, and what two threads gain."""
    head = ["scene", "verb", "8 bits, ms", "not snapped, ms", "ratio", "two threads", "not snapped"]
    rows = []
    for row in record["rows"]:
        gains = [f"{row[name]:.2f}" if name in row else "" for name in ("snapped_gain", "exact_gain")]
        ratio = row["exact_ms"] / row["snapped_ms"]
        times = f"{row['snapped_ms']:.2f}", f"{row['exact_ms']:.2f}", f"{ratio:.2f}"
        rows.append([row["scene"], row["verb"], *times, *gains])
    yield from table(head, rows)


STUDY = Study("no-snap", "time vertices that are not snapped beside snapped ones", add_arguments, run, lines)
