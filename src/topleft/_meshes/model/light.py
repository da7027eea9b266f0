"""Lights: directions and points that light comes from, and the depth cue; values, checked once.

Based on: Lambert, J. H., "Photometria", 1760; Mitchell, J., G. McTaggart and C. Green, "Shading in Valve's Source
Engine", SIGGRAPH 2006 courses (the half-Lambert fall-off of the headlight, there with the power 2); Khronos, glTF
extension KHR_lights_punctual, 2018 (the cone of a spot).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.arrays import as_number, as_vector, shown
from topleft._core.base.color import Color, ColorLike, as_color
from topleft._core.base.options import parse
from topleft.typing import LightKindOption, SpaceOption

TO_HEADLIGHT = np.array([-0.35, 0.45, 1.0]) / engine.length([-0.35, 0.45, 1.0])
"""Direction of the headlight in eye space: from over the viewer's left shoulder, so that up and left read as lit."""

AMBIENT = 0.03
"""Share of the light, in linear light, that reaches a surface from all sides.

The headlight adds the rest: it falls off as ((1 + n . l) / 2)**3 and so reaches 0 smoothly, at the far side of a
sphere. Lambert's max(0, n . l) ends in a line, which on coarse meshes reads as a seam.
"""


@dataclass(frozen=True)
class Light:
    """A light that shines from a direction, from a point, or from a point within a cone; without shadows.

    Parameters
    ----------
    at : (3,) of float
        The direction *to* the light, of any length, or the point where it is. World space, or that of the eye (x right,
        y up, the view along -z, of cameras of OpenCV, too).
    kind : {"directional", "point", "spot"}
        The meaning of `at`. A spot is a point whose light stays within a cone.
    color : (3,) of 0 to 255
        sRGB.
    intensity : float
        Not negative. A white surface that faces a white light of intensity 1 is white.
    falloff : float
        Not negative. At distance d from a point the light is divided by `1 + falloff * d**2`; 0: it is the same
        everywhere.
    space : {"world", "eye"}
        "eye": the light moves with the camera.
    direction : (3,) of float, optional
        Where a spot shines to, of any length; in the same space.
    inner_deg, outer_deg : float
        Of a spot, degrees from its direction, 0 <= inner < outer <= 90: where its light begins to fall off, and where
        none is left.

    Raises
    ------
    ValueError
        If a number is not finite or outside its range, a direction has no length, or `direction` is given for another
        kind than "spot", or missing there.

    Examples
    --------
    >>> Light((0, 1, 0)).kind
    'directional'
    """

    at: tuple[float, float, float]
    kind: str = "directional"
    color: Color = (255, 255, 255)
    intensity: float = 1.0
    falloff: float = 0.0
    space: str = "world"
    direction: tuple[float, float, float] | None = None
    inner_deg: float = 0.0
    outer_deg: float = 45.0

    if TYPE_CHECKING:  # anything that NumPy reads may be given; the types above are kept

        def __init__(
            self,
            at: npt.ArrayLike,
            kind: LightKindOption = "directional",
            color: ColorLike = (255, 255, 255),
            intensity: float = 1.0,
            falloff: float = 0.0,
            space: SpaceOption = "world",
            direction: npt.ArrayLike | None = None,
            inner_deg: float = 0.0,
            outer_deg: float = 45.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        keep = object.__setattr__  # the dataclass is frozen, and its values are coerced
        keep(self, "kind", parse(LightKindOption, "kind", self.kind))
        keep(self, "space", parse(SpaceOption, "space", self.space))
        keep(self, "color", as_color("color", self.color, 3))
        keep(self, "at", tuple(as_vector("at", self.at).tolist()))
        if self.kind == "directional" and not any(self.at):
            raise ValueError(f"at must be a direction, got {self.at}")
        for name in ("intensity", "falloff"):
            keep(self, name, as_not_negative(name, getattr(self, name)))
        if (self.kind == "spot") != (self.direction is not None):
            raise ValueError(f"direction must be given for a spot, and for no other kind, got {self.direction}")
        if self.direction is not None:
            keep(self, "direction", tuple(as_vector("direction", self.direction).tolist()))
            if not any(self.direction):
                raise ValueError(f"direction must have a length, got {self.direction}")
        if not 0 <= as_number("inner_deg", self.inner_deg) < as_number("outer_deg", self.outer_deg) <= 90:
            raise ValueError(f"0 <= inner_deg < outer_deg <= 90 must hold, got {self.inner_deg} and {self.outer_deg}")

    @property
    def cone(self) -> tuple[float, float]:
        """Scale and offset of a spot, which sends the square of scale * cosine + offset, cut off at 0 and 1."""
        if self.kind != "spot":
            return 0.0, 0.0
        inner, outer = (engine.cosine_and_sine(angle)[0] for angle in (self.inner_deg, self.outer_deg))
        return 1 / (inner - outer), -outer / (inner - outer)


@dataclass(frozen=True)
class Fog:
    """The depth cue: surfaces fade into a colour with the distance along the view.

    Parameters
    ----------
    near, far : float
        Where it begins, and where nothing else is left; world units in front of the eye, near < far.
    color : (3,) of 0 to 255
        sRGB.

    Raises
    ------
    ValueError
        If a number is outside its range.

    Examples
    --------
    >>> import topleft as tl
    >>> fog = tl.Fog(2.0, 6.0, color=(200, 210, 220))
    >>> ball = tl.Mesh(*tl.scenes.icosphere(2))
    >>> tl.render(ball, tl.Camera.framing(ball), (32, 32), fog=fog).shape
    (32, 32, 4)
    """

    near: float
    far: float
    color: Color = (255, 255, 255)

    if TYPE_CHECKING:  # anything that NumPy reads may be given; the types above are kept

        def __init__(self, near: float, far: float, color: ColorLike = (255, 255, 255)) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "color", as_color("color", self.color, 3))
        near, far = as_number("near", self.near), as_number("far", self.far)
        if not -math.inf < near < far < math.inf:
            raise ValueError(f"near and far must be finite and near < far, got {self.near} and {self.far}")
        object.__setattr__(self, "near", near)
        object.__setattr__(self, "far", far)


def as_not_negative(name: str, value: float) -> float:
    """The number as a float."""
    if not 0 <= as_number(name, value) < math.inf:
        raise ValueError(f"{name} must be finite and not negative, got {value!r}")
    return float(value)


def as_lights(lights: object) -> Sequence[Light]:
    """Return one light or several as a sequence."""
    if isinstance(lights, Light):
        return (lights,)
    if not isinstance(lights, Iterable) or isinstance(lights, np.ndarray | str | dict):
        raise TypeError(f"lights must be a Light or a sequence of them, got {shown(lights)}")
    found = tuple(lights)
    for light in found:
        if not isinstance(light, Light):
            raise TypeError(f"lights must be of Light, got {type(light).__name__}: a direction is Light((0, 1, 0))")
    return found
