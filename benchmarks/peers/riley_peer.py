"""riley-raster: a mono image, float64, of a field on the nodes, which here is the distance along the view.

It always culls back faces. Its camera is made of words, so the mesh is turned into eye space before; its own transform
runs all the same.
"""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.peers.views import draw_by_riley, set_up_riley
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "riley", "riley-raster"
TASKS = ("visibility", "views", "views-png")
THREADS = True


def prepare(scene: Scene, threads: int) -> Drawing:
    """Read focal length and pixel size off the matrix of the scene."""
    if scene.views is not None:
        return draw_by_riley(scene, threads)
    import riley

    if scene.cull != "back":
        raise ValueError("riley always culls back faces")
    matrix, (width, height) = scene.transform, scene.size
    scale_x, scale_y = np.linalg.norm(matrix[0, :3]), np.linalg.norm(matrix[1, :3])
    if not np.isclose(scale_x * width, scale_y * height):
        raise ValueError("the camera has pixels that are not square")
    eye = np.stack([matrix[0] / scale_x, matrix[1] / scale_y, -matrix[3]])
    vertices = scene.vertices @ eye[:, :3].T + eye[:, 3]
    ratio, offset = np.linalg.lstsq(np.stack([matrix[3], [0, 0, 0, 1]], axis=1), matrix[2], rcond=None)[0]
    convention, camera, config = set_up_riley(scene.size, scale_y, threads)
    shader = riley.NodalShader(np.ascontiguousarray(-vertices[:, 2:]), scaling_type=riley.ScaleStrategy.none)
    mesh = riley.create_mesh(
        convention, riley.MeshType.tri3opt, vertices.astype(np.float64), scene.triangles.astype(np.int64), shader
    )
    found: list[np.ndarray] = []

    def draw() -> None:
        found[:] = [riley.raster(mesh, camera, config)]

    def picture() -> dict[str, np.ndarray]:
        distance = found[0].reshape(height, width)
        with np.errstate(divide="ignore"):
            window = (ratio + offset / distance + 1) / 2
        return {"depth": np.where(distance > 0, window, np.inf).astype(np.float32)}

    return Drawing(draw, picture, "distance", "turned into eye space")
