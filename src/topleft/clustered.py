"""Drawing clusters: a view takes what it needs of a mesh from vertices to pixels, cluster by cluster.

In: `Clusters`, a view, a target. Out: the same picture that the whole mesh gives, and the scene that attributes need.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from topleft import _engine, choices
from topleft.arrays import as_matrix
from topleft.clusters import Clusters
from topleft.memory import FreshMemory, Memory
from topleft.models import Sink
from topleft.threads import run_parts
from topleft.view import View

__all__ = ["ClusterScene"]

#: Vertices that are snapped together when some of them are needed: whole vectors.
VERTEX_BLOCK = 16


@dataclass(frozen=True, slots=True)
class ClusterScene:
    """A clustered mesh behind a view with a `transform`."""

    clusters: Clusters
    view: View
    first_id: int = 0

    @property
    def _matrix(self) -> NDArray[np.floating]:
        return as_matrix(self.view.transform, self.clusters.points.dtype)  # type: ignore[arg-type]

    def draw(
        self, memory: Memory, sink: Sink, target: _engine.Target, *, is_first: bool = True, is_last: bool = True
    ) -> bool:
        """Draw into a target that the first of several scenes clears and the last one finishes.

        Returns False, with the target in any state, where a vertex does not fit or is not finite: the whole mesh is
        then to be drawn, which tells why.
        """
        view, clusters, matrix = self.view, self.clusters, self._matrix
        height, n_triangles = view.size[1], clusters.n_triangles
        engine_view = view.engine_view()
        source = _engine.Source(clusters.own_points, matrix, choices.is_affine(matrix))
        n_parts = min(height, choices.threads_to_draw(view, n_triangles))
        may_be_hidden = sink in (Sink.NEAREST, Sink.FARTHEST)
        rooms: NDArray[np.int32] = memory.empty("others", (n_parts, n_triangles + 1), np.int32)
        how = self._empty_scene(source, engine_view)

        def draw_rows(first: int, end: int) -> tuple[int, int]:
            seen = clusters.view_of_rows(matrix, view, first, end, is_farthest=sink is Sink.FARTHEST)
            listed = clusters.survivors(seen)
            row = next(free)
            n_others, _ = clusters.engine.draw(
                how, source, engine_view, seen, listed, may_be_hidden, target, first, end - first, rooms[row],
                is_first, is_last,
            )  # fmt: skip
            return row, n_others

        free = iter(range(n_parts))
        found = [rooms[row, :n] for row, n in run_parts(draw_rows, height, n_parts)]
        others = np.unique(np.concatenate(found))
        if not len(others):
            return True
        scene = self.part(others, memory)
        if scene is None:
            return False

        def draw_others(first: int, end: int) -> None:
            scene.draw_listed(target, first, end - first, others, is_last)

        run_parts(draw_others, height, n_parts)
        return True

    def _empty_scene(self, source: _engine.Source, engine_view: _engine.View) -> _engine.Scene:
        return self._scene(source, np.empty(0, np.uint8), self.clusters.corners[:0], None, engine_view)

    def _scene(
        self,
        source: _engine.Source,
        records: NDArray[np.uint8],
        corners: NDArray[np.int32],
        pieces: _engine.Pieces | None,
        engine_view: _engine.View,
    ) -> _engine.Scene:
        view = self.view
        how = (*view.origin, view.grid_bits, view.cull, view.method, view.test)
        scene = _engine.Scene(source, records, None, corners, pieces, *how, engine_view)
        return scene.numbered_from(self.first_id) if self.first_id else scene

    def part(self, triangles: NDArray[np.int32], memory: Memory | None = None) -> _engine.Scene | None:
        """Return the mesh with the vertices that some triangles use snapped, and no others.

        `triangles` ascend. None where a vertex does not fit or is not finite.
        """
        points, corners, matrix = self.clusters.points, self.clusters.corners, self._matrix
        engine_view = self.view.engine_view()
        source = _engine.Source(points, matrix, choices.is_affine(matrix))
        is_used: NDArray[np.uint8] = np.zeros(len(points) // VERTEX_BLOCK + 1, np.uint8)
        is_used[corners[triangles].ravel() // VERTEX_BLOCK] = 1
        n_bytes = len(points) * _engine.VERTEX_BYTES
        records: NDArray[np.uint8] = (memory or FreshMemory()).empty("records", (n_bytes,), np.uint8)
        bad, wide, clipped = source.project_blocks(is_used, VERTEX_BLOCK, engine_view, records)
        if bad or wide:
            return None
        pieces = _engine.Pieces(source, records, corners, engine_view, triangles) if clipped else None
        return self._scene(source, records, corners, pieces, engine_view)
