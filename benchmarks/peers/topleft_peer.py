"""topleft itself, on memory that a `Rasterizer` keeps."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE = DISTRIBUTION = "topleft"
TASKS = ("visibility", "depth-2d", "mask", "fill", "labels", "empty", "views", "views-png")
THREADS = True


def prepare(scene: Scene, threads: int) -> Drawing:
    """Every call takes the arrays as they come and includes the transform or snap, and the clear."""
    import topleft as tl

    if scene.views is not None:
        from benchmarks.peers.views import draw_by_topleft

        return draw_by_topleft(scene, threads)
    rasterizer = tl.Rasterizer(scene.size, threads=threads)
    width, height = scene.size
    mesh = scene.vertices, scene.triangles
    if scene.task == "visibility":
        view = {"transform": scene.transform, "cull": scene.cull}
        return Drawing(
            lambda: rasterizer.rasterize(*mesh, **view),
            lambda: _fragments(rasterizer.rasterize(*mesh, **view)),
            "id + depth",
        )
    if scene.task == "depth-2d":
        return Drawing(
            lambda: rasterizer.rasterize(*mesh), lambda: _fragments(rasterizer.rasterize(*mesh)), "id + depth"
        )
    if scene.task == "fill":
        canvas = np.zeros((height, width, scene.colors.shape[1]), np.uint8)
        return Drawing(
            lambda: rasterizer.fill(*mesh, scene.colors, per="triangle", background=0, out=canvas),
            lambda: {"color": canvas},
            "RGB",
        )
    if scene.task == "labels":  # vertices (V, 2) are drawn in painter's order
        return Drawing(
            lambda: rasterizer.rasterize(*mesh, depth_test=None),
            lambda: {"triangle": rasterizer.rasterize(*mesh, depth_test=None).triangle},
            "id + depth",
        )
    mask = np.zeros((height, width), np.bool_)
    return Drawing(lambda: rasterizer.coverage(*mesh, out=mask), lambda: {"mask": mask}, "mask")


def _fragments(fragments) -> dict[str, np.ndarray]:
    return {"triangle": fragments.triangle, "depth": fragments.depth}
