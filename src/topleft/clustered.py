"""Drawing clusters: a view takes what it needs of a mesh from vertices to pixels, cluster by cluster.

In: `Clusters`, a view, a target. Out: the same picture that the whole mesh gives, and the scene that attributes need.
"""

from __future__ import annotations

from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft import _engine, choices
from topleft.arrays import as_matrix
from topleft.clusters import Clusters
from topleft.memory import FreshMemory, Memory
from topleft.models import Sink
from topleft.snapped import snap_scene
from topleft.threads import run_parts
from topleft.view import View

__all__ = ["ClusteredScene"]

#: Vertices that are snapped together when some of them are needed: whole vectors.
VERTEX_BLOCK = 16

NO_RECORDS: NDArray[np.uint8] = np.empty(0, np.uint8)


class ClusteredScene:
    """A mesh in clusters behind a view with a `transform`; triangle 0 is called `first_id` where it is drawn."""

    def __init__(self, clusters: Clusters, view: View, first_id: int = 0) -> None:
        self.clusters, self._view, self._first_id = clusters, view, first_id
        self._matrix = as_matrix(view.transform, clusters.points.dtype)  # type: ignore[arg-type]
        self._is_affine = choices.is_affine(self._matrix)
        self._engine_view = view.engine_view()
        self._own = self._source_of(clusters.own_points)
        self._empty = self._scene_of(self._own, NO_RECORDS, clusters.corners[:0], None)

    def draw(
        self, memory: Memory, sink: Sink, target: _engine.Target, *, is_first: bool = True, is_last: bool = True
    ) -> bool:
        """Draw into a target that the first of several scenes clears and the last one finishes.

        Returns False, with the target in any state, where a vertex does not fit or is not finite: the whole mesh is
        then to be drawn, which tells why.
        """
        clusters, (width, height) = self.clusters, self._view.size
        n_parts = min(height, choices.threads_to_draw(self._view, clusters.n_triangles))
        rooms: NDArray[np.int32] = memory.empty("others", (n_parts, clusters.n_triangles + 1), np.int32)
        exact = self._matrix.astype(np.float64)
        may_be_hidden, numbers = sink in (Sink.NEAREST, Sink.FARTHEST), count()

        def draw_rows(first: int, end: int) -> NDArray[np.int32]:
            seen = clusters.seen_in(exact, self._empty, first, end, width, is_farthest=sink is Sink.FARTHEST)
            room, listed, place = rooms[next(numbers)], clusters.survivors(seen), (target, first, end - first)
            how = self._empty, self._own, seen, listed, may_be_hidden
            return room[: clusters.engine.draw(*how, *place, room, is_first, is_last)[0]]

        others = [found for found in run_parts(draw_rows, height, n_parts) if len(found)]
        return not others or self._draw_others(memory, np.unique(np.concatenate(others)), target, n_parts, is_last)

    def _draw_others(
        self, memory: Memory, triangles: NDArray[np.int32], target: _engine.Target, n_parts: int, is_last: bool
    ) -> bool:
        """Draw triangles that the planes of clip space may cut over what is there; returns as `draw` does."""
        scene = self._part(triangles, memory)
        if scene is None:
            return False

        def draw_rows(first: int, end: int) -> None:
            scene.draw_listed(target, first, end - first, triangles, is_last)

        run_parts(draw_rows, self._view.size[1], n_parts)
        return True

    def part(self, triangles: NDArray[np.int32]) -> _engine.Scene:
        """Return the mesh with the vertices that some triangles use snapped, and seldom all; `triangles` ascend."""
        scene = self._part(triangles, FreshMemory())
        if scene is None:  # a vertex beside one of them, which need not be used, does not fit
            points, corners = self.clusters.points, self.clusters.corners
            snapped = snap_scene(FreshMemory(), points, corners, self._view, with_depth=True, out=None)
            return snapped.scene
        return scene

    def _part(self, triangles: NDArray[np.int32], memory: Memory) -> _engine.Scene | None:
        points, corners = self.clusters.points, self.clusters.corners
        source = self._source_of(points)
        is_used: NDArray[np.uint8] = np.zeros(len(points) // VERTEX_BLOCK + 1, np.uint8)
        is_used[corners[triangles].ravel() // VERTEX_BLOCK] = 1
        records: NDArray[np.uint8] = memory.empty("records", (len(points) * _engine.VERTEX_BYTES,), np.uint8)
        bad, wide, clipped = source.project_blocks(is_used, VERTEX_BLOCK, self._engine_view, records)
        if bad or wide:
            return None
        pieces = _engine.Pieces(source, records, corners, self._engine_view, triangles) if clipped else None
        return self._scene_of(source, records, corners, pieces)

    def _source_of(self, points: NDArray[Any]) -> _engine.Source:
        return _engine.Source(points, self._matrix, self._is_affine)

    def _scene_of(
        self,
        source: _engine.Source,
        records: NDArray[np.uint8],
        corners: NDArray[np.int32],
        pieces: _engine.Pieces | None,
    ) -> _engine.Scene:
        view = self._view
        how = (*view.origin, view.grid_bits, view.cull, view.method, view.test)
        scene = _engine.Scene(source, records, None, corners, pieces, *how, self._engine_view)
        return scene.numbered_from(self._first_id)
