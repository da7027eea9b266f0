"""Memory that a process keeps after thousands of calls, and of calls that fail. `python -m benchmarks growth`."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from resource import getpagesize
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.harness.arguments import Options, count
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study

N_FIRST = 500
"""Calls before the first look: imports, and memory that is kept once, are no growth."""

SIZE = (96, 64)
LARGE = (4000, 3000)


def calls() -> dict[str, tuple[Callable[[], Any], Callable[[], Any]]]:
    """A call of each verb, and one that fails late: at an index of the last triangle, where there is one."""
    rng = np.random.default_rng(0)
    vertices, triangles = rng.uniform(-5, 70, (60, 3)), rng.integers(0, 60, (80, 3))
    bad = np.concatenate([triangles, [[0, 1, 60]]])
    colors = rng.integers(0, 256, (81, 4), dtype=np.uint8)
    mesh = tl.Mesh(*tl.scenes.shape("octahedron"))
    camera, image = tl.Camera.framing(mesh), np.zeros((8, 8, 3), np.uint8)
    layers = tl.peel(vertices, triangles, SIZE)
    rings = [vertices[:5, :2], vertices[5:9, :2]]
    kept = tl.Rasterizer(SIZE)
    arrays, wrong = (vertices, triangles), (vertices, bad)

    def shaded() -> Any:
        return tl.shade(tl.rasterize_mesh(mesh, camera, SIZE), mesh, camera)

    def new_mesh() -> Any:
        return tl.render(tl.Mesh(mesh.vertices.copy(), mesh.triangles.copy()), camera, SIZE)

    return {
        "coverage": (lambda: tl.coverage(*arrays, SIZE), lambda: tl.coverage(*wrong, SIZE)),
        "coverage, area": (lambda: tl.coverage(*arrays, SIZE, sampling="area"),
                           lambda: tl.coverage(*wrong, SIZE, sampling="area")),
        "overdraw": (lambda: tl.overdraw(*arrays, SIZE), lambda: tl.overdraw(*wrong, SIZE)),
        "fill": (lambda: tl.fill(*arrays, colors[:80], SIZE, per="triangle", blend="over"),
                 lambda: tl.fill(*wrong, colors, SIZE, per="triangle", blend="over")),
        "rasterize": (lambda: tl.rasterize(*arrays, SIZE).barycentric(), lambda: tl.rasterize(*wrong, SIZE)),
        "rasterize, msaa8": (lambda: tl.rasterize(*arrays, SIZE, sampling="msaa8"),
                             lambda: tl.rasterize(*wrong, SIZE, sampling="msaa8")),
        "wireframe": (lambda: tl.wireframe(*arrays, SIZE), lambda: tl.wireframe(*wrong, SIZE)),
        "Rasterizer.fill": (lambda: kept.fill(*arrays, colors[:80], per="triangle"),
                            lambda: kept.fill(*wrong, colors, per="triangle")),
        "peel": (lambda: tl.peel(*arrays, SIZE), lambda: tl.peel(*wrong, SIZE)),
        "composite": (lambda: tl.composite(layers, colors[:80], per="triangle"),
                      lambda: tl.composite(layers, colors, per="triangle")),
        "field": (lambda: tl.field(arrays, vertices[:, 2], SIZE), lambda: tl.field(wrong, vertices[:, 2], SIZE)),
        "height_map": (lambda: tl.height_map(arrays, 1.0), lambda: tl.height_map(wrong, 1.0)),
        "points": (lambda: tl.points(vertices, SIZE), lambda: tl.points(vertices * np.nan, SIZE)),
        "polygons": (lambda: tl.polygons(rings, SIZE), lambda: tl.polygons([rings[0] * np.nan], SIZE)),
        "polygons, area": (lambda: tl.polygons(rings, SIZE, sampling="area"),
                           lambda: tl.polygons([rings[0] * np.nan], SIZE, sampling="area")),
        "render": (lambda: tl.render(mesh, camera, SIZE), lambda: tl.render(mesh, camera, SIZE, shading="none")),
        "render, a new mesh": (new_mesh, lambda: tl.render(tl.Mesh(mesh.vertices, bad), camera, SIZE)),
        "shade": (shaded, lambda: tl.shade(tl.rasterize_mesh(mesh, camera, SIZE), mesh, camera, lights="none")),
        "render_layers": (lambda: tl.render_layers(mesh, camera, SIZE, layers="depth"),
                          lambda: tl.render_layers(mesh, camera, SIZE, layers="none")),
        "render_transparent": (lambda: tl.render_transparent(mesh, camera, SIZE, layers=2),
                               lambda: tl.render_transparent(mesh, camera, SIZE, layers=-1)),
        "silhouette": (lambda: tl.silhouette(mesh, camera, SIZE), lambda: tl.silhouette(mesh, camera, (-1, 0))),
        "Texture": (lambda: tl.Texture(image), lambda: tl.Texture(image[0, 0])),
        "plan": (lambda: tl.plan(*arrays, SIZE), lambda: tl.plan(*wrong, SIZE)),
    }  # fmt: skip


def resident_bytes() -> int:
    """Resident memory of the process, after garbage is collected."""
    gc.collect()
    tl.release_memory()
    return int(Path("/proc/self/statm").read_text().split()[1]) * getpagesize()


def growth(call: Callable[[], Any], n: int, *, fails: bool) -> tuple[int, int]:
    """Return by how many bytes the process grows in n calls, and by how many of Python's own blocks."""

    def repeat(n_times: int) -> None:
        for _ in range(n_times):
            try:
                call()
            except (ValueError, TypeError, IndexError):
                if not fails:
                    raise
            else:
                if fails:
                    raise AssertionError("this call is to fail")

    repeat(min(N_FIRST, n))
    before, blocks = resident_bytes(), sys.getallocatedblocks()
    repeat(n)
    return resident_bytes() - before, sys.getallocatedblocks() - blocks


