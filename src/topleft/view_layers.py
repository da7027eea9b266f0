"""Layers for vision: depth, normals, positions, ids, flow and what else a view shows, as named arrays in one call.

Input: `Mesh` or `Scene`, `Camera`, names. Output: `ViewLayers`, arrays by name; nothing else is computed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.camera import Camera
from topleft.eye import eye_normals
from topleft.mesh import Mesh, unit_or_zero
from topleft.render import DEFAULT_SIZE, default_camera, render
from topleft.scene import Scene
from topleft.scene_render import camera_of
from topleft.sight import Sight, Surface, moved, project
from topleft.silhouette import silhouette as draw_silhouette

__all__ = ["LAYERS", "ViewLayers", "render_layers"]

Array = npt.NDArray[Any]
F64 = npt.NDArray[np.float64]


class ViewLayers(Mapping[str, Array]):
    """Named arrays of one view, in the order asked for: what `render_layers` returns."""

    def __init__(self, arrays: Mapping[str, Array]) -> None:
        self._arrays = dict(arrays)

    def __getitem__(self, name: str) -> Array:
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        return f"ViewLayers({', '.join(f'{name} {array.shape} {array.dtype}' for name, array in self.items())})"

    def save(self, path: str | os.PathLike[str], layer: str | None = None, *, scale: float | None = None) -> None:
        """Write the layers, or one of them; see `topleft.view_layer_files.save_layers`."""
        from topleft.view_layer_files import save_layers

        save_layers(path, self, layer, scale=scale)


def render_layers(
    mesh: Mesh | Scene,
    camera: Camera | None = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    layers: str | Iterable[str] = ("color", "depth"),
    attributes: Mapping[str, Any] | None = None,
    camera_to: Camera | None = None,
    transforms_to: npt.ArrayLike | None = None,
    cull: str = "none",
    threads: int | None = None,
    **look: Any,
) -> ViewLayers:
    """Layers of one view by name: depth, normals, positions, ids and flow beside the colours.

    Parameters
    ----------
    mesh : Mesh or Scene
        What to look at.
    camera : Camera, optional
        Unless given, the three-quarter view of `Camera.framing`, with y up.
    size : (width, height), pixels
        640 x 480 unless given.
    layers : str or iterable of str
        Names of the table below; only these are computed.
    attributes : mapping of str to array_like, optional
        Further layers: values of the vertices (V, K) or (V,), or of the corners (T, 3, K); of a scene a sequence of
        such arrays, one of each instance.
    camera_to : Camera, optional
        For "flow": who looks when it ends; the same camera unless given.
    transforms_to : (N, 4, 4) array_like, optional
        For "flow": where the instances of the scene are when it ends, world from object; (4, 4) for a mesh. Unless
        given they stay.
    cull, threads
        As for `render`.
    **look
        Further options of `render`, for "color". `sampling` also holds for "alpha" and "silhouette"; every other layer
        is taken at the centres of the pixels.

    Returns
    -------
    ViewLayers
        Arrays by name, in the order asked for, the attributes last:

        ============== ============== ========== =================================================================
        name           shape, dtype   background what it holds
        ============== ============== ========== =================================================================
        color          (H, W, 4) u8   as asked   the picture of `render`
        alpha          (H, W) u8      0          how much of the pixel is covered, of 255
        silhouette     (H, W) bool    False      where the mesh is; with several samples their share, float32
        depth          (H, W) f32     +inf       window depth, 0 near to 1 far
        distance       (H, W) f32     +inf       along the view, world units ("metric z")
        ray_distance   (H, W) f32     +inf       from the eye; without perspective the same as distance
        triangle       (H, W) i32     -1         index of the triangle in its mesh
        instance       (H, W) i32     -1         index of the instance, 0 for a mesh
        barycentric    (H, W, 3) f32  0          weights of the triangle's vertices
        world_position (H, W, 3) f32  NaN        the point of the surface
        world_normal   (H, W, 3) f32  0          unit, interpolated from the vertices, on the side that is seen
        camera_normal  (H, W, 3) f32  0          the same in eye space: x right, y up, z to the viewer
        uv             (H, W, 2) f32  NaN        texture coordinates, of meshes that have them
        flow           (H, W, 2) f32  NaN        where the point moves to, pixels (dx, dy), y down; NaN too for
                                                 what ends behind the camera
        attributes     as given, f32  NaN        interpolated
        ============== ============== ========== =================================================================

    Raises
    ------
    ValueError
        If there is no such layer, an attribute has its name or does not fit, "flow" has no end, "uv" finds no texture
        coordinates, or an option of `render` is wrong.
    TypeError
        If an option is unknown, or of colours and no colours are asked for.

    Notes
    -----
    The point of a pixel lies on its triangle and projects to within 2**-9 pixels of the centre in x and y, half a
    sub-pixel, which is what the snap moves a vertex by; float32 then rounds it. Flow is the difference of its two
    projections in float64, so what does not move has flow 0, to the bit.

    Examples
    --------
    >>> import topleft as tl
    >>> found = tl.render_layers(tl.Mesh(*tl.scenes.shape("cube")), size=(8, 6), layers=("distance", "triangle"))
    >>> found
    ViewLayers(distance (6, 8) float32, triangle (6, 8) int32)
    >>> found["triangle"][3]
    array([-1, -1, 11, 10, 10,  3, -1, -1], dtype=int32)
    """
    names = check_layers(layers)
    for option in look.keys() - {"sampling"} if "color" not in names else ():
        raise TypeError(f"option {option!r} is for layer 'color', which is not among {', '.join(names)}")
    camera = default_camera(mesh, size) if camera is None else camera
    n_instances = len(mesh) if isinstance(mesh, Scene) else 1
    sight = Sight(
        subject=mesh,
        camera=camera,
        size=size,
        options={"cull": cull, "threads": threads},
        look=look,
        camera_to=camera_to,
        transforms_to=None if transforms_to is None else as_transforms(transforms_to, n_instances),
    )
    found = {name: LAYERS[name](sight) for name in names}
    for name, values in (attributes or {}).items():
        if name in LAYERS:
            raise ValueError(f"attributes must not have the name of a layer, got {name!r}")
        found[name] = sight.frags.interpolate(values, background=np.nan)
    return ViewLayers(found)


def check_layers(layers: str | Iterable[str]) -> tuple[str, ...]:
    """Return names of layers, each once, after checking them."""
    names = tuple(dict.fromkeys((layers,) if isinstance(layers, str) else layers))
    for name in names:
        if name not in LAYERS:
            raise ValueError(f"layers must be some of {', '.join(LAYERS)}, got {name!r}")
    return names


def as_transforms(transforms: npt.ArrayLike, n: int) -> F64:
    """Return a matrix for each instance, (N, 4, 4) float64."""
    array = np.asarray(transforms, np.float64)
    if n == 1 and array.shape == (4, 4):
        array = array[None]
    if array.shape != (n, 4, 4):
        raise ValueError(f"transforms_to must have shape ({n}, 4, 4), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("transforms_to must hold finite numbers")
    if not (array[:, 3] == [0, 0, 0, 1]).all():
        raise ValueError("the last row of each of transforms_to must be [0, 0, 0, 1]")
    return array


# ---- one function a layer ---------------------------------------------------------------------------------------


def color(sight: Sight) -> Array:
    """The picture (H, W, 4) uint8 of `render`."""
    return render(sight.subject, sight.camera, sight.size, **sight.options, **sight.look)


def alpha(sight: Sight) -> Array:
    """How much of the pixel is covered, (H, W) uint8, 255 for all of it."""
    return np.rint(silhouette(sight) * np.float32(255)).astype(np.uint8)


def silhouette(sight: Sight) -> Array:
    """Where the subject is, (H, W): bool, or the share of samples, float32."""
    sampling = sight.look.get("sampling", "center")
    if sampling == "center":
        return sight.frags.mask
    return draw_silhouette(sight.subject, sight.camera, sight.size, sampling=sampling, **sight.options)


def depth(sight: Sight) -> Array:
    """Window depth (H, W) float32, +inf where nothing is."""
    return sight.frags.depth


def distance(sight: Sight) -> Array:
    """Distance along the view (H, W) float32, world units, +inf where nothing is."""
    return sight.join((), np.inf, lambda surface: -moved(surface.points_world, sight.camera.view[2:3])[:, 0])


def ray_distance(sight: Sight) -> Array:
    """Distance from the eye (H, W) float32, world units, +inf where nothing is; along the view without perspective."""
    if not sight.camera.projection[3, :3].any():
        return distance(sight)

    def make(surface: Surface) -> F64:
        x, y, z = moved(surface.points_world, sight.camera.view[:3]).T
        return np.sqrt(x * x + y * y + z * z)

    return sight.join((), np.inf, make)


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
    return sight.join((3,), np.nan, lambda surface: surface.points_world)


def camera_normal(sight: Sight) -> Array:
    """Unit normal in eye space, (H, W, 3) float32, 0 where nothing is."""
    return sight.join((3,), 0.0, lambda surface: normals_of(surface, sight.camera))


def world_normal(sight: Sight) -> Array:
    """Unit normal in the world, (H, W, 3) float32, 0 where nothing is."""
    back = np.hstack([sight.camera.view[:3, :3].T, np.zeros((3, 1))])  # the transpose, where positions take the inverse

    def make(surface: Surface) -> F64:
        return unit_or_zero(moved(normals_of(surface, sight.camera).astype(np.float64), back))

    return sight.join((3,), 0.0, make)


def normals_of(surface: Surface, camera: Camera) -> npt.NDArray[np.float32]:
    """Unit normals (P, 3) of the pixels of a surface in eye space, on the side that is seen."""
    own = camera_of(camera, surface.instance)
    return eye_normals(surface.part.frags, surface.instance.mesh, own, is_smooth=True)


def uv(sight: Sight) -> Array:
    """Texture coordinates, (H, W, 2) float32, NaN where nothing is or a mesh has none."""
    if all(getattr(instance.mesh, "uv", None) is None for instance in sight.instances):
        raise ValueError("layer 'uv' needs a mesh that has texture coordinates")

    def make(surface: Surface) -> Array:
        coordinates = getattr(surface.instance.mesh, "uv", None)
        if coordinates is None:
            return np.full((1, 2), np.nan)
        return surface.part.frags.interpolate(coordinates)[surface.seen]

    return sight.join((2,), np.nan, make)


def flow(sight: Sight) -> Array:
    """Where the point of each pixel moves to in the picture, (H, W, 2) float32 pixels, NaN where nothing is."""
    if sight.camera_to is None and sight.transforms_to is None:
        raise ValueError("layer 'flow' needs camera_to or transforms_to")
    begin, end = (camera.clip_from_world(sight.size) for camera in (sight.camera, sight.camera_to or sight.camera))

    def make(surface: Surface) -> F64:
        here = surface.instance.transform
        there = here if sight.transforms_to is None else sight.transforms_to[surface.part.instance]
        return project(surface.points, end @ there, sight.size) - project(surface.points, begin @ here, sight.size)

    return sight.join((2,), np.nan, make)


LAYERS: Mapping[str, Callable[[Sight], Array]] = MappingProxyType({
    layer.__name__: layer
    for layer in (
        color, alpha, silhouette, depth, distance, ray_distance, triangle, instance, barycentric, world_position,
        world_normal, camera_normal, uv, flow,
    )
})  # fmt: skip
"""Every layer by its name."""
