"""Renders: a mesh or scene and a camera to a picture, in one call.

Input: `Mesh` or `Scene`, `Camera`. Output: the picture (H, W, 4) uint8 of `render`, or the visibility buffer of
`rasterize_mesh`.
"""

from __future__ import annotations

from typing import Any, Literal, Unpack, cast

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_size
from topleft._core.base.color import DEFAULT_COLOR, WHITE, ColorLike
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.verbs import Rasterizer
from topleft._core.raster.view import WindowOptions
from topleft._meshes.camera.camera import CameraLike
from topleft._meshes.model.points import Points
from topleft._meshes.picture.blended import blended_masks, transparent_pass
from topleft._meshes.picture.buffers import rasterize_shot
from topleft._meshes.picture.cloud import draw_cloud, shade_cloud
from topleft._meshes.picture.edges import draw_all_edges
from topleft._meshes.picture.fragments import SceneFragments
from topleft._meshes.picture.holes import draw_visible
from topleft._meshes.picture.kept import kept_picture
from topleft._meshes.picture.scene_shade import shade_by
from topleft._meshes.picture.shade import LookOptions, ShadingOptions
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene.scene import Scene
from topleft.typing import CullOption, DepthTestOption, SamplesOption, SamplingOption, ShadingOption


class RasterizeOptions(WindowOptions, total=False):
    """The options of `rasterize` that `rasterize_mesh` passes on."""

    sampling: SamplingOption
    depth_test: DepthTestOption | None
    background_depth: float | None
    out: tuple[NDArray[np.int32] | None, NDArray[np.float32] | None] | None


def render(
    mesh: MeshLike | Scene | Points,
    camera: CameraLike | None = None,
    size: int | tuple[int, int] = DEFAULT_SIZE,
    *,
    shading: ShadingOption = "smooth",
    color: ColorLike = DEFAULT_COLOR,
    background: ColorLike = WHITE,
    cull: CullOption | None = None,
    edges: bool = False,
    sampling: SamplesOption = "center",
    subpixel_bits: int | Literal["exact"] = 8,
    tolerance: float = 0.0,
    threads: int | None = None,
    rasterizer: Rasterizer | None = None,
    **look: Unpack[LookOptions],
) -> npt.NDArray[np.uint8]:
    """A picture of the mesh or scene.

    Parameters
    ----------
    mesh : Mesh, Scene, Points, or whatever `as_mesh` takes
        The subject: a path, or a mesh of trimesh, meshio, pyvista, say. Its colours are used if it has any.
        Points have no edges, sides to cull, materials and levels; they are lit where they have normals.
    camera : Camera or (4, 4) array, optional
        Unless given, the three-quarter view of `Camera.framing`, with y up. A matrix is clip from world, see
        `Camera.from_matrix`.
    size : (width, height), or one number for a square; pixels
        640 x 480 unless given.
    shading : {"smooth", "flat", "unlit", "matcap", "ids", "depth", "normals"}
        The meaning of colours; `topleft.shade` describes each. The first three composite blended surfaces, of
        `alpha_mode="blend"` or colours with alpha, in linear light; the others show these as if they were opaque.
    color : str, (3,) integers of 0 to 255 or (3,) floats of 0 to 1
        sRGB colour of a mesh without colours: "red", "#f00", (255, 0, 0) and (1.0, 0.0, 0.0) are the same.
    background : str, (3,) or (4,) integers of 0 to 255 or floats of 0 to 1
        sRGB, and alpha if it is not opaque; white unless given, "transparent" is `(0, 0, 0, 0)`.
    cull : {"none", "back", "front"}, optional
        Triangles to leave out, by the side that is seen, whatever their materials say: "none" shows both sides of all.
        Unless given: the backs of materials that are not `double_sided`.
    edges : bool
        Whether the edges that show are drawn over it, as smooth dark lines.
    sampling : {"center", "msaa2", "msaa4", "msaa8", "msaa16"}
        Samples of a pixel. With several outlines are smooth: a triangle is shaded once in a pixel, where the first of
        its samples lies, and the light of the samples is averaged.
    subpixel_bits : int, 0 to 16, or "exact"
        As for `coverage`: which grid vertices snap to. "exact": they stay where they are.
    tolerance : float
        The largest error of outlines, pixels: the mesh is drawn at the coarsest level of detail that
        a bound on its distance allows in this view, see `choose_detail`. 0: the mesh itself. Levels are made at the
        first use, which takes a while, and kept with the mesh; `simplify` and `Levels.load` do that beforehand.
    threads : int, optional
        How many threads draw; never changes a bit.
    rasterizer : Rasterizer, optional
        Of this size: intermediate buffers lie in the memory that it keeps.
    **look
        `lights`, `ambient`, `material`, `matcap`, `fog` and `environment` of `topleft.shade`.

    Returns
    -------
    (H, W, 4) uint8
        sRGB with alpha: 255 where the mesh is, the background elsewhere, their mean where samples see both.

    Raises
    ------
    ValueError
        If the mesh has no triangles and no camera is given, or an option is unknown.
    MissingPackageError
        If levels of detail are to be made and fast-simplification is not installed.

    Examples
    --------
    >>> import topleft as tl
    >>> mesh = tl.Mesh(*tl.scenes.shape("cube"))
    >>> tl.render(mesh, size=(64, 48), background=(0, 0, 0, 0))[24, 32].tolist()[3]
    255
    """
    for option in look.keys() - LookOptions.__annotations__:
        raise TypeError(f"render() got an unexpected keyword argument {option!r}")
    view: dict[str, Any] = {"cull": cull, "sampling": sampling, "subpixel_bits": subpixel_bits, "threads": threads}
    given: dict[str, Any] = {"shading": shading, "color": color, "background": background, "threads": threads, **look}
    shot = Shot.of(mesh, camera, size)
    is_whole = type(tolerance) is float and not (tolerance or edges)
    if shot.is_mesh and is_whole and shot.camera.lens is None:
        kept = kept_picture(shot.subject, shot.size, view, given)
        if kept is not None:
            return kept.draw(shot.subject, shot.camera, rasterizer)
    options = ShadingOptions.parse(**given)
    if shot.cloud is not None:
        if edges:
            raise ValueError("points have no edges")
        return shade_cloud(draw_cloud(shot.cloud, shot.camera, shot.size, **view), shot.cloud, shot.camera, options)
    in_parts = not is_whole and not edges and blended_masks(shot.scene, options) is None
    shot = shot.within(tolerance, in_parts=in_parts, cull=cull, material=options.material)
    blended = transparent_pass(shot, options, view)
    frags = draw_visible(shot, rasterizer, options.material, **view) if blended is None else blended.draw_opaque()
    scene, camera = shot.scene, shot.camera
    picture = shade_by(frags, scene, camera, options)
    if blended is not None:
        blended.lay_over(picture, cast(SceneFragments, frags))
    if edges:
        draw_all_edges(picture, frags, scene, camera, options, cull=cull)
    return picture


