"""Draws the layers of a view by name: the registry of all there are.

Input: a `GBuffer`. Output: an array for each name asked for; nothing else is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, Array
from topleft._core.base.options import check_layers
from topleft._meshes.picture.blended import blended_masks
from topleft._meshes.picture.cloud import CLOUD_LAYERS, CloudBuffer
from topleft._meshes.picture.edges import draw_all_edges
from topleft._meshes.picture.fragments import VisiblePart, shown_of
from topleft._meshes.picture.gbuffer import GBuffer, PointKind, points_of, project
from topleft._meshes.picture.render import render
from topleft._meshes.picture.scene_shade import shade_by
from topleft._meshes.picture.shade import ShadingOptions, shade_normals
from topleft._meshes.picture.silhouette import silhouette as draw_silhouette
from topleft._meshes.picture.transparent import render_transparent

NOT_OF_LIGHT = ("cull", "edges", "sampling", "subpixel_bits")
"""Options of `render` that say which triangle is seen where, not how it is lit."""


def color(gbuffer: GBuffer) -> Array:
    """The picture (H, W, 4) uint8 of `render`, or of `render_transparent` if the look has an `opacity`."""
    scene, camera, options = gbuffer.scene, gbuffer.camera, {**gbuffer.options, **gbuffer.look}
    if "opacity" in options:
        return render_transparent(scene, camera, gbuffer.size, **options)
    look = {name: value for name, value in options.items() if name not in NOT_OF_LIGHT}
    checked = ShadingOptions.parse(**look)
    if options.get("sampling", "center") != "center" or blended_masks(scene, checked) is not None:
        return render(gbuffer.shot.subject, camera, gbuffer.size, rasterizer=gbuffer.rasterizer, **options)
    picture = shade_by(gbuffer.frags, scene, camera, checked)
    if options.get("edges"):
        draw_all_edges(picture, gbuffer.frags, scene, camera, checked, cull=options["cull"])
    return picture


def cloud_color(buffer: CloudBuffer) -> Array:
    """The picture (H, W, 4) uint8 of points."""
    return render(buffer.subject, buffer.camera, buffer.size, **buffer.options, **buffer.look)


def alpha(gbuffer: GBuffer) -> Array:
    """How much of the pixel is covered, (H, W) uint8, 255 for all of it."""
    share = silhouette(gbuffer)
    if share.dtype == np.bool_:
        return share.view(np.uint8) * np.uint8(255)
    return np.rint(share * np.float32(255)).astype(np.uint8)


def silhouette(gbuffer: GBuffer) -> Array:
    """Where the subject is, (H, W): bool, or the share of samples, float32."""
    sampling = gbuffer.look.get("sampling", "center")
    if sampling == "center":
        return gbuffer.frags.mask
    if gbuffer.has_holes:
        return (gbuffer.sampled(sampling).samples_triangle >= 0).mean(axis=-1, dtype=np.float32)
    return draw_silhouette(gbuffer.scene, gbuffer.camera, gbuffer.size, sampling=sampling, **gbuffer.options)


def depth(gbuffer: GBuffer) -> Array:
    """Window depth (H, W) float32, +inf where nothing is."""
    return gbuffer.frags.depth


def distance(gbuffer: GBuffer) -> Array:
    """Distance along the view (H, W) float32, world units, +inf where nothing is."""
    return of_eye_space(gbuffer, PointKind.ROWS, -gbuffer.camera.view[2:3])


def ray_distance(gbuffer: GBuffer) -> Array:
    """Distance from the eye (H, W) float32, world units, +inf where nothing is; along the view without perspective."""
    if not gbuffer.camera.projection[3, :3].any():
        return distance(gbuffer)
    return of_eye_space(gbuffer, PointKind.LENGTH, gbuffer.camera.view[:3])


def of_eye_space(gbuffer: GBuffer, kind: PointKind, rows: F64) -> Array:
    """What rows of eye from world tell of the points that show, +inf where nothing is."""
    return gbuffer.join((), np.inf, lambda one: gbuffer.evaluate(one, kind, engine.product(rows, one.place), np.inf))


def triangle(gbuffer: GBuffer) -> Array:
    """Index of the triangle in its mesh, (H, W) int32, -1 where nothing is."""
    return gbuffer.frags.triangle


def instance(gbuffer: GBuffer) -> Array:
    """Index of the instance, (H, W) int32, -1 where nothing is."""
    return gbuffer.frags.instance


def barycentric(gbuffer: GBuffer) -> Array:
    """Weights of the triangle's vertices, (H, W, 3) float32, 0 where nothing is."""
    return gbuffer.frags.barycentric()


