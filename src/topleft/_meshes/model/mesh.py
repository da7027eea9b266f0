"""A triangle mesh as arrays: positions, indices, attributes and materials; checked once, here.

Input: anything NumPy can read. Output: a `Mesh` whose arrays the other stages use as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, F64, I32, U8
from topleft._core.base.arrays import as_array, as_checked_triangles, as_crease, set_read_only, shown
from topleft._core.base.cached import cached_property
from topleft._core.base.options import parse
from topleft._core.raster import choices
from topleft._core.raster.clusters import Clusters, box_of
from topleft._meshes.model.cache import MeshCache
from topleft._meshes.model.material import Material
from topleft._meshes.model.normals import CornerNormals, angle_weighted_normals, box_of_triangles, creased_normals
from topleft._meshes.model.texture import Texture
from topleft.typing import EncodingOption, UpOption

FloatArray = npt.NDArray[np.floating[Any]]

NO_CREASE = 180.0
"""The crease angle at which no edge is sharp, degrees."""

POINTS_AT_ONCE = 1 << 14
"""Points whose distances are computed together: they stay in the second-level cache."""


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
        sRGB colours, with or without alpha, which blends where a mesh has no materials, or materials that blend.
    uv : (V, 2) array_like of real numbers, optional
        Where each vertex lies in a texture: u from left to right, v from the bottom up, 0 to 1. Kept as float32. Where
        a texture has a seam, vertices stand twice.
    materials : sequence of Material, optional
        The materials of the triangles.
    material_of_triangle : (T,) array_like of integers, optional
        The row of `materials` that each triangle has; the first unless given.
    uv1 : (V, 2) array_like of real numbers, optional
        A second set of texture coordinates, for textures with `uv_set=1`.
    crease : float
        Degrees, 0 to 180: where two triangles bend by more at an edge, each side has its own normal, so that the edge
        is sharp; of a mesh without `normals`. 180: no edge is; 0: every one is ("flat"). With less than 180 vertices
        at one place count as one for the normals.
    color_interpolation : {"srgb", "linear"}
        Whether colours are linear between vertices in their sRGB numbers, or in their light, as glTF has it.
    up : {"y", "z"}
        The axis that points up in views of the mesh for which nothing else is asked.

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
    Vertices, normals, colours and uv are read-only views of the caller's memory where the dtype allows. Do not change
    it while the mesh lives: computed values are kept. Triangles are copied, unless the array and the owner of its
    memory are read-only.

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
    uv1: F32 | None = None
    crease: float = NO_CREASE
    color_interpolation: EncodingOption = "srgb"
    up: UpOption = "y"

    is_in_parts: ClassVar[bool] = False
    """Whether only some of the triangles are drawn, see `drawn_triangles`."""

    if TYPE_CHECKING:  # anything that NumPy reads may be given; the types above are kept

        def __init__(
            self,
            vertices: npt.ArrayLike,
            triangles: npt.ArrayLike,
            normals: npt.ArrayLike | None = None,
            colors: npt.ArrayLike | None = None,
            uv: npt.ArrayLike | None = None,
            materials: Iterable[Material] | Material = (),
            material_of_triangle: npt.ArrayLike | None = None,
            uv1: npt.ArrayLike | None = None,
            crease: float = NO_CREASE,
            color_interpolation: EncodingOption = "srgb",
            up: UpOption = "y",
        ) -> None: ...

    def __post_init__(self) -> None:
        vertices = as_real_array(self.vertices, "vertices")
        triangles = as_checked_triangles(self.triangles, len(vertices))
        keep = object.__setattr__  # the dataclass is frozen, and its arrays are coerced
        keep(self, "vertices", read_only(vertices))
        keep(self, "triangles", read_only(triangles))
        _check_finite(vertices, triangles)
        if self.normals is not None:
            normals = as_real_array(self.normals, "normals")
            if len(normals) != len(vertices):
                raise ValueError(f"normals must have shape ({len(vertices)}, 3), got {normals.shape}")
            keep(self, "normals", read_only(normals))
        if self.colors is not None:
            keep(self, "colors", read_only(as_color_array(self.colors, len(vertices))))
        for name in ("uv", "uv1"):
            if getattr(self, name) is not None:
                keep(self, name, read_only(_uv_array(name, getattr(self, name), len(vertices))))
        keep(self, "crease", as_crease(self.crease))
        parse(EncodingOption, "color_interpolation", self.color_interpolation)
        parse(UpOption, "up", self.up)
        keep(self, "materials", _material_tuple(self.materials))
        if self.material_of_triangle is not None:
            rows = _material_rows(self.material_of_triangle, len(triangles), len(self.materials))
            keep(self, "material_of_triangle", read_only(rows))

    def __repr__(self) -> str:
        """One line: numbers of vertices and triangles, attributes and materials."""
        words = [f"{len(self.vertices):,} vertices", f"{len(self.triangles):,} triangles"]
        words += [name for name in ("normals", "colors", "uv") if getattr(self, name) is not None]
        words += [f"{len(self.materials)} material{'s' * (len(self.materials) > 1)}"] if self.materials else []
        return f"Mesh({', '.join(words)})"

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
        return box_of_triangles(self.vertices, self.triangles)

    def extreme_points(self) -> F64:
        """Vertices in use (7, 3), float64, which have the box and the bounding sphere of all; found once.

        Raises
        ------
        ValueError
            If the mesh has no triangles.
        """
        if not len(self.triangles):
            raise ValueError("a mesh without triangles has no bounds")
        return self._extreme_points

    @cached_property
    def _extreme_points(self) -> F64:
        used = used_vertices(self)
        return read_only(extreme_points(lambda: used))

    def vertex_normals(self) -> FloatArray:
        """Normals (V, 3): those of the mesh where it has them, else angle-weighted ones, float64.

        Returns
        -------
        (V, 3) float
            Read-only. Unit length where computed here, once, of all triangles at the vertex, whatever the crease angle;
            (0, 0, 0) for a vertex that no triangle with an area uses.
        """
        if self.normals is not None:
            return self.normals
        return self._computed_normals[0]

    def corner_normals(self) -> CornerNormals | None:
        """Normals of the corners of triangles, where some differ from those of their vertices; else None.

        Returns
        -------
        CornerNormals or None
            `rows` (N, 3) float64, the first V those of `vertex_normals`, and `of_corner` (T, 3) int32, the row of
            each corner. None for a mesh with normals, with a crease angle of 180, or without an edge that is sharp.
        """
        return self._computed_normals[1] if self.normals is None else None

    @property
    def is_faceted(self) -> bool:
        """Whether every edge is sharp: each triangle has the normal of its face."""
        return self.normals is None and self.crease == 0

    @cached_property
    def has_alpha(self) -> bool:
        """Whether the colours of the vertices are not all opaque."""
        return self.colors is not None and self.colors.shape[1] == 4 and bool((self.colors[:, 3] < 255).any())

    def single_sided(self, material: Material | None = None) -> npt.NDArray[np.uint8] | None:
        """Which triangles (T,) have a back that does not show, by their material or by this one; None if none."""
        materials = self.materials if material is None else (material,)
        if all(one.double_sided for one in materials):
            return None
        rows = self.material_of_triangle if material is None else None
        if rows is None:
            is_single = not materials[0].double_sided
            return np.ones(len(self.triangles), np.uint8) if is_single else None
        return np.array([not one.double_sided for one in materials], np.uint8)[rows]

    @cached_property
    def vertex_box(self) -> F64:
        """Lowest and highest x, y, z of all finite vertices, (6,) float64; zeros without any."""
        return box_of(self.vertices)

    @cached_property
    def is_finite(self) -> bool:
        """Whether all vertices are finite."""
        return bool(np.isfinite(self.vertices).all())

    @property
    def drawn_triangles(self) -> I32:
        """The triangles (T, 3) as pictures have them: all."""
        return self.triangles

    def note_drawn(self) -> int:
        """Note that there is a picture of the mesh; returns how many there were before."""
        self.cache.n_drawn += 1
        return self.cache.n_drawn - 1

    def find_clusters(self) -> Clusters | None:
        """The clusters, from the second picture of a large mesh on; a call counts as a picture."""
        is_large = choices.pays_to_cluster(len(self.triangles), 1)
        return self.clusters if is_large and self.note_drawn() else None

    def is_drawn_whole(self) -> bool:
        """Whether this picture needs no look at the clusters: there are none, or they have not paid lately."""
        clusters = self.find_clusters()
        if clusters is None:
            return True
        return not clusters.backoff.is_over()

    @cached_property
    def cache(self) -> MeshCache:
        """Values computed for its next pictures."""
        return MeshCache()

    @property
    def has_clusters(self) -> bool:
        """Whether `clusters` have been made."""
        return "clusters" in self.__dict__

    @cached_property
    def clusters(self) -> Clusters:
        """The triangles sorted into clusters, so that a view draws only some; made at the first use.

        That takes about as long as drawing the mesh some twenty times, and keeps a copy of it of about 30 bytes a
        triangle. Meshes that are drawn more than once ask for it themselves:
        `pays_to_cluster` in `_core/raster/choices.py`.
        """
        return Clusters(self.vertices, self.triangles)

    @cached_property
    def _computed_normals(self) -> tuple[FloatArray, CornerNormals | None]:
        if self.crease == NO_CREASE:
            return read_only(angle_weighted_normals(self.vertices, self.triangles)), None
        first, group = self._places
        places = None if len(first) == len(group) else (first, group)
        rows, of_corners = creased_normals(self.vertices, self.triangles, self.crease, places)
        return read_only(rows), of_corners

    @cached_property
    def _places(self) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Which vertices are at one place, as `coincident` says it."""
        return coincident(self.vertices)

    def __getstate__(self) -> dict[str, Any]:
        """The state for another process, which computes the rest itself."""
        return {field.name: self.__dict__[field.name] for field in fields(self)}

    __setstate__ = set_read_only


