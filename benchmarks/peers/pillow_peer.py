"""Pillow: ImageDraw.polygon, a call a triangle. It draws the outline too."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE, DISTRIBUTION = "PIL", "pillow"
TASKS = ("mask", "fill", "labels")


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Pixel centres lie on integers, so vertices move by half a pixel."""
    from PIL import Image, ImageDraw

    polygons = (scene.vertices[:, :2] - 0.5)[scene.triangles].reshape(-1, 6).tolist()
    mode = {"fill": "RGB", "labels": "I"}.get(scene.task, "L")
    values = [255] * len(polygons)
    if scene.task == "fill":
        values = list(map(tuple, scene.colors.tolist()))
    elif scene.task == "labels":
        values = list(range(len(polygons)))
    background = -1 if scene.task == "labels" else 0
    image = Image.new(mode, scene.size, background)
    everything = (0, 0, *scene.size)

    def draw() -> None:
        image.paste(background, everything)
        canvas = ImageDraw.Draw(image)
        for polygon, value in zip(polygons, values, strict=True):
            canvas.polygon(polygon, value)

    name = {"fill": "color", "labels": "triangle"}.get(scene.task, "mask")
    gives = {"fill": "RGB image", "labels": "id image"}.get(scene.task, "mask image")
    return Drawing(
        draw,
        lambda: {name: np.asarray(image) > 0 if name == "mask" else np.asarray(image)},
        gives,
        "coordinates to lists",
    )
