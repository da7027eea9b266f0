"""Frames: how a camera sees the space that light is computed in: rays of pixels, and the turn to eye space.

Input: `Camera`, the size of the whole picture. Output: `Frame`, numbers for the kernels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topleft._camera.camera import Camera

F64 = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Frame:
    """What `tl_shading` in csrc/shading.h tells of the camera, in a shading space whose origin is at `center`.

    Attributes
    ----------
    eye : (3,) float64
        Where the camera is; without perspective the unit vector to it.
    ray : (4, 3) float64
        The ray of pixel position (0, 0), what it gains per column and per row, and, without perspective, along the
        depth.
    eye_from, origin : (3, 3) and (3,) float64
        Eye space from shading space: `eye_from @ p + origin` but for a scale.
    scale : float
        How many units of eye space one of the shading space is.
    distance_start, distance_scale : float
        The distance along the view: `start + scale * w`, or `start + scale * depth` without perspective.
    """

    has_perspective: bool
    eye: F64
    ray: F64
    eye_from: F64
    origin: F64
    scale: float
    distance_start: float
    distance_scale: float


def is_similarity(view: F64) -> bool:
    """Whether a matrix (4, 4) keeps angles and does not mirror, so that light may be computed before it."""
    rows = view[:3, :3].tolist()
    (a, b, c), (d, e, f), (g, h, i) = rows
    squares = a * a + b * b + c * c, d * d + e * e + f * f, g * g + h * h + i * i
    products = a * d + b * e + c * f, a * g + b * h + c * i, d * g + e * h + f * i
    scale = sum(squares) / 3
    error = max(map(abs, (*products, *(square - scale for square in squares))))
    return determinant(rows) > 0 and error <= 1e-9 * scale


def frame_of(camera: Camera, size: tuple[int, int], center: F64, *, in_eye_space: bool) -> Frame:
    """How the camera sees shading space: the world, or its own eye space, moved so that `center` is the origin."""
    view = np.eye(4) if in_eye_space else camera.view
    clip = camera.clip_from_eye(size) @ view
    width, height = size
    has_perspective = bool(clip[3, :3].any())
    rows = clip[[0, 1, 3 if has_perspective else 2]]
    world_from_rows = np.linalg.inv(rows[:, :3])
    offset = world_from_rows @ rows[:, 3]
    # the corner, one column, one row and the whole depth, of clip space
    ends = [[-1, 1, 1 if has_perspective else -1], [2 / width, 0, 0], [0, -2 / height, 0], [0, 0, 2]]
    ray = np.array(ends) @ world_from_rows.T
    if has_perspective:
        eye = -offset - center
        start, scale = 0.0, 1.0 / -float(camera.projection[3, 2])
    else:
        ray[0] -= offset + center
        eye = -ray[3] / np.linalg.norm(ray[3])
        (a, b), (c, d) = camera.projection[2:, 2:]
        near, far = ((ndc * d - b) / (ndc * c - a) for ndc in (-1.0, 1.0))
        start, scale = near, far - near
    size_of_unit = math.cbrt(determinant(view[:3, :3].tolist()))
    linear = view[:3, :3]
    origin = linear @ center + view[:3, 3]
    return Frame(has_perspective, eye, ray, linear / size_of_unit, origin, size_of_unit, start, scale)


def determinant(rows: list[list[float]]) -> float:
    """Of a matrix (3, 3): NumPy's takes ten times as long for one."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def turn_of_normals(view: F64) -> F64:
    """The matrix (3, 3) that takes rows of normals to eye space, but for their lengths: the inverse of that of points.

    Its numbers are sums of products, the same on every machine.
    """
    rows = view[:3, :3].tolist()
    (a, b, c), (d, e, f), (g, h, i) = rows
    adjugate = [
        [e * i - f * h, c * h - b * i, b * f - c * e],
        [f * g - d * i, a * i - c * g, c * d - a * f],
        [d * h - e * g, b * g - a * h, a * e - b * d],
    ]
    return np.array(adjugate) * math.copysign(1.0, determinant(rows))
