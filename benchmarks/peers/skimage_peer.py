"""scikit-image: draw.polygon gives the pixels of a triangle, a call each; NumPy writes them."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "skimage", "scikit-image"
TASKS = ("mask", "labels")


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Pixel centres lie on integers, so vertices move by half a pixel."""
    from skimage.draw import polygon

    width, height = scene.size
    corners = (scene.vertices[:, :2] - 0.5)[scene.triangles]
    rows, columns = list(corners[..., 1]), list(corners[..., 0])
    is_mask = scene.task == "mask"
    canvas = np.zeros((height, width), bool if is_mask else np.int32)
    values = [True] * len(rows) if is_mask else range(len(rows))
    background = 0 if is_mask else -1
    shape = canvas.shape

    def draw() -> None:
        canvas.fill(background)
        for row, column, value in zip(rows, columns, values, strict=True):
            canvas[polygon(row, column, shape)] = value

    return Drawing(draw, lambda: {scene.task if is_mask else "triangle": canvas}, "mask" if is_mask else "id", "split")