def trusted_mesh(vertices: FloatArray, triangles: I32) -> Mesh:
    """A mesh of arrays that were checked when they were made."""
    mesh = object.__new__(Mesh)
    vars(mesh).update(vertices=vertices, triangles=triangles)
    return mesh


def keep_corner_normals(mesh: Mesh, normals: CornerNormals) -> None:
    """Have a mesh without normals take these instead of computing them."""
    mesh.__dict__["_computed_normals"] = read_only(normals.rows[: len(mesh.vertices)]), normals


def with_normals(mesh: Mesh) -> Mesh:
    """The mesh with `normals`: computed where it has none; vertices at creases then stand several times."""
    corners = mesh.corner_normals()
    if corners is None:
        return mesh if mesh.normals is not None else replace(mesh, normals=mesh.vertex_normals())
    rows = np.concatenate([np.arange(len(mesh.vertices)), corners.vertex_of_row])
    colors, uv, uv1 = (None if own is None else own[rows] for own in (mesh.colors, mesh.uv, mesh.uv1))
    split: dict[str, Any] = {"vertices": mesh.vertices[rows], "triangles": corners.of_corner, "normals": corners.rows}
    return replace(mesh, **split, colors=colors, uv=uv, uv1=uv1)


def used_vertices(mesh: Mesh) -> FloatArray:
    """The vertices (N, 3) that triangles use, each once, in their order and precision."""
    is_used = np.zeros(len(mesh.vertices), np.bool_)
    is_used[mesh.triangles.ravel()] = True
    return mesh.vertices if is_used.all() else mesh.vertices[is_used]


