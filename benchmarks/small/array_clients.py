"""The clients of `python -m benchmarks clients` that draw meshes into arrays: their own code beside topleft's.

Input: a checkout. Output: a row for each case: pixels that differ, how far values are off where they agree, CPU time.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.harness.records import Record
from benchmarks.report.tables import table
from benchmarks.scenes.arrays import write_ply

Client = Callable[[Path, Any], list[Record]]
Draws = tuple[Callable[[], Any], Callable[[], Any]]

SIZES = (5_000, 20_000, 80_000)
"""Triangles of the meshes."""

POSES = 12
"""Of each object of bop_toolkit: its masks have a million pixels together."""

SNAP = 2.0**-7
"""Pixels: both programs move vertices by up to half of 1 / 256."""

INTRINSICS = (572.4114, 573.57043, 325.2611, 242.04899)
"""Of the camera of the data set LINEMOD: fx, fy, cx, cy."""


def timed(theirs: Callable[[], Any], ours: Callable[[], Any], rounds: int) -> Record:
    """Milliseconds of CPU time of both, medians of calls in turns."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(rounds):
        for draw, found in zip((theirs, ours), times, strict=True):
            start = time.process_time()
            draw()
            found.append(time.process_time() - start)
    return {"ms": [1e3 * statistics.median(found) for found in times]}


def run_bop(folder: Path, options: Any) -> list[Record]:
    """Objects in many poses by bop_toolkit's vispy renderer and by topleft, and their errors VSD."""
    os.environ.setdefault("EGL_PLATFORM", "surfaceless")
    os.environ.setdefault("LP_NUM_THREADS", "1")
    sys.path.insert(0, str(folder))
    from bop_toolkit_lib import pose_error
    from bop_toolkit_lib.rendering import renderer

    from topleft.compat import bop

    rng = np.random.default_rng(0)
    rows: list[Record] = []
    with tempfile.TemporaryDirectory() as folder_of_models:
        paths = {n: Path(folder_of_models, f"{n}.ply") for n in SIZES}
        for n, path in paths.items():
            write_bumpy(path, n)
        for mode in ("depth", "rgb+depth"):
            both = [own.create_renderer(640, 480, "vispy", mode=mode) for own in (renderer, bop)]
            for n, path in paths.items():
                for own in both:
                    own.add_object(n, str(path))
                poses = [pose_of(rng) for _ in range(POSES)]
                rows.append({"case": f"{n} triangles, {mode}"} | compare_poses(pose_error, both, n, poses, options))
    return rows


def compare_poses(pose_error: Any, both: list[Any], n: int, poses: list[Any], options: Any) -> Record:
    """Pixels of masks that differ, depth that is off, errors VSD that differ, and the median time of a call."""
    row: Record = {"pixels": 0, "differ": 0, "beyond edges": 0, "off": 0.0, "vsd": 0.0}
    found: list[Record] = []
    K = np.array([[INTRINSICS[0], 0, INTRINSICS[2]], [0, INTRINSICS[1], INTRINSICS[3]], [0, 0, 1]])
    for R, t in poses:
        theirs, ours = ({k: np.array(v) for k, v in own.render_object(n, R, t, *INTRINSICS).items()} for own in both)
        masks = theirs["depth"] > 0, ours["depth"] > 0
        agree = masks[0] & masks[1]
        error = np.abs(theirs["depth"] - ours["depth"])[agree] / theirs["depth"][agree]
        row["pixels"] += int(masks[0].sum())
        differ = masks[0] != masks[1]
        row["differ"] += int(differ.sum())
        row["beyond edges"] += int((differ & ~near_edge(both[1], n, R, t)).sum()) if differ.any() else 0
        row["off"] = max(row["off"], float(np.quantile(error, 0.99)))
        draws = [lambda own=own, R=R, t=t: own.render_object(n, R, t, *INTRINSICS) for own in both]
        found.append(timed(*draws, options.rounds))
        # an estimate that is off by 12 mm, on a depth image of its own
        errors = [
            pose_error.vsd(
                R, t + [[9.0], [0], [8]], R, t, theirs["depth"], K, 15, np.arange(0.05, 0.51, 0.05), True, 180.0, own, n
            )
            for own in both
        ]
        row["vsd"] = max(row["vsd"], float(np.abs(np.subtract(*errors)).max()))
    return row | {"ms": [statistics.median(own["ms"][k] for own in found) for k in range(2)]}


