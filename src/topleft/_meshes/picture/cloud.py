"""Draws clouds of points: their visibility buffer and their picture.

Input: `Points`, a camera. Output: `PointFragments`, a picture (H, W, 4) uint8.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, F64, U8
from topleft._core.base.color import DEFAULT_COLOR, LINEAR_ONE, light_of, srgb_tables
from topleft._core.base.memory import FRESH
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.points import PointFragments, draw_points
from topleft._core.raster.rasterize import refuse_many
from topleft._core.raster.view import View, ViewOptions
from topleft._meshes.camera.camera import Camera, pixels_of
from topleft._meshes.camera.lens import Lens
from topleft._meshes.model.light import TO_HEADLIGHT, Light
from topleft._meshes.model.normals import moved, turn_of_normals, unit_or_zero
from topleft._meshes.model.points import Points
from topleft._meshes.picture.shade import ShadingOptions, shade_each, shade_numbers

NOWHERE_PX = 1e12
"""The place of points that a lens does not see: outside of every window."""


@dataclass(frozen=True, eq=False)
class CloudShot:
    """A cloud of points and its camera: what `Shot` is of meshes."""

    cloud: Points
    camera: Camera
    size: tuple[int, int]

    def draw(self, *, depth_test: str | None = "less", **options: Any) -> PointFragments:
        """The visibility buffer; options as of `points`, a `ValueError` for those without a meaning."""
        if depth_test != "less":
            raise ValueError(f"points are drawn with depth_test 'less', got {depth_test!r}")
        if options.get("cull") not in (None, "none"):
            raise ValueError("points have no side to cull")
        cloud, camera, frame = self.cloud, self.camera, options.get("viewport") or self.size
        positions: npt.NDArray[Any] = cloud.positions
        sizes: float | F64 = cloud.size
        if camera.lens is None:
            options |= {"transform": camera.drawn_from_world(frame), **camera.depth_options}
        if camera.lens is not None or cloud.unit != "px":
            eye = moved(positions, camera.view)
            bent = eye if camera.lens is None else camera.lens.bend(eye)
            projection = camera.clip_from_eye(frame)
            if cloud.unit != "px":
                unit_of_eye = abs(engine.determinant(camera.view[:3, :3])) ** (1 / 3)
                scale = unit_of_eye * abs(float(projection[1, 1])) * frame[1] / 2
                sizes = np.asarray(cloud.size) * scale / w_of(bent, projection)
            if camera.lens is not None:
                positions = through_lens(eye, bent, camera, camera.lens, frame)
        view = View.parse(self.size, cast(ViewOptions, options), why_snapped="the corners of points lie on the grid")
        refuse_many(view, "a cloud")
        view.refuse_classic("points")
        return draw_points(FRESH, positions, sizes, cloud.shape, view)

    def render(self, view: dict[str, Any], look: ShadingOptions, *, edges: bool) -> U8:
        """The picture (H, W, 4) of `render`."""
        if edges:
            raise ValueError("points have no edges")
        return shade_cloud(self.draw(**view), self.cloud, self.camera, look)

    def share(self, **options: Any) -> npt.NDArray[Any]:
        """Where points are, (H, W): bool, or of several samples a pixel the share, float32; options as for `draw`."""
        frags = self.draw(**options)
        is_seen = frags.samples_triangle >= 0
        return frags.mask if is_seen.shape[-1] == 1 else is_seen.mean(axis=-1, dtype=np.float32)


def through_lens(eye: F64, bent: F64, camera: Camera, lens: Lens, frame: tuple[int, int]) -> F64:
    """Where points in eye space lie in the picture of a lens, which bends them: pixels and depth (N, 3)."""
    with np.errstate(all="ignore"):
        places = pixels_of(bent, camera, frame)
        _, angle = engine.off_axis(eye * [1, 1, -1])
    is_seen = np.isfinite(places).all(axis=1)
    is_seen &= (places[:, 2] >= 0) & (places[:, 2] <= 1) if camera.has_planes else places[:, 2] < 0
    places[~(is_seen & (angle < lens.max_angle))] = NOWHERE_PX, NOWHERE_PX, 0
    return places


def w_of(bent: F64, projection: F64) -> F64:
    """The divisors (N,) of sizes of points in a picture; 1 for points that it cannot show."""
    x, y, z = bent.T
    a, b, c, d = projection[3].tolist()
    w = ((a * x + b * y) + c * z) + d
    return np.where(w > 0, w, 1)


def shade_cloud(frags: Fragments, cloud: Points, camera: Camera, options: ShadingOptions) -> U8:
    """The picture (H, W, 4) of a cloud: its colours, lit where it has normals.

    A `ValueError` if an option has no meaning for points.
    """
    if options.mode == "matcap" or options.material is not None or options.environment is not None:
        raise ValueError("points have colours of their own: they take neither a material, a matcap nor an environment")
    if options.mode == "normals" and cloud.normals is None:
        raise ValueError("shading 'normals' needs points that have normals")
    if options.mode in ("ids", "depth"):
        return shade_numbers(frags, camera, options)
    return shade_each(
        frags._buffers(), options.background, lambda ids, depth: colors_of(ids, depth, cloud, camera, options)
    )


def colors_of(ids: npt.NDArray[np.int32], depth: F32, cloud: Points, camera: Camera, options: ShadingOptions) -> U8:
    """Colours (P, 3) of pixels that show these points: each point is lit once."""
    decode, encode = srgb_tables()
    is_seen = np.zeros(len(cloud), np.bool_)
    is_seen[ids] = True
    rows = np.flatnonzero(is_seen)
    row_of = np.cumsum(is_seen) - 1
    if options.mode == "normals":
        return np.rint(127.5 * in_eye_space(cloud, camera, rows)[1] + 127.5).astype(np.uint8)[row_of[ids]]
    plain = np.array(options.color or DEFAULT_COLOR, np.uint8)
    own = np.broadcast_to(plain, (len(rows), 3)) if cloud.colors is None else cloud.colors[rows, :3]
    light = decode[own] / LINEAR_ONE
    if cloud.normals is not None and options.mode != "unlit":
        light *= light_at(cloud, camera, rows, options)
    if options.fog is None:
        return encode[steps_of(light)][row_of[ids]]
    way = (camera.distance_of(depth) - options.fog.near) / (options.fog.far - options.fog.near)
    share = way.clip(0, 1)[:, None]
    behind = np.array(light_of(options.fog.color)[:3])
    return encode[steps_of(light[row_of[ids]] * (1 - share) + behind * share)]


def steps_of(light: F64) -> npt.NDArray[np.intp]:
    """Light in whole steps: rows of the table of sRGB values."""
    return np.rint(LINEAR_ONE * light.clip(0, 1)).astype(np.intp)


def in_eye_space(cloud: Points, camera: Camera, rows: npt.NDArray[np.intp]) -> tuple[F64, F64]:
    """Positions (P, 3) of some points in eye space, and unit normals on the side that is seen; 0: none."""
    given = cast(npt.NDArray[Any], cloud.normals)[rows]
    matrix = np.eye(4)
    matrix[:3, :3] = turn_of_normals(camera.view).T
    eye, normals = moved(cloud.positions[rows], camera.view), unit_or_zero(moved(unit_or_zero(given), matrix))
    to_eye = -eye if camera.projection[3, :3].any() else np.broadcast_to(np.array([0.0, 0.0, 1.0]), normals.shape)
    normals[engine.row_products(normals, to_eye) < 0] *= -1
    return eye, normals


def light_at(cloud: Points, camera: Camera, rows: npt.NDArray[np.intp], options: ShadingOptions) -> F64:
    """How much of red, green and blue (P, 3) some points send back: as a mesh does, without highlights."""
    eye, normals = in_eye_space(cloud, camera, rows)
    total = np.full((len(rows), 3), options.ambient)
    if options.lights is None:
        half = (1 + engine.row_products(normals, TO_HEADLIGHT)) / 2
        total += (max(0.0, 1 - options.ambient) * half * half * half)[:, None]
    for light in options.lights or ():
        total += lambert(light, eye, normals, camera.view)[:, None] * np.array(light_of(light.color)[:3])
    total[~normals.any(axis=1)] = 1.0
    return total


def lambert(light: Light, eye: F64, normals: F64, view: F64) -> F64:
    """The cosine of one light at some points (P, 3) in eye space, times its intensity: (P,)."""
    is_point = light.kind != "directional"
    at, axis = np.array([light.at]), np.array([light.direction or (0, 0, 0)])
    if light.space == "world":
        turn = np.vstack([np.c_[view[:3, :3], np.zeros(3)], [0, 0, 0, 1]])
        at, axis = moved(at, view if is_point else turn), moved(axis, turn)
    way = at - eye if is_point else at
    cosine = light.intensity * np.maximum(engine.row_products(normals, unit_or_zero(way)), 0)
    if not is_point:
        return cosine
    if light.kind == "spot":
        scale, offset = light.cone
        cosine *= (offset - scale * engine.row_products(unit_or_zero(way), unit_or_zero(axis))).clip(0, 1) ** 2
    unit_of_eye = abs(engine.determinant(view[:3, :3])) ** (1 / 3)
    return cosine / (1 + light.falloff * engine.row_products(way, way) / unit_of_eye**2)


def normals_at(cloud: Points, camera: Camera, turn: F64) -> F64:
    """Unit normals (N, 3) of points on the side that is seen, turned from eye space by a matrix (3, 3); 0: none.

    A `ValueError` if there are no normals.
    """
    if cloud.normals is None:
        raise ValueError("normals need points that have them")
    _, normals = in_eye_space(cloud, camera, np.arange(len(cloud)))
    if (turn == np.eye(3)).all():
        return normals
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    return unit_or_zero(moved(normals, matrix))
