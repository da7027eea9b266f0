"""Anti-Grain Geometry as matplotlib has it: one compound path of all triangles.

Without antialiasing it draws every pixel that a triangle touches, which is another question.
"""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE = DISTRIBUTION = "matplotlib"
TASKS = ("smooth",)


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """The renderer counts y from below."""
    from matplotlib.backends.backend_agg import RendererAgg
    from matplotlib.path import Path
    from matplotlib.transforms import IdentityTransform

    width, height = scene.size
    corners = scene.vertices[:, :2][scene.triangles] * [1, -1] + [0, height]
    points = np.concatenate([corners, corners[:, :1]], axis=1).reshape(-1, 2)
    codes = np.tile(np.array([Path.MOVETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], Path.code_type), len(corners))
    path = Path(points, codes)
    renderer = RendererAgg(width, height, 72)
    how = renderer.new_gc()
    how.set_linewidth(0)
    how.set_snap(False)
    place = IdentityTransform()

    def draw() -> None:
        renderer.clear()
        renderer.draw_path(how, path, place, (1, 1, 1, 1))

    def picture() -> dict[str, np.ndarray]:
        return {"smooth": np.asarray(renderer.buffer_rgba())[..., 3]}

    return Drawing(draw, picture, "RGBA, one path", "path")
