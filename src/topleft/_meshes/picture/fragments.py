"""Holds a visibility buffer by instances: of a mesh or a scene, with or without a lens.

Input: ids that count the triangles of all instances, and the placed scene. Output: `SceneFragments`, and its parts:
rectangles of pixels with the fragments and the mesh as they were drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.array_types import F64
from topleft._core.base.arrays import as_aligned, as_array, as_values, set_aligned, shown
from topleft._core.base.cached import cached_property
from topleft._core.base.memory import empty
from topleft._core.raster.fragments import Fragments, Viewer, view_of
from topleft._core.raster.peel import DepthLayers
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.bend import BentMesh
from topleft._meshes.picture.shade import ShownInstance
from topleft._meshes.scene.scene import Instance, Scene, counted_ranges

if TYPE_CHECKING:
    from topleft._meshes.picture.placed import Placed

Ids = NDArray[np.int32] | NDArray[np.int64]
"""Ids of the triangles of all instances: int64 where int32 does not count them."""

WHOLE = slice(None), slice(None)
"""The box of a part that is all of the picture."""


@dataclass(frozen=True, eq=False)
class VisiblePart:
    """The visible part of one instance: its index, the rectangle of pixels round it, and the fragments there.

    `frags` count the triangles that were drawn: of `bent` through a lens, else of the mesh.
    """

    i: int
    box: tuple[slice, slice]
    frags: Fragments
    instance: Instance
    bent: BentMesh | None = None

    @property
    def mesh(self) -> Mesh:
        """The mesh of the instance."""
        return self.instance.mesh

    @property
    def place(self) -> F64:
        """World from object, (4, 4)."""
        return self.instance.transform

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """Where in the rectangle the instance shows."""
        return self.frags.mask

    @cached_property
    def shown(self) -> ShownInstance:
        """The mesh as it was drawn, for kernels."""
        ((_, snapped, first),) = self.frags._visible_meshes
        mesh = self.mesh if self.bent is None else self.bent.mesh_of(self.mesh)
        return ShownInstance(snapped, mesh, self.place, first, i=self.i)

    def interpolate(self, values: Any, background: float, *, derivatives: bool = False) -> NDArray[np.float32]:
        """Return an attribute of the mesh in the rectangle, or its derivatives."""
        array: NDArray[Any] = as_values(values, len(self.mesh.vertices), len(self.mesh.triangles))
        if self.bent is not None and (derivatives or self.bent.parts is not None):
            corners = array if array.ndim == 3 else array.reshape(len(array), -1)[self.mesh.triangles]
            corners = self.bent.at_corners(corners).astype(np.float32)
            found = self.frags._derivatives(corners) if derivatives else self.frags._interpolated(corners, background)
            return found if array.ndim > 1 else found[:, :, 0]
        return self.frags._derivatives(array) if derivatives else self.frags._interpolated(array, background)

    def barycentric(self) -> NDArray[np.float32]:
        """Return the weights of the three vertices of the triangle of the mesh that shows in each pixel."""
        if self.bent is None or self.bent.parts is None:
            return self.frags.barycentric()
        corners = np.broadcast_to(np.eye(3, dtype=np.float32), (len(self.mesh.triangles), 3, 3))
        return self.interpolate(corners, 0.0)


def parts_of(frags: Fragments, scene: Scene) -> Sequence[VisiblePart]:
    """The visible parts of the instances that show, of the scene as drawn; a mesh has one part."""
    parts: Sequence[VisiblePart] | None = getattr(frags, "parts", None)
    return [VisiblePart(0, WHOLE, frags, scene[0])] if parts is None else parts


def shown_of(frags: Fragments, scene: Scene) -> Sequence[ShownInstance]:
    """The instances that some sample sees, as they are shaded, of the scene that was drawn."""
    found = []
    for i, snapped, first in frags._visible_meshes:
        one = scene[i]
        found.append(ShownInstance(snapped, frags._parts_of(i, one.mesh), one.transform, first, one.material, i))
    return found


def join(
    parts: Sequence[VisiblePart], shape: tuple[int, ...], background: Any, make: Callable[[VisiblePart], NDArray[Any]]
) -> NDArray[np.float32]:
    """A picture made part by part; the picture of a part that fills it is returned, not copied."""
    if len(parts) == 1 and parts[0].box == WHOLE:
        return make(parts[0])
    picture = empty(shape, np.float32)
    picture[...] = background
    for part in parts:
        to = picture[part.box]
        np.copyto(to, make(part), where=part.seen.reshape(part.seen.shape + (1,) * (to.ndim - 2)))
    return picture


class InstanceIds:
    """Tells instances by the ids of their triangles, in a buffer or in layers."""

    id: Any  # Ids
    placed: Any

    @cached_property
    def instance(self) -> NDArray[np.int32]:
        """Index of the instance that shows, int32, -1 where there is none."""
        return instance_of_ids(self.id, self.placed.whole.first_ids)

    @cached_property
    def triangle(self) -> NDArray[np.int32]:
        """Index of the triangle in its mesh, int32, -1 where there is none."""
        return local_ids(self.id, self.instance, self.placed.whole.first_ids)


class SceneFragments(InstanceIds, Fragments):
    """The visibility buffer of a `Scene`, from `rasterize_mesh`.

    An instance is snapped again when an attribute of it is needed.

    Attributes
    ----------
    instance : ndarray of int32, shape (H, W)
        Index of the instance that shows in the pixel, -1 where there is none.
    triangle : ndarray of int32, shape (H, W)
        Index of its triangle in the mesh of that instance, -1 where there is none.
    id : ndarray of int32, shape (H, W)
        The triangles of all instances counted in their order: the number that decides ties. int64 where there are more
        than 2**31 - 1 of them.
    depth, mask
        As in `Fragments`. `interpolate` takes a sequence of arrays, one of each instance, all with as many channels.
    samples_instance, samples_triangle, samples_id, samples_depth : ndarray, shape (H, W, S)
        `instance`, `triangle`, `id` and `depth` of each sample, with several a pixel.

    Examples
    --------
    >>> import topleft as tl
    >>> cube = tl.Mesh(*tl.scenes.cube())
    >>> scene = tl.Scene([tl.Instance(cube)])
    >>> frags = tl.rasterize_mesh(scene, tl.Camera.framing(scene), (16, 16))
    >>> int(frags.instance[8, 8]), int(frags.instance[0, 0])
    (0, -1)
    """

    _subject_kind = "Scene"

    #: The fragments of the only instance, as an array draws it; None of several.
    _one: Fragments | None = None

    def __init__(
        self, ids: Ids, depth: NDArray[np.float32], placed: Placed, positions: Sequence[tuple[int, int]]
    ) -> None:
        """Take drawn planes (S, H, W), and where samples lie."""
        self._planes = ids, depth
        self.placed = placed
        self.positions = positions
        self.id, self._depth = placed.whole_ids(ids[0]), depth[0]

    @classmethod
    def of(cls, drawn: Fragments, placed: Placed) -> Self:
        """Return the fragments of a scene from the fragments of all its triangles as one mesh."""
        planes = drawn._planes or (drawn.id[None], drawn.depth[None])
        frags = cls(*planes, placed, placed.positions)
        frags._one = drawn if len(placed.scene.first_ids) == 2 else None
        return frags

    def _of_sample(self, k: int, ids: Ids, depth: NDArray[np.float32]) -> Self:
        return type(self)(ids[None], depth[None], self.placed, self.positions[k : k + 1])

    def __repr__(self) -> str:
        height, width = self.id.shape
        return f"SceneFragments({width}x{height}, {len(self.whole)} instances, {self.whole.n_triangles} triangles)"

    def __getstate__(self) -> dict[str, Any]:
        """The state for another process, which makes the parts itself: they refer to memory of this one."""
        state = vars(self) | {"_planes": self.drawn_planes}
        return {name: state[name] for name in state.keys() - {"parts", "_one", "_meshes", "_visible_meshes"}}

    __setstate__ = set_aligned

    @property
    def whole(self) -> Scene:
        """The scene that ids count the triangles of."""
        return self.placed.whole

    @cached_property
    def _found(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Which instance shows (H, W), and the boxes of pixels round each (N, 4): left, top, right, bottom."""
        ids: Ids = np.ascontiguousarray(as_aligned(self.id))
        boxes = np.tile(np.array([*ids.shape[::-1], 0, 0], np.int32), (len(self.placed.whole.first_ids) - 1, 1))
        return find_instances(ids, self.placed.whole.first_ids, boxes), boxes

    @cached_property
    def instance(self) -> NDArray[np.int32]:
        """Index of the instance that shows, int32, -1 where there is none."""
        return super().instance if self._one is not None else self._found[0]

    @cached_property
    def samples_instance(self) -> NDArray[np.int32]:
        """Index of the instance that each sample sees, int32 (H, W, S)."""
        return instance_of_ids(self.samples_id, self.placed.whole.first_ids)

    @cached_property
    def samples_triangle(self) -> NDArray[np.int32]:
        """Index of the triangle in its mesh that each sample sees, int32 (H, W, S)."""
        return local_ids(self.samples_id, self.samples_instance, self.placed.whole.first_ids)

    def _whole(self, ids: Ids) -> Ids:
        return self.placed.whole_ids(ids)

    def _counts(self) -> list[tuple[int, int]]:
        return counts_of(self.whole)

    def _parts_of(self, i: int, mesh: Mesh) -> Mesh:
        return mesh if self.placed.bent is None else self.placed.bent[i].mesh_of(mesh)

    @cached_property
    def _visible_meshes(self) -> tuple[tuple[int, engine.SnappedMesh, int], ...]:
        if self._one is not None:
            return tuple(self._one._visible_meshes)
        ids, first_ids = self._buffers().ids, self.placed.scene.first_ids
        width, height = ids.shape[:0:-1]
        if len(first_ids) == 2:  # the only instance may be anywhere
            boxes = np.array([[0, 0, width, height]], np.int32)
        else:
            boxes = np.tile(np.array([width, height, 0, 0], np.int32), (len(first_ids) - 1, 1))
            for plane in ids:
                find_instances(np.ascontiguousarray(as_aligned(plane)), first_ids, boxes)
        firsts, sample = first_ids.tolist(), self.positions[0]

        def part(i: int) -> NDArray[np.int32]:
            left, top, right, bottom = boxes[i].tolist()
            return local_part(ids[:, top:bottom, left:right], firsts[i], firsts[i + 1])

        shown = np.flatnonzero(boxes[:, 2] > 0)
        snapped = self.placed.snap_parts(shown, part)
        return tuple((i, mesh.at_sample(*sample), firsts[i]) for i, mesh in zip(shown.tolist(), snapped, strict=True))

    @cached_property
    def parts(self) -> tuple[VisiblePart, ...]:
        """The visible parts of the instances that show, in their order."""
        placed, bent = self.placed, self.placed.bent
        if self._one is not None and placed.scene.n_triangles:
            return (VisiblePart(0, WHOLE, self._one, self.whole[0], None if bent is None else bent[0]),)
        boxes, ids, parts = self._found[1].tolist(), self._buffers().ids[0], []
        for i, snapped, first in self._visible_meshes:
            (left, top, right, bottom), mesh = boxes[i], placed.scene[i].mesh
            if right > left:  # otherwise other samples alone see it
                box = slice(top, bottom), slice(left, right)
                local = local_part(ids[box], first, first + len(mesh.triangles))
                numbers = len(mesh.vertices), len(mesh.triangles)
                frags = Fragments(local, self.depth[box], snapped.moved(left, top), *numbers)
                frags.drawn_from(mesh.vertices, mesh.triangles, placed.view_of(i))
                parts.append(VisiblePart(i, box, frags, self.whole[i], None if bent is None else bent[i]))
        return tuple(parts)

    def barycentric(self) -> NDArray[np.float32]:
        """Return the weights of the three vertices of the triangle that shows in each pixel; see `Fragments`."""
        return join(self.parts, (*self.id.shape, 3), 0.0, lambda part: part.barycentric())

    def distance(self, camera: Viewer) -> NDArray[np.float32]:
        """Return the distance of each pixel along the view, as `Fragments.distance` does."""
        view = view_of(camera)

        def distances(part: VisiblePart) -> NDArray[np.float32]:
            instance = self.whole[part.i]
            row = engine.product(view[2], instance.transform)
            return part.interpolate(-(engine.product(instance.mesh.vertices, row[:3]) + row[3]), np.inf)

        return join(self.parts, self.id.shape, np.inf, distances)

    def _checked(self, values: Any) -> list[NDArray[Any]]:
        n = len(self.whole)
        if not isinstance(values, Iterable):
            raise TypeError(f"values must be one array for each of {n} instances, got {shown(values)}")
        arrays = [as_array("values", array) for array in values]
        if len(arrays) != n:
            raise ValueError(f"values must be one array for each of {n} instances, got {len(arrays)}")
        shapes = {() if array.ndim < 2 else array.shape[-1:] for array in arrays}
        if len(shapes) > 1:
            raise ValueError(f"values must have as many channels for each instance, got {sorted(shapes)}")
        return arrays

    def _interpolated(self, arrays: list[NDArray[Any]], background: float) -> NDArray[np.float32]:  # type: ignore[override]
        """The attribute, part by part."""
        shape = *self.id.shape, *arrays[0].shape[1:][-1:]
        return join(self.parts, shape, background, lambda part: part.interpolate(arrays[part.i], background))

    def _derivatives(self, arrays: list[NDArray[Any]]) -> NDArray[np.float32]:  # type: ignore[override]
        """The derivatives, part by part."""
        shape = *self.id.shape, *arrays[0].shape[1:][-1:], 2
        return join(self.parts, shape, 0.0, lambda part: part.interpolate(arrays[part.i], 0.0, derivatives=True))


