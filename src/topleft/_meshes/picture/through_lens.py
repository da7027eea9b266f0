"""Finds what to draw of a mesh or scene: itself, or the parts that a lens makes of it.

Input: `Mesh` or `Scene`, a camera with or without lens. Output: `DrawnMesh` or `DrawnScene`, what the verbs draw.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import Array
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.mesh import trusted_mesh
from topleft._meshes.picture.bend import BentMesh, bend
from topleft._meshes.scene.scene import Instance, Scene

MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


class DrawnMesh(NamedTuple):
    """What the verbs draw of a mesh."""

    vertices: Array
    triangles: Array
    transform: npt.NDArray[np.float64]
    bent: BentMesh | None


def seen_through(
    vertices: Array, triangles: Array, camera: Camera, frame: tuple[int, int], *, near_clip: bool = True
) -> DrawnMesh:
    """The mesh as it is, and the camera's matrix for a whole picture of this size; or as the camera's lens bends it."""
    if camera.lens is None:
        return DrawnMesh(vertices, triangles, camera.clip_from_world(frame), None)
    bent = bend(vertices, triangles, camera, camera.lens, frame, near_clip=near_clip)
    return DrawnMesh(bent.points_eye, bent.triangles, camera.clip_from_eye(frame), bent)


class DrawnScene(NamedTuple):
    """What is drawn of a scene, and the scene itself, which ids count the triangles of."""

    scene: Scene
    whole: Scene
    clip_from_world: npt.NDArray[np.float64]
    bent: tuple[BentMesh, ...] | None


def scene_through(scene: Scene, camera: Camera, frame: tuple[int, int], *, near_clip: bool = True) -> DrawnScene:
    """The scene as it is, and the camera's matrix for a whole picture of this size; or as the camera's lens bends it.

    What is bent stands in eye space, mirrored instances mirrored twice: so they stay mirrored, for `cull`.
    """
    if camera.lens is None:
        return DrawnScene(scene, scene, camera.clip_from_world(frame), None)
    scene.check_counted("a scene behind a lens")
    many, instances = [], []
    for instance in scene:
        mesh = instance.mesh
        own = camera.placed(instance.transform)
        bent = bend(mesh.vertices, mesh.triangles, own, camera.lens, frame, near_clip=near_clip)
        place = MIRROR if instance.is_mirrored else np.eye(4)
        points = bent.points_eye * np.diag(MIRROR)[:3] if instance.is_mirrored else bent.points_eye
        many.append(bent)
        instances.append(Instance(trusted_mesh(points, bent.triangles), place))
    return DrawnScene(Scene(instances), scene, camera.clip_from_eye(frame), tuple(many))
