"""Makes coarser levels of a mesh, each with a bound on its distance from the mesh.

In: a mesh. Out: `Levels`. Edges are collapsed by another package (`collapse.py`); here
each level is measured against the surface that it stands for (`distance.py`).

A vertex of a level takes the attributes of the point that is nearest to it on the triangles round the vertices that
went into it. Other triangles may be nearer, across a seam or a thin wall: they are not read.
"""

from __future__ import annotations

import threading
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I32
from topleft._core.base.arrays import shown
from topleft._core.base.color import spread_colors
from topleft._meshes.lod.collapse import STUCK, Collapsed, collapse, collapser, wanted_of
from topleft._meshes.lod.distance import TriangleTree, measure, welded
from topleft._meshes.lod.levels import Level, Levels, keep_levels, kept_levels
from topleft._meshes.model.mesh import FloatArray, Mesh, coincident
from topleft._meshes.model.normals import unit_or_zero

#: Levels are measured against the mesh itself, or against its finest level with at most so many triangles, whose bound
#: is added: it is small beside those of coarser levels, and the time that comparisons take goes with the triangles.
MOST_TO_COMPARE = 300_000

#: The levels end before one that has 1/n of the triangles of the one before and more than n to
#: this power times its bound: it has lost a part. Bounds go with the area of triangles on smooth surfaces, with n.
MOST_POWER = 2.0

#: The attributes of vertices, by their names in a mesh.
ATTRIBUTES = ("normals", "colors", "uv", "uv1")


_lock = threading.RLock()


class Corners(NamedTuple):
    """Points that are one only where all their attributes are equal."""

    points: F64  # (N, 3)
    triangles: I32  # (T, 3)
    attributes: dict[str, npt.NDArray[Any]]  # (N, K) each
    material: I32 | None  # (N,) rows; triangles of two materials have no point in common
    mixes_light: bool = False  # whether colours between vertices are mixed as light


def simplify(mesh: Mesh, *, ratio: float = 0.25, smallest: int = 200) -> Levels:
    """The mesh and coarser levels of it, each with a bound on its distance from the mesh; kept with the mesh.

    Parameters
    ----------
    mesh : Mesh
    ratio : float
        Triangles of a level as a share of those of the level before, 0.05 to 0.75.
    smallest : int
        No level has fewer triangles than about this number, at least 4.

    Returns
    -------
    Levels
        `levels[0]` is the mesh. It ends where triangles cannot be collapsed any more. `render(tolerance=)` finds the
        levels with the mesh for as long as it lives; `levels.save(path)` writes them.

    Raises
    ------
    TypeError
        If it is no mesh.
    ValueError
        If an option is out of range.
    MissingPackageError
        If fast-simplification is not installed: ``pip install fast-simplification``.

    Notes
    -----
    The bound is one on the two-sided Hausdorff distance of the surfaces as they are drawn, float32 or float64, in units
    of object space: it holds for each point of both, borders included, whatever the collapser did.

    Vertices that stand at one place with equal attributes count as one, and those that no triangle uses as none. A
    vertex of a level takes its normal, colour and texture coordinates from the nearest point of the level before,
    among the triangles round the vertices that went into it. Open borders stay as they are, vertex by vertex, and so do
    the seams where attributes jump or materials meet: nothing bleeds across and nothing cracks, but no level is coarser
    than its borders and seams. A mesh without normals has levels without, which crease at the same angle.

    Examples
    --------
    >>> import topleft as tl
    >>> torus = tl.Mesh(*tl.scenes.torus())
    >>> levels = tl.simplify(torus)  # doctest: +SKIP
    >>> [len(level.mesh.triangles) for level in levels]  # doctest: +SKIP
    [16384, 4096, 1024, 256]
    """
    if not isinstance(mesh, Mesh):
        raise TypeError(f"mesh must be a Mesh, got {shown(mesh)}; of a Scene simplify its meshes")
    if not 0.05 <= ratio <= 0.75:
        raise ValueError(f"ratio must lie in 0.05 to 0.75, got {ratio!r}")
    if smallest < 4:
        raise ValueError(f"smallest must be at least 4, got {smallest!r}")
    collapser()
    with _lock:
        coarser = coarser_levels(mesh, ratio, smallest)
        return keep_levels(mesh, Levels(mesh, coarser))


def levels_of(mesh: Mesh) -> Levels:
    """The levels that are kept with a mesh; they are made where there are none yet, once."""
    with _lock:
        return kept_levels(mesh) or simplify(mesh)


def coarser_levels(mesh: Mesh, ratio: float, smallest: int) -> list[Level]:
    """The levels below the mesh, as long as each is of use."""
    found: list[Level] = []
    corners = corners_of(mesh)
    center = corners.points.min(axis=0) / 2 + corners.points.max(axis=0) / 2 if len(corners.points) else np.zeros(3)
    has_more = bool(corners.attributes) or corners.material is not None
    anchor: TriangleTree | None = None
    bound_of_anchor = 0.0
    while n_wanted := wanted_of(corners.triangles, ratio, smallest):
        n_before = len(corners.triangles)
        collapsed = collapse(corners.points, corners.triangles, n_wanted, with_pairs=has_more)
        if not 0 < len(collapsed.triangles) <= STUCK * n_before:
            break
        if anchor is None:  # without attributes the corners are welded already
            anchor = (
                TriangleTree.of_mesh(mesh.vertices, mesh.triangles, center)
                if has_more
                else TriangleTree(corners.points - center, corners.triangles)
            )
        corners = stored(next_corners(corners, collapsed), mesh)
        level = level_mesh(corners, mesh)
        surface = TriangleTree.of_mesh(level.vertices, level.triangles, center)
        apart = measure(anchor, surface)
        bound = bound_of_anchor + apart.bound
        if found and bound > (n_before / len(corners.triangles)) ** MOST_POWER * found[-1].bound:
            break
        found.append(Level(level, bound, max(apart.known - bound_of_anchor, 0.0)))
        if len(anchor.triangles) > MOST_TO_COMPARE:
            anchor, bound_of_anchor = surface, bound
    return found


