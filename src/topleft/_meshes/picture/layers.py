"""Draws the layers of a view by name: the registry of all there are.

Input: a `GBuffer`. Output: an array for each given name; nothing else is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, Array
from topleft._core.base.options import check_layers
from topleft._meshes.picture.blended import blended_masks
from topleft._meshes.picture.cloud import normals_at
from topleft._meshes.picture.edges import draw_all_edges
from topleft._meshes.picture.fragments import VisiblePart, shown_of
from topleft._meshes.picture.gbuffer import GBuffer, PointKind, points_of, project
from topleft._meshes.picture.render import render
from topleft._meshes.picture.scene_shade import shade_by
from topleft._meshes.picture.shade import ShadingOptions, ShownInstance, shade_normals
from topleft._meshes.picture.silhouette import silhouette as draw_silhouette
from topleft._meshes.picture.transparent import render_transparent

NOT_OF_LIGHT = ("cull", "edges", "sampling", "subpixel_bits")
"""Options of `render` that say which triangle is seen where, not how it is lit."""


def color(gbuffer: GBuffer) -> Array:
    """The picture (H, W, 4) uint8 of `render`, or of `render_transparent` if the look has an `opacity`."""
    scene, camera, options = gbuffer.shot.scene, gbuffer.shot.camera, {**gbuffer.options, **gbuffer.look}
    if gbuffer.shot.cloud is not None:
        return render(gbuffer.shot.cloud, camera, gbuffer.shot.size, **options)
    if "opacity" in options:
        return render_transparent(scene, camera, gbuffer.shot.size, **options)
    look = {name: value for name, value in options.items() if name not in NOT_OF_LIGHT}
    checked = ShadingOptions.parse(**look)
    if options.get("sampling", "center") != "center" or blended_masks(scene, checked) is not None:
        return render(gbuffer.shot.subject, camera, gbuffer.shot.size, rasterizer=gbuffer.rasterizer, **options)
    picture = shade_by(gbuffer.frags, scene, camera, checked)
    if options.get("edges"):
        draw_all_edges(picture, gbuffer.frags, scene, camera, checked, cull=options["cull"])
    return picture


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
    return draw_silhouette(
        gbuffer.shot.subject, gbuffer.shot.camera, gbuffer.shot.size, sampling=sampling, **gbuffer.options
    )


def depth(gbuffer: GBuffer) -> Array:
    """Window depth (H, W) float32, +inf where nothing is."""
    return gbuffer.frags.depth


def distance(gbuffer: GBuffer) -> Array:
    """Distance along the view (H, W) float32, world units, +inf where nothing is."""
    return gbuffer.tell(PointKind.ROWS, lambda place: engine.product(-gbuffer.shot.camera.view[2:3], place), (), np.inf)


def ray_distance(gbuffer: GBuffer) -> Array:
    """Distance from the eye (H, W) float32, world units, +inf where nothing is; along the view without perspective."""
    if not gbuffer.shot.camera.projection[3, :3].any():
        return distance(gbuffer)
    return gbuffer.tell(PointKind.LENGTH, lambda place: engine.product(gbuffer.shot.camera.view[:3], place), (), np.inf)


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
    return gbuffer.tell(PointKind.ROWS, lambda place: place[:3], (3,), np.nan)


def camera_normal(gbuffer: GBuffer) -> Array:
    """Unit normal in eye space, (H, W, 3) float32, 0 where nothing is."""
    return normals_of(gbuffer, np.eye(3))


def world_normal(gbuffer: GBuffer) -> Array:
    """Unit normal in the world, (H, W, 3) float32, 0 where nothing is."""
    return normals_of(gbuffer, gbuffer.shot.camera.view[:3, :3].T)  # the transpose, where positions take the inverse


def normals_of(gbuffer: GBuffer, turn: F64) -> npt.NDArray[np.float32]:
    """Unit normals (H, W, 3), from eye space by the matrix (3, 3) `turn`, on the side that is seen."""
    frags, cloud = gbuffer.frags, gbuffer.shot.cloud
    if cloud is not None:
        return frags.interpolate(normals_at(cloud, gbuffer.shot.camera, turn), background=0.0)
    seen, shown = frags._buffers(), shown_of(frags, gbuffer.shot.scene)
    return shade_normals(shown, seen.ids[0], gbuffer.shot.camera, turn, threads=gbuffer.options.get("threads"))


def uv(gbuffer: GBuffer) -> Array:
    """Texture coordinates, (H, W, 2) float32, NaN where nothing is or a mesh has none."""
    if all(one.mesh.uv is None for one in gbuffer.shot.scene):
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
    begin, end, size = gbuffer.shot.camera, gbuffer.camera_to or gbuffer.shot.camera, gbuffer.shot.size
    if gbuffer.shot.cloud is not None:
        centres, here = gbuffer.shot.cloud.positions.astype(np.float64), np.eye(4)
        there = here if gbuffer.transforms_to is None else gbuffer.transforms_to[0]
        moves = project(centres, end, there, size) - project(centres, begin, here, size)
        return gbuffer.frags.interpolate(moves, background=np.nan)

    def end_of(one: VisiblePart | ShownInstance) -> F64:
        return one.place if gbuffer.transforms_to is None else gbuffer.transforms_to[one.i]

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
        return gbuffer.evaluate(PointKind.FLOW, rows_of, (2,), np.nan)
    return gbuffer.join((2,), np.nan, make)


LAYERS: Mapping[str, Callable[[GBuffer], Array]] = MappingProxyType({
    layer.__name__: layer
    for layer in (
        color, alpha, silhouette, depth, distance, ray_distance, triangle, instance, barycentric, world_position,
        world_normal, camera_normal, uv, flow,
    )
})  # fmt: skip
"""How each layer is made; `LayerOption` of `topleft.typing` has these names in this order."""


NOT_OF_POINTS = ("barycentric", "uv")
"""The layers that points do not have."""


def draw_layers(names: str | Iterable[str], gbuffer: GBuffer) -> dict[str, Array]:
    """Return arrays by name, in the given order; a `ValueError` for a layer that this view has not."""
    checked = check_layers(names)
    for name in checked:
        if gbuffer.shot.cloud is not None and name in NOT_OF_POINTS:
            there = ", ".join(name for name in LAYERS if name not in NOT_OF_POINTS)
            raise ValueError(f"points have no layer {name!r}; they have {there}")
    # Colours first: in memory that is kept they may need other samples than the visibility buffer of all others.
    drawn = {name: LAYERS[name](gbuffer) for name in sorted(checked, key=lambda name: name != "color")}
    return {name: drawn[name] for name in checked}
