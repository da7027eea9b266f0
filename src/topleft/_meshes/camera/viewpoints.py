"""Viewpoints: many cameras round one subject.

Input: a subject and how many. Output: a list of `Camera`, each made by `Camera.framing`.

Based on: Gonzalez, A., "Measurement of Areas on a Sphere Using Fibonacci and Latitude-Longitude Lattices", Mathematical
Geosciences 42, 2010.
"""

from __future__ import annotations

from typing import TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_count
from topleft._core.base.defaults import THREE_QUARTER_DEG
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.matrices import Framed, as_framed, bounding_sphere, ends_to_frame, up_of
from topleft._meshes.scene.scene import Scene
from topleft.typing import FitOption, UpOption

GOLDEN_ANGLE_DEG = 180 * (3 - 5**0.5)


class FramingOptions(TypedDict, total=False):
    """The options of `Camera.framing` that `turntable` and `viewpoints` pass on."""

    fov_y_deg: float
    up: UpOption
    ortho: bool
    aspect: float
    fit: FitOption


def turntable(
    subject: MeshLike | Scene | npt.ArrayLike,
    n: int,
    *,
    azimuth_deg: float = THREE_QUARTER_DEG[0],
    elevation_deg: float = THREE_QUARTER_DEG[1],
    **framing: Unpack[FramingOptions],
) -> list[Camera]:
    """Cameras that go once round the subject at one height, in equal steps.

    Parameters
    ----------
    subject : mesh, Scene, or (N, 3) array_like
        As for `Camera.framing`.
    n : int
        How many, at least 1.
    azimuth_deg, elevation_deg : float
        Of the first one; the next stands at a larger azimuth. Degrees.
    **framing
        Other options of `Camera.framing`: `up="z"`, `fov_y_deg=`, `aspect=`.

    Returns
    -------
    list of Camera

    Raises
    ------
    ValueError
        If `n` is below 1, or as `Camera.framing` does.
    TypeError
        If `n` is no integer.

    Examples
    --------
    >>> len(turntable([(-1, -1, -1), (1, 1, 1)], 12))
    12
    """
    n = as_count("n", n)
    sphere = _looked_at(subject, framing)
    return [
        Camera.framing(sphere, azimuth_deg=azimuth_deg + 360 * i / n, elevation_deg=elevation_deg, **framing)
        for i in range(n)
    ]


def viewpoints(subject: MeshLike | Scene | npt.ArrayLike, n: int, **framing: Unpack[FramingOptions]) -> list[Camera]:
    """Cameras spread evenly over the sphere round the subject, from the top to the bottom.

    Parameters
    ----------
    subject : mesh, Scene, or (N, 3) array_like
        As for `Camera.framing`.
    n : int
        How many, at least 1.
    **framing
        Other options of `Camera.framing`: `up="z"`, `fov_y_deg=`, `aspect=`.

    Returns
    -------
    list of Camera

    Raises
    ------
    ValueError
        If `n` is below 1, or as `Camera.framing` does.
    TypeError
        If `n` is no integer.

    Notes
    -----
    The lattice of Fibonacci: camera i of n stands at the height 1 - (2 i + 1) / n of the unit sphere, the golden angle
    round from the one before. Each has the same share of the sphere's area to itself.

    Examples
    --------
    >>> eye = [-camera.view[:3, :3].T @ camera.view[:3, 3] for camera in viewpoints([(-1, -1, -1), (1, 1, 1)], 100)]
    >>> bool(np.abs(np.mean(eye, axis=0)).max() < 0.05)
    True
    """
    n = as_count("n", n)
    sphere = _looked_at(subject, framing)
    height = 1 - (2 * np.arange(n) + 1) / n
    return [
        Camera.framing(sphere, azimuth_deg=i * GOLDEN_ANGLE_DEG % 360, elevation_deg=elevation_deg, **framing)
        for i, elevation_deg in enumerate(map(engine.arc_sine, height.tolist()))
    ]


def _looked_at(subject: MeshLike | Scene | npt.ArrayLike, framing: FramingOptions) -> Framed:
    """The subject of all cameras, converted once; for its sphere two points with an equal sphere, and its axis."""
    framed = as_framed(subject)
    framing.setdefault("up", up_of(framed))
    if framing.get("fit", "sphere") != "sphere":
        return framed
    center, radius = bounding_sphere(ends_to_frame(framed))
    return np.stack([center - [radius, 0, 0], center + [radius, 0, 0]])
