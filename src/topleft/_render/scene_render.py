"""Pictures of scenes: each instance is shaded by itself, in the rectangle that it shows in.

Input: `SceneFragments`, `Scene`, `Camera`. Output: a picture (H, W, 4) uint8, sRGB with alpha.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._base.color import id_colors
from topleft._camera.camera import Camera
from topleft._model.light import Light, LightKind, LightSpace
from topleft._model.mesh import Mesh
from topleft._model.scene import Instance, Scene
from topleft._raster.fragments import Fragments
from topleft._render.scene_fragments import BentFragments, SceneFragments
from topleft._shade.frame import is_similarity
from topleft._shade.shade import shade

__all__ = ["camera_of", "cull_of", "drawn_of", "shade_scene"]


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
    # `Look` measures distances in object space where the way to the eye keeps angles, else in eye space.
    in_object_space = is_similarity(camera.view @ instance.transform)
    scale = np.cbrt(abs(np.linalg.det(instance.transform[:3, :3]))) if in_object_space else 1.0
    moved = []
    for light in lights:
        if not isinstance(light, Light):
            raise TypeError(f"lights must be of Light, got {type(light).__name__}")
        at = np.array([*light.at, light.kind == LightKind.POINT])
        at = at if light.space == LightSpace.EYE else object_from_world @ at
        moved.append(replace(light, at=tuple(at[:3]), falloff=float(light.falloff * scale**2)))
    return moved


def shade_scene(
    frags: Fragments, scene: Scene, camera: Camera, *, background: tuple[int, ...], shading: str, **look: Any
) -> npt.NDArray[np.uint8]:
    """The picture (H, W, 4) uint8 of a scene; options as for `shade`, "ids" colours the triangles of all instances."""
    picture = np.empty((*frags.id.shape, 4), np.uint8)
    picture[...] = background
    if not isinstance(frags, SceneFragments):
        raise TypeError(f"frags must be what rasterize_mesh returns of a scene, got {type(frags).__name__}")
    lights: Sequence[Light] | None = look.pop("lights", None)
    for part in frags.parts:
        instance = scene[part.instance]
        look["lights"] = lights_of(lights, camera, instance)
        shown, mesh = drawn_of(part.frags, instance.mesh)
        own_camera = camera_of(camera, instance).straightened()
        own = shade(shown, mesh, own_camera, background=background, shading=shading, **look)
        seen = part.frags.mask
        picture[part.box][seen] = own[seen]
    if shading == "ids":
        picture[frags.mask, :3] = id_colors(frags.id[frags.mask])
    return picture
