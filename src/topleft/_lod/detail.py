"""Detail: the coarsest level of a mesh that a view cannot tell from it, within a tolerance in pixels.

In: a mesh or scene, a camera, a size, a tolerance. Out: `Detail`: the level, its bound in pixels, and why no other.

Let p be a point of one surface that shows in the picture, at clip = (x, y, z, w), q one of the other, and d = q - p.
With u = x / w, rows l of the linear part of the matrix and a viewport W wide, exactly

    px(q) - px(p) = W/2 (l_x - u l_w) . d / w(q),      and so for y with v and H.

So no p moves by more than bound * s / w_min: s the largest singular value of the matrix of both rows, which is convex
in (u, v) and so largest in a corner of what the mesh can show in, w_min the least w on both surfaces. Stretched
pixels, shear, the edge of the frame and instances that are scaled are in the matrix.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._base.arrays import as_number, as_size, shown
from topleft._camera.camera import Camera, CameraLike, as_camera
from topleft._lod.levels import Level
from topleft._lod.simplify import levels_of
from topleft._model.material import Material
from topleft._model.mesh import Mesh, has_holes
from topleft._scene.adapt import MeshLike, as_mesh
from topleft._scene.scene import Scene
from topleft.typing import CullOption

__all__ = ["Detail", "check_tolerance", "choose_detail", "detailed", "pixels_of_bound"]

F64 = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Detail:
    """Which level of a mesh a view needs. Made by `choose_detail`.

    Attributes
    ----------
    level : int
        0: the mesh itself.
    mesh : Mesh
        What is drawn: the `.triangle` of its visibility buffer are rows of its triangles.
    bound : float
        How far its surface may lie from the mesh, object units.
    bound_px : float
        How far a point that shows may lie from where it belongs, pixels.
    tolerance : float
        What was asked for, pixels.
    n_triangles : int
        Triangles of the mesh itself.
    why : str
    rejected : tuple of str

    Examples
    --------
    >>> import topleft as tl
    >>> ball = tl.Mesh(*tl.scenes.icosphere(3))
    >>> detail = tl.choose_detail(ball, tl.Camera.framing(ball), (64, 64), tolerance=0.0)
    >>> detail.level, detail.mesh is ball
    (0, True)
    """

    level: int
    mesh: Mesh
    bound: float
    bound_px: float
    tolerance: float
    n_triangles: int
    why: str
    rejected: tuple[str, ...] = ()


def choose_detail(
    mesh: MeshLike,
    camera: CameraLike,
    size: int | tuple[int, int],
    *,
    tolerance: float,
    cull: CullOption = "none",
    material: Material | None = None,
    transform: npt.ArrayLike | None = None,
    viewport: tuple[int, int] | None = None,
    origin: tuple[int, int] = (0, 0),
) -> Detail:
    """The coarsest level of a mesh whose points lie within a tolerance of where they belong in a picture.

    Parameters
    ----------
    mesh : Mesh, or whatever `as_mesh` takes
        Its levels are made when they are needed first, and kept with it; see `simplify`.
    camera : Camera
    size : (width, height), pixels
    tolerance : float
        Pixels, at least 0. 0: always the mesh itself.
    cull, material, viewport, origin
        As for `render` and `rasterize`.
    transform : (4, 4) array_like, optional
        World from object, of an instance.

    Returns
    -------
    Detail

    Raises
    ------
    ValueError
        If the tolerance is negative or not finite.
    MissingPackageError
        If levels are to be made and fast-simplification is not installed.

    Notes
    -----
    Each point of the mesh that shows lies within `bound_px` of a point of the level in the picture, and the other way
    round; the snap to sub-pixels moves either by 1/512 pixel at most along each axis. The order in which surfaces hide
    each other, and their light, may differ by more.

    It is the mesh itself where no bound holds: with a lens; where the mesh may reach the near or the far plane or the
    eye; where a side is culled, since turns of triangles are not bounded; where materials cut holes.

    Examples
    --------
    >>> import topleft as tl
    >>> cube = tl.Mesh(*tl.scenes.shape("cube"))
    >>> tl.choose_detail(cube, tl.Camera.framing(cube), (64, 48), tolerance=0).level
    0
    """
    mesh, camera, size = as_mesh(mesh), as_camera(camera), as_size(size)
    viewport = None if viewport is None else as_size(viewport, "viewport", smallest=1)
    tolerance = check_tolerance(tolerance)
    return detail_of(
        mesh, camera, size, tolerance, cull=cull, material=material, viewport=viewport, origin=origin,
        transform=transform,
    )  # fmt: skip


def detail_of(
    mesh: Mesh,
    camera: Camera,
    size: tuple[int, int],
    tolerance: float,
    *,
    cull: str = "none",
    material: Material | None = None,
    viewport: tuple[int, int] | None = None,
    origin: tuple[int, int] = (0, 0),
    transform: npt.ArrayLike | None = None,
) -> Detail:
    """The level that a view needs, of checked arguments."""
    n = len(mesh.triangles)

    def whole(why: str, rejected: tuple[str, ...] = ()) -> Detail:
        return Detail(0, mesh, 0.0, 0.0, tolerance, n, why, rejected)

    if reason := why_whole(mesh, camera, tolerance, cull, material):
        return whole(reason)
    matrix = camera.clip_from_world(viewport or size)
    if transform is not None:
        matrix = matrix @ np.asarray(transform, np.float64)
    window = window_of(size, viewport, origin)
    rejected: list[str] = []
    original, *coarser = levels_of(mesh)
    for i, level in reversed(list(enumerate(coarser, 1))):
        bound_px = pixels_of_bound(matrix, viewport or size, window, original, level)
        count = len(level.mesh.triangles)
        if bound_px is None:
            rejected.append(f"level {i}, {count:,} triangles: may reach the near or the far plane, or the eye")
        elif bound_px <= tolerance:
            why = f"no point that shows is off by more than {bound_px:.3g} px, and {tolerance:g} px are allowed"
            rejected.append(f"the mesh itself, {n:,} triangles: finer than the picture has to be")
            return Detail(i, level.mesh, level.bound, bound_px, tolerance, n, why, tuple(rejected[-2:]))
        else:
            rejected.append(f"level {i}, {count:,} triangles: may be off by {bound_px:.3g} px")
    why = f"no coarser level is sure to be within {tolerance:g} px" if coarser else "it has no coarser level"
    return whole(why, tuple(rejected[-1:]))


def check_tolerance(tolerance: float) -> float:
    """The tolerance, if it is one."""
    if not 0 <= as_number("tolerance", tolerance) < math.inf:
        raise ValueError(f"tolerance must be at least 0 pixels, got {tolerance!r}")
    return float(tolerance)


def why_whole(mesh: Mesh, camera: Camera, tolerance: float, cull: str, material: Material | None) -> str | None:
    """Why nothing but the mesh itself will do, as far as that is known without its levels."""
    if tolerance == 0:
        return "tolerance=0: the picture of the mesh itself, to the bit"
    if not len(mesh.triangles):
        return "it has no triangles"
    if camera.lens is not None:
        return "a lens bends the picture by what no bound is known of"
    if str(cull) != "none":
        return f"cull={str(cull)!r}: which way a triangle is turned has no bound"
    if any(has_holes(one, mesh) for one in (mesh.materials if material is None else (material,))):
        return "a material cuts holes, and they have no bound"
    return None


def window_of(size: tuple[int, int], viewport: tuple[int, int] | None, origin: tuple[int, int]) -> F64:
    """Where in normalised device coordinates pixels are looked at, (2, 2): lower and upper x, and y.

    All of the viewport, so that a window of a picture has the level of the whole; more where the window has more.
    """
    whole = viewport or size
    ends = np.empty((2, 2))
    for axis in range(2):
        low, high = min(0, origin[axis]), max(whole[axis], origin[axis] + size[axis])
        ends[axis] = 2 * (low - 1) / max(whole[axis], 1) - 1, 2 * (high + 1) / max(whole[axis], 1) - 1
    ends[1] = -ends[1, ::-1]
    return ends


def pixels_of_bound(matrix: F64, viewport: tuple[int, int], window: F64, original: Level, level: Level) -> float | None:
    """How far a point that shows may be off, pixels; None where nothing is known of that.

    Parameters
    ----------
    matrix : (4, 4) float64
        Clip from object.
    viewport : (width, height), pixels
    window : (2, 2) float64
        What `window_of` gives.
    original, level : Level
    """
    lows, highs = zip(original.extent[0], level.extent[0], strict=True)
    ends = np.array([np.min(lows, axis=0), np.max(highs, axis=0)])
    corners = np.array([[ends[k, axis] for axis, k in enumerate(pick)] for pick in product((0, 1), repeat=3)])
    clip = corners @ matrix[:, :3].T + matrix[:, 3]
    nearest = least(matrix[3], clip[:, 3], original, level)
    beyond = [least(matrix[3] + sign * matrix[2], clip[:, 3] + sign * clip[:, 2], original, level) for sign in (1, -1)]
    if not nearest > 0 or not min(beyond) >= 0:
        return None
    in_x, in_y = window
    if clip[:, 3].min() > 0:  # then the box shows nowhere but between its corners
        places = clip[:, :2] / clip[:, 3:]
        in_x, in_y = (
            np.array([max(end[0], column.min()), min(end[1], column.max())])
            for end, column in zip(window, places.T, strict=True)
        )
        if in_x[0] > in_x[1] or in_y[0] > in_y[1]:
            return 0.0
    half = np.array(viewport, np.float64)[:, None] / 2
    stretch = max(
        np.linalg.norm(half * (matrix[:2, :3] - np.array([[u], [v]]) * matrix[3, :3]), 2)
        for u, v in product(in_x, in_y)
    )
    # A billionth more for what float64 rounds here.
    return float(level.bound * stretch / nearest * (1 + 1e-9))


def least(row: F64, at_corners: F64, original: Level, level: Level) -> float:
    """A bound from below on an affine function on both surfaces: by their boxes, or by their spheres."""
    by_sphere = min(
        float(row[:3] @ center + row[3] - np.linalg.norm(row[:3]) * radius)
        for _, center, radius in (original.extent, level.extent)
    )
    return max(float(at_corners.min()), by_sphere)


def detailed(
    mesh: Mesh | Scene, camera: Camera, size: tuple[int, int], tolerance: float, **options: Any
) -> Mesh | Scene:
    """The mesh or scene as it is drawn within a tolerance; options as for `choose_detail`."""
    if not isinstance(options.get("material"), Material | None):
        raise TypeError(f"material must be a Material, got {shown(options['material'])}")
    if check_tolerance(tolerance) == 0:
        return mesh
    if isinstance(mesh, Mesh):
        return detail_of(mesh, camera, size, tolerance, **options).mesh
    own = [detail_of(one.mesh, camera, size, tolerance, transform=one.transform, **options).mesh for one in mesh]
    return Scene([replace(one, mesh=level) for one, level in zip(mesh, own, strict=True)])
