"""aggdraw: Anti-Grain Geometry, a polygon a triangle."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE = DISTRIBUTION = "aggdraw"
TASKS = ("smooth-fill",)


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Brushes and coordinates are made before."""
    import aggdraw

    width, height = scene.size
    polygons = scene.vertices[:, :2][scene.triangles].reshape(-1, 6).tolist()
    brushes = [aggdraw.Brush(tuple(color)) for color in scene.colors.tolist()]
    canvas = aggdraw.Draw("RGB", scene.size, "black")
    canvas.setantialias(True)
    black, everything = aggdraw.Brush("black"), (0, 0, width, height)

    def draw() -> None:
        canvas.rectangle(everything, None, black)
        for polygon, brush in zip(polygons, brushes, strict=True):
            canvas.polygon(polygon, None, brush)

    def picture() -> dict[str, np.ndarray]:
        return {"color": np.frombuffer(canvas.tobytes(), np.uint8).reshape(height, width, 3)}

    return Drawing(draw, picture, "RGB image", "brushes, coordinates to lists")
