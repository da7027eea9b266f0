"""Adapters: the meshes of other libraries, told by their attributes, as a `Mesh`; none of those libraries is imported.

Input: `trimesh.Trimesh` and `trimesh.Scene`, `meshio.Mesh`, `pyvista.PolyData` and `pyvista.UnstructuredGrid`,
`matplotlib.tri.Triangulation`, anything with `vertices` and `triangles` (or `faces`), or a pair of arrays. Output:
`Mesh`, or `Polygons` where points may be flat. Arrays are taken without a copy where their numbers allow it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from topleft._base.arrays import as_array
from topleft._base.color import Color, encode_srgb
from topleft._model.material import Material
from topleft._model.mesh import NO_CREASE, Mesh, as_crease, coincident, with_normals
from topleft._model.normals import angle_weighted_normals
from topleft._model.polygons import triangulate
from topleft._model.texture import Texture
from topleft.typing import AlphaModeOption, EncodingOption

DEFAULT_CREASE = 30.0
"""Degrees by which triangles of a mesh without normals bend at an edge before it is sharp: round things of 12 sides and
more stay round."""

MeshLike: TypeAlias = Any
"""What `as_mesh` takes."""

FILE_READERS: list[Callable[[str | os.PathLike[str]], Any]] = []
"""What reads a mesh where a path is given: `load`, which puts itself here, for it stands on a floor above this one."""

CORNERS_OF_CELL = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4, "polygon": None}
"""Corners of the surface cells of meshio, which come first in a row; `None`: all of the row. Of curved cells the points
on their edges and inside are left out: they are drawn straight, from corner to corner."""

SIDES_OF_SOLID = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "voxel": ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)),
}
"""Corners of the sides of solid cells, counter-clockwise seen from outside."""

SOLID_OF_CELL = {
    "tetra": "tetra", "tetra10": "tetra", "hexahedron": "hexahedron", "hexahedron20": "hexahedron",
    "hexahedron24": "hexahedron", "hexahedron27": "hexahedron", "wedge": "wedge", "wedge15": "wedge",
    "wedge18": "wedge", "pyramid": "pyramid", "pyramid13": "pyramid", "pyramid14": "pyramid", "voxel": "voxel",
}  # fmt: skip

CELL_OF_VTK = {
    5: "triangle", 7: "polygon", 9: "quad", 10: "tetra", 11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid",
    22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20", 26: "wedge15", 27: "pyramid13", 28: "quad9",
    29: "hexahedron27", 34: "triangle7",
}  # fmt: skip
"""The cells of VTK, by their numbers."""

ALPHA_MODES: dict[str, AlphaModeOption] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}
DEFAULT_OF_TRIMESH = ((102, 102, 102), 1.0)
"""Specular colour and glossiness of trimesh's materials where nobody gave them."""


class Polygons(NamedTuple):
    """Points, and triangles that know which face they were cut from."""

    points: npt.NDArray[Any]
    """(V, 2) or (V, 3)."""

    triangles: npt.NDArray[Any]
    """(T, 3) integers."""

    faces: npt.NDArray[np.int64] | None
    """(T,) the face, of any number of corners, that each triangle is a part of; `None`: faces are the triangles."""

    n_faces: int


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
        Of a path what `load` reads. Vertices share the memory of the subject's where they are float32 or float64
        (V, 3). Flat points get z = 0.
        Faces with more corners, concave ones too, are cut into triangles, in the order of the faces; masked triangles
        are left out. Curved cells of meshio and VTK (triangle6, quad8, ...) are drawn straight, from corner to corner.
        Of solid cells (tetra, hexahedron, wedge, pyramid) comes the skin: the sides that no second cell has. Of
        trimesh come colours, materials, and the normals that it has already; a scene is placed and joined as `load`
        does it.

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
    points = polygons.points
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    return Mesh(points, polygons.triangles, crease=crease)


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
    if hasattr(subject, "points") and hasattr(subject, "celltypes"):
        return _of_grid(subject)
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
    points = as_array("vertices", vertices)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"points must have shape (V, 2) or (V, 3), got {points.shape}")
    if isinstance(triangles, list | tuple) and len({np.size(face) for face in triangles}) > 1:
        n_corners = np.array([np.size(face) for face in triangles])
        corners = np.concatenate([np.asarray(face).ravel() for face in triangles])
        if corners.dtype.kind not in "iu":
            raise TypeError(f"triangles must be integers, got {corners.dtype}")
        return _of_faces(points, corners, n_corners)
    corners = as_array("triangles", triangles)
    if corners.ndim == 2 and corners.shape[1] > 3 and corners.dtype.kind in "iu":
        return _of_blocks(points, [corners])
    return Polygons(points, corners, None, corners.shape[0] if corners.ndim else 0)


