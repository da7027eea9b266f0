"""Adapters: the meshes of other libraries, told by their attributes, as a `Mesh`; none of those libraries is imported.

Input: `trimesh.Trimesh` and `trimesh.Scene`, `meshio.Mesh`, `pyvista.PolyData`, `matplotlib.tri.Triangulation`,
anything with `vertices` and `triangles` (or `faces`), or a pair of arrays. Output: `Mesh`, or `Surface` where points
may be flat. Arrays are taken without a copy where their numbers allow it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from topleft.arrays import as_array
from topleft.files import joined, placed
from topleft.mesh import Mesh

MeshLike: TypeAlias = Any
"""What `as_mesh` takes."""

CORNERS_OF_CELL = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4, "polygon": None}
"""Corners of the surface cells of meshio, which come first in a row; `None`: all of the row."""


class Surface(NamedTuple):
    """Points, and triangles that know which face they were cut from."""

    points: npt.NDArray[Any]
    """(V, 2) or (V, 3)."""

    triangles: npt.NDArray[Any]
    """(T, 3) integers."""

    faces: npt.NDArray[np.int64] | None
    """(T,) the face, of any number of corners, that each triangle is a part of; `None`: faces are the triangles."""

    n_faces: int


def as_mesh(subject: MeshLike) -> Mesh:
    """The subject as a `Mesh`.

    Parameters
    ----------
    subject : Mesh, trimesh.Trimesh, trimesh.Scene, meshio.Mesh, pyvista.PolyData, matplotlib.tri.Triangulation
        Or anything with `vertices` and `triangles` or `faces`, or a pair (vertices, triangles).

    Returns
    -------
    Mesh
        Vertices share the memory of the subject's where they are float32 or float64 (V, 3). Flat points get z = 0.
        Faces with more corners become fans of triangles, in the order of the faces; masked triangles are left out. Of
        trimesh come colours, and the normals that it has already; a scene is placed and joined as `load` does it.

    Raises
    ------
    TypeError
        If the subject is none of these.
    ValueError
        If it has no faces that are surfaces, or as `Mesh` does.

    Examples
    --------
    >>> as_mesh(([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]])).vertices.tolist()
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    if isinstance(subject, Mesh):
        return subject
    if _is_scene(subject):
        nodes = [subject.graph[node] for node in subject.graph.nodes_geometry]
        shapes = [(subject.geometry[name], transform) for transform, name in nodes]
        parts = [placed(shape, transform) for shape, transform in shapes if len(getattr(shape, "faces", ()))]
        if not parts:
            raise ValueError("mesh has no triangles: nothing in the scene has faces")
        return joined(parts)
    if hasattr(subject, "visual") and hasattr(subject, "faces"):
        return placed(subject, np.eye(4))
    surface = as_surface(subject)
    points = surface.points
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    return Mesh(points, surface.triangles)


def as_surface(subject: MeshLike) -> Surface:
    """The points and triangles of a subject that `as_mesh` takes; points stay flat where they are.

    Raises
    ------
    TypeError
        If the subject is none of those.
    ValueError
        If it has no faces that are surfaces.
    """
    if _is_scene(subject):
        subject = as_mesh(subject)
    if hasattr(subject, "x") and hasattr(subject, "y") and hasattr(subject, "triangles"):
        return _of_triangulation(subject)
    if hasattr(subject, "points") and isinstance(getattr(subject, "cells", None), list):
        return _of_cells(as_array("points", subject.points), subject.cells)
    if hasattr(subject, "points") and hasattr(subject, "faces"):
        return _of_padded(subject)
    if hasattr(subject, "vertices"):
        # The `triangles` of trimesh are positions; its `faces` are what others call triangles.
        triangles = getattr(subject, "faces", None)
        triangles = getattr(subject, "triangles", None) if triangles is None else triangles
        if triangles is not None:
            return _plain(subject.vertices, triangles)
    if isinstance(subject, tuple | list) and len(subject) == 2:
        return _plain(*subject)
    raise TypeError(
        "mesh must be a Mesh, a mesh of trimesh, meshio or pyvista, a Triangulation, or a pair (vertices, triangles), "
        f"got {type(subject).__name__}"
    )


def is_mesh_like(subject: object) -> bool:
    """Whether a subject has faces, rather than being an array of points."""
    return _is_scene(subject) or any(hasattr(subject, name) for name in ("triangles", "faces", "cells"))


def _is_scene(subject: object) -> bool:
    return hasattr(subject, "geometry") and hasattr(subject, "graph")


def _plain(vertices: npt.ArrayLike, triangles: npt.ArrayLike) -> Surface:
    corners = as_array("triangles", triangles)
    return Surface(as_array("vertices", vertices), corners, None, len(corners))


def _of_triangulation(subject: Any) -> Surface:
    points = np.column_stack([as_array("x", subject.x), as_array("y", subject.y)])
    triangles, mask = as_array("triangles", subject.triangles), getattr(subject, "mask", None)
    if mask is None:
        return Surface(points, triangles, None, len(triangles))
    kept = np.flatnonzero(~np.asarray(mask))
    return Surface(points, triangles[kept], kept, len(triangles))


def _of_cells(points: npt.NDArray[Any], blocks: Iterable[Any]) -> Surface:
    """Triangles of the surface cells of meshio, block after block."""
    blocks = list(blocks)
    surfaces = [block for block in blocks if block.type in CORNERS_OF_CELL]
    found = [as_array("cells", block.data)[:, : CORNERS_OF_CELL[block.type]] for block in surfaces]
    if not found:
        kinds = ", ".join(block.type for block in blocks) or "none"
        raise ValueError(f"mesh has no triangles: its cells are {kinds}")
    return _fans(points, found)


def _of_padded(subject: Any) -> Surface:
    """Triangles of the faces of pyvista: one array, before each face its number of corners."""
    points, padded = as_array("points", subject.points), as_array("faces", subject.faces)
    if padded.ndim == 2:
        return Surface(points, padded, None, len(padded))
    if getattr(subject, "n_strips", 0):
        raise ValueError("mesh has strips of triangles: take its triangulate()")
    if padded.size % 4 == 0 and (padded[::4] == 3).all():
        triangles = padded.reshape(-1, 4)[:, 1:]
        return Surface(points, triangles, None, len(triangles))
    faces, start = [], 0
    while start < len(padded):
        faces.append(padded[None, start + 1 : start + 1 + padded[start]])
        start += 1 + int(padded[start])
    return _fans(points, faces)


def _fans(points: npt.NDArray[Any], blocks: list[npt.NDArray[Any]]) -> Surface:
    """Faces (N, K) as K - 2 triangles each."""
    if all(block.shape[1] == 3 for block in blocks):
        triangles = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        return Surface(points, triangles, None, len(triangles))
    fans, sources, n_faces = [], [], 0
    for block in blocks:
        n, n_corners = block.shape
        steps = np.arange(1, n_corners - 1)
        fan = np.stack([np.zeros_like(steps), steps, steps + 1], axis=1)
        fans.append(block[:, fan].reshape(-1, 3))
        sources.append(np.repeat(np.arange(n_faces, n_faces + n), len(steps)))
        n_faces += n
    return Surface(points, np.concatenate(fans), np.concatenate(sources), n_faces)
