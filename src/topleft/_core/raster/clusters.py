"""Clusters: a mesh sorted once, so that a view leaves out triangles that cannot show in it.

In: the vertices and triangles of a mesh in object space. Out: a copy of them in clusters.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.threads import count_threads, run_parts

#: `tl_cluster` of csrc/clusters/clusters.h.
RECORD = np.dtype([("low", np.float64, 3), ("high", np.float64, 3), ("axis", np.float64, 3), ("cone_cos", np.float64),
                   ("min_area", np.float64), ("min_height", np.float64), ("first_triangle", np.int64),
                   ("first_vertex", np.int64), ("n_triangles", np.int32), ("n_vertices", np.int32)])  # fmt: skip


class Backoff:
    """Exponential back-off: how long a mesh or scene is drawn whole before its clusters are tried again.

    After a picture for which clusters do not pay, the next two, then four, then eight pictures are drawn whole without
    a survey: cameras move little between pictures. Gain where clusters do not pay, AVX2 of a Zen 3: 15 scenes of 20 to
    2,000 instances 1.38 on the median, meshes 1.03, 1.1 to 1.2 below 100,000 triangles in 16x16 and 64x64.
    """

    def __init__(self) -> None:
        self._n_left = self._n_refused = 0

    def is_over(self) -> bool:
        """Tell whether to try the clusters with this picture."""
        self._n_left -= 1
        return self._n_left < 0

    def note(self, *, pays: bool) -> None:
        """Note whether the clusters paid."""
        self._n_refused = 0 if pays else min(3, self._n_refused + 1)
        self._n_left = 2**self._n_refused if self._n_refused else 0


class Clusters:
    """A mesh in object space, and a copy of it in clusters: few triangles that are neighbours, measured together.

    Attributes
    ----------
    points : ndarray, shape (V, 3), contiguous float32 or float64
        The vertices of the mesh.
    triangles : ndarray of int32, shape (T, 3)
        Its triangles, their indices checked.
    own_points : ndarray, shape (N, 3)
        The vertices cluster by cluster, vertices on borders several times, and some rows that may be read past the end.
    n_drawn : int, optional
        Of clusters that are a part of those of the mesh: how many triangles they have. Nothing else draws that part.
    """

    n_drawn: int | None

    def __init__(self, points: NDArray[Any], triangles: NDArray[np.int32], threads: int | None = None) -> None:
        """Sort and measure (V, 3) contiguous points and (T, 3) checked triangles that nobody writes to."""
        found = sort_clusters(points, triangles)
        own_points = np.zeros((len(found.vertices) + engine.CLUSTER_TAIL, 3), points.dtype)
        np.take(points, found.vertices, axis=0, out=own_points[: len(found.vertices)])
        boxes = measure_clusters(own_points, found.corners, found.records, threads)
        self._keep(points, triangles, own_points, found.records, boxes, found.corners, found.order)

    @classmethod
    def of_parts(
        cls,
        own_points: NDArray[Any],
        triangles: NDArray[np.int32],
        records: NDArray[np.uint8],
        boxes: NDArray[np.float64],
        corners: NDArray[np.uint8],
        order: NDArray[np.int32],
        n_drawn: int,
    ) -> Clusters:
        """Return some measured clusters, with `n_drawn` triangles, of a mesh whose points lie cluster by cluster."""
        found = cls.__new__(cls)
        found._keep(own_points[: -engine.CLUSTER_TAIL], triangles, own_points, records, boxes, corners, order)
        found.n_drawn = n_drawn
        return found

    def _keep(
        self,
        points: NDArray[Any],
        triangles: NDArray[np.int32],
        own_points: NDArray[Any],
        records: NDArray[np.uint8],
        boxes: NDArray[np.float64],
        corners: NDArray[np.uint8],
        order: NDArray[np.int32],
    ) -> None:
        self.points, self.triangles, self.backoff = points, triangles, Backoff()
        self.own_points, self._records, self.order = own_points, records, order
        self.engine, self.n_drawn = engine.Clustered(records, boxes, corners, order), None

    def __len__(self) -> int:
        return len(self.engine)

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


class SortedClusters(NamedTuple):
    """Triangles in clusters that are not measured yet."""

    records: NDArray[np.uint8]
    """`tl_cluster` of ``csrc/clusters/clusters.h``, one after the other."""
    vertices: NDArray[np.int32]
    """(N,) the vertices of the mesh cluster by cluster, vertices on borders several times."""
    corners: NDArray[np.uint8]
    """(T, 3) the corners of the triangles among the vertices of their cluster."""
    order: NDArray[np.int32]
    """(T,) which triangle of the mesh each is."""


def sort_clusters(points: NDArray[Any], triangles: NDArray[np.int32]) -> SortedClusters:
    """Return the triangles of a mesh sorted into clusters."""
    n = len(triangles)
    order: NDArray[np.int32] = np.empty(n, np.int32)
    keys: NDArray[np.uint32] = np.empty(n, np.uint32)
    room: NDArray[np.uint64] = np.empty((2, n), np.uint64)
    engine.order_triangles(engine.Source(points), triangles, box_of(points), keys, room, order)
    clusters: NDArray[np.uint8] = np.empty(max(1, n) * engine.CLUSTER_BYTES, np.uint8)
    vertices: NDArray[np.int32] = np.empty(3 * n, np.int32)
    corners: NDArray[np.uint8] = np.empty((n, 3), np.uint8)
    seen: NDArray[np.int32] = np.full(len(points), -1, np.int32)
    n_clusters, n_vertices = engine.cut_clusters(triangles, order, seen, clusters, vertices, corners)
    return SortedClusters(clusters[: n_clusters * engine.CLUSTER_BYTES].copy(), vertices[:n_vertices], corners, order)


def measure_clusters(
    own_points: NDArray[Any], corners: NDArray[np.uint8], records: NDArray[np.uint8], threads: int | None = None
) -> NDArray[np.float64]:
    """Measure clusters, and return the boxes of each `CLUSTER_GROUP` of them, (N, 6)."""
    n = len(records) // engine.CLUSTER_BYTES
    boxes: NDArray[np.float64] = np.empty((-(-n // engine.CLUSTER_GROUP), 6))
    source = engine.Source(own_points)

    def measure(first: int, end: int) -> None:
        first, end = first * engine.CLUSTER_GROUP, min(end * engine.CLUSTER_GROUP, n)
        engine.measure_clusters(source, corners, records, boxes, first, end)

    run_parts(measure, len(boxes), count_threads(threads, len(corners)))
    return boxes


def box_of(points: NDArray[Any]) -> NDArray[np.float64]:
    """Return the lowest and the highest of the finite coordinates of each axis, (6,)."""
    if not len(points):
        return np.zeros(6)
    low, high = points.min(axis=0), points.max(axis=0)
    if not np.isfinite([low, high]).all():
        finite = points[np.isfinite(points).all(axis=1)]
        low, high = (finite.min(axis=0), finite.max(axis=0)) if len(finite) else (np.zeros(3), np.zeros(3))
    return np.concatenate([low, high]).astype(np.float64)
