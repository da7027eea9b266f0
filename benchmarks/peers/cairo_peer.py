"""pycairo: a path and a fill a triangle, without antialiasing, or with it for smooth pictures."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "cairo", "pycairo"
TASKS = ("mask", "fill", "labels", "smooth", "smooth-fill")


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Labels are drawn as colours: id + 1 in 24 bits."""
    import cairo

    width, height = scene.size
    polygons = scene.vertices[:, :2][scene.triangles].reshape(-1, 6).tolist()
    is_mask = scene.task in ("mask", "smooth")
    if is_mask:
        rgb = np.ones((len(polygons), 3))
    elif scene.task in ("fill", "smooth-fill"):
        rgb = scene.colors / 255
    else:
        rgb = (np.arange(len(polygons))[:, None] + 1 >> np.array([16, 8, 0]) & 255) / 255
    values = rgb.tolist()
    layout = cairo.FORMAT_A8 if is_mask else cairo.FORMAT_RGB24
    canvas = np.zeros((height, cairo.ImageSurface.format_stride_for_width(layout, width)), np.uint8)
    context = cairo.Context(cairo.ImageSurface.create_for_data(canvas, layout, width, height))
    quality = {"smooth": cairo.ANTIALIAS_BEST, "smooth-fill": cairo.ANTIALIAS_DEFAULT}
    context.set_antialias(quality.get(scene.task, cairo.ANTIALIAS_NONE))

    def draw() -> None:
        canvas.fill(0)
        for (x0, y0, x1, y1, x2, y2), value in zip(polygons, values, strict=True):
            context.set_source_rgb(*value)
            context.move_to(x0, y0)
            context.line_to(x1, y1)
            context.line_to(x2, y2)
            context.fill()

    def picture() -> dict[str, np.ndarray]:
        if scene.task == "smooth":
            return {"smooth": canvas[:, :width]}
        if is_mask:
            return {"mask": canvas[:, :width] > 0}
        color = canvas[:, : 4 * width].view(np.uint32).reshape(height, width) & 0xFFFFFF
        if scene.task == "labels":
            return {"triangle": color.astype(np.int32) - 1}
        return {"color": np.stack([color >> 16, color >> 8 & 255, color & 255], axis=-1).astype(np.uint8)}

    gives = {"mask": "mask", "smooth": "coverage, ANTIALIAS_BEST", "labels": "RGB labels"}
    return Drawing(draw, picture, gives.get(scene.task, "RGB"), "lists")