class MeshFragments(SceneFragments):
    """The visibility buffer of a mesh that was drawn as its scene of one instance: behind a lens, or with holes.

    `triangle` and `id` hold triangles of the mesh, and attributes are of its vertices.
    """

    _subject_kind = "Mesh"

    def __repr__(self) -> str:
        return Fragments.__repr__(self)

    @property
    def _n_triangles(self) -> int:  # type: ignore[override]
        return self.whole.n_triangles

    def _checked(self, values: Any) -> list[NDArray[Any]]:
        (counts,) = self._counts()
        return [as_values(values, *counts)]


class SceneDepthLayers(InstanceIds, DepthLayers):
    """The nearest layers of every pixel of a `Scene`.

    Attributes
    ----------
    instance, triangle, id : ndarray of int32, shape (H, W, K)
        As in `SceneFragments`, of each layer; -1 where there are fewer.
    depth : ndarray of float32, shape (H, W, K)
        As in `DepthLayers`.

    Examples
    --------
    >>> import topleft as tl
    >>> cube = tl.Mesh(*tl.scenes.cube())
    >>> scene = tl.Scene([tl.Instance(cube)])
    >>> layers = tl.visible_layers(scene, tl.Camera.framing(scene), (16, 16), layers=2)
    >>> layers.instance[8, 8].tolist()
    [0, 0]
    """

    def __init__(self, ids: NDArray[np.int32], depth: NDArray[np.float32], placed: Placed) -> None:
        """Take planes (K, H, W)."""
        self.planes = ids, depth
        self.placed = placed

    @property
    def n_triangles(self) -> int:
        """Triangles of all instances together."""
        return int(self.placed.whole.first_ids[-1])

    @property
    def n_vertices(self) -> None:
        """None: several meshes have vertices."""
        return

    @property
    def id(self) -> NDArray[np.int32]:  # none assigns it
        """The triangles of all instances counted in their order, int32 (H, W, K)."""
        return np.moveaxis(self.planes[0], 0, -1)

    def layer(self, k: int) -> SceneFragments:
        """Return layer k, 0 the nearest, as a visibility buffer, which computes attributes."""
        k = range(len(self))[k]
        ids, depth = self.planes
        return SceneFragments(ids[k : k + 1], depth[k : k + 1], self.placed, [(0, 0)])


