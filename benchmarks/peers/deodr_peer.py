"""DEODR: depth and one colour channel of pixel-space triangles, back faces culled or not."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.peers.views import deodr_scene, draw_by_deodr
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "deodr", "deodr"
TASKS = ("visibility", "depth-2d", "labels", "views", "views-png")


def prepare(scene: Scene, threads: int) -> Drawing:
    """Labels are drawn as colours, float64, at one depth."""
    if scene.views is not None:
        return draw_by_deodr(scene, threads)
    from deodr import differentiable_renderer as renderer

    snapped = scene.snapped()
    z = snapped[:, 2] if snapped.shape[1] > 2 else np.zeros(len(snapped))
    width, height = scene.size
    n_vertices, n_triangles = len(z), len(scene.triangles)
    is_label = scene.task == "labels"
    # Without depth the first triangle wins: labels are drawn from the last to the first.
    triangles = np.ascontiguousarray(scene.triangles[::-1] if is_label else scene.triangles, np.uint32)
    xy_px = snapped[:, :2] if scene.transform is not None else scene.vertices[:, :2].astype(np.float64)
    colors = np.zeros((n_vertices, 1))
    if is_label:  # flat: corners of their own
        xy_px, z = xy_px[triangles.reshape(-1)], np.zeros(3 * n_triangles)
        triangles = np.arange(3 * n_triangles, dtype=np.uint32).reshape(-1, 3)
        colors = np.repeat(np.arange(n_triangles)[::-1] + 1.0, 3)[:, None]
        n_vertices = len(z)
    ij, depths = np.ascontiguousarray(xy_px), np.ascontiguousarray(z, np.float64)
    world = deodr_scene(scene, triangles, n_vertices, ij=ij, depths=depths, colors=colors)
    image, depth = np.zeros((height, width, 1)), np.zeros((height, width))

    def draw() -> None:
        renderer.renderScene(world, 0, image, depth, False, None, None, False)

    if is_label:
        labels = lambda: {"triangle": image[..., 0].round().astype(np.int32) - 1}  # noqa: E731
        return Drawing(draw, labels, "label + depth", "corners")
    return Drawing(draw, lambda: {"depth": depth.astype(np.float32)}, "depth", "transform or copy")
