"""Textures: pictures of linear light and their halves, made once from an sRGB picture.

Input: uint8 pixels. Output: what the kernels read.

Based on: Williams, L., "Pyramidal Parametrics", SIGGRAPH 1983.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._base.arrays import as_array
from topleft._base.color import LIGHT_OF_SRGB
from topleft._base.options import parse

U8 = npt.NDArray[np.uint8]
U16 = npt.NDArray[np.uint16]
F64 = npt.NDArray[np.float64]

MAX_TEXTURE_SIZE = 1 << 15
"""Of a side: 16 levels."""


class Filter(StrEnum):
    """What a texture is at a point between its texels, and where they are smaller than a pixel."""

    NEAREST = "nearest"
    BILINEAR = "bilinear"
    TRILINEAR = "trilinear"


class Wrap(StrEnum):
    """What lies beyond a texture."""

    REPEAT = "repeat"
    CLAMP = "clamp"
    MIRROR = "mirror"


FILTER_CODES = {Filter.NEAREST: 0, Filter.BILINEAR: 1, Filter.TRILINEAR: 2}  # tl_filter in csrc/shading.h
WRAP_CODES = {Wrap.REPEAT: 0, Wrap.CLAMP: 1, Wrap.MIRROR: 2}  # tl_wrap in csrc/shading.h


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture to be laid on a mesh by its `uv`.

    Parameters
    ----------
    image : (H, W), (H, W, 3) or (H, W, 4) array_like of uint8
        sRGB, and opacity; row 0 is the top, where v = 1. Copied.
    filter : {"trilinear", "bilinear", "nearest"}
        "trilinear": between the texels and between the two halvings next to the size of the pixel's footprint.
        "bilinear": between the four texels next to the point. "nearest": the texel that the point lies in.
    wrap : {"repeat", "clamp", "mirror"}, or a pair of them for u and v
        What lies beyond 0 and 1.

    Raises
    ------
    TypeError
        If the pixels are no uint8.
    ValueError
        If the picture has another shape, no pixels, or a side of more than 32768, or an option is unknown.

    Notes
    -----
    Texels are kept as linear light in 65535ths, so filters and halvings take the mean of light. A halving is the mean
    over the area of its texels, also where a side is odd.

    Examples
    --------
    >>> Texture([[0, 255]]).filter
    <Filter.TRILINEAR: 'trilinear'>
    """

    image: U8
    filter: str = "trilinear"
    wrap: str | tuple[str, str] = "repeat"

    def __post_init__(self) -> None:
        keep = object.__setattr__  # the dataclass is frozen, and its values are coerced
        keep(self, "image", as_image("image", self.image))
        keep(self, "filter", parse(Filter, "filter", self.filter))
        both = (self.wrap, self.wrap) if isinstance(self.wrap, str) else self.wrap
        if not isinstance(both, tuple | list) or len(both) != 2:
            raise ValueError(f"wrap must be one word, or two for u and v, got {self.wrap!r}")
        keep(self, "wrap", tuple(parse(Wrap, "wrap", one) for one in both))

    def __repr__(self) -> str:
        """One line: its size and how it is looked up."""
        height, width = self.image.shape[:2]
        wraps = list(dict.fromkeys(map(str, self.wrap)))
        return f"Texture({width}x{height}, filter={str(self.filter)!r}, wrap={'/'.join(wraps)!r})"

    @cached_property
    def engine(self) -> _engine.Mipmap:
        """What the kernels read; made when it is first needed."""
        levels = [light_of_image(self.image)[::-1]]  # row 0 of the kernels is v = 0
        while self.filter is Filter.TRILINEAR and max(levels[-1].shape[:2]) > 1:
            levels.append(halved(levels[-1]))
        offset, rows, texels = 0, [], []
        for level in levels:
            height, width = level.shape[:2]
            rows.append((offset, width, height))
            offset += height * (width + 1)
            padded = np.concatenate([level, level[:, :1]], axis=1)
            texels.append(np.rint(65535 * padded).astype(np.uint16).reshape(-1, 4))
        texels.append(np.zeros((1, 4), np.uint16))  # pairs may be read one texel past the end
        wrap_u, wrap_v = (WRAP_CODES[Wrap(one)] for one in self.wrap)
        table = np.array(rows, dtype=np.int32)
        return _engine.Mipmap(np.concatenate(texels), table, FILTER_CODES[Filter(self.filter)], wrap_u, wrap_v)

    def __getstate__(self) -> dict[str, Any]:
        """What another process needs: the texels are made there."""
        return {name: self.__dict__[name] for name in ("image", "filter", "wrap")}


def as_image(name: str, pixels: npt.ArrayLike) -> U8:
    """The picture as its own read-only (H, W, 4) uint8.

    Raises
    ------
    TypeError
        If the pixels are no uint8.
    ValueError
        If it has another shape, no pixels, or a side of more than 32768.
    """
    array = as_array(name, pixels)
    if array.dtype != np.uint8:
        if array.dtype.kind not in "iu" or (array.size and not (0 <= array.min() and array.max() <= 255)):
            raise TypeError(f"{name} must be uint8, got {array.dtype}")
        array = array.astype(np.uint8)
    if array.ndim not in (2, 3) or array.shape[2:] not in ((), (3,), (4,)):
        raise ValueError(f"{name} must have shape (H, W), (H, W, 3) or (H, W, 4), got {array.shape}")
    if not 0 < min(array.shape[:2]) <= max(array.shape[:2]) <= MAX_TEXTURE_SIZE:
        raise ValueError(f"{name} must have 1 to {MAX_TEXTURE_SIZE} pixels a side, got shape {array.shape}")
    rgba = np.full((*array.shape[:2], 4), 255, np.uint8)
    rgba[..., : array.shape[2] if array.ndim == 3 else 3] = array if array.ndim == 3 else array[..., None]
    rgba.flags.writeable = False
    return rgba


def light_of_image(rgba: U8) -> F64:
    """Linear light and opacity (H, W, 4) float64, 0 to 1, of an sRGB picture."""
    light = np.empty(rgba.shape)
    light[..., :3] = LIGHT_OF_SRGB[rgba[..., :3]]
    light[..., 3] = rgba[..., 3] / 255
    return light


def halved(level: F64) -> F64:
    """The next halving (max(1, H // 2), max(1, W // 2), 4): each texel the mean over its area."""
    for axis in range(2):
        n = level.shape[axis]
        if n % 2 == 0:
            even, odd = (level.take(range(first, n, 2), axis) for first in (0, 1))
            level = (even + odd) / 2
        elif n > 1:
            level = mean_over_area(level, n // 2, axis)
    return level


def mean_over_area(level: F64, m: int, axis: int) -> F64:
    """The m means of equal parts of an axis."""
    n = level.shape[axis]
    sums = np.cumsum(np.insert(level, 0, 0, axis=axis), axis=axis)  # the area up to each border
    border = np.arange(m + 1) * n / m
    below = np.minimum(border.astype(int), n - 1)
    share = np.expand_dims(border - below, tuple(k for k in range(level.ndim) if k != axis))
    area = sums.take(below, axis) + share * level.take(below, axis)
    return np.diff(area, axis=axis) * (m / n)
