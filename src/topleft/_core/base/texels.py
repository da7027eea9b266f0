"""Looks up arrays at pixels: between their texels, and in halvings where texels are smaller than a pixel.

In: an array of values, (u, v) of pixels and how they change from one to the next. Out: values, float32.

Based on: Williams, L., "Pyramidal Parametrics", SIGGRAPH 1983; Heckbert, P. S., "Fundamentals of Texture Mapping and
Image Warping", 1989 (the footprint of a pixel from derivatives).
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.array_types import F32
from topleft._core.base.arrays import as_array
from topleft._core.base.color import LIGHT_OF_SRGB, decode_srgb
from topleft._core.base.options import parse
from topleft.typing import EncodingOption, FilterOption, WrapOption

MOST_KEPT_BYTES = 1 << 27
"""The most bytes of levels that are kept with a texture; 2048 x 2048 texels of four channels take 2/3 of it."""

FILTER_CODES = {"nearest": 0, "bilinear": 1, "trilinear": 2, "pixelated": 3}  # tl_filter in csrc/pixels/shading.h
WRAP_CODES = {"repeat": 0, "clamp": 1, "mirror": 2}  # tl_wrap
HALVING = ("trilinear", "pixelated")
"""Filters that look at halvings of the picture."""


class ValueLevels(NamedTuple):
    """Values and their halvings, and how they are looked up."""

    texels: F32  # (N, C): of all levels, behind each other; row 0 is the top, where v = 1
    rows: NDArray[np.int64]  # (L, 3): where each begins, width and height
    codes: tuple[int, int, int]  # of the filter, and of the wraps of u and v
    is_flat: bool = False  # (H, W) without channels

    @property
    def n_channels(self) -> int:
        """Numbers of a texel."""
        return self.texels.shape[1]

    def look_up(self, ids: NDArray[np.int32], uv: F32, slopes: F32 | None, background: float) -> F32:
        """Return the values (P, C) of pixels with `ids` (P,) int32; -1: the background.

        `uv` (P, 2) float32. `slopes` (P, 2, 2) float32: of u and v, the first axis, from pixel to pixel along x and y;
        None unless there are halvings.
        """
        out = np.empty((len(ids), self.n_channels), np.float32)
        engine.fill_texels(self.texels, self.rows, self.codes, ids, uv, slopes, background, out)
        return out


def as_levels(texture: object, filter: str, wrap: object, encoding: str | None) -> ValueLevels:  # noqa: A002
    """Return the texels of a lookup: of a `Texture`, which keeps its levels, or of (H, W) or (H, W, C) real numbers.

    A `Texture` tells filter, wrap (one word, or two for u and v) and encoding itself. "srgb": the first three channels
    are decoded to light; otherwise "linear". Unsigned bytes become 0 to 1 either way. Anything but real numbers is a
    `TypeError`, another shape, no texels or an unknown option a `ValueError`.
    """
    if hasattr(texture, "value_levels"):
        found: ValueLevels = texture.value_levels()
        return found
    encoding = "linear" if encoding is None else encoding
    parse(FilterOption, "filter", filter)
    parse(EncodingOption, "encoding", encoding)
    wraps = (wrap, wrap) if isinstance(wrap, str) else wrap
    if not isinstance(wraps, tuple | list) or len(wraps) != 2:
        raise ValueError(f"wrap must be one word, or two for u and v, got {wrap!r}")
    for one in wraps:
        parse(WrapOption, "wrap", one)
    array = as_array("texture", texture)  # type: ignore[arg-type]
    if array.dtype.kind not in "fiub":
        raise TypeError(f"texture must be a Texture or real numbers, got dtype {array.dtype}")
    if array.ndim not in (2, 3) or not array.size:
        raise ValueError(f"texture must have shape (H, W) or (H, W, C), got {array.shape}")
    values = as_light(array.reshape(*array.shape[:2], -1), encoding)
    return levels_of(values, filter, (str(wraps[0]), str(wraps[1])))._replace(is_flat=array.ndim == 2)


def as_light(array: NDArray[Any], encoding: str) -> F32:
    """Return values (H, W, C) as float32, bytes as 0 to 1, the first three channels decoded where they are sRGB."""
    if array.dtype != np.uint8:
        values = np.ascontiguousarray(array, np.float32)
        if encoding == "srgb":
            values = values.copy()
            values[..., :3] = decode_srgb(values[..., :3].astype(np.float64))
        return values
    values = np.empty(array.shape, np.float32)
    np.divide(array, np.float32(255), out=values, dtype=np.float32)
    if encoding == "srgb":
        values[..., :3] = LIGHT_OF_SRGB[array[..., :3]]
    return values


def levels_of(values: F32, filter: str, wraps: tuple[str, str]) -> ValueLevels:  # noqa: A002
    """Return contiguous values (H, W, C) with their halvings, where the filter reads halvings."""
    height, width, n_channels = values.shape
    rows = [(0, width, height)]
    while filter in HALVING and max(width, height) > 1:
        offset, width, height = rows[-1]
        offset, width, height = offset + height * width, max(1, width // 2), max(1, height // 2)
        rows.append((offset, width, height))
    codes = FILTER_CODES[filter], *(WRAP_CODES[one] for one in wraps)
    texels = values.reshape(-1, n_channels)
    if len(rows) > 1:
        texels = np.empty((rows[-1][0] + 1, n_channels), np.float32)
        texels[: rows[1][0]] = values.reshape(-1, n_channels)
        for (first, width, height), (offset, *half) in pairwise(rows):
            end = offset + half[0] * half[1]
            engine.halve_rows(texels[first:offset], width, height, 0, half[1], texels[offset:end])
    return ValueLevels(texels, np.array(rows, np.int64), codes)  # type: ignore[arg-type]


def halve(level: F32) -> F32:
    """Return the next halving (max(1, H // 2), max(1, W // 2), C): each texel the mean over its area."""
    found = levels_of(np.ascontiguousarray(level), "trilinear", ("clamp", "clamp"))
    offset, width, height = found.rows[1].tolist()
    return found.texels[offset : offset + width * height].reshape(height, width, -1)