def _of_triangulation(subject: Any) -> Polygons:
    points = np.column_stack([as_array("x", subject.x), as_array("y", subject.y)])
    triangles, mask = as_array("triangles", subject.triangles), getattr(subject, "mask", None)
    if mask is None:
        return Polygons(points, triangles, None, len(triangles))
    kept = np.flatnonzero(~np.asarray(mask))
    return Polygons(points, triangles[kept], kept, len(triangles))


def _of_cells(points: npt.NDArray[Any], blocks: Iterable[Any]) -> Polygons:
    """Triangles of the surface cells of meshio, block after block; where there are none, of the skin of solid ones."""
    blocks = list(blocks)
    surfaces = [block for block in blocks if block.type in CORNERS_OF_CELL]
    if surfaces:
        return _of_blocks(
            points, [as_array("cells", block.data)[:, : CORNERS_OF_CELL[block.type]] for block in surfaces]
        )
    solids = [
        (SOLID_OF_CELL[block.type], as_array("cells", block.data)) for block in blocks if block.type in SOLID_OF_CELL
    ]
    if not solids:
        kinds = ", ".join(block.type for block in blocks) or "none"
        raise ValueError(f"mesh has no triangles: its cells are {kinds}")
    return _skin(points, solids)


def _of_grid(subject: Any) -> Polygons:
    """Triangles of the cells of pyvista's UnstructuredGrid: one array, before each cell its number of points."""
    points, padded = as_array("points", subject.points), as_array("cells", subject.cells).ravel().astype(np.int64)
    kinds = as_array("celltypes", subject.celltypes).ravel()
    starts, sizes = _rows_of_padded(padded)
    if len(starts) != len(kinds):
        raise ValueError(f"mesh has {len(starts)} cells and {len(kinds)} types of cells")
    blocks = []
    for kind in np.unique(kinds).tolist():
        for size in np.unique(sizes[kinds == kind]).tolist():
            rows = padded[starts[(kinds == kind) & (sizes == size)][:, None] + np.arange(size)]
            blocks.append(_Block(CELL_OF_VTK.get(kind, f"VTK's {kind}"), rows))
    return _of_cells(points, blocks)


class _Block(NamedTuple):
    type: str
    data: npt.NDArray[np.int64]


def _skin(points: npt.NDArray[Any], solids: list[tuple[str, npt.NDArray[Any]]]) -> Polygons:
    """Triangles of the sides of solid cells that no second cell has."""
    sides: dict[int, list[npt.NDArray[np.int64]]] = {3: [], 4: []}
    for kind, cells in solids:
        sides_of_cell = SIDES_OF_SOLID[kind]
        middle = points[cells[:, : 1 + max(max(side) for side in sides_of_cell)]].mean(axis=1)
        for side in sides_of_cell:
            rows = cells[:, side].astype(np.int64)
            first, *_, last = corners = np.moveaxis(points[rows], 1, 0)
            # Programs do not agree which way round a wedge goes.
            is_inwards = (np.cross(corners[1] - first, last - first) * (corners.mean(axis=0) - middle)).sum(axis=1) < 0
            rows[is_inwards] = rows[is_inwards][:, ::-1]
            sides[len(side)].append(rows)
    blocks = []
    for rows in (np.concatenate(own) for own in sides.values() if own):
        _, first, n_cells = np.unique(np.sort(rows, axis=1), axis=0, return_index=True, return_counts=True)
        blocks.append(rows[np.sort(first[n_cells == 1])])
    return _of_blocks(points, blocks)