def extreme_points(*parts: Callable[[], FloatArray]) -> F64:
    """A few points (7 P, 3), float64, which have the box and the bounding sphere of all of P parts (N, 3), N > 0.

    Each part returns its points, twice: one part is in memory at a time. Of each there are the two ends along each
    axis, and the point farthest from the centre of the box of all parts.
    """
    # column by column: NumPy takes twenty times as long along rows of three
    ends = np.concatenate([_ends(part()) for part in parts]).astype(np.float64)
    center = ends.min(axis=0) / 2 + ends.max(axis=0) / 2
    return np.concatenate([ends, [_farthest(part(), center) for part in parts]])


def _ends(points: FloatArray) -> FloatArray:
    """The first of the points that lie farthest out along each axis, (6, 3)."""
    return points[[int(end(points[:, axis])) for end in (np.argmin, np.argmax) for axis in range(3)]]


def _farthest(points: FloatArray, center: F64) -> FloatArray:
    """The first of the points that are farthest from a centre."""
    row, most = 0, -1.0
    for first in range(0, len(points), POINTS_AT_ONCE):
        own = points[first : first + POINTS_AT_ONCE].astype(np.float64)
        x, y, z = ((own[:, axis] - center[axis]) ** 2 for axis in range(3))
        squared = x + y + z
        k = int(squared.argmax())
        if squared[k] > most:
            row, most = first + k, float(squared[k])
    return points[row].copy()  # a view would keep all of them