def near_edge(renderer: Any, n: int, R: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Where the outline passes so close to a centre that the snap of a vertex may decide."""
    fx, fy, cx, cy = INTRINSICS
    shifts = [(x, y) for x in (-SNAP, SNAP) for y in (-SNAP, SNAP)]
    masks = [renderer.render_object(n, R, t, fx, fy, cx + x, cy + y)["depth"] > 0 for x, y in shifts]
    near: np.ndarray = np.any(masks, axis=0) & ~np.all(masks, axis=0)
    return near


def pose_of(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A rotation, and a place before the camera, millimetres."""
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return R * np.linalg.det(R), rng.uniform([-60, -60, 400], [60, 60, 900])[:, None]


def write_bumpy(path: Path, n: int) -> None:
    """Write a bumpy object of about n triangles, 180 mm long, for the reader of bop_toolkit."""
    vertices, triangles = tl.scenes.blob(n)
    vertices = vertices * [60, 40, 90]
    normals = tl.Mesh(vertices, triangles).vertex_normals().T.astype("<f4")
    colors = np.rint(127 + 127 * np.sin(vertices / 20)).astype(np.uint8).T
    columns = zip(("nx", "ny", "nz", "red", "green", "blue"), (*normals, *colors), strict=True)
    write_ply(path, vertices, triangles, **dict(columns))


def run_pytorch3d(folder: Path, options: Any) -> list[Record]:
    """Expected values of the tests of PyTorch3D without blur, and spheres by its kernel for the CPU and by topleft."""
    sys.path.insert(0, str(folder))
    import torch
    from pytorch3d.renderer.mesh.rasterize_meshes import rasterize_meshes
    from pytorch3d.structures import Meshes
    from tests.test_rasterize_meshes import TestRasterizeMeshes

    from topleft.compat import pytorch3d

    torch.set_num_threads(1)
    for name in ("_simple_triangle_raster", "_test_back_face_culling"):  # each raises if a value is not as expected
        getattr(TestRasterizeMeshes(), name)(pytorch3d.rasterize_meshes, torch.device("cpu"), bin_size=0)
    rows: list[Record] = []
    for n, k, in_space in ((1_280, 1, True), (1_280, 4, True), (5_120, 1, True), (5_120, 1, False)):
        vertices, triangles = tl.scenes.blob(n)
        points = torch.tensor(vertices * 0.7 + [0, 0, 2.5], dtype=torch.float32)
        meshes = Meshes(verts=[points], faces=[torch.tensor(np.array(triangles), dtype=torch.int64)])
        draws = [
            lambda own=own, meshes=meshes, k=k, in_space=in_space: own(
                meshes, 128, 0.0, k, perspective_correct=in_space
            )
            for own in (rasterize_meshes, pytorch3d.rasterize_meshes)
        ]
        theirs, ours = ([np.asarray(part) for part in draw()] for draw in draws)
        same = theirs[0] == ours[0]
        case = f"{n} faces, {k} a pixel, {'in space' if in_space else 'on the screen'}"
        row = {"case": case, "pixels": int((theirs[0] >= 0).sum()), "differ": int((~same).sum())}
        row["off"] = max(float(np.abs(a - b)[same].max()) for a, b in zip(theirs[1:], ours[1:], strict=True))
        rows.append(row | timed(*draws, options.rounds))
    return rows


def run_custom_rasterizer(folder: Path, options: Any) -> list[Record]:
    """Faces and weights by the kernel of Hunyuan3D for the CPU; its compiled module lies in the folder."""
    sys.path.insert(0, str(folder))
    import torch

    from topleft.compat import custom_rasterizer

    kernel = import_module("custom_rasterizer_kernel")  # after PyTorch: it needs its libraries
    torch.set_num_threads(1)
    rows: list[Record] = []
    for n, size in zip(SIZES, (256, 512, 1024), strict=True):
        vertices, triangles = tl.scenes.blob(n)
        camera = tl.Camera.look_at((0, 0.7, 3), fov_y_deg=45)
        pos = torch.tensor(tl.scenes.to_clip(vertices, camera.clip_from_world(size)), dtype=torch.float32)
        tri = torch.tensor(np.array(triangles), dtype=torch.int32)
        draws = [
            lambda pos=pos, tri=tri, size=size: kernel.rasterize_image(pos, tri, torch.zeros(0), size, size, 1e-6, 0),
            lambda pos=pos, tri=tri, size=size: custom_rasterizer.rasterize(pos[None], tri, (size, size)),
        ]
        row = compare_faces(*(draw() for draw in draws)) | timed(*draws, options.rounds)
        rows.append({"case": f"{n} faces, {size}x{size}"} | row)
    return rows


def run_texture_baker(folder: Path, options: Any) -> list[Record]:
    """Faces and weights of atlases by the kernel of Stable Fast 3D for the CPU, and by topleft."""
    import torch

    sys.path.insert(0, str(folder))
    import texture_baker

    from topleft.compat.texture_baker import TextureBaker

    torch.set_num_threads(1)
    rows: list[Record] = []
    for n, size in zip(SIZES, (512, 1024, 2048), strict=True):
        points, triangles = tl.scenes.planar_mesh(n // 2, 1, 1)
        uv, faces = torch.tensor(points, dtype=torch.float32), torch.tensor(np.array(triangles))
        theirs, ours = (
            lambda own=own, uv=uv, faces=faces, size=size: own.rasterize(uv, faces, size)
            for own in (texture_baker.TextureBaker(), TextureBaker())
        )
        drawn = [(rast[..., 3] + 1, rast[..., :3]) for rast in (theirs(), ours())]
        row = compare_faces(*drawn) | timed(theirs, ours, options.rounds)
        rows.append({"case": f"{n} faces, {size}x{size}"} | row)
    return rows


def compare_faces(theirs: Any, ours: Any) -> Record:
    """The number of pixels with another face, counted from 1, and the error of weights in 99 % of the others."""
    (ids, weights), (own_ids, own_weights) = ([np.asarray(part) for part in parts] for parts in (theirs, ours))
    same = (ids == own_ids) & (ids > 0)
    row: Record = {"pixels": int((ids > 0).sum()), "differ": int((ids != own_ids).sum())}
    row["off"] = float(np.quantile(np.abs(weights - own_weights).max(axis=2)[same], 0.99))
    return row


ARRAY_CLIENTS: Mapping[str, Client] = {
    "bop": run_bop,
    "pytorch3d": run_pytorch3d,
    "custom_rasterizer": run_custom_rasterizer,
    "texture_baker": run_texture_baker,
}


def lines_of(name: str, rows: list[Record]) -> Iterator[str]:
    """The table of a client."""
    yield f"{name} beside topleft.compat.{name}"
    counts = [key for key in ("pixels", "differ", "beyond edges") if key in rows[0]]
    errors = [key for key in ("off", "vsd") if key in rows[0]]
    yield from table(
        ["case", *counts, *(f"{key} by" for key in errors), "its ms", "ms", "times"],
        [
            [
                row["case"],
                *(str(row[key]) for key in counts),
                *(f"{row[key]:.1e}" for key in errors),
                *(f"{ms:.2f}" for ms in row["ms"]),
                f"{row['ms'][0] / row['ms'][1]:.1f}",
            ]
            for row in rows
        ],
    )
