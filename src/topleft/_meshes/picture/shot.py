"""Makes a shot of what is given to be drawn: the subject, who looks at it, and the size of the picture.

Input: whatever a picture takes: a mesh, a scene, points, a path, a camera or none. Output: `Shot`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_size
from topleft._meshes.camera.camera import Camera, CameraLike, camera_for
from topleft._meshes.lod.detail import detailed
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.points import Points
from topleft._meshes.scene.scene import Scene, as_meshes, as_subject


@dataclass(frozen=True, eq=False)
class Shot:
    """What is drawn, and who looks at it: `cloud` of points, or else the `subject`, of which `mesh` is one alone."""

    subject: Mesh | Scene
    cloud: Points | None
    camera: Camera
    size: tuple[int, int]

    @classmethod
    def of(
        cls, given: MeshLike | Scene | Points, camera: CameraLike | None, size: object, *, takes_points: bool = True
    ) -> Shot:
        """Return a shot of what is given; without a camera the three-quarter view."""
        checked = as_size(size)
        subject: Any = as_subject(given) if takes_points else as_meshes(given)
        return cls(
            subject, subject if isinstance(subject, Points) else None, camera_for(subject, camera, checked), checked
        )

    @property
    def mesh(self) -> Mesh | None:
        """The mesh that is drawn, unless a scene is."""
        return self.subject if isinstance(self.subject, Mesh) else None

    def within(self, tolerance: float, **options: Any) -> Shot:
        """Return the shot of the levels of detail that a tolerance in pixels allows; options as for `choose_detail`."""
        return replace(self, subject=detailed(self.subject, self.camera, self.size, tolerance, **options))
