"""Anti-Grain Geometry as aggdraw has it: polygon, a call a triangle.

It fills a quarter of a pixel beyond each edge, pen or no pen.
"""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE = DISTRIBUTION = "aggdraw"
TASKS = ("smooth",)


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """A new canvas for each picture: an old one cannot be cleared without drawing."""
    import aggdraw

    polygons = scene.vertices[:, :2][scene.triangles].reshape(-1, 6).tolist()
    brush = aggdraw.Brush(255)
    found: list[aggdraw.Draw] = []

    def draw() -> None:
        canvas = aggdraw.Draw("L", scene.size, 0)
        for polygon in polygons:
            canvas.polygon(polygon, None, brush)
        found[:] = [canvas]

    def picture() -> dict[str, np.ndarray]:
        width, height = scene.size
        return {"smooth": np.frombuffer(found[0].tobytes(), np.uint8).reshape(height, width)}

    return Drawing(draw, picture, "coverage", "coordinates to lists")
