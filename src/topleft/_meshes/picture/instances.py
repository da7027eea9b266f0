"""The instances of a scene as a camera sees them: snapped when they are needed, and drawn, whole or in clusters.

In: `Scene`, the matrix of a camera, the options of a view.  Out: ids and depths in targets, `SceneFragments`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.arrays import INT32_MAX, set_aligned
from topleft._core.base.memory import FRESH
from topleft._core.base.options import Sink
from topleft._core.base.threads import count_threads, run_parts
from topleft._core.raster import choices
from topleft._core.raster.cluster_draw import ClusteredMesh, SeenBoxes, equal_bands
from topleft._core.raster.clusters import Clusters
from topleft._core.raster.fragments import Fragments, GivenCorners
from topleft._core.raster.sampling import SamplePass, draw_sorted, draw_split, sample_positions
from topleft._core.raster.snap import refuse_changed, snap_mesh
from topleft._core.raster.view import CULL_CODES, View
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import trusted_mesh
from topleft._meshes.picture.bend import BentMesh, bend
from topleft._meshes.picture.fragments import Ids, MeshFragments, SceneFragments
from topleft._meshes.picture.rounds import draw_placed, front_to_back, pays_in_clusters
from topleft._meshes.scene.scene import Instance, Scene, unchecked_scene

#: Snapped vertices that are held at a time: 16 bytes each.
VERTICES_AT_ONCE = 1 << 20

#: Triangles of a scene that are kept in one array, 12 bytes each.
TRIANGLES_AT_ONCE = 1 << 21

#: Instances that are drawn before others are tested against their depths; each later round has twice as many.
FIRST_ROUND = 64

#: Runs of instances that cull alike, each drawn as one mesh.
MOST_JOINED = 8

#: `tl_kernels.draw` begins a mask anew after 2**31 pixels, which one that is drawn in several calls must not meet.
MOST_PIXELS_OF_PART = 1 << 30

#: cull codes of a view (tl_cull) for an instance that mirrors.
MIRRORED = np.array([0, 2, 1], np.int32)


#: The second mirror of mirrored instances that stand in eye space.
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


class DrawnScene(NamedTuple):
    """A scene as drawn, and the scene itself, which has the triangles that ids count."""

    scene: Scene
    whole: Scene
    clip_from_world: NDArray[np.float64]
    bent: tuple[BentMesh, ...] | None


def scene_through(scene: Scene, camera: Camera, frame: tuple[int, int], *, near_clip: bool = True) -> DrawnScene:
    """The scene as it is, and the camera's matrix for a whole picture of this size; or as the camera's lens bends it.

    Bent meshes stand in eye space, mirrored instances mirrored twice, so that they stay mirrored for `cull`.
    """
    if camera.lens is None:
        return DrawnScene(scene, scene, camera.clip_from_world(frame), None)
    scene.check_counted("a scene behind a lens")
    many, instances = [], []
    for instance in scene:
        mesh = instance.mesh
        own = camera.placed(instance.transform)
        bent = bend(mesh.vertices, mesh.triangles, own, camera.lens, frame, near_clip=near_clip)
        place = MIRROR if instance.is_mirrored else np.eye(4)
        points = bent.points_eye * np.diag(MIRROR)[:3] if instance.is_mirrored else bent.points_eye
        many.append(bent)
        instances.append(Instance(trusted_mesh(points, bent.triangles), place))
    return DrawnScene(Scene(instances), scene, camera.clip_from_eye(frame), tuple(many))


class PlacedScene:
    """A scene as a camera sees it: its instances are snapped when they are needed.

    Attributes
    ----------
    scene, whole : Scene
        The scene as drawn, and the one that ids count the triangles of: the same except through a lens.
    first_ids, whole_first_ids : (N + 1,) int64
        Where the ids of each instance begin in these, and their end.
    bent : sequence of BentMesh, optional
        The parts that a lens makes of each instance.

    `numbers`: the id of triangle 0 of each instance, of a scene that is a part of another; `pays_in_clusters`: whether
    that is known.
    """

    def __init__(
        self,
        drawn: DrawnScene,
        view: View,
        *,
        with_depth: bool,
        may_cluster: bool = True,
        material: Material | None = None,
        numbers: NDArray[np.int64] | None = None,
        pays_in_clusters: bool = False,
        is_mesh: bool = False,
    ) -> None:
        self.scene, self.whole, self._clip_from_world, self.bent = self._drawn = drawn
        self._view, self._given_numbers, self._is_mesh = view, numbers, is_mesh
        self._is_sure_to_pay = pays_in_clusters
        self._material = material  # instead of those of the meshes
        self._with_depth = with_depth
        self._may_cluster = may_cluster
        self._kept: dict[int, engine.SnappedMesh] = {}
        self._n_kept = 0  # vertices of these
        self._all: engine.PlacedMeshes | None = None  # of a small scene, once they have been joined
        self._sides_of_looks: dict[tuple[int, int], tuple[int, NDArray[np.uint8] | None]] = {}
        self._last: tuple[int, View] | None = None  # the last instance that was needed: often thrice in turn

    def __getstate__(self) -> dict[str, Any]:
        """The state for another process, which makes views of instances itself."""
        own = {name: value for name, value in vars(self).items() if name != "joined"}
        return own | {"_last": None, "_kept": {}, "_n_kept": 0, "_all": None, "_sides_of_looks": {}}

    __setstate__ = set_aligned

    @property
    def first_ids(self) -> NDArray[np.int64]:
        """Where the ids of each instance of the drawn scene begin."""
        return self.scene.first_ids

    @property
    def whole_first_ids(self) -> NDArray[np.int64]:
        """Where the ids of each instance begin."""
        return self.whole.first_ids

    def of(self, scene: Scene) -> PlacedScene:
        """Return another scene to draw, made for this picture alone, seen in the same way."""
        drawn = self._drawn._replace(scene=scene)
        return PlacedScene(drawn, self._view, with_depth=self._with_depth, may_cluster=False, material=self._material)

    def fragments(self, ids: Ids, depth: NDArray[np.float32], positions: Sequence[tuple[int, int]]) -> SceneFragments:
        """Return drawn planes (S, H, W) as fragments of the scene, or of its only mesh."""
        return (MeshFragments if self._is_mesh else SceneFragments)(ids, depth, self, positions)

    def fragments_of(self, drawn: Fragments, view: View) -> SceneFragments:
        """Return the same of the only instance, which was drawn alone."""
        frags = self.fragments(drawn.id[None], drawn.depth[None], self.positions(view))
        frags._whole_scene = drawn
        return frags

    @staticmethod
    def positions(view: View) -> list[tuple[int, int]]:
        """Where the samples of a pixel lie."""
        return list(map(tuple, sample_positions(view.sampling.n_samples, view.grid_bits).tolist()))

    def whole_ids(self, ids: Ids) -> Ids:
        """Return ids in terms of the whole scene: as they are without a lens."""
        if self.bent is None or all(one.parts is None for one in self.bent):
            return ids
        firsts = zip(self.bent, self.whole_first_ids[:-1].tolist(), strict=True)
        wholes = np.concatenate([*(one.source + first for one, first in firsts), [-1]]).astype(np.int32)
        return wholes[ids]  # part -1, none, is the last

    def snap(self, i: int) -> engine.SnappedMesh:
        """Return an instance, snapped; in shared buffers it draws its own range of ids. Small scenes are kept."""
        return self.snap_all(np.array([i]))[0]

    def snap_all(self, some: NDArray[np.intp]) -> list[engine.SnappedMesh]:
        """Return some instances in the same way."""
        snapped = [mesh or self._snap_alone(i) for i, mesh in zip(some.tolist(), self._snap(some), strict=True)]
        if self._n_kept < VERTICES_AT_ONCE:
            self._kept.update(zip(some.tolist(), snapped, strict=True))
            self._n_kept += int(self._vertex_counts[some].sum())
        return snapped

    def _snap(self, some: NDArray[np.intp]) -> list[engine.SnappedMesh | None]:
        """Return some instances, all in one call; None for those that are to be snapped alone."""
        numbers = some.tolist()
        if self._all is not None:
            return [self._kept.get(i) or self._all.mesh(i) for i in numbers]
        if all(i in self._kept for i in numbers):
            return [self._kept[i] for i in numbers]
        placed = self._project(some)
        return [None] * len(some) if placed is None else [placed.mesh(k) for k in range(len(some))]

    def _project(self, some: NDArray[np.intp]) -> engine.PlacedMeshes | None:
        """Return some instances, but for those to be snapped alone; None: that is all of them."""
        view, n = self._view, len(some)
        firsts = np.concatenate([[0], np.cumsum(self._vertex_counts[some])])
        n_threads = choices.threads_to_snap(view.threads, int(firsts[-1]), self.scene.n_triangles)
        is_sliced = n_threads <= n  # fewer instances than threads: each is the work of all of them
        if not (is_sliced and view.plan is None and view.grid_bits == view.subpixel_bits) or 0 in view.size:
            return None
        points = FRESH.empty("points", (int(firsts[-1]), engine.PLACED), np.float64) if view.is_exact else None
        shape = int(firsts[-1]) * engine.VERTEX_BYTES
        room = FRESH.empty("records", (shape,), np.uint8) if points is None else points
        culls, is_apart = self._sides
        if len(self._in_parts):  # of which all parts would be drawn
            is_apart = is_apart.copy()
            is_apart[self._in_parts] = True
        meshes, of_instance = self.scene.mesh_list
        placed = engine.PlacedMeshes(
            meshes, of_instance[some], self._clip_from_objects[some], culls[some], self._numbers[some],
            is_apart[some].view(np.uint8), view.engine_viewport(), view.how, room, firsts,
        )  # fmt: skip
        run_parts(placed.project, n, n_threads)
        return placed

    @cached_property
    def _vertex_counts(self) -> NDArray[np.int64]:
        return np.diff(self.scene.first_vertices)

    @cached_property
    def joined(self) -> list[engine.SnappedMesh]:
        """All instances as a few meshes, one for each run that culls alike; none of large scenes or clipped ones."""
        scene, culls = self.scene, self._sides[0]
        is_end = culls[1:] != culls[:-1]
        if self._given_numbers is not None:  # of one mesh they count on
            is_end = is_end | (np.diff(self._given_numbers) != np.diff(scene.first_ids)[:-1])
        starts = [0, *(np.flatnonzero(is_end) + 1).tolist()]
        is_small = scene.first_vertices[-1] <= VERTICES_AT_ONCE and 0 < scene.n_triangles <= TRIANGLES_AT_ONCE
        if not is_small or len(starts) > MOST_JOINED:
            return []
        self._all = placed = self._project(np.arange(len(scene)))
        if placed is None or placed.count_left_out():
            return []
        triangles, ends = scene.joined_triangles, pairwise(scene.first_ids[[*starts, len(scene)]].tolist())
        runs = zip(starts, ends, strict=True)
        return [placed.joined(i, triangles[first:end]) for i, (first, end) in runs if first < end]

    def _snap_alone(self, i: int) -> engine.SnappedMesh:
        mesh = self.scene[i].mesh
        snapped = snap_mesh(
            FRESH, mesh.vertices, mesh.triangles, self.view_of(i), with_depth=self._with_depth, out=None
        )
        return snapped.mesh.numbered_from(int(self._numbers[i]))

    @cached_property
    def _numbers(self) -> NDArray[np.int64]:
        """The id of triangle 0 of each instance."""
        if self._given_numbers is not None:
            return self._given_numbers
        has_ids = self._with_depth and self.scene.n_triangles <= INT32_MAX
        return self.first_ids[:-1] if has_ids else np.zeros(len(self.scene), np.int64)

    @cached_property
    def _in_parts(self) -> NDArray[np.intp]:
        """The instances whose meshes are parts of several levels."""
        found = [at for mesh, at in self.scene.meshes.values() if mesh.is_in_parts]
        return np.sort(np.concatenate(found)) if found else np.empty(0, np.intp)

    @cached_property
    def _sides(self) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
        """The `tl_cull` of each instance, and which have triangles with two sides beside others with one."""
        view, key = self._view, (self._view.cull, self._view.sides_by_material)
        kept = self.whole.cache.sides if self._material is None else {}
        found = kept.get(key)
        if found is None:
            sides: NDArray[np.int32] = np.full(len(self.scene), view.cull, np.int32)
            is_mixed = np.zeros(len(sides), np.bool_)
            for _, _, at in self.whole.looks(self._material) if view.sides_by_material else ():
                sides[at], is_single = self._sides_of(self.whole[at[0]])
                is_mixed[at] = is_single is not None
            found = kept[key] = sides, is_mixed
        culls, is_mixed = found
        is_mirrored = self.scene.are_mirrored
        return (np.where(is_mirrored, MIRRORED[culls], culls) if is_mirrored.any() else culls), is_mixed

    def _sides_of(self, whole: Instance) -> tuple[int, NDArray[np.uint8] | None]:
        """The `tl_cull` of an instance that is no mirror; 1 for each triangle with one side, where others have two."""
        key = id(whole.mesh), id(whole.material)
        found = self._sides_of_looks.get(key)
        if found is None:
            material = whole.material if self._material is None else self._material
            is_single = whole.mesh.single_sided(material) if self._view.sides_by_material else None
            is_all = is_single is not None and bool(is_single.all())
            found = CULL_CODES["back"] if is_all else self._view.cull, None if is_all else is_single
            self._sides_of_looks[key] = found
        return found

    def corners(self, i: int) -> GivenCorners:
        """Return the arrays and the view that an instance is drawn from."""
        mesh, view = self.scene[i].mesh, self.view_of(i)
        return GivenCorners(mesh.vertices, mesh.triangles, view.transform, view.viewport, view.origin, view.zero_to_one)

    def snap_parts(
        self, some: NDArray[np.intp], triangles_of: Callable[[int], NDArray[np.int32]]
    ) -> list[engine.SnappedMesh]:
        """Return some instances snapped; of a large mesh in clusters the part with some triangles."""
        is_snapped = self._all is not None
        in_clusters = [not (is_snapped or i in self._kept) and self._is_clustered(i) for i in some.tolist()]
        n_pixels = self._view.size[0] * self._view.size[1]
        is_large = np.array(
            [
                of_clusters and not choices.pays_to_snap_all(n, n_pixels)
                for of_clusters, n in zip(in_clusters, self._vertex_counts[some].tolist(), strict=True)
            ],
            np.bool_,
        )
        found = dict(zip(some[~is_large].tolist(), self._snap(some[~is_large]), strict=True))

        def snapped(i: int, *, of_clusters: bool) -> engine.SnappedMesh:
            whole = found.get(i)
            if whole is not None:
                return whole
            return ClusteredMesh(*self.clustered(i)).part(triangles_of(i)) if of_clusters else self._snap_alone(i)

        return [snapped(i, of_clusters=own) for i, own in zip(some.tolist(), in_clusters, strict=True)]

    def _is_clustered(self, i: int) -> bool:
        """Whether an instance has clusters that know its sides."""
        mesh = self.scene[i].mesh
        may_cluster = mesh.has_clusters and (self._may_cluster or mesh.is_in_parts)
        return may_cluster and choices.can_cluster(self._view, Sink.NEAREST) and not bool(self._sides[1][i])

    def view_of(self, i: int) -> View:
        """How an instance is seen."""
        last = self._last
        if last is None or last[0] != i:
            self._last = last = i, self._make_view(i)
        return last[1]

    def _make_view(self, i: int) -> View:
        one, (cull, is_single) = self.scene[i], self._sides_of(self.whole[i])
        is_mirrored, single_sided = one.is_mirrored, None
        if is_single is not None:
            back = CULL_CODES["front" if is_mirrored else "back"]
            single_sided = is_single if self.bent is None else is_single[self.bent[i].source], back
        cull = int(MIRRORED[cull]) if is_mirrored else cull
        transform = self._clip_from_objects[i]
        static = one.mesh if self._may_cluster or one.mesh.is_in_parts else None
        return self._view.but(transform=transform, cull=cull, single_sided=single_sided, static=static)

    def _can_cluster(self, sink: Sink) -> bool:
        """Whether clusters may be drawn, which do not know that some triangles are single-sided and others are not."""
        return self._may_cluster and choices.can_cluster(self._view, sink) and not self._sides[1].any()

    def clustered(self, i: int) -> tuple[Clusters, View, int]:
        """Return the clusters of an instance's mesh, their view, and the id of triangle 0."""
        return self.scene[i].mesh.clusters, self.view_of(i), int(self._numbers[i])

    def groups(self) -> Iterator[tuple[int, PlacedScene]]:
        """Yield the first id and the placed instances of each part of the scene that int32 can count from 1 on."""
        for first, group in self.scene.groups:
            yield int(self.first_ids[first]), self._placed(group, group.first_ids[:-1] + 1, pays_in_clusters=True)

    def _placed(self, scene: Scene, numbers: NDArray[np.int64], *, pays_in_clusters: bool = False) -> PlacedScene:
        """Return a part of the scene, seen in the same way, whose instances have triangles 0 of these numbers."""
        return PlacedScene(
            self._drawn._replace(scene=scene, whole=scene), self._view, with_depth=self._with_depth,
            may_cluster=self._may_cluster or pays_in_clusters, material=self._material, numbers=numbers,
            pays_in_clusters=pays_in_clusters or self._is_sure_to_pay,
        )  # fmt: skip

    def _some(self, at: NDArray[np.intp], *, pays_in_clusters: bool = False) -> PlacedScene:
        """Return some instances by themselves, with the ids that they have among all."""
        instances = [self.scene[i] for i in at.tolist()]
        known = {"transforms": self.scene.transforms[at], "are_mirrored": self.scene.are_mirrored[at]}
        return self._placed(unchecked_scene(instances, **known), self._numbers[at], pays_in_clusters=pays_in_clusters)

    def _in_turn(self, sink: Sink) -> Iterator[PlacedScene]:
        """Yield the scene; if it has meshes in parts, which clusters draw faster, these first where order allows it."""
        at = self._in_parts
        first = self._some(at, pays_in_clusters=True) if len(at) else self
        if first is self or not first._can_cluster(sink):
            yield self
            return
        yield first
        if len(at) < len(self.scene):
            yield self._some(np.delete(np.arange(len(self.scene)), at))

    def shown(
        self,
        some: NDArray[np.intp],
        targets: Sequence[engine.Target],
        positions: Sequence[tuple[int, int]],
        rows: tuple[int, int] | None = None,
        *,
        is_drawn: bool,
    ) -> NDArray[np.intp]:
        """Return those of some instances whose boxes may show in a sample in some rows, or in all.

        If `is_drawn`, before the targets' depths; otherwise at least the first one, which clears the targets.
        """
        may_show: NDArray[np.uint8] = np.zeros(len(some), np.uint8)
        for target, at in zip(targets, positions, strict=True):
            for dtype in (np.float32, np.float64):
                own = np.flatnonzero((may_show == 0) & (self._is_float32[some] == (dtype == np.float32)))
                if not len(own):
                    continue
                chosen = some[own]
                boxes = SeenBoxes(np.zeros((1, 3), dtype), self.view_of(int(chosen[0])))
                seen, mesh = boxes.seen(target.sink, at, rows)
                shown: NDArray[np.uint8] = np.empty(len(own), np.uint8)
                matrices = self._clip_from_objects[chosen].astype(dtype).astype(np.float64)  # as vertices have them
                engine.find_shown(mesh, seen, self.scene.boxes[chosen], matrices, target, is_drawn, shown)
                may_show[own] = shown
        return some[:1] if not is_drawn and not may_show.any() else some[may_show != 0]

    def split_rows(self, some: NDArray[np.intp], height: int, n: int) -> list[int]:
        """Return the first rows of n bands with about as many of some instances each, and `height`.

        Instances of about one distance often lie in one band of equal bands. Small ones are left to one thread.
        """
        view = self._view
        if n == 1 or height * view.size[0] > MOST_PIXELS_OF_PART:
            return equal_bands(height, n)
        boxes, matrices = self.scene.boxes[some], self._clip_from_objects[some][:, [1, 3]]
        low, high = boxes[:, None, :3], boxes[:, None, 3:]
        y, w = (0.5 * (matrices[:, :, :3] * (low + high)).sum(axis=2) + matrices[:, :, 3]).T
        w = np.where(w > 0, w, np.inf)
        reach = 0.5 * (np.abs(matrices[:, 0, :3]) * (high - low)[:, 0]).sum(axis=1)
        n_rows = float(np.mean(reach / w)) * view.viewport[1]
        if not choices.pays_to_share_instances(self.scene.n_triangles // len(self.scene), n_rows):
            return [0, height]
        rows = (1 - y / w) * (0.5 * view.viewport[1]) - view.origin[1]
        wished = np.quantile(rows, np.arange(1, n) / n).clip(0, height)
        tops = [0]
        for k, top in enumerate(wished.tolist(), 1):
            tops.append(min(max(int(top), tops[-1] + 1), height - n + k))
        return [*tops, height]

    @cached_property
    def _clip_from_objects(self) -> NDArray[np.float64]:
        return self.scene.clip_from_objects(self._clip_from_world)

    @cached_property
    def _is_float32(self) -> NDArray[np.bool_]:
        is_float32 = np.empty(len(self.scene), np.bool_)
        for mesh, at in self.scene.meshes.values():
            is_float32[at] = mesh.vertices.dtype == np.float32
        return is_float32

    def chunks(self) -> Iterator[list[engine.SnappedMesh]]:
        """Yield the instances in their order, as many at a time as `VERTICES_AT_ONCE` allows."""
        return map(self.snap_all, self._ranges(np.arange(len(self.scene))))

    def _ranges(self, order: NDArray[np.intp], n_most: float = np.inf) -> Iterator[NDArray[np.intp]]:
        """Yield instances in this order, as many at a time as `VERTICES_AT_ONCE` and `n_most` allow.

        Each time `n_most` doubles.
        """
        ends, first = np.cumsum(self._vertex_counts[order]), 0
        while first < len(order):
            before = ends[first - 1] if first else 0
            end = min(int(np.searchsorted(ends, before + VERTICES_AT_ONCE, side="right")), first + n_most)
            end = int(max(end, first + 1))
            yield order[first:end]
            first, n_most = end, 2 * n_most

    def meshes(self) -> Iterator[list[engine.SnappedMesh]]:
        """Yield what is drawn, in the order of ids: all instances joined, or else `chunks`."""
        return iter([self.joined]) if self.joined else self.chunks()

    @cached_property
    def _pays_in_clusters(self) -> bool:
        return self._is_sure_to_pay or pays_in_clusters(self, self._clip_from_world, self._view)

    def _n_parts(self, height: int) -> int:
        """How many threads draw."""
        n_parts = count_threads(self._view.threads, self.scene.n_triangles)
        return min(height, max(n_parts, height * self._view.size[0] // MOST_PIXELS_OF_PART))

    def draw_split(self, sink: Sink, background: float) -> SceneFragments | None:
        """Draw several samples as those of a mesh are; None where that takes planes: of clusters, or of many meshes."""
        view = self._view.but(is_split=True)
        is_clustered = len(self._in_parts) > 0 or (self._can_cluster(sink) and self._pays_in_clusters)
        if is_clustered or len(self.joined) != 1 or not choices.can_split(view, self.scene.n_triangles):
            return None
        (width, height), positions = view.size, self.positions(view)
        own = SamplePass(FRESH, self.joined[0], np.array(positions, np.int32), self._n_parts(height))
        split = draw_split(own, sink, (height, width), background)
        if split is None:
            refuse_changed()
        frags = self.fragments(split.ids[None], split.depth[None], positions)
        frags._whole_scene = Fragments.of_split(split, int(self.scene.first_vertices[-1]), self.scene.n_triangles)
        return frags

    def draw(
        self, targets: list[engine.Target], positions: Sequence[tuple[int, int]], height: int, *, is_first: bool = True
    ) -> None:
        """Draw the scene at each sample into targets of that many rows; (0, 0) is the pixel's centre.

        `is_first`: clear them before; otherwise their samples stay unless something lies before them.
        """
        for k, part in enumerate(self._in_turn(Sink(targets[0].sink))):
            part._draw(targets, positions, height, is_first=is_first and k == 0)

    def _draw(
        self, targets: list[engine.Target], positions: Sequence[tuple[int, int]], height: int, *, is_first: bool
    ) -> None:
        """The same, all instances in one way."""
        n_parts = self._n_parts(height)
        if self._can_cluster(Sink(targets[0].sink)) and self._pays_in_clusters:
            order = self._in_order(np.arange(len(self.scene)), Sink(targets[0].sink))
            if is_first and Sink(targets[0].sink) in (Sink.NEAREST, Sink.FARTHEST):
                shape = engine.Target.bounds_shape(height, self._view.size[0])
                for target in targets:
                    target.keep_bounds(FRESH.empty("bounds", shape, np.float32))
            if draw_placed(self, order, targets, positions, height, n_parts, is_first=is_first):
                return
        if len(targets) > 1 and len(self.joined) == 1 and choices.can_slice(self._view) and is_first:
            own = SamplePass(FRESH, self.joined[0], np.array(positions, np.int32), n_parts)
            if draw_sorted(own, targets, (height, self._view.size[0])):
                refuse_changed()
            return
        if self.joined:
            self._draw_meshes(self.joined, targets, positions, height, is_first=is_first)
        else:
            self._draw_rounds(targets, positions, height, is_first=is_first)

    def _draw_rounds(
        self, targets: list[engine.Target], positions: Sequence[tuple[int, int]], height: int, *, is_first: bool
    ) -> None:
        """Draw whole instances; where order does not matter those whose boxes may show, nearest first."""
        sink, order = Sink(targets[0].sink), np.arange(len(self.scene))
        may_leave_out = choices.can_cluster(self._view, sink)
        may_hide = may_leave_out and sink in (Sink.NEAREST, Sink.FARTHEST)
        if may_leave_out:
            order = self.shown(order, targets, positions, is_drawn=False)
        if may_hide:
            order = self._in_order(order, sink)
        n_left = len(order)
        for some in self._ranges(order, FIRST_ROUND if may_hide else np.inf):
            n_left -= len(some)
            if may_hide and not is_first:
                some = self.shown(some, targets, positions, is_drawn=True)
            if len(some):
                ends = {"is_first": is_first, "is_last": n_left == 0}
                self._draw_meshes(self.snap_all(some), targets, positions, height, **ends)
            is_first = False

    def _in_order(self, some: NDArray[np.intp], sink: Sink) -> NDArray[np.intp]:
        """Return some instances in the order in which they hide each other, about."""
        order = some[front_to_back(self.scene, self._clip_from_world, some)]
        return order[::-1].copy() if sink is Sink.FARTHEST else order

    def _draw_meshes(
        self,
        meshes: list[engine.SnappedMesh],
        targets: list[engine.Target],
        positions: Sequence[tuple[int, int]],
        height: int,
        *,
        is_first: bool,
        is_last: bool = True,
    ) -> None:
        """Draw some snapped meshes."""
        for target, at in zip(targets, positions, strict=True):
            scenes = [mesh.at_sample(*at) for mesh in meshes]
            run_parts(rows_of(scenes, target, is_first=is_first, is_last=is_last), height, self._n_parts(height))


def rows_of(
    scenes: list[engine.SnappedMesh], target: engine.Target, *, is_first: bool, is_last: bool
) -> Callable[[int, int], None]:
    """Return a function that draws rows [first, end) of scenes into one target, which the first of all clears."""

    def draw_rows(first: int, end: int) -> None:
        for i, scene in enumerate(scenes):
            scene.draw(target, first, end - first, is_first and i == 0, is_last and i == len(scenes) - 1)

    return draw_rows
