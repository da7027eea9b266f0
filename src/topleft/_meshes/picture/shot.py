"""Makes a shot: the subject, the camera, and the size of the picture.

Input: whatever a picture takes: a mesh, a scene, points, a path, a camera or none. Output: `Shot`.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Any

from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_size, shown
from topleft._core.base.memory import FRESH, Memory
from topleft._core.raster.verbs import Rasterizer
from topleft._meshes.camera.camera import Camera, CameraLike, camera_for
from topleft._meshes.lod.detail import detailed
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.points import Points
from topleft._meshes.picture.cloud import CloudShot
from topleft._meshes.scene.scene import Scene, as_meshes, as_subject, scene_of

UNSHARED: AbstractContextManager[Memory] = nullcontext(FRESH)


@dataclass(frozen=True, eq=False)
class Shot:
    """A scene and its camera; a mesh alone is a scene of one instance. Points have a `CloudShot`."""

    scene: Scene
    camera: Camera
    size: tuple[int, int]
    is_mesh: bool = False
    may_cut: bool = False
    """Whether the camera has planes that no picture has compared with the subject yet."""

    @classmethod
    def of(cls, given: MeshLike | Scene | Points, camera: CameraLike | None, size: object) -> Shot | CloudShot:
        """Return a shot of a subject; without a camera the three-quarter view."""
        checked, subject = as_size(size), as_subject(given)
        seen_by = camera_for(subject, camera, checked)
        if isinstance(subject, Points):
            return CloudShot(subject, seen_by, checked)
        is_new = camera is not None and seen_by.has_planes and seen_by not in subject.cache.checked_cameras
        scene = scene_of(subject)
        return cls(scene, seen_by, checked, scene is not subject, is_new)

    @classmethod
    def of_meshes(cls, given: MeshLike | Scene, camera: CameraLike | None, size: object) -> Shot:
        """Return a shot of a mesh or a scene, as `of` does; points are refused."""
        checked, subject = as_size(size), as_meshes(given)
        scene, seen_by = scene_of(subject), camera_for(subject, camera, checked)
        is_new = camera is not None and seen_by.has_planes and seen_by not in subject.cache.checked_cameras
        return cls(scene, seen_by, checked, scene is not subject, is_new)

    def memory(self, rasterizer: Rasterizer | None) -> AbstractContextManager[Memory]:
        """Return the memory of a `Rasterizer` of a mesh's size, which draws nothing else meanwhile, or fresh memory.

        Fragments refer to their inputs, so fresh memory is not drawn into again.
        """
        if rasterizer is None or not self.is_mesh:
            return UNSHARED
        if not isinstance(rasterizer, Rasterizer):
            raise TypeError(f"rasterizer must be a Rasterizer or None, got {shown(rasterizer)}")
        if rasterizer.size != self.size:
            raise ValueError(f"rasterizer must have the size {self.size}, got {rasterizer.size}")
        return rasterizer._lent

    @property
    def subject(self) -> Mesh | Scene:
        """The mesh or the scene, as verbs take it."""
        return self.scene[0].mesh if self.is_mesh else self.scene

    def within(self, tolerance: float, *, in_parts: bool = False, **options: Any) -> Shot:
        """Return the shot of the levels of detail that a tolerance in pixels allows; options as for `choose_detail`.

        `in_parts`: large meshes may have parts of several levels; what is drawn is asked of the view alone then.
        """
        if type(tolerance) is float and not tolerance:  # unless given
            return self
        scene = detailed(self.scene, self.camera, self.size, tolerance, in_parts=in_parts, **options)
        return self if scene is self.scene else replace(self, scene=scene)
