"""Anti-Grain Geometry as matplotlib has it: one compound path of all triangles, or a PolyCollection for colours.

Without antialiasing it draws every pixel that a triangle touches, which is another question.
"""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE = DISTRIBUTION = "matplotlib"
TASKS = ("smooth", "smooth-fill")


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """The renderer counts y from below; there is no figure with axes."""
    from matplotlib.backends.backend_agg import RendererAgg

    width, height = scene.size
    corners = scene.vertices[:, :2][scene.triangles] * [1, -1] + [0, height]
    renderer = RendererAgg(width, height, 72)
    prepare_task = prepare_path if scene.task == "smooth" else prepare_collection
    return prepare_task(renderer, corners, scene.colors)


def prepare_path(renderer, corners: np.ndarray, _: np.ndarray | None) -> Drawing:
    """Coverage, by one path."""
    from matplotlib.path import Path
    from matplotlib.transforms import IdentityTransform

    points = np.concatenate([corners, corners[:, :1]], axis=1).reshape(-1, 2)
    codes = np.tile(np.array([Path.MOVETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], Path.code_type), len(corners))
    path = Path(points, codes)
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


def prepare_collection(renderer, corners: np.ndarray, colors: np.ndarray) -> Drawing:
    """Colours, on black, one triangle after the other."""
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure
    from matplotlib.transforms import IdentityTransform

    collection = PolyCollection(
        corners, facecolors=colors / 255, edgecolors="none", linewidths=0, antialiaseds=True, snap=False,
        transform=IdentityTransform(),
    )  # fmt: skip
    collection.set_clip_on(False)
    collection.set_figure(Figure(dpi=72))
    canvas = np.asarray(renderer.buffer_rgba())
    pixels = canvas.view(np.uint32)[..., 0]
    black = np.array([0, 0, 0, 255], np.uint8).view(np.uint32)[0]

    def draw() -> None:
        pixels.fill(black)
        collection.draw(renderer)

    return Drawing(draw, lambda: {"color": canvas[..., :3]}, "RGBA", "collection")
