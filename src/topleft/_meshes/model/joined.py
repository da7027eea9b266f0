"""Places the parts of a mesh, and joins them to one: vertices that are equal become one where no normals are given.

Input: arrays and their place; `Mesh` parts. Output: arrays; `Mesh`, with the attributes and materials of all of them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import Array
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import NO_CREASE, Mesh, coincident, with_normals
from topleft._meshes.model.normals import angle_weighted_normals, moved
from topleft.typing import EncodingOption


def placed_arrays(
    vertices: Array, triangles: Array, normals: Array | None, transform: npt.NDArray[np.float64]
) -> tuple[Array, Array, Array | None]:
    """Vertices, triangles and normals, placed by a matrix (4, 4); they are themselves where it does nothing."""
    if np.array_equal(transform, np.eye(4)):
        return vertices, triangles, normals
    linear = transform[:3, :3]
    volume = engine.determinant(linear)
    if volume < 0:  # a mirror turns the triangles over
        triangles = triangles[:, ::-1]
    if normals is not None:
        normals = engine.product(normals, engine.inverse(linear) if volume else np.linalg.pinv(linear))
    return moved(vertices, transform), triangles, normals


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
    colors, mixed, up = None, _interpolation_of(parts), parts[0].up
    if any(part.colors is not None for part in parts):
        colors = np.concatenate([_rgba(part) for part in parts])
    uv, uv1 = _joined_uv(parts, "uv"), _joined_uv(parts, "uv1")
    materials, rows = _joined_materials(parts)
    if all(part.normals is not None for part in parts):
        normals = np.concatenate([part.vertex_normals() for part in parts])
        return Mesh(vertices, triangles, normals, colors, uv, materials, rows, uv1, color_interpolation=mixed, up=up)
    own_normals: npt.NDArray[Any] | None = None
    if crease == NO_CREASE and (colors is not None or uv is not None):
        # Vertices of two colours, or on both sides of a seam, stay two, and still share a normal.
        first, group = coincident(vertices)
        own_normals = angle_weighted_normals(vertices[first], group[triangles].astype(np.int32))[group]
    attributes = [vertices, own_normals, colors, uv, uv1]
    first, group = coincident(*(array for array in attributes if array is not None))
    own_normals, uv, uv1 = (None if array is None else array[first] for array in (own_normals, uv, uv1))
    colors = None if colors is None else colors[first]
    own = vertices[first], group[triangles], own_normals, colors, uv, materials, rows, uv1
    return Mesh(*own, crease=crease, color_interpolation=mixed, up=up)


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


def _interpolation_of(parts: list[Mesh]) -> EncodingOption:
    """The interpolation of the colours of all parts: linear in light, if that of each part with colours is."""
    own = {part.color_interpolation for part in parts if part.colors is not None}
    return "linear" if own == {"linear"} else "srgb"


def _rgba(part: Mesh) -> npt.NDArray[np.uint8]:
    if part.colors is None:
        return np.full((len(part.vertices), 4), 255, dtype=np.uint8)
    return part.colors
