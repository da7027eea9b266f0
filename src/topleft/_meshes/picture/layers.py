"""Draws the layers of a view by name: each is a method of `MeshLayers` or of `CloudLayers`.

Input: a `Shot` or a `CloudShot`. Output: an array for each given name; nothing else is computed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, Array
from topleft._core.base.cached import cached_property
from topleft._core.base.memory import empty
from topleft._core.base.options import LAYER_NAMES, check_layers
from topleft._core.base.threads import run_parts, threads_for
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.verbs import Rasterizer
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.normals import moved
from topleft._meshes.picture.blended import blended_masks
from topleft._meshes.picture.cloud import CloudShot, normals_at
from topleft._meshes.picture.edges import draw_all_edges
from topleft._meshes.picture.fragments import VisiblePart, join, parts_of, shown_of
from topleft._meshes.picture.holes import cuts_of, draw_visible
from topleft._meshes.picture.placed import Placed
from topleft._meshes.picture.render import render, shade_by
from topleft._meshes.picture.shade import ShadingOptions, ShownInstance, shade_normals
from topleft._meshes.picture.shot import Shot
from topleft._meshes.picture.silhouette import silhouette
from topleft._meshes.picture.transparent import render_transparent
from topleft.typing import SamplesOption

NOT_OF_LIGHT = ("cull", "edges", "sampling", "subpixel_bits")
"""Options of `render` that say which triangle is seen where, not how it is lit."""


class PointKind(IntEnum):
    """The values of a point: tl_point_kind in csrc/topleft.h."""

    ROWS = 0
    LENGTH = 1
    FLOW = 2


N_NUMBERS = {PointKind.LENGTH: 1, PointKind.FLOW: 2}


def evaluate(
    shown: Sequence[ShownInstance],
    ids: npt.NDArray[np.int32],
    what: PointKind,
    rows: F64,
    background: float,
    *,
    size: tuple[int, int] = (0, 0),
    threads: int | None = None,
    dtype: type[np.floating[Any]] = np.float32,
) -> npt.NDArray[Any]:
    """The values of pixels' points by pixels/points.c, from numbers that are rows (N, R, 4) times (x, y, z, 1).

    `shown`: at least the N instances that show. Points are in the space of each mesh. A point has the float64 weights
    of its pixel in its triangle, before the snap, relative to a corner; all is float64 and rounded once. `size` is that
    of the whole picture, for the flow.
    """
    n = N_NUMBERS.get(what, rows.shape[1])
    out: npt.NDArray[Any] = empty((*ids.shape, n)[: 2 if n == 1 else 3], dtype)
    points = engine.PixelPoints(
        [one.snapped.with_inverse_w(ids.size // len(shown), empty) for one in shown],
        [one.mesh.vertices for one in shown], [one.first_id for one in shown], what, np.ascontiguousarray(rows),
        (size[0] / 2, size[1] / 2), background, dtype is np.float64,
    )  # fmt: skip
    n_threads = threads_for(threads, sum(len(one.mesh.triangles) for one in shown))
    run_parts(lambda first, end: points.fill(ids, out, first, end - first), len(ids), n_threads)
    return out


def points_of(part: VisiblePart) -> F64:
    """Where visible pixels lie on the mesh, in object space: (P, 3) float64."""
    ids, rows = part.frags._buffers().ids[0], np.eye(4)[None, :3]
    points: F64 = evaluate([part.shown], ids, PointKind.ROWS, rows, np.nan, dtype=np.float64)[part.seen]
    return points


@dataclass(frozen=True, eq=False)
class Layers(ABC):
    """The layers of a subject before its camera, a method each; a layer that a subject lacks is no method."""

    shot: Shot | CloudShot
    options: dict[str, Any] = field(default_factory=dict)  # `cull`, `subpixel_bits`, `threads` of `rasterize_mesh`
    look: dict[str, Any] = field(default_factory=dict)  # further options of `render`, for colours
    camera_to: Camera | None = None  # at the end of the flow
    transforms_to: F64 | None = None  # (N, 4, 4): where the instances are then
    rasterizer: Rasterizer | None = None  # layers may lie in its memory, which the next picture overwrites

    @cached_property
    @abstractmethod
    def frags(self) -> Fragments:
        """The visibility buffer, at the centres of the pixels, without the holes of materials."""

    @abstractmethod
    def share(self, sampling: SamplesOption) -> Array:
        """Return the share (H, W) float32 of the samples of a pixel in which the subject is."""

    @abstractmethod
    def values(
        self, kind: PointKind, rows_of: Callable[[F64], F64], channels: tuple[int, ...], background: float
    ) -> npt.NDArray[np.float32]:
        """Return values of visible points by matrices: rows (R, 4) from world from object."""

    @abstractmethod
    def normals(self, turn: F64) -> npt.NDArray[np.float32]:
        """Return unit normals (H, W, 3), from eye space by the matrix (3, 3) `turn`, on the side that is seen."""

    @property
    def n_instances(self) -> int:
        """How many instances layers tell apart: points are one."""
        return 1

    def draw(self, names: str | Iterable[str]) -> dict[str, Array]:
        """Return arrays by name, in the given order; a `ValueError` for a layer that points have not."""
        checked = check_layers(names)
        for name in checked:
            if not hasattr(type(self), name):
                there = ", ".join(name for name in LAYER_NAMES if hasattr(type(self), name))
                raise ValueError(f"points have no layer {name!r}; they have {there}")
        # Colours first: in memory that is kept they may need other samples than the visibility buffer of all others.
        drawn = {name: getattr(self, name)() for name in sorted(checked, key=lambda name: name != "color")}
        return {name: drawn[name] for name in checked}

    def alpha(self) -> Array:
        """How much of the pixel is covered, (H, W) uint8, 255 for all of it."""
        share = self.silhouette()
        if share.dtype == np.bool_:
            return share.view(np.uint8) * np.uint8(255)
        return np.rint(share * np.float32(255)).astype(np.uint8)

    def silhouette(self) -> Array:
        """Where the subject is, (H, W): bool, or the share of samples, float32."""
        sampling = self.look.get("sampling", "center")
        return self.frags.mask if sampling == "center" else self.share(sampling)

    def depth(self) -> Array:
        """Depth (H, W) float32 as `rasterize_mesh` has it, +inf where nothing is."""
        return self.frags.depth

    def distance(self) -> Array:
        """Distance along the view (H, W) float32, world units, +inf where nothing is."""
        return self.values(PointKind.ROWS, lambda place: engine.product(-self.shot.camera.view[2:3], place), (), np.inf)

    def ray_distance(self) -> Array:
        """Distance from the eye (H, W) float32, world units, +inf where nothing is; of parallel rays `distance`."""
        if not self.shot.camera.projection[3, :3].any():
            return self.distance()
        return self.values(PointKind.LENGTH, lambda place: engine.product(self.shot.camera.view[:3], place), (), np.inf)

    def triangle(self) -> Array:
        """Index of the triangle in its mesh, or of the point, (H, W) int32, -1 where nothing is."""
        return self.frags.triangle

    def instance(self) -> Array:
        """Index of the instance, (H, W) int32, -1 where nothing is."""
        return self.frags.instance

    def world_position(self) -> Array:
        """The point of the surface, (H, W, 3) float32, NaN where nothing is."""
        return self.values(PointKind.ROWS, lambda place: place[:3], (3,), np.nan)

    def camera_normal(self) -> Array:
        """Unit normal in eye space, (H, W, 3) float32, 0 where nothing is."""
        return self.normals(np.eye(3))

    def world_normal(self) -> Array:
        """Unit normal in the world, (H, W, 3) float32, 0 where nothing is."""
        return self.normals(self.shot.camera.view[:3, :3].T)  # the transpose, where positions take the inverse

    @property
    def end(self) -> Camera:
        """The camera at the end of the flow."""
        if self.camera_to is None and self.transforms_to is None:
            raise ValueError("layer 'flow' needs camera_to or transforms_to")
        return self.camera_to or self.shot.camera


class MeshLayers(Layers):
    """The layers of a mesh or a scene."""

    shot: Shot

    @cached_property
    def frags(self) -> Fragments:
        """The visibility buffer, at the centres of the pixels, without the holes of materials."""
        return draw_visible(self.shot, self.rasterizer, self.look.get("material"), **self.options)

    @property
    def n_instances(self) -> int:
        """How many instances layers tell apart."""
        return len(self.shot.scene)

    @cached_property
    def parts(self) -> Sequence[VisiblePart]:
        """The visible pixels of each instance that shows any."""
        return parts_of(self.frags, self.shot.scene)

    def color(self) -> Array:
        """The picture (H, W, 4) uint8 of `render`, or of `render_transparent` if the look has an `opacity`."""
        shot, options = self.shot, {**self.options, **self.look}
        if "opacity" in options:
            return render_transparent(shot.scene, shot.camera, shot.size, **options)
        checked = ShadingOptions.parse(**{name: options[name] for name in options.keys() - NOT_OF_LIGHT})
        if options.get("sampling", "center") != "center" or blended_masks(shot.scene, checked) is not None:
            return render(shot.subject, shot.camera, shot.size, rasterizer=self.rasterizer, **options)
        picture = shade_by(self.frags, shot.scene, shot.camera, checked)
        if options.get("edges"):
            draw_all_edges(picture, self.frags, Placed.parse(shot, self.options), checked, cull=options["cull"])
        return picture

    def share(self, sampling: SamplesOption) -> Array:
        """Return the share (H, W) float32 of the samples of a pixel in which the subject is."""
        shot, material = self.shot, self.look.get("material")
        if any(cuts_of(shot.scene, material)):
            frags = draw_visible(shot, material=material, sampling=sampling, **self.options)
            return (frags.samples_triangle >= 0).mean(axis=-1, dtype=np.float32)
        return silhouette(shot.subject, shot.camera, shot.size, sampling=sampling, **self.options)

    def join(
        self, channels: tuple[int, ...], background: float, make: Callable[[VisiblePart], npt.NDArray[Any]]
    ) -> npt.NDArray[np.float32]:
        """Return a picture (H, W, *channels), made by `make` for the rectangle of each part."""
        return join(self.parts, (*self.frags.depth.shape, *channels), background, make)

    def evaluate(
        self, kind: PointKind, rows_of: Callable[[ShownInstance], F64], channels: tuple[int, ...], background: float
    ) -> npt.NDArray[np.float32]:
        """Return values of visible points by rows (R, 4), in the space of each mesh."""
        ids, threads = self.frags._buffers().ids[0], self.options.get("threads")

        def make(shown: Sequence[ShownInstance], ids: npt.NDArray[np.int32]) -> npt.NDArray[np.float32]:
            if not shown:
                return np.full((*ids.shape, *channels), background, np.float32)
            rows = np.array([rows_of(one) for one in shown])
            return evaluate(shown, ids, kind, rows, background, size=self.shot.size, threads=threads)

        if ids.dtype == np.int32:
            return make(shown_of(self.frags, self.shot.scene), ids)
        return self.join(channels, background, lambda part: make([part.shown], part.frags._buffers().ids[0]))

    def values(
        self, kind: PointKind, rows_of: Callable[[F64], F64], channels: tuple[int, ...], background: float
    ) -> npt.NDArray[np.float32]:
        """Return values of visible points by matrices: rows (R, 4) from world from object."""
        return self.evaluate(kind, lambda one: rows_of(one.place), channels, background)

    def normals(self, turn: F64) -> npt.NDArray[np.float32]:
        """Return unit normals (H, W, 3), from eye space by the matrix (3, 3) `turn`, on the side that is seen."""
        seen, shown = self.frags._buffers(), shown_of(self.frags, self.shot.scene)
        return shade_normals(shown, seen.ids[0], self.shot.camera, turn, threads=self.options.get("threads"))

    def barycentric(self) -> Array:
        """Weights of the triangle's vertices, (H, W, 3) float32, 0 where nothing is."""
        return self.frags.barycentric()

    def uv(self) -> Array:
        """Texture coordinates, (H, W, 2) float32, NaN where nothing is or a mesh has none."""
        if all(one.mesh.uv is None for one in self.shot.scene):
            raise ValueError("layer 'uv' needs a mesh that has texture coordinates")

        def make(part: VisiblePart) -> Array:
            if part.mesh.uv is None:
                return np.full((*part.seen.shape, 2), np.nan, np.float32)
            return part.interpolate(part.mesh.uv, np.nan)

        return self.join((2,), np.nan, make)

    def flow(self) -> Array:
        """Where the point of each pixel moves to in the picture, (H, W, 2) float32 pixels, NaN where nothing is."""
        begin, end, size = self.shot.camera, self.end, self.shot.size

        def end_of(one: VisiblePart | ShownInstance) -> F64:
            return one.place if self.transforms_to is None else self.transforms_to[one.i]

        def rows_of(one: ShownInstance) -> F64:
            ways = ((begin, one.place), (end, end_of(one)))
            both = [engine.product(camera.clip_from_world(size), place) for camera, place in ways]
            return np.concatenate([way[[0, 1, 3]] for way in both])

        def make(part: VisiblePart) -> Array:
            picture = np.full((*part.seen.shape, 2), np.nan, np.float32)
            points = points_of(part)
            picture[part.seen] = project(points, end, end_of(part), size) - project(points, begin, part.place, size)
            return picture

        if begin.lens is None and end.lens is None:
            return self.evaluate(PointKind.FLOW, rows_of, (2,), np.nan)
        return self.join((2,), np.nan, make)


