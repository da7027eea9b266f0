"""Poses: where a camera stands, as 4x4 matrices, and what it takes to have a subject in the frame.

Spaces: world; eye (OpenGL: x right, y up, the view along -z).
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from topleft._camera.projections import F64, as_vector
from topleft._model.adapt import MeshLike, as_mesh, is_mesh_like

THREE_QUARTER_DEG = (35.0, 20.0)
"""Azimuth and elevation of the three-quarter view: front, right side and top all show."""

FRAMING_MARGIN = 1.05
"""What fits fills 1 / 1.05 of the frame, so that no outline touches its border."""


POINTS_AT_ONCE = 1 << 14
"""Points whose distances are computed together: they stay in the second-level cache."""


def points_to_frame(subject: MeshLike | npt.ArrayLike) -> F64:
    """The points (N, 3) float64 of a subject that count: vertices that triangles use, each once, or all points.

    Raises
    ------
    ValueError
        If there is no point, or one is not finite.
    """
    return np.asarray(_own_points(subject), dtype=np.float64)


def _own_points(subject: MeshLike | npt.ArrayLike) -> npt.NDArray[np.floating[Any]]:
    """The same in the precision that they have."""
    points: npt.NDArray[np.floating[Any]]
    if is_mesh_like(subject):
        mesh = as_mesh(subject)
        is_used = np.zeros(len(mesh.vertices), dtype=bool)
        is_used[mesh.triangles.ravel()] = True
        points = mesh.vertices if is_used.all() else mesh.vertices[is_used]
    else:
        points = np.asarray(subject, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points to frame must have shape (N, 3), got {points.shape}")
    if not len(points):
        raise ValueError("there is nothing to frame: the mesh has no triangles")
    if not np.isfinite(points).all():
        raise ValueError("points to frame must be finite")
    return points


def bounding_sphere(subject: MeshLike | npt.ArrayLike) -> tuple[F64, float]:
    """Centre (3,) of the box round the subject, and the distance of its farthest point (1 if they are all one).

    Raises
    ------
    ValueError
        If there is no point, or one is not finite.
    """
    points = _own_points(subject)
    # column by column: NumPy takes twenty times as long along rows of three
    low, high = (np.array([end(points[:, axis]) for axis in range(3)], np.float64) for end in (np.min, np.max))
    center = low / 2 + high / 2
    farthest = 0.0
    for first in range(0, len(points), POINTS_AT_ONCE):
        own = points[first : first + POINTS_AT_ONCE].astype(np.float64)
        x, y, z = ((own[:, axis] - center[axis]) ** 2 for axis in range(3))
        farthest = max(farthest, float((x + y + z).max()))
    radius = math.sqrt(farthest)
    return center, radius if radius > 0 else 1.0


def box_corners(subject: MeshLike | npt.ArrayLike) -> F64:
    """The corners (8, 3) float64 of the box round the subject; raises as `bounding_sphere` does."""
    points = points_to_frame(subject)
    low, high = points.min(axis=0), points.max(axis=0)
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def distance_to_fit(points: F64, tan_x: float, tan_y: float) -> float:
    """How far in front of the origin a camera has to stand to have all points just inside its frame.

    Parameters
    ----------
    points : (N, 3) float64
        In eye axes, relative to the point that the camera looks at.
    tan_x, tan_y : float
        Tangents of half the fields of view.
    """
    x, y, z = points.T
    needed = z + FRAMING_MARGIN * np.maximum(np.abs(x) / tan_x, np.abs(y) / tan_y)
    farthest = np.sqrt((points**2).sum(axis=1).max())
    return float(max(needed.max(), 1e-2 * farthest)) or 1.0


def view_matrix(eye: npt.ArrayLike, target: npt.ArrayLike, up: npt.ArrayLike = (0.0, 1.0, 0.0)) -> F64:
    """Eye from world (4, 4) float64, for a camera at `eye` that looks at `target`.

    Raises
    ------
    ValueError
        If eye and target coincide, or if `up` is zero or parallel to the view.
    """
    eye, target, up = as_vector(eye, "eye"), as_vector(target, "target"), as_vector(up, "up")
    forward = target - eye
    distance = np.linalg.norm(forward)
    if distance == 0:
        raise ValueError(f"eye and target must differ, got {eye.tolist()} for both")
    forward = forward / distance
    right = np.cross(forward, up)
    # Below 1e-12 of the length of `up` the direction is made of rounding errors.
    if np.linalg.norm(right) <= 1e-12 * np.linalg.norm(up):
        raise ValueError(f"up must not be zero or parallel to the view, got {up.tolist()}")
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def orbit_view(
    target: npt.ArrayLike,
    distance: float,
    azimuth_deg: float = THREE_QUARTER_DEG[0],
    elevation_deg: float = THREE_QUARTER_DEG[1],
    *,
    up: Literal["y", "z"] = "y",
) -> F64:
    """Eye from world (4, 4) float64, for a camera on a sphere round the target; the angles of `Camera.framing`.

    Raises
    ------
    ValueError
        If the elevation is outside -90 to 90 degrees or `up` is neither "y" nor "z".
    """
    if up not in ("y", "z"):
        raise ValueError(f'up must be "y" or "z", got {up!r}')
    if not np.isfinite(azimuth_deg):
        raise ValueError(f"azimuth_deg must be finite, got {azimuth_deg}")
    if not -90 <= elevation_deg <= 90:
        raise ValueError(f"elevation_deg must lie in -90 to 90, got {elevation_deg}")
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    outward = np.array(
        [np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)]
    )
    axis = np.array([0.0, 1.0, 0.0])
    if abs(elevation_deg) > 89:  # from a pole: the limit of the pictures on the way there
        axis = np.array([-np.sin(azimuth), 0, -np.cos(azimuth)]) * np.sign(elevation)
    if up == "z":
        outward, axis = outward[[0, 2, 1]] * [1, -1, 1], axis[[0, 2, 1]] * [1, -1, 1]
    target = as_vector(target, "target")
    return view_matrix(target + distance * outward, target, axis)
