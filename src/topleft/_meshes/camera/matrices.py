"""Makes the 4x4 matrices of cameras: poses, projections, and both of them for a subject in the frame.

Spaces: world; eye (OpenGL: x right, y up, the view along -z); clip (-w <= x, y, z <= w inside).

Based on: Segal, M., and K. Akeley, "The OpenGL Graphics System", 1992 (the matrices of glFrustum and glOrtho).
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, MeshLike
from topleft._core.base.arrays import as_number, as_real, check_regular
from topleft._core.base.defaults import THREE_QUARTER_DEG
from topleft._core.base.options import parse
from topleft._meshes.model.mesh import Mesh, extreme_points, used_vertices
from topleft._meshes.model.points import Points
from topleft._meshes.scene.adapt import is_mesh_like
from topleft._meshes.scene.scene import Scene, as_subject, world_corners
from topleft.typing import UpOption

Framed: TypeAlias = Mesh | Scene | Points | F64

FRAMING_MARGIN = 1.05
"""A subject that fits fills 1 / 1.05 of the frame, so that no outline touches its border."""

SILHOUETTE_MARGIN = 0.05
"""The share of the frame that `fit="silhouette"` leaves free at each end of the side that is filled."""


def as_framed(subject: MeshLike | Scene | npt.ArrayLike) -> Framed:
    """The subject to frame: a mesh, a scene, or points, by themselves or in a cloud."""
    if isinstance(subject, Scene | Points) or is_mesh_like(subject):
        return as_subject(subject)
    return as_real("subject", subject)


def up_of(subject: Framed) -> UpOption:
    """The axis that points up unless something else is asked for: that of a mesh, else y."""
    return subject.up if isinstance(subject, Mesh) else "y"


def points_to_frame(subject: Framed) -> F64:
    """The points (N, 3) float64 of a subject that count: vertices that triangles use, each once, or all points."""
    if isinstance(subject, Points):
        points = np.asarray(subject.positions, np.float64)
    elif isinstance(subject, Scene):
        points = np.concatenate([np.empty((0, 3)), *map(world_corners, subject)])
    else:
        points = np.asarray(used_vertices(subject), np.float64) if isinstance(subject, Mesh) else subject
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points to frame must have shape (N, 3), got {points.shape}")
    if not len(points):
        raise ValueError("there is nothing to frame: the mesh has no triangles")
    if not np.isfinite(points).all():
        raise ValueError("points to frame must be finite")
    return points


def ends_to_frame(subject: Framed) -> F64:
    """A few of the points of `points_to_frame`: their box and bounding sphere are those of all points."""
    if isinstance(subject, Mesh | Points) and len(subject.triangles if isinstance(subject, Mesh) else subject):
        return subject.extreme_points()
    if isinstance(subject, Scene) and subject.n_triangles and np.isfinite(ends := subject.extreme_points()).all():
        return ends
    points = points_to_frame(subject)
    return extreme_points(lambda: points)


def bounding_sphere(ends: F64) -> tuple[F64, float]:
    """Centre (3,) of the box round points, and the distance of the farthest of them (1 if all are equal)."""
    center = ends.min(axis=0) / 2 + ends.max(axis=0) / 2
    radius = math.sqrt(float(((ends - center) ** 2).sum(axis=1).max()))
    return center, radius if radius > 0 else 1.0


def box_corners(ends: F64) -> F64:
    """The corners (8, 3) float64 of the box round points."""
    low, high = ends.min(axis=0), ends.max(axis=0)
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def distance_to_fit(points: F64, tan_x: float, tan_y: float) -> float:
    """The distance at which a camera has all points (N, 3), in its axes, just inside a frame of two half tangents."""
    x, y, z = points.T
    needed = z + FRAMING_MARGIN * np.maximum(np.abs(x) / tan_x, np.abs(y) / tan_y)
    farthest = np.sqrt((points**2).sum(axis=1).max())
    return float(max(needed.max(), 1e-2 * farthest)) or 1.0


def split_matrix(clip_from_world: F64) -> tuple[F64, F64]:
    """View and projection (4, 4) float64 of their product, up to its scale; the view turns and moves, nothing else.

    Without perspective the eye is put into the near plane, in the middle of the picture: no matrix tells where it is.
    """
    name = "clip_from_world"
    check_regular(name, clip_from_world)
    has_perspective = bool(clip_from_world[3, :3].any())
    linear = clip_from_world[:3, :3]
    if not has_perspective and np.allclose(engine.product(linear, linear.T), np.eye(3), rtol=0, atol=1e-6):
        raise ValueError(
            f"{name} must be a projection times a view, got a pose: Camera.perspective(view, near=, far=) adds one"
        )
    scale = engine.length(clip_from_world[3, :3]) if has_perspective else clip_from_world[3, 3]
    matrix = clip_from_world / scale
    rows = matrix[[0, 1, 3 if has_perspective else 2]]
    ends = np.array([0.0, 0.0, 0.0 if has_perspective else -1.0])
    try:
        eye = engine.product(engine.inverse(rows[:, :3]), ends - rows[:, 3])
    except np.linalg.LinAlgError:
        raise ValueError(f"{name} must have an eye, got {clip_from_world.tolist()}") from None
    back = -rows[2, :3] / engine.length(rows[2, :3])
    up = rows[1, :3] - engine.product(rows[1, :3], back) * back
    up /= engine.length(up)
    view = np.eye(4)
    view[:3, :3] = np.cross(up, back), up, back
    view[:3, 3] = engine.product(-view[:3, :3], eye)
    projection = engine.product(matrix, engine.inverse(view))
    error = 1e-9 * np.abs(projection).max()
    if np.abs(projection[2, :2]).max() > error:
        raise ValueError(f"{name} must have depth along the view alone, got planes that lie aslant")
    projection[2, :2] = 0
    projection[3] = [0, 0, -1, 0] if has_perspective else [0, 0, 0, 1]
    return view, projection


def place_to_fill(points: F64, tan_x: float, tan_y: float, *, ortho: bool = False) -> F64:
    """The place of a camera that fits the box round the picture of points (N, 3) into the middle of its frame.

    In the middle also along the axis that it does not fill, to within 1e-6 of its width. Points are in eye axes: z
    towards the viewer. `tan_x`, `tan_y`: tangents of half the fields of view; without perspective half the sides of the
    frame; only their ratio counts. Returns the eye; without perspective x and y, and half the height of the frame.
    """
    x, y, z = points.T
    if ortho:
        (left, right), (bottom, top) = (x.min(), x.max()), (y.min(), y.max())
        half = max((top - bottom) / 2, (right - left) / 2 * tan_y / tan_x)
        return np.array([(left + right) / 2, (bottom + top) / 2, half])
    sides = (x, tan_x), (y, tan_y)
    ends = [_planes_of(axis, z, tan) for axis, tan in sides]
    distance = max((low + high) / (2 * tan) for (low, high), (_, tan) in zip(ends, sides, strict=True))
    nearest = float(z.max())
    distance = max(distance, nearest + (1e-2 * float(np.ptp(points, axis=0).max()) or 1.0))
    return np.array([*(_middle(axis, z, tan, distance) for axis, tan in sides), distance])


def _planes_of(axis: F64, z: F64, tan: float) -> tuple[float, float]:
    """The offsets of the two planes of this half angle that touch the points: low and high."""
    return float((tan * z - axis).max()), float((tan * z + axis).max())


def _middle(axis: F64, z: F64, tan: float, distance: float) -> float:
    """The place along an axis that centres the picture of the points, from this distance."""
    depth = distance - z
    for _ in range(20):
        low, high = _planes_of(axis, z, tan)
        place = (high - low) / 2
        seen = (axis - place) / depth
        widest = float(np.abs(seen).max())
        if abs(float(seen.max() + seen.min())) <= 1e-6 * widest or widest == 0:
            break
        tan = widest
    return place


def view_matrix(eye: F64, target: F64, up: F64) -> F64:
    """Eye from world (4, 4) float64, for a camera at `eye` that looks at `target`."""
    forward = target - eye
    distance = engine.length(forward)
    if distance == 0:
        raise ValueError(f"eye and target must differ, got {eye.tolist()} for both")
    forward = forward / distance
    right = np.cross(forward, up)
    # Below 1e-12 of the length of `up` the direction is made of rounding errors.
    if engine.length(right) <= 1e-12 * engine.length(up):
        raise ValueError(f"up must not be zero or parallel to the view, got {up.tolist()}")
    right /= engine.length(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = engine.product(-view[:3, :3], eye)
    return view


def orbit_view(
    target: npt.ArrayLike,
    distance: float,
    azimuth_deg: float = THREE_QUARTER_DEG[0],
    elevation_deg: float = THREE_QUARTER_DEG[1],
    *,
    up: UpOption = "y",
) -> F64:
    """Eye from world (4, 4) float64, for a camera on a sphere round the target; the angles of `Camera.framing`."""
    parse(UpOption, "up", up)
    if not math.isfinite(as_number("azimuth_deg", azimuth_deg)):
        raise ValueError(f"azimuth_deg must be finite, got {azimuth_deg}")
    if not -90 <= as_number("elevation_deg", elevation_deg) <= 90:
        raise ValueError(f"elevation_deg must lie in -90 to 90, got {elevation_deg}")
    cosine, sine = engine.cosine_and_sine(azimuth_deg)
    level, height = engine.cosine_and_sine(elevation_deg)
    outward = np.array([level * sine, height, level * cosine])
    axis = np.array([0.0, 1.0, 0.0])
    if abs(elevation_deg) > 89:  # from a pole: the limit of the pictures on the way there
        axis = np.array([-sine, 0, -cosine]) * np.sign(elevation_deg)
    if up == "z":
        outward, axis = outward[[0, 2, 1]] * [1, -1, 1], axis[[0, 2, 1]] * [1, -1, 1]
    at = np.asarray(target, np.float64)
    return view_matrix(at + distance * outward, at, axis)


def tangent(degrees: float) -> float:
    """The tangent of an angle."""
    cosine, sine = engine.cosine_and_sine(degrees)
    return sine / cosine


def sine_of_tangent(value: float) -> float:
    """The sine of the angle that has a tangent."""
    return value / math.sqrt(1 + value * value)


def perspective_matrix(fov_y_deg: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a square picture; see `Camera.perspective`."""
    fov_y_deg, (near, far) = as_fov(fov_y_deg), as_planes(near, far)
    scale = 1 / tangent(fov_y_deg / 2)
    matrix = np.diag([scale, scale, (far + near) / (near - far), 0])
    matrix[2, 3] = 2 * far * near / (near - far)
    matrix[3, 2] = -1
    return matrix


