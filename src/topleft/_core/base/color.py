"""Converts colours: sRGB to linear light and back; a colour for each id.

Based on: IEC 61966-2-1, "Default RGB colour space - sRGB", 1999.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import F32, F64, I32, U8, Array
from topleft._core.base.arrays import as_array, shown
from topleft._core.base.notes import level_outside

Color = tuple[int, ...]
ColorLike: TypeAlias = str | Sequence[float] | npt.NDArray[Any]
"""The argument of `as_color`."""

DEFAULT_COLOR = (224, 222, 217)
"""sRGB of a mesh without colours: a light warm grey, in which light and shadow both have room."""

WHITE = (255, 255, 255, 255)
"""sRGB and alpha of the background of a picture."""

LINEAR_ONE = 1 << 16
"""Steps of the light from 0 to 1 where it is kept as a whole number."""


def decode_srgb(values: F64) -> F64:
    """Linear light of sRGB values, both 0 to 1."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def encode_srgb(light: F64) -> F64:
    """The sRGB values of linear light, both 0 to 1."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


LIGHT_OF_SRGB: F32 = decode_srgb(np.arange(256) / 255).astype(np.float32)
"""(256,) float32: the light, 0 to 1, of each sRGB value."""
LIGHT_OF_SRGB.flags.writeable = False
_LIGHTS: list[float] = LIGHT_OF_SRGB.tolist()


@lru_cache(maxsize=1)
def srgb_tables() -> tuple[I32, U8]:
    """Return the light of each sRGB value, in steps, and the sRGB value of each step."""
    light = LINEAR_ONE * decode_srgb(np.arange(256) / 255)
    values = 255 * encode_srgb(np.arange(LINEAR_ONE + 1) / LINEAR_ONE)
    return np.rint(light).astype(np.int32), np.rint(values).astype(np.uint8)


def spread_colors(colors: U8, are_light: bool, spread: Callable[[Array], F64]) -> U8:
    """Return colours (N, 4) between others, by a function of mixed numbers: mixed as sRGB numbers, or as light."""
    if not are_light:
        return np.rint(spread(colors)).astype(np.uint8)
    light = spread(np.concatenate([LIGHT_OF_SRGB[colors[:, :3]], colors[:, 3:] / 255], axis=1))
    light[:, :3] = encode_srgb(light[:, :3].clip(0, 1))
    return np.rint(255 * light).astype(np.uint8)


def as_color(name: str, color: ColorLike, n_channels: int) -> Color:
    """The colour as whole numbers of 0 to 255; RGB becomes opaque RGBA if four channels are wanted.

    It may be a name of CSS ("red", "#f2a65a", "rgb(255, 0, 0)", for a background "transparent"); integers of 0 to 255;
    or floats of 0 to 1, which one float among the numbers makes of them all: (1.0, 0, 0) is red, (1, 0, 0) nearly
    black, with a warning. Another name, number of channels or range is a `ValueError`, anything else a `TypeError`.
    """
    if isinstance(color, str) and color == "transparent" and n_channels == 4:
        return (0, 0, 0, 0)
    if isinstance(color, str):
        named = color_of_name(name, color)
        channels: tuple[int, ...] = named if n_channels == 4 or named[3] < 255 else named[:3]
    elif type(color) is tuple and set(map(type, color)) == {int} and min(color) >= 0 and max(color) <= 255:
        channels = (*color, 255) if n_channels == 4 and len(color) == 3 else color  # as below, without an array
        if max(color) == 1 and len(channels) == n_channels:
            full = tuple(map(float, color))
            text = f"{name} {color} of integers is of 0 to 255, nearly black: write {full} for full"
            warnings.warn(text, stacklevel=level_outside())
    else:
        array = as_array(name, color)
        if array.ndim != 1 or array.dtype.kind not in "fiu":
            raise TypeError(
                f"{name} must be a name, '#rrggbb', {n_channels} integers of 0 to 255 or floats of 0 to 1, "
                f"got {shown(color)}"
            )
        if array.dtype.kind == "f":
            if not ((array >= 0) & (array <= 1)).all():
                raise ValueError(
                    f"{name} must be floats of 0 to 1 or integers of 0 to 255, got floats {array.tolist()}"
                )
            array = np.rint(255 * array.astype(np.float64))
        channels = tuple(map(int, array.tolist()))
        if n_channels == 4 and len(channels) == 3:
            channels = (*channels, 255)
    if len(channels) != n_channels or min(channels) < 0 or max(channels) > 255:
        raise ValueError(f"{name} must be {n_channels} numbers of 0 to 255, got {shown(color)}")
    return channels


def color_of_name(name: str, text: str) -> tuple[int, int, int, int]:
    """Red, green, blue and alpha of 0 to 255 of a colour by its name."""
    from PIL import ImageColor  # which colours as numbers do without

    try:
        red, green, blue, alpha = cast("tuple[int, int, int, int]", ImageColor.getcolor(text.strip(), "RGBA"))
    except ValueError:
        raise ValueError(f"{name} must be a name of CSS like 'red', or '#rrggbb', got {text[:40]!r}") from None
    return red, green, blue, alpha


def light_of(color: Color) -> tuple[float, ...]:
    """Linear red, green and blue of an sRGB colour, and its opacity of 0 to 1 (1 unless it has one)."""
    return _LIGHTS[color[0]], _LIGHTS[color[1]], _LIGHTS[color[2]], color[3] / 255 if len(color) == 4 else 1.0


def id_colors(ids: npt.NDArray[np.integer[Any]]) -> U8:
    """A bright colour (N, 3) uint8 for each id: the hue turns by the golden angle, so neighbours differ most."""
    ids = ids.astype(np.uint64)
    hue = (ids * np.uint64(0x9E3779B97F4A7C15) >> np.uint64(40)).astype(np.float32) / 2**24
    tint = (ids * np.uint64(0xD1B54A32D192ED03) >> np.uint64(40)).astype(np.float32) / 2**24
    value, saturation = 0.65 + 0.35 * tint, 0.80 - 0.40 * ((5 * tint) % 1)
    ramp = np.abs((6 * hue[:, None] + np.array([0, 4, 2], dtype=np.float32)) % 6 - 3) - 1
    rgb = value[:, None] * (1 - saturation[:, None] * (1 - np.clip(ramp, 0, 1)))
    return np.rint(255 * rgb).astype(np.uint8)
