"""matplotlib: a PolyCollection on its Agg renderer, without figure and axes."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Scene
from benchmarks.peers import Drawing

MODULE = DISTRIBUTION = "matplotlib"
TASKS = ("smooth-fill",)


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """The collection is made before; y points up there."""
    from matplotlib.backends.backend_agg import RendererAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure
    from matplotlib.transforms import IdentityTransform

    width, height = scene.size
    corners = scene.vertices[:, :2] * (1, -1) + (0, height)
    collection = PolyCollection(
        corners[scene.triangles], facecolors=scene.colors / 255, edgecolors="none", linewidths=0, antialiaseds=True,
        snap=False, transform=IdentityTransform(),
    )  # fmt: skip
    collection.set_clip_on(False)
    collection.set_figure(Figure(dpi=72))
    renderer = RendererAgg(width, height, 72)
    canvas = np.asarray(renderer.buffer_rgba())
    pixels = canvas.view(np.uint32)[..., 0]
    black = np.array([0, 0, 0, 255], np.uint8).view(np.uint32)[0]

    def draw() -> None:
        pixels.fill(black)
        collection.draw(renderer)

    return Drawing(draw, lambda: {"color": canvas[..., :3]}, "RGBA", "collection")
