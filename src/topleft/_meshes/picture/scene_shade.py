"""Shades a visibility buffer of a mesh, a scene or points.

Input: `Fragments`, the `Mesh` or `Scene` and the `Camera` they were made with. Output: a picture (H, W, 4) uint8, sRGB
with alpha.
"""

from __future__ import annotations

from collections.abc import Sequence

from topleft._core.base.array_types import U8
from topleft._core.base.color import DEFAULT_COLOR, WHITE, ColorLike
from topleft._core.raster.fragments import Fragments
from topleft._meshes.camera.camera import Camera, CameraLike, as_camera
from topleft._meshes.model.environment import Environment
from topleft._meshes.model.light import Fog, Light
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.points import Points
from topleft._meshes.model.texture import Texture
from topleft._meshes.picture.cloud import shade_cloud
from topleft._meshes.picture.fragments import counts_of, shown_of
from topleft._meshes.picture.shade import NUMBERS, ShadingOptions, shade_instances, shade_numbers
from topleft._meshes.scene.scene import Scene, scene_of
from topleft.typing import ShadingOption

SUBJECTS: dict[str, type] = {"Mesh": Mesh, "Scene": Scene, "Points": Points}


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
