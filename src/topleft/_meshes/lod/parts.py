"""Parts of levels: pieces of the surface with levels of their own, and the mesh that a view puts together from them.

In: a mesh and its levels, the triangles of each in the order of its parts. Out: a mesh of parts of several levels.

A part of a level stands for several parts of the level before it, side by side; where these meet other parts, their
vertices stay when it is made. So parts of different levels have the vertices along their sides in common, and fit.

Based on: P. Cignoni, F. Ganovelli, E. Gobbetti, F. Marton, F. Ponchio, R. Scopigno, "Batched Multi Triangulation",
2005; B. Karis, R. Stubbe, G. Wihlidal, "Nanite: A Deep Dive", 2021 (groups with locked sides, chosen by their error).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I32
from topleft._core.raster.clusters import RECORD, Clusters, box_of, measure_clusters, sort_clusters
from topleft._meshes.model.cache import MeshCache
from topleft._meshes.model.mesh import Mesh, read_only, with_normals

#: Triangles of a part of the mesh itself, about. Of hills of a million within half a pixel, seen from near, views
#: draw 200,000 triangles; of parts of 1,000 they draw 150,000, but whole levels have up to 1.8 times as many.
OF_PART = 4096

#: Parts that one of the next level stands for: its level has a quarter of the triangles, so parts stay as large.
JOINED = 4

#: Meshes of fewer triangles have levels of one part: what draws them takes less than a look at parts saves.
LEAST_PARTED = 500_000

#: Half a side of a sphere round parts that says nothing: their boxes tell where they are.
NO_SPHERE = 1e300

#: The attributes of a mesh that its vertices have.
OF_VERTICES = ("vertices", "normals", "colors", "uv", "uv1")


@dataclass(frozen=True, eq=False)
class Parts:
    """Where the parts of each level lie, the mesh itself first, and their distances from it."""

    order: I32  # (T,): the triangles of the mesh, part by part; those of other levels are in order
    starts: tuple[npt.NDArray[np.int64], ...]  # (N + 1,): where those of each part of a level begin, the last ends
    bounds: tuple[F64, ...]
    """(N,): no point of a part, nor of the part of the mesh that it stands for, is farther than that from the other."""


def parts_of_arrays(array: Callable[[str], Any], meshes: Sequence[Mesh]) -> Parts | None:
    """Return the parts of a mesh and its levels from the arrays of a file, by their names, after checking them.

    None where it has none.
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
    for own, own_bounds, end in zip(starts, bounds, ends, strict=True):
        if not (is_whole_row(own) and len(own) > 1 and own[0] == 0 and own[-1] == end and (np.diff(own) > 0).all()):
            raise ValueError("parts must hold all triangles of their level, each at least one")
        n_parts = len(own) - 1
        if n_before and (n_before < n_parts or n_before % n_parts):
            raise ValueError("parts must stand for as many of the level before")
        is_row = own_bounds is not None and own_bounds.shape == (n_parts,) and own_bounds.dtype == np.float64
        if not is_row or not (np.isfinite(own_bounds) & (own_bounds >= 0)).all():
            raise ValueError("bounds of parts must be finite and at least 0")
        n_before = n_parts
    return Parts(order, starts, bounds)


def is_whole_row(array: npt.NDArray[Any] | None) -> bool:
    """Tell whether an array is one row of whole numbers."""
    return array is not None and array.ndim == 1 and array.dtype in (np.int32, np.int64)


