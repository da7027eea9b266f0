"""Lenses: from straight rays to the bent rays of a real camera, in float64.

Camera axes here are those of OpenCV: x right, y down, z along the view. The image plane lies at z = 1.

Based on: Brown, D. C., "Close-Range Camera Calibration", Photogrammetric Engineering 37(8), 1971 (radial and tangential
terms); Kannala, J., and S. S. Brandt, "A Generic Camera Model and Calibration Method for Conventional, Wide-Angle, and
Fish-Eye Lenses", IEEE PAMI 28(8), 2006 (the fisheye); both with the terms and names of OpenCV.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64
from topleft._core.base.arrays import as_number, as_real

FLIP = np.array([1.0, -1.0, -1.0])
"""Turns axes of OpenCV into axes of OpenGL, and back."""

DEFAULT_TOLERANCE_PX = 0.125
FINEST_TOLERANCE_PX = 2.0**-8
"""Vertices snap to this grid unless the caller asks for a finer one."""


class Lens(Protocol):
    """A lens, as cameras need it."""

    #: Radians from the axis; beyond it the lens is not evaluated.
    max_angle: ClassVar[float]

    #: Whether `range_along` is the distance along the axis, which a straight projection shows as it is.
    has_planar_range: ClassVar[bool]

    def __hash__(self) -> int:
        """Equal for lenses of equal terms."""
        return hash(self.terms)

    @property
    def tolerance_px(self) -> float:
        """The largest error of a straight piece of a bent edge, in pixels."""

    def distort(self, points: F64) -> F64:
        """Places (N, 2) in the image plane of points (N, 3) in front of the lens."""

    def range_along(self, points: F64) -> F64:
        """The distances of points (N, 3) that depth stands for, world units."""

    @property
    def terms(self) -> Terms:
        """The coefficients that kernels read."""

    def bend(self, points_eye: F64) -> F64:
        """Points (N, 3) in eye space, moved so that a camera without a lens sees them where the lens shows them."""
        points = points_eye * FLIP
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            place, reach = self.distort(points), self.range_along(points)
        return np.stack([place[:, 0] * reach, -place[:, 1] * reach, -reach], axis=1)


class Terms(NamedTuple):
    """The terms of a lens by kind: k1 to k6, p1 and p2, s1 to s4; cosine and sine of tau_x, then of tau_y."""

    radial: tuple[float, ...]
    tangential: tuple[float, float] = (0.0, 0.0)
    prism: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    tilt: tuple[float, ...] = (1.0, 0.0, 1.0, 0.0)


@dataclass(frozen=True)
class OpenCVLens(Lens):
    """Radial and tangential distortion, thin prism and tilt, as `cv2.projectPoints` has them.

    Parameters
    ----------
    k1, k2, k3 : float
        Radial terms, numerator.
    p1, p2 : float
        Tangential terms.
    k4, k5, k6 : float
        Radial terms, denominator.
    s1, s2, s3, s4 : float
        Terms of the thin prism.
    tau_x, tau_y : float
        The tilt of the sensor, radians, each below 90 degrees.
    tolerance_px : float
        The largest error of a straight piece of a bent edge, in pixels.

    Raises
    ------
    ValueError
        If a term is not finite, or the tolerance is below 2**-8.

    Notes
    -----
    With x = X/Z, y = Y/Z, r2 = x*x + y*y and q = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3) the
    point is seen at x q + 2 p1 x y + p2 (r2 + 2 x x) + s1 r2 + s2 r2^2, y q + p1 (r2 + 2 y y) + 2 p2 x y + s3 r2 +
    s4 r2^2, and from there on the plane that the tilt turns about its axes x, then y. Depth stays that of Z.

    Examples
    --------
    >>> import numpy as np
    >>> import topleft as tl
    >>> tl.OpenCVLens(k1=-0.25).distort(np.array([[1.0, 0.0, 2.0]])).tolist()  # 0.5 (1 - 0.25 * 0.5^2)
    [[0.46875, 0.0]]
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    tolerance_px: float = DEFAULT_TOLERANCE_PX
    s1: float = 0.0
    s2: float = 0.0
    s3: float = 0.0
    s4: float = 0.0
    tau_x: float = 0.0
    tau_y: float = 0.0

    max_angle: ClassVar[float] = np.radians(89.4)
    has_planar_range: ClassVar[bool] = True

    def __post_init__(self) -> None:
        radial = [self.k1, self.k2, self.p1, self.p2, self.k3, self.k4, self.k5, self.k6]
        rest = [self.s1, self.s2, self.s3, self.s4, self.tau_x, self.tau_y]
        _check_terms(radial + rest, self.tolerance_px)
        if max(abs(self.tau_x), abs(self.tau_y)) >= np.pi / 2:
            raise ValueError(f"tau_x and tau_y must be below 90 degrees, got {self.tau_x} and {self.tau_y} radians")

    def distort(self, points: F64) -> F64:
        """Places (N, 2) in the image plane of points (N, 3) with Z > 0."""
        points = _as_points(points)
        x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
        r2 = x * x + y * y
        numerator = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        radial = numerator / (1 + r2 * (self.k4 + r2 * (self.k5 + r2 * self.k6)))
        u = x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x * x)
        v = y * radial + self.p1 * (r2 + 2 * y * y) + 2 * self.p2 * x * y
        if any((self.s1, self.s2, self.s3, self.s4)):
            u += r2 * (self.s1 + r2 * self.s2)
            v += r2 * (self.s3 + r2 * self.s4)
        if self.tau_x or self.tau_y:
            u, v = self._tilt(u, v)
        return np.stack([u, v], axis=1)

    @property
    def terms(self) -> Terms:
        """The coefficients that kernels read."""
        radial = self.k1, self.k2, self.k3, self.k4, self.k5, self.k6
        tilts = (engine.cosine_and_sine(math.degrees(angle)) for angle in (self.tau_x, self.tau_y))
        prism = self.s1, self.s2, self.s3, self.s4
        return Terms(radial, (self.p1, self.p2), prism, tuple(number for tilt in tilts for number in tilt))

    def _tilt(self, u: F64, v: F64) -> tuple[F64, F64]:
        """Places in a plane that is turned about x, then y, seen from the lens."""
        cos_x, sin_x, cos_y, sin_y = self.terms.tilt
        a = cos_y * u + sin_x * sin_y * v - sin_y * cos_x
        b = cos_x * v + sin_x
        c = sin_y * u - cos_y * sin_x * v + cos_y * cos_x
        depth = cos_y * cos_x
        return (depth * a + sin_y * cos_x * c) / c, (depth * b - sin_x * c) / c

    def range_along(self, points: F64) -> F64:
        """Z."""
        return points[:, 2]


