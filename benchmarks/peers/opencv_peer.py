"""OpenCV: fillConvexPoly, a call a triangle, on 1/256 pixel; triangleRasterizeDepth for meshes (OpenCV 5)."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "cv2", "opencv-python-headless"
TASKS = ("visibility", "mask", "fill", "labels", "smooth", "smooth-fill")
SHIFT = 8


def prepare(scene: Scene, threads: int) -> Drawing:
    """fillConvexPoly puts pixel centres on integers, so vertices move by half a pixel."""
    import cv2

    cv2.setNumThreads(threads)
    if scene.task == "visibility":
        return prepare_mesh(scene, cv2)
    width, height = scene.size
    corners = np.rint((scene.vertices[:, :2] - 0.5) * (1 << SHIFT)).astype(np.int32)[scene.triangles]
    polygons = list(corners)
    if scene.task in ("fill", "smooth-fill"):
        canvas, values = np.zeros((height, width, 3), np.uint8), scene.colors.tolist()
    elif scene.task == "labels":
        canvas, values = np.zeros((height, width), np.int32), list(range(len(polygons)))
    else:
        canvas, values = np.zeros((height, width), np.uint8), [255] * len(polygons)
    background = -1 if scene.task == "labels" else 0
    line = cv2.LINE_AA if scene.task in ("smooth", "smooth-fill") else cv2.LINE_8

    def draw() -> None:
        canvas.fill(background)
        for polygon, value in zip(polygons, values, strict=True):
            cv2.fillConvexPoly(canvas, polygon, value, line, SHIFT)

    name = {"fill": "color", "smooth-fill": "color", "labels": "triangle", "smooth": "smooth"}.get(scene.task, "mask")
    gives = {"fill": "RGB", "smooth-fill": "RGB, LINE_AA", "labels": "id", "smooth": "LINE_AA"}.get(scene.task, "mask")
    return Drawing(draw, lambda: {name: canvas > 0 if name == "mask" else canvas}, gives, "snap, split into polygons")


def prepare_mesh(scene: Scene, cv2) -> Drawing:
    """OpenCV takes a pose and a field of view, read off the scene's matrix here, and gives the distance along z."""
    if not hasattr(cv2, "triangleRasterizeDepth"):
        raise RuntimeError(f"OpenCV {cv2.__version__} has no triangleRasterizeDepth")
    width, height = scene.size
    # The rows of the matrix are scale_x * right, scale_y * up, (depth), forward: rotation and scales in one.
    forward, offset_z = scene.transform[3, :3], scene.transform[3, 3]
    scale_x, scale_y = np.linalg.norm(scene.transform[0, :3]), np.linalg.norm(scene.transform[1, :3])
    if not np.isclose(scale_x * width, scale_y * height):
        raise ValueError("the camera has pixels that are not square")
    pose = np.eye(4)
    pose[0] = scene.transform[0] / scale_x
    pose[1] = scene.transform[1] / scale_y
    pose[2] = -scene.transform[3]
    ratio, offset = scene.transform[2, :3] @ forward, scene.transform[2, 3]
    offset -= ratio * offset_z
    near, far = offset / (-1 - ratio), offset / (1 - ratio)
    vertices = np.ascontiguousarray(scene.vertices, np.float32)
    triangles = np.ascontiguousarray(scene.triangles, np.int32)
    settings = cv2.TriangleRasterizeSettings()
    settings.setCullingMode(cv2.RASTERIZE_CULLING_CW if scene.cull == "back" else cv2.RASTERIZE_CULLING_NONE)
    depth = np.zeros((height, width), np.float32)
    view = pose.astype(np.float32)
    fov_y = 2 * float(np.arctan(1 / scale_y))

    def draw() -> None:
        depth.fill(far)
        cv2.triangleRasterizeDepth(vertices, triangles, depth, view, fov_y, float(near), float(far), settings)

    def picture() -> dict[str, np.ndarray]:
        with np.errstate(divide="ignore"):
            window = ((ratio + offset / depth) + 1) / 2
        return {"depth": np.where(depth < far, window, np.inf).astype(np.float32)}

    return Drawing(draw, picture, "depth")
