"""Tells once of planes that cut what lies in front of the eye, or leave the depth of float32 no room.

Input: a subject, a scene of it, and the camera of a picture. Output: `MeshWarning`, or lines for a listener.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F64, I32
from topleft._core.base.notes import level_outside, tell
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import moved
from topleft._meshes.scene.scene import Scene

if TYPE_CHECKING:
    from topleft._meshes.picture.shot import Shot

MOST_TRIANGLES = 2048
"""Triangles of a mesh that are looked at: all, or as many that are spread over a larger one."""

MOST_INSTANCES = 16
"""The most instances that are looked at, among instances whose boxes reach beyond a plane."""

SPREAD = 2654435761
"""A prime: its multiples, modulo the number of triangles, are spread over all of them."""

SLACK = 1e-6
"""Of the distance of a plane: what lies in a plane, up to rounding, is not cut."""

LARGE_RATIO = 1e5
"""far / near from which on the steps of depth are compared with meshes."""

STEPS_PER_MESH = 1000
"""Steps of depth in the size of a mesh, at least."""


def tell_of_planes(shot: Shot) -> None:
    """Tell of the planes of a shot's camera, at its first picture of this subject."""
    subject, camera = shot.subject, shot.camera
    subject.cache.checked_cameras.add(camera)
    with np.errstate(all="ignore"):
        lines = list(faults_of(shot.scene, camera, shot.size))
    if lines:
        tell(lines, stacklevel=level_outside())


def faults_of(scene: Scene, camera: Camera, size: tuple[int, int]) -> Iterator[str]:
    """Yield a line for each kind of fault; of equal planes equal lines."""
    near, far = camera.planes
    eye_from_objects = scene.clip_from_objects(camera.view)
    nearest, farthest, sizes = np.empty((3, len(scene)))
    for mesh, at in scene.meshes.values():
        low, high = mesh.vertex_box.reshape(2, 3)
        matrices = eye_from_objects[at, :3]
        turns = np.ascontiguousarray(matrices[:, :, :3]).reshape(-1, 3)
        reach = engine.product(np.abs(turns), (high - low) / 2).reshape(-1, 3)
        middle = -(engine.product(turns, (low + high) / 2)[2::3] + matrices[:, 2, 3])
        nearest[at], farthest[at] = middle - reach[:, 2], middle + reach[:, 2]
        sizes[at] = 2 * np.sqrt((reach * reach).sum(axis=1))
    room = near - SLACK * abs(near), far + SLACK * abs(far)
    is_beyond = ((nearest < room[0]) & (farthest > 0)) | (farthest > room[1])
    if is_beyond.any():
        found = np.flatnonzero(is_beyond)
        some = found[:: -(-len(found) // MOST_INSTANCES)].tolist()
        cuts = [cut_of(scene[i].mesh, eye_from_objects[i], camera, size, room) for i in some]
        words = [f"near={near:.6g}"] * any(cut[0] for cut in cuts) + [f"far={far:.6g}"] * any(cut[1] for cut in cuts)
        if words:
            verb = "cut" if len(words) > 1 else "cuts"
            wish = "planes round all that it shows, or none: without near= and far= it cuts nothing"
            yield f"camera should have {wish}; {' and '.join(words)} {verb} what lies in front of the eye"
    if camera.projection[3, 2] and far > LARGE_RATIO * near:
        steps = 2.0**-24 * np.maximum(nearest, near) ** 2 / near
        if ((steps * STEPS_PER_MESH > sizes) & (sizes > 0) & (farthest > near) & (nearest < far)).any():
            yield (
                f"camera should have far / near of at most {LARGE_RATIO:g} here, or no planes: between near={near:.6g} "
                f"and far={far:.6g} float32 has fewer than {STEPS_PER_MESH} steps of depth in the size of a mesh"
            )


def cut_of(
    mesh: Mesh, eye_from_object: F64, camera: Camera, size: tuple[int, int], room: tuple[float, float]
) -> tuple[bool, bool]:
    """Whether a triangle in the picture has a corner in front of the eye before `room`, and one beyond it."""
    corners = mesh.vertices[some_triangles(mesh)].reshape(-1, 3)
    eye = moved(corners, eye_from_object)
    distance = -eye[:, 2].reshape(-1, 3)
    is_before, is_beyond = (distance > 0) & (distance < room[0]), distance > room[1]
    if not (is_before.any() or is_beyond.any()):
        return False, False
    x, y, w = clip_of(eye, camera, size)
    sides = np.stack([w - x, w + x, w - y, w + y]).reshape(4, -1, 3)
    is_in = ~(sides < 0).all(axis=2).any(axis=0)
    return bool(is_before[is_in].any()), bool(is_beyond[is_in].any())


def clip_of(eye: F64, camera: Camera, size: tuple[int, int]) -> F64:
    """The x, y and w (3, N) of points in eye space, as the lens bends them."""
    projection = camera.clip_from_eye(size)[[0, 1, 3]]
    bent = eye if camera.lens is None else camera.lens.bend(eye)
    return engine.product(projection[:, :3], np.ascontiguousarray(bent.T)) + projection[:, 3:]


def some_triangles(mesh: Mesh) -> I32:
    """Return `MOST_TRIANGLES` triangles of a mesh at most."""
    n = len(mesh.triangles)
    return mesh.triangles if n <= MOST_TRIANGLES else mesh.triangles[np.arange(MOST_TRIANGLES) * SPREAD % n]