def rasterize_mesh(
    mesh: MeshLike | Scene | Points,
    camera: CameraLike | None = None,
    size: int | tuple[int, int] = DEFAULT_SIZE,
    *,
    cull: CullOption | None = None,
    tolerance: float = 0.0,
    threads: int | None = None,
    rasterizer: Rasterizer | None = None,
    **view: Unpack[RasterizeOptions],
) -> Fragments:
    """The visibility buffer of the mesh or scene: ids and depth per pixel, and attributes interpolated on demand.

    Parameters
    ----------
    mesh, camera, size, cull, threads
        As for `render`.
    tolerance : float
        As for `render`; unless it is 0 ids are those of the level's triangles, ``choose_detail(...).mesh``.
    rasterizer : Rasterizer, optional
        Of this size: the result lies in its memory, until the next call. Scenes are drawn in memory of their own.
    **view
        Other options of `rasterize`, `origin=` for a window of a larger picture, say.

    Returns
    -------
    Fragments
        `.triangle` (H, W) int32, -1 where there is nothing; `.depth` (H, W) float32, window depth in [0, 1], +inf where
        there is nothing. Of a scene `SceneFragments`: also `.instance` (H, W) int32, and `.triangle` counts the
        triangles of its mesh. Of `Points` `PointFragments`: `.point` is the same as `.triangle`.

    Raises
    ------
    ValueError
        If the mesh has no triangles and no camera is given, an option is unknown, or `rasterizer` has another size.

    Examples
    --------
    >>> import topleft as tl
    >>> cube = tl.Mesh(*tl.scenes.cube())
    >>> camera = tl.Camera.look_at((0, 0, 5), (0, 0, 0), up=(0, 1, 0))
    >>> frags = tl.rasterize_mesh(cube, camera, (9, 9))
    >>> round(float(frags.distance(camera)[4, 4]), 3)
    4.0
    """
    shot = Shot.of(mesh, camera, size)
    if view.get("viewport") is not None:
        view["viewport"] = as_size(view["viewport"], "viewport", smallest=1)
    if shot.cloud is not None:
        return draw_cloud(shot.cloud, shot.camera, shot.size, cull=cull, threads=threads, **view)
    window = {"viewport": view.get("viewport"), "origin": view.get("origin", (0, 0))}
    shot = shot.within(tolerance, in_parts=True, cull=cull, **window)
    return rasterize_shot(shot, rasterizer, is_split=False, cull=cull, threads=threads, **view)