def orthographic_matrix(height: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a square picture; see `Camera.orthographic`."""
    height, (near, far) = as_positive("height", height), as_planes(near, far, least=-math.inf)
    matrix = np.diag([2 / height, 2 / height, 2 / (near - far), 1])
    matrix[2, 3] = (far + near) / (near - far)
    return matrix


def frustum_matrix(left: float, right: float, bottom: float, top: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a window of the plane at `near`; see `Camera.off_center`."""
    left, right, bottom, top = as_window(left, right, bottom, top)
    near, far = as_planes(near, far)
    matrix = perspective_matrix(90, near, far)
    matrix[0, 0], matrix[0, 2] = 2 * near / (right - left), (right + left) / (right - left)
    matrix[1, 1], matrix[1, 2] = 2 * near / (top - bottom), (top + bottom) / (top - bottom)
    return matrix


def box_matrix(left: float, right: float, bottom: float, top: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a box without perspective; see `Camera.off_center`."""
    left, right, bottom, top = as_window(left, right, bottom, top)
    matrix = orthographic_matrix(1, near, far)
    matrix[0, 0], matrix[0, 3] = 2 / (right - left), -(right + left) / (right - left)
    matrix[1, 1], matrix[1, 3] = 2 / (top - bottom), -(top + bottom) / (top - bottom)
    return matrix


def frame_of_sphere(radius: float, fov_y_deg: float, aspect: float) -> tuple[float, float]:
    """The distance from which a sphere is just inside a frame, and the height of the frame without perspective."""
    narrow = min(1.0, aspect)
    # The sphere touches the pyramid of view at sin, not tan, of the half angle.
    distance = radius * FRAMING_MARGIN / sine_of_tangent(tangent(fov_y_deg / 2) * narrow)
    return distance, 2 * radius * FRAMING_MARGIN / narrow


def framing_matrices(
    ends: F64,
    points: F64 | None,
    angles: tuple[float, float, float],
    *,
    up: UpOption = "y",
    ortho: bool = False,
    aspect: float = 1.0,
    fills: bool = False,
) -> tuple[F64, F64]:
    """View and projection (4, 4) that have the sphere round these ends, or the points, just inside a frame.

    `angles`: azimuth, elevation and field of view, degrees. `fills`: the points fill the frame; see `Camera.framing`.
    """
    azimuth_deg, elevation_deg, fov_y_deg = angles
    center, radius = bounding_sphere(ends)
    fov_y_deg, aspect = as_fov(fov_y_deg), as_positive("aspect", aspect)
    tan_y = tangent(fov_y_deg / 2)
    distance, height = frame_of_sphere(radius, fov_y_deg, aspect)
    right, above = 0.0, 0.0
    if points is not None:
        turn = orbit_view((0, 0, 0), 1.0, azimuth_deg, elevation_deg, up=up)[:3, :3]
        points = engine.product(points - center, turn.T)
        if fills:
            share = 1 - 2 * SILHOUETTE_MARGIN
            right, above, distance = place_to_fill(points, share * tan_y * aspect, share * tan_y)
            if ortho:
                right, above, half = place_to_fill(points, aspect, 1.0, ortho=True)
                distance, height = radius / sine_of_tangent(tan_y), 2 * half / share
        else:
            distance = distance_to_fit(points, tan_y * aspect, tan_y)
            height = 2 * FRAMING_MARGIN * max(np.abs(points[:, 1]).max(), np.abs(points[:, 0]).max() / aspect)
        height = height or 2 * FRAMING_MARGIN
    view = orbit_view(center, distance, azimuth_deg, elevation_deg, up=up)
    view[:2, 3] -= right, above
    near, far = max(distance - 1.01 * radius, 1e-3 * radius), distance + 1.01 * radius
    if ortho:
        return view, orthographic_matrix(height, near, far)
    return view, perspective_matrix(fov_y_deg, near, far)


def as_positive(name: str, value: float) -> float:
    """The number as a float; a `ValueError` unless it is finite and above 0."""
    if not 0 < (number := as_number(name, value)) < math.inf:
        raise ValueError(f"{name} must be positive, got {value}")
    return number


def as_fov(fov_y_deg: float) -> float:
    """The field of view as a float; a `ValueError` unless it lies between 0 and 180 degrees."""
    if not 0 < (degrees := as_number("fov_y_deg", fov_y_deg)) < 180:
        raise ValueError(f"fov_y_deg must lie between 0 and 180, got {fov_y_deg}")
    return degrees


def as_planes(near: float, far: float, *, least: float = 0.0) -> tuple[float, float]:
    """Both distances as floats, which do not wrap round; a `ValueError` unless least < near < far, finite."""
    planes = as_number("near", near), as_number("far", far)
    if not least < planes[0] < planes[1] < math.inf:
        wish = "0 < near < far" if least == 0 else "near < far"
        raise ValueError(f"near and far must be finite and {wish}, got {near} and {far}")
    return planes


def as_window(left: float, right: float, bottom: float, top: float) -> tuple[float, float, float, float]:
    """The four sides as floats; a `ValueError` unless they are finite and in order."""
    sides = as_number("left", left), as_number("right", right), as_number("bottom", bottom), as_number("top", top)
    if not (-math.inf < sides[0] < sides[1] < math.inf and -math.inf < sides[2] < sides[3] < math.inf):
        raise ValueError(f"left < right and bottom < top must be finite, got {left} and {right}, {bottom} and {top}")
    return sides
