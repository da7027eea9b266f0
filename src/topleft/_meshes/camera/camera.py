"""Cameras: from world to clip space, as two 4x4 matrices made from words (eye, target, field of view, intrinsics).

Spaces: world; eye (OpenGL: x right, y up, the view along -z); clip (OpenGL: -w <= x, y, z <= w inside).
Matrices act on columns: `clip = projection @ view @ [x, y, z, 1]`. A lens bends eye space between the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, TypedDict

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, MeshLike
from topleft._core.base.arrays import (
    as_array,
    as_number,
    as_real,
    as_size,
    as_square,
    as_vector,
    check_regular,
    set_read_only,
    shown,
)
from topleft._core.base.cached import cached_property
from topleft._core.base.defaults import DEFAULT_FOV_Y_DEG, THREE_QUARTER_DEG
from topleft._core.base.options import parse
from topleft._meshes.camera.calibration import Calibration, of_colmap, of_nerfstudio, of_opengl, of_pytorch3d
from topleft._meshes.camera.lens import FLIP, Lens, lens_of_opencv
from topleft._meshes.camera.matrices import (
    as_framed,
    as_planes,
    as_positive,
    box_corners,
    box_matrix,
    ends_to_frame,
    framing_matrices,
    frustum_matrix,
    orthographic_matrix,
    perspective_matrix,
    points_to_frame,
    split_matrix,
    up_of,
    view_matrix,
)
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import moved
from topleft._meshes.model.points import Points
from topleft._meshes.model.pose import as_pose
from topleft._meshes.scene.scene import Scene
from topleft.typing import ClipDepthOption, FitOption, UpOption


class ClipOptions(TypedDict, total=False):
    """The options of `rasterize` that tell how clip space is cut."""

    clip_depth: ClipDepthOption
    near_clip: bool
    far_clip: bool


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
    lens : OpenCVLens or FisheyeLens, optional
        Bends the rays before `projection`, which must have perspective, sees them; without one they are straight.
    has_planes : bool
        Whether the near and far planes of `projection` cut what is drawn; `MeshWarning` tells if they cut what a
        picture shows in front of the eye. False for a camera that is made without
        `near=` and `far=`: pictures show all that lies in front of the eye, and depth is measured without planes, as
        -1 / distance along the view, or without perspective as that distance. Only `clip_from_world` and
        `clip_from_eye` have planes then.

    Raises
    ------
    ValueError
        If a matrix has another shape or a number that is not finite, if `aspect` is not positive, or if there is a lens
        and no perspective.

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
    lens: Lens | None = None
    has_planes: bool = True

    if TYPE_CHECKING:  # anything that NumPy reads may be given; float64 is kept

        def __init__(
            self, view: npt.ArrayLike, projection: npt.ArrayLike, aspect: float | None = None,
            lens: Lens | None = None, has_planes: bool = True,
        ) -> None: ...  # fmt: skip

    __setstate__ = set_read_only

    def __post_init__(self) -> None:
        for name in ("view", "projection"):
            matrix = as_square(name, getattr(self, name), 4)
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)
        if self.aspect is not None:
            object.__setattr__(self, "aspect", as_positive("aspect", self.aspect))
        if not (self.lens is None or hasattr(self.lens, "bend")):
            raise TypeError(f"lens must be an OpenCVLens, a FisheyeLens or None, got {shown(self.lens)}")
        if self.lens is not None and not np.array_equal(self.projection[3], [0, 0, -1, 0]):
            raise ValueError(
                f"a lens needs a projection with the last row [0, 0, -1, 0], got {self.projection[3].tolist()}"
            )

    def __repr__(self) -> str:
        """One line: where it stands, where it looks, how wide."""
        try:
            eye = engine.product(engine.inverse(self.view[:3, :3]), -self.view[:3, 3])
        except np.linalg.LinAlgError:
            return "Camera(singular view)"
        forward = -self.view[2, :3] / (engine.length(self.view[2, :3]) or 1.0)
        words = [
            f"eye=({', '.join(f'{x:.4g}' for x in eye)})",
            f"forward=({', '.join(f'{x + 0.0:.3g}' for x in forward)})",
        ]
        up = float(self.projection[1, 1])
        if up and self.projection[3, :3].any():
            words.append(f"fov_y_deg={np.degrees(2 * np.arctan(1 / abs(up))):.4g}")
        elif up:
            words.append(f"ortho_height={2 / abs(up):.4g}")
        if self.lens is not None:
            words.append(f"lens={type(self.lens).__name__}")
        return f"Camera({', '.join(words)})"

    def clip_from_world(self, size: int | tuple[int, int]) -> F64:
        """The matrix (4, 4) float64 that `rasterize` takes as `transform=`, for a picture of this size.

        Parameters
        ----------
        size : (width, height), pixels
            An empty picture gets the matrix of a square one.

        Raises
        ------
        ValueError
            If the camera has a lens, which no matrix describes: `rasterize_mesh` and `render` draw through it, and
            `straightened` leaves it out.
        """
        if self.lens is not None:
            raise ValueError("no matrix describes a camera with a lens; rasterize_mesh draws through it")
        return engine.product(self.clip_from_eye(size), self.view)

    def clip_from_eye(self, size: int | tuple[int, int]) -> F64:
        """The projection (4, 4) float64 for a picture of this size; with a lens it acts on bent points."""
        width, height = as_size(size)
        projection = self.projection.copy()
        if self.aspect is not None and width > 0 and height > 0:
            projection[0] *= self.aspect * height
            projection[0] /= width
        return projection

    def drawn_from_world(self, size: int | tuple[int, int]) -> F64:
        """The matrix (4, 4) float64 of pictures: `clip_from_world`, with depth as `has_planes` says."""
        return engine.product(self.drawn_from_eye(size), self.view)

    def drawn_from_eye(self, size: int | tuple[int, int]) -> F64:
        """The projection (4, 4) float64 of pictures: `clip_from_eye`, with depth as `has_planes` says."""
        projection = self.clip_from_eye(size)
        if not self.has_planes:
            projection[2] = (0, 0, 0, -1) if projection[3, 2] else (0, 0, -1, 0)
        return projection

    @cached_property
    def projection_mirrors(self) -> bool:
        """Whether `projection` shows eye space in a mirror: a focal length is negative, say."""
        forward = self.projection[3, :3] if self.projection[3, :3].any() else np.array([0.0, 0.0, -1.0])
        return bool(engine.determinant(np.stack([*self.projection[:2, :3], forward])) > 0)

    @cached_property
    def is_mirrored(self) -> bool:
        """Whether pictures show the world in a mirror, by the view or the projection: `cull` takes the other side."""
        return bool(engine.determinant(self.view[:3, :3]) < 0) != self.projection_mirrors

    @cached_property
    def depth_options(self) -> ClipOptions:
        """The options of `rasterize` that belong to `drawn_from_world`."""
        if self.has_planes:
            return {}
        return {"clip_depth": "zero_to_one", "near_clip": not self.projection[3, 2], "far_clip": False}

    def distance_of(self, depth: npt.ArrayLike) -> F64:
        """Distances along the view, float64, of depths in a picture of this camera.

        Parameters
        ----------
        depth : array_like of any shape
            As `Fragments.depth` has it; depths of pixels that show nothing have no meaning here.

        Returns
        -------
        ndarray of that shape, world units
        """
        (a, b), (c, d) = self.drawn_from_eye((1, 1))[2:, 2:]
        ndc = as_real("depth", depth)
        ndc = 2.0 * ndc - 1 if self.has_planes else ndc
        return (ndc * d - b) / (ndc * c - a)

    @cached_property
    def planes(self) -> tuple[float, float]:
        """The distances along the view of the planes of `projection`, ascending."""
        (a, b), (c, d) = self.projection[2:, 2:].tolist()
        first, last = (
            float("inf") if not divisor or (c and above / divisor < 0) else above / divisor
            for above, divisor in ((-d - b, -c - a), (d - b, c - a))
        )
        return min(first, last), max(first, last)

    def straightened(self) -> Camera:
        """The camera without its lens."""
        return self if self.lens is None else replace(self, lens=None)

    def placed(self, transform: F64) -> Camera:
        """The camera in the object space of an instance at `transform` (4, 4), world from object."""
        return replace(self, view=engine.product(self.view, transform))

    def project(self, points: npt.ArrayLike, size: int | tuple[int, int]) -> F64:
        """Where world points lie in a picture.

        Parameters
        ----------
        points : (N, 3) array_like
            World positions.
        size : (width, height), pixels

        Returns
        -------
        (N, 3) float64
            x and y in pixels (the centre of the top-left pixel is (0.5, 0.5)) and depth as `rasterize_mesh` has it.
            Whatever a point behind the eye gives is not in the picture.

        Raises
        ------
        ValueError
            If the points have another shape.

        Examples
        --------
        >>> Camera.look_at((0, 0, 5)).project([(0, 0, 0)], (200, 100))[0, :2].tolist()
        [100.0, 50.0]
        """
        world, size = as_real("points", points), as_size(size)
        if world.ndim != 2 or world.shape[1] != 3:
            raise ValueError(f"points must have shape (N, 3), got {world.shape}")
        eye = moved(world, self.view)
        return pixels_of(eye if self.lens is None else self.lens.bend(eye), self, size)

    @classmethod
    def from_matrix(cls, clip_from_world: npt.ArrayLike) -> Camera:
        """The camera of one matrix, a projection times a view: the mvp of OpenGL and nvdiffrast.

        Parameters
        ----------
        clip_from_world : (4, 4) array_like
            Acts on columns, into OpenGL's clip space; its scale does not matter. Whatever takes a camera takes such a
            matrix, too.

        Returns
        -------
        Camera
            Its `clip_from_world` is the matrix, up to its scale and the rounding of float64, for pictures of every
            size: a picture of another shape is stretched. Without perspective the eye is put into the near plane.

        Raises
        ------
        ValueError
            If the matrix is singular, is a pose without a projection, or its near and far planes lie aslant.

        Examples
        --------
        >>> camera = Camera.look_at((0, 0, 5), fov_y_deg=40)
        >>> Camera.from_matrix(camera.clip_from_world((64, 64)))
        Camera(eye=(0, 0, 5), forward=(0, 0, -1), fov_y_deg=40)
        """
        return cls(*split_matrix(as_square("clip_from_world", clip_from_world, 4)))

    @classmethod
    def perspective(
        cls, view: npt.ArrayLike, *, near: float, far: float, fov_y_deg: float = DEFAULT_FOV_Y_DEG
    ) -> Camera:
        """A pinhole camera with a field of view of `fov_y_deg` from the bottom to the top of the picture.

        Parameters
        ----------
        view : (4, 4) array_like
            Eye from world; the `view` of another camera, say.
        near, far : float
            Distances of the planes in front of the eye, world units, 0 < near < far.
        fov_y_deg : float
            Degrees, between 0 and 180.

        Raises
        ------
        ValueError
            If the field of view or the planes are outside their range.
        """
        return cls(view, perspective_matrix(fov_y_deg, near, far), aspect=1.0)

    @classmethod
    def orthographic(cls, view: npt.ArrayLike, *, near: float, far: float, height: float) -> Camera:
        """A camera without perspective that sees `height` world units from the bottom to the top of the picture.

        Parameters
        ----------
        view : (4, 4) array_like
            Eye from world; the `view` of another camera, say.
        near, far : float
            Distances of the planes in front of the eye, world units, near < far; negative ones lie behind it.
        height : float
            World units, positive.

        Raises
        ------
        ValueError
            If the height or the planes are outside their range.
        """
        return cls(view, orthographic_matrix(height, near, far), aspect=1.0)

    @classmethod
    def off_center(
        cls,
        view: npt.ArrayLike,
        *,
        left: float,
        right: float,
        bottom: float,
        top: float,
        near: float,
        far: float,
        ortho: bool = False,
    ) -> Camera:
        """A camera whose axis need not pass through the middle of its picture: part of a wall of screens, say.

        Parameters
        ----------
        view : (4, 4) array_like
            Eye from world; the `view` of another camera, say.
        left, right, bottom, top : float
            Sides of the picture in the plane at `near`, world units from the axis, as for glFrustum and glOrtho. A
            picture of another shape is stretched.
        near, far : float
            Distances of the planes in front of the eye, world units, near < far; with perspective 0 < near.
        ortho : bool
            Without perspective.

        Raises
        ------
        ValueError
            If the sides or the planes are out of order.
        """
        matrix = (box_matrix if ortho else frustum_matrix)(left, right, bottom, top, near, far)
        return cls(view, matrix)

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
            Distances of the planes. With neither nothing is cut in front of the eye: see `has_planes`. Of one that is
            given alone the other is a hundredth, or a hundred times, the distance of the target.

        Raises
        ------
        ValueError
            If eye and target coincide, `up` is parallel to the view, or another number is outside its range.
        """
        eye, target, up = as_vector("eye", eye), as_vector("target", target), as_vector("up", up)
        view = view_matrix(eye, target, up)
        distance, has_planes = engine.length(target - eye), not (near is None and far is None)
        near = 0.01 * distance if near is None else near
        far = 100 * distance if far is None else far
        if ortho_height is not None:
            projection = orthographic_matrix(as_positive("ortho_height", ortho_height), near, far)
        else:
            projection = perspective_matrix(fov_y_deg, near, far)
        return cls(view, projection, aspect=1.0, has_planes=has_planes)

    @classmethod
    def from_intrinsics(
        cls,
        intrinsics: npt.ArrayLike,
        camera_from_world: npt.ArrayLike | Mapping[str, npt.ArrayLike],
        size: int | tuple[int, int],
        *,
        near: float | None = None,
        far: float | None = None,
        distortion: npt.ArrayLike | None = None,
        fisheye: npt.ArrayLike | None = None,
        pixel_center: float = 0.0,
    ) -> Camera:
        """The camera of a calibrated photograph, in the convention of OpenCV.

        Parameters
        ----------
        intrinsics : (3, 3) array_like
            `[[fx, skew, cx], [0, fy, cy], [0, 0, 1]]`, pixels.
        camera_from_world : (4, 4) or (3, 4) array_like, pair (R, t) or (rvec, tvec), or mapping
            The pose. Camera axes are those of OpenCV: x right, y down, z forward. A mapping has `cam_R_w2c` and
            `cam_t_w2c`, or `cam_R_m2c` and `cam_t_m2c`, as BOP has them.
        size : (width, height), pixels
            The picture that the intrinsics belong to. A picture rendered at another size is that one, scaled.
        near, far : float, optional
            Distances of the planes along z, world units, 0 < near < far. With `fisheye` they are spheres. With neither
            nothing is cut in front of the eye: see `has_planes`. Of one that is given alone the other is a thousandth
            of the distance d of the world's origin, or a thousand times the largest of d, 1 and `near`; d counts as 1
            for a camera at the origin.
        distortion : (4,), (5,), (8,), (12,) or (14,) array_like, optional
            `k1, k2, p1, p2[, k3[, k4, k5, k6[, s1, s2, s3, s4[, tau_x, tau_y]]]]`, as `cv2.calibrateCamera` returns
            them.
        fisheye : (4,) array_like, optional
            `k1, k2, k3, k4` as `cv2.fisheye.calibrate` returns them. Not together with `distortion`.
        pixel_center : float
            Where the source of the intrinsics puts the centre of the top-left pixel, in x and y: 0 as OpenCV and BOP
            do, 0.5 as COLMAP and nerfstudio, 1 as MATLAB.

        Raises
        ------
        ValueError
            If a matrix has another shape, is singular or has another last row, or a number is outside its range.

        Notes
        -----
        OpenCV puts the centre of the top-left pixel at (0, 0), `topleft` at (0.5, 0.5). So the point that the matrix
        projects to (u, v) is drawn at x_px = u + 0.5, y_px = v + 0.5: in the same pixel. With another `pixel_center`
        c it is drawn at u + 0.5 - c, v + 0.5 - c.
        """
        matrix = as_square("intrinsics", intrinsics, 3)
        pose = as_pose("camera_from_world", camera_from_world)
        width, height = as_size(size, smallest=1)
        has_planes = not (near is None and far is None)
        near, far = planes_for(engine.length(pose[:3, 3]), near, far)
        if not np.array_equal(matrix[2], [0, 0, 1]):
            raise ValueError(f"the last row of intrinsics must be [0, 0, 1], got {matrix[2].tolist()}")
        check_regular("intrinsics", matrix)
        shift = 0.5 - as_number("pixel_center", pixel_center)
        if not np.isfinite(shift):
            raise ValueError(f"pixel_center must be finite, got {pixel_center}")
        px_of_center = np.array([[1, 0, shift], [0, 1, shift], [0, 0, 1]])
        ndc_of_px = np.array([[2 / width, 0, -1], [0, -2 / height, 1], [0, 0, 1]])
        eye_of_camera = np.diag([1.0, -1.0, -1.0, 1.0])
        projection = perspective_matrix(90, near, far)
        ndc_of_matrix = engine.product(engine.product(ndc_of_px, px_of_center), matrix)
        projection[:2, :3] = engine.product(ndc_of_matrix[:2], eye_of_camera[:3, :3])
        view, lens = engine.product(eye_of_camera, pose), lens_of_opencv(distortion, fisheye)
        return cls(view, projection, lens=lens, has_planes=has_planes)

    @classmethod
    def from_opengl(
        cls,
        c2w: npt.ArrayLike,
        intrinsics: npt.ArrayLike | None = None,
        size: int | tuple[int, int] | None = None,
        *,
        fov_y_deg: float | None = None,
        pixel_center: float = 0.5,
        near: float | None = None,
        far: float | None = None,
        distortion: npt.ArrayLike | None = None,
        fisheye: npt.ArrayLike | None = None,
    ) -> Camera:
        """The camera that stands in the world with the axes of OpenGL and Blender: x right, y up, the view along -z.

        Parameters
        ----------
        c2w : (4, 4) or (3, 4) array_like, or pair (R, t)
            World from camera: its columns are the axes of the camera and where it stands.
        intrinsics : (3, 3) array_like, optional
            `[[fx, skew, cx], [0, fy, cy], [0, 0, 1]]`, pixels from the top-left corner, y down, of a picture of `size`.
        size : (width, height), pixels
            The picture that the intrinsics belong to.
        fov_y_deg : float, optional
            Without intrinsics: field of view from bottom to top, degrees; 40 unless given.
        pixel_center : float
            Where the centre of the top-left pixel is in the intrinsics: 0.5, unless they come of OpenCV, then 0.
        near, far, distortion, fisheye
            As for `from_intrinsics`.

        Raises
        ------
        ValueError
            If there are intrinsics and no size, or both intrinsics and a field of view, or as `from_intrinsics` does.

        Examples
        --------
        >>> import numpy as np
        >>> c2w = np.eye(4)
        >>> c2w[:3, 3] = 0, 0, 5
        >>> Camera.from_opengl(c2w)
        Camera(eye=(0, 0, 5), forward=(0, 0, -1), fov_y_deg=40)
        """
        pose = of_opengl(c2w)
        if intrinsics is None:
            if not (size is None and distortion is None and fisheye is None):
                raise ValueError("size, distortion and fisheye need intrinsics; without them fov_y_deg sets the view")
            has_planes = not (near is None and far is None)
            near, far = planes_for(engine.length(pose[:3, 3]), near, far)
            projection = perspective_matrix(DEFAULT_FOV_Y_DEG if fov_y_deg is None else fov_y_deg, near, far)
            return cls(np.append(FLIP, 1)[:, None] * pose, projection, aspect=1.0, has_planes=has_planes)
        if fov_y_deg is not None or size is None:
            raise ValueError("intrinsics need the size of their picture, and no fov_y_deg")
        return cls.from_intrinsics(
            intrinsics,
            pose,
            size,
            near=near,
            far=far,
            distortion=distortion,
            fisheye=fisheye,
            pixel_center=pixel_center,
        )

    @classmethod
    def from_colmap(
        cls, camera: Any, image: Any, *, pixel_center: float = 0.5, near: float | None = None, far: float | None = None
    ) -> Camera:
        """The camera of an image of COLMAP.

        Parameters
        ----------
        camera : object, mapping or str
            A camera of `pycolmap` or of COLMAP's `read_write_model`, or whatever has `model`, `width`, `height` and
            `params`; or its line in cameras.txt. The model is SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV,
            FULL_OPENCV, SIMPLE_FISHEYE, FISHEYE, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE or OPENCV_FISHEYE.
        image : object, mapping or str
            An image of these, with `cam_from_world`, or `qvec` and `tvec`; or its line in images.txt.
        pixel_center : float
            Where the centre of the top-left pixel is: COLMAP has it at (0.5, 0.5).
        near, far : float, optional
            As for `from_intrinsics`.

        Raises
        ------
        ValueError
            If the model is another one, has other parameters, or the image is of another camera; as `from_intrinsics`.
        TypeError
            If something is missing.

        Examples
        --------
        >>> Camera.from_colmap("1 SIMPLE_RADIAL 640 480 500 320 240 -0.1", "7 1 0 0 0 0 0 4 1 a.jpg")
        Camera(eye=(0, 0, -4), forward=(0, 0, 1), fov_y_deg=51.28, lens=OpenCVLens)
        """
        return cls._of_calibration(of_colmap(camera, image), pixel_center, near, far)

    @classmethod
    def from_nerfstudio(
        cls,
        transforms: Any,
        i: int = 0,
        *,
        size: int | tuple[int, int] | None = None,
        pixel_center: float = 0.5,
        near: float | None = None,
        far: float | None = None,
    ) -> Camera:
        """The camera of a frame of a transforms.json, of nerfstudio, Instant NGP or the Blender scenes of NeRF.

        Parameters
        ----------
        transforms : mapping or path
            The content of the file, or the file. Poses are world from camera with the axes of OpenGL.
        i : int
            The frame.
        size : (width, height), optional
            Of the picture, where the file has no `w` and `h`.
        pixel_center : float
            Where the centre of the top-left pixel is: nerfstudio has it at (0.5, 0.5).
        near, far : float, optional
            As for `from_intrinsics`.

        Returns
        -------
        Camera
            In the world of the file: turns, moves and scales by a data parser of nerfstudio are not applied. It has
            OpenCV's fisheye lens where `camera_model` is OPENCV_FISHEYE or `is_fisheye` is true.

        Raises
        ------
        ValueError
            If the file is broken or has no frames, focal length or size, or another camera model than OPENCV,
            OPENCV_FISHEYE and the simpler ones, or `ftheta_p0`, `latlong`, `equirectangular` or `orthographic` of
            Instant NGP; as `from_intrinsics`.
        FileNotFoundError
            If there is no such file.
        IndexError
            If there is no such frame.

        Examples
        --------
        >>> import numpy as np
        >>> file = {"fl_x": 500, "w": 640, "h": 480, "frames": [{"transform_matrix": np.eye(4).tolist()}]}
        >>> Camera.from_nerfstudio(file, 0)
        Camera(eye=(0, 0, 0), forward=(0, 0, -1), fov_y_deg=51.28)
        """
        return cls._of_calibration(of_nerfstudio(transforms, i, size), pixel_center, near, far)

    @classmethod
    def from_pytorch3d(
        cls,
        cameras: Any,
        i: int = 0,
        *,
        size: int | tuple[int, int] | None = None,
        pixel_center: float = 0.5,
        near: float | None = None,
        far: float | None = None,
    ) -> Camera:
        """The camera of a batch of PyTorch3D, as its rasterizer sees it.

        Parameters
        ----------
        cameras : PerspectiveCameras or FoVPerspectiveCameras
            Or whatever has their `R`, `T`, and `focal_length` and `principal_point`, `fov` and `aspect_ratio`, or `K`.
        i : int
            Which camera of the batch.
        size : (width, height), optional
            Of the picture; the `image_size` of the cameras, which has the height first, unless given.
        pixel_center : float
            Where the centre of the top-left pixel is on the screen: PyTorch3D has it at (0.5, 0.5).
        near, far : float, optional
            As for `from_intrinsics`; `znear` and `zfar` unless given.

        Raises
        ------
        ValueError
            If the cameras are orthographic or have a lens, or no size is known.
        IndexError
            If there is no such camera.
        TypeError
            If something is missing.

        Notes
        -----
        PyTorch3D multiplies rows by `R`, has x to the left and y up, and counts from -1 to 1 along the shorter side of
        the picture. A field of view is that of the shorter side.
        """
        return cls._of_calibration(of_pytorch3d(cameras, i, size), pixel_center, near, far)

    @classmethod
    def _of_calibration(cls, own: Calibration, pixel_center: float, near: float | None, far: float | None) -> Camera:
        return cls.from_intrinsics(
            own.intrinsics, own.camera_from_world, own.size, near=own.near if near is None else near,
            far=own.far if far is None else far, distortion=own.distortion, fisheye=own.fisheye,
            pixel_center=pixel_center,
        )  # fmt: skip

    @classmethod
    def framing(
        cls,
        subject: MeshLike | Scene | npt.ArrayLike,
        *,
        azimuth_deg: float = THREE_QUARTER_DEG[0],
        elevation_deg: float = THREE_QUARTER_DEG[1],
        fov_y_deg: float = DEFAULT_FOV_Y_DEG,
        up: UpOption | None = None,
        ortho: bool = False,
        aspect: float = 1.0,
        fit: FitOption = "sphere",
    ) -> Camera:
        """A camera that has the whole subject just inside its frame; three-quarter view by default.

        Parameters
        ----------
        subject : mesh, Scene, or (N, 3) array_like
            Whatever `as_mesh` takes, or a scene: its vertices in use count; or points: two corners of a box, say.
        azimuth_deg : float
            0 looks at the front of the subject (+z with y up, -y with z up), 90 at its right (+x). Degrees.
        elevation_deg : float
            0 is level, 90 looks straight down. Degrees, -90 to 90.
        fov_y_deg : float
            Field of view from bottom to top, degrees. Sets the distance from which `ortho` is seen, too.
        up : {"y", "z"}, optional
            The axis of the world that points up: that of a mesh, else y, unless given.
        ortho : bool
            Without perspective.
        aspect : float
            Width / height of the picture to be made.
        fit : {"sphere", "box", "points", "silhouette"}
            The shape that just fits: the sphere round the subject, which keeps its size from every side; its box; or
            all of its points, which comes nearest; each with the middle of the box in the middle of the picture.
            "silhouette": the box round the picture of all points is in the middle and fills the frame, with a margin
            of 5 % at each end of its longer side.

        Raises
        ------
        ValueError
            If there is nothing to frame or a number is outside its range.
        """
        framed = as_framed(subject)
        ends = ends_to_frame(framed)
        parse(FitOption, "fit", fit)
        points = None if fit == "sphere" else box_corners(ends) if fit == "box" else points_to_frame(framed)
        angles = azimuth_deg, elevation_deg, fov_y_deg
        fills, up = fit == "silhouette", up_of(framed) if up is None else up
        matrices = framing_matrices(ends, points, angles, up=up, ortho=ortho, aspect=aspect, fills=fills)
        return cls(*matrices, aspect=1.0)