def _of_padded(subject: Any) -> Polygons:
    """Triangles of the faces of pyvista: one array, before each face its number of corners."""
    points, padded = as_array("points", subject.points), as_array("faces", subject.faces)
    if padded.ndim == 2:
        return _plain(points, padded)
    if getattr(subject, "n_strips", 0):
        raise ValueError("mesh has strips of triangles: take its triangulate()")
    if padded.size % 4 == 0 and (padded[::4] == 3).all():
        triangles = padded.reshape(-1, 4)[:, 1:]
        return Polygons(points, triangles, None, len(triangles))
    starts, sizes = _rows_of_padded(padded)
    within = np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return _of_faces(points, padded[np.repeat(starts, sizes) + within], sizes)


def _rows_of_padded(padded: npt.NDArray[Any]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Where the rows of one array begin, before each of which stands its length, and these."""
    starts, sizes, at, numbers = [], [], 0, padded.tolist()
    while at < len(numbers):
        size = numbers[at]
        if size < 0 or at + 1 + size > len(numbers):
            raise ValueError(f"faces[{at}] = {size} must be a number of corners that follow")
        starts.append(at + 1)
        sizes.append(size)
        at += 1 + size
    return np.array(starts, np.int64), np.array(sizes, np.int64)


def _of_blocks(points: npt.NDArray[Any], blocks: list[npt.NDArray[Any]]) -> Polygons:
    """Faces (N, K) as K - 2 triangles each."""
    if all(block.shape[1] == 3 for block in blocks):
        triangles = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        return Polygons(points, triangles, None, len(triangles))
    n_corners = np.concatenate([np.full(len(block), block.shape[1]) for block in blocks])
    return _of_faces(points, np.concatenate([block.ravel() for block in blocks]), n_corners)


def _of_faces(points: npt.NDArray[Any], corners: npt.NDArray[Any], n_corners: npt.NDArray[Any]) -> Polygons:
    rows, faces = triangulate(points, corners, n_corners)
    return Polygons(points, corners[rows], faces, len(n_corners))


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


def joined(parts: list[Mesh], crease: float = NO_CREASE) -> Mesh:
    """One mesh of several; vertices that are equal become one unless the file has normals.

    `crease` is that of the parts without normals.
    """
    if len(parts) == 1 and parts[0].normals is not None:
        return parts[0]
    if len({part.normals is None for part in parts}) > 1:
        parts = [with_normals(replace(part, crease=crease)) for part in parts]
    starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([part.triangles + np.int32(start) for part, start in zip(parts, starts, strict=True)])
    colors = None
    if any(part.colors is not None for part in parts):
        colors = np.concatenate([_rgba(part) for part in parts])
    uv, uv1 = _joined_uv(parts, "uv"), _joined_uv(parts, "uv1")
    materials, rows = _joined_materials(parts)
    if all(part.normals is not None for part in parts):
        normals = np.concatenate([part.vertex_normals() for part in parts])
        return Mesh(vertices, triangles, normals, colors, uv, materials, rows, uv1)
    own_normals: npt.NDArray[Any] | None = None
    if crease == NO_CREASE and (colors is not None or uv is not None):
        # Vertices of two colours, or on both sides of a seam, stay two, and still share a normal.
        first, group = coincident(vertices)
        own_normals = angle_weighted_normals(vertices[first], group[triangles].astype(np.int32))[group]
    attributes = [vertices, own_normals, colors, uv, uv1]
    first, group = coincident(*(array for array in attributes if array is not None))
    own_normals, uv, uv1 = (None if array is None else array[first] for array in (own_normals, uv, uv1))
    colors = None if colors is None else colors[first]
    return Mesh(vertices[first], group[triangles], own_normals, colors, uv, materials, rows, uv1, crease=crease)


def _joined_materials(parts: list[Mesh]) -> tuple[tuple[Material, ...], npt.NDArray[np.int32] | None]:
    """The materials of all parts, and which of them each triangle has."""
    if not any(part.materials for part in parts):
        return (), None
    places: dict[Material, int] = {}
    rows = []
    for part in parts:
        place = [places.setdefault(own, len(places)) for own in part.materials or (Material(),)]
        own_rows = part.material_of_triangle
        n = len(part.triangles)
        rows.append(np.full(n, place[0], np.int32) if own_rows is None else np.array(place, np.int32)[own_rows])
    return tuple(places), np.concatenate(rows)


def _joined_uv(parts: list[Mesh], name: str) -> npt.NDArray[np.float32] | None:
    """The texture coordinates of all parts; zeros for those without."""
    own = [getattr(part, name) for part in parts]
    if all(uv is None for uv in own):
        return None
    return np.concatenate(
        [
            np.zeros((len(part.vertices), 2), np.float32) if uv is None else uv
            for part, uv in zip(parts, own, strict=True)
        ]
    )


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
        if source.specular is not None and (_rgb(source.specular), shininess) == DEFAULT_OF_TRIMESH:
            specular = 0.0  # nobody asked for highlights
        texture = _texture(source.image)
        color = None if texture else _rgb(source.diffuse)
        return Material(color, texture, specular=min(specular, 1.0) if shininess else 0.0, shininess=shininess)
    return None


def _metallic_rough(source: Any) -> Material:
    """What trimesh keeps of a material of glTF."""
    factor = source.baseColorFactor
    linear = np.ones(4)
    if factor is not None:
        given = np.asarray(factor, np.float64).ravel() / (255 if np.asarray(factor).dtype.kind in "iu" else 1)
        linear[: len(given)] = given[:4]
    emission = np.zeros(3) if source.emissiveFactor is None else np.asarray(source.emissiveFactor, np.float64)
    mode = source.alphaMode if source.alphaMode in ALPHA_MODES else "OPAQUE"
    cutoff = 0.5 if source.alphaCutoff is None else float(source.alphaCutoff)
    return Material(
        None if factor is None else _rgb(np.rint(255 * encode_srgb(linear).clip(0, 1))),
        _texture(source.baseColorTexture),
        alpha_cutoff=min(max(cutoff, 0.0), 1.0) if mode == "MASK" else None,
        opacity=min(max(float(linear[3]), 0.0), 1.0),
        alpha_mode=ALPHA_MODES[mode],
        double_sided=source.doubleSided is not False,
        emission=tuple(np.maximum(emission, 0).tolist()),
        emission_texture=_texture(source.emissiveTexture),
        metallic=1.0 if source.metallicFactor is None else min(max(float(source.metallicFactor), 0.0), 1.0),
        roughness=1.0 if source.roughnessFactor is None else min(max(float(source.roughnessFactor), 0.0), 1.0),
        metallic_roughness_texture=_texture(source.metallicRoughnessTexture, "linear"),
        occlusion_texture=_texture(source.occlusionTexture, "linear"),
        normal_texture=_texture(source.normalTexture, "linear"),
    )


def _texture(image: Any, encoding: EncodingOption = "srgb") -> Texture | None:
    if image is None:
        return None
    return Texture(np.asarray(image.convert("RGBA")), encoding=encoding)


def _rgb(values: Any) -> Color:
    red, green, blue = (int(value) for value in np.asarray(values)[:3])
    return red, green, blue
