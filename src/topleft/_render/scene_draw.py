"""Scenes into buffers: each instance is snapped and drawn over what the ones before have left.

In: `Scene`, the matrix of a camera, the options of a view.  Out: `SceneFragments`, or a mask.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft import _engine
from topleft._base.memory import SCRATCH, FreshMemory
from topleft._base.options import DepthTest, Sampling, Sink, parse
from topleft._base.threads import count_threads, run_parts
from topleft._model.scene import Scene
from topleft._raster import choices
from topleft._raster.classic import refuse_classic
from topleft._raster.cluster_draw import ClusteredMesh
from topleft._raster.clusters import Clusters
from topleft._raster.peel import check_peel, peel_meshes
from topleft._raster.rasterize import canvas_of, refuse_many
from topleft._raster.sampling import sample_positions, sum_areas
from topleft._raster.snap import Snapped, snap_mesh
from topleft._raster.view import View
from topleft._render.scene_clusters import draw_placed, front_to_back, pays_to_draw, wants_clusters
from topleft._render.scene_fragments import SceneDepthLayers, SceneFragments

__all__ = ["PlacedScene", "draw_scene", "draw_scene_coverage", "peel_scene"]

#: Snapped vertices that are held at a time: 16 bytes each.
VERTICES_AT_ONCE = 1 << 20

#: `tl_kernels.draw` begins a mask anew after 2**31 pixels, which one that is drawn in several calls must not meet.
MOST_PIXELS_OF_PART = 1 << 30

FRESH = FreshMemory()

#: cull codes of a view (tl_cull) for an instance that mirrors.
MIRRORED = {0: 0, 1: 2, 2: 1}


class PlacedScene:
    """A scene as a camera sees it: its instances are snapped when they are asked for."""

    def __init__(
        self,
        scene: Scene,
        clip_from_world: NDArray[np.float64],
        view: View,
        *,
        with_depth: bool,
        may_cluster: bool = True,
    ) -> None:
        self.scene = scene
        self.first_ids = scene.first_ids
        self._clip_from_world = clip_from_world
        self._view = view
        self._with_depth = with_depth
        self._may_cluster = may_cluster

    def of(self, scene: Scene) -> PlacedScene:
        """Return another scene, made for this picture alone, seen in the same way."""
        how = self._clip_from_world, self._view
        return PlacedScene(scene, *how, with_depth=self._with_depth, may_cluster=False)

    def snap(self, i: int) -> Snapped:
        """Return an instance, snapped; in shared buffers it draws its own range of ids."""
        mesh = self.scene[i].mesh
        view, with_depth = self._view_of(i), self._with_depth
        snapped = snap_mesh(FRESH, mesh.vertices, mesh.triangles, view, with_depth=with_depth, out=None)
        return replace(snapped, mesh=snapped.mesh.numbered_from(int(self.first_ids[i])))

    def snap_part(self, i: int, triangles: NDArray[np.int32]) -> _engine.SnappedMesh:
        """Return what some triangles of an instance need, snapped: all of it, unless its mesh is drawn in clusters."""
        can_cluster = self._may_cluster and choices.can_cluster(self._view, Sink.NEAREST)
        if can_cluster and self.scene[i].mesh.has_clusters:
            return ClusteredMesh(*self.clustered(i)).part(triangles)
        return self.snap(i).mesh

    def _view_of(self, i: int) -> View:
        instance, view = self.scene[i], self._view
        cull = MIRRORED[view.cull] if instance.is_mirrored else view.cull
        return replace(view, transform=self._clip_from_world @ instance.transform, cull=cull)

    def clustered(self, i: int) -> tuple[Clusters, View, int]:
        """Return the clusters of an instance's mesh, how they are seen, and what triangle 0 is called."""
        return self.scene[i].mesh.clusters, self._view_of(i), int(self.first_ids[i])

    def chunks(self) -> Iterator[list[Snapped]]:
        """Yield the instances in their order, as many at a time as `VERTICES_AT_ONCE` allows."""
        chunk: list[Snapped] = []
        for i in range(len(self.scene)):
            chunk.append(self.snap(i))
            if sum(snapped.n_vertices for snapped in chunk) >= VERTICES_AT_ONCE:
                yield chunk
                chunk = []
        if chunk:
            yield chunk

    def draw(self, targets: list[_engine.Target], positions: Sequence[tuple[int, int]], height: int) -> None:
        """Clear targets of that many rows, one a sample, and draw what each sees; (0, 0) is the pixel's centre."""
        n_parts = count_threads(self._view.threads, self.scene.n_triangles)
        n_parts = min(height, max(n_parts, height * self._view.size[0] // MOST_PIXELS_OF_PART))
        can_cluster = self._may_cluster and choices.can_cluster(self._view, Sink(targets[0].sink))
        seen = self._clip_from_world, self._view
        if can_cluster and wants_clusters(self.scene) and pays_to_draw(self, *seen):
            order = front_to_back(self.scene, self._clip_from_world)
            if draw_placed(self, order, targets, positions, height, n_parts):
                return
        n_left = len(self.scene)
        is_first = True
        for chunk in self.chunks():
            n_left -= len(chunk)
            for target, at in zip(targets, positions, strict=True):
                scenes = [snapped.mesh.seen_from(*at) for snapped in chunk]
                run_parts(rows_of(scenes, target, is_first=is_first, is_last=n_left == 0), height, n_parts)
            is_first = False


def rows_of(
    scenes: list[_engine.SnappedMesh], target: _engine.Target, *, is_first: bool, is_last: bool
) -> Callable[[int, int], None]:
    """Return what draws rows [first, end) of several scenes into one target, which the first of all clears."""

    def draw_rows(first: int, end: int) -> None:
        for i, scene in enumerate(scenes):
            scene.draw(target, first, end - first, is_first and i == 0, is_last and i == len(scenes) - 1)

    return draw_rows


def draw_scene(
    scene: Scene,
    clip_from_world: NDArray[np.float64],
    size: tuple[int, int],
    *,
    depth_test: str | None = "less",
    background_depth: float | None = None,
    **options: Any,
) -> SceneFragments:
    """Return the visibility buffer of a scene; options as those of `rasterize`, without `out` and `transform`."""
    view_options: Any = options
    view = View.parse(size, view_options)
    refuse_classic(view, "depth")
    refuse_many(view, "rasterize")
    test = None if depth_test is None else parse(DepthTest, "depth_test", depth_test)
    sink = {None: Sink.PAINT, DepthTest.LESS: Sink.NEAREST, DepthTest.GREATER: Sink.FARTHEST}[test]
    (width, height), n = view.size, view.sampling.n_samples
    positions = [(0, 0)] if n == 1 else [(x, y) for x, y in sample_positions(n, view.grid_bits).tolist()]
    ids: NDArray[np.int32] = FRESH.empty("ids", (n, height, width), np.int32)
    depth: NDArray[np.float32] = FRESH.empty("depth", (n, height, width), np.float32)
    placed = PlacedScene(scene, clip_from_world, view, with_depth=True)
    if width and height:
        targets = [_engine.Target(sink, *planes, None) for planes in zip(ids, depth, strict=True)]
        placed.draw(targets, positions, height)
    if background_depth is not None:
        depth[ids < 0] = background_depth
    return SceneFragments(ids, depth, placed, positions)


def peel_scene(
    scene: Scene,
    clip_from_world: NDArray[np.float64],
    size: tuple[int, int],
    *,
    layers: int,
    depth_test: str = "less",
    **options: Any,
) -> SceneDepthLayers:
    """Return the nearest layers of a scene; options as those of `peel`, without `transform`."""
    view_options: Any = options
    view = View.parse(size, view_options)
    n, is_farthest = check_peel(view, layers, depth_test)
    placed = PlacedScene(scene, clip_from_world, view, with_depth=True)
    snapped = [placed.snap(i) for i in range(len(scene))]  # a band of rows is drawn once, with all instances
    return SceneDepthLayers(*peel_meshes(SCRATCH, snapped, view, n, is_farthest=is_farthest), placed)


def draw_scene_coverage(
    scene: Scene, clip_from_world: NDArray[np.float64], size: tuple[int, int], out: object, **options: Any
) -> NDArray[Any]:
    """Return the mask of a scene, as `coverage` gives that of a mesh; options as there."""
    view_options: Any = options
    view = View.parse(size, view_options)
    refuse_classic(view, "a scene")
    width, height = view.size
    placed = PlacedScene(scene, clip_from_world, view, with_depth=False)
    n = view.sampling.n_samples
    is_share = n > 1 or view.sampling is Sampling.AREA
    with canvas_of(FRESH, "coverage", out, (height, width), np.float32 if is_share else np.bool_) as (result, canvas):
        if not (width and height):
            pass
        elif view.sampling is Sampling.AREA:
            add_areas(placed, view, canvas)
        else:
            samples = sample_positions(n, view.grid_bits) if n > 1 else None
            shape = _engine.Target.covered_shape(height, width, n)
            sink = Sink.SAMPLES if n > 1 else Sink.MASK
            target = _engine.Target(sink, canvas, None, SCRATCH.empty("covered", shape, np.uint64), samples)
            placed.draw([target], [(0, 0)], height)
    return result


def add_areas(placed: PlacedScene, view: View, canvas: NDArray[np.float32]) -> None:
    """Write the sum of the areas that the instances cover, at most 1."""
    canvas[...] = 0
    own = np.empty_like(canvas)
    for chunk in placed.chunks():
        for snapped in chunk:
            n_threads = count_threads(view.threads, snapped.n_triangles)
            sum_areas(SCRATCH, snapped.mesh, own, n_threads, is_clamped=True)
            canvas += own
    np.minimum(canvas, 1, out=canvas)