def world_position(gbuffer: GBuffer) -> Array:
    """The point of the surface, (H, W, 3) float32, NaN where nothing is."""
    return gbuffer.join((3,), np.nan, lambda one: gbuffer.evaluate(one, PointKind.ROWS, one.place[:3], np.nan))


def camera_normal(gbuffer: GBuffer) -> Array:
    """Unit normal in eye space, (H, W, 3) float32, 0 where nothing is."""
    return normals_of(gbuffer, np.eye(3))


def world_normal(gbuffer: GBuffer) -> Array:
    """Unit normal in the world, (H, W, 3) float32, 0 where nothing is."""
    return normals_of(gbuffer, gbuffer.camera.view[:3, :3].T)  # the transpose, where positions take the inverse


def normals_of(gbuffer: GBuffer, turn: F64) -> npt.NDArray[np.float32]:
    """Unit normals (H, W, 3), from eye space by the matrix (3, 3) `turn`, on the side that is seen."""
    frags = gbuffer.frags
    seen, shown = frags._seen(), shown_of(frags, gbuffer.scene)
    return shade_normals(shown, seen.ids[0], gbuffer.camera, turn, threads=gbuffer.options.get("threads"))


def uv(gbuffer: GBuffer) -> Array:
    """Texture coordinates, (H, W, 2) float32, NaN where nothing is or a mesh has none."""
    if all(one.mesh.uv is None for one in gbuffer.scene):
        raise ValueError("layer 'uv' needs a mesh that has texture coordinates")

    def make(part: VisiblePart) -> Array:
        if part.mesh.uv is None:
            return np.full((*part.seen.shape, 2), np.nan, np.float32)
        return part.interpolate(part.mesh.uv, np.nan)

    return gbuffer.join((2,), np.nan, make)


def flow(gbuffer: GBuffer) -> Array:
    """Where the point of each pixel moves to in the picture, (H, W, 2) float32 pixels, NaN where nothing is."""
    if gbuffer.camera_to is None and gbuffer.transforms_to is None:
        raise ValueError("layer 'flow' needs camera_to or transforms_to")
    begin, end, size = gbuffer.camera, gbuffer.camera_to or gbuffer.camera, gbuffer.size

    def make(part: VisiblePart) -> Array:
        here = part.place
        there = here if gbuffer.transforms_to is None else gbuffer.transforms_to[part.i]
        if begin.lens is None and end.lens is None:
            ways = [engine.product(camera.clip_from_world(size), at) for camera, at in ((begin, here), (end, there))]
            rows = np.concatenate([way[[0, 1, 3]] for way in ways])
            return gbuffer.evaluate(part, PointKind.FLOW, rows, np.nan, size=size)
        picture = np.full((*part.seen.shape, 2), np.nan, np.float32)
        points = points_of(part)
        picture[part.seen] = project(points, end, there, size) - project(points, begin, here, size)
        return picture

    return gbuffer.join((2,), np.nan, make)


def cloud_flow(buffer: CloudBuffer) -> Array:
    """Where the point of each pixel moves to in the picture, (H, W, 2) float32 pixels."""
    if buffer.camera_to is None and buffer.transforms_to is None:
        raise ValueError("layer 'flow' needs camera_to or transforms_to")
    points = buffer.subject.positions.astype(np.float64)
    there = np.eye(4) if buffer.transforms_to is None else buffer.transforms_to[0]
    ends = project(points, buffer.camera_to or buffer.camera, there, buffer.size)
    return buffer.spread(ends - project(points, buffer.camera, np.eye(4), buffer.size), np.nan)


LAYERS: Mapping[str, Callable[[GBuffer], Array]] = MappingProxyType({
    layer.__name__: layer
    for layer in (
        color, alpha, silhouette, depth, distance, ray_distance, triangle, instance, barycentric, world_position,
        world_normal, camera_normal, uv, flow,
    )
})  # fmt: skip
"""How each layer is made; `LayerOption` of `topleft.typing` has the same names in the same order."""


def draw_layers(names: str | Iterable[str], gbuffer: GBuffer | CloudBuffer) -> dict[str, Array]:
    """Return arrays by name, in the order asked for.

    Raises
    ------
    ValueError
        If there is no such layer, or one cannot be had of this view.
    """
    checked = check_layers(names)
    # Colours first: in memory that is kept they may need other samples than the visibility buffer of all others.
    table: Mapping[str, Callable[[Any], Array]] = LAYERS
    if isinstance(gbuffer, CloudBuffer):
        table = {"color": cloud_color, **CLOUD_LAYERS, "flow": cloud_flow}
    for name in checked:
        if name not in table:
            raise ValueError(f"points have no layer {name!r}; they have {', '.join(table)}")
    drawn = {name: table[name](gbuffer) for name in sorted(checked, key=lambda name: name != "color")}
    return {name: drawn[name] for name in checked}
