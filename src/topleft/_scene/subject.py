"""Makes of whatever is given what is drawn: a `Mesh`, a `Scene` or `Points`, once, before a verb does anything with it.

Input: a mesh, a scene, points, a path, or a mesh of another library. Output: one of the first three; the meshes or the
instances in it.
"""

from __future__ import annotations

import os

from topleft._io.load import load
from topleft._model.mesh import Mesh
from topleft._model.points import Points
from topleft._scene.adapt import MeshLike, as_mesh
from topleft._scene.scene import Scene

__all__ = ["as_meshes", "as_subject", "meshes_of", "scene_of"]


def as_subject(given: MeshLike | Scene | Points) -> Mesh | Scene | Points:
    """What is drawn of what is given; of a path what `load` reads, of other things what `as_mesh` makes of them."""
    if isinstance(given, Mesh | Scene | Points):
        return given
    return load(given) if isinstance(given, str | os.PathLike) else as_mesh(given)


def as_meshes(given: MeshLike | Scene) -> Mesh | Scene:
    """The same for what needs triangles: points are refused."""
    return given if isinstance(given, Scene) else as_mesh(given)


def meshes_of(subject: Mesh | Scene) -> list[Mesh]:
    """The mesh of each instance."""
    return [subject] if isinstance(subject, Mesh) else [instance.mesh for instance in subject]


def scene_of(subject: Mesh | Scene) -> Scene:
    """The scene, or that of a mesh alone."""
    return subject if isinstance(subject, Scene) else Scene([subject])
