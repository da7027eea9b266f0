"""Blend2D: fill_path, one path of all triangles, or a path and a fill a triangle for colours. It always antialiases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "blend2d", "blend2d-py"
TASKS = ("smooth", "smooth-fill")


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Coverage is white on black: any channel. Pixels are BGRA."""
    import blend2d

    image = blend2d.Image(*scene.size)
    corners = scene.vertices[:, :2][scene.triangles].tolist()
    is_coverage = scene.task == "smooth"
    paths = [path_of(blend2d, part) for part in ([corners] if is_coverage else [[corner] for corner in corners])]
    values = [(255, 255, 255)] if is_coverage else scene.colors.tolist()

    def draw() -> None:
        context = blend2d.Context(image)
        context.set_fill_style_rgba(0, 0, 0)
        context.fill_all()
        for path, value in zip(paths, values, strict=True):
            context.set_fill_style_rgba(*value)
            context.fill_path(path)
        context.end()

    if is_coverage:
        return Drawing(draw, lambda: {"smooth": np.asarray(image.asarray())[..., 0]}, "RGBA, one path", "path")
    return Drawing(draw, lambda: {"color": np.asarray(image.asarray())[..., 2::-1]}, "RGBA", "paths")


def path_of(blend2d, corners: Sequence[Sequence[Sequence[float]]]):
    """One path of triangles (n, 3, 2)."""
    path = blend2d.Path()
    for (x0, y0), (x1, y1), (x2, y2) in corners:
        path.move_to(x0, y0)
        path.line_to(x1, y1)
        path.line_to(x2, y2)
        path.close()
    return path