def coincident(*attributes: npt.NDArray[Any]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Groups of rows that are equal in all the attributes, (V, K) arrays, compared exactly.

    Returns the lowest row of each group, ascending, (G,) int, and the group that each row belongs to, (V,) int:
    `attribute[first][group]` equals `attribute`.
    """
    groups = _groups_by_hash(attributes)
    if groups is not None:
        return groups
    columns = [column for rows in attributes for column in rows.T]
    order, starts = _runs_by_value(columns)
    lowest = np.minimum.reduceat(order, np.flatnonzero(starts)) if len(order) else order
    first_of_row = np.empty(len(order), dtype=np.intp)
    first_of_row[order] = lowest[np.cumsum(starts) - 1]
    is_first = first_of_row == np.arange(len(order))
    return np.flatnonzero(is_first), (np.cumsum(is_first) - 1)[first_of_row]


def _groups_by_hash(
    attributes: tuple[npt.NDArray[Any], ...],
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]] | None:
    """First rows and groups of equal rows, by their bits, in a sixth of the time; None if some are not numbers."""
    n = len(attributes[0])
    if not 0 < n < 1 << 30 or any(rows.dtype.kind == "f" and np.isnan(rows).any() for rows in attributes):
        return None
    words = [_words(rows) for rows in attributes]
    rows = words[0] if len(words) == 1 else np.concatenate(words, axis=1)
    table_bits = max(4, (2 * n - 1).bit_length())
    table = np.full(1 << table_bits, -1, np.int32)
    first, group = np.empty(n, np.int32), np.empty(n, np.int32)
    n_groups = engine.group_rows(rows, table_bits, table, first, group)
    return None if n_groups < 0 else (first[:n_groups].astype(np.intp), group.astype(np.intp))


def _words(rows: npt.NDArray[Any]) -> npt.NDArray[np.uint32]:
    """The rows (V, K) as words (V, W) that are equal where the rows are."""
    if rows.dtype.kind == "f":
        wide = rows.astype(np.float64 if rows.itemsize > 4 else np.float32, order="C", copy=False) + 0  # -0.0 is 0.0
    elif rows.dtype == np.uint8 and rows.shape[1] == 4:
        wide = np.ascontiguousarray(rows)
    else:
        wide = rows.astype(np.int64, order="C")
    return wide.view(np.uint32)


def _runs_by_value(columns: list[npt.NDArray[Any]]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Rows in an order in which equal ones follow each other, and where runs of them begin."""
    order = np.lexsort(columns[::-1])
    return order, _differ(columns, order)


def _differ(columns: list[npt.NDArray[Any]], order: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """Which rows, in an order, differ from the one before."""
    starts = np.zeros(len(order), dtype=bool)
    starts[:1] = True
    for column in columns:
        ordered = column[order]
        starts[1:] |= ordered[1:] != ordered[:-1]
    return starts


def as_real_array(values: npt.ArrayLike, name: str) -> FloatArray:
    array = as_array(name, values)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must hold real numbers, got {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must have shape (V, 3), got {array.shape}")
    native = array.dtype.newbyteorder("=")
    return np.ascontiguousarray(array, native if native in (np.float32, np.float64) else np.float64)


def as_color_array(values: npt.ArrayLike, n_vertices: int) -> U8:
    array = as_array("colors", values)
    if array.dtype != np.uint8:
        raise TypeError(f"colors must be uint8, got {array.dtype}")
    if array.ndim != 2 or array.shape[0] != n_vertices or array.shape[1] not in (3, 4):
        raise ValueError(f"colors must have shape ({n_vertices}, 3) or ({n_vertices}, 4), got {array.shape}")
    return np.ascontiguousarray(array)


def _uv_array(name: str, values: npt.ArrayLike, n_vertices: int) -> F32:
    array = as_array(name, values)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must hold real numbers, got {array.dtype}")
    if array.shape != (n_vertices, 2):
        raise ValueError(f"{name} must have shape ({n_vertices}, 2), got {array.shape}")
    return np.ascontiguousarray(array, np.float32)


def _material_tuple(values: Iterable[Material]) -> tuple[Material, ...]:
    if isinstance(values, Material):
        return (values,)
    if not isinstance(values, Iterable) or isinstance(values, np.ndarray):
        raise TypeError(f"materials must be a sequence of Material, got {shown(values)}")
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
    array = array.copy()  # nobody changes a copy after the check
    outside = (array < 0) | (array >= n_materials)
    if outside.any():
        row = int(outside.argmax())
        raise IndexError(f"material_of_triangle[{row}] = {array[row]} must name one of {n_materials} materials")
    return array.astype(np.int32)


def _check_finite(vertices: FloatArray, triangles: I32) -> None:
    finite = np.isfinite(vertices)
    if finite.all():
        return
    used = triangles.ravel()
    bad = used[~finite[used].all(axis=1)]
    if len(bad):
        row = int(bad.min())
        raise ValueError(f"vertices[{row}] = {vertices[row].tolist()} must be finite: a triangle uses it")


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view


def has_holes(material: Material, mesh: Mesh) -> bool:
    """Whether the material cuts holes into its triangles."""
    return material.alpha_mode == "mask" and bool(material.alpha_cutoff) and has_opacity(material, mesh)


def has_opacity(material: Material, mesh: Mesh) -> bool:
    """Whether some of the surface may not be opaque: by the material, its texture, or the colours of the vertices."""
    texture = material.texture if is_laid(material.texture, mesh) else None
    return material.opacity < 1 or mesh.has_alpha or (texture is not None and texture.has_alpha)


def is_laid(texture: Texture | None, mesh: Mesh) -> bool:
    """Whether there is a texture, and the mesh has its set of uv."""
    return texture is not None and (mesh.uv, mesh.uv1)[texture.uv_set] is not None
