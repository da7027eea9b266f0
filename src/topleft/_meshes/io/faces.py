"""A mesh of the faces of PLY and OFF: polygons over shared vertices, with values of vertices, corners or faces.

Input: rows of vertices, the corners of all faces one after the other. Output: a `Mesh`, or none without triangles.
"""

from __future__ import annotations

import numpy as np

from topleft._core.base.array_types import I64, Array
from topleft._meshes.io.references import InputFile
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.polygons import triangulate
from topleft.errors import MeshError


def note_small_faces(source: InputFile, n_corners: I64) -> None:
    """Note faces that have no triangle."""
    if len(n_corners) and int(n_corners.min()) < 3:
        source.notes.add("faces of fewer than three corners not drawn")


def mesh_of_faces(
    source: InputFile, positions: Array, corners: I64, n_corners: I64, *, normals: Array | None, colors: Array | None,
    uv: Array | None, uv_of_corners: Array | None = None, colors_of_faces: Array | None = None,
) -> Mesh | None:  # fmt: skip
    """The triangles of polygons; no two share a vertex where values end at the edges of a face."""
    if len(corners) and not 0 <= int(corners.min()) <= int(corners.max()) < len(positions):
        bad = int(corners.min()) if int(corners.min()) < 0 else int(corners.max())
        raise MeshError(f"a face names vertex {bad} of {len(positions)}")
    note_small_faces(source, n_corners)
    triangles, faces = triangulate(positions, corners, n_corners)
    if not len(triangles):
        return None
    names = corners[triangles].astype(np.int32)
    if colors is not None and colors_of_faces is not None:
        source.notes.add("colours of faces beside those of vertices not drawn")
    if uv_of_corners is None and (colors_of_faces is None or colors is not None):
        return Mesh(positions, names, normals, colors, uv)
    source.budget.spend("max_vertices", names.size)
    at = names.ravel()
    if uv_of_corners is not None:
        uv = uv_of_corners[triangles.ravel()]
    elif uv is not None:
        uv = uv[at]
    if colors is not None:
        colors = colors[at]
    elif colors_of_faces is not None:
        colors = np.repeat(colors_of_faces[faces], 3, axis=0)
    normals_of_corners = None if normals is None else normals[at]
    return Mesh(positions[at], np.arange(len(at), dtype=np.int32).reshape(-1, 3), normals_of_corners, colors, uv)
