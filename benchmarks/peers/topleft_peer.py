"""topleft itself, on memory that a `Rasterizer` keeps."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE = DISTRIBUTION = "topleft"
TASKS = ("visibility", "depth-2d", "mask", "fill", "labels", "smooth-fill", "empty", "views", "views-png")
WAYS = {"smooth-fill": ("area, one by one", "area, summed", "msaa4")}
THREADS = True


def prepare(scene: Scene, threads: int, way: str | None = None) -> Drawing:
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
        canvas, colors = np.zeros((height, width, 4), np.uint8), opaque(scene.colors)
        return Drawing(
            lambda: rasterizer.fill(*mesh, colors, per="triangle", background=0, out=canvas),
            lambda: {"color": canvas[..., :3]},
            "RGBA",
        )
    if scene.task == "smooth-fill":
        return prepare_smooth(rasterizer, scene, way)
    if scene.task == "labels":  # vertices (V, 2) are drawn in painter's order
        ids = np.zeros((height, width), np.int32)
        return Drawing(lambda: rasterizer.rasterize(*mesh, out=(ids, None)), lambda: {"triangle": ids}, "id")
    mask = np.zeros((height, width), np.bool_)
    return Drawing(lambda: rasterizer.coverage(*mesh, out=mask), lambda: {"mask": mask}, "mask")


def prepare_smooth(rasterizer, scene: Scene, way: str | None) -> Drawing:
    """Areas blended in painter's order, areas summed, or four samples a pixel."""
    width, height = scene.size
    mesh = scene.vertices, scene.triangles
    if way == "area, summed":
        area = np.zeros((height, width), np.float32)
        return Drawing(
            lambda: rasterizer.overdraw(*mesh, sampling="area", out=area), lambda: {"area": area}, "float32 area"
        )
    colors = opaque(scene.colors)
    canvas = np.zeros((height, width, 4), np.uint8)
    options = {"sampling": "msaa4"} if way == "msaa4" else {"sampling": "area", "blend": "over"}
    options |= {"per": "triangle", "background": (0, 0, 0, 255), "out": canvas}
    return Drawing(lambda: rasterizer.fill(*mesh, colors, **options), lambda: {"color": canvas[..., :3]}, "RGBA")


def opaque(colors: np.ndarray) -> np.ndarray:
    """RGBA of RGB."""
    return np.concatenate([colors, np.full((len(colors), 1), 255, np.uint8)], axis=1)


def _fragments(fragments) -> dict[str, np.ndarray]:
    return {"triangle": fragments.triangle, "depth": fragments.depth}
