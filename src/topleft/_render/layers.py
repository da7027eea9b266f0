"""The registry of layers: what a view of a mesh or scene shows, by name.

Input: a `Sight`. Output: an array for each name asked for; nothing else is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._render.render import picture_of, render
from topleft._render.scene_render import camera_of
from topleft._render.sight import PointKind, Sight, Surface, project
from topleft._render.silhouette import silhouette as draw_silhouette
from topleft._render.transparent import render_transparent
from topleft._shade.shade import shade_normals

__all__ = ["LAYERS", "check_layers", "draw_layers"]

Array = npt.NDArray[Any]
F64 = npt.NDArray[np.float64]


def color(sight: Sight) -> Array:
    """The picture (H, W, 4) uint8 of `render`, or of `render_transparent` if the look has an `opacity`."""
    options = {**sight.options, **sight.look}
    if "opacity" in options:
        return render_transparent(sight.subject, sight.camera, sight.size, **options)
    sampling = options.pop("sampling", "center")
    if sampling == "center":
        return picture_of(sight.frags, sight.subject, sight.camera, **options)
    options |= {"sampling": sampling, "rasterizer": sight.rasterizer}
    return render(sight.subject, sight.camera, sight.size, **options)


def alpha(sight: Sight) -> Array:
    """How much of the pixel is covered, (H, W) uint8, 255 for all of it."""
    share = silhouette(sight)
    if share.dtype == np.bool_:
        return share.view(np.uint8) * np.uint8(255)
    return np.rint(share * np.float32(255)).astype(np.uint8)


def silhouette(sight: Sight) -> Array:
    """Where the subject is, (H, W): bool, or the share of samples, float32."""
    sampling = sight.look.get("sampling", "center")
    if sampling == "center":
        return sight.frags.mask
    if sight.has_holes:
        return (sight.sampled(sampling).samples_triangle >= 0).mean(axis=-1, dtype=np.float32)
    return draw_silhouette(sight.subject, sight.camera, sight.size, sampling=sampling, **sight.options)


def depth(sight: Sight) -> Array:
    """Window depth (H, W) float32, +inf where nothing is."""
    return sight.frags.depth


def distance(sight: Sight) -> Array:
    """Distance along the view (H, W) float32, world units, +inf where nothing is."""
    rows = -sight.camera.view[2:3]
    return sight.join((), np.inf, lambda one: sight.tell(one, PointKind.ROWS, rows @ one.instance.transform, np.inf))


def ray_distance(sight: Sight) -> Array:
    """Distance from the eye (H, W) float32, world units, +inf where nothing is; along the view without perspective."""
    if not sight.camera.projection[3, :3].any():
        return distance(sight)
    rows = sight.camera.view[:3]
    return sight.join((), np.inf, lambda one: sight.tell(one, PointKind.LENGTH, rows @ one.instance.transform, np.inf))


def triangle(sight: Sight) -> Array:
    """Index of the triangle in its mesh, (H, W) int32, -1 where nothing is."""
    return sight.frags.triangle


def instance(sight: Sight) -> Array:
    """Index of the instance, (H, W) int32, -1 where nothing is."""
    return sight.frags.instance


def barycentric(sight: Sight) -> Array:
    """Weights of the triangle's vertices, (H, W, 3) float32, 0 where nothing is."""
    return sight.frags.barycentric()


def world_position(sight: Sight) -> Array:
    """The point of the surface, (H, W, 3) float32, NaN where nothing is."""
    return sight.join((3,), np.nan, lambda one: sight.tell(one, PointKind.ROWS, one.instance.transform[:3], np.nan))


def camera_normal(sight: Sight) -> Array:
    """Unit normal in eye space, (H, W, 3) float32, 0 where nothing is."""
    return sight.join((3,), 0.0, lambda surface: normals_of(sight, surface, np.eye(3)))


def world_normal(sight: Sight) -> Array:
    """Unit normal in the world, (H, W, 3) float32, 0 where nothing is."""
    back = sight.camera.view[:3, :3].T  # the transpose, where positions take the inverse
    return sight.join((3,), 0.0, lambda surface: normals_of(sight, surface, back))


def normals_of(sight: Sight, surface: Surface, turn: F64) -> npt.NDArray[np.float32]:
    """Unit normals (H, W, 3) of a surface, from eye space by the matrix (3, 3) `turn`, on the side that is seen."""
    own = camera_of(sight.camera, surface.instance).straightened()
    return shade_normals(*surface.drawn, own, turn, threads=sight.options.get("threads"))


def uv(sight: Sight) -> Array:
    """Texture coordinates, (H, W, 2) float32, NaN where nothing is or a mesh has none."""
    if all(getattr(instance.mesh, "uv", None) is None for instance in sight.instances):
        raise ValueError("layer 'uv' needs a mesh that has texture coordinates")

    def make(surface: Surface) -> Array:
        coordinates = getattr(surface.instance.mesh, "uv", None)
        if coordinates is None:
            return np.full((*surface.seen.shape, 2), np.nan, np.float32)
        return surface.part.frags.interpolate(coordinates, background=np.nan)

    return sight.join((2,), np.nan, make)


def flow(sight: Sight) -> Array:
    """Where the point of each pixel moves to in the picture, (H, W, 2) float32 pixels, NaN where nothing is."""
    if sight.camera_to is None and sight.transforms_to is None:
        raise ValueError("layer 'flow' needs camera_to or transforms_to")
    begin, end, size = sight.camera, sight.camera_to or sight.camera, sight.size

    def make(surface: Surface) -> Array:
        here = surface.instance.transform
        there = here if sight.transforms_to is None else sight.transforms_to[surface.part.instance]
        if begin.lens is None and end.lens is None:
            ways = [camera.clip_from_eye(size) @ camera.view @ at for camera, at in ((begin, here), (end, there))]
            rows = np.concatenate([way[[0, 1, 3]] for way in ways])
            return sight.tell(surface, PointKind.FLOW, rows, np.nan, size=size)
        picture = np.full((*surface.seen.shape, 2), np.nan, np.float32)
        points = surface.points
        picture[surface.seen] = project(points, end, there, size) - project(points, begin, here, size)
        return picture

    return sight.join((2,), np.nan, make)


LAYERS: Mapping[str, Callable[[Sight], Array]] = MappingProxyType({
    layer.__name__: layer
    for layer in (
        color, alpha, silhouette, depth, distance, ray_distance, triangle, instance, barycentric, world_position,
        world_normal, camera_normal, uv, flow,
    )
})  # fmt: skip
"""The only list of layers: `render_layers`, batches, files and the command line read it."""


def check_layers(names: str | Iterable[str]) -> tuple[str, ...]:
    """Return names of layers, each once.

    Raises
    ------
    ValueError
        If there is no such layer.
    """
    checked = tuple(dict.fromkeys((names,) if isinstance(names, str) else names))
    for name in checked:
        if name not in LAYERS:
            raise ValueError(f"layers must be some of {', '.join(LAYERS)}, got {name!r}")
    return checked


def draw_layers(names: str | Iterable[str], sight: Sight) -> dict[str, Array]:
    """Return arrays by name, in the order asked for.

    Raises
    ------
    ValueError
        If there is no such layer, or one cannot be had of this sight.
    """
    checked = check_layers(names)
    # Colours first: in memory that is kept they may need other samples than the visibility buffer of all others.
    drawn = {name: LAYERS[name](sight) for name in sorted(checked, key=lambda name: name != "color")}
    return {name: drawn[name] for name in checked}

