"""What the vertices and triangles of a coarser level take over: normals, colours, texture coordinates, materials.

In: the corners of one level, and which of them became one. Out: those of the next.

A vertex takes the attributes of the point that is nearest to it on the triangles round the vertices that went into it.
Other triangles may be nearer, across a seam or a thin wall: they have no say.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._lod.collapse import Collapsed
from topleft._lod.surface_distance import welded
from topleft._model.mesh import FloatArray, Mesh, coincident
from topleft._model.normals import unit_or_zero

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]

#: The attributes of vertices, by their names in a mesh.
ATTRIBUTES = ("normals", "colors", "uv")


class Corners(NamedTuple):
    """Points that are one only where all that is known of them is equal.

    Attributes
    ----------
    points : (N, 3) float64
    triangles : (T, 3) int32
    attributes : dict of str to (N, K) array
    material : (N,) int32 or None
        Row of the materials; triangles of two materials have no point in common.
    """

    points: F64
    triangles: I32
    attributes: dict[str, npt.NDArray[Any]]
    material: I32 | None


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
        attributes = {name: mixed(name, array, rows, weights) for name, array in attributes.items()}
    if material is not None:
        is_left = into >= 0
        of_next = np.empty(len(collapsed.points), np.int32)
        of_next[into[is_left]] = material[is_left]
        material = of_next
    return Corners(collapsed.points, collapsed.triangles, attributes, material)


def nearest_before(corners: Corners, points: F64, into: I32) -> tuple[npt.NDArray[np.intp], F64]:
    """Of each new point the triangle (N,) that has its nearest point, and the weights (N, 3) of its corners there."""
    point = into[corners.triangles].ravel()
    triangle = np.repeat(np.arange(len(corners.triangles), dtype=np.int32), 3)[point >= 0]
    point = point[point >= 0]
    feet = np.empty((len(point), 3))
    squared = np.empty(len(point))
    _engine.set_feet(corners.points, corners.triangles, points, triangle, point, feet, squared)
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


def mixed(name: str, array: npt.NDArray[Any], rows: I32, weights: F64) -> npt.NDArray[Any]:
    """The attribute of points: that of three vertices, by weight."""
    values = np.einsum("ij,ijk->ik", weights, array[rows].astype(np.float64))
    if name == "normals":
        return unit_or_zero(values).astype(array.dtype)
    return np.rint(values).astype(np.uint8) if array.dtype == np.uint8 else values.astype(array.dtype)


def level_mesh(corners: Corners, original: Mesh) -> Mesh:
    """The mesh of a level, its positions of the original's dtype."""
    vertices: FloatArray = corners.points.astype(original.vertices.dtype)
    rows = None if corners.material is None else corners.material[corners.triangles[:, 0]]
    return Mesh(
        vertices, corners.triangles, materials=original.materials, material_of_triangle=rows, **corners.attributes
    )
