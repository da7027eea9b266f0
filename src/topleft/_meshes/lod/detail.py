"""Detail: the coarsest level of a mesh whose picture differs by at most a tolerance in pixels.

In: a mesh or scene, a camera, a size, a tolerance. Out: `Detail`: the level, its bound in pixels, and why no other.

Let p be a visible point of one surface, at clip = (x, y, z, w), q a point of the other surface, and d = q - p.
With u = x / w, rows l of the linear part of the matrix and a viewport W wide, exactly

    px(q) - px(p) = W/2 (l_x - u l_w) . d / w(q),      and so for y with v and H.

So no p moves by more than bound * s / w_min: s the largest singular value of the matrix of both rows, which is convex
in (u, v) and so largest in a corner of the rectangle that shows the mesh, w_min the least w on both surfaces. Stretched
pixels, shear, the edge of the frame and instances that are scaled are in the matrix.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.array_types import F64, MeshLike
from topleft._core.base.arrays import as_number, as_size, shown
from topleft._meshes.camera.camera import Camera, CameraLike, as_camera
from topleft._meshes.lod.levels import Level, Levels
from topleft._meshes.lod.parts import LEAST_PARTED, CutMesh
from topleft._meshes.lod.simplify import levels_of
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh, has_holes
from topleft._meshes.scene.adapt import as_mesh
from topleft._meshes.scene.scene import Scene
from topleft.typing import CullOption

#: Parts are drawn where they have at most this share of the triangles of the level for the whole mesh.
MOST_CUT = 0.5


@dataclass(frozen=True)
class Detail:
    """The level of a mesh that a view needs. Made by `choose_detail`.

    Attributes
    ----------
    level : int
        0: the mesh itself. Of a mesh in parts the coarsest level of the parts.
    mesh : Mesh
        The mesh to draw: the `.triangle` of its visibility buffer are rows of its triangles.
    bound : float
        How far its surface may lie from the mesh, object units.
    bound_px : float
        The largest error of a visible point, pixels.
    tolerance : float
        The limit, pixels.
    n_triangles : int
        Triangles of the mesh itself.
    why : str
    rejected : tuple of str
    n_drawn : int
        Triangles that are drawn. The triangles of a mesh in parts are the triangles of all parts of all levels; where a
        part is not chosen, its triangles are degenerate, a corner three times.
    n_parts : int
        How many parts, each at a level chosen for it, the mesh has; 0: it is a single level.

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
    n_drawn: int = 0
    n_parts: int = 0


