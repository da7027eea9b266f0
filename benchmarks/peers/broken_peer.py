"""A contestant that draws nothing, fast: the count of wrong pixels must tell."""

from __future__ import annotations

import numpy as np

from benchmarks.peers import Drawing
from benchmarks.scenes.cases import TASKS as ALL_TASKS
from benchmarks.scenes.cases import Scene

MODULE, DISTRIBUTION = "numpy", "numpy"
TASKS = tuple(ALL_TASKS)


def prepare(scene: Scene, threads: int) -> Drawing:  # noqa: ARG001
    """Nothing, everywhere."""
    width, height = scene.size
    picture = {
        "triangle": np.full((height, width), -1, np.int32),
        "smooth": np.zeros((height, width), np.uint8),
        "color": np.zeros((height, width, 3), np.uint8),
    }
    return Drawing(lambda: None, lambda: picture, "nothing")
