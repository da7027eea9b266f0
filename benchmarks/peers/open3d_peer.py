"""Open3D's ray casting scene (Embree): one ray a pixel through a tree that is built before. It cannot cull."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE = DISTRIBUTION = "open3d"
TASKS = ("visibility",)
THREADS = True


def prepare(scene: Scene, threads: int) -> Drawing:
    """Rays from the eye through the pixel centres, by the inverse of the matrix."""
    import open3d as o3d

    width, height = scene.size
    tracer = o3d.t.geometry.RaycastingScene(nthreads=threads)
    tracer.add_triangles(
        o3d.core.Tensor(np.ascontiguousarray(scene.vertices, np.float32)),
        o3d.core.Tensor(np.ascontiguousarray(scene.triangles, np.uint32)),
    )
    x, y = (np.arange(width) + 0.5) * 2 / width - 1, 1 - (np.arange(height) + 0.5) * 2 / height
    ends = np.stack([*np.meshgrid(x, y), np.ones((height, width)), np.ones((height, width))], axis=-1)
    far = ends @ np.linalg.inv(scene.transform).T
    eye = np.linalg.solve(scene.transform[[0, 1, 3], :3], -scene.transform[[0, 1, 3], 3])
    rays = np.zeros((height, width, 6), np.float32)
    rays[..., :3], rays[..., 3:] = eye, far[..., :3] / far[..., 3:] - eye
    rays = o3d.core.Tensor(rays)
    found: dict[str, np.ndarray] = {}

    def draw() -> None:
        hits = tracer.cast_rays(rays, nthreads=threads)
        found["ids"], found["distance"] = hits["primitive_ids"].numpy(), hits["t_hit"].numpy()

    return Drawing(
        draw,
        lambda: {"triangle": np.where(np.isinf(found["distance"]), -1, found["ids"].astype(np.int64)).astype(np.int32)},
        "id + distance",
        "tree, rays",
    )
