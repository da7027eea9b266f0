"""Cuts polygons with any number of corners into triangles that cover the same points.

Input: points, flat or in space, and faces as corners one after the other. Output: triangles, in the order of the faces.
Polygons in space are seen along their area vector. Convex ones become fans; of the others ears are cut off
(csrc/mesh/ears.c).
"""

from __future__ import annotations

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F64, I64, Array
from topleft._core.base.arrays import INT32_MAX

MAX_STEPS = 1 << 30
"""Steps for all polygons of a call: some seconds. One of 100,000 corners takes up to 200,000,000."""


def triangulate(points: Array, corners: Array, n_corners: Array) -> tuple[I64, I64]:
    """Triangles (T, 3) int64 of polygons, with their winding, as rows of `corners`; and the polygon (T,) int64 of each.

    `points`: (V, 2) or (V, 3). `corners`: (C,) rows of points, those of one polygon after the other. `n_corners`: (F,)
    how many each has; those with fewer than three have no triangles.
    """
    n_corners = n_corners.astype(np.int64)
    if (n_corners == 3).all():
        return np.arange(3 * len(n_corners)).reshape(-1, 3), np.arange(len(n_corners))
    faces = np.repeat(np.arange(len(n_corners)), np.maximum(n_corners - 2, 0))
    corners = np.array(corners, np.int64)  # a copy, which nobody changes after the check
    if len(corners) and not (0 <= corners.min() and corners.max() < len(points)):
        bad = int(((corners < 0) | (corners >= len(points))).argmax())
        raise IndexError(f"corner {bad} = {corners[bad]} must be one of {len(points)} points")
    if n_corners.min() < 0 or n_corners.sum() > len(corners) or n_corners.max() > INT32_MAX:
        raise ValueError(f"polygons must have {len(corners)} corners together, got {n_corners.sum()}")
    triangles = np.empty((len(faces), 3), np.int64)
    if len(faces):
        in_space, most = _in_space(points), int(n_corners.max())
        n_cut = engine.cut_faces(in_space, corners, n_corners, most, MAX_STEPS, triangles)
        if n_cut < len(n_corners):
            raise ValueError(
                f"polygons must be cut into triangles within {MAX_STEPS:,} comparisons, polygon {n_cut} of "
                f"{n_corners[n_cut]:,} corners takes more"
            )
    return triangles, faces


def _in_space(points: Array) -> F64:
    if points.shape[-1] == 2:
        points = np.concatenate([points, np.zeros((len(points), 1))], axis=1)
    return np.ascontiguousarray(points, np.float64)
