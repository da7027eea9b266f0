"""Places the instances of a scene before a camera: their matrices, the sides that show, ids; snapped on demand.

In: a `Shot` and a checked view.  Out: `Placed`, which `draw_scene` draws and kernels shade.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.arrays import INT32_MAX, set_aligned
from topleft._core.base.cached import cached_property
from topleft._core.base.memory import FRESH
from topleft._core.base.options import Sink
from topleft._core.base.threads import run_parts
from topleft._core.raster import choices
from topleft._core.raster.cluster_draw import ClusteredMesh
from topleft._core.raster.rasterize import refuse_many
from topleft._core.raster.sampling import sample_positions
from topleft._core.raster.snap import snap_mesh
from topleft._core.raster.view import CULL_CODES, View, ViewOptions
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.lens import Lens
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import trusted_mesh
from topleft._meshes.picture.bend import BentMesh, bend
from topleft._meshes.picture.fragments import Ids, MeshFragments, SceneFragments
from topleft._meshes.picture.planes import tell_of_planes
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene.scene import Instance, Scene

#: Snapped vertices that are held at a time: 16 bytes each.
VERTICES_AT_ONCE = 1 << 20

#: cull codes of a view (tl_cull) for an instance or a camera that mirrors.
MIRRORED = np.array([0, 2, 1], np.int32)


#: The second mirror of mirrored instances that stand in eye space.
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])

Mask = NDArray[np.bool_]


def bend_scene(
    scene: Scene, camera: Camera, lens: Lens, frame: tuple[int, int], *, near_clip: bool
) -> tuple[Scene, tuple[BentMesh, ...]]:
    """Return the scene as the camera's lens bends it, in eye space, and its meshes, for a whole picture of a size.

    Mirrored instances are mirrored twice, so that they stay mirrored for `cull`.
    """
    scene.check_counted("a scene behind a lens")
    many, instances = [], []
    for instance in scene:
        mesh = instance.mesh
        own = camera.placed(instance.transform)
        bent = bend(mesh.vertices, mesh.triangles, own, lens, frame, near_clip=near_clip)
        place = MIRROR if instance.is_mirrored else np.eye(4)
        points = bent.points_eye * np.diag(MIRROR)[:3] if instance.is_mirrored else bent.points_eye
        many.append(bent)
        instances.append(Instance(trusted_mesh(points, bent.triangles), place))
    return Scene(instances), tuple(many)


@dataclass(eq=False)
class Placed:
    """A scene before a camera, and the view of a picture; each instance is snapped when it is needed."""

    scene: Scene
    """The scene as drawn."""
    whole: Scene
    """The scene that ids count the triangles of: the drawn scene except through a lens."""
    camera: Camera
    clip_from_world: NDArray[np.float64]
    view: View
    """The view of all instances, without matrix and sides."""
    bent: tuple[BentMesh, ...] | None = None
    """The parts that a lens makes of each instance."""
    is_mesh: bool = False
    """Whether the subject is a mesh alone, not a scene."""
    with_depth: bool = True
    material: Material | None = None
    """Goes before the materials of the meshes."""
    may_cluster: bool = True
    pays_in_clusters: bool | None = None
    """Whether drawing in clusters pays; None until that is asked."""
    given_numbers: NDArray[np.int64] | None = None
    """The id of triangle 0 of each instance, of a scene that is a part of another."""
    _last: tuple[int, View] | None = field(default=None, init=False)
    """The last instance that was needed, and its view: often thrice in turn."""
    _n_kept: int = field(default=0, init=False)
    """Vertices of the snapped instances that are kept."""

    @classmethod
    def of(
        cls, shot: Shot, view: View, material: Material | None = None, *, with_depth: bool = True,
        mesh_view: View | None = None,
    ) -> Placed:  # fmt: skip
        """Place a shot; `mesh_view`: the view of a mesh alone with the sides that it shows, if these are known."""
        camera, whole = shot.camera, shot.scene
        if shot.may_cut and view.near_clip and view.far_clip:
            tell_of_planes(shot)
        if camera.lens is not None:
            scene, bent = bend_scene(whole, camera, camera.lens, view.viewport, near_clip=view.near_clip)
            matrix = camera.drawn_from_eye(view.viewport)
            return cls(scene, whole, camera, matrix, view, bent, shot.is_mesh, with_depth, material)
        matrix = camera.drawn_from_world(view.viewport)
        placed = cls(whole, whole, camera, matrix, view, None, shot.is_mesh, with_depth, material)
        if mesh_view is not None:
            placed._last = 0, mesh_view.but(transform=matrix, static=whole[0].mesh)
        return placed

    @classmethod
    def parse(
        cls, shot: Shot, options: dict[str, Any], material: Material | None = None, *, with_depth: bool = True
    ) -> Placed:
        """Place a shot by the options of a verb, which are checked; `with_depth`: the verb gives ids and depth."""
        view = View.parse(shot.size, cast(ViewOptions, options | shot.camera.depth_options))
        if with_depth:
            view.refuse_classic("depth")
            refuse_many(view, "rasterize")
        return cls.of(shot, view, material, with_depth=with_depth)

    def __getstate__(self) -> dict[str, Any]:
        """The state for another process, which makes views of instances itself."""
        made = ("_kept", "_sides_of_looks")
        own = {name: value for name, value in vars(self).items() if name not in made}
        return own | {"_last": None, "_n_kept": 0}

    __setstate__ = set_aligned

    @property
    def is_plain_mesh(self) -> bool:
        """Whether the fragments of the only instance are the fragments of the subject: a mesh without a lens."""
        return self.is_mesh and self.bent is None

    def alone(self, i: int, size: tuple[int, int], origin: tuple[int, int]) -> Placed:
        """Return one instance before the camera, in a window of the picture; a lens does not bend it again."""
        scene, view = Scene([self.scene[i]]), self.view.but(size=size, origin=origin)
        if self.bent is None:
            return replace(self, scene=scene, whole=scene, view=view)
        return replace(self, scene=scene, whole=Scene([self.whole[i]]), view=view, bent=(self.bent[i],))

    def with_scene(self, scene: Scene) -> Placed:
        """Return another scene before the camera, made for this picture alone: no mesh of it is drawn in clusters."""
        return replace(self, scene=scene, may_cluster=False)

    def fragments(self, ids: Ids, depth: NDArray[np.float32]) -> SceneFragments:
        """Return drawn planes (S, H, W) as fragments of the scene or of its only mesh."""
        return self.kind_of_fragments(ids, depth, self, self.positions)

    @property
    def kind_of_fragments(self) -> type[SceneFragments]:
        """Of a scene, or of its only mesh."""
        return MeshFragments if self.is_mesh else SceneFragments

    @cached_property
    def positions(self) -> list[tuple[int, int]]:
        """Where the samples of a pixel lie, in sub-pixels from its centre."""
        return list(map(tuple, sample_positions(self.view.sampling.n_samples, self.view.grid_bits).tolist()))

    def masks_as_drawn(self, masks: Sequence[Mask | None]) -> Sequence[Mask | None]:
        """Return masks of the triangles of each instance as masks of the drawn ones: of the parts that a lens makes."""
        if self.bent is None:
            return masks
        return [mask if mask is None else mask[bent.source] for mask, bent in zip(masks, self.bent, strict=True)]

    def whole_ids(self, ids: Ids) -> Ids:
        """Return ids in terms of the whole scene: as they are without a lens."""
        if self.bent is None or all(one.parts is None for one in self.bent):
            return ids
        firsts = zip(self.bent, self.whole.first_ids[:-1].tolist(), strict=True)
        wholes = np.concatenate([*(one.source + first for one, first in firsts), [-1]]).astype(np.int32)
        return wholes[ids]  # part -1, none, is the last

    def snap(self, i: int) -> engine.SnappedMesh:
        """Return an instance, snapped; it draws the ids of its range. Small scenes are kept."""
        return self.snap_all(np.array([i]))[0]

    def snap_all(self, some: NDArray[np.intp]) -> list[engine.SnappedMesh]:
        """Return some instances, snapped, as `snap` does."""
        snapped = [mesh or self._snap_alone(i) for i, mesh in zip(some.tolist(), self._snap(some), strict=True)]
        if self._n_kept < VERTICES_AT_ONCE:
            self._kept.update(zip(some.tolist(), snapped, strict=True))
            self._n_kept += int(self._vertex_counts[some].sum())
        return snapped

    def _snap(self, some: NDArray[np.intp]) -> list[engine.SnappedMesh | None]:
        """Return some instances, all in one call; None for an instance that is to be snapped alone."""
        numbers = some.tolist()
        if all(i in self._kept for i in numbers):
            return [self._kept[i] for i in numbers]
        placed = self._project(some)
        return [None] * len(some) if placed is None else [placed.mesh(k) for k in range(len(some))]

    def _project(self, some: NDArray[np.intp]) -> engine.PlacedMeshes | None:
        """Return some instances without those that are snapped alone; None: all are."""
        view, n = self.view, len(some)
        firsts = np.concatenate([[0], np.cumsum(self._vertex_counts[some])])
        n_threads = choices.threads_to_snap(view.threads, int(firsts[-1]), self.scene.n_triangles)
        is_sliced = n_threads <= n  # fewer instances than threads: each is the work of all of them
        if not (is_sliced and view.grid_bits == view.subpixel_bits) or 0 in view.size:
            return None
        points = FRESH.empty("points", (int(firsts[-1]), engine.PLACED), np.float64) if view.is_exact else None
        shape = int(firsts[-1]) * engine.VERTEX_BYTES
        room = FRESH.empty("records", (shape,), np.uint8) if points is None else points
        culls, is_apart = self.sides
        if len(self.in_parts):  # of which all parts would be drawn
            is_apart = is_apart.copy()
            is_apart[self.in_parts] = True
        meshes, of_instance = self.scene.mesh_list
        placed = engine.PlacedMeshes(
            meshes, of_instance[some], self.clip_from_objects[some], culls[some], self.numbers[some],
            is_apart[some].view(np.uint8), view.engine_viewport(), view.raster_state, room, firsts,
        )  # fmt: skip
        run_parts(placed.project, n, n_threads)
        return placed

    @cached_property
    def _kept(self) -> dict[int, engine.SnappedMesh]:
        """Instances that have been snapped, `VERTICES_AT_ONCE` vertices at most."""
        return {}

    @cached_property
    def _vertex_counts(self) -> NDArray[np.int64]:
        return np.diff(self.scene.first_vertices)

    def _snap_alone(self, i: int) -> engine.SnappedMesh:
        mesh = self.scene[i].mesh
        snapped = snap_mesh(FRESH, mesh.vertices, mesh.triangles, self.view_of(i), with_depth=self.with_depth, out=None)
        return snapped.mesh.numbered_from(int(self.numbers[i]))

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """The id of triangle 0 of each instance."""
        if self.given_numbers is not None:
            return self.given_numbers
        has_ids = self.with_depth and self.scene.n_triangles <= INT32_MAX
        return self.scene.first_ids[:-1] if has_ids else np.zeros(len(self.scene), np.int64)

    @cached_property
    def in_parts(self) -> NDArray[np.intp]:
        """The instances whose meshes are parts of several levels."""
        found = [at for mesh, at in self.scene.meshes.values() if mesh.is_in_parts]
        return np.sort(np.concatenate(found)) if found else np.empty(0, np.intp)

    @cached_property
    def sides(self) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
        """The `tl_cull` of each instance, and which have triangles with two sides beside triangles with one side."""
        view, key = self.view, (self.view.cull, self.view.sides_by_material)
        kept = self.whole.cache.sides if self.material is None else {}
        found = kept.get(key)
        if found is None:
            sides: NDArray[np.int32] = np.full(len(self.scene), view.cull, np.int32)
            is_mixed = np.zeros(len(sides), np.bool_)
            for _, _, at in self.whole.looks(self.material) if view.sides_by_material else ():
                sides[at], is_single = self._sides_of(self.whole[at[0]])
                is_mixed[at] = is_single is not None
            found = kept[key] = sides, is_mixed
        culls, is_mixed = found
        is_mirrored = self.scene.are_mirrored != self.camera.is_mirrored
        return (np.where(is_mirrored, MIRRORED[culls], culls) if is_mirrored.any() else culls), is_mixed

    @cached_property
    def _sides_of_looks(self) -> dict[tuple[int, int], tuple[int, NDArray[np.uint8] | None]]:
        """What `_sides_of` has returned, by mesh and material."""
        return {}

    def _sides_of(self, whole: Instance) -> tuple[int, NDArray[np.uint8] | None]:
        """The `tl_cull` of an instance that is no mirror; 1 for each triangle with one side, where others have two."""
        key = id(whole.mesh), id(whole.material)
        found = self._sides_of_looks.get(key)
        if found is None:
            material = whole.material if self.material is None else self.material
            is_single = whole.mesh.single_sided(material) if self.view.sides_by_material else None
            is_all = is_single is not None and bool(is_single.all())
            found = CULL_CODES["back"] if is_all else self.view.cull, None if is_all else is_single
            self._sides_of_looks[key] = found
        return found

    def snap_parts(
        self, some: NDArray[np.intp], triangles_of: Callable[[int], NDArray[np.int32]]
    ) -> list[engine.SnappedMesh]:
        """Return some instances snapped; of a large mesh in clusters the part with some triangles."""
        in_clusters = [i not in self._kept and self._is_clustered(i) for i in some.tolist()]
        n_pixels = self.view.size[0] * self.view.size[1]
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
            return self.clustered(i).part(triangles_of(i)) if of_clusters else self._snap_alone(i)

        return [snapped(i, of_clusters=own) for i, own in zip(some.tolist(), in_clusters, strict=True)]

    def _is_clustered(self, i: int) -> bool:
        """Whether an instance has clusters that know its sides."""
        mesh = self.scene[i].mesh
        may_cluster = mesh.has_clusters and (self.may_cluster or mesh.is_in_parts)
        return may_cluster and choices.can_cluster(self.view, Sink.NEAREST) and not bool(self.sides[1][i])

    def view_of(self, i: int) -> View:
        """How an instance is seen."""
        last = self._last
        if last is None or last[0] != i:
            self._last = last = i, self._make_view(i)
        return last[1]

    def _make_view(self, i: int) -> View:
        one, (cull, is_single) = self.scene[i], self._sides_of(self.whole[i])
        is_mirrored, single_sided = one.is_mirrored != self.camera.is_mirrored, None
        if is_single is not None:
            back = CULL_CODES["front" if is_mirrored else "back"]
            single_sided = is_single if self.bent is None else is_single[self.bent[i].source], back
        cull = int(MIRRORED[cull]) if is_mirrored else cull
        transform = self.clip_from_objects[i]
        static = one.mesh if self.may_cluster or one.mesh.is_in_parts else None
        return self.view.but(transform=transform, cull=cull, single_sided=single_sided, static=static)

    def clustered(self, i: int) -> ClusteredMesh:
        """Return an instance in clusters."""
        return ClusteredMesh(self.scene[i].mesh.clusters, self.view_of(i), int(self.numbers[i]))

    @cached_property
    def clip_from_objects(self) -> NDArray[np.float64]:
        return self.scene.clip_from_objects(self.clip_from_world)

    @cached_property
    def is_float32(self) -> NDArray[np.bool_]:
        is_float32 = np.empty(len(self.scene), np.bool_)
        for mesh, at in self.scene.meshes.values():
            is_float32[at] = mesh.vertices.dtype == np.float32
        return is_float32

    def chunks(self) -> Iterator[list[engine.SnappedMesh]]:
        """Yield the instances in their order, as many at a time as `VERTICES_AT_ONCE` allows."""
        return map(self.snap_all, self.ranges(np.arange(len(self.scene))))

    def ranges(self, order: NDArray[np.intp], n_most: float = np.inf) -> Iterator[NDArray[np.intp]]:
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
