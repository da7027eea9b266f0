"""Looks up arrays at points: between their texels, and in halvings where texels are smaller than a pixel.

In: an array of values, points (u, v) and how they change from pixel to pixel. Out: values, float32.

Based on: Williams, L., "Pyramidal Parametrics", SIGGRAPH 1983; Heckbert, P. S., "Fundamentals of Texture Mapping and
Image Warping", 1989 (the footprint of a pixel from derivatives).
"""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from topleft._base.arrays import as_array
from topleft._base.color import decode_srgb
from topleft._base.options import check_choice
from topleft.typing import EncodingOption, FilterOption, WrapOption

__all__ = ["as_texels", "look_up"]

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Wraps = tuple[str, str]

POINTS_AT_ONCE = 1 << 16
"""Points that are looked up together: with four texels of four channels each they take 8 MB of float64."""


def as_texels(texture: object, filter: str, wrap: str | Wraps, encoding: str | None) -> tuple[F32, str, Wraps, bool]:  # noqa: A002
    """The values (H, W, C) of a texture, its filter and wraps, and whether it had no channels (H, W).

    Parameters
    ----------
    texture : Texture, or (H, W) or (H, W, C) array_like of real numbers
        A `Texture` tells filter, wrap and encoding itself.
    filter : {"trilinear", "bilinear", "nearest"}
    wrap : {"repeat", "clamp", "mirror"}, or a pair of them
    encoding : {"linear", "srgb"}, optional
        "srgb": the first three channels are decoded to light. Unsigned bytes become 0 to 1 either way.

    Raises
    ------
    TypeError
        If it holds no real numbers.
    ValueError
        If it has another shape or no texels, or an option is unknown.
    """
    if hasattr(texture, "image") and hasattr(texture, "filter") and hasattr(texture, "wrap"):
        filter, wrap = str(texture.filter), texture.wrap  # noqa: A001
        encoding, texture = str(getattr(texture, "encoding", "srgb")), texture.image
    encoding = "linear" if encoding is None else encoding
    check_choice("filter", filter, get_args(FilterOption))
    check_choice("encoding", encoding, get_args(EncodingOption))
    wraps = (wrap, wrap) if isinstance(wrap, str) else wrap
    if not isinstance(wraps, tuple | list) or len(wraps) != 2:
        raise ValueError(f"wrap must be one word, or two for u and v, got {wrap!r}")
    for one in wraps:
        check_choice("wrap", str(one), get_args(WrapOption))
    array = as_array("texture", texture)  # type: ignore[arg-type]
    if array.dtype.kind not in "fiub":
        raise TypeError(f"texture must be a Texture or real numbers, got dtype {array.dtype}")
    if array.ndim not in (2, 3) or not array.size:
        raise ValueError(f"texture must have shape (H, W) or (H, W, C), got {array.shape}")
    is_flat = array.ndim == 2
    values = array.reshape(*array.shape[:2], -1).astype(np.float32)
    if array.dtype == np.uint8:
        values /= 255
    if encoding == "srgb":
        values[..., :3] = decode_srgb(values[..., :3].astype(np.float64))
    return values, filter, (str(wraps[0]), str(wraps[1])), is_flat


def look_up(texels: F32, uv: F64, footprint: F64 | None, filter: str, wrap: Wraps) -> F32:  # noqa: A002
    """The values (P, C) float32 of texels (H, W, C) at points.

    Parameters
    ----------
    texels : (H, W, C) float32
        Row 0 is the top, where v = 1.
    uv : (P, 2) float64
    footprint : (P, 2, 2) float64, optional
        What u and v, the first axis, change by from pixel to pixel along x and y. None: texels are never smaller than
        a pixel.
    filter, wrap
        As `as_texels` returns them.
    """
    levels = [texels]
    while filter == "trilinear" and footprint is not None and max(levels[-1].shape[:2]) > 1:
        levels.append(halve(levels[-1]))
    height, width, n_channels = texels.shape
    out = np.empty((len(uv), n_channels), np.float32)
    for first in range(0, len(uv), POINTS_AT_ONCE):
        part = slice(first, first + POINTS_AT_ONCE)
        if len(levels) == 1:
            out[part] = between(texels, uv[part], wrap, is_nearest=filter == "nearest")
            continue
        sides = np.square(footprint[part] * np.array([[width], [height]])).sum(axis=1)  # type: ignore[index]
        with np.errstate(divide="ignore"):
            lod = np.clip(0.5 * np.log2(sides.max(axis=1)), 0, len(levels) - 1)
        fine = np.floor(lod).astype(np.intp)
        share = (lod - fine)[:, None]
        own = np.zeros((len(lod), n_channels))
        for k, level in enumerate(levels):
            weight = np.where(fine == k, 1 - share[:, 0], np.where(fine == k - 1, share[:, 0], 0.0))
            used = np.flatnonzero(weight)
            if used.size:
                own[used] += weight[used, None] * between(level, uv[part][used], wrap, is_nearest=False)
        out[part] = own
    return out


def between(texels: F32, uv: F64, wrap: Wraps, *, is_nearest: bool) -> F64:
    """The values (P, C) of one level: of the texel that a point lies in, or between the four next to it."""
    height, width = texels.shape[:2]
    x, y = uv[:, 0] * width, (1 - uv[:, 1]) * height
    if is_nearest:
        return texels[wrapped(np.floor(y), height, wrap[1]), wrapped(np.floor(x), width, wrap[0])].astype(np.float64)
    left, top = np.floor(x - 0.5), np.floor(y - 0.5)
    share_x, share_y = (x - 0.5 - left)[:, None], (y - 0.5 - top)[:, None]
    columns = [wrapped(left + k, width, wrap[0]) for k in range(2)]
    rows = [wrapped(top + k, height, wrap[1]) for k in range(2)]
    upper, lower = (texels[row, columns[0]] * (1 - share_x) + texels[row, columns[1]] * share_x for row in rows)
    mixed: F64 = upper * (1 - share_y) + lower * share_y
    return mixed


def wrapped(index: F64, n: int, wrap: str) -> NDArray[np.intp]:
    """Which texel of n an index beyond them means; that of a point that is nowhere is 0."""
    finite = np.where(np.isfinite(index), index, 0.0)
    if wrap == "clamp":
        return np.clip(finite, 0, n - 1).astype(np.intp)
    if wrap == "repeat":
        return np.mod(finite, n).astype(np.intp)
    turned = np.mod(finite, 2 * n)
    return np.minimum(turned, 2 * n - 1 - turned).astype(np.intp)


def halve(level: F32) -> F32:
    """The next halving (max(1, H // 2), max(1, W // 2), C): each texel the mean over its area."""
    values: NDArray[Any] = level.astype(np.float64)
    for axis in range(2):
        n = values.shape[axis]
        if n % 2 == 0:
            values = (values.take(range(0, n, 2), axis) + values.take(range(1, n, 2), axis)) / 2
        elif n > 1:
            m = n // 2
            sums = np.cumsum(np.insert(values, 0, 0, axis=axis), axis=axis)  # the area up to each border
            border = np.arange(m + 1) * n / m
            below = np.minimum(border.astype(int), n - 1)
            share = np.expand_dims(border - below, tuple(k for k in range(3) if k != axis))
            area = sums.take(below, axis) + share * values.take(below, axis)
            values = np.diff(area, axis=axis) * (m / n)
    return values.astype(np.float32)
