"""Adapters: a path, or the mesh of another library, recognized by its attributes, as a `Mesh`.

Input: a path, `trimesh.Trimesh` and `trimesh.Scene`, `meshio.Mesh`, `pyvista.PolyData` and `pyvista.UnstructuredGrid`,
`matplotlib.tri.Triangulation`, anything with `vertices` and `triangles` (or `faces`), or a pair of arrays. Output:
`Mesh`, or `Polygons` where points may be flat. Arrays are taken without a copy where their numbers allow it; none of
those libraries is imported.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_crease
from topleft._core.base.defaults import DEFAULT_CREASE
from topleft._core.base.notes import tell
from topleft._meshes.io.load import load
from topleft._meshes.model.cells import Polygons, of_arrays, of_cells, of_grid, of_padded, of_pair, of_triangulation
from topleft._meshes.model.from_trimesh import placed
from topleft._meshes.model.joined import joined
from topleft._meshes.model.mesh import Mesh


def as_mesh(subject: MeshLike, *, crease: float = DEFAULT_CREASE) -> Mesh:
    """The subject as a `Mesh`.

    Parameters
    ----------
    subject : Mesh, path, trimesh.Trimesh, trimesh.Scene, meshio.Mesh, pyvista.PolyData, matplotlib.tri.Triangulation
        Or pyvista.UnstructuredGrid, or anything with `vertices` and `triangles` or `faces`, or a pair (vertices,
        triangles). Faces are (T, 3), (F, K) with K corners each, or a list of lists.

    crease : float
        Degrees, 0 to 180: edges at which triangles bend by more are sharp, where the subject has no normals of its own;
        see `Mesh`. A `Mesh` stays as it is.

    Returns
    -------
    Mesh
        Of a path the mesh that `load` reads; points are refused. Vertices share the memory of the subject's where they
        are float32 or float64 (V, 3). Flat points get z = 0.
        Faces with more corners, concave ones too, are cut into triangles, in the order of the faces; masked triangles
        are left out. Curved cells of meshio and VTK (triangle6, quad8, ...) are drawn straight, from corner to corner.
        Of solid cells (tetra, hexahedron, wedge, pyramid) comes the skin: the sides that no second cell has. Of
        trimesh come colours, materials, and the normals that it has already; a scene is placed and joined as `load`
        does it.

    Raises
    ------
    TypeError
        If the subject is none of these, or a file without triangles.
    ValueError
        If it has no faces that are surfaces, or as `Mesh` does.

    Warns
    -----
    MeshWarning
        Once for each kind of cells of meshio and VTK that is not drawn: lines, say, or solid cells beside surfaces.

    Examples
    --------
    >>> as_mesh(([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]])).vertices.tolist()
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    if isinstance(subject, Mesh):
        return subject
    if isinstance(subject, str | os.PathLike):
        mesh = load(subject)
        if not isinstance(mesh, Mesh):
            raise TypeError(f"mesh must have triangles, got {mesh!r} from {os.fspath(subject)!r}")
        return mesh
    crease = as_crease(crease)
    if _is_scene(subject):
        nodes = [subject.graph[node] for node in subject.graph.nodes_geometry]
        shapes = [(subject.geometry[name], transform) for transform, name in nodes]
        parts = [placed(shape, transform) for shape, transform in shapes if len(getattr(shape, "faces", ()))]
        if not parts:
            raise ValueError("mesh has no triangles: nothing in the scene has faces")
        return joined(parts, crease)
    if hasattr(subject, "visual") and hasattr(subject, "faces"):
        return replace(placed(subject, np.eye(4)), crease=crease)
    polygons = as_polygons(subject)
    tell((f"mesh: cells of kind {kind!r} not drawn" for kind in polygons.not_drawn), stacklevel=2)
    return Mesh(polygons.points_in_space, polygons.triangles, crease=crease)


def as_polygons(subject: MeshLike) -> Polygons:
    """The points and triangles of a subject that `as_mesh` takes; points stay flat where they are.

    A `TypeError` if it is none of these, a `ValueError` if it has no faces that are surfaces.
    """
    if _is_scene(subject) or isinstance(subject, str | os.PathLike):
        subject = as_mesh(subject)
    make = _maker_for(subject)
    if make is None:
        raise TypeError(
            "mesh must be a Mesh, a mesh of trimesh, meshio or pyvista, a Triangulation, or a pair (vertices, "
            f"triangles), got {type(subject).__name__}"
        )
    return make(subject)


def _maker_for(subject: MeshLike) -> Callable[[Any], Polygons] | None:
    """The function that makes polygons of a subject with these attributes."""
    has = {name for name in ("x", "y", "triangles", "points", "celltypes", "faces") if hasattr(subject, name)}
    if {"x", "y", "triangles"} <= has:
        return of_triangulation
    if "points" in has and isinstance(getattr(subject, "cells", None), list):
        return of_cells
    if {"points", "celltypes"} <= has:
        return of_grid
    if {"points", "faces"} <= has:
        return of_padded
    if hasattr(subject, "vertices") and any(
        getattr(subject, name, None) is not None for name in ("faces", "triangles")
    ):
        return of_arrays
    return of_pair if isinstance(subject, tuple | list) and len(subject) == 2 else None


def is_mesh_like(subject: object) -> bool:
    """Whether a subject has faces, rather than being an array of points."""
    if isinstance(subject, str | os.PathLike):
        return True
    if isinstance(subject, tuple) and len(subject) == 2:  # (vertices, triangles), not two points
        return all(_has_rows(part) for part in subject)
    return _is_scene(subject) or any(hasattr(subject, name) for name in ("triangles", "faces", "cells"))


def _has_rows(part: Any) -> bool:
    """Whether an array, a table or a list is of rows; an empty array may be, of an empty list nobody knows."""
    if isinstance(getattr(part, "ndim", None), int):
        return bool(part.ndim == 2)
    return hasattr(part, "__len__") and len(part) > 0 and hasattr(part[0], "__len__")


def _is_scene(subject: object) -> bool:
    return hasattr(subject, "geometry") and hasattr(subject, "graph")