def instance_of_ids(ids: Ids, first_ids: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return the instance that each id belongs to, -1 for -1."""
    if len(first_ids) == 2:
        return ids >> 31
    flat: Any = np.ascontiguousarray(ids).reshape(1, -1)
    return find_instances(flat, first_ids, None).reshape(ids.shape)


def find_instances(ids: Ids, first_ids: NDArray[np.int64], boxes: NDArray[np.int32] | None) -> NDArray[np.int32]:
    """Return the instance of each of contiguous ids (H, W), and widen the boxes of visible instances."""
    found = empty(ids.shape, np.int32)
    if ids.dtype == np.int32:
        engine.find_instances(cast("NDArray[np.int32]", ids), first_ids, found, boxes)
        return found
    found[...] = -1
    for first, end in counted_ranges(first_ids):
        own, part = local_part(ids, *first_ids[[first, end]].tolist()), empty(ids.shape, np.int32)
        own_ids = first_ids[first : end + 1] - first_ids[first]
        engine.find_instances(own, own_ids, part, None if boxes is None else boxes[first:end])
        np.add(part, np.int32(first), out=found, where=own >= 0)
    return found


def local_part(ids: Ids, first: int, end: int) -> NDArray[np.int32]:
    """Return ids in [first, end) less `first`, which int32 counts; -1 for others."""
    own: NDArray[Any] = ids - ids.dtype.type(first)
    own[own.view(np.dtype(f"u{own.itemsize}")) >= end - first] = -1
    return own.astype(np.int32, copy=False)


def local_ids(ids: Ids, instance: NDArray[np.int32], first_ids: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return the index of each triangle in its mesh, -1 for -1."""
    if len(first_ids) == 2:
        return cast("NDArray[np.int32]", ids)
    first: NDArray[Any] = np.append(first_ids[:-1], 0).astype(ids.dtype)
    return (ids - first[instance]).astype(np.int32, copy=False)  # instance -1 takes the last of them, 0


def counts_of(scene: Scene) -> list[tuple[int, int]]:
    """Vertices and triangles of the mesh of each instance."""
    return [(len(one.mesh.vertices), len(one.mesh.triangles)) for one in scene]
