"""The exact reference for blending: a colour over a pixel, in fractions, or in float32 step by step.

In: the old pixel, a colour, a mode, and how much of the pixel the colour covers.  Out: the new pixel.

Based on: T. Porter, T. Duff, Compositing Digital Images, 1984.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from math import floor
from typing import Any

import numpy as np

from topleft.methods.reference import Point, fragments

ONE = np.float32(1)


def nearest(value: Fraction) -> int:
    """Return the nearest integer, ties upwards."""
    return floor(value + Fraction(1, 2))


_NEW_UINT8: dict[str, Callable[[int, int], int]] = {
    "replace": lambda _, s: s,
    "add": lambda d, s: min(255, d + s),
    "multiply": lambda d, s: nearest(Fraction(d * s, 255)),
    "max": max,
    "min": min,
}
_NEW_FLOAT32: dict[str, Callable[[np.float32, np.float32], np.float32]] = {
    "replace": lambda _, s: s,
    "add": lambda d, s: d + s,
    "multiply": lambda d, s: d * s,
    "max": lambda d, s: s if d < s else d,
    "min": lambda d, s: s if s < d else d,
}


def blend_uint8(old: Sequence[int], color: Sequence[int], mode: str, alpha: str, coverage: Fraction) -> list[int]:
    """Return the channels of a uint8 pixel after a colour has covered a part of it, a multiple of 2**-24.

    Examples
    --------
    >>> blend_uint8([10, 20, 30, 255], [200, 100, 0, 128], "over", "straight", Fraction(1))
    [105, 60, 15, 255]
    """
    if coverage == 0:
        return list(old)
    share = Fraction(nearest(coverage * 2**15), 2**15)
    has_alpha = len(old) in (2, 4)
    if mode in ("over", "replace") and has_alpha and alpha == "straight":
        weight = _alpha_uint8(color[-1], coverage, share)
        return _weigh_uint8(old, color, 1 if coverage == 1 else share, weight, is_over=mode == "over")
    if mode == "over":
        loss = _alpha_uint8(color[-1], coverage, share)
        return [min(255, nearest(d + s * share - d * loss)) for d, s in zip(old, color, strict=True)]
    new = _NEW_UINT8[mode]
    return [nearest(d + (new(d, s) - d) * share) for d, s in zip(old, color, strict=True)]


def _alpha_uint8(alpha: int, coverage: Fraction, share: Fraction) -> Fraction:
    """Return the alpha of a colour in a pixel: unchanged in a whole pixel, else a multiple of 2**-15."""
    return Fraction(alpha, 255) if coverage == 1 else Fraction(nearest(share * 2**15 * alpha / 255), 2**15)


def _weigh_uint8(
    old: Sequence[int], color: Sequence[int], share: Fraction | int, above: Fraction, *, is_over: bool
) -> list[int]:
    """Return old and new colour in proportion to their coverage, and the sum of both as alpha."""
    if share == 1 and not is_over:
        return list(color)
    if old[-1] == 255 and (is_over or color[-1] == 255):
        return [nearest(d + (s - d) * above) for d, s in zip([*old[:-1], 255], [*color[:-1], 255], strict=True)]
    below = Fraction(old[-1], 255) * (1 - (above if is_over else share))
    if above + below == 0:
        return list(old)
    mixed = [round((s * above + d * below) / (above + below)) for d, s in zip(old[:-1], color[:-1], strict=True)]
    return [*mixed, round(255 * (above + below))]


def blend_float32(
    old: Sequence[np.float32], color: Sequence[np.float32], mode: str, alpha: str, coverage: np.float32
) -> list[np.float32]:
    """Return the channels of a float32 pixel; each operation rounds once, in the order written."""
    c = coverage
    if c == 0:
        return list(old)
    if mode in ("over", "replace") and len(old) in (2, 4) and alpha == "straight":
        above = color[-1] * c
        below = old[-1] * (ONE - (above if mode == "over" else c))
        total = above + below
        if mode == "replace" and c == 1:
            return list(color)
        if total == 0:
            return [*old[:-1], total]
        return [*((s * above + d * below) / total for d, s in zip(old[:-1], color[:-1], strict=True)), total]
    if mode == "over":
        return [s * c + d * (ONE - color[-1] * c) for d, s in zip(old, color, strict=True)]
    new = _NEW_FLOAT32[mode]
    return [new(d, s) * c + d * (ONE - c) for d, s in zip(old, color, strict=True)]


def blend(
    vertices: Any, triangles: Any, colors: Any, size: Point, *, per: str, mode: str, alpha: str = "straight",
    background: Any = 0, coverages: Any = None, **view: Any,
) -> np.ndarray:  # fmt: skip
    """Return the picture of triangles blended in their order, shape (H, W, C), of the colours' dtype.

    ``coverages`` (T, H, W) are the areas of each triangle, for flat colours; without them the samples of `fragments`
    are covered whole. Colours of vertices are linear on the screen and must be uint8, rounded to nearest, ties to even.
    """
    colors, triangles = np.asarray(colors), np.asarray(triangles)
    is_u8 = colors.dtype == np.uint8
    picture = np.empty((size[1], size[0], colors.shape[1]), colors.dtype)
    picture[...] = background

    def put(pixel: Point, color: Any, coverage: Any) -> None:
        old = picture[pixel].tolist() if is_u8 else list(picture[pixel])
        if is_u8:
            picture[pixel] = blend_uint8(old, color, mode, alpha, Fraction(float(coverage)))
        else:
            picture[pixel] = blend_float32(old, color, mode, alpha, np.float32(coverage))

    if coverages is not None:
        for color, coverage in zip(colors, coverages, strict=True):
            for row, column in np.argwhere(coverage > 0).tolist():
                put((row, column), color.tolist() if is_u8 else list(color), coverage[row, column])
        return picture
    for fragment in fragments(vertices, triangles, size, **view):
        index = fragment.piece.triangle
        if per == "triangle":
            color = colors[index].tolist() if is_u8 else list(colors[index])
        else:
            weights, corners = fragment.screen_weights(), colors[triangles[index]].T.tolist()
            color = [round(sum(w * v for w, v in zip(weights, channel, strict=True))) for channel in corners]
        put((fragment.row, fragment.column), color, 1)
    return picture
