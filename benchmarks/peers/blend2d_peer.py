"""Blend2D: fill_path, one path of all triangles."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE, DISTRIBUTION = "blend2d", "blend2d-py"
TASKS = ("smooth",)


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """White on black: any channel is the coverage."""
    import blend2d

    image = blend2d.Image(*scene.size)
    path = blend2d.Path()
    for (x0, y0), (x1, y1), (x2, y2) in scene.vertices[:, :2][scene.triangles].tolist():
        path.move_to(x0, y0)
        path.line_to(x1, y1)
        path.line_to(x2, y2)
        path.close()

    def draw() -> None:
        context = blend2d.Context(image)
        context.set_fill_style_rgba(0, 0, 0, 255)
        context.fill_all()
        context.set_fill_style_rgba(255, 255, 255, 255)
        context.fill_path(path)
        context.end()

    return Drawing(draw, lambda: {"smooth": np.asarray(image.asarray())[..., 0]}, "RGBA, one path", "path")
