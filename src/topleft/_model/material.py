"""Materials: what a surface is made of, as values."""

from __future__ import annotations

from dataclasses import dataclass, fields

from topleft._base.arrays import as_number
from topleft._base.color import Color, as_color
from topleft._model.light import as_not_negative
from topleft._model.texture import Texture


@dataclass(frozen=True)
class Material:
    """How a surface answers to light.

    Parameters
    ----------
    color : (3,) of 0 to 255, optional
        sRGB; times the texture and the colours of the vertices. Unless given: white where there are those, else a light
        warm grey.
    texture : Texture, optional
        Used where the mesh has `uv`.
    specular : float
        Strength of the highlights, 0 to 1: what a mirror turned to the light adds, white.
    shininess : float
        Blinn's exponent: the larger, the smaller the highlight. 0: none.
    back_color : (3,) of 0 to 255, optional
        sRGB of the back of the triangles, without texture; as the front unless given.
    unlit : bool
        The colour shows as it is, whatever the light.
    alpha_cutoff : float, optional
        0 to 1: what has less opacity in the texture is cut out, and what is behind it shows. Unless given everything is
        opaque.

    Raises
    ------
    ValueError
        If a number is outside its range.
    """

    color: Color | None = None
    texture: Texture | None = None
    specular: float = 0.0
    shininess: float = 32.0
    back_color: Color | None = None
    unlit: bool = False
    alpha_cutoff: float | None = None

    def __repr__(self) -> str:
        """One line: what differs from a plain material."""
        own = ((one.name, getattr(self, one.name), one.default) for one in fields(self))
        told = ((name, str(value) if isinstance(value, str) else value) for name, value, plain in own if value != plain)
        words = (f"{name}={value!r}" for name, value in told)
        return f"Material({', '.join(words)})"

    def __post_init__(self) -> None:
        keep = object.__setattr__  # the dataclass is frozen, and its values are coerced
        for name in ("color", "back_color"):
            if getattr(self, name) is not None:
                keep(self, name, as_color(name, getattr(self, name), 3))
        for name in ("specular", "shininess"):
            keep(self, name, as_not_negative(name, getattr(self, name)))
        for name in ("specular", "alpha_cutoff"):
            value = getattr(self, name)
            if value is not None and not 0 <= as_number(name, value) <= 1:
                raise ValueError(f"{name} must lie in 0 to 1, got {value!r}")
        if self.texture is not None and not isinstance(self.texture, Texture):
            raise TypeError(f"texture must be a Texture, got {type(self.texture).__name__}")