def stored(corners: Corners, mesh: Mesh) -> Corners:
    """The corners with their points as the mesh of the level has them, so the bound is that of the drawn points."""
    return corners._replace(points=corners.points.astype(mesh.vertices.dtype).astype(np.float64))


def corners_of(mesh: Mesh) -> Corners:
    """The corners of a mesh, without triangles that have two corners at one place."""
    given = {name: getattr(mesh, name) for name in ATTRIBUTES}
    given = {name: array for name, array in given.items() if array is not None}
    rows = mesh.material_of_triangle
    if not given and rows is None:
        points, triangles = welded(mesh.vertices, mesh.triangles)
        return Corners(points, triangles, {}, None)
    first, group = coincident(mesh.vertices, *given.values())
    corners = group[mesh.triangles]
    _, place = coincident(mesh.vertices)
    a, b, c = place[mesh.triangles].T
    is_whole = (a != b) & (b != c) & (c != a)
    if is_whole.any():
        corners, rows = corners[is_whole], None if rows is None else rows[is_whole]
    if rows is None:
        key = corners.ravel()
    else:  # a vertex of two materials becomes two
        key = corners.ravel() * len(mesh.materials) + rows.repeat(3)
    used, compact = np.unique(key, return_inverse=True)
    vertex = used if rows is None else used // len(mesh.materials)
    source = first[vertex]
    return Corners(
        mesh.vertices[source].astype(np.float64),
        compact.reshape(-1, 3).astype(np.int32),
        {name: array[source] for name, array in given.items()},
        None if rows is None else (used % len(mesh.materials)).astype(np.int32),
        mesh.color_interpolation == "linear",
    )


def next_corners(corners: Corners, collapsed: Collapsed) -> Corners:
    """The corners of the next level."""
    attributes, material = corners.attributes, corners.material
    into = collapsed.into
    if into is None:
        return Corners(collapsed.points, collapsed.triangles, {}, None)
    if attributes:
        triangle, weights = nearest_before(corners, collapsed.points, into)
        rows = corners.triangles[triangle]
        attributes = {
            name: mixed(name, array, rows, weights, corners.mixes_light) for name, array in attributes.items()
        }
    if material is not None:
        is_left = into >= 0
        of_next = np.empty(len(collapsed.points), np.int32)
        of_next[into[is_left]] = material[is_left]
        material = of_next
    return Corners(collapsed.points, collapsed.triangles, attributes, material, corners.mixes_light)


def nearest_before(corners: Corners, points: F64, into: I32) -> tuple[npt.NDArray[np.intp], F64]:
    """Of each new point the triangle (N,) that has its nearest point, and the weights (N, 3) of its corners there."""
    point = into[corners.triangles].ravel()
    triangle = np.repeat(np.arange(len(corners.triangles), dtype=np.int32), 3)[point >= 0]
    point = point[point >= 0]
    feet = np.empty((len(point), 3))
    squared = np.empty(len(point))
    engine.set_feet(corners.points, corners.triangles, points, triangle, point, feet, squared)
    order = np.lexsort((triangle, squared, point))
    starts = np.flatnonzero(np.diff(point[order], prepend=-1))
    best = order[starts]  # every new point has triangles, so these are the points in their order
    found = triangle[best].astype(np.intp)
    return found, weights_of(corners.points[corners.triangles[found]], feet[best])


def weights_of(corners: F64, points: F64) -> F64:
    """Weights (N, 3) of three corners (N, 3, 3) that give points (N, 3) on their triangle: at least 0, their sum 1."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    across = np.cross(b - a, c - a)
    parts = [np.cross(c - b, points - b), np.cross(a - c, points - c), np.cross(b - a, points - a)]
    weights = np.stack([np.einsum("ij,ij->i", part, across) for part in parts], axis=1).clip(0)
    total = weights.sum(axis=1, keepdims=True)
    # A triangle without area is a line: the nearest corner will do.
    nearest = ((corners - points[:, None]) ** 2).sum(axis=2).argmin(axis=1)
    return np.where(total > 0, weights / np.where(total > 0, total, 1), np.eye(3)[nearest])


def mixed(name: str, array: npt.NDArray[Any], rows: I32, weights: F64, mixes_light: bool) -> npt.NDArray[Any]:
    """The attribute of points: that of three vertices, by weight; colours as light, or as their numbers."""

    def mix(values: npt.NDArray[Any]) -> F64:
        mean: F64 = np.einsum("ij,ijk->ik", weights, values[rows].astype(np.float64))
        return mean

    if name == "colors":
        return spread_colors(array, mixes_light, mix)
    return (unit_or_zero(mix(array)) if name == "normals" else mix(array)).astype(array.dtype)


def level_mesh(corners: Corners, original: Mesh) -> Mesh:
    """The mesh of a level, its positions of the original's dtype."""
    vertices: FloatArray = corners.points.astype(original.vertices.dtype)
    rows = None if corners.material is None else corners.material[corners.triangles[:, 0]]
    return Mesh(
        vertices,
        corners.triangles,
        materials=original.materials,
        material_of_triangle=rows,
        crease=original.crease,
        color_interpolation=original.color_interpolation,
        **corners.attributes,
    )
