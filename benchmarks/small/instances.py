"""Time scenes of thousands of instances, and one mesh of hundreds of millions of triangles from a memory map.

Instances of a blob stand in rows, one behind the other; the first picture sorts the mesh and is not counted. Those of a
smaller blob are strewn far away, where most are smaller than a pixel. The mapped mesh is of blobs in a grid, written to
a temporary folder; its memory is that of the process without mapped files.
"""

from __future__ import annotations

import itertools
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.harness.arguments import Options, count, option
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study
from benchmarks.report.tables import facts_text, number, table

SIZE = (1920, 1080)
WIDE = 10
"""Instances in a row."""

STREWN_TRIANGLES = 20_000

MAPPED_AT_ONCE = 10_000_000


@dataclass(frozen=True)
class InstanceOptions(Options):
    triangles: int = count(1_000_000, "--triangles", "of the blob")
    counts: Sequence[int] = count((200, 3000), "--counts", nargs="+")
    strewn: int = option(20_000, "--strewn", "far away (%(default)s)", type=int, metavar="N")
    rounds: int = count(11, "--rounds")
    mapped: int = option(
        0, "--mapped", "times 10 million triangles from a memory map; 40 take 7 GB", type=int, metavar="N"
    )


def in_rows(mesh: tl.Mesh, n: int) -> tl.Scene:
    """So many instances, row behind row."""
    matrices = np.tile(np.eye(4), (n, 1, 1))
    matrices[:, 0, 3] = 1.3 * (np.arange(n) % WIDE - (WIDE - 1) / 2)
    matrices[:, 2, 3] = -1.3 * (np.arange(n) // WIDE)
    return tl.Scene([(mesh, matrix) for matrix in matrices])


def strewn(mesh: tl.Mesh, n: int) -> tl.Scene:
    """So many instances in a cube, as a camera far away sees them: a third of a pixel wide."""
    matrices = np.tile(np.eye(4), (n, 1, 1))
    matrices[:, :3, 3] = np.random.default_rng(0).uniform(-4000, 4000, (n, 3))
    return tl.Scene([(mesh, matrix) for matrix in matrices])


def seconds_of(call: Callable[[], object], rounds: int) -> list[float]:
    """Seconds by the clock of some calls."""
    found = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        found.append(time.perf_counter() - start)
    return found


def run(asked: InstanceOptions, _: Save) -> Record:
    """Measure seconds, by the clock."""
    rows: list[dict[str, Any]] = []

    def measure(kind: str, scene: tl.Scene, camera: tl.Camera, tolerances: tuple[float, ...]) -> None:
        for tolerance, threads in itertools.product(tolerances, (1, 2)):
            options = {"tolerance": tolerance, "threads": threads}
            call = partial(tl.rasterize_mesh, scene, camera, SIZE, **options)
            frags, found = call(), seconds_of(call, asked.rounds)
            rows.append({"scene": kind, "instances": len(scene), "triangles": scene.n_triangles, **options,
                         "shown": len(np.unique(frags.instance)) - 1, "seconds": found})  # fmt: skip

    mesh, camera = blob(asked.triangles), tl.Camera.look_at((0, 0.2, 7.0), fov_y_deg=60)
    for n in asked.counts:
        measure("in rows", in_rows(mesh, n), camera, (0.0, 0.5))
    if asked.strewn:
        far = tl.Camera.look_at((0, 0, 12_000), fov_y_deg=50, near=1, far=20_000)
        measure("strewn, far", strewn(blob(STREWN_TRIANGLES), asked.strewn), far, (0.0,))
    if asked.mapped:
        rows.append(mapped(asked.mapped))
    return {"kind": "instances"} | describe() | {"rows": rows}


def blob(n: int) -> tl.Mesh:
    """A blob of about so many triangles, in float32."""
    vertices, triangles = tl.scenes.blob(n)
    return tl.Mesh(vertices.astype(np.float32), triangles)


def mapped(n: int) -> dict[str, Any]:
    """Draw so many blobs of ten million triangles, all in one mesh of mapped arrays, once."""
    points, triangles = tl.scenes.blob(MAPPED_AT_ONCE)
    n_points, n_triangles = len(points), len(triangles)
    with tempfile.TemporaryDirectory() as folder:
        arrays = [
            np.lib.format.open_memmap(Path(folder, name), "w+", dtype, (n * size, 3))
            for name, dtype, size in (("v.npy", np.float32, n_points), ("t.npy", np.int32, n_triangles))
        ]
        for i in range(n):
            arrays[0][i * n_points : (i + 1) * n_points] = points * (1 + 0.01 * i) + [
                2.6 * (i % 8 - 3.5), 0, -2.6 * (i // 8)
            ]  # fmt: skip
            arrays[1][i * n_triangles : (i + 1) * n_triangles] = triangles + i * n_points
        del points, triangles
        camera = tl.Camera.look_at((0, 6, 12), (0, -1, -4), fov_y_deg=60)
        rasterizer = tl.Rasterizer(SIZE, threads=2)
        transform = camera.clip_from_world(SIZE)
        found = seconds_of(lambda: rasterizer.rasterize(*arrays, transform=transform), 3)
        return {"scene": "mapped", "instances": 1, "triangles": n * n_triangles, "tolerance": 0.0, "threads": 2,
                "shown": 1, "seconds": found[1:], "own_gb": own_gb()}  # fmt: skip


def own_gb() -> float | None:
    """Memory of the process that is not of a file, GB; None where the system does not say."""
    if not sys.platform.startswith("linux"):
        return None
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("RssAnon")) / 1e6


def lines(record: Record) -> Iterator[str]:
    """The table: a row a scene and tolerance, the median of each number of threads."""
    groups: dict[tuple[Any, ...], Record] = {}
    for row in record["rows"]:
        own = groups.setdefault((row["scene"], row["instances"], row["tolerance"]), {**row, "of_threads": {}})
        own["of_threads"][row["threads"]] = statistics.median(row["seconds"])
    counts = sorted({row["threads"] for row in record["rows"]})
    rows = [
        [row["scene"], f"{row['instances']:,}", f"{row['triangles']:,}", f"{row['tolerance']:g}", str(row["shown"]),
         *(number(row["of_threads"][n]) if n in row["of_threads"] else "-" for n in counts),
         f"{row['own_gb']:.1f}" if row.get("own_gb") else ""]
        for row in groups.values()
    ]  # fmt: skip
    threads = [f"{n} thread{'s' * (n > 1)}, s" for n in counts]
    yield from table(["scene", "instances", "triangles", "tolerance, px", "show", *threads, "own GB"], rows)


PARTS: dict[str, Callable[[Record], str | None]] = {
    "instances-facts": facts_text,
    "instances": lambda record: "\n".join(lines(record)),
}
"""The parts of the page by their markers `<!-- table: NAME -->`."""

STUDY = Study(
    "instances", "time thousands of instances, and a mesh from a memory map", InstanceOptions, run, lines, PARTS
)
