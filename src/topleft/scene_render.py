"""Pictures of scenes: each instance is shaded by itself, in the rectangle that it shows in.

Input: `SceneFragments`, `Scene`, `Camera`. Output: a picture (H, W, 4) uint8, sRGB with alpha.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.camera import Camera
from topleft.colors import id_colors
from topleft.cutout import has_holes
from topleft.fragments import Fragments
from topleft.material import Material
from topleft.scene import Instance, Scene
from topleft.scene_fragments import SceneFragments
from topleft.shade import shade

__all__ = ["camera_of", "cull_of", "refuse_holes", "shade_scene"]


def camera_of(camera: Camera, instance: Instance) -> Camera:
    """The camera as it stands in the object space of an instance."""
    return replace(camera, view=camera.view @ instance.transform)


def cull_of(cull: str, instance: Instance) -> str:
    """What `cull` leaves out of an instance, whose winding is turned over where it is mirrored."""
    return {"back": "front", "front": "back"}.get(cull, cull) if instance.is_mirrored else cull


def refuse_holes(scene: Scene, material: Material | None) -> None:
    """Raise an error where a material cuts something out: what lies behind a hole may belong to another instance."""
    for i, instance in enumerate(scene):
        own = instance.mesh.materials if material is None else (material,)
        if any(has_holes(one, instance.mesh) for one in own):
            raise ValueError(f"scenes have no cut-outs, but a material of instance {i} has an alpha_cutoff")


def shade_scene(
    frags: Fragments, scene: Scene, camera: Camera, *, background: tuple[int, ...], shading: str, **look: Any
) -> npt.NDArray[np.uint8]:
    """The picture (H, W, 4) uint8 of a scene; options as for `shade`, "ids" colours the triangles of all instances."""
    picture = np.empty((*frags.id.shape, 4), np.uint8)
    picture[...] = background
    if not isinstance(frags, SceneFragments):
        raise TypeError(f"frags must be what rasterize_mesh returns of a scene, got {type(frags).__name__}")
    for part in frags.parts:
        instance = scene[part.instance]
        own = shade(
            part.frags, instance.mesh, camera_of(camera, instance), background=background, shading=shading, **look
        )
        seen = part.frags.mask
        picture[part.box][seen] = own[seen]
    if shading == "ids":
        picture[frags.mask, :3] = id_colors(frags.id[frags.mask])
    return picture
