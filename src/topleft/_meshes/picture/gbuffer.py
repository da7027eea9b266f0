"""Evaluates the points in space of the visible pixels of a mesh, scene or cloud, for layers.

Input: `Shot`. Output: `GBuffer`, from which `layers` are taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64
from topleft._core.base.memory import empty
from topleft._core.base.threads import run_parts, threads_for
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.verbs import Rasterizer
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.normals import moved
from topleft._meshes.picture.cloud import draw_cloud
from topleft._meshes.picture.fragments import VisiblePart, join, parts_of, shown_of
from topleft._meshes.picture.holes import cuts_of, draw_visible
from topleft._meshes.picture.shade import ShownInstance
from topleft._meshes.picture.shot import Shot


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
class GBuffer:
    """A mesh, scene or cloud and its camera."""

    shot: Shot
    options: dict[str, Any] = field(default_factory=dict)  # `cull`, `subpixel_bits`, `threads` of `rasterize_mesh`
    look: dict[str, Any] = field(default_factory=dict)  # further options of `render`, for colours
    camera_to: Camera | None = None  # at the end of the flow
    transforms_to: F64 | None = None  # (N, 4, 4): where the instances are then
    rasterizer: Rasterizer | None = None  # layers may lie in its memory, which the next picture overwrites

    @cached_property
    def frags(self) -> Fragments:
        """The visibility buffer, at the centres of the pixels, without the holes of materials."""
        if self.shot.cloud is not None:
            return draw_cloud(self.shot.cloud, self.shot.camera, self.shot.size, **self.options)
        return draw_visible(self.shot, self.rasterizer, self.look.get("material"), **self.options)

    def sampled(self, sampling: str) -> Fragments:
        """Return the visibility buffer with several samples a pixel, without the holes of materials."""
        return draw_visible(self.shot, material=self.look.get("material"), sampling=sampling, **self.options)

    @cached_property
    def has_holes(self) -> bool:
        """Whether materials cut holes."""
        return self.shot.cloud is None and any(cuts_of(self.shot.scene, self.look.get("material")))

    @cached_property
    def parts(self) -> Sequence[VisiblePart]:
        """The visible pixels of each instance that shows any."""
        return parts_of(self.frags, self.shot.scene)

    def join(
        self, channels: tuple[int, ...], background: float, make: Callable[[VisiblePart], npt.NDArray[Any]]
    ) -> npt.NDArray[np.float32]:
        """Return a picture (H, W, *channels), made by `make` for the rectangle of each part."""
        return join(self.parts, (*self.frags.depth.shape, *channels), background, make)

    def evaluate(
        self, kind: PointKind, rows_of: Callable[[ShownInstance], F64], channels: tuple[int, ...], background: float
    ) -> npt.NDArray[np.float32]:
        """The values of visible points of meshes by rows (R, 4), in the space of each."""
        ids, threads = self.frags._buffers().ids[0], self.options.get("threads")

        def make(shown: Sequence[ShownInstance], ids: npt.NDArray[np.int32]) -> npt.NDArray[np.float32]:
            if not shown:
                return np.full((*ids.shape, *channels), background, np.float32)
            rows = np.array([rows_of(one) for one in shown])
            return evaluate(shown, ids, kind, rows, background, size=self.shot.size, threads=threads)

        if ids.dtype == np.int32:
            return make(shown_of(self.frags, self.shot.scene), ids)
        return self.join(channels, background, lambda part: make([part.shown], part.frags._buffers().ids[0]))

    def tell(
        self, kind: PointKind, rows_of: Callable[[F64], F64], channels: tuple[int, ...], background: float
    ) -> npt.NDArray[np.float32]:
        """The values of visible points by matrices: rows (R, 4) from world from object; of a cloud at the centres."""
        cloud = self.shot.cloud
        if cloud is None:
            return self.evaluate(kind, lambda one: rows_of(one.place), channels, background)
        rows = rows_of(np.eye(4))
        values = moved(cloud.positions, np.resize(rows, (3, 4)))[:, : len(rows)]
        if kind is PointKind.LENGTH:
            values = np.sqrt(engine.row_products(values, values))
        return self.frags.interpolate(values if channels else values.reshape(-1), background=background)


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