def rasterizer_bytes() -> tuple[int, int]:
    """Return the growth of the process by a Rasterizer of a large picture, and the part that stays without it."""
    triangles = np.tile(np.array([[0, 1, 2]], np.int32), (20_000, 1))
    scene = np.array([[0.0, 0, 0], [4000, 0, 0], [0, 3000, 0]]), triangles
    before = resident_bytes()
    rasterizer = tl.Rasterizer(LARGE, threads=1)
    for draw in (rasterizer.coverage, rasterizer.overdraw, rasterizer.rasterize, rasterizer.wireframe):
        draw(scene[0], scene[1][:50])
    with_it = resident_bytes() - before
    del rasterizer, draw
    return with_it, resident_bytes() - before


def run(options: GrowthOptions, _: Save) -> Record:
    """Measure each verb, and a Rasterizer that goes."""
    grown = {name: [*growth(right, options.calls, fails=False), *growth(wrong, options.calls, fails=True)]
             for name, (right, wrong) in calls().items()}  # fmt: skip
    return {"kind": "growth", "calls": options.calls, "grown": grown, "rasterizer": list(rasterizer_bytes())}


def lines(record: Record) -> list[str]:
    """A table: KiB that the process has grown by, and Python's blocks."""
    n = f"{record['calls']:,}"
    made = [f"| verb | {n} calls | Python's blocks | {n} that fail | Python's blocks |", "|---|---:|---:|---:|---:|"]
    for name, (right, blocks, wrong, wrong_blocks) in record["grown"].items():
        made.append(f"| {name} | {right // 1024} KiB | {blocks} | {wrong // 1024} KiB | {wrong_blocks} |")
    with_it, after = record["rasterizer"]
    made.append(f"\nA Rasterizer of {LARGE[0]}x{LARGE[1]} holds {with_it / 2**20:.1f} MiB after four verbs; "
                f"{after / 2**20:.1f} MiB stay when it goes.")  # fmt: skip
    return made


@dataclass(frozen=True)
class GrowthOptions(Options):
    calls: int = count(10_000, "--calls", "of each verb")


STUDY = Study("growth", "memory after thousands of calls, and of calls that fail", GrowthOptions, run, lines)
