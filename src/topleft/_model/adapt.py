"""Adapters: the meshes of other libraries, told by their attributes, as a `Mesh`; none of those libraries is imported.

Input: `trimesh.Trimesh` and `trimesh.Scene`, `meshio.Mesh`, `pyvista.PolyData`, `matplotlib.tri.Triangulation`,
anything with `vertices` and `triangles` (or `faces`), or a pair of arrays. Output: `Mesh`, or `Polygons` where points
may be flat. Arrays are taken without a copy where their numbers allow it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from topleft._base.arrays import as_array
from topleft._base.color import Color, encode_srgb
from topleft._model.material import Material
from topleft._model.mesh import Mesh, coincident
from topleft._model.normals import angle_weighted_normals
from topleft._model.texture import Texture

MeshLike: TypeAlias = Any
"""What `as_mesh` takes."""

FILE_READERS: list[Callable[[str | os.PathLike[str]], Mesh]] = []
"""What reads a mesh where a path is given: `load`, which puts itself here, for it stands on a floor above this one."""

CORNERS_OF_CELL = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4, "polygon": None}
"""Corners of the surface cells of meshio, which come first in a row; `None`: all of the row."""

DIELECTRIC = 0.04
"""The share of light that glass, paint and skin reflect when seen along their normal."""


class Polygons(NamedTuple):
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
    subject : Mesh, path, trimesh.Trimesh, trimesh.Scene, meshio.Mesh, pyvista.PolyData, matplotlib.tri.Triangulation
        Or anything with `vertices` and `triangles` or `faces`, or a pair (vertices, triangles).

    Returns
    -------
    Mesh
        Of a path what `load` reads. Vertices share the memory of the subject's where they are float32 or float64
        (V, 3). Flat points get z = 0.
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
    if isinstance(subject, str | os.PathLike) and FILE_READERS:
        return FILE_READERS[0](subject)
    if _is_scene(subject):
        nodes = [subject.graph[node] for node in subject.graph.nodes_geometry]
        shapes = [(subject.geometry[name], transform) for transform, name in nodes]
        parts = [placed(shape, transform) for shape, transform in shapes if len(getattr(shape, "faces", ()))]
        if not parts:
            raise ValueError("mesh has no triangles: nothing in the scene has faces")
        return joined(parts)
    if hasattr(subject, "visual") and hasattr(subject, "faces"):
        return placed(subject, np.eye(4))
    polygons = as_polygons(subject)
    points = polygons.points
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    return Mesh(points, polygons.triangles)


def as_polygons(subject: MeshLike) -> Polygons:
    """The points and triangles of a subject that `as_mesh` takes; points stay flat where they are.

    Raises
    ------
    TypeError
        If the subject is none of those.
    ValueError
        If it has no faces that are surfaces.
    """
    if _is_scene(subject) or isinstance(subject, str | os.PathLike):
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
    if isinstance(subject, str | os.PathLike):
        return True
    if isinstance(subject, tuple) and len(subject) == 2:  # (vertices, triangles), not two points
        return all(hasattr(part, "__len__") and len(part) > 0 and hasattr(part[0], "__len__") for part in subject)
    return _is_scene(subject) or any(hasattr(subject, name) for name in ("triangles", "faces", "cells"))


def _is_scene(subject: object) -> bool:
    return hasattr(subject, "geometry") and hasattr(subject, "graph")


def _plain(vertices: npt.ArrayLike, triangles: npt.ArrayLike) -> Polygons:
    points, corners = as_array("vertices", vertices), as_array("triangles", triangles)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"points must have shape (V, 2) or (V, 3), got {points.shape}")
    if corners.ndim == 2 and corners.shape[1] > 3 and corners.dtype.kind in "iu":
        return _fans(points, [corners])
    return Polygons(points, corners, None, corners.shape[0] if corners.ndim else 0)


def _of_triangulation(subject: Any) -> Polygons:
    points = np.column_stack([as_array("x", subject.x), as_array("y", subject.y)])
    triangles, mask = as_array("triangles", subject.triangles), getattr(subject, "mask", None)
    if mask is None:
        return Polygons(points, triangles, None, len(triangles))
    kept = np.flatnonzero(~np.asarray(mask))
    return Polygons(points, triangles[kept], kept, len(triangles))


def _of_cells(points: npt.NDArray[Any], blocks: Iterable[Any]) -> Polygons:
    """Triangles of the surface cells of meshio, block after block."""
    blocks = list(blocks)
    surfaces = [block for block in blocks if block.type in CORNERS_OF_CELL]
    found = [as_array("cells", block.data)[:, : CORNERS_OF_CELL[block.type]] for block in surfaces]
    if not found:
        kinds = ", ".join(block.type for block in blocks) or "none"
        raise ValueError(f"mesh has no triangles: its cells are {kinds}")
    return _fans(points, found)


def _of_padded(subject: Any) -> Polygons:
    """Triangles of the faces of pyvista: one array, before each face its number of corners."""
    points, padded = as_array("points", subject.points), as_array("faces", subject.faces)
    if padded.ndim == 2:
        return Polygons(points, padded, None, len(padded))
    if getattr(subject, "n_strips", 0):
        raise ValueError("mesh has strips of triangles: take its triangulate()")
    if padded.size % 4 == 0 and (padded[::4] == 3).all():
        triangles = padded.reshape(-1, 4)[:, 1:]
        return Polygons(points, triangles, None, len(triangles))
    faces, start = [], 0
    while start < len(padded):
        faces.append(padded[None, start + 1 : start + 1 + padded[start]])
        start += 1 + int(padded[start])
    return _fans(points, faces)


def _fans(points: npt.NDArray[Any], blocks: list[npt.NDArray[Any]]) -> Polygons:
    """Faces (N, K) as K - 2 triangles each."""
    if all(block.shape[1] == 3 for block in blocks):
        triangles = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        return Polygons(points, triangles, None, len(triangles))
    fans, sources, n_faces = [], [], 0
    for block in blocks:
        n, n_corners = block.shape
        steps = np.arange(1, n_corners - 1)
        fan = np.stack([np.zeros_like(steps), steps, steps + 1], axis=1)
        fans.append(block[:, fan].reshape(-1, 3))
        sources.append(np.repeat(np.arange(n_faces, n_faces + n), len(steps)))
        n_faces += n
    return Polygons(points, np.concatenate(fans), np.concatenate(sources), n_faces)


def placed(geometry: Any, transform: npt.NDArray[np.float64]) -> Mesh:
    """A trimesh geometry as a mesh in the space of its scene; per-face colours get corners of their own."""
    vertices, triangles = np.asarray(geometry.vertices), np.asarray(geometry.faces)
    # trimesh computes normals when asked for them; what a file gave waits in the cache.
    normals = np.asarray(geometry.vertex_normals) if "vertex_normals" in geometry._cache else None
    colors = uv = None
    materials: tuple[Material, ...] = ()
    if geometry.visual.kind == "texture":
        own = geometry.visual.uv
        uv = None if own is None or np.shape(own) != (len(vertices), 2) else np.asarray(own)
        material = material_of(geometry.visual.material)
        materials = () if material is None else (material,)
    elif geometry.visual.kind == "vertex":
        colors = np.asarray(geometry.visual.vertex_colors)
    elif geometry.visual.kind == "face":
        colors = np.asarray(geometry.visual.face_colors).repeat(3, axis=0)
        vertices = vertices[triangles.ravel()]
        normals = None if normals is None else normals[triangles.ravel()]
        triangles = np.arange(triangles.size).reshape(-1, 3)
    if not np.array_equal(transform, np.eye(4)):
        linear = transform[:3, :3]
        vertices = vertices @ linear.T + transform[:3, 3]
        if np.linalg.det(linear) < 0:  # a mirror turns the triangles over
            triangles = triangles[:, ::-1]
        if normals is not None:
            normals = normals @ np.linalg.pinv(linear)
    return Mesh(vertices, triangles, normals, colors, uv, materials)


def joined(parts: list[Mesh]) -> Mesh:
    """One mesh of several; vertices that are equal become one unless the file has normals."""
    starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([part.triangles + start for part, start in zip(parts, starts, strict=True)])
    colors = uv = None
    if any(part.colors is not None for part in parts):
        colors = np.concatenate([_rgba(part) for part in parts])
    if any(part.uv is not None for part in parts):
        uv = np.concatenate([_uv(part) for part in parts])
    surface = _joined_materials(parts)
    if all(part.normals is not None for part in parts):
        normals = np.concatenate([part.vertex_normals() for part in parts])
        return Mesh(vertices, triangles, normals, colors, uv, *surface)
    own_normals: npt.NDArray[Any] | None = None
    if any(part.normals is not None for part in parts):
        own_normals = np.concatenate([part.vertex_normals() for part in parts])
    elif colors is not None or uv is not None:
        # Vertices of two colours, or on both sides of a seam, stay two, and still share a normal.
        first, group = coincident(vertices)
        own_normals = angle_weighted_normals(vertices[first], group[triangles].astype(np.int32))[group]
    first, group = coincident(*(array for array in (vertices, own_normals, colors, uv) if array is not None))
    own_normals, colors, uv = (None if array is None else array[first] for array in (own_normals, colors, uv))
    return Mesh(vertices[first], group[triangles], own_normals, colors, uv, *surface)


def _joined_materials(parts: list[Mesh]) -> tuple[tuple[Material, ...], npt.NDArray[np.int32] | None]:
    """The materials of all parts, and which of them each triangle has."""
    if not any(part.materials for part in parts):
        return (), None
    materials: dict[Material, int] = {}
    rows = []
    for part in parts:
        own = part.materials[0] if part.materials else Material()
        rows.append(np.full(len(part.triangles), materials.setdefault(own, len(materials)), np.int32))
    return tuple(materials), np.concatenate(rows)


def _uv(part: Mesh) -> npt.NDArray[np.float32]:
    return np.zeros((len(part.vertices), 2), np.float32) if part.uv is None else part.uv


def _rgba(part: Mesh) -> npt.NDArray[np.uint8]:
    if part.colors is None:
        return np.full((len(part.vertices), 4), 255, dtype=np.uint8)
    return part.colors


def material_of(source: Any) -> Material | None:
    """The material of a trimesh visual: `SimpleMaterial` (MTL) or `PBRMaterial` (glTF); None for anything else."""
    if hasattr(source, "baseColorFactor"):
        return _metallic_rough(source)
    if hasattr(source, "diffuse"):
        shininess = float(source.glossiness or 0)
        specular = 0.0 if source.specular is None else float(np.mean(np.asarray(source.specular)[:3])) / 255
        texture = _texture(source.image)
        color = None if texture else _rgb(source.diffuse)
        return Material(color, texture, specular=min(specular, 1.0) if shininess else 0.0, shininess=shininess)
    return None


def _metallic_rough(source: Any) -> Material:
    factor = source.baseColorFactor
    texture = _texture(source.baseColorTexture)
    linear = np.ones(4) if factor is None else np.asarray(factor, dtype=np.float64)
    if factor is not None and np.asarray(factor).dtype.kind in "iu":
        linear = linear / 255
    roughness = 1.0 if source.roughnessFactor is None else float(source.roughnessFactor)
    alpha = max(roughness, 0.05) ** 2
    shininess = max(2 / alpha**2 - 2, 0.0)
    specular = min(DIELECTRIC * (shininess + 8) / 8, 1.0) if roughness < 1 else 0.0
    cutoff = None
    if source.alphaMode == "MASK":
        cutoff = 0.5 if source.alphaCutoff is None else float(source.alphaCutoff)
    color = None if factor is None else _rgb(np.rint(255 * encode_srgb(linear).clip(0, 1)))
    return Material(color, texture, specular=specular, shininess=shininess, alpha_cutoff=cutoff)


def _texture(image: Any) -> Texture | None:
    if image is None:
        return None
    return Texture(np.asarray(image.convert("RGBA")))


def _rgb(values: Any) -> Color:
    red, green, blue = (int(value) for value in np.asarray(values)[:3])
    return red, green, blue
