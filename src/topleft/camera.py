"""Cameras: from world to clip space, as two 4x4 matrices made from words (eye, target, field of view, intrinsics).

Spaces: world; eye (OpenGL: x right, y up, the view along -z); clip (OpenGL: -w <= x, y, z <= w inside).
Matrices act on columns: `clip = projection @ view @ [x, y, z, 1]`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]

DEFAULT_FOV_Y_DEG = 40.0
THREE_QUARTER_DEG = (35.0, 20.0)
"""Azimuth and elevation of the three-quarter view: front, right side and top all show."""

FRAMING_MARGIN = 1.05
"""The bounding sphere fills 1 / 1.05 of the frame, so that no outline touches its border."""


@runtime_checkable
class HasTriangles(Protocol):
    """What `Camera.framing` looks at: a `Mesh`, or anything like it."""

    @property
    def vertices(self) -> npt.NDArray[Any]:
        """Positions (V, 3)."""

    @property
    def triangles(self) -> npt.NDArray[Any]:
        """Rows of vertex indices (T, 3)."""


@dataclass(frozen=True, eq=False)
class Camera:
    """Where the camera stands and how it projects.

    Parameters
    ----------
    view : (4, 4) array_like
        Eye from world. Eye axes are those of OpenGL: x right, y up, the view along -z.
    projection : (4, 4) array_like
        Clip from eye, OpenGL clip space.
    aspect : float, optional
        Width / height of the picture that `projection` was made for. `clip_from_world` then widens or narrows the
        field of view to that of the picture and leaves its height alone. `None`: `projection` is taken as it is, and
        a picture of another shape is stretched.

    Raises
    ------
    ValueError
        If a matrix has another shape or a number that is not finite, or if `aspect` is not positive.

    Examples
    --------
    >>> camera = Camera.look_at(eye=(0, 0, 5), target=(0, 0, 0), fov_y_deg=90)
    >>> clip = camera.clip_from_world((200, 100)) @ [10, 0, 0, 1]
    >>> round(float(clip[0] / clip[3]), 6)
    1.0
    """

    view: F64
    projection: F64
    aspect: float | None = None

    def __post_init__(self) -> None:
        for name in ("view", "projection"):
            matrix = _matrix(getattr(self, name), 4, name)
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)
        if self.aspect is not None:
            _check_positive("aspect", self.aspect)

    def clip_from_world(self, size: tuple[int, int]) -> F64:
        """The matrix (4, 4) float64 that `rasterize` takes as `transform=`, for a picture of this size.

        Parameters
        ----------
        size : (width, height), pixels
            An empty picture gets the matrix of a square one.
        """
        width, height = size
        projection = self.projection.copy()
        if self.aspect is not None and width > 0 and height > 0:
            projection[0] = projection[0] * (self.aspect * height) / width
        return projection @ self.view

    @classmethod
    def perspective(
        cls, view: npt.ArrayLike, *, near: float, far: float, fov_y_deg: float = DEFAULT_FOV_Y_DEG
    ) -> Camera:
        """A pinhole camera with a field of view of `fov_y_deg` from the bottom to the top of the picture.

        Parameters
        ----------
        view : (4, 4) array_like
            Eye from world; `view_matrix` makes one.
        near, far : float
            Distances of the planes in front of the eye, world units, 0 < near < far.
        fov_y_deg : float
            Degrees, between 0 and 180.

        Raises
        ------
        ValueError
            If the field of view or the planes are outside their range.
        """
        return cls(_matrix(view, 4, "view"), perspective_matrix(fov_y_deg, near, far), aspect=1.0)

    @classmethod
    def orthographic(cls, view: npt.ArrayLike, *, near: float, far: float, height: float) -> Camera:
        """A camera without perspective that sees `height` world units from the bottom to the top of the picture.

        Parameters
        ----------
        view : (4, 4) array_like
            Eye from world; `view_matrix` makes one.
        near, far : float
            Distances of the planes in front of the eye, world units, near < far; negative ones lie behind it.
        height : float
            World units, positive.

        Raises
        ------
        ValueError
            If the height or the planes are outside their range.
        """
        return cls(_matrix(view, 4, "view"), orthographic_matrix(height, near, far), aspect=1.0)

    @classmethod
    def look_at(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike = (0.0, 0.0, 0.0),
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        *,
        fov_y_deg: float = DEFAULT_FOV_Y_DEG,
        ortho_height: float | None = None,
        near: float | None = None,
        far: float | None = None,
    ) -> Camera:
        """A camera at `eye` that has `target` in the middle of its picture.

        Parameters
        ----------
        eye, target : (3,) array_like
            World positions.
        up : (3,) array_like
            The world direction that points up in the picture; not parallel to the view.
        fov_y_deg : float
            Field of view from bottom to top, degrees; not looked at when `ortho_height` is given.
        ortho_height : float, optional
            Makes the camera orthographic, with that many world units from bottom to top.
        near, far : float, optional
            Distances of the planes; a hundredth and a hundred times the distance of the target unless given.

        Raises
        ------
        ValueError
            If eye and target coincide, `up` is parallel to the view, or another number is outside its range.
        """
        view = view_matrix(eye, target, up)
        distance = float(np.linalg.norm(_vector(target, "target") - _vector(eye, "eye")))
        near = 0.01 * distance if near is None else near
        far = 100 * distance if far is None else far
        if ortho_height is not None:
            return cls.orthographic(view, near=near, far=far, height=ortho_height)
        return cls.perspective(view, near=near, far=far, fov_y_deg=fov_y_deg)

    @classmethod
    def from_intrinsics(
        cls,
        intrinsics: npt.ArrayLike,
        camera_from_world: npt.ArrayLike,
        size: tuple[int, int],
        *,
        near: float,
        far: float,
    ) -> Camera:
        """The camera of a calibrated photograph, in the convention of OpenCV.

        Parameters
        ----------
        intrinsics : (3, 3) array_like
            `[[fx, skew, cx], [0, fy, cy], [0, 0, 1]]`, pixels.
        camera_from_world : (4, 4) array_like
            The pose. Camera axes are those of OpenCV: x right, y down, z forward.
        size : (width, height), pixels
            The picture that the intrinsics belong to. A picture rendered at another size is that one, scaled.
        near, far : float
            Distances of the planes along z, world units, 0 < near < far.

        Raises
        ------
        ValueError
            If a matrix has another shape, is singular or has another last row, or a number is outside its range.

        Notes
        -----
        OpenCV puts the centre of the top-left pixel at (0, 0), `topleft` at (0.5, 0.5). So the point that the matrix
        projects to (u, v) is drawn at x_px = u + 0.5, y_px = v + 0.5: in the same pixel.
        """
        matrix = _matrix(intrinsics, 3, "intrinsics")
        pose = _matrix(camera_from_world, 4, "camera_from_world")
        width, height = size
        _check_positive("width", width)
        _check_positive("height", height)
        _check_planes(near, far)
        if not np.array_equal(matrix[2], [0, 0, 1]):
            raise ValueError(f"the last row of intrinsics must be [0, 0, 1], got {matrix[2].tolist()}")
        if not np.array_equal(pose[3], [0, 0, 0, 1]):
            raise ValueError(f"the last row of camera_from_world must be [0, 0, 0, 1], got {pose[3].tolist()}")
        _check_regular(matrix, "intrinsics")
        _check_regular(pose, "camera_from_world")
        px_of_center = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
        ndc_of_px = np.array([[2 / width, 0, -1], [0, -2 / height, 1], [0, 0, 1]])
        eye_of_camera = np.diag([1.0, -1.0, -1.0, 1.0])
        projection = perspective_matrix(90, near, far)
        projection[:2, :3] = (ndc_of_px @ px_of_center @ matrix)[:2] @ eye_of_camera[:3, :3]
        return cls(eye_of_camera @ pose, projection)

    @classmethod
    def framing(
        cls,
        subject: HasTriangles | npt.ArrayLike,
        *,
        azimuth_deg: float = THREE_QUARTER_DEG[0],
        elevation_deg: float = THREE_QUARTER_DEG[1],
        fov_y_deg: float = DEFAULT_FOV_Y_DEG,
        up: Literal["y", "z"] = "y",
        ortho: bool = False,
        aspect: float = 1.0,
    ) -> Camera:
        """A camera that has the bounding sphere of the subject just inside its frame; three-quarter view by default.

        Parameters
        ----------
        subject : Mesh, or (N, 3) array_like
            A mesh, of which the vertices in use count, or points: the two corners of a box, say.
        azimuth_deg : float
            0 looks at the front of the subject (+z with y up, -y with z up), 90 at its right (+x). Degrees.
        elevation_deg : float
            0 is level, 90 looks straight down. Degrees, -90 to 90.
        fov_y_deg : float
            Field of view from bottom to top, degrees. Sets the distance from which `ortho` is seen, too.
        up : {"y", "z"}
            The axis of the world that points up.
        ortho : bool
            Without perspective.
        aspect : float
            Width / height of the picture to be made.

        Raises
        ------
        ValueError
            If there is nothing to frame or a number is outside its range.
        """
        center, radius = bounding_sphere(subject)
        _check_fov(fov_y_deg)
        _check_positive("aspect", aspect)
        narrow_tan = np.tan(np.radians(fov_y_deg) / 2) * min(1.0, aspect)
        # The sphere touches the pyramid of view at sin, not tan, of the half angle.
        distance = radius * FRAMING_MARGIN / np.sin(np.arctan(narrow_tan))
        view = orbit_view(center, distance, azimuth_deg, elevation_deg, up=up)
        near, far = max(distance - 1.01 * radius, 1e-3 * radius), distance + 1.01 * radius
        if ortho:
            height = 2 * radius * FRAMING_MARGIN / min(1.0, aspect)
            return cls.orthographic(view, near=near, far=far, height=height)
        return cls.perspective(view, near=near, far=far, fov_y_deg=fov_y_deg)


def bounding_sphere(subject: HasTriangles | npt.ArrayLike) -> tuple[F64, float]:
    """Centre (3,) of the box round the subject, and the distance of its farthest point (1 if they are all one).

    Raises
    ------
    ValueError
        If there is no point, or one is not finite.
    """
    if isinstance(subject, HasTriangles):
        points = np.asarray(subject.vertices, dtype=np.float64)[subject.triangles.ravel()]
    else:
        points = np.asarray(subject, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points to frame must have shape (N, 3), got {points.shape}")
    if not len(points):
        raise ValueError("there is nothing to frame: the mesh has no triangles")
    if not np.isfinite(points).all():
        raise ValueError("points to frame must be finite")
    center = points.min(axis=0) / 2 + points.max(axis=0) / 2
    radius = float(np.sqrt(((points - center) ** 2).sum(axis=1).max()))
    return center, radius if radius > 0 else 1.0


def view_matrix(eye: npt.ArrayLike, target: npt.ArrayLike, up: npt.ArrayLike = (0.0, 1.0, 0.0)) -> F64:
    """Eye from world (4, 4) float64, for a camera at `eye` that looks at `target`.

    Raises
    ------
    ValueError
        If eye and target coincide, or if `up` is zero or parallel to the view.
    """
    eye, target, up = _vector(eye, "eye"), _vector(target, "target"), _vector(up, "up")
    forward = target - eye
    distance = np.linalg.norm(forward)
    if distance == 0:
        raise ValueError(f"eye and target must differ, got {eye.tolist()} for both")
    forward = forward / distance
    right = np.cross(forward, up)
    # Below 1e-12 of the length of `up` the direction is made of rounding errors.
    if np.linalg.norm(right) <= 1e-12 * np.linalg.norm(up):
        raise ValueError(f"up must not be zero or parallel to the view, got {up.tolist()}")
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def orbit_view(
    target: npt.ArrayLike,
    distance: float,
    azimuth_deg: float = THREE_QUARTER_DEG[0],
    elevation_deg: float = THREE_QUARTER_DEG[1],
    *,
    up: Literal["y", "z"] = "y",
) -> F64:
    """Eye from world (4, 4) float64, for a camera on a sphere round the target; the angles of `Camera.framing`.

    Raises
    ------
    ValueError
        If the elevation is outside -90 to 90 degrees or `up` is neither "y" nor "z".
    """
    if up not in ("y", "z"):
        raise ValueError(f'up must be "y" or "z", got {up!r}')
    if not np.isfinite(azimuth_deg):
        raise ValueError(f"azimuth_deg must be finite, got {azimuth_deg}")
    if not -90 <= elevation_deg <= 90:
        raise ValueError(f"elevation_deg must lie in -90 to 90, got {elevation_deg}")
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    outward = np.array(
        [np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)]
    )
    axis = np.array([0.0, 1.0, 0.0])
    if abs(elevation_deg) > 89:  # from a pole: the limit of the pictures on the way there
        axis = np.array([-np.sin(azimuth), 0, -np.cos(azimuth)]) * np.sign(elevation)
    if up == "z":
        outward, axis = outward[[0, 2, 1]] * [1, -1, 1], axis[[0, 2, 1]] * [1, -1, 1]
    target = _vector(target, "target")
    return view_matrix(target + distance * outward, target, axis)


def perspective_matrix(fov_y_deg: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a square picture; see `Camera.perspective`."""
    _check_fov(fov_y_deg)
    _check_planes(near, far)
    scale = 1 / np.tan(np.radians(fov_y_deg) / 2)
    matrix = np.diag([scale, scale, (far + near) / (near - far), 0])
    matrix[2, 3] = 2 * far * near / (near - far)
    matrix[3, 2] = -1
    return matrix


