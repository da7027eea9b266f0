"""Pillow: ImageDraw.polygon, a call a triangle; it draws the outline too. Smooth: 4 x 4 as large, then reduced."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE, DISTRIBUTION = "PIL", "pillow"
TASKS = ("mask", "fill", "labels", "smooth-fill")
SUPERSAMPLING = 4


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Pixel centres lie on integers, so vertices move by half a pixel."""
    from PIL import Image, ImageDraw

    is_smooth = scene.task == "smooth-fill"
    scale = SUPERSAMPLING if is_smooth else 1
    polygons = (scene.vertices[:, :2] * scale - 0.5)[scene.triangles].reshape(-1, 6).tolist()
    mode = {"fill": "RGB", "smooth-fill": "RGB", "labels": "I"}.get(scene.task, "L")
    values = [255] * len(polygons)
    if scene.task in ("fill", "smooth-fill"):
        values = list(map(tuple, scene.colors.tolist()))
    elif scene.task == "labels":
        values = list(range(len(polygons)))
    background = -1 if scene.task == "labels" else 0
    size = (scene.size[0] * scale, scene.size[1] * scale)
    image = Image.new(mode, size, background)
    everything = (0, 0, *size)
    reduced = [image]

    def draw() -> None:
        image.paste(background, everything)
        canvas = ImageDraw.Draw(image)
        for polygon, value in zip(polygons, values, strict=True):
            canvas.polygon(polygon, value)
        if is_smooth:
            reduced[0] = image.reduce(SUPERSAMPLING)

    name = {"fill": "color", "smooth-fill": "color", "labels": "triangle"}.get(scene.task, "mask")
    gives = {"fill": "RGB image", "smooth-fill": "RGB image", "labels": "id image"}.get(scene.task, "mask image")
    return Drawing(
        draw,
        lambda: {name: np.asarray(reduced[0]) > 0 if name == "mask" else np.asarray(reduced[0])},
        gives,
        "coordinates to lists",
    )
