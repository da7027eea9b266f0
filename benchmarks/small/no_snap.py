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
FINE_BITS = (12, 16)
GRIDS = {"whole pixels": 1, "half pixels": 2, "1/256 pixels": 256}
GRID_SIZES = {"100,000 of 4 px": (100_000, 4.0), "50,000 of 10 px": (50_000, 10.0)}
PARTS = ("scenes", "verbs", "threads")

Calls = Iterator[tuple[str, str, Callable[..., object]]]


def soup(rng: np.random.Generator, n: int, side: float) -> Any:
    """Corners (3 n, 2) of triangles that are strewn over the frame."""
    corners = rng.uniform(0, FRAME_PX, (n, 1, 2)) + rng.uniform(-0.5, 0.5, (n, 3, 2)) * side
    return corners.reshape(-1, 2)


def thin(rng: np.random.Generator, n: int, length: float, thickness: float) -> Any:
    """Corners (3 n, 2) of slivers in any direction."""
    start, angle = rng.uniform(0, FRAME_PX, (n, 2)), rng.uniform(0, 2 * np.pi, n)
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    across = along[:, ::-1] * [-1, 1]
    corners = [start, start + length * along, start + length / 2 * along + thickness * across]
    return np.stack(corners, axis=1).reshape(-1, 2)


def beside_centres(rng: np.random.Generator, points: Any) -> Any:
    """Points moved to within three steps of float64 of pixel centres: most row ends are in doubt, and on no grid."""
    centres = np.floor(points) + 0.5
    return centres + rng.integers(-3, 4, centres.shape) * np.spacing(centres)


def scenes() -> Iterator[tuple[str, str, Callable[..., object], tuple[Any, Any]]]:
    """Yield scene, verb, a call that takes `subpixel_bits`, and the two of them to compare; one thread."""
    import topleft as tl

    rng = np.random.default_rng(3)
    wide, square = tl.Rasterizer((1920, 1080), threads=1), tl.Rasterizer((FRAME_PX, FRAME_PX), threads=1)
    points, triangles = tl.scenes.planar_mesh(100_000)
    yield "Delaunay mesh of 200,000, 1920x1080", "rasterize", lambda **v: wide.rasterize(points, triangles, **v), BITS
    soups = {
        "5,000 slivers of 300 x 2 px": thin(rng, 5_000, 300, 2),
        "20,000 of 30 x 0.3 px": thin(rng, 20_000, 30, 0.3),
    }
    for name, (n, side) in GRID_SIZES.items():
        random = soup(rng, n, side)
        soups |= {f"{name} on {grid}": np.round(random * scale) / scale for grid, scale in GRIDS.items()}
        soups[f"{name} within three last bits of centres"] = beside_centres(rng, random)
    fine = {name: soup(rng, n, side) for name, (n, side) in SIZES.items()}
    for pair, group in ((BITS, soups), (FINE_BITS, fine)):
        for name, corners in group.items():
            rows = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
            yield name, "overdraw", lambda c=corners, r=rows, **view: square.overdraw(c, r, **view), pair


def verbs() -> Calls:
    """Yield scene, verb, and a call that takes options; one thread."""
    import topleft as tl

    rng = np.random.default_rng(1)
    rasterizer = tl.Rasterizer((FRAME_PX, FRAME_PX), threads=1)
    for name, (n, side) in SIZES.items():
        scene: tuple[Any, Any] = soup(rng, n, side), np.arange(3 * n, dtype=np.int32).reshape(-1, 3)
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


def compare(calls: list[Callable[[], object]], rounds: int) -> tuple[list[float], list[float]]:
    """Return the least milliseconds of each call, in turns, and the median of its ratios to the first call."""
    times = take_turns([turn_of(call, time.process_time) for call in calls], rounds, 0.0)
    least, ratios = ([took.min() for took in times], [np.median(took / times[0]) for took in times])
    return [float(f"{one:.4g}") for one in least], [float(f"{one:.3f}") for one in ratios]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=positive, default=10, metavar="N", help="(%(default)s)")
    parser.add_argument("--part", nargs="+", choices=PARTS, default=PARTS, metavar="NAME", help=", ".join(PARTS))
    add_out(parser)


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure scenes and verbs on one thread, and two scenes on one and on two."""
    rows: list[dict[str, Any]] = []
    single = list(scenes()) if "scenes" in arguments.part else []
    if "verbs" in arguments.part:
        single += [(*found, BITS) for found in verbs()]
    for scene, verb, call, bits in single:
        pair = [lambda bits=bits, call=call: call(subpixel_bits=bits) for bits in bits]
        (first, second), (_, ratio) = compare(pair, arguments.rounds)
        rows.append(
            {"scene": scene, "verb": verb, "bits": bits, "first_ms": first, "second_ms": second, "ratio": ratio}
        )
    for scene, verb, call in threaded() if "threads" in arguments.part else ():
        four = [lambda bits=bits, n=n, call=call: call(subpixel_bits=bits, threads=n) for bits in BITS for n in (1, 2)]
        (one, two, exact_one, exact_two), (*_, ratio, _) = compare(four, arguments.rounds)
        gains = {"first_gain": 2 * one / two, "second_gain": 2 * exact_one / exact_two}
        took = {"first_ms": one, "second_ms": exact_one, "ratio": ratio}
        rows.append({"scene": scene, "verb": verb, "bits": BITS} | took | gains)
    return {"kind": "no-snap"} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The table: least milliseconds, median ratio of the rounds, and what two threads gain."""
    head = ["scene", "verb", "bits", "ms", "bits", "ms", "ratio", "two threads", "and the other"]
    rows = []
    for row in record["rows"]:
        gains = [f"{row[name]:.2f}" if name in row else "" for name in ("first_gain", "second_gain")]
        first, second = (f"{row[name]:.2f}" for name in ("first_ms", "second_ms"))
        one, other = map(str, row["bits"])
        rows.append([row["scene"], row["verb"], one, first, other, second, f"{row['ratio']:.2f}", *gains])
    yield from table(head, rows)


STUDY = Study("no-snap", "time vertices that are not snapped beside snapped ones", add_arguments, run, lines)
