"""Levels of detail: time beside error of each level, near and far.

The error is measured on masks, not taken from the bound: how far a sample that one outline holds lies from the other.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.harness.arguments import Options, count, option
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.levels import tables
from benchmarks.report.study import Study
from topleft._meshes.lod.detail import ScreenError, window_of

SIZE = (1920, 1080)
HEIGHTS_PX = (1000, 300, 100, 30, 10)
"""How high meshes stand in the picture: near to far."""

SAMPLES = 1200
"""About how many samples high the masks are that are compared."""

TOLERANCE = 0.5
FOV_Y_DEG = 40.0


@dataclass(frozen=True)
class LevelOptions(Options):
    meshes: Sequence[str] = option((), "--mesh", "meshes besides the generated ones", nargs="*", metavar="FILE")
    n_triangles: int = count(10_000_000, "--triangles", "of the blob")
    rounds: int = count(5, "--rounds")


def run(options: LevelOptions, _: Save) -> Record:
    """Return the record."""
    record: dict[str, Any] = {
        "kind": "levels", **describe("fast-simplification"), "size": list(SIZE), "tolerance": TOLERANCE,
        "rounds": options.rounds, "meshes": [],
    }  # fmt: skip
    found = [(name, mesh, *make_levels(mesh)) for name, mesh in subjects(options)]
    times = [draw_times(mesh, levels, options.rounds) for _, mesh, levels, _ in found]  # all in one go
    for (name, mesh, levels, made_s), own in zip(found, times, strict=True):
        record["meshes"].append(measure_mesh(name, mesh, levels, own) | {"made_s": made_s})
    return record


def subjects(options: LevelOptions) -> Iterator[tuple[str, tl.Mesh]]:
    """Give the meshes: a shape that ships, those of files, and a large blob."""
    yield "torus-knot", tl.Mesh(*tl.scenes.shape("torus-knot"))
    for path in options.meshes:
        yield Path(path).stem, tl.load(path)
    yield "blob", tl.Mesh(*tl.scenes.blob(options.n_triangles))


def make_levels(mesh: tl.Mesh) -> tuple[tl.Levels, float]:
    """Return new levels, and the CPU time of all threads: how many there are, and neighbours, hardly change it."""
    started = time.process_time()
    return tl.simplify(mesh), time.process_time() - started


def measure_mesh(name: str, mesh: tl.Mesh, levels: tl.Levels, times: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the times of all levels of a mesh, and their errors, at each height."""
    extent = extent_of(mesh)
    views = []
    for height_px, own in zip(HEIGHTS_PX, times, strict=True):
        camera = camera_at(mesh, extent, height_px)
        chosen = tl.choose_detail(mesh, camera, SIZE, tolerance=TOLERANCE)
        matrix = camera.clip_from_world(SIZE)
        fineness = max(1, min(8, SAMPLES // height_px))
        masks = [mask_of(level.mesh, matrix, fineness, height_px) for level in levels]
        rows = []
        for level, mask, turns in zip(levels, masks, own["turns_ms"], strict=True):
            scale = ScreenError(matrix, SIZE, window_of(SIZE, None, (0, 0))).scale_of(None, levels[0], level)
            bound_px = None if scale is None else level.bound * scale
            rows.append({"turns_ms": turns, "bound_px": bound_px, "error_px": outlines_px(masks[0], mask) / fineness})
        views.append({"height_px": height_px, "level": chosen.level, "resolution_px": 1 / fineness, "levels": rows,
                      "clustered_ms": own["clustered_ms"]})  # fmt: skip
    sizes = [{"n_triangles": len(one.mesh.triangles), "bound": one.bound / extent, "known": one.known / extent}
             for one in levels]  # fmt: skip
    return {"name": name, "n_triangles": len(mesh.triangles), "levels": sizes, "views": views}


def extent_of(mesh: tl.Mesh) -> float:
    """Return the longest side of the box."""
    return float(np.ptp(mesh.bounds, axis=0).max())


def camera_at(mesh: tl.Mesh, extent: float, height_px: int) -> tl.Camera:
    """A camera that sees the longest side of the mesh about so many pixels long."""
    middle = mesh.bounds.mean(axis=0)
    distance = extent * SIZE[1] / height_px / (2 * np.tan(np.radians(FOV_Y_DEG) / 2)) + extent / 2
    return tl.Camera.look_at(middle + [0, 0, distance], middle, fov_y_deg=FOV_Y_DEG)


def draw_times(mesh: tl.Mesh, levels: tl.Levels, rounds: int) -> list[dict[str, Any]]:
    """Return the time of `rasterize` at each height, on memory that is kept, one thread, in turns; milliseconds.

    `turns_ms`: of each level, from arrays; `clustered_ms`: of the mesh as one that is drawn again, in clusters.
    """
    rasterizer = tl.Rasterizer(SIZE, threads=1)
    arrays = [(one.mesh.vertices, one.mesh.triangles) for one in levels]
    found = []
    for height_px in HEIGHTS_PX:
        camera = camera_at(mesh, extent_of(mesh), height_px)
        matrix = camera.clip_from_world(SIZE)
        turns: list[list[float]] = [[] for _ in range(len(levels) + 1)]
        for i in range(rounds + 2):
            for k, own in enumerate(turns):
                started = time.perf_counter_ns()
                if k == len(levels):
                    tl.rasterize_mesh(mesh, camera, SIZE, rasterizer=rasterizer, threads=1)
                else:
                    rasterizer.rasterize(*arrays[k], transform=matrix)
                if i > 1:  # the first one touches the memory, and from the second on there are clusters
                    own.append((time.perf_counter_ns() - started) / 1e6)
        found.append({"turns_ms": turns[:-1], "clustered_ms": turns[-1]})
    return found


def mask_of(mesh: tl.Mesh, matrix: Any, fineness: int, height_px: int) -> Any:
    """Return the mask in the middle of the picture, with so many samples a pixel along each axis."""
    width, height = (fineness * n for n in SIZE)
    side = min(height, int(1.3 * fineness * height_px) + 8 * fineness)
    origin = (width - side) // 2, (height - side) // 2
    size = side, side
    return tl.coverage(mesh.vertices, mesh.triangles, size, transform=matrix, viewport=(width, height), origin=origin)


def outlines_px(one: Any, other: Any) -> float:
    """Return how far a sample of either mask is from the other."""
    from scipy.ndimage import distance_transform_edt

    ways = ((one, other), (other, one))
    return max(float(distance_transform_edt(~b)[a].max(initial=0.0)) for a, b in ways if b.any())


STUDY = Study(
    "levels", "measure levels of detail: time beside error", LevelOptions, run, tables.lines, tables.PARTS,
    "benchmarks.levels.charts",
)  # fmt: skip
