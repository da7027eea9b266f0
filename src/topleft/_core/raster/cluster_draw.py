"""Draws clusters: takes the visible part of a mesh from vertices to pixels, cluster by cluster.

In: `Clusters`, a view, a target. Out: the picture of the whole mesh, and its snapped triangles for attributes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.arrays import refuse_rows
from topleft._core.base.memory import FRESH, Memory
from topleft._core.base.options import Sink
from topleft._core.base.threads import count_threads, run_parts
from topleft._core.raster import choices
from topleft._core.raster.clusters import Clusters
from topleft._core.raster.snap import snap_mesh, source_of
from topleft._core.raster.view import View

#: A bound of the error of the vertex stage as a share of the terms that it adds up: four roundings, and the same again
#: for how the bounds themselves are computed, in float64; twice that.
STAGE_ERROR = {np.dtype(np.float32): 2.0**-21, np.dtype(np.float64): 2.0**-49}

#: Pixels around the window that count as inside: more than the snap and the vertex stage move a corner.
MARGIN_PX = 1.0

#: Clusters that are looked at to estimate the visibility of all: 5 microseconds. The choice gains 1.12 on the median
#: beside meshes that are always drawn whole, 1.1 to 4.5 where half of the mesh is out of view; beside meshes that are
#: always drawn from clusters 1.02, 1.2 to 1.4 for culled ones in full view, 64x64 (40 views, AVX2 of a Zen 3).
SURVEYED = 50

#: Clusters that tell the same of a picture of several samples, which depends on how many triangles lie in view a pixel,
#: and vertices that tell how many lie beyond the near and far planes: 20 microseconds each.
SURVEYED_OF_SAMPLES = 200

NO_RECORDS: NDArray[np.uint8] = np.empty(0, np.uint8)
NO_TRIANGLES: NDArray[np.int32] = np.empty((0, 3), np.int32)


class Survey(NamedTuple):
    """Shares of the clusters of a mesh by their visibility in a view, hidden or not."""

    outside: float
    turned: float
    """Certain to be culled."""
    back: float
    """Showing their backs: a closed mesh that is not culled hides them."""
    front: float


class BoxView:
    """Boxes behind a view with a `transform`, round points of the type of `points`."""

    def __init__(self, points: NDArray[Any], view: View, first_id: int = 0) -> None:
        self._view, self._first_id, self._viewport = view, first_id, view.engine_viewport()
        self._own, self._dtype = source_of(points, view), points.dtype
        self._empty = self._snapped(self._own, NO_RECORDS, NO_TRIANGLES, None)

    def seen(
        self, sink: int, sample: tuple[int, int], rows: tuple[int, int] | None = None
    ) -> tuple[engine.ClusterView, engine.SnappedMesh]:
        """Return the view of boxes in some rows of the picture, or all, and a mesh as a sample sees it."""
        empty = self._empty.at_sample(*sample)
        first, end = rows or (0, self._view.size[1])
        return self._seen(sink, first, end, empty), empty

    def _seen(
        self, sink: int, first: int = 0, end: int | None = None, empty: engine.SnappedMesh | None = None
    ) -> engine.ClusterView:
        """Return the view of clusters in rows [first, end) of the picture, or all; `empty`: of a sample."""
        width, height = self._view.size
        n_rows, how = (height if end is None else end) - first, (MARGIN_PX, STAGE_ERROR[self._dtype])
        return engine.ClusterView(self._own, empty or self._empty, first, n_rows, width, *how, sink)

    def _snapped(
        self,
        source: engine.Source,
        records: NDArray[np.uint8],
        triangles: NDArray[np.int32],
        pieces: engine.Pieces | None,
        is_used: NDArray[np.uint8] | None = None,
    ) -> engine.SnappedMesh:
        how, viewport = self._view.raster_state, self._viewport
        mesh = engine.SnappedMesh(source, records, None, triangles, pieces, how, viewport, is_used)
        return mesh.numbered_from(self._first_id)


class ClusteredMesh(BoxView):
    """A mesh in clusters behind a view with a `transform`; triangle 0 is called `first_id` where it is drawn."""

    def __init__(self, clusters: Clusters, view: View, first_id: int = 0) -> None:
        super().__init__(clusters.own_points, view, first_id)
        self.clusters = clusters

    def survey(self, n_most: int = SURVEYED, sample: tuple[int, int] = (0, 0)) -> Survey:
        """Return the visibility of the clusters at a sample, by about `n_most` of them, evenly spread over the mesh."""
        n_of: NDArray[np.int64] = np.zeros(4, np.int64)
        seen = self._seen(Sink.NEAREST, empty=self._empty.at_sample(*sample))
        self.clusters.engine.survey(seen, max(1, round(len(self.clusters) / n_most)), n_of)
        n = max(1, int(n_of.sum()))
        return Survey(*(count / n for count in n_of.tolist()))

    def share_clipped(self) -> float:
        """Return the share of the vertices that lie beyond the near or far plane or the eye, by some of them."""
        view, points = self._view, self.clusters.points
        matrix = np.asarray(view.transform, np.float64)
        some = points[:: max(1, len(points) // SURVEYED_OF_SAMPLES)].astype(np.float64)
        z, w = (engine.product(some, matrix[2:, :3].T) + matrix[2:, 3]).T
        is_before = z < (0.0 if view.zero_to_one else -w) if view.near_clip else w <= 0
        is_beyond = (is_before | (z > w)) if view.far_clip else is_before
        return float(is_beyond.mean()) if len(some) else 0.0

    def pays(self) -> bool:
        """Tell whether a picture of the mesh is drawn from its clusters, and let them note that."""
        clusters = self.clusters
        if clusters.n_drawn is not None:
            return True
        survey = self.survey(SURVEYED_OF_SAMPLES if self._view.sampling.n_samples > 1 else SURVEYED)
        pays = choices.pays_to_draw_from_clusters(self._view, clusters.n_triangles, survey, self.share_clipped)
        clusters.backoff.note(pays=pays)
        return pays

    def draw(self, memory: Memory, target: engine.Target, sample: tuple[int, int] = (0, 0)) -> bool:
        """Clear a target and draw the mesh; returns as `draw_clustered` does.

        `sample`: where in a pixel it is sampled, in sub-pixels from the centre.
        """
        n_triangles = self.clusters.n_drawn or self.clusters.n_triangles
        height, n_threads = self._view.size[1], count_threads(self._view.threads, n_triangles)
        memories, tops = (
            [memory] if n_threads == 1 else [FRESH] * n_threads,
            equal_bands(height, min(n_threads, height)),
        )
        return draw_clustered(memories, tops, lambda *_: [0], lambda _: self, target, sample)

    def draw_rows(
        self,
        memory: Memory,
        target: engine.Target,
        first: int,
        end: int,
        *,
        sample: tuple[int, int] = (0, 0),
        is_first: bool = True,
        is_last: bool = True,
    ) -> tuple[NDArray[np.int32], int]:
        """Draw rows [first, end) of a target that the first of several meshes clears and the last one finishes.

        Returns the triangles that are still to be drawn, which the planes of clip space may cut or which do not fit,
        and how many clusters have been.
        """
        clusters, sink = self.clusters, target.sink
        empty = self._empty if sample == (0, 0) else self._empty.at_sample(*sample)
        room: NDArray[np.int32] = memory.empty("clusters", (3 * len(clusters) + 1,), np.int32)
        others: NDArray[np.int32] = memory.scratch("outside", (clusters.n_triangles + 1,), np.int32)
        may_be_hidden = sink in (Sink.NEAREST, Sink.FARTHEST)
        seen, place = self._seen(sink, first, end, empty), (target, first, end - first, room, others)
        n_others, _, n_drawn = clusters.engine.draw(empty, self._own, seen, may_be_hidden, *place, is_first, is_last)
        return others[:n_others].copy(), n_drawn

    def count_drawn(self, sink: Sink) -> int:
        """Return how many clusters one thread draws: the clusters that are neither left out nor hidden."""
        width, height = self._view.size
        ids: NDArray[np.int32] = np.empty((height, width), np.int32)
        target = engine.Target(sink, ids, np.empty((height, width), np.float32), None)
        return self.draw_rows(FRESH, target, 0, height)[1]

    def part(self, *triangles: NDArray[np.int32]) -> engine.SnappedMesh:
        """Return the mesh with the vertices of some triangles snapped, maybe more; -1 is no triangle."""
        points, own, view = self.clusters.points, self.clusters.triangles, self._view
        mesh = None
        is_all_drawn = self.clusters.n_drawn is None
        if is_all_drawn and choices.pays_to_snap_all(len(points), view.size[0] * view.size[1]):
            mesh = self.try_part(None, FRESH)
        if mesh is None:
            mesh = self.try_part(triangles, FRESH)
        if mesh is None:  # an unused vertex beside a used one does not fit
            mesh = snap_mesh(FRESH, points, own, view, with_depth=True, out=None).mesh
        return mesh

    def parts_of_samples(
        self, ids: NDArray[np.int32], samples: Sequence[tuple[int, int]]
    ) -> list[Callable[..., engine.SnappedMesh]]:
        """Return a maker of the mesh as each sample sees it; triangles that (S, H, W) ids show are snapped once.

        Where other triangles are needed, too, all are snapped.
        """
        common = cache(lambda: self.part(ids))
        whole = cache(lambda: self.part(np.arange(self.clusters.n_triangles, dtype=np.int32)))

        def part_at(x: int, y: int) -> Callable[..., engine.SnappedMesh]:
            return lambda _, *others: (whole() if others else common()).at_sample(x, y)

        return [part_at(*sample) for sample in samples]

    def try_part(self, triangles: Sequence[NDArray[np.int32]] | None, memory: Memory) -> engine.SnappedMesh | None:
        """Return the mesh with the vertices of some triangles snapped; None if one does not fit or is not finite.

        Without triangles: with all vertices snapped, or None where a clip plane may cut a triangle, too.
        """
        points, own = self.clusters.points, self.clusters.triangles
        source = source_of(points, self._view)
        is_used: NDArray[np.uint8] = np.full(len(points) // engine.BLOCK + 1, triangles is None, np.uint8)
        ids = [np.ascontiguousarray(array, np.int32).ravel() for array in triangles or ()]
        for array in ids:
            refuse_rows([engine.mark_vertices(array, own, len(points), is_used)], own, len(points))
        records: NDArray[np.uint8] = memory.scratch("records", (len(points) * engine.VERTEX_BYTES,), np.uint8)
        bad, wide, clipped = source.project_blocks(is_used, self._viewport, records)
        if bad or wide or (clipped and triangles is None):
            return None
        pieces = None
        if clipped:
            cut = np.empty(sum(map(len, ids)), np.int32)
            n_cut = 0
            for array in ids:
                n_cut += engine.list_cut(array, own, records, cut[n_cut:])
            pieces = engine.Pieces(source, records, own, self._viewport, np.unique(cut[:n_cut]))
        return self._snapped(source, records, own, pieces, is_used)


def draw_clustered(
    memories: Sequence[Memory],
    tops: Sequence[int],
    own: Callable[[int, int], Sequence[int]],
    mesh_of: Callable[[int], ClusteredMesh],
    target: engine.Target,
    sample: tuple[int, int],
    *,
    is_first: bool = True,
    is_last: bool = True,
) -> bool:
    """Clear a target and draw meshes, a thread for each band; of several calls the first clears, the last finishes.

    `tops`: the first rows of the bands, and the height; `own(first, end)`: the numbers of the meshes that are drawn in
    these rows, one at least; `mesh_of`: the mesh of a number, made when its turn comes and not before, for Python's
    search for cycles goes through all objects that live. Returns False, with the target in any state, where a vertex
    does not fit or is not finite: the whole meshes are then to be drawn, which tells why.
    """

    def draw_band(k: int, _: int) -> dict[int, NDArray[np.int32]]:
        rows, left = (tops[k], tops[k + 1]), {}
        numbers = own(*rows)
        for i in numbers:
            ends = {"is_first": is_first and i == numbers[0], "is_last": is_last and i == numbers[-1]}
            others, _ = mesh_of(i).draw_rows(memories[k], target, *rows, sample=sample, **ends)
            if len(others):
                left[i] = others
        return left

    parts = run_parts(draw_band, len(tops) - 1, len(tops) - 1)
    for i in dict.fromkeys(i for part in parts for i in part):
        others = np.unique(np.concatenate([part[i] for part in parts if i in part]))
        if not draw_others(memories[0], mesh_of(i), others, target, tops, sample):
            return False
    return True


def equal_bands(height: int, n: int) -> list[int]:
    """Return the first rows of n bands of as many rows, and `height`."""
    return [height * i // n for i in range(n + 1)]


def draw_others(
    memory: Memory,
    mesh: ClusteredMesh,
    triangles: NDArray[np.int32],
    target: engine.Target,
    tops: Sequence[int],
    sample: tuple[int, int],
) -> bool:
    """Draw some triangles of a mesh over the picture; returns as `draw_clustered` does.

    `tops`: the first rows of the bands that the others were drawn in, and the height: a mask has its bits band by band.
    """
    part = mesh.try_part([triangles], memory)
    if part is None:
        return False
    seen = part.at_sample(*sample)

    def draw_band(i: int, _: int) -> None:
        seen.draw_listed(target, tops[i], tops[i + 1] - tops[i], triangles, True)

    run_parts(draw_band, len(tops) - 1, len(tops) - 1)
    return True
