"""A triangle mesh as arrays: positions, indices, and what else is known of its surface; checked once, here.

Input: anything NumPy can read. Output: a `Mesh` whose arrays the other stages use as they are.

Based on: Thurmer, G., and C. A. Wuthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics
Tools 3(1), 1998 (normals weighted by the angle at the vertex).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.arrays import as_array, as_checked_triangles
from topleft.clusters import Clusters, box_of
from topleft.material import Material

FloatArray = npt.NDArray[np.floating[Any]]
F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Vertices and triangles in object space, with normals and colours per vertex where they are known.

    Parameters
    ----------
    vertices : (V, 3) array_like of real numbers
        Positions; float32 and float64 stay as they are, everything else becomes float64.
    triangles : (T, 3) array_like of integers
        Rows of vertex indices, counter-clockwise seen from outside; kept as int32.
    normals : (V, 3) array_like of real numbers, optional
        Directions, of any length; `None`: not known, `vertex_normals` computes them.
    colors : (V, 3) or (V, 4) array_like of uint8, optional
        sRGB colours, with or without alpha.
    uv : (V, 2) array_like of real numbers, optional
        Where each vertex lies in a texture: u from left to right, v from the bottom up, 0 to 1. Kept as float32. Where
        a texture has a seam, vertices stand twice.
    materials : sequence of Material, optional
        What the triangles are made of.
    material_of_triangle : (T,) array_like of integers, optional
        The row of `materials` that each triangle has; the first unless given.

    Raises
    ------
    ValueError
        If an array has another shape, or a vertex that a triangle uses is not finite.
    TypeError
        If an array holds another kind of number.
    IndexError
        If a triangle names a vertex that does not exist.

    Notes
    -----
    The arrays are read-only views: of the caller's memory where the dtype allows.

    Examples
    --------
    >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    >>> mesh.bounds.tolist()
    [[0.0, 0.0, 0.0], [1.0, 2.0, 0.0]]
    """

    vertices: FloatArray
    triangles: I32
    normals: FloatArray | None = None
    colors: U8 | None = None
    uv: F32 | None = None
    materials: tuple[Material, ...] = ()
    material_of_triangle: I32 | None = None

    def __post_init__(self) -> None:
        vertices = _real_array(self.vertices, "vertices")
        triangles = as_checked_triangles(self.triangles, len(vertices))
        keep = object.__setattr__  # the dataclass is frozen, and its arrays are coerced
        keep(self, "vertices", _read_only(vertices))
        keep(self, "triangles", _read_only(triangles))
        _check_finite(vertices, triangles)
        if self.normals is not None:
            normals = _real_array(self.normals, "normals")
            if len(normals) != len(vertices):
                raise ValueError(f"normals must have shape ({len(vertices)}, 3), got {normals.shape}")
            keep(self, "normals", _read_only(normals))
        if self.colors is not None:
            keep(self, "colors", _read_only(_color_array(self.colors, len(vertices))))
        if self.uv is not None:
            keep(self, "uv", _read_only(_uv_array(self.uv, len(vertices))))
        keep(self, "materials", _material_tuple(self.materials))
        if self.material_of_triangle is not None:
            rows = _material_rows(self.material_of_triangle, len(triangles), len(self.materials))
            keep(self, "material_of_triangle", _read_only(rows))

    def _repr_png_(self) -> bytes | None:
        from topleft.notebook import png_of_mesh  # which imports this module

        return png_of_mesh(self)

    @property
    def bounds(self) -> F64:
        """Lower and upper corner (2, 3) float64 of the box round the triangles; unused vertices do not count.

        Raises
        ------
        ValueError
            If the mesh has no triangles.
        """
        if not len(self.triangles):
            raise ValueError("a mesh without triangles has no bounds")
        used = self.vertices[self.triangles.ravel()]
        return np.stack([used.min(axis=0), used.max(axis=0)]).astype(np.float64)

    def vertex_normals(self) -> FloatArray:
        """Normals (V, 3): those of the mesh where it has them, else angle-weighted ones, float64.

        Returns
        -------
        (V, 3) float
            Read-only. Unit length where computed here, once; (0, 0, 0) for a vertex that no triangle with an area uses.
        """
        if self.normals is not None:
            return self.normals
        return self._computed_normals

    @cached_property
    def vertex_box(self) -> F64:
        """Lowest and highest x, y, z of all finite vertices, (6,) float64; zeros without any."""
        return box_of(self.vertices)

    def note_drawn(self) -> int:
        """Note that there is a picture of the mesh; returns how many there were before."""
        n_drawn: int = self.__dict__.get("_n_drawn", 0)
        self.__dict__["_n_drawn"] = n_drawn + 1
        return n_drawn

    @property
    def has_clusters(self) -> bool:
        """Whether `clusters` have been made."""
        return "clusters" in self.__dict__

    @cached_property
    def clusters(self) -> Clusters:
        """The triangles sorted into clusters, which a view needs only some of; made when it is first asked for.

        That takes about as long as drawing the mesh some twenty times, and keeps a copy of it of about 30 bytes a
        triangle. Meshes that are drawn more than once ask for it themselves: `topleft.choices.pays_to_cluster`.
        """
        return Clusters(self.vertices, self.triangles)

    @cached_property
    def _computed_normals(self) -> FloatArray:
        return _read_only(angle_weighted_normals(self.vertices, self.triangles))

    def __getstate__(self) -> dict[str, Any]:
        """What another process needs: what is computed from it is computed there."""
        return {field.name: self.__dict__[field.name] for field in fields(self)}


