"""datashader: a triangle mesh with one value per triangle, rasterized by numba code."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import Scene

MODULE = DISTRIBUTION = "datashader"
TASKS = ("labels",)


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """The largest value in a pixel wins: that of the last triangle."""
    import datashader as ds
    import pandas as pd

    width, height = scene.size
    vertices = pd.DataFrame(scene.vertices[:, :2].astype(np.float64), columns=["x", "y"])
    simplices = pd.DataFrame(scene.triangles.astype(np.int64), columns=["v0", "v1", "v2"])
    simplices["label"] = np.arange(len(simplices), dtype=np.float64)
    mesh = ds.utils.mesh(vertices, simplices)
    canvas = ds.Canvas(width, height, x_range=(0, width), y_range=(0, height))
    found: list[np.ndarray] = []

    def draw() -> None:
        found[:] = [canvas.trimesh(vertices, simplices, mesh=mesh, agg=ds.max("label"), interpolate="nearest").data]

    return Drawing(
        draw,
        lambda: {"triangle": np.where(np.isnan(found[0]), -1, found[0]).astype(np.int32)},
        "label",
        "mesh as a table",
    )
