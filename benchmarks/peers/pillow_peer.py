"""Pillow: ImageDraw.polygon, a call a triangle. It draws the outline too.

Smooth pictures are drawn four times as wide and high and reduced.
"""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "PIL", "pillow"
TASKS = ("mask", "fill", "labels", "smooth", "smooth-fill")
FINER = 4


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Coordinates are truncated, to the pixel that they lie in: vertices stay where they are."""
    from PIL import Image, ImageDraw

    is_smooth = scene.task in ("smooth", "smooth-fill")
    finer = FINER if is_smooth else 1
    polygons = (scene.vertices[:, :2] * finer)[scene.triangles].reshape(-1, 6).tolist()
    mode = {"fill": "RGB", "smooth-fill": "RGB", "labels": "I"}.get(scene.task, "L")
    values = [255] * len(polygons)
    if scene.task in ("fill", "smooth-fill"):
        values = list(map(tuple, scene.colors.tolist()))
    elif scene.task == "labels":
        values = list(range(len(polygons)))
    background = -1 if scene.task == "labels" else 0
    size = (scene.size[0] * finer, scene.size[1] * finer)
    image = Image.new(mode, size, background)
    everything = (0, 0, *size)
    reduced = [image]

    def draw() -> None:
        image.paste(background, everything)
        canvas = ImageDraw.Draw(image)
        for polygon, value in zip(polygons, values, strict=True):
            canvas.polygon(polygon, value)
        if is_smooth:
            reduced[:] = [image.reduce(FINER)]

    name = {"fill": "color", "smooth-fill": "color", "labels": "triangle", "smooth": "smooth"}.get(scene.task, "mask")
    gives = {"fill": "RGB image", "smooth-fill": "RGB image, 16 samples", "labels": "id image", "smooth": "16 samples"}
    return Drawing(
        draw,
        lambda: {name: np.asarray(reduced[0]) > 0 if name == "mask" else np.asarray(reduced[0])},
        gives.get(scene.task, "mask image"),
        "coordinates to lists",
    )
