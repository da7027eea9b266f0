"""Scenes through a lens: each instance is bent by itself, then they are drawn as a scene that no lens sees.

Input: `Scene`, a camera with or without lens. Output: what is drawn of it, and fragments in terms of whole triangles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._camera.camera import Camera
from topleft._model.mesh import Mesh
from topleft._model.scene import Instance, Scene
from topleft._render.bend import BentMesh, bend
from topleft._render.fragments import BentFragments, Part, SceneFragments
from topleft._render.instances import draw_scene
from topleft._render.scene_shade import camera_of

__all__ = ["BentSceneFragments", "DrawnScene", "draw_seen", "scene_through"]

MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


class DrawnMesh(NamedTuple):
    """What the verbs draw of a mesh."""

    vertices: npt.NDArray[Any]
    triangles: npt.NDArray[np.integer[Any]]
    transform: npt.NDArray[np.float64]
    bent: BentMesh | None


def seen_through(mesh: Mesh, camera: Camera, frame: tuple[int, int], *, near_clip: bool = True) -> DrawnMesh:
    """The mesh as it is, and the camera's matrix for a whole picture of this size; or as the camera's lens bends it."""
    if camera.lens is None:
        return DrawnMesh(mesh.vertices, mesh.triangles, camera.clip_from_world(frame), None)
    bent = bend(mesh.vertices, mesh.triangles, camera, camera.lens, frame, near_clip=near_clip)
    return DrawnMesh(bent.points_eye, bent.triangles, camera.clip_from_eye(frame), bent)


class DrawnScene(NamedTuple):
    """What the verbs draw of a scene."""

    scene: Scene
    clip_from_world: npt.NDArray[np.float64]
    bent: tuple[BentMesh, ...] | None


def scene_through(scene: Scene, camera: Camera, frame: tuple[int, int], *, near_clip: bool = True) -> DrawnScene:
    """The scene as it is, and the camera's matrix for a whole picture of this size; or as the camera's lens bends it.

    What is bent stands in eye space, mirrored instances mirrored twice: so they stay mirrored, for `cull`.
    """
    if camera.lens is None:
        return DrawnScene(scene, camera.clip_from_world(frame), None)
    many, instances = [], []
    for instance in scene:
        mesh = instance.mesh
        bent = bend(mesh.vertices, mesh.triangles, camera_of(camera, instance), camera.lens, frame, near_clip=near_clip)
        place = MIRROR if instance.is_mirrored else np.eye(4)
        many.append(bent)
        instances.append(Instance(Mesh(bent.points_eye * np.diag(place)[:3], bent.triangles.astype(np.int32)), place))
    return DrawnScene(Scene(instances), camera.clip_from_eye(frame), tuple(many))


class BentSceneFragments(SceneFragments):
    """The visibility buffer of a scene whose triangles were drawn in parts, in terms of the whole ones."""

    def __init__(self, drawn: SceneFragments, bent: Sequence[BentMesh], scene: Scene) -> None:
        """Take the fragments of the parts, the parts, and the whole scene."""
        sources = [one.source + first for one, first in zip(bent, scene.first_ids[:-1].tolist(), strict=True)]
        wholes = np.concatenate([*sources, [-1]]).astype(np.int32)  # part -1, none, is the last
        ids, depth = drawn.planes
        super().__init__(wholes[ids], depth, drawn.placed, drawn.positions)
        self.drawn, self.bent = drawn, bent
        self._scene_of_wholes = scene

    @property
    def whole(self) -> Scene:
        """The scene that `triangle` counts the triangles of."""
        return self._scene_of_wholes

    def again(self) -> BentSceneFragments:
        """Return the same made anew from the parts, whose buffers have changed."""
        return BentSceneFragments(self.drawn, self.bent, self._scene_of_wholes)

    def sample(self, i: int) -> BentSceneFragments:
        """Return ids, depth and attributes at one sample of each pixel."""
        return BentSceneFragments(self.drawn.sample(i), self.bent, self._scene_of_wholes)

    def only(self, rows: npt.NDArray[np.intp], cols: npt.NDArray[np.intp]) -> BentSceneFragments:
        """Return what is left when no other pixels than these show a triangle."""
        return BentSceneFragments(self.drawn.only(rows, cols), self.bent, self._scene_of_wholes)

    def _make_parts(self) -> Iterator[Part]:
        for part in self.drawn.parts:
            bent, mesh = self.bent[part.instance], self._scene_of_wholes[part.instance].mesh
            arrays = bent.triangles, bent.source, bent.weights, mesh.triangles, len(mesh.vertices)
            yield Part(part.instance, part.rows, part.columns, BentFragments(part.frags, *arrays))


def draw_seen(scene: Scene, camera: Camera, size: tuple[int, int], **view: Any) -> SceneFragments:
    """The visibility buffer of a scene, through a lens too; options as for `draw_scene`."""
    seen = scene_through(scene, camera, view.get("viewport") or size, near_clip=view.get("near_clip", True))
    frags = draw_scene(seen.scene, seen.clip_from_world, size, **view)
    return frags if seen.bent is None else BentSceneFragments(frags, seen.bent, scene)