def orthographic_matrix(height: float, near: float, far: float) -> F64:
    """Clip from eye (4, 4) float64 for a square picture; see `Camera.orthographic`."""
    _check_positive("height", height)
    if not (np.isfinite([near, far]).all() and near < far):
        raise ValueError(f"near and far must be finite and near < far, got {near} and {far}")
    matrix = np.diag([2 / height, 2 / height, 2 / (near - far), 1])
    matrix[2, 3] = (far + near) / (near - far)
    return matrix


def _vector(values: npt.ArrayLike, name: str) -> F64:
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ValueError(f"{name} must be three finite numbers, got {values!r}")
    return vector


def _matrix(values: npt.ArrayLike, n: int, name: str) -> F64:
    matrix = np.array(values, dtype=np.float64)
    if matrix.shape != (n, n):
        raise ValueError(f"{name} must have shape ({n}, {n}), got {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} must hold finite numbers, got {matrix.tolist()}")
    return matrix


def _check_regular(matrix: F64, name: str) -> None:
    if np.linalg.matrix_rank(matrix) < len(matrix):
        raise ValueError(f"{name} must not be singular, got {matrix.tolist()}")


def _check_positive(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{name} must be positive, got {value}")


def _check_fov(fov_y_deg: float) -> None:
    if not 0 < fov_y_deg < 180:
        raise ValueError(f"fov_y_deg must lie between 0 and 180, got {fov_y_deg}")


def _check_planes(near: float, far: float) -> None:
    if not (np.isfinite(near) and np.isfinite(far) and 0 < near < far):
        raise ValueError(f"near and far must be finite and 0 < near < far, got {near} and {far}")
