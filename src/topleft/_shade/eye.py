"""Eye space: distances of the visible pixels as the camera has them.

Input: `Fragments` and the camera they were made with.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topleft._camera.camera import Camera
from topleft._raster.fragments import Fragments

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


def eye_distance(depth: F32, camera: Camera) -> F64:
    """Distance along the view, world units, of window depths in [0, 1]: `-z` in eye space."""
    (a, b), (c, d) = camera.projection[2:, 2:]
    ndc = 2.0 * depth.astype(np.float64) - 1
    return (ndc * d - b) / (ndc * c - a)


def distances(frags: Fragments, camera: Camera) -> tuple[float, float] | None:
    """The least and the greatest distance along the view of what any sample shows; None where there is nothing."""
    depth = frags.samples_depth[frags.samples_triangle >= 0]
    if not depth.size:
        return None
    ends = eye_distance(np.array([depth.min(), depth.max()]), camera)
    return float(ends[0]), float(ends[1])
