"""Clusters: a mesh sorted once, so that a view leaves out what cannot show in it.

In: the vertices and triangles of a mesh in object space, then a view of it. Out: what of them may draw a pixel.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft import _engine
from topleft._base.arrays import bad_triangle
from topleft._base.threads import count_threads, run_parts
from topleft._raster.meshlets import Meshlets

__all__ = ["Backoff", "Clusters", "Survey", "check_rows"]

#: A bound of the error of the vertex stage as a share of the terms that it adds up: four roundings, and the same again
#: for how the bounds themselves are computed, in float64; twice that.
STAGE_ERROR = {np.dtype(np.float32): 2.0**-21, np.dtype(np.float64): 2.0**-49}

#: Pixels around the window that count as inside: more than the snap and the vertex stage move a corner.
MARGIN_PX = 1.0


#: `tl_cluster` of csrc/clusters.h, as far as Python reads it.
RECORD = np.dtype({"names": ["first_triangle", "n_triangles"], "formats": [np.int64, np.int32], "offsets": [96, 112],
                   "itemsize": _engine.CLUSTER_BYTES})  # fmt: skip


class Survey(NamedTuple):
    """Shares of the clusters of a mesh by what a view does with them, hidden or not."""

    outside: float
    turned: float
    """Certain to be culled."""
    back: float
    """Showing their backs: what is closed and not culled hides them."""
    front: float


class Backoff:
    """Exponential back-off: how long a mesh is drawn whole before its clusters are asked again whether they pay.

    After a picture for which they did not, that is not found out for the next two, then four, then eight pictures:
    cameras move little between pictures, and finding out takes 5 % of a small one.
    """

    def __init__(self) -> None:
        self._n_left = self._n_refused = 0

    def is_over(self) -> bool:
        """Tell whether to find out, for one picture more."""
        self._n_left -= 1
        return self._n_left < 0

    def note(self, *, pays: bool) -> None:
        """Note what was found out."""
        self._n_refused = 0 if pays else min(3, self._n_refused + 1)
        self._n_left = 2**self._n_refused if self._n_refused else 0


class Clusters:
    """A mesh in object space, and a copy of it in clusters: few triangles that are neighbours, measured together.

    Attributes
    ----------
    points : ndarray, shape (V, 3), contiguous float32 or float64
        The vertices of the mesh.
    triangles : ndarray of int32, shape (T, 3)
        Its triangles, whose indices have been checked.
    n_pictures : int
        How many pictures of the mesh there have been that might have been drawn in clusters.
    hidden : float
        The share of the clusters in view that the last one hid.
    own_points : ndarray, shape (N, 3)
        The vertices cluster by cluster, those on borders several times, and some rows that may be read past the end.
    """

    def __init__(self, points: NDArray[Any], triangles: NDArray[np.int32], threads: int | None = None) -> None:
        """Sort and measure (V, 3) contiguous points and (T, 3) checked triangles."""
        check_rows(triangles, len(points))
        self.points, self.triangles, self.backoff = points, triangles, Backoff()
        self.n_pictures, self.hidden = 0, 0.0
        n_triangles = len(triangles)
        order: NDArray[np.int32] = np.empty(n_triangles, np.int32)
        keys: NDArray[np.uint32] = np.empty(n_triangles, np.uint32)
        room: NDArray[np.uint64] = np.empty((2, n_triangles), np.uint64)
        _engine.order_triangles(_engine.Source(points), triangles, box_of(points), keys, room, order)
        clusters: NDArray[np.uint8] = np.empty(max(1, n_triangles) * _engine.CLUSTER_BYTES, np.uint8)
        vertices: NDArray[np.int32] = np.empty(3 * n_triangles, np.int32)
        own_corners: NDArray[np.uint8] = np.empty((n_triangles, 3), np.uint8)
        seen: NDArray[np.int32] = np.full(len(points), -1, np.int32)
        n, n_vertices = _engine.cut_clusters(triangles, order, seen, clusters, vertices, own_corners)
        records = clusters[: n * _engine.CLUSTER_BYTES].copy()
        self.own_points = np.zeros((n_vertices + _engine.CLUSTER_TAIL, 3), points.dtype)
        np.take(points, vertices[:n_vertices], axis=0, out=self.own_points[:n_vertices])
        group_boxes: NDArray[np.float64] = np.empty((-(-n // _engine.CLUSTER_GROUP), 6))
        source = _engine.Source(self.own_points)

        def measure(first: int, end: int) -> None:
            first, end = first * _engine.CLUSTER_GROUP, min(end * _engine.CLUSTER_GROUP, n)
            _engine.measure_clusters(source, own_corners, records, group_boxes, first, end)

        run_parts(measure, len(group_boxes), count_threads(threads, n_triangles))
        self.engine = _engine.Clustered(records, group_boxes, own_corners, order)
        self._records, self.order = records, order
        arrays = self.own_points, records, group_boxes, own_corners, order
        self._n_bytes = sum(array.nbytes for array in arrays)

    @cached_property
    def meshlets(self) -> Meshlets:
        """The same triangles in meshlets, made when they are first asked for (`pays_to_grow` in `choices.py`)."""
        check_rows(self.triangles, len(self.points))
        return Meshlets(self)

    def __len__(self) -> int:
        return len(self.engine)

    @property
    def n_bytes(self) -> int:
        """How much memory the copy takes."""
        return self._n_bytes

    @property
    def n_triangles(self) -> int:
        """How many triangles the mesh has."""
        return len(self.triangles)

    def of_triangles(self) -> NDArray[np.int32]:
        """Return which cluster each triangle of the mesh is in, (T,) int32."""
        found: NDArray[np.int32] = np.empty(self.n_triangles, np.int32)
        sizes = self._records.view(RECORD)["n_triangles"]
        found[self.order] = np.repeat(np.arange(len(sizes), dtype=np.int32), sizes)
        return found

    def seen_in(
        self,
        matrix: NDArray[np.float64],
        mesh: _engine.SnappedMesh,
        first: int,
        end: int,
        width: int,
        *,
        is_farthest: bool,
    ) -> _engine.ClusterView:
        """Return what clusters need to know of rows [first, end) of a picture; `matrix`: clip from object."""
        error = STAGE_ERROR[self.points.dtype]
        return _engine.ClusterView(matrix, mesh, first, end - first, width, MARGIN_PX, error, is_farthest)

    def survey(self, seen: _engine.ClusterView, n_most: int) -> Survey:
        """Return what becomes of some clusters, about `n_most`, evenly spread over the mesh."""
        n_of: NDArray[np.int64] = np.zeros(4, np.int64)
        self.engine.survey(seen, max(1, round(len(self) / n_most)), n_of)
        n = max(1, int(n_of.sum()))
        return Survey(*(count / n for count in n_of.tolist()))


def check_rows(triangles: NDArray[np.int32], n_vertices: int) -> None:
    """Raise an error for triangles that have changed since they were checked: a mesh may share the caller's memory."""
    bad_row = _engine.first_bad_row(triangles, n_vertices)
    if bad_row >= 0:
        raise bad_triangle(triangles, bad_row, n_vertices)


def box_of(points: NDArray[Any]) -> NDArray[np.float64]:
    """Return the lowest and the highest of the finite coordinates of each axis, (6,)."""
    if not len(points):
        return np.zeros(6)
    low, high = points.min(axis=0), points.max(axis=0)
    if not np.isfinite([low, high]).all():
        finite = points[np.isfinite(points).all(axis=1)]
        low, high = (finite.min(axis=0), finite.max(axis=0)) if len(finite) else (np.zeros(3), np.zeros(3))
    return np.concatenate([low, high]).astype(np.float64)
