"""Renders: a mesh or scene and a camera to a picture, in one call, or by its visibility buffer.

Input: `Mesh` or `Scene`, `Camera`. Output: the picture (H, W, 4) uint8 of `render`, the visibility buffer of
`rasterize_mesh`, or the picture that `shade` makes of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Unpack, cast

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.array_types import U8, MeshLike
from topleft._core.base.arrays import as_size
from topleft._core.base.color import DEFAULT_COLOR, WHITE, ColorLike
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft._core.base.memory import Memory, empty
from topleft._core.base.options import Sink, meant
from topleft._core.raster import choices
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.rasterize import FragmentOptions, refuse_many
from topleft._core.raster.snap import source_of
from topleft._core.raster.verbs import Rasterizer
from topleft._core.raster.view import View, ViewOptions, WindowOptions
from topleft._meshes.camera.camera import Camera, CameraLike, as_camera
from topleft._meshes.model.environment import Environment
from topleft._meshes.model.light import Fog, Light
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.points import Points
from topleft._meshes.model.texture import Texture
from topleft._meshes.picture.blended import blended_masks, lay_blended
from topleft._meshes.picture.cloud import CloudShot, shade_cloud
from topleft._meshes.picture.draw_scene import draw_ids
from topleft._meshes.picture.edges import draw_all_edges
from topleft._meshes.picture.fragments import counts_of, shown_of
from topleft._meshes.picture.holes import Cut, cuts_of, draw_solid
from topleft._meshes.picture.placed import Mask, Placed
from topleft._meshes.picture.shade import (
    NUMBERS,
    Lit,
    LookOptions,
    ShadingOptions,
    ShownInstance,
    shade_instances,
    shade_numbers,
)
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene.scene import EYE, Scene, scene_of
from topleft.typing import CullOption, DepthTestOption, SamplesOption, SamplingOption, ShadingOption

MOST_KEPT = 64
"""Options that are kept of a mesh or a scene: by size, look and sides."""

SUBJECTS: dict[str, type] = {"Mesh": Mesh, "Scene": Scene, "Points": Points}


@dataclass(frozen=True, eq=False)
class PictureOptions:
    """The checked options of `render` for one subject, size and look. Kept with the subject, they hold no mesh."""

    view: View
    look: ShadingOptions
    cuts: Sequence[Cut | None]
    """The materials with holes of each instance."""
    blended: Sequence[Mask | None] | None
    """The blended triangles of each instance; None where there are none."""
    mesh_view: View | None
    """The view of a mesh alone, with the sides that it shows."""

    @classmethod
    def of(cls, shot: Shot, view: dict[str, Any], look: dict[str, Any]) -> PictureOptions:
        """Return the checked options of a shot, kept with its subject unless a value may change.

        Options of a mesh in parts of several levels are not kept: other choices of parts share its cache.
        """
        subject = shot.scene[0].mesh if shot.is_mesh else shot.scene
        if shot.is_mesh and shot.scene[0].mesh.is_in_parts:
            return cls.parse(shot, view, look)
        try:
            kinds = *map(type, look["color"]), None, *map(type, look["background"])  # (1.0, 0, 0) is red
            values = *view.values(), *look.values()
            key = shot.size, shot.camera.is_mirrored, *look, *values, *map(type, values), *kinds
            found = subject.cache.pictures.get(key)
        except TypeError:  # a list, say
            return cls.parse(shot, view, look)
        if found is None:
            found = cls.parse(shot, view, look)
            if len(subject.cache.pictures) >= MOST_KEPT:
                subject.cache.pictures.clear()
            subject.cache.pictures[key] = found
        return found

    @classmethod
    def parse(cls, shot: Shot, options: dict[str, Any], shading: dict[str, Any]) -> PictureOptions:
        """Check the options."""
        look = ShadingOptions.parse(**shading)
        view = View.parse(shot.size, cast(ViewOptions, options))
        refuse_many(view, "rasterize")
        scene, mesh_view = shot.scene, None
        if shot.is_mesh:  # as a camera without a lens sees it
            placed = Placed(scene, scene, shot.camera, EYE, view, is_mesh=True, material=look.material)
            mesh_view = placed.view_of(0).but(transform=None, static=None)
        return cls(view, look, cuts_of(scene, look.material), blended_masks(scene, look), mesh_view)


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
        known = ("size", *(render.__kwdefaults__ or ()), *LookOptions.__annotations__)
        raise TypeError(f"render() got an unexpected keyword argument {option!r}{meant(option, known)}")
    view: dict[str, Any] = {"cull": cull, "sampling": sampling, "subpixel_bits": subpixel_bits, "threads": threads}
    given: dict[str, Any] = {"shading": shading, "color": color, "background": background, "threads": threads, **look}
    shot = Shot.of(mesh, camera, size)
    if isinstance(shot, CloudShot):
        return shot.render(view, ShadingOptions.parse(**given), edges=edges)
    view |= shot.camera.depth_options
    options = PictureOptions.of(shot, view, given)
    if not (type(tolerance) is float and tolerance == 0):
        in_parts = not edges and options.blended is None
        shot = shot.within(tolerance, in_parts=in_parts, cull=cull, material=options.look.material)
        options = PictureOptions.of(shot, view, given)
    with shot.memory(rasterizer) as memory:
        placed = Placed.of(shot, options.view, options.look.material, mesh_view=options.mesh_view)
        picture = None if edges else draw_at_once(memory, placed, options)
        if picture is not None:
            return picture
        masks = None if options.blended is None else placed.masks_as_drawn(options.blended)
        solid = draw_solid(memory, placed, options.cuts, masks)
        picture = shade_by(solid, shot.scene, shot.camera, options.look)
        if masks is not None:
            lay_blended(picture, solid, placed, masks, options.look)
        if edges:
            draw_all_edges(picture, solid, placed, options.look, cull=cull)
    return picture


def draw_at_once(memory: Memory, placed: Placed, options: PictureOptions) -> U8 | None:
    """The picture of a small opaque mesh by one call of the engine; None of others, and where a vertex is clipped, say.

    Ids and depth lie in this memory.
    """
    look = options.look
    if not placed.is_plain_mesh or look.mode in NUMBERS or options.blended is not None or any(options.cuts):
        return None
    mesh, view = placed.scene[0].mesh, placed.view_of(0)
    n = len(mesh.triangles)
    if mesh.is_in_parts or not choices.draws_at_once(view, n):
        return None
    if choices.pays_to_cluster_shaded(n) and not mesh.is_drawn_whole():
        return None
    n_bytes, shape = len(mesh.vertices) * engine.VERTEX_BYTES, view.size[::-1]
    source, records = source_of(mesh.vertices, view), memory.scratch("records", (n_bytes,), np.uint8)
    waiting = engine.UnprojectedMesh(
        source, records, None, mesh.triangles, None, view.raster_state, view.engine_viewport()
    )
    lit = Lit([ShownInstance(waiting, mesh, EYE)], placed.camera, view.size, look)
    ids, depth = memory.empty("triangle", shape, np.int32), memory.empty("depth", shape, np.float32)
    picture = empty((*shape, 4), np.uint8)
    return picture if lit.scene.draw(engine.Target(Sink.NEAREST, ids, depth, None), picture) else None


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
    if isinstance(shot, CloudShot):
        return shot.draw(cull=cull, threads=threads, **view)
    window = {"viewport": view.get("viewport"), "origin": view.get("origin", (0, 0))}
    shot = shot.within(tolerance, in_parts=True, cull=cull, **window)
    depth_test, background_depth = view.pop("depth_test", "less"), view.pop("background_depth", None)
    out = view.pop("out", None) if shot.is_mesh else None
    with shot.memory(rasterizer) as memory:
        placed = Placed.parse(shot, {"cull": cull, "threads": threads, **view})
        options = FragmentOptions.parse(depth_test, background_depth, out)
        return draw_ids(memory, placed, options)


def shade(
    frags: Fragments,
    mesh: Mesh | Scene | Points,
    camera: CameraLike,
    *,
    shading: ShadingOption = "smooth",
    color: ColorLike = DEFAULT_COLOR,
    background: ColorLike = WHITE,
    depth_range: tuple[float, float] | None = None,
    lights: Light | Sequence[Light] | None = None,
    ambient: float | None = None,
    material: Material | None = None,
    matcap: Texture | None = None,
    fog: Fog | None = None,
    environment: Environment | None = None,
    threads: int | None = None,
) -> U8:
    """The picture (H, W, 4) uint8 of a visibility buffer: sRGB, alpha 255 where a triangle shows.

    Parameters
    ----------
    frags : Fragments
        From `rasterize` or `rasterize_mesh`, of the mesh or scene. With several samples a pixel a triangle is
        shaded once in a pixel, at the first of the samples that see it, and the picture is the mean of the light of the
        samples, each at most white.
    mesh : Mesh, Scene or Points
        Its materials, and its colours, are used if it has any. Each instance of a scene is shaded by itself.
    camera : Camera
        The camera of `frags`.
    shading : {"smooth", "flat", "unlit", "matcap", "ids", "depth", "normals"}
        "smooth": interpolated vertex normals, lit in the pixel. "flat": the same with the normals of the faces. Both
        light the side that is seen, whichever it is. "unlit": colours and textures as they are. "matcap": the colour
        that `matcap` has for the normal. "ids": a colour for each triangle. "depth": grey, bright is near, over a range
        of distances. "normals": the smooth normal in eye space, x, y, z from -1..1 as red, green, blue:
        light blue faces the viewer.
    color, background : str, integers of 0 to 255 or floats of 0 to 1
        sRGB of a mesh without colours and materials, and with alpha where nothing shows; as for `render`.
    depth_range : (float, float), optional
        Distances along the view that are the brightest and the darkest grey of "depth", world units; unless given,
        those of the picture.
    lights : Light or sequence of Light, optional
        Lambert's cosine for each of them, or GGX on metallic-rough materials. Unless given: one headlight over the
        viewer's left shoulder, whose light wraps round the mesh; none in an environment.
    ambient : float, optional
        Light from all sides, not negative, 0.03 unless given, 0 in an environment.
    material : Material, optional
        For all triangles, instead of those of the mesh.
    matcap : Texture, optional
        A picture of a lit sphere, for "matcap". It is clamped, so the rim holds where normals turn away.
    fog : Fog, optional
        The depth cue.
    environment : Environment, optional
        Light from all around. Unless given, metallic-rough materials mirror a bright side, that of the headlight, and
        a dark one, and nothing else is lit by it.
    threads : int, optional
        How many threads shade; never changes a bit.

    Raises
    ------
    ValueError
        If the mesh has other numbers of vertices or triangles than the drawn one, `shading` is unknown, a colour is
        none, a number is outside its range, or "matcap" has no matcap.
    TypeError
        If `frags`, the mesh, a light, material, texture or environment is none.

    Examples
    --------
    >>> import topleft as tl
    >>> ball = tl.Mesh(*tl.scenes.icosphere(2))
    >>> camera = tl.Camera.framing(ball)
    >>> frags = tl.rasterize_mesh(ball, camera, (32, 32))
    >>> tl.shade(frags, ball, camera, shading="normals").shape
    (32, 32, 4)
    """
    camera = as_camera(camera)
    check_drawn(frags, mesh)
    options = ShadingOptions.parse(
        shading, color, background, depth_range, lights, ambient, material, matcap, fog, environment, threads
    )
    if isinstance(mesh, Points):
        return shade_cloud(frags, mesh, camera, options)
    return shade_by(frags, scene_of(mesh), camera, options)


def shade_by(frags: Fragments, scene: Scene, camera: Camera, options: ShadingOptions) -> U8:
    """The picture of a visibility buffer by checked options."""
    if options.mode in NUMBERS:
        return shade_numbers(frags, camera, options)
    return shade_instances(shown_of(frags, scene), frags._buffers(), camera, options)


def check_drawn(frags: Fragments, mesh: Mesh | Scene | Points) -> None:
    """Raise an error unless the subject can be what was drawn: kernels index its arrays by fragments."""
    if not isinstance(frags, Fragments):
        raise TypeError(f"frags must be Fragments, got {type(frags).__name__}")
    kind, drawn = frags._subject_kind, frags._counts()
    if not isinstance(mesh, SUBJECTS[kind]):
        raise TypeError(f"mesh must be a {kind}, got {type(mesh).__name__}")
    given = [(len(mesh), len(mesh))] if isinstance(mesh, Points) else counts_of(scene_of(mesh))
    if len(drawn) != len(given):
        raise ValueError(f"mesh must be the scene that was drawn, of {len(drawn)} instances, got one of {len(given)}")
    for k, (old, new) in enumerate(zip(drawn, given, strict=True)):
        if old != new:
            name = f"mesh[{k}]" if kind == "Scene" else "mesh"
            raise ValueError(
                f"{name} must be the one that was drawn, with {old[0]} vertices and {old[1]} triangles, "
                f"got {new[0]} and {new[1]}"
            )