def angle_weighted_normals(vertices: FloatArray, triangles: I32) -> F64:
    """Unit normals (V, 3) float64 of a mesh: the faces round a vertex count by the angle they have there.

    Parameters
    ----------
    vertices : (V, 3) float
    triangles : (T, 3) int32, counter-clockwise seen from outside

    Returns
    -------
    (V, 3) float64
        (0, 0, 0) where no face with an area meets the vertex, or where the faces cancel.

    Notes
    -----
    The weight makes the normal independent of how a flat face is cut into triangles, which weights of one a
    triangle, or of its area, do not.

    References
    ----------
    G. Thurmer and C. A. Wuthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1),
    1998.
    """
    a, b, c = _corners(vertices, triangles)
    ab, bc, ca = b - a, c - b, a - c
    area_vectors = np.cross(ca, ab)
    twice_area = np.sqrt(np.einsum("ij,ij->i", area_vectors, area_vectors))
    faces = np.ascontiguousarray(unit_or_zero(area_vectors).T)
    total = np.zeros((3, len(vertices)))
    for corner, (back, onward) in enumerate([(ca, ab), (ab, bc), (bc, ca)]):
        # atan2 keeps its accuracy for needles, where the arc cosine of a rounded quotient loses it.
        angle = np.arctan2(twice_area, -np.einsum("ij,ij->i", back, onward))
        for axis in range(3):
            total[axis] += np.bincount(triangles[:, corner], angle * faces[axis], minlength=len(vertices))
    return unit_or_zero(total.T)


def face_normals(vertices: FloatArray, triangles: I32) -> F64:
    """Unit normals (T, 3) float64 of the triangles, on the side from which they run counter-clockwise.

    (0, 0, 0) for a triangle without area.
    """
    a, b, c = _corners(vertices, triangles)
    return unit_or_zero(np.cross(b - a, c - a))


def unit_or_zero(vectors: F64) -> F64:
    """Vectors (N, 3) scaled to length 1; zero stays zero."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def coincident(*attributes: npt.NDArray[Any]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Groups of rows that are equal in all the attributes, compared exactly.

    Parameters
    ----------
    *attributes : (V, K) arrays
        Positions, say, or positions and colours.

    Returns
    -------
    first : (G,) int
        The lowest row of each group, ascending.
    group : (V,) int
        The group that each row belongs to: `attribute[first][group]` equals `attribute`.
    """
    columns = [column for rows in attributes for column in rows.T]
    order = np.lexsort(columns[::-1])  # stable, so a group starts with its lowest row
    starts = np.zeros(len(order), dtype=bool)
    starts[:1] = True
    for column in columns:
        ordered = column[order]
        starts[1:] |= ordered[1:] != ordered[:-1]
    first_of_row = np.empty(len(order), dtype=np.intp)
    first_of_row[order] = order[starts][np.cumsum(starts) - 1]
    first, group = np.unique(first_of_row, return_inverse=True)
    return first, group


def _corners(vertices: FloatArray, triangles: I32) -> tuple[F64, F64, F64]:
    """Positions (T, 3) of the first, second and third corner of the triangles."""
    points = np.asarray(vertices, dtype=np.float64)
    return points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]


def _real_array(values: npt.ArrayLike, name: str) -> FloatArray:
    array = as_array(name, values)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must hold real numbers, got {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must have shape (V, 3), got {array.shape}")
    native = array.dtype.newbyteorder("=")
    return np.ascontiguousarray(array, native if native in (np.float32, np.float64) else np.float64)


def _color_array(values: npt.ArrayLike, n_vertices: int) -> U8:
    array = as_array("colors", values)
    if array.dtype != np.uint8:
        raise TypeError(f"colors must be uint8, got {array.dtype}")
    if array.ndim != 2 or array.shape[0] != n_vertices or array.shape[1] not in (3, 4):
        raise ValueError(f"colors must have shape ({n_vertices}, 3) or ({n_vertices}, 4), got {array.shape}")
    return np.ascontiguousarray(array)


def _uv_array(values: npt.ArrayLike, n_vertices: int) -> F32:
    array = as_array("uv", values)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"uv must hold real numbers, got {array.dtype}")
    if array.shape != (n_vertices, 2):
        raise ValueError(f"uv must have shape ({n_vertices}, 2), got {array.shape}")
    return np.ascontiguousarray(array, np.float32)


def _material_tuple(values: Iterable[Material]) -> tuple[Material, ...]:
    materials = tuple(values)
    for value in materials:
        if not isinstance(value, Material):
            raise TypeError(f"materials must be of Material, got {type(value).__name__}")
    return materials


def _material_rows(values: npt.ArrayLike, n_triangles: int, n_materials: int) -> I32:
    array = as_array("material_of_triangle", values)
    if array.dtype.kind not in "iu":
        raise TypeError(f"material_of_triangle must hold integers, got {array.dtype}")
    if array.shape != (n_triangles,):
        raise ValueError(f"material_of_triangle must have shape ({n_triangles},), got {array.shape}")
    outside = (array < 0) | (array >= n_materials)
    if outside.any():
        row = int(outside.argmax())
        raise IndexError(f"material_of_triangle[{row}] = {array[row]} must name one of {n_materials} materials")
    return np.ascontiguousarray(array, np.int32)


def _check_finite(vertices: FloatArray, triangles: I32) -> None:
    finite = np.isfinite(vertices)
    if finite.all():
        return
    used = triangles.ravel()
    bad = used[~finite[used].all(axis=1)]
    if len(bad):
        row = int(bad.min())
        raise ValueError(f"vertices[{row}] = {vertices[row].tolist()} must be finite: a triangle uses it")


def _read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view
