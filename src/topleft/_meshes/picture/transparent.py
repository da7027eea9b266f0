"""Draws transparent pictures: shades every layer of a mesh or scene, then composites them.

Input: a mesh or `Scene`, `Camera`. Output: a picture (H, W, 4) uint8, sRGB with alpha.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal, Unpack, cast

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_count
from topleft._core.base.color import WHITE, ColorLike, as_color
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft._core.base.memory import SCRATCH
from topleft._core.raster.composite import composite
from topleft._core.raster.peel import DepthLayers, check_peel, draw_layers_of, peel_meshes
from topleft._core.raster.view import WindowOptions
from topleft._meshes.camera.camera import Camera, CameraLike
from topleft._meshes.model.material import Material
from topleft._meshes.picture.fragments import SceneDepthLayers
from topleft._meshes.picture.holes import Cut, cuts_of, draw_holed, holed_instances, solid_scene
from topleft._meshes.picture.placed import Placed
from topleft._meshes.picture.render import shade
from topleft._meshes.picture.shade import LookOptions
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene.scene import Scene
from topleft.typing import CullOption, DepthTestOption, SamplesOption, ShadingOption

CLEAR = (0, 0, 0, 0)


class GlassOptions(LookOptions, total=False):
    """The options of `shade` that `render_transparent` passes on."""

    color: ColorLike
    depth_range: tuple[float, float] | None


class PeelOptions(WindowOptions, total=False):
    """The options of `peel` that `visible_layers` passes on."""

    layers: int
    depth_test: DepthTestOption
    sampling: SamplesOption
    cull: CullOption | None
    threads: int | None


def render_transparent(
    mesh: MeshLike | Scene,
    camera: CameraLike | None = None,
    size: int | tuple[int, int] = DEFAULT_SIZE,
    *,
    opacity: float = 0.5,
    layers: int = 8,
    shading: ShadingOption = "smooth",
    background: ColorLike = WHITE,
    cull: CullOption | None = None,
    subpixel_bits: int | Literal["exact"] = 8,
    tolerance: float = 0.0,
    threads: int | None = None,
    **look: Unpack[GlassOptions],
) -> npt.NDArray[np.uint8]:
    """A picture of the mesh or scene as if it were of coloured glass.

    Parameters
    ----------
    mesh, camera, size, shading, background, cull, subpixel_bits, tolerance, threads, **look
        As for `render`, one sample a pixel, and as for `shade`.
    opacity : float, 0 to 1
        How much each layer hides of the layers behind it.
    layers : int, 1 to 16
        How many are looked at; layers behind them are not seen.

    Returns
    -------
    (H, W, 4) uint8
        sRGB with alpha. The values are composited as they are, front to back; see `composite`.

    Raises
    ------
    ValueError
        If the mesh has no triangles and no camera is given, an option is out of range, or the camera has a lens.

    Notes
    -----
    Holes by `alpha_cutoff` are no glass, and no layer.

    Examples
    --------
    >>> import topleft as tl
    >>> mesh = tl.Mesh(*tl.scenes.shape("cube"))
    >>> tl.render_transparent(mesh, size=(64, 48), opacity=0.5, background=(0, 0, 0, 0))[24, 32].tolist()[3]
    192
    """
    layers, material = as_count("layers", layers), look.get("material")
    shot = Shot.of_meshes(mesh, camera, size).within(tolerance, cull=cull, material=material)
    camera, size = shot.camera, shot.size
    ground = as_color("background", background, 4)
    view: dict[str, Any] = {"cull": cull, "subpixel_bits": subpixel_bits, "threads": threads}
    check_straight(camera)
    cuts = cuts_of(shot.scene, material)
    if any(cuts):
        shot = replace(shot, is_mesh=False)  # which is the same picture
        found: DepthLayers = solid_layers(shot, cuts, layers=layers, **view)
    else:
        found = peel_shot(shot, layers=layers, **view)
    pictures = np.zeros((size[1], size[0], layers, 3), np.uint8)
    for k in range(layers):
        frags = found.layer(k)
        if not frags.mask.any():
            break
        own = shade(frags, shot.subject, camera, shading=shading, background=CLEAR, **look)
        pictures[:, :, k] = own[..., :3]
    picture: npt.NDArray[np.uint8] = composite(found, pictures, opacity=opacity, background=ground, threads=threads)
    return picture


def solid_layers(shot: Shot, cuts: Sequence[Cut | None], *, threads: int | None, **options: Any) -> SceneDepthLayers:
    """The nearest layers of a scene without the holes of its materials."""
    holed = holed_instances(shot.scene, cuts, shot.camera)
    solid = replace(shot, scene=solid_scene(shot.scene, holed))
    found = cast("SceneDepthLayers", peel_shot(solid, threads=threads, **options))
    if 0 in shot.size:
        return found
    whole = SceneDepthLayers(*found.planes, found.placed.with_scene(shot.scene))
    draw_holed(whole.placed, holed, *whole.planes, is_peeled=True, threads=threads)
    return whole


def peel_shot(
    shot: Shot,
    *,
    layers: int = 4,
    depth_test: DepthTestOption = "less",
    material: Material | None = None,
    **options: Any,
) -> DepthLayers:
    """The nearest layers of a shot; options as for `peel`, without `transform`."""
    shot.scene.check_counted("a scene that is peeled")
    placed = Placed.parse(shot, options, material)
    if shot.is_mesh:
        mesh = shot.scene[0].mesh
        return draw_layers_of(mesh.vertices, mesh.triangles, placed.view_of(0), layers, depth_test)
    n, is_farthest = check_peel(placed.view, layers, depth_test)
    planes = peel_meshes(SCRATCH, placed.chunks(), placed.view, n, is_farthest=is_farthest)
    return SceneDepthLayers(*planes, placed)


def check_straight(camera: Camera) -> None:
    """Raise an error if the camera has a lens."""
    if camera.lens is not None:
        raise ValueError("layers are not peeled through a lens, but camera has one: take its straightened()")


def visible_layers(
    mesh: MeshLike | Scene,
    camera: CameraLike | None = None,
    size: int | tuple[int, int] = DEFAULT_SIZE,
    **options: Unpack[PeelOptions],
) -> DepthLayers:
    """The nearest layers of every pixel of a mesh or scene, with holes of materials filled; options as for `peel`.

    Parameters
    ----------
    mesh, camera, size
        As for `render`.
    **options
        Those of `peel`: `layers`, `cull`, `threads`, `origin`, ...

    Returns
    -------
    DepthLayers
        Of a scene `SceneDepthLayers`, which tells instances apart.

    Raises
    ------
    ValueError
        If the mesh has no triangles and no camera is given, an option is out of range, or the camera has a lens.

    Examples
    --------
    >>> import topleft as tl
    >>> cube = tl.Mesh(*tl.scenes.cube())
    >>> layers = tl.visible_layers(cube, tl.Camera.framing(cube), (16, 16), layers=3)
    >>> int(layers.count[8, 8])  # the front and the back
    2
    """
    shot = Shot.of_meshes(mesh, camera, size)
    check_straight(shot.camera)
    return peel_shot(shot, **options)
