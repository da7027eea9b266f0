"""Draws clusters: takes what a view shows of a mesh from vertices to pixels, cluster by cluster.

In: `Clusters`, a view, a target. Out: the picture that the whole mesh gives, and what attributes need, snapped.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft import _engine
from topleft._base.arrays import as_matrix, bad_triangle
from topleft._base.memory import FRESH, Memory
from topleft._base.options import Sink
from topleft._base.threads import run_parts
from topleft._raster import choices
from topleft._raster.clusters import Clusters, Survey, check_rows
from topleft._raster.snap import snap_mesh
from topleft._raster.view import View

__all__ = ["ClusteredMesh", "draw_clustered"]

#: Clusters that tell what a view shows of all: 5 microseconds.
SURVEYED = 50

#: Clusters that tell how much a picture hides: 40 microseconds. With 50 the share of a ball is off by 0.1.
SURVEYED_BEHIND = 200

NO_RECORDS: NDArray[np.uint8] = np.empty(0, np.uint8)


class ClusteredMesh:
    """A mesh in clusters behind a view with a `transform`; triangle 0 is called `first_id` where it is drawn."""

    def __init__(self, clusters: Clusters, view: View, first_id: int = 0) -> None:
        self.clusters, self._view, self._first_id = clusters, view, first_id
        self._matrix = as_matrix(view.transform, clusters.points.dtype)  # type: ignore[arg-type]
        self._exact = self._matrix.astype(np.float64)
        self._is_affine = choices.is_affine(self._matrix)
        self._viewport = view.engine_viewport()
        self._own = self._source_of(clusters.own_points)
        self._empty = self._snapped(self._own, NO_RECORDS, clusters.triangles[:0], None)

    def survey(self, n_most: int = SURVEYED) -> Survey:
        """Return what becomes of the clusters, by some of them: outside, turned away, and so on."""
        (width, height), clusters = self._view.size, self.clusters
        seen = clusters.seen_in(self._exact, self._empty, 0, height, width, is_farthest=False)
        return clusters.survey(seen, n_most)

    def draw_rows(
        self,
        memory: Memory,
        target: _engine.Target,
        first: int,
        end: int,
        *,
        sample: tuple[int, int] = (0, 0),
        is_first: bool = True,
        is_last: bool = True,
    ) -> NDArray[np.int32]:
        """Draw rows [first, end) of a target that the first of several meshes clears and the last one finishes.

        Returns the triangles that are still to be drawn: the planes of clip space may cut them, or they do not fit.
        """
        others, _ = self._draw_rows(memory, target, first, end, sample, is_first=is_first, is_last=is_last)
        return others

    def count_drawn(self, sink: Sink) -> int:
        """Return how many clusters the picture draws, by one thread: those that are not left out, nor hidden."""
        width, height = self._view.size
        ids: NDArray[np.int32] = np.empty((height, width), np.int32)
        target = _engine.Target(sink, ids, np.empty((height, width), np.float32), None)
        return self._draw_rows(FRESH, target, 0, height, (0, 0), is_first=True, is_last=True)[1]

    def _draw_rows(
        self,
        memory: Memory,
        target: _engine.Target,
        first: int,
        end: int,
        sample: tuple[int, int],
        *,
        is_first: bool,
        is_last: bool,
    ) -> tuple[NDArray[np.int32], int]:
        """Return what is still to be drawn, and how many clusters were."""
        clusters = self.clusters
        empty = self._empty if sample == (0, 0) else self._empty.seen_from(*sample)
        is_farthest = target.sink == Sink.FARTHEST
        seen = clusters.seen_in(self._exact, empty, first, end, self._view.size[0], is_farthest=is_farthest)
        room: NDArray[np.int32] = memory.empty("clusters", (3 * len(clusters) + 1,), np.int32)
        others: NDArray[np.int32] = memory.empty("others", (clusters.n_triangles + 1,), np.int32)
        may_be_hidden = is_farthest or target.sink == Sink.NEAREST
        place = target, first, end - first, room, others
        n_others, _, n_drawn = clusters.engine.draw(empty, self._own, seen, may_be_hidden, *place, is_first, is_last)
        return others[:n_others].copy(), n_drawn

    def hidden_share(self, target: _engine.Target, n_most: int = SURVEYED_BEHIND) -> float:
        """Return the share of the clusters that the picture may show which lie behind what a target holds, by some."""
        (width, height), clusters = self._view.size, self.clusters
        is_farthest = target.sink == Sink.FARTHEST
        seen = clusters.seen_in(self._exact, self._empty, 0, height, width, is_farthest=is_farthest)
        n, n_hidden = clusters.engine.count_hidden(self._empty, seen, target, max(1, round(len(clusters) / n_most)))
        return n_hidden / max(1, n)

    def draw_meshlets(self, memory: Memory, target: _engine.Target, n_parts: int) -> bool:
        """Clear a target and draw the mesh from meshlets, as `draw_clustered` does from clusters."""
        (width, height), clusters = self._view.size, self.clusters
        is_farthest = target.sink == Sink.FARTHEST
        seen = clusters.seen_in(self._exact, self._empty, 0, height, width, is_farthest=is_farthest)
        meshlets = clusters.meshlets
        drawn = _engine.MeshletPass(meshlets.engine, self._empty, self._own, seen, target)
        parts = meshlets.draw(memory, drawn, clusters.n_triangles, height, n_parts, is_first=True)
        if not any(map(len, parts)):
            return True
        return draw_others([memory] * n_parts, self, np.unique(np.concatenate(parts)), target, height, (0, 0))

    def part(self, *triangles: NDArray[np.int32]) -> _engine.SnappedMesh:
        """Return the mesh with what some triangles use snapped, maybe more; -1 is no triangle."""
        points, own, view = self.clusters.points, self.clusters.triangles, self._view
        mesh = None
        if choices.pays_to_snap_all(len(points), view.size[0] * view.size[1]):
            mesh = self.try_part(None, FRESH)
        if mesh is None:
            mesh = self.try_part(triangles, FRESH)
        if mesh is None:  # a vertex beside one of them, which need not be used, does not fit
            mesh = snap_mesh(FRESH, points, own, view, with_depth=True, out=None).mesh
        return mesh

    def try_part(self, triangles: Sequence[NDArray[np.int32]] | None, memory: Memory) -> _engine.SnappedMesh | None:
        """Return the mesh with what some triangles use snapped; None where a vertex does not fit or is not finite.

        Without triangles: with all vertices snapped, or None where a clip plane may cut a triangle, too.
        """
        points, own = self.clusters.points, self.clusters.triangles
        source = self._source_of(points)
        is_used: NDArray[np.uint8] = np.full(len(points) // _engine.BLOCK + 1, triangles is None, np.uint8)
        ids = [np.ascontiguousarray(array, np.int32).ravel() for array in triangles or ()]
        for array in ids:
            bad_row = _engine.mark_vertices(array, own, len(points), is_used)
            if bad_row >= 0:  # the caller has written into the triangles of the mesh
                raise bad_triangle(own, bad_row, len(points))
        if triangles is None:
            check_rows(own, len(points))
        records: NDArray[np.uint8] = memory.empty("records", (len(points) * _engine.VERTEX_BYTES,), np.uint8)
        bad, wide, clipped = source.project_blocks(is_used, self._viewport, records)
        if bad or wide or (clipped and triangles is None):
            return None
        pieces = None
        if clipped:
            cut = np.empty(sum(map(len, ids)), np.int32)
            n_cut = 0
            for array in ids:
                n_cut += _engine.list_cut(array, own, records, cut[n_cut:])
            pieces = _engine.Pieces(source, records, own, self._viewport, np.unique(cut[:n_cut]))
        return self._snapped(source, records, own, pieces, is_used)

    def _source_of(self, points: NDArray[Any]) -> _engine.Source:
        return _engine.Source(points, self._matrix, self._is_affine)

    def _snapped(
        self,
        source: _engine.Source,
        records: NDArray[np.uint8],
        triangles: NDArray[np.int32],
        pieces: _engine.Pieces | None,
        is_used: NDArray[np.uint8] | None = None,
    ) -> _engine.SnappedMesh:
        how, viewport = self._view.how, self._viewport
        mesh = _engine.SnappedMesh(source, records, None, triangles, pieces, how, viewport, is_used)
        return mesh.numbered_from(self._first_id)


def draw_clustered(
    memories: Sequence[Memory],
    meshes: Sequence[ClusteredMesh],
    target: _engine.Target,
    height: int,
    sample: tuple[int, int] = (0, 0),
) -> bool:
    """Clear a target and draw meshes, a thread for each memory.

    Returns False, with the target in any state, where a vertex does not fit or is not finite: the whole meshes are then
    to be drawn, which tells why.
    """
    n_parts, last = min(height, len(memories)), len(meshes) - 1

    def draw_rows(i: int, _: int) -> list[NDArray[np.int32]]:
        rows = height * i // n_parts, height * (i + 1) // n_parts
        return [
            mesh.draw_rows(memories[i], target, *rows, sample=sample, is_first=k == 0, is_last=k == last)
            for k, mesh in enumerate(meshes)
        ]

    found = zip(*run_parts(draw_rows, n_parts, n_parts), strict=True)
    for mesh, parts in zip(meshes, found, strict=True):
        if not any(map(len, parts)):
            continue
        others = np.unique(np.concatenate(parts))
        if not draw_others(memories, mesh, others, target, height, sample):
            return False
    return True


def draw_others(
    memories: Sequence[Memory],
    mesh: ClusteredMesh,
    triangles: NDArray[np.int32],
    target: _engine.Target,
    height: int,
    sample: tuple[int, int],
) -> bool:
    """Draw some triangles of a mesh over what is there; returns as `draw_clustered` does."""
    part = mesh.try_part([triangles], memories[0])
    if part is None:
        return False
    seen = part.seen_from(*sample)

    def draw_rows(first: int, end: int) -> None:
        seen.draw_listed(target, first, end - first, triangles, True)

    run_parts(draw_rows, height, min(height, len(memories)))
    return True
