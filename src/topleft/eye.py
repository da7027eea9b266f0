"""Eye space: normals and distances of the visible pixels as the camera has them, in NumPy.

Input: `Fragments`, the mesh and the camera they were made with.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topleft.camera import Camera
from topleft.fragments import Fragments
from topleft.mesh import Mesh, face_normals, unit_or_zero

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


def eye_normals(frags: Fragments, mesh: Mesh, camera: Camera, *, is_smooth: bool) -> F32:
    """Unit normals (P, 3) float32 in eye space of the visible pixels in row order, on the side that is seen.

    A triangle seen from behind has its normals turned round as a whole, never pixel by pixel: so a mesh whose faces are
    inverted looks like one whose faces are not, and no edge of light runs through a triangle.
    """
    seen = frags.mask
    ids = frags.triangle[seen]
    linear = camera.view[:3, :3]
    points_eye = mesh.vertices @ linear.T + camera.view[:3, 3]
    faces = face_normals(points_eye, mesh.triangles)
    if camera.projection[3, 2] != 0:
        to_viewer = -points_eye[mesh.triangles[:, 0]]  # the eye is the origin
    else:
        to_viewer = np.broadcast_to([0.0, 0.0, 1.0], faces.shape)
    faces[(faces * to_viewer).sum(axis=1) < 0] *= -1
    if not is_smooth:
        return faces.astype(np.float32)[ids]
    vertex_normals = unit_or_zero(mesh.vertex_normals() @ np.linalg.inv(linear))
    a, b, c = mesh.triangles.T
    is_turned = ((vertex_normals[a] + vertex_normals[b] + vertex_normals[c]) * faces).sum(axis=1) < 0
    if is_turned[ids].any():
        sign = np.where(is_turned, -1, 1)[:, None, None]
        normals = frags.interpolate(sign * vertex_normals[mesh.triangles])[seen]
    else:
        normals = frags.interpolate(vertex_normals)[seen]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # Normals that cancel (or were never there) leave the one of the face.
    return np.where(length > 1e-6, normals / np.maximum(length, 1e-6), faces.astype(np.float32)[ids])


def eye_distance(depth: F32, camera: Camera) -> F64:
    """Distance along the view, world units, of window depths in [0, 1]: `-z` in eye space."""
    (a, b), (c, d) = camera.projection[2:, 2:]
    ndc = 2.0 * depth.astype(np.float64) - 1
    return (ndc * d - b) / (ndc * c - a)


def distances(frags: Fragments, camera: Camera) -> tuple[float, float] | None:
    """The least and the greatest distance along the view of what any sample shows; None where there is nothing."""
    depth = frags.samples_depth[frags.samples_triangle >= 0]
    if not depth.size:
        return None
    ends = eye_distance(np.array([depth.min(), depth.max()]), camera)
    return float(ends[0]), float(ends[1])
