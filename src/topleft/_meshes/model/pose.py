"""Poses in the forms that others write them: a matrix, a rotation and a translation, a mapping of BOP's files.

In: a caller's pose. Out: a matrix (4, 4).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F64
from topleft._core.base.arrays import as_real, check_regular, shown

BOP_POSES = (("cam_R_m2c", "cam_t_m2c"), ("cam_R_w2c", "cam_t_w2c"))
"""Rotation, nine numbers row by row, and translation: of a model and of the world, as seen by the camera."""

FORMS = "(4, 4), (3, 4), (R, t), (rvec, tvec) or a mapping with cam_R_m2c and cam_t_m2c"


def as_pose(name: str, pose: Any) -> F64:
    """Return a pose as a matrix (4, 4), always a copy.

    A matrix (4, 4) or (3, 4); a pair of a rotation (3, 3), or the vector (3,) that OpenCV has for it, and a translation
    (3,); or a mapping with `cam_R_m2c` and `cam_t_m2c`, or `cam_R_w2c` and `cam_t_w2c`, as BOP writes them.
    """
    is_matrix = type(pose) is np.ndarray and pose.shape == (4, 4) and pose.dtype == np.float64 and pose.flags.aligned
    if is_matrix and engine.is_pose(pose):
        return pose.copy()
    if isinstance(pose, Mapping):
        keys = next((keys for keys in BOP_POSES if all(key in pose for key in keys)), None)
        if keys is None:
            raise ValueError(f"{name} must be {FORMS}, got a mapping with {', '.join(map(str, pose)) or 'nothing'}")
        rotation, translation = (as_real(f"{key} of {name}", pose[key]).ravel() for key in keys)
        if (rotation.size, translation.size) != (9, 3):
            sizes = f"{rotation.size} and {translation.size}"
            raise ValueError(f"{keys[0]} and {keys[1]} of {name} must have 9 and 3 numbers, got {sizes}")
        matrix = joined_pose(rotation.reshape(3, 3), translation)
    elif isinstance(pose, tuple | list) and len(pose) == 2:
        turn, shift = (as_real(name, part) for part in pose)
        if shift.size != 3 or not (turn.size == 3 or turn.shape == (3, 3)):
            raise ValueError(f"{name} must be {FORMS}, got a pair of shapes {turn.shape} and {shift.shape}")
        matrix = joined_pose(rotation_of_vector(turn.ravel()) if turn.size == 3 else turn, shift.ravel())
    else:
        matrix = as_real(name, pose)
        if matrix.shape not in ((4, 4), (3, 4)):
            raise ValueError(f"{name} must be {FORMS}, got shape {matrix.shape}")
        matrix = joined_pose(matrix[:3, :3], matrix[:3, 3]) if matrix.shape == (3, 4) else matrix.copy()
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} must hold finite numbers, got {shown(pose)}")
    if not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise ValueError(f"the last row of {name} must be [0, 0, 0, 1], got {matrix[3].tolist()}")
    check_regular(name, matrix)
    return matrix


def joined_pose(rotation: F64, translation: F64) -> F64:
    """The matrix (4, 4) of a rotation (3, 3) and a translation (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, translation
    return matrix


def rotation_of_vector(vector: F64) -> F64:
    """The rotation (3, 3) about a vector (3,) by as many radians as it is long: Rodrigues' formula."""
    angle = engine.length(vector)
    if not 0 < angle < math.inf:
        return np.eye(3) if angle == 0 else np.full((3, 3), np.nan)
    x, y, z = vector / angle
    cosine, sine = engine.cosine_and_sine(math.degrees(angle))
    axis = np.array([x, y, z])
    return (
        cosine * np.eye(3) + (1 - cosine) * axis[:, None] * axis + sine * np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    )


def rotation_of_quaternion(w: float, x: float, y: float, z: float) -> F64:
    """The rotation (3, 3) of a quaternion of any length but 0."""
    w, x, y, z = (np.array([w, x, y, z]) / (engine.length(np.array([w, x, y, z])) or math.nan)).tolist()
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
