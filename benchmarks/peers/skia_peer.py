"""skia-python: drawVertices for many triangles in one call, drawPath for one.

Antialiased only if asked for; drawVertices cannot, so smooth colours are a drawPath a triangle.
"""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "skia", "skia-python"
TASKS = ("mask", "fill", "labels", "smooth", "smooth-fill")


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Labels are drawn as colours: id + 1 in 24 bits."""
    import skia

    width, height = scene.size
    corners = scene.vertices[:, :2][scene.triangles]
    if scene.task in ("mask", "smooth"):
        canvas = np.zeros((height, width), np.uint8)
        surface = skia.Surface.MakeRasterDirect(skia.ImageInfo.MakeA8(width, height), canvas, width)
        path = skia.Path()
        for triangle in corners.tolist():
            path.addPoly([skia.Point(*corner) for corner in triangle], True)
        is_smooth = scene.task == "smooth"
        paint = skia.Paint(AntiAlias=is_smooth)

        def draw_mask() -> None:
            canvas.fill(0)
            surface.getCanvas().drawPath(path, paint)

        if is_smooth:
            return Drawing(draw_mask, lambda: {"smooth": canvas}, "coverage, one path", "path")
        return Drawing(draw_mask, lambda: {"mask": canvas > 0}, "mask, one path", "path")
    if scene.task == "smooth-fill":
        return prepare_paths(scene, skia)
    if scene.task == "fill":
        packed = scene.colors.astype(np.int64) @ np.array([1 << 16, 1 << 8, 1])
    else:
        packed = np.arange(len(corners)) + 1
    points = [skia.Point(x, y) for x, y in corners.reshape(-1, 2).tolist()]
    colors = np.repeat(packed | 0xFF000000, 3).tolist()
    mesh = skia.Vertices(skia.Vertices.VertexMode.kTriangles_VertexMode, points, points, colors)
    canvas = np.zeros((height, width, 4), np.uint8)
    info = skia.ImageInfo.Make(width, height, skia.kRGBA_8888_ColorType, skia.kPremul_AlphaType)
    surface = skia.Surface.MakeRasterDirect(info, canvas, 4 * width)
    paint = skia.Paint(AntiAlias=False)

    def draw() -> None:
        canvas.fill(0)
        surface.getCanvas().drawVertices(mesh, paint, skia.BlendMode.kDst)

    def picture() -> dict[str, np.ndarray]:
        if scene.task == "fill":
            return {"color": canvas[..., :3]}
        return {"triangle": (canvas[..., :3].astype(np.int32) @ np.array([1 << 16, 1 << 8, 1])).astype(np.int32) - 1}

    return Drawing(draw, picture, "RGBA" if scene.task == "fill" else "RGBA labels", "lists to vertices")


def prepare_paths(scene: Scene, skia) -> Drawing:
    """A path a triangle: drawVertices has no antialiasing."""
    width, height = scene.size
    paths = []
    for triangle in scene.vertices[:, :2][scene.triangles].tolist():
        path = skia.Path()
        path.addPoly([skia.Point(*corner) for corner in triangle], True)
        paths.append(path)
    values = (scene.colors.astype(np.int64) @ np.array([1 << 16, 1 << 8, 1]) | 0xFF000000).tolist()
    canvas = np.zeros((height, width, 4), np.uint8)
    info = skia.ImageInfo.Make(width, height, skia.kRGBA_8888_ColorType, skia.kPremul_AlphaType)
    surface = skia.Surface.MakeRasterDirect(info, canvas, 4 * width)
    paint = skia.Paint(AntiAlias=True)

    def draw() -> None:
        target = surface.getCanvas()
        target.clear(0xFF000000)
        for path, value in zip(paths, values, strict=True):
            paint.setColor(value)
            target.drawPath(path, paint)

    return Drawing(draw, lambda: {"color": canvas[..., :3]}, "RGBA", "paths")
