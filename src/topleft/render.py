"""Rendering: a mesh and a camera to a picture, in one call.

Input: `Mesh`, `Camera`. Output: the picture (H, W, 4) uint8 of `render`, or the visibility buffer of `visibility`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.api import rasterize
from topleft.camera import Camera
from topleft.fragments import Fragments
from topleft.mesh import Mesh
from topleft.shade import DEFAULT_COLOR, shade

DEFAULT_SIZE = (640, 480)
WHITE = (255, 255, 255, 255)


def render(
    mesh: Mesh,
    camera: Camera | None = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    shading: str = "smooth",
    color: tuple[int, ...] = DEFAULT_COLOR,
    background: tuple[int, ...] = WHITE,
    cull: str = "none",
    threads: int | None = None,
) -> npt.NDArray[np.uint8]:
    """A picture of the mesh.

    Parameters
    ----------
    mesh : Mesh
        What to draw. Its colours are used if it has any.
    camera : Camera, optional
        Unless given, the three-quarter view of `Camera.framing`, with y up.
    size : (width, height), pixels
        640 x 480 unless given.
    shading : {"smooth", "flat", "ids", "depth", "normals"}
        What the colours tell; `topleft.shade.shade` describes each.
    color : (3,) of 0 to 255
        sRGB colour of a mesh without colours.
    background : (3,) or (4,) of 0 to 255
        sRGB, and alpha if it is not opaque; white unless given, `(0, 0, 0, 0)` is transparent.
    cull : {"none", "back", "front"}
        Triangles to leave out, by the side that is seen.
    threads : int, optional
        How many threads draw; never changes a bit.

    Returns
    -------
    (H, W, 4) uint8
        sRGB with alpha: 255 where the mesh is, the background elsewhere.

    Raises
    ------
    ValueError
        If the mesh has no triangles and no camera is given, or an option is unknown.

    Examples
    --------
    >>> import topleft as tl
    >>> mesh = tl.Mesh(*tl.scenes.shape("cube"))
    >>> tl.render(mesh, size=(64, 48), background=(0, 0, 0, 0))[24, 32].tolist()[3]
    255
    """
    camera = default_camera(mesh, size) if camera is None else camera
    frags = visibility(mesh, camera, size, cull=cull, threads=threads)
    return shade(frags, mesh, camera, shading=shading, color=color, background=background)


def visibility(
    mesh: Mesh,
    camera: Camera | None = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    cull: str = "none",
    threads: int | None = None,
    **view: Any,
) -> Fragments:
    """The visibility buffer of the mesh: ids and depth per pixel, and attributes interpolated on demand.

    Parameters
    ----------
    mesh, camera, size, cull, threads
        As for `render`.
    **view
        Other options of `rasterize`, `origin=` for a window of a larger picture, say.

    Returns
    -------
    Fragments
        `.triangle` (H, W) int32, -1 where there is nothing; `.depth` (H, W) float32, window depth in [0, 1], +inf where
        there is nothing.

    Raises
    ------
    ValueError
        If the mesh has no triangles and no camera is given, or an option is unknown.
    """
    camera = default_camera(mesh, size) if camera is None else camera
    transform = camera.clip_from_world(view.get("viewport") or size)
    return rasterize(mesh.vertices, mesh.triangles, size, transform=transform, cull=cull, threads=threads, **view)


def default_camera(mesh: Mesh, size: tuple[int, int]) -> Camera:
    """The three-quarter view of the mesh with y up, for a picture of this size."""
    width, height = size
    return Camera.framing(mesh, aspect=width / height if width > 0 and height > 0 else 1.0)