class CloudLayers(Layers):
    """The layers of points: all pixels of a point have the values of its centre."""

    shot: CloudShot

    @cached_property
    def frags(self) -> Fragments:
        """The visibility buffer, at the centres of the pixels."""
        return self.shot.draw(**self.options)

    def color(self) -> Array:
        """The picture (H, W, 4) uint8 of `render`."""
        return render(self.shot.cloud, self.shot.camera, self.shot.size, **self.options, **self.look)

    def share(self, sampling: SamplesOption) -> Array:
        """Return the share (H, W) float32 of the samples of a pixel in which points are."""
        return self.shot.share(sampling=sampling, **self.options)

    def values(
        self, kind: PointKind, rows_of: Callable[[F64], F64], channels: tuple[int, ...], background: float
    ) -> npt.NDArray[np.float32]:
        """Return values of the centres of visible points, whose world is their space: rows (R, 4)."""
        rows = rows_of(np.eye(4))
        values = moved(self.shot.cloud.positions, np.resize(rows, (3, 4)))[:, : len(rows)]
        if kind is PointKind.LENGTH:
            values = np.sqrt(engine.row_products(values, values))
        return self.frags.interpolate(values if channels else values.reshape(-1), background=background)

    def normals(self, turn: F64) -> npt.NDArray[np.float32]:
        """Return unit normals (H, W, 3), from eye space by the matrix (3, 3) `turn`, on the side that is seen."""
        return self.frags.interpolate(normals_at(self.shot.cloud, self.shot.camera, turn), background=0.0)

    def flow(self) -> Array:
        """Where the centre of a pixel's point moves to, (H, W, 2) float32 pixels, NaN where nothing is."""
        end, size, here = self.end, self.shot.size, np.eye(4)
        centres = self.shot.cloud.positions.astype(np.float64)
        there = here if self.transforms_to is None else self.transforms_to[0]
        moves = project(centres, end, there, size) - project(centres, self.shot.camera, here, size)
        return self.frags.interpolate(moves, background=np.nan)


def project(points: F64, camera: Camera, transform: F64, size: tuple[int, int]) -> F64:
    """Where points (P, 3) of an object lie in a picture, pixels (P, 2) float64; NaN where the camera cannot see."""
    projection = camera.clip_from_eye(size)
    if camera.lens is None:
        is_seen = np.ones(len(points), np.bool_)
        x, y, w = moved(points, engine.product(engine.product(projection, camera.view), transform)[[0, 1, 3]]).T
    else:
        eye = moved(points, engine.product(camera.view, transform)[:3])
        is_seen = engine.off_axis(eye * [1, 1, -1])[1] < camera.lens.max_angle
        x, y, w = moved(camera.lens.bend(eye), projection[[0, 1, 3]]).T
    w[~(is_seen & (w > 0))] = np.nan
    width, height = size
    return np.stack([(x / w + 1) * (width / 2), (1 - y / w) * (height / 2)], -1)