def choose_detail(
    mesh: MeshLike,
    camera: CameraLike,
    size: int | tuple[int, int],
    *,
    tolerance: float,
    cull: CullOption | None = None,
    material: Material | None = None,
    transform: npt.ArrayLike | None = None,
    viewport: tuple[int, int] | None = None,
    origin: tuple[int, int] = (0, 0),
) -> Detail:
    """The coarsest level of a mesh that moves no visible point by more than a tolerance.

    Parameters
    ----------
    mesh : Mesh, or whatever `as_mesh` takes
        Its levels are computed at the first use, and cached with it; see `simplify`.
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
        If levels must be computed and fast-simplification is not installed.

    Notes
    -----
    Each visible point of the mesh lies within `bound_px` of a point of the level in the picture, and the other way
    round; the snap to sub-pixels moves either by 1/512 pixel at most along each axis. Occlusion between surfaces, and
    their light, may differ by more.

    Each part of a mesh of 500,000 triangles or more is drawn at its coarsest level where that leaves at most half of
    the triangles. `rasterize_mesh` and `render` draw these parts, in a scene for each instance, where no edges and
    nothing translucent is drawn; otherwise the whole mesh is drawn at a single level.

    The level is 0 where no bound holds: with a lens; where the mesh may reach the near or the far plane or the eye;
    where a side is culled, since turns of triangles are not bounded; where materials cut holes.

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
    n = len(mesh.triangles)

    def whole(why: str, others: tuple[str, ...] = ()) -> Detail:
        return Detail(0, mesh, 0.0, 0.0, tolerance, n, why, others, n)

    if reason := why_whole(mesh, camera, tolerance, cull, material):
        return whole(reason)
    levels = levels_of(mesh)
    if len(levels) == 1:
        return whole("it has no coarser level")
    screen = screen_error_of(camera, size, viewport, origin)
    place = None if transform is None else np.asarray(transform, np.float64)

    def rejected(i: int) -> str:
        scale = screen.scale_of(place, levels[0], levels[i])
        off = "reach the near or the far plane, or the eye"
        if scale is not None:
            off = f"be off by {levels[i].bound * scale:.3g} px"
        return f"level {i}, {len(levels[i].mesh.triangles):,} triangles: may {off}"

    matrix = screen.clip_from_world if place is None else engine.product(screen.clip_from_world, place)
    (i,), (scale,) = (column.tolist() for column in screen.coarsest(matrix[None], levels, tolerance))
    if (cut := screen.cut(matrix, levels, i, tolerance)) is not None:
        used = np.unique(cut.levels)
        why = f"each part is the coarsest of levels {used[0]} to {used[-1]} that is sure to be within {tolerance:g} px"
        return Detail(
            int(used[-1]), cut.mesh.as_mesh(), cut.bound, cut.bound_px, tolerance, n, why,
            (rejected(i + 1),) if i + 1 < len(levels) else (), cut.mesh.n_drawn, len(cut.levels),
        )  # fmt: skip
    if i == 0:
        return whole(f"no coarser level is sure to be within {tolerance:g} px", (rejected(1),))
    bound_px = levels[i].bound * scale
    why = f"no point that shows is off by more than {bound_px:.3g} px, and {tolerance:g} px are allowed"
    others = [rejected(i + 1)] if i + 1 < len(levels) else []
    others.append(f"the mesh itself, {n:,} triangles: finer than the picture has to be")
    return Detail(
        i, levels[i].mesh, levels[i].bound, bound_px, tolerance, n, why, tuple(others), len(levels[i].mesh.triangles)
    )


class ScreenError(NamedTuple):
    """The scale of errors in a view: from object units to pixels."""

    clip_from_world: F64
    viewport: tuple[int, int]
    window: F64  # of `window_of`

    def scale_of(self, place: F64 | None, *levels: Level) -> float | None:
        """The most pixels of a unit on some levels; None where there is no bound."""
        matrix = self.clip_from_world if place is None else engine.product(self.clip_from_world, place)
        return engine.pixels_per_unit(matrix, self.viewport, self.window, np.stack([level.extent for level in levels]))

    def coarsest(self, matrices: F64, levels: Levels, tolerance: float) -> tuple[NDArray[np.int64], F64]:
        """The coarsest level that is surely within a tolerance under each matrix, and its scale."""
        chosen: NDArray[np.int64] = np.empty(len(matrices), np.int64)
        scales: F64 = np.empty(len(matrices))
        how = matrices, self.viewport, self.window, levels.extents, levels.bounds, tolerance
        engine.coarsest_levels(*how, chosen, scales)
        return chosen, scales

    def cut(self, matrix: F64, levels: Levels, level: int, tolerance: float) -> ChosenParts | None:
        """The mesh of the coarsest parts that are surely within a tolerance, if a level is much finer."""
        parted = levels.parted if may_cut(levels, level) else None
        if parted is None:
            return None
        chosen, bound_px = parted.choose(matrix, self.viewport, self.window, tolerance)
        if parted.n_triangles(chosen) > MOST_CUT * len(levels[level].mesh.triangles):
            return None
        return ChosenParts(parted.mesh(chosen), parted.levels(chosen), parted.bound(chosen), bound_px)


def may_cut(levels: Levels, level: int) -> bool:
    """Whether the mesh has parts, and the level so many triangles that parts may be coarser."""
    return levels.parts is not None and len(levels[level].mesh.triangles) >= LEAST_PARTED


class ChosenParts(NamedTuple):
    """A mesh of parts of several levels, the level of each part, and the bounds of the mesh."""

    mesh: CutMesh
    levels: NDArray[np.intp]
    bound: float
    bound_px: float


def screen_error_of(
    camera: Camera, size: tuple[int, int], viewport: tuple[int, int] | None, origin: tuple[int, int]
) -> ScreenError:
    """The scale of errors in a view: from object units to pixels."""
    matrix = camera.clip_from_world(viewport or size)
    if not camera.has_planes and matrix[3, :3].any():  # the eye alone cuts
        matrix[2] = 0
    return ScreenError(matrix, viewport or size, window_of(size, viewport, origin))


def check_tolerance(tolerance: float) -> float:
    """The tolerance as float, or an error."""
    if not 0 <= as_number("tolerance", tolerance) < math.inf:
        raise ValueError(f"tolerance must be at least 0 pixels, got {tolerance!r}")
    return float(tolerance)


def why_whole(mesh: Mesh, camera: Camera, tolerance: float, cull: str | None, material: Material | None) -> str | None:
    """Why the mesh itself is drawn, or None where its levels decide."""
    if tolerance == 0:
        return "tolerance=0: the picture of the mesh itself, to the bit"
    if not len(mesh.triangles):
        return "it has no triangles"
    if camera.lens is not None:
        return "no bound is known for the bend of the lens"
    if cull is not None and str(cull) != "none":
        return f"cull={str(cull)!r}: which way a triangle is turned has no bound"
    if any(has_holes(each, mesh) for each in (mesh.materials if material is None else (material,))):
        return "a material cuts holes, and they have no bound"
    return None


def window_of(size: tuple[int, int], viewport: tuple[int, int] | None, origin: tuple[int, int]) -> F64:
    """The window in normalised device coordinates: lower and upper x, and y, (4,).

    At least the viewport, so that a window of a picture has the level of the whole picture.
    """
    ends = []
    for first, n, whole in zip(origin, size, viewport or size, strict=True):
        low, high = min(0, first), max(whole, first + n)
        ends.append((2 * (low - 1) / max(whole, 1) - 1, 2 * (high + 1) / max(whole, 1) - 1))
    return np.array([*ends[0], -ends[1][1], -ends[1][0]])


def detailed(
    scene: Scene, camera: Camera, size: tuple[int, int], tolerance: float, *, in_parts: bool = False, **options: Any
) -> Scene:
    """The scene to draw within a tolerance; options as for `choose_detail`, `in_parts` as for `Shot.within`."""
    if not isinstance(options.get("material"), Material | None):
        raise TypeError(f"material must be a Material, got {shown(options['material'])}")
    if check_tolerance(tolerance) == 0:
        return scene
    if camera.lens is not None:
        return scene  # see `why_whole`
    screen = screen_error_of(camera, size, options.get("viewport"), options.get("origin", (0, 0)))
    matrices = scene.clip_from_objects(screen.clip_from_world)
    chosen: dict[int, tuple[int, Mesh]] = {}
    of_instance: NDArray[np.int64] = np.empty(len(scene), np.int64)

    def use(mesh: Mesh, at: NDArray[np.intp] | int) -> None:
        of_instance[at] = chosen.setdefault(id(mesh), (len(chosen), mesh))[0]

    for mesh, material, at in scene.looks(options.get("material")):
        if why_whole(mesh, camera, tolerance, options.get("cull"), material):
            use(mesh, at)
            continue
        levels = levels_of(mesh)
        chosen_levels = screen.coarsest(matrices[at], levels, tolerance)[0]
        for level in sorted(set(chosen_levels.tolist())):
            instances = at[chosen_levels == level]
            use(levels[level].mesh if level else mesh, instances)
            for i in instances.tolist() if in_parts and may_cut(levels, level) else ():
                if (cut := screen.cut(matrices[i], levels, level, tolerance)) is not None:
                    use(cut.mesh, i)
    return scene.with_meshes([mesh for _, mesh in chosen.values()], of_instance)
