"""Parts of levels: pieces of the surface that choose their levels separately, and the mesh of the chosen parts.

In: a mesh and its levels, the triangles of each in the order of its parts. Out: a mesh of parts of several levels.

A part of a level replaces several neighbouring parts of the level before; their vertices on the border to other parts
are not collapsed. So parts of different levels share the vertices along their borders, and fit.

Based on: P. Cignoni, F. Ganovelli, E. Gobbetti, F. Marton, F. Ponchio, R. Scopigno, "Batched Multi Triangulation",
2005; B. Karis, R. Stubbe, G. Wihlidal, "Nanite: A Deep Dive", 2021 (groups with locked sides, chosen by their error).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I32
from topleft._core.base.cached import cached_property
from topleft._core.raster.clusters import RECORD, Clusters, box_of, measure_clusters, sort_clusters
from topleft._meshes.model.cache import MeshCache
from topleft._meshes.model.mesh import Mesh, read_only, with_normals

#: About the triangles of a part of the mesh itself. Of hills of a million within half a pixel, seen from near, views
#: draw 200,000 triangles; of parts of 1,000 they draw 150,000, but whole levels have up to 1.8 times as many.
OF_PART = 4096

#: Parts that a part of the next level replaces: a level has a quarter of the triangles, so parts stay as large.
JOINED = 4

#: Meshes of fewer triangles have levels of a single part: to choose parts takes longer than it saves.
LEAST_PARTED = 500_000

#: The radius of spheres that bound nothing: the extents of parts are boxes only.
NO_SPHERE = 1e300

#: The arrays of a mesh with a row for each vertex.
OF_VERTICES = ("vertices", "normals", "colors", "uv", "uv1")


@dataclass(frozen=True, eq=False)
class Parts:
    """The parts of each level, the mesh itself first, and their distances from the mesh."""

    order: I32  # (T,): the triangles of the mesh, part by part; other levels are stored part by part
    starts: tuple[npt.NDArray[np.int64], ...]  # (N + 1,): the first triangle of each part of a level, and the end
    bounds: tuple[F64, ...]
    """(N,): upper bounds of the Hausdorff distance of each part from the part of the mesh that it replaces."""


def parts_of_arrays(array: Callable[[str], Any], meshes: Sequence[Mesh]) -> Parts | None:
    """Return the parts of a mesh and its levels from the arrays of a file, by their names, after checking them.

    None where the file has no parts.
    """
    order = array("order")
    if order is None:
        return None
    starts = tuple(array(f"starts_{i}") for i in range(len(meshes)))
    bounds = tuple(array(f"bounds_{i}") for i in range(len(meshes)))
    n = len(meshes[0].triangles)
    if not (is_whole_row(order) and ((order >= 0) & (order < n)).all()):
        raise ValueError("order must hold rows of triangles")
    ends = [len(order), *(len(mesh.triangles) for mesh in meshes[1:])]
    n_before = 0
    for rows, errors, end in zip(starts, bounds, ends, strict=True):
        if not (
            is_whole_row(rows) and len(rows) > 1 and rows[0] == 0 and rows[-1] == end and (np.diff(rows) > 0).all()
        ):
            raise ValueError("parts must hold all triangles of their level, each at least one")
        n_parts = len(rows) - 1
        if n_before and (n_before < n_parts or n_before % n_parts):
            raise ValueError("parts must stand for as many of the level before")
        is_row = errors is not None and errors.shape == (n_parts,) and errors.dtype == np.float64
        if not is_row or not (np.isfinite(errors) & (errors >= 0)).all():
            raise ValueError("bounds of parts must be finite and at least 0")
        n_before = n_parts
    return Parts(order, starts, bounds)


def is_whole_row(array: npt.NDArray[Any] | None) -> bool:
    """Return whether an array has one axis and holds integers."""
    return array is not None and array.ndim == 1 and array.dtype in (np.int32, np.int64)


def sort_in_parts(points: F64, triangles: I32, n_joins: int) -> tuple[I32, npt.NDArray[np.int64]]:
    """Return triangles sorted into parts of equal size, and where parts begin; each JOINED parts are neighbours.

    J. L. Bentley, "Multidimensional Binary Search Trees Used for Associative Searching", 1975.
    """
    middles = points[triangles[:, 0]] + points[triangles[:, 1]] + points[triangles[:, 2]]
    parts: list[npt.NDArray[np.int64]] = [np.arange(len(triangles))]
    for _ in range(n_joins * (JOINED.bit_length() - 1)):  # halves every part
        halves = []
        for part in parts:
            middles_of_part = middles[part]
            axis = int(np.ptp(middles_of_part, axis=0).argmax()) if len(part) else 0
            along = part[np.argsort(middles_of_part[:, axis], kind="stable")]
            halves += [np.sort(along[: len(part) // 2]), np.sort(along[len(part) // 2 :])]
        parts = halves
    starts = np.cumsum([0, *map(len, parts)])
    return np.concatenate(parts).astype(np.int32), starts.astype(np.int64)


class Pool(NamedTuple):
    """The parts of all levels one after the other, first of the mesh itself; each part is sorted into clusters."""

    arrays: dict[str, npt.NDArray[Any]]
    """The arrays of a mesh by their names; vertices lie cluster by cluster."""
    corners: npt.NDArray[np.uint8]
    """(T, 3) among the vertices of the cluster of each triangle."""
    records: npt.NDArray[Any]
    """The clusters, dtype `RECORD`, measured."""
    starts: npt.NDArray[np.int64]
    """(N + 1, 3): where the vertices, the triangles and the clusters of each part begin."""
    padded_points: npt.NDArray[Any]
    """The vertices, and rows of padding that clusters may read."""


def pool_of(meshes: Sequence[Mesh], parts: Parts) -> Pool:
    """Return a mesh and its levels in parts; where they have no normals, with the normals of shading."""
    columns = []
    for i, mesh in enumerate(meshes):
        source = mesh if mesh.normals is not None or mesh.is_faceted else with_normals(mesh)
        order = parts.order if i == 0 else np.arange(len(source.triangles))
        columns += [sorted_part(source, order[first:end]) for first, end in pairwise(parts.starts[i].tolist())]
    arrays = {name: np.concatenate([part[name] for part in columns]) for name in columns[0]}
    corners, records = arrays.pop("corners"), arrays.pop("records")
    sizes = np.array([(len(part["vertices"]), len(part["corners"]), len(part["records"])) for part in columns])
    starts = np.concatenate([np.zeros((1, 3), np.int64), np.cumsum(sizes, axis=0)])
    records["first_vertex"] += np.repeat(starts[:-1, 0], sizes[:, 2])
    records["first_triangle"] += np.repeat(starts[:-1, 1], sizes[:, 2])
    first_vertices = np.repeat(records["first_vertex"], records["n_triangles"])
    arrays["triangles"] = (corners + first_vertices[:, None]).astype(np.int32)
    n = len(arrays["vertices"])
    points = np.zeros((n + engine.CLUSTER_TAIL, 3), arrays["vertices"].dtype)
    points[:n] = arrays["vertices"]
    arrays["vertices"] = points[:n]
    if meshes[0].normals is None and "normals" in arrays:
        arrays["normals"] = arrays["normals"].astype(np.float32)
    measure_clusters(points, corners, records.view(np.uint8))
    return Pool({name: read_only(array) for name, array in arrays.items()}, corners, records, starts, points)


def sorted_part(source: Mesh, rows: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    """Return the triangles `rows` of a mesh in clusters: the arrays of a mesh by their names, corners and records."""
    used, compact = np.unique(source.triangles[rows], return_inverse=True)
    clusters = sort_clusters(source.vertices[used], compact.reshape(-1, 3).astype(np.int32))
    of_vertex = used[clusters.vertices]
    arrays = {name: getattr(source, name) for name in OF_VERTICES}
    arrays = {name: array[of_vertex] for name, array in arrays.items() if array is not None}
    if source.material_of_triangle is not None:
        arrays["material_of_triangle"] = source.material_of_triangle[rows][clusters.order]
    return arrays | {"corners": clusters.corners, "records": clusters.records.view(RECORD)}


class CutMesh(Mesh):
    """A mesh of chosen parts: its arrays hold the parts of all levels, and only the chosen parts are drawn.

    What draws it reads `clusters` where clusters may be drawn, otherwise `drawn_triangles`.
    """

    is_in_parts = True

    def note_drawn(self) -> int:
        """Return 0: each picture has a new mesh."""
        return 0

    def find_clusters(self) -> Clusters:
        """The clusters of the chosen parts: `triangles` would draw the parts of all levels."""
        return self.clusters

    def is_drawn_whole(self) -> bool:
        """Return False: `triangles` holds the parts of all levels."""
        return False

    @property
    def drawn_triangles(self) -> I32:
        """The triangles (T, 3); the triangles of parts that are not chosen are degenerate, all corners 0."""
        triangles = np.zeros_like(self.triangles)
        for first, end in self.__dict__["_runs"]:
            triangles[first:end] = self.triangles[first:end]
        return triangles

    @property
    def n_drawn(self) -> int:
        """How many triangles the chosen parts have."""
        return sum(end - first for first, end in self.__dict__["_runs"])

    def as_mesh(self) -> Mesh:
        """The mesh with `triangles` that are computed at the first read."""
        mesh = object.__new__(LateMesh)
        fields_of_cut = {field.name: vars(self)[field.name] for field in fields(Mesh) if field.name != "triangles"}
        vars(mesh).update(fields_of_cut, _cut=self)
        return mesh

    def __reduce__(self) -> Any:
        """Pickle as a plain mesh, without parts."""
        return self.as_mesh().__reduce__()


class LateMesh(Mesh):
    """A mesh of the `drawn_triangles` of a `CutMesh`, which are computed at the first read."""

    @cached_property
    def triangles(self) -> I32:
        """The triangles (T, 3)."""
        return read_only(self.__dict__["_cut"].drawn_triangles)

    def __reduce__(self) -> Any:
        """Pickle as a plain mesh."""
        return Mesh, tuple(getattr(self, field.name) for field in fields(Mesh))


class PartedMesh:
    """The levels of a mesh in parts, from which `choose` selects for a view."""

    def __init__(self, meshes: Sequence[Mesh], parts: Parts) -> None:
        """Pool the parts of a mesh and its levels."""
        self._pool, like = pool_of(meshes, parts), meshes[0]
        self._counts = np.array([len(bounds) for bounds in parts.bounds], np.int64)
        self._bounds = np.concatenate(parts.bounds)
        self._extents = extents_of(self._pool, self._counts.tolist())
        self._order = np.arange(len(self._pool.corners), dtype=np.int32)
        defaults = {field.name: None for field in fields(Mesh)}
        look = {name: getattr(like, name) for name in ("materials", "crease", "color_interpolation", "up")}
        points = self._pool.arrays["vertices"]
        shared = {"cache": MeshCache(), "vertex_box": box_of(points), "is_finite": bool(np.isfinite(points).all())}
        self._of_all = defaults | look | self._pool.arrays | shared

    def choose(self, matrix: F64, viewport: tuple[int, int], window: F64, tolerance: float) -> tuple[I32, float]:
        """Return the coarsest parts that are surely within a tolerance, and a bound of their error in pixels."""
        chosen = np.empty(int(self._counts[0]), np.int32)
        how = matrix, viewport, window, self._extents, self._bounds, self._counts, tolerance, chosen
        n, off = engine.choose_parts(*how)
        return np.sort(chosen[:n]), off

    def n_triangles(self, chosen: I32) -> int:
        """Return how many triangles the chosen parts have."""
        return int((self._pool.starts[chosen + 1, 1] - self._pool.starts[chosen, 1]).sum())

    def levels(self, chosen: I32) -> npt.NDArray[np.intp]:
        """Return the level of each part."""
        return np.searchsorted(np.cumsum(self._counts), chosen, side="right")

    def bound(self, chosen: I32) -> float:
        """Return how far parts may lie from the mesh."""
        return float(self._bounds[chosen].max())

    def mesh(self, chosen: I32) -> CutMesh:
        """Return the mesh of sorted parts."""
        is_last = np.diff(chosen, append=-1) != 1
        firsts, ends = chosen[np.roll(is_last, 1)], chosen[is_last] + 1  # runs of neighbours
        _, triangles, clusters = (
            np.stack([self._pool.starts[firsts, k], self._pool.starts[ends, k]], axis=1).tolist() for k in range(3)
        )
        records = np.concatenate([self._pool.records[first:end] for first, end in clusters])
        groups = np.arange(0, len(records), engine.CLUSTER_GROUP)
        boxes = [np.minimum.reduceat(records["low"], groups), np.maximum.reduceat(records["high"], groups)]
        mesh = object.__new__(CutMesh)
        vars(mesh).update(self._of_all, _runs=triangles)
        arrays = records.view(np.uint8), np.concatenate(boxes, axis=1), self._pool.corners, self._order
        vars(mesh)["clusters"] = Clusters.of_parts(self._pool.padded_points, mesh.triangles, *arrays, mesh.n_drawn)
        return mesh


def extents_of(pool: Pool, counts: Sequence[int]) -> F64:
    """Return the extent (N, 10), as of `Level` but without a sphere, of each part with all parts that it replaces."""
    points, firsts = pool.arrays["vertices"].astype(np.float64), pool.starts[:-1, 0]
    boxes = np.concatenate([-np.minimum.reduceat(points, firsts), np.maximum.reduceat(points, firsts)], axis=1)
    first = 0
    for n, n_next in pairwise(counts):
        of_next = boxes[first : first + n].reshape(n_next, -1, 6).max(axis=1)
        first += n
        np.maximum(boxes[first : first + n_next], of_next, out=boxes[first : first + n_next])
    rest = np.broadcast_to([0.0, 0.0, 0.0, NO_SPHERE], (len(boxes), 4))
    return np.concatenate([-boxes[:, :3], boxes[:, 3:], rest], axis=1)
