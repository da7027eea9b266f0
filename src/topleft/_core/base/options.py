"""Values that options take: every option is a string in the API and an enum inside."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum, StrEnum
from functools import cache, cached_property
from typing import TypeVar, get_args

from topleft._core.base.arrays import as_names
from topleft.typing import LayerOption


class Sampling(StrEnum):
    """Where a pixel is sampled, or which squares count."""

    CENTER = "center"
    MSAA2 = "msaa2"
    MSAA4 = "msaa4"
    MSAA8 = "msaa8"
    MSAA16 = "msaa16"
    AREA = "area"
    OUTER = "outer"
    INNER = "inner"

    @cached_property
    def n_samples(self) -> int:
        """Samples of a pixel, 1 unless there are several."""
        return int(self.removeprefix("msaa")) if self.startswith("msaa") else 1


class Cull(StrEnum):
    """Which triangles are left out; the front is counter-clockwise seen with y up."""

    NONE = "none"
    BACK = "back"
    FRONT = "front"


class DepthTest(StrEnum):
    """Which of two triangles is kept; ``None`` in the API is painter's order."""

    LESS = "less"
    GREATER = "greater"


class ClipDepth(StrEnum):
    """The range of z/w that the near and far planes leave: OpenGL's, or that of Direct3D and Vulkan."""

    MINUS_ONE_TO_ONE = "minus_one_to_one"
    ZERO_TO_ONE = "zero_to_one"


class Per(StrEnum):
    """The owner of a row of colours."""

    AUTO = "auto"
    TRIANGLE = "triangle"
    VERTEX = "vertex"


class Blend(StrEnum):
    """How a triangle's colour changes that of a pixel; in the order of `tl_blend` in ``csrc/topleft.h``."""

    REPLACE = "replace"
    OVER = "over"
    ADD = "add"
    MULTIPLY = "multiply"
    MAX = "max"
    MIN = "min"


class Alpha(StrEnum):
    """Whether the colours of pixels with alpha, their last channel, have been multiplied by it."""

    STRAIGHT = "straight"
    PREMULTIPLIED = "premultiplied"


class Resolve(StrEnum):
    """How a pixel's samples are averaged: their values, or the light that sRGB values stand for."""

    VALUES = "values"
    LINEAR = "linear"


class PointShape(StrEnum):
    """The shape of a point."""

    DISC = "disc"
    SQUARE = "square"


class Sink(IntEnum):
    """How a covered sample changes the buffers; the numbers are `tl_sink` in ``csrc/topleft.h``."""

    MASK = 0
    COUNT = 1
    LABEL = 2
    PAINT = 3
    NEAREST = 4
    FARTHEST = 5
    SAMPLES = 6


Option = TypeVar("Option", bound=StrEnum)


@cache
def members(kind: type[Option]) -> dict[str, Option]:
    """Return the members of an enum by their values: calling the enum takes five times as long."""
    return {member.value: member for member in kind}


def parse(kind: type[Option], name: str, value: object) -> Option:
    """Return the member of an enum that an option names."""
    member = members(kind).get(value) if isinstance(value, str) else None
    if member is None:
        choices = ", ".join(repr(str(member)) for member in kind)
        raise ValueError(f"{name} must be one of {choices}, got {value!r}")
    return member


def check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Raise a `ValueError` unless the value is one of a few words."""
    if not (isinstance(value, str) and value in choices):
        *others, last = (f'"{choice}"' for choice in choices)
        raise ValueError(f"{name} must be {', '.join(others)} or {last}, got {value!r}")


LAYER_NAMES: tuple[str, ...] = get_args(LayerOption)
"""Names of the layers of a view."""


def check_layers(names: str | Iterable[str]) -> tuple[str, ...]:
    """Return names of layers, each once."""
    checked = tuple(dict.fromkeys(as_names("layers", names)))
    for name in checked:
        if name not in LAYER_NAMES:
            raise ValueError(f"layers must be some of {', '.join(LAYER_NAMES)}, got {name!r}")
    return checked