def planes_for(away: float, near: float | None, far: float | None) -> tuple[float, float]:
    """The planes given, or those of `Camera.clip_from_world` for a camera at this distance from the world's origin."""
    near = 1e-3 * (away or 1.0) if near is None else near
    far = max(1e3 * max(away or 1.0, 1.0), 1e3 * as_number("near", near)) if far is None else far
    return as_planes(near, far)


def pixels_of(points_eye: F64, camera: Camera, size: tuple[int, int]) -> F64:
    """The pixels of points in eye space that a lens has bent, as in `Camera.project`."""
    (width, height), projection = size, camera.drawn_from_eye(size)
    clip = engine.product(points_eye, projection[:, :3].T) + projection[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y, z = (clip[:, :3] / clip[:, 3:]).T
    depth = (z + 1) / 2 if camera.has_planes else z
    return np.stack([(x + 1) * (width / 2), (1 - y) * (height / 2), depth], axis=1)


CameraLike: TypeAlias = Camera | npt.NDArray[Any]
"""Functions that take a camera take its matrix (4, 4), clip from world, too: see `Camera.from_matrix`."""


def as_camera(camera: object, name: str = "camera") -> Camera:
    """The camera, or that of a matrix (4, 4) by `Camera.from_matrix`; a `TypeError` if it is neither."""
    if isinstance(camera, Camera):
        return camera
    wish = f"{name} must be a Camera or a (4, 4) matrix, clip from world"
    hint = ""
    if isinstance(camera, int) or (isinstance(camera, tuple | list) and len(camera) == 2):
        hint = "; the size comes after the camera: size=(640, 480)"
    elif camera is not None and not isinstance(camera, str | bytes | dict):
        try:
            matrix = as_array(name, camera)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            matrix = np.zeros(0)
        if matrix.shape == (4, 4) and matrix.dtype.kind in "fiu":
            return Camera.from_matrix(matrix)
        hint = "; Camera.from_intrinsics takes those of OpenCV" * (matrix.shape in ((3, 3), (3, 4)))
    raise TypeError(f"{wish}, got {shown(camera)}{hint}")


def camera_for(subject: Mesh | Scene | Points, camera: CameraLike | None, size: tuple[int, int]) -> Camera:
    """The camera, or the three-quarter view of the subject in a picture of this size."""
    if camera is not None:
        return as_camera(camera)
    if isinstance(subject, Mesh) and not len(subject.triangles):
        raise ValueError("there is nothing to frame: the mesh has no triangles")
    width, height = size
    aspect = width / height if width > 0 and height > 0 else 1.0
    angles, up = (*THREE_QUARTER_DEG, DEFAULT_FOV_Y_DEG), up_of(subject)
    return Camera(*framing_matrices(subject.extreme_points(), None, angles, up=up, aspect=aspect), aspect=1.0)