def sort_in_parts(points: F64, triangles: I32, n_joins: int) -> tuple[I32, npt.NDArray[np.int64]]:
    """Return triangles in the order of parts that are as large, and where these begin; joined ones are neighbours.

    J. L. Bentley, "Multidimensional Binary Search Trees Used for Associative Searching", 1975.
    """
    middles = points[triangles[:, 0]] + points[triangles[:, 1]] + points[triangles[:, 2]]
    parts: list[npt.NDArray[np.int64]] = [np.arange(len(triangles))]
    for _ in range(n_joins * (JOINED.bit_length() - 1)):  # each time into halves
        halves = []
        for part in parts:
            own = middles[part]
            axis = int(np.ptp(own, axis=0).argmax()) if len(part) else 0
            along = part[np.argsort(own[:, axis], kind="stable")]
            halves += [np.sort(along[: len(part) // 2]), np.sort(along[len(part) // 2 :])]
        parts = halves
    starts = np.cumsum([0, *map(len, parts)])
    return np.concatenate(parts).astype(np.int32), starts.astype(np.int64)


class Pool(NamedTuple):
    """The parts of all levels one after the other, those of the mesh itself first, each in clusters of its own."""

    arrays: dict[str, npt.NDArray[Any]]
    """Those of a mesh by their names; vertices lie cluster by cluster."""
    corners: npt.NDArray[np.uint8]
    """(T, 3) among the vertices of the cluster of each triangle."""
    records: npt.NDArray[Any]
    """The clusters, as `RECORD` reads them, measured."""
    starts: npt.NDArray[np.int64]
    """(N + 1, 3): where the vertices, the triangles and the clusters of each part begin."""
    own_points: npt.NDArray[Any]
    """The vertices, and rows behind them that clusters may read."""


def pool_of(meshes: Sequence[Mesh], parts: Parts) -> Pool:
    """Return a mesh and its levels in parts; where they have no normals, with those that they would be lit with."""
    columns = []
    for i, mesh in enumerate(meshes):
        source = mesh if mesh.normals is not None or mesh.is_faceted else with_normals(mesh)
        order = parts.order if i == 0 else np.arange(len(source.triangles))
        columns += [sorted_part(source, order[first:end]) for first, end in pairwise(parts.starts[i].tolist())]
    arrays = {name: np.concatenate([own[name] for own in columns]) for name in columns[0]}
    corners, records = arrays.pop("corners"), arrays.pop("records")
    sizes = np.array([(len(own["vertices"]), len(own["corners"]), len(own["records"])) for own in columns])
    starts = np.concatenate([np.zeros((1, 3), np.int64), np.cumsum(sizes, axis=0)])
    records["first_vertex"] += np.repeat(starts[:-1, 0], sizes[:, 2])
    records["first_triangle"] += np.repeat(starts[:-1, 1], sizes[:, 2])
    first_vertices = np.repeat(records["first_vertex"], records["n_triangles"])
    arrays["triangles"] = (corners + first_vertices[:, None]).astype(np.int32)
    n = len(arrays["vertices"])
    own_points = np.zeros((n + engine.CLUSTER_TAIL, 3), arrays["vertices"].dtype)
    own_points[:n] = arrays["vertices"]
    arrays["vertices"] = own_points[:n]
    if meshes[0].normals is None and "normals" in arrays:
        arrays["normals"] = arrays["normals"].astype(np.float32)
    measure_clusters(own_points, corners, records.view(np.uint8))
    return Pool({name: read_only(array) for name, array in arrays.items()}, corners, records, starts, own_points)


def sorted_part(source: Mesh, rows: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    """Return some triangles of a mesh in clusters: the arrays of a mesh by their names, corners and records."""
    own, compact = np.unique(source.triangles[rows], return_inverse=True)
    found = sort_clusters(source.vertices[own], compact.reshape(-1, 3).astype(np.int32))
    of_vertex = own[found.vertices]
    arrays = {name: getattr(source, name) for name in OF_VERTICES}
    arrays = {name: array[of_vertex] for name, array in arrays.items() if array is not None}
    if source.material_of_triangle is not None:
        arrays["material_of_triangle"] = source.material_of_triangle[rows][found.order]
    return arrays | {"corners": found.corners, "records": found.records.view(RECORD)}


class CutMesh(Mesh):
    """Parts of several levels that fit: all arrays are those of all parts, and what is drawn are the chosen ones.

    Each verb that draws it finds out here which: clusters where these may be drawn, else `drawn_triangles`.
    """

    is_in_parts = True

    def note_drawn(self) -> int:
        """Count nothing: each picture has a mesh that is cut for its view."""
        return 0

    def find_clusters(self) -> Clusters:
        """Those of the chosen parts, always: without them all parts would have to be looked at."""
        return self.clusters

    def is_drawn_whole(self) -> bool:
        """No picture is."""
        return False

    @property
    def drawn_triangles(self) -> I32:
        """Its triangles (T, 3); those of other parts have one corner three times, and cover nothing."""
        triangles = np.zeros_like(self.triangles)
        for first, end in self.__dict__["_runs"]:
            triangles[first:end] = self.triangles[first:end]
        return triangles

    @property
    def n_drawn(self) -> int:
        """How many triangles its parts have."""
        return sum(end - first for first, end in self.__dict__["_runs"])

    def as_mesh(self) -> Mesh:
        """The cut as a mesh whose triangles are made when something reads them."""
        mesh = object.__new__(LateMesh)
        own = {field.name: vars(self)[field.name] for field in fields(Mesh) if field.name != "triangles"}
        vars(mesh).update(own, _cut=self)
        return mesh

    def __reduce__(self) -> Any:
        """For another process, which knows no parts."""
        return self.as_mesh().__reduce__()


class LateMesh(Mesh):
    """A mesh of the triangles that a `CutMesh` draws, and of triangles that cover nothing, made when they are read."""

    @cached_property
    def triangles(self) -> I32:
        """The triangles (T, 3)."""
        return read_only(self.__dict__["_cut"].drawn_triangles)

    def __reduce__(self) -> Any:
        """For another process: a mesh like any other."""
        return Mesh, tuple(getattr(self, field.name) for field in fields(Mesh))


class PartedMesh:
    """The levels of a mesh in parts, as views choose from them."""

    def __init__(self, meshes: Sequence[Mesh], parts: Parts) -> None:
        """Take the mesh and its levels apart."""
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
        """Return the coarsest parts that are sure to be within a tolerance, and the most pixels that they are off."""
        chosen = np.empty(int(self._counts[0]), np.int32)
        given = matrix, viewport, window, self._extents, self._bounds, self._counts, tolerance, chosen
        n, off = engine.choose_parts(*given)
        return np.sort(chosen[:n]), off

    def n_triangles(self, chosen: I32) -> int:
        """Return how many triangles some parts have."""
        return int((self._pool.starts[chosen + 1, 1] - self._pool.starts[chosen, 1]).sum())

    def levels(self, chosen: I32) -> npt.NDArray[np.intp]:
        """Return the level of each part."""
        return np.searchsorted(np.cumsum(self._counts), chosen, side="right")

    def bound(self, chosen: I32) -> float:
        """Return how far parts may lie from the mesh."""
        return float(self._bounds[chosen].max())

    def mesh(self, chosen: I32) -> CutMesh:
        """Return sorted parts as one mesh."""
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
        vars(mesh)["clusters"] = Clusters.of_parts(self._pool.own_points, mesh.triangles, *arrays, mesh.n_drawn)
        return mesh


def extents_of(pool: Pool, counts: Sequence[int]) -> F64:
    """Return the extent (N, 10) of each part and of all that it stands for, as that of a `Level`: a box alone."""
    points, firsts = pool.arrays["vertices"].astype(np.float64), pool.starts[:-1, 0]
    boxes = np.concatenate([-np.minimum.reduceat(points, firsts), np.maximum.reduceat(points, firsts)], axis=1)
    first = 0
    for n, n_next in pairwise(counts):
        of_next = boxes[first : first + n].reshape(n_next, -1, 6).max(axis=1)
        first += n
        np.maximum(boxes[first : first + n_next], of_next, out=boxes[first : first + n_next])
    rest = np.broadcast_to([0.0, 0.0, 0.0, NO_SPHERE], (len(boxes), 4))
    return np.concatenate([-boxes[:, :3], boxes[:, 3:], rest], axis=1)
