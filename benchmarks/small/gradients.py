"""Forward and backward of colours and silhouettes, the loss left out, beside DEODR. `python -m benchmarks gradients`.

Needs PyTorch; DEODR (`pip install deodr`) where it is installed. Both run in turns on one thread; times are CPU time.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from statistics import median
from time import process_time
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study

#: Triangles, width and height.
SCENES = ((10_000, 512, 512), (70_000, 512, 512), (100_000, 1920, 1080))


def blob(n_triangles: int, width: int, height: int) -> tuple[Any, Any]:
    """Return a wavy ball in clip space, (V, 4) float32, and its triangles."""
    n = int(math.sqrt(n_triangles / 2))
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, n + 1), indexing="ij")
    r = 1 + 0.15 * np.sin(5 * theta) * np.cos(4 * phi)
    axes = [r * np.sin(theta) * np.cos(phi), r * np.cos(theta), r * np.sin(theta) * np.sin(phi)]
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    triangles = np.concatenate([i + [0, 1, n + 2], i + [0, n + 2, n + 1]]).astype(np.int32)
    camera = tl.Camera.look_at((0, 0.5, 3.0), (0, 0, 0), fov_y_deg=50)
    clip = tl.scenes.to_clip(np.stack(axes, -1).reshape(-1, 3), camera.clip_from_world((width, height)))
    return clip.astype(np.float32), triangles


def step_of_topleft(clip: Any, triangles: Any, size: tuple[int, int], edges: str) -> Callable[[], None]:
    """Return a call of forward and backward of `topleft.torch`."""
    import torch

    import topleft.torch as dr

    torch.set_num_threads(1)
    context, tri = dr.RasterizeContext(threads=1, output_db=False), torch.from_numpy(triangles)
    pos, colors = torch.from_numpy(clip)[None].requires_grad_(), torch.rand(1, len(clip), 3, requires_grad=True)
    across, g = dr.antialias_construct_topology_hash(tri), torch.rand(1, size[1], size[0], 3)

    def step() -> None:
        pos.grad = colors.grad = None
        rast, _ = dr.rasterize(context, pos, tri, size[::-1])
        out, _ = dr.interpolate(colors, rast, tri)
        dr.antialias(out, rast, pos, tri, topology_hash=across, edges=edges).backward(g)

    return step


def step_of_loss(clip: Any, triangles: Any, size: tuple[int, int]) -> Callable[[], None]:
    """Return a call of a loss with its gradients, in one."""
    import torch

    import topleft.torch as dr

    context, tri = dr.RasterizeContext(threads=1, output_db=False), torch.from_numpy(triangles)
    pos, colors = torch.from_numpy(clip)[None].requires_grad_(), torch.rand(1, len(clip), 3, requires_grad=True)
    across, target = dr.antialias_construct_topology_hash(tri), torch.rand(1, size[1], size[0], 3)

    def step() -> None:
        pos.grad = colors.grad = None
        dr.photometric_loss(context, pos, tri, colors, target, across).backward()

    return step


def step_of_deodr(clip: Any, triangles: Any, size: tuple[int, int]) -> Callable[[], None] | None:
    """Return the same of DEODR, None where it is not installed; the silhouettes are found before."""
    try:
        from deodr.differentiable_renderer import Scene2D
    except ImportError:
        return None
    (width, height), n, w = size, len(clip), clip[:, 3].astype(float)
    px = np.stack([(clip[:, 0] / w * 0.5 + 0.5) * width, (0.5 - clip[:, 1] / w * 0.5) * height], 1)
    (ax, ay), (bx, by), (cx, cy) = (px[triangles[:, k]].T for k in range(3))
    is_front = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay) < 0
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, 1)], -1).reshape(-1, 2).astype(np.int64), 1)
    _, edge = np.unique(ends[:, 0] << 32 | ends[:, 1], return_inverse=True)
    flags = (np.bincount(edge, np.repeat(is_front, 3))[edge] == 1).reshape(-1, 3) & is_front[:, None]
    scene = Scene2D(
        faces=triangles.astype(np.uint32), faces_uv=triangles.astype(np.uint32), ij=np.ascontiguousarray(px), depths=w,
        textured=np.zeros(len(triangles), bool), uv=np.zeros((n, 2)), shade=np.zeros(n), colors=np.ones((n, 3)),
        shaded=np.zeros(len(triangles), bool), edgeflags=flags, height=height, width=width, nb_colors=3,
        texture=np.zeros((0, 0)), background_color=np.zeros(3), clockwise=False, backface_culling=True,
        integer_pixel_centers=False,
    )  # fmt: skip
    g = np.ones((height, width, 3))

    def step() -> None:
        scene.render(1.0)
        scene.uv_b, scene.ij_b, scene.shade_b = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros(n)
        scene.colors_b, scene.texture_b = np.zeros((n, 3)), np.zeros((0, 0))
        scene.render_backward(g)

    return step


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Measure all of them in turns."""
    rows = []
    for n_triangles, width, height in SCENES:
        clip, triangles = blob(n_triangles, width, height)
        steps = {f"topleft.torch, {edges}": step_of_topleft(clip, triangles, (width, height), edges)
                 for edges in ("silhouette", "area", "straight-through")}  # fmt: skip
        steps["topleft.torch, a loss in one, area"] = step_of_loss(clip, triangles, (width, height))
        peer = step_of_deodr(clip, triangles, (width, height))
        steps |= {"DEODR": peer} if peer else {}
        times: dict[str, list[float]] = {name: [] for name in steps}
        for _round in range(arguments.rounds):
            for name, step in steps.items():
                start = process_time()
                step()
                times[name].append(1e3 * (process_time() - start))
        rows += [
            {"scene": f"{n_triangles} triangles, {width}x{height}", "way": name, "ms": min(own), "median": median(own)}
            for name, own in times.items()
        ]
    return {"kind": "gradients", "isa": tl.build_info()["isa"], "rows": rows}


def lines(record: Record) -> list[str]:
    """One a scene and way."""
    return [
        f"{row['scene']:32}{row['way']:34}{row['ms']:8.1f} ms, median {row['median']:.1f}" for row in record["rows"]
    ]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rounds", type=int, default=12, metavar="N", help="of each way (%(default)s)")


STUDY = Study("gradients", "forward and backward of topleft.torch beside DEODR", add_arguments, run, lines)
