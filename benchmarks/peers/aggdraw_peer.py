"""Anti-Grain Geometry as aggdraw has it: polygon, a call a triangle.

It fills a quarter of a pixel beyond each edge, pen or no pen.
"""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE = DISTRIBUTION = "aggdraw"
TASKS = ("smooth", "smooth-fill")


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """A new canvas for each picture: an old one cannot be cleared without drawing."""
    import aggdraw

    width, height = scene.size
    polygons = scene.vertices[:, :2][scene.triangles].reshape(-1, 6).tolist()
    if scene.task == "smooth":
        mode, name, brushes = "L", "smooth", [aggdraw.Brush(255)] * len(polygons)
    else:
        mode, name, brushes = "RGB", "color", [aggdraw.Brush(tuple(color)) for color in scene.colors.tolist()]
    found: list[aggdraw.Draw] = []

    def draw() -> None:
        canvas = aggdraw.Draw(mode, scene.size, 0)
        for polygon, brush in zip(polygons, brushes, strict=True):
            canvas.polygon(polygon, None, brush)
        found[:] = [canvas]

    def picture() -> dict[str, np.ndarray]:
        pixels = np.frombuffer(found[0].tobytes(), np.uint8)
        return {name: pixels.reshape(height, width, -1) if name == "color" else pixels.reshape(height, width)}

    gives, untimed = ("coverage", "") if name == "smooth" else ("RGB image", "brushes, ")
    return Drawing(draw, picture, gives, untimed + "coordinates to lists")
