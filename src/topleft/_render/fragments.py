"""The visibility buffer of a scene: which instance, and which of its triangles, shows in each pixel.

In: ids that count the triangles of all instances, and the scene that they were drawn from.  Out: `SceneFragments`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import _engine
from topleft._base.arrays import as_values
from topleft._model.mesh import Mesh
from topleft._model.scene import Scene
from topleft._raster.fragments import Fragments
from topleft._raster.peel import DepthLayers
from topleft._raster.snap import Snapped

__all__ = ["Part", "SceneDepthLayers", "SceneFragments"]


class Placed(Protocol):
    """A scene as a camera sees it."""

    @property
    def scene(self) -> Scene:
        """The scene."""

    @property
    def first_ids(self) -> NDArray[np.int64]:
        """Where the ids of each instance begin, and their end: (N + 1,)."""

    def of(self, scene: Scene) -> Placed:
        """Return another scene, seen in the same way."""

    def draw(self, targets: list[_engine.Target], positions: Sequence[tuple[int, int]], height: int) -> None:
        """Clear targets of that many rows, one a sample, and draw what each sees."""

    def snap(self, i: int) -> Snapped:
        """Return an instance, snapped."""

    def snap_part(self, i: int, triangles: NDArray[np.int32]) -> _engine.Scene:
        """Return what some triangles of an instance need, snapped; maybe all of it."""


@dataclass(frozen=True, slots=True)
class Part:
    """What one instance shows: its index, the rectangle of pixels round that, and the fragments there."""

    instance: int
    rows: slice
    columns: slice
    frags: Fragments

    @property
    def box(self) -> tuple[slice, slice]:
        """The rectangle as an index of a picture."""
        return self.rows, self.columns


class SceneFragments(Fragments):
    """What `rasterize_mesh` returns of a `Scene`.

    An instance is snapped again when an attribute of it is asked for.

    Attributes
    ----------
    instance : ndarray of int32, shape (H, W)
        Index of the instance that shows in the pixel, -1 where there is none.
    triangle : ndarray of int32, shape (H, W)
        Index of its triangle in the mesh of that instance, -1 where there is none.
    id : ndarray of int32, shape (H, W)
        The triangles of all instances counted in their order: the number that decides ties.
    depth, mask
        As in `Fragments`.
    samples_instance, samples_triangle, samples_id, samples_depth : ndarray, shape (H, W, S)
        The same for each sample, with several a pixel.
    """

    _planes: tuple[NDArray[np.int32], NDArray[np.float32]]

    def __init__(
        self,
        ids: NDArray[np.int32],
        depth: NDArray[np.float32],
        placed: Placed,
        positions: Sequence[tuple[int, int]],
    ) -> None:
        """Take planes (S, H, W) and where their samples lie."""
        self.id, self._depth = ids[0], depth[0]
        self.samples_id = np.moveaxis(ids, 0, -1)
        self._placed = placed
        self._positions = positions
        self._planes = ids, depth

    def __repr__(self) -> str:
        height, width = self.id.shape
        first_ids = self.first_ids
        return f"SceneFragments({width}x{height}, {len(first_ids) - 1} instances, {first_ids[-1]} triangles)"

    @property
    def placed(self) -> Placed:
        """What was drawn."""
        return self._placed

    @property
    def first_ids(self) -> NDArray[np.int64]:
        """Where the ids of each instance begin, and their end: (N + 1,)."""
        return self.whole.first_ids

    @property
    def whole(self) -> Scene:
        """The scene that `triangle` counts the triangles of."""
        return self._placed.scene

    @property
    def n_drawn(self) -> list[tuple[int, int]]:
        """Vertices and triangles of the mesh of each instance."""
        return [(len(instance.mesh.vertices), len(instance.mesh.triangles)) for instance in self.whole]

    @property
    def positions(self) -> Sequence[tuple[int, int]]:
        """Where the samples lie."""
        return self._positions

    @property
    def planes(self) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Ids and depth of each sample, (S, H, W)."""
        return self._planes

    def forget(self) -> None:
        """Forget what was computed of buffers that have changed."""
        for name in ("instance", "triangle", "samples_instance", "samples_triangle", "parts"):
            self.__dict__.pop(name, None)

    @cached_property
    def instance(self) -> NDArray[np.int32]:
        """Index of the instance that shows in each pixel, int32 (H, W), -1 where there is none."""
        return instances_of(self.id, self.first_ids)

    @cached_property
    def triangle(self) -> NDArray[np.int32]:
        """Index of the triangle in its mesh, int32 (H, W), -1 where there is none."""
        return local_ids(self.id, self.instance, self.first_ids)

    @cached_property
    def samples_instance(self) -> NDArray[np.int32]:
        """Index of the instance that each sample sees, int32 (H, W, S)."""
        return instances_of(self.samples_id, self.first_ids)

    @cached_property
    def samples_triangle(self) -> NDArray[np.int32]:
        """Index of the triangle in its mesh that each sample sees, int32 (H, W, S)."""
        return local_ids(self.samples_id, self.samples_instance, self.first_ids)

    def sample(self, i: int) -> SceneFragments:
        """Return ids, depth and attributes at one sample of each pixel."""
        i = range(len(self._positions))[i]
        ids, depth = self._planes
        return SceneFragments(ids[i : i + 1], depth[i : i + 1], self._placed, self._positions[i : i + 1])

    def only(self, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> SceneFragments:
        """Return what is left when no other pixels than these show a triangle."""
        ids = np.full((1, *self.id.shape), -1, np.int32)
        ids[0, rows, cols] = self.id[rows, cols]
        return SceneFragments(ids, self.depth[None], self._placed, self._positions[:1])

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """What each instance shows that shows anything, in their order."""
        return tuple(self._make_parts())

    def _make_parts(self) -> Iterator[Part]:
        flat = np.flatnonzero(self.id >= 0)
        if not flat.size:
            return
        instance = self.instance.ravel()[flat]
        order = np.argsort(instance, kind="stable")
        found, starts = np.unique(instance[order], return_index=True)
        rows, columns = np.divmod(flat[order], self.id.shape[1])
        lows = [np.minimum.reduceat(axis, starts) for axis in (rows, columns)]
        ends = [np.maximum.reduceat(axis, starts) + 1 for axis in (rows, columns)]
        for i, top, left, bottom, right in zip(found.tolist(), *lows, *ends, strict=True):
            box = slice(int(top), int(bottom)), slice(int(left), int(right))
            first, end = self.first_ids[i : i + 2]
            ids = self.id[box]
            own = np.where((ids >= first) & (ids < end), ids - np.int32(first), np.int32(-1))
            scene = self._placed.snap_part(i, own).seen_from(*self._positions[0]).moved(int(left), int(top))
            mesh = self._placed.scene[i].mesh
            yield Part(i, *box, Fragments(own, self.depth[box], scene, len(mesh.vertices), len(mesh.triangles)))

    def barycentric(self) -> NDArray[np.float32]:
        """Return the weights of the three vertices of the triangle that shows in each pixel; see `Fragments`."""
        return self._join((3,), 0.0, lambda part: part.frags.barycentric())

    def interpolate(self, values: ArrayLike | Sequence[ArrayLike], *, background: float = 0.0) -> NDArray[np.float32]:
        """Return an attribute of the vertices at each visible pixel.

        Parameters
        ----------
        values : sequence of array_like
            One of each instance, as `Fragments.interpolate` takes it; all with as many channels.
        background : float
            Value where there is no triangle.

        Returns
        -------
        ndarray of float32, shape (H, W, K), or (H, W) for values of shape (V,)

        Raises
        ------
        ValueError
            If the number of arrays is not that of the instances, or they fit neither these nor each other.
        """
        n = len(self.first_ids) - 1
        arrays = [np.asarray(array) for array in values]  # type: ignore[union-attr]
        if len(arrays) != n:
            raise ValueError(f"values must be one array for each of {n} instances, got {len(arrays)}")
        shapes = {() if array.ndim < 2 else array.shape[-1:] for array in arrays}
        if len(shapes) > 1:
            raise ValueError(f"values must have as many channels for each instance, got {sorted(shapes)}")
        return self._join(
            shapes.pop(),
            background,
            lambda part: part.frags.interpolate(arrays[part.instance], background=background),
        )

    def _join(
        self, channels: tuple[int, ...], background: float, make: Callable[[Part], NDArray[Any]]
    ) -> NDArray[np.float32]:
        """Return a picture made part by part."""
        joined: NDArray[np.float32] = np.full((*self.id.shape, *channels), background, np.float32)
        for part in self.parts:
            seen = part.frags.mask
            joined[part.box][seen] = make(part)[seen]
        return joined


class SceneDepthLayers(DepthLayers):
    """The nearest layers of every pixel of a `Scene`.

    Attributes
    ----------
    instance, triangle, id : ndarray of int32, shape (H, W, K)
        As in `SceneFragments`, of each layer; -1 where there are fewer.
    depth : ndarray of float32, shape (H, W, K)
        As in `DepthLayers`.
    """

    def __init__(self, ids: NDArray[np.int32], depth: NDArray[np.float32], placed: Placed) -> None:
        """Take planes (K, H, W)."""
        self.planes = ids, depth
        self._placed = placed

    @property
    def placed(self) -> Placed:
        """What was drawn."""
        return self._placed

    @property
    def n_triangles(self) -> int:
        """Triangles of all instances together."""
        return int(self._placed.first_ids[-1])

    @property
    def n_vertices(self) -> None:
        """None: vertices are those of several meshes."""
        return

    @property
    def id(self) -> NDArray[np.int32]:
        """The triangles of all instances counted in their order, int32 (H, W, K)."""
        return np.moveaxis(self.planes[0], 0, -1)

    @cached_property
    def instance(self) -> NDArray[np.int32]:
        """Index of the instance of each layer, int32 (H, W, K)."""
        return instances_of(self.id, self._placed.first_ids)

    @cached_property
    def triangle(self) -> NDArray[np.int32]:
        """Index of the triangle in its mesh, int32 (H, W, K)."""
        return local_ids(self.id, self.instance, self._placed.first_ids)

    def layer(self, k: int) -> SceneFragments:
        """Return layer k, 0 the nearest, as a visibility buffer of its own: attributes are computed there."""
        k = range(len(self))[k]
        ids, depth = self.planes
        return SceneFragments(ids[k : k + 1], depth[k : k + 1], self._placed, [(0, 0)])


def instances_of(ids: NDArray[np.int32], first_ids: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return the instance that each id belongs to, -1 for -1."""
    return (np.searchsorted(first_ids, ids.ravel(), side="right") - 1).astype(np.int32).reshape(ids.shape)


def local_ids(ids: NDArray[np.int32], instance: NDArray[np.int32], first_ids: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return the index of each triangle in its mesh, -1 for -1."""
    first = np.append(first_ids[:-1], 0).astype(np.int32)
    return ids - first[instance]  # instance -1 takes the last of them, 0


class BentFragments(Fragments):
    """The visibility buffer of a mesh whose triangles were drawn in parts, in terms of the whole ones.

    Made by `rasterize_mesh` for cameras with a lens. `triangle` holds triangles of the mesh, and attributes are those
    of its vertices.
    """

    def __init__(
        self,
        parts: Fragments,
        drawn: NDArray[np.int64],
        source: NDArray[np.int64],
        weights: NDArray[np.float64],
        triangles: NDArray[np.integer[Any]],
        n_vertices: int,
    ) -> None:
        wholes = np.append(source, -1).astype(np.int32)  # part -1, none, is the last
        super().__init__(wholes[parts.triangle], parts.depth, parts._scene, n_vertices, len(triangles))
        self._samples = tuple(
            BentFragments(sample, drawn, source, weights, triangles, n_vertices) for sample in parts._samples
        )
        self._planes = parts._planes and (wholes[parts._planes[0]], parts._planes[1])
        self._parts, self._drawn = parts, drawn
        self._source, self._weights, self._triangles = source, weights, triangles

    @property
    def parts(self) -> Fragments:
        """The visibility buffer of the parts, as drawn."""
        return self._parts

    def again(self) -> BentFragments:
        """Return the same made anew from the parts, whose buffers have changed."""
        return self._of(self._parts)

    def _of(self, parts: Fragments) -> BentFragments:
        return BentFragments(parts, self._drawn, self._source, self._weights, self._triangles, self._n_vertices)

    def mesh_of_parts(self, mesh: Mesh) -> Mesh:
        """Return the parts as a mesh: positions and attributes of the mesh where the parts have corners."""
        return mesh_of_parts(mesh, self._drawn, self._source, self._weights)

    def only(self, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> Fragments:
        """Return what is left when no other pixels than these show a triangle."""
        parts = self._parts.only(rows, cols)
        return self._of(parts)

    def barycentric(self) -> NDArray[np.float32]:
        """Return the weights of the three vertices of the triangle that shows in each pixel."""
        if not len(self._source):
            return np.zeros((*self.triangle.shape, 3), np.float32)
        return self._parts.interpolate(self._weights)

    def interpolate(self, values: ArrayLike, *, background: float = 0.0) -> NDArray[np.float32]:
        """Return an attribute of the vertices at each visible pixel, as `Fragments.interpolate` does."""
        array = as_values(values, self._n_vertices, self._n_triangles)
        if not len(self._source):
            channels = array.shape[-1:] if array.ndim > 1 else ()
            return np.full((*self.triangle.shape, *channels), background, np.float32)
        if array.ndim == 3:
            corners = array[self._source]
        else:
            corners = array.reshape(len(array), -1)[self._triangles[self._source]]
        out = self._parts.interpolate(np.matmul(self._weights, corners), background=background)
        return out if array.ndim > 1 else out[..., 0]


def mesh_of_parts(
    mesh: Mesh, drawn: NDArray[np.int64], source: NDArray[np.int64], weights: NDArray[np.float64]
) -> Mesh:
    """Return parts of triangles as a mesh: positions and attributes of the whole mesh where the parts have corners."""
    corners = mesh.triangles[source]

    def spread(values: NDArray[Any]) -> NDArray[np.float64]:
        of_parts = np.zeros((int(drawn.max(initial=-1)) + 1, values.shape[1]))
        of_parts[drawn.ravel()] = np.matmul(weights, values[corners]).reshape(-1, values.shape[1])
        return of_parts

    rows = mesh.material_of_triangle
    return Mesh(
        spread(mesh.vertices),
        drawn.astype(np.int32),
        spread(mesh.vertex_normals()),
        None if mesh.colors is None else np.rint(spread(mesh.colors)).astype(np.uint8),
        None if mesh.uv is None else spread(mesh.uv).astype(np.float32),
        mesh.materials,
        None if rows is None else rows[source],
    )
