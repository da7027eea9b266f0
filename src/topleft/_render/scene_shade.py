"""Shades a visibility buffer, of a scene each instance by itself, in the rectangle that it shows in.

Input: `Fragments`, the `Mesh` or `Scene` and the `Camera` they were made with. Output: a picture (H, W, 4) uint8, sRGB
with alpha.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from topleft._base.color import DEFAULT_COLOR, Color
from topleft._camera.camera import Camera
from topleft._model.light import Fog, Light, LightKind, LightSpace
from topleft._model.material import Material
from topleft._model.mesh import Mesh
from topleft._model.scene import Instance, Scene
from topleft._model.texture import Texture
from topleft._raster.fragments import Fragments
from topleft._render.fragments import BentFragments, SceneFragments
from topleft._shade.look import is_similarity
from topleft._shade.shade import Shading, ShadingOptions, shade_mesh, shade_numbers, shade_samples

__all__ = ["camera_of", "cull_of", "drawn_of", "shade"]

U8 = npt.NDArray[np.uint8]


def camera_of(camera: Camera, instance: Instance) -> Camera:
    """The camera as it stands in the object space of an instance."""
    return replace(camera, view=camera.view @ instance.transform)


def drawn_of(frags: Fragments, mesh: Mesh) -> tuple[Fragments, Mesh]:
    """The fragments and the mesh as they were drawn: through a lens those of its parts."""
    return (frags.parts, frags.mesh_of_parts(mesh)) if isinstance(frags, BentFragments) else (frags, mesh)


def cull_of(cull: str, instance: Instance) -> str:
    """What `cull` leaves out of an instance, whose winding is turned over where it is mirrored."""
    return {"back": "front", "front": "back"}.get(cull, cull) if instance.is_mirrored else cull


def lights_of(lights: Sequence[Light] | None, camera: Camera, instance: Instance) -> Sequence[Light] | None:
    """The lights as they stand in the object space of an instance, as bright as they are in the world."""
    if lights is None:
        return None
    object_from_world = np.linalg.inv(instance.transform)
    # `ShadingInputs` measures distances in object space where the way to the eye keeps angles, else in eye space.
    in_object_space = is_similarity(camera.view @ instance.transform)
    scale = np.cbrt(abs(np.linalg.det(instance.transform[:3, :3]))) if in_object_space else 1.0
    moved = []
    for light in lights:
        at = np.array([*light.at, light.kind == LightKind.POINT])
        at = at if light.space == LightSpace.EYE else object_from_world @ at
        moved.append(replace(light, at=tuple(at[:3]), falloff=float(light.falloff * scale**2)))
    return moved


def shade(
    frags: Fragments,
    mesh: Mesh | Scene,
    camera: Camera,
    *,
    shading: str = "smooth",
    color: Color = DEFAULT_COLOR,
    background: Color = (255, 255, 255, 255),
    depth_range: tuple[float, float] | None = None,
    lights: Sequence[Light] | None = None,
    ambient: float | None = None,
    material: Material | None = None,
    matcap: Texture | None = None,
    fog: Fog | None = None,
    threads: int | None = None,
) -> U8:
    """The picture (H, W, 4) uint8 of a visibility buffer: sRGB, alpha 255 where a triangle shows.

    Parameters
    ----------
    frags : Fragments
        What `rasterize` or `rasterize_mesh` returned for the mesh or scene. With several samples a pixel a triangle is
        shaded once in a pixel, at the first of the samples that see it, and the picture is the mean of the light of the
        samples.
    mesh : Mesh or Scene
        Its materials, and its colours, are used if it has any. Each instance of a scene is shaded by itself.
    camera : Camera
        The camera of `frags`.
    shading : {"smooth", "flat", "unlit", "matcap", "ids", "depth", "normals"}
        "smooth": interpolated vertex normals, lit in the pixel. "flat": the same with the normals of the faces. Both
        light the side that is seen, whichever it is. "unlit": colours and textures as they are. "matcap": the colour
        that `matcap` has for the normal. "ids": a colour for each triangle. "depth": grey, bright is near, over a range
        of distances. "normals": the smooth normal in eye space, x, y, z from -1..1 as red, green, blue; what
        faces the viewer is light blue.
    color : (3,) of 0 to 255
        sRGB colour of a mesh without colours and materials.
    background : (4,) of 0 to 255
        sRGB and alpha where nothing shows.
    depth_range : (float, float), optional
        Distances along the view that are the brightest and the darkest grey of "depth", world units; unless given,
        those of the picture.
    lights : sequence of Light, optional
        Lambert's cosine for each of them. Unless given: one headlight over the viewer's left shoulder, whose light
        wraps round the mesh.
    ambient : float, optional
        Light from all sides, not negative, 0.03 unless given.
    material : Material, optional
        For all triangles, instead of those of the mesh.
    matcap : Texture, optional
        A picture of a lit sphere, for "matcap". It is clamped, so the rim holds where normals turn away.
    fog : Fog, optional
        The depth cue.
    threads : int, optional
        How many threads shade; never changes a bit.

    Raises
    ------
    ValueError
        If the mesh has other numbers of vertices or triangles than what was drawn, `shading` is unknown, a colour is
        none, a number is outside its range, or "matcap" has no matcap.
    TypeError
        If `frags`, the mesh, a light, material or texture is none.
    """
    options = ShadingOptions.parse(
        shading, color, background, depth_range, lights, ambient, material, matcap, fog, threads
    )
    check_drawn(frags, mesh)
    if options.mode in (Shading.IDS, Shading.DEPTH):
        return shade_numbers(frags, camera, options)
    if isinstance(mesh, Scene):
        return shade_samples(frags, lambda one: shade_instances(one, mesh, camera, options), options.background)
    own_camera = camera.straightened() if isinstance(frags, BentFragments) else camera
    return shade_mesh(*drawn_of(frags, mesh), own_camera, options)


def shade_instances(frags: Fragments, scene: Scene, camera: Camera, options: ShadingOptions) -> U8:
    """The picture (H, W, 4) uint8 of a scene, one sample a pixel: each instance is shaded by itself."""
    picture = np.empty((*frags.id.shape, 4), np.uint8)
    picture[...] = options.background
    assert isinstance(frags, SceneFragments)
    for part in frags.parts:
        instance = scene[part.instance]
        lights = lights_of(options.lights, camera, instance)
        own_camera = camera_of(camera, instance).straightened()
        own = shade_mesh(*drawn_of(part.frags, instance.mesh), own_camera, replace(options, lights=lights))
        seen = part.frags.mask
        picture[part.box][seen] = own[seen]
    return picture


def check_drawn(frags: Fragments, mesh: Mesh | Scene) -> None:
    """Raise an error unless the mesh or scene can be the one that was drawn: kernels index its arrays by fragments."""
    if not isinstance(frags, Fragments):
        raise TypeError(f"frags must be Fragments, got {type(frags).__name__}")
    kind = Scene if isinstance(frags, SceneFragments) else Mesh
    if not isinstance(mesh, kind):
        raise TypeError(f"mesh must be a {kind.__name__}, got {type(mesh).__name__}")
    meshes = [mesh] if isinstance(mesh, Mesh) else [instance.mesh for instance in mesh]
    given = [(len(one.vertices), len(one.triangles)) for one in meshes]
    counts = frags.n_drawn if isinstance(frags, SceneFragments) else [(frags._n_vertices, frags._n_triangles)]
    if len(counts) != len(given):
        raise ValueError(f"mesh must be the scene that was drawn, of {len(counts)} instances, got one of {len(given)}")
    for k, (drawn, own) in enumerate(zip(counts, given, strict=True)):
        if drawn != own:
            name = "mesh" if isinstance(mesh, Mesh) else f"mesh[{k}]"
            raise ValueError(
                f"{name} must be the one that was drawn, with {drawn[0]} vertices and {drawn[1]} triangles, "
                f"got {own[0]} and {own[1]}"
            )