@dataclass(frozen=True)
class FisheyeLens(Lens):
    """A fisheye, as `cv2.fisheye.projectPoints` has it; it may see behind itself, up to 160 degrees from its axis.

    Parameters
    ----------
    k1, k2, k3, k4 : float
        Terms of the angle.
    tolerance_px : float
        The largest error of a straight piece of a bent edge, in pixels.

    Raises
    ------
    ValueError
        If a term is not finite, or the tolerance is below 2**-8.

    Notes
    -----
    A point at the angle t from the axis is seen at the distance t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) from the
    centre. Depth is that of the distance from the lens, not of Z, which is 0 at 90 degrees.

    Examples
    --------
    >>> import numpy as np
    >>> import topleft as tl
    >>> round(float(tl.FisheyeLens(k1=0.0).distort(np.array([[1.0, 0.0, 1.0]]))[0, 0]), 4)  # 45 degrees from the axis
    0.7854
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    tolerance_px: float = DEFAULT_TOLERANCE_PX

    max_angle: ClassVar[float] = np.radians(179.0)
    has_planar_range: ClassVar[bool] = False

    def __post_init__(self) -> None:
        _check_terms([self.k1, self.k2, self.k3, self.k4], self.tolerance_px)

    def distort(self, points: F64) -> F64:
        """Places (N, 2) in the image plane of points (N, 3)."""
        points = _as_points(points)
        off_axis, angle = engine.off_axis(points)
        t2 = angle * angle
        bent = angle * (1 + t2 * (self.k1 + t2 * (self.k2 + t2 * (self.k3 + t2 * self.k4))))
        # On the axis, where the angle is nothing, the direction is too.
        scale = np.divide(bent, off_axis, out=np.zeros_like(bent), where=off_axis > 0)
        return points[:, :2] * scale[:, None]

    @property
    def terms(self) -> Terms:
        """The coefficients that kernels read."""
        return Terms((self.k1, self.k2, self.k3, self.k4, 0.0, 0.0))

    def range_along(self, points: F64) -> F64:
        """The distance from the lens."""
        return np.sqrt(engine.row_products(points, points))


def _as_points(points: npt.ArrayLike) -> F64:
    found = as_real("points", points)
    if found.ndim != 2 or found.shape[1] != 3:
        raise ValueError(f"points must have shape (N, 3), got {found.shape}")
    return found


def lens_of_opencv(distortion: npt.ArrayLike | None, fisheye: npt.ArrayLike | None) -> Lens | None:
    """The lens of the coefficients that OpenCV returns, in its order; `None` without any."""
    if distortion is not None and fisheye is not None:
        raise ValueError("distortion and fisheye are two models of a lens: give one of them")
    if distortion is not None:
        terms = as_real("distortion", distortion).ravel().tolist()
        if len(terms) not in (4, 5, 8, 12, 14):
            raise ValueError(
                "distortion must be k1, k2, p1, p2[, k3[, k4, k5, k6[, s1, s2, s3, s4[, tau_x, tau_y]]]]: 4, 5, 8, 12 "
                f"or 14 numbers, got {len(terms)}"
            )
        return OpenCVLens(*terms[:8], **dict(zip(("s1", "s2", "s3", "s4", "tau_x", "tau_y"), terms[8:], strict=False)))
    if fisheye is not None:
        terms = as_real("fisheye", fisheye).ravel().tolist()
        if len(terms) != 4:
            raise ValueError(f"fisheye must be k1, k2, k3, k4: 4 numbers, got {len(terms)}")
        return FisheyeLens(*terms)
    return None


def _check_terms(terms: list[float], tolerance_px: float) -> None:
    if not all(math.isfinite(as_number("terms of a lens", term)) for term in terms):
        raise ValueError(f"the terms of a lens must be finite, got {terms}")
    if not FINEST_TOLERANCE_PX <= as_number("tolerance_px", tolerance_px) < math.inf:
        raise ValueError(f"tolerance_px must be at least {FINEST_TOLERANCE_PX}, got {tolerance_px}")
