"""Projections: clip space from eye space, as 4x4 matrices, and the checks of numbers that cameras share.

Eye axes are those of OpenGL: x right, y up, the view along -z. Clip space: -w <= x, y, z <= w inside.

Based on: Segal, M., and K. Akeley, "The OpenGL Graphics System", 1992 (the matrices of glFrustum and glOrtho).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def perspective_matrix(fov_y_deg: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a square picture; see `Camera.perspective`."""
    check_fov(fov_y_deg)
    check_planes(near, far)
    scale = 1 / np.tan(np.radians(fov_y_deg) / 2)
    matrix = np.diag([scale, scale, (far + near) / (near - far), 0])
    matrix[2, 3] = 2 * far * near / (near - far)
    matrix[3, 2] = -1
    return matrix


def orthographic_matrix(height: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a square picture; see `Camera.orthographic`."""
    check_positive("height", height)
    if not (np.isfinite([near, far]).all() and near < far):
        raise ValueError(f"near and far must be finite and near < far, got {near} and {far}")
    matrix = np.diag([2 / height, 2 / height, 2 / (near - far), 1])
    matrix[2, 3] = (far + near) / (near - far)
    return matrix


def frustum_matrix(left: float, right: float, bottom: float, top: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a window of the plane at `near`; see `Camera.frustum`."""
    check_window(left, right, bottom, top)
    check_planes(near, far)
    matrix = perspective_matrix(90, near, far)
    matrix[0, 0], matrix[0, 2] = 2 * near / (right - left), (right + left) / (right - left)
    matrix[1, 1], matrix[1, 2] = 2 * near / (top - bottom), (top + bottom) / (top - bottom)
    return matrix


def box_matrix(left: float, right: float, bottom: float, top: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a box without perspective; see `Camera.box`."""
    check_window(left, right, bottom, top)
    matrix = orthographic_matrix(1, near, far)
    matrix[0, 0], matrix[0, 3] = 2 / (right - left), -(right + left) / (right - left)
    matrix[1, 1], matrix[1, 3] = 2 / (top - bottom), -(top + bottom) / (top - bottom)
    return matrix


def as_vector(values: npt.ArrayLike, name: str) -> F64:
    """Three finite numbers as float64."""
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ValueError(f"{name} must be three finite numbers, got {values!r}")
    return vector


def as_square(values: npt.ArrayLike, n: int, name: str) -> F64:
    """A finite matrix (n, n) as float64, always a copy."""
    matrix = np.array(values, dtype=np.float64)
    if matrix.shape != (n, n):
        raise ValueError(f"{name} must have shape ({n}, {n}), got {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} must hold finite numbers, got {matrix.tolist()}")
    return matrix


def check_regular(matrix: F64, name: str) -> None:
    """Raise a `ValueError` if the matrix is singular."""
    if np.linalg.matrix_rank(matrix) < len(matrix):
        raise ValueError(f"{name} must not be singular, got {matrix.tolist()}")


def check_positive(name: str, value: float) -> None:
    """Raise a `ValueError` unless the number is finite and above 0."""
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{name} must be positive, got {value}")


def check_fov(fov_y_deg: float) -> None:
    """Raise a `ValueError` unless the field of view is one."""
    if not 0 < fov_y_deg < 180:
        raise ValueError(f"fov_y_deg must lie between 0 and 180, got {fov_y_deg}")


def check_planes(near: float, far: float) -> None:
    """Raise a `ValueError` unless 0 < near < far, finite."""
    if not (np.isfinite(near) and np.isfinite(far) and 0 < near < far):
        raise ValueError(f"near and far must be finite and 0 < near < far, got {near} and {far}")


def check_window(left: float, right: float, bottom: float, top: float) -> None:
    """Raise a `ValueError` unless the four sides are finite and in order."""
    if not (np.isfinite([left, right, bottom, top]).all() and left < right and bottom < top):
        raise ValueError(
            f"left < right and bottom < top must be finite, got {left} and {right}, {bottom} and {top}"
        )
