"""Textures: pictures of linear light and their halves, made once from an sRGB picture.

Input: uint8 pixels. Output: the kernels' inputs.

Based on: Williams, L., "Pyramidal Parametrics", SIGGRAPH 1983; Castano, I., "Computing Alpha Mipmaps", 2010.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, U8, U16
from topleft._core.base.arrays import as_array, set_read_only
from topleft._core.base.cached import cached_property
from topleft._core.base.color import LIGHT_OF_SRGB
from topleft._core.base.options import parse
from topleft._core.base.texels import (
    FILTER_CODES,
    HALVING,
    MOST_KEPT_BYTES,
    WRAP_CODES,
    ValueLevels,
    as_light,
    levels_of,
)
from topleft.typing import EncodingOption, FilterOption, WrapOption

MAX_TEXTURE_SIZE = 1 << 15
"""Texels of a side: 16 levels."""


LIGHT_OF_BYTE = {"srgb": LIGHT_OF_SRGB.astype(np.float64), "linear": np.arange(256) / 255}
N_COVERAGE_POINTS = 1 << 12
"""Points at which the share of a texture that an alpha test lets through is counted; a thousandth of them may miss."""

LEAST_SCALE, MOST_SCALE = 1 / 16, 256.0
"""Factors of the opacity of a halving; by the most every texel that is not clear is opaque."""

BLOCK_TEXELS = 1 << 22
"""Texels that a call of the kernel reads; Ctrl-C is heard between two calls."""


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture to be laid on a mesh by its `uv`.

    Parameters
    ----------
    image : (H, W), (H, W, 3) or (H, W, 4) array_like of uint8
        sRGB, and opacity; row 0 is the top, where v = 1. Copied.
    filter : {"trilinear", "bilinear", "nearest", "pixelated"}
        "trilinear": between the texels and between the two halvings next to the size of the pixel's footprint.
        "bilinear": between the four texels next to the point. "nearest": the texel that the point lies in.
        "pixelated": "nearest" where texels are larger than a pixel, "trilinear" where they are smaller.
    wrap : {"repeat", "clamp", "mirror"}, or a pair of them for u and v
        The continuation beyond 0 and 1.
    encoding : {"srgb", "linear"}
        "srgb": red, green and blue are colours. "linear": they are numbers, 0 to 255 for 0 to 1, as in normal maps.
    uv_set : {0, 1}
        Laid on by `uv` or by `uv1` of the mesh.
    transform : (2, 3) array_like of float, optional
        Takes (u, v, 1) of the mesh to where the texture is looked up.

    Raises
    ------
    TypeError
        If the pixels are no uint8.
    ValueError
        If the picture has another shape, no pixels, or a side of more than 32768, or an option is unknown.

    Notes
    -----
    Texels are kept as linear light in 65535ths, so filters and halvings take the mean of light. A halving is the mean
    over the area of its texels, also where a side is odd. Under a material with an `alpha_cutoff` the opacity of a
    halving is scaled, so that as much of its area shows as of the picture: leaves and wires stay in small pictures.

    Examples
    --------
    >>> Texture([[0, 255]]).filter
    'trilinear'
    """

    image: U8
    filter: str = "trilinear"
    wrap: str | tuple[str, str] = "repeat"
    encoding: str = "srgb"
    uv_set: int = 0
    transform: F64 | None = None

    if TYPE_CHECKING:  # anything that NumPy reads may be given; the types above are kept

        def __init__(
            self,
            image: npt.ArrayLike,
            filter: FilterOption = "trilinear",  # noqa: A002
            wrap: WrapOption | tuple[WrapOption, WrapOption] = "repeat",
            encoding: EncodingOption = "srgb",
            uv_set: int = 0,
            transform: npt.ArrayLike | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        keep = object.__setattr__  # the dataclass is frozen, and its values are coerced
        keep(self, "image", as_image("image", self.image))
        keep(self, "filter", parse(FilterOption, "filter", self.filter))
        both = (self.wrap, self.wrap) if isinstance(self.wrap, str) else self.wrap
        if not isinstance(both, tuple | list) or len(both) != 2:
            raise ValueError(f"wrap must be one word, or two for u and v, got {self.wrap!r}")
        keep(self, "wrap", tuple(parse(WrapOption, "wrap", one) for one in both))
        keep(self, "encoding", parse(EncodingOption, "encoding", self.encoding))
        if self.uv_set not in (0, 1):
            raise ValueError(f"uv_set must be 0 or 1, got {self.uv_set!r}")
        if self.transform is not None:
            matrix = as_array("transform", self.transform).astype(np.float64)
            if matrix.shape != (2, 3) or not np.isfinite(matrix).all():
                raise ValueError(f"transform must be (2, 3) finite numbers, got shape {matrix.shape}")
            matrix.flags.writeable = False
            keep(self, "transform", matrix)

    def __repr__(self) -> str:
        """One line: its size and how it is looked up."""
        height, width = self.image.shape[:2]
        wraps = list(dict.fromkeys(map(str, self.wrap)))
        return f"Texture({width}x{height}, filter={str(self.filter)!r}, wrap={'/'.join(wraps)!r})"

    @cached_property
    def compiled(self) -> engine.Mipmap:
        """The kernels' input; made when it is first needed."""
        return self._mipmap(None)

    def compiled_cut_at(self, cutoff: float) -> engine.Mipmap:
        """The kernels' input for an alpha test: its halvings let through as much of their area as the picture does."""
        if not self.has_alpha or self.filter not in HALVING or not 0 < cutoff <= 1:
            return self.compiled
        cut: dict[float, engine.Mipmap] = self.__dict__.setdefault("_cut", {})
        if cutoff not in cut:
            cut[cutoff] = self._mipmap(cutoff)
        return cut[cutoff]

    def _mipmap(self, cutoff: float | None) -> engine.Mipmap:
        height, width = self.image.shape[:2]
        rows = level_rows(width, height, has_halves=self.filter in HALVING)
        texels = texels_of(self.image, rows, light=LIGHT_OF_BYTE[self.encoding])
        if cutoff is not None:
            keep_coverage(texels, rows, 65535 * cutoff, self.wrap)
        wrap_u, wrap_v = (WRAP_CODES[one] for one in self.wrap)
        filter_code = FILTER_CODES[self.filter]
        table = np.array(rows, dtype=np.int32)
        if self.transform is None:
            return engine.Mipmap(texels, table, filter_code, wrap_u, wrap_v, self.uv_set)
        (a, b, _), (c, d, _) = rows_of_transform = self.transform.tolist()
        hand = -1.0 if a * d < b * c else 1.0
        return engine.Mipmap(
            texels, table, filter_code, wrap_u, wrap_v, self.uv_set, rows_of_transform, (d * hand, -c * hand), hand
        )

    def value_levels(self) -> ValueLevels:
        """Light and opacity as float32, and their halvings; made when they are first needed, and kept unless large."""
        found: ValueLevels | None = self.__dict__.get("_value_levels")
        if found is None:
            wrap_u, wrap_v = map(str, self.wrap)
            found = levels_of(as_light(self.image, self.encoding), self.filter, (wrap_u, wrap_v))
            if found.texels.nbytes <= MOST_KEPT_BYTES:
                self.__dict__["_value_levels"] = found
        return found

    @cached_property
    def has_alpha(self) -> bool:
        """Whether some of it is not opaque."""
        return int(self.image[..., 3].min()) < 255

    def __getstate__(self) -> dict[str, Any]:
        """The state for another process, which makes the texels itself."""
        return {field.name: self.__dict__[field.name] for field in fields(self)}

    __setstate__ = set_read_only


def as_image(name: str, pixels: npt.ArrayLike) -> U8:
    """The picture as its own read-only (H, W, 4) uint8."""
    array = as_array(name, pixels)
    if array.dtype != np.uint8:
        if array.dtype.kind not in "iu" or (array.size and not (0 <= array.min() and array.max() <= 255)):
            raise TypeError(f"{name} must be uint8, got {array.dtype}")
        array = array.astype(np.uint8)
    if array.ndim not in (2, 3) or array.shape[2:] not in ((), (3,), (4,)):
        raise ValueError(f"{name} must have shape (H, W), (H, W, 3) or (H, W, 4), got {array.shape}")
    if not 0 < min(array.shape[:2]) <= max(array.shape[:2]) <= MAX_TEXTURE_SIZE:
        raise ValueError(f"{name} must have 1 to {MAX_TEXTURE_SIZE} pixels a side, got shape {array.shape}")
    if array.shape[2:] == (4,):
        rgba = array.copy()
    else:
        rgba = np.empty((*array.shape[:2], 4), np.uint8)
        rgba[..., 3] = 255
        for k in range(3):  # a quarter of the time of a copy of the three at once
            rgba[..., k] = array[..., k] if array.ndim == 3 else array
    rgba.flags.writeable = False
    return rgba


def level_rows(width: int, height: int, *, has_halves: bool) -> list[tuple[int, int, int]]:
    """A row (offset in texels, width, height) of each level; behind each row of texels stands its first one again."""
    rows = [(0, width, height)]
    while has_halves and max(width, height) > 1:
        offset, width, height = rows[-1]
        offset, width, height = offset + height * (width + 1), max(1, width // 2), max(1, height // 2)
        rows.append((offset, width, height))
    return rows


def texels_of(image: U8, rows: list[tuple[int, int, int]], *, light: F64) -> U16:
    """The texels (N, 4) of all levels in 65535ths, row 0 at v = 0; `light` is that of each value of a byte.

    A few rows at a time go through all levels, so that nothing but the texels themselves is large.
    """
    (_, width, height), (offset, last_width, last_height) = rows[0], rows[-1]
    n_texels = offset + last_height * (last_width + 1) + 1  # pairs may be read one texel past the end
    texels, n_written = np.zeros((n_texels, 4), np.uint16), np.zeros(len(rows), np.int64)
    tables, room = np.stack([light, np.arange(256) / 255]), np.zeros(8 * sum(width for _, width, _ in rows))
    n = max(1, BLOCK_TEXELS // width)
    for first in range(0, height, n):
        end = min(first + n, height)
        engine.write_levels(image, tables, np.array(rows, np.int32), first, end, n_written, room, texels)
    return texels


def keep_coverage(texels: U16, rows: list[tuple[int, int, int]], cutoff: float, wrap: str | tuple[str, str]) -> None:
    """Scale the opacity of each halving so that a cutoff lets through as much of its area as of the picture, in place.

    The mean of opacity does not: thin parts fall below the cutoff, and small holes are filled.
    """
    wanted = None
    for offset, width, height in rows:
        level = texels[offset : offset + height * (width + 1), 3].reshape(height, width + 1)
        around = around_points(level[:, :-1], wrap)
        scale, n_shown = 1.0, n_above(around, 1, cutoff)
        if wanted is None:
            wanted = n_shown
        best, least_miss = scale, abs(n_shown - wanted)
        low, high = LEAST_SCALE, MOST_SCALE
        while least_miss > N_COVERAGE_POINTS >> 10 and high > low * (1 + 2**-12):
            scale = math.sqrt(low * high)
            n_shown = n_above(around, scale, cutoff)
            low, high = (low, scale) if n_shown >= wanted else (scale, high)
            if abs(n_shown - wanted) < least_miss:
                best, least_miss = scale, abs(n_shown - wanted)
        if best != 1:
            np.rint(np.minimum(level * best, 65535), out=level, casting="unsafe")


def n_above(around: tuple[F64, F64], scale: float, cutoff: float) -> int:
    """At how many points the opacity is at least the cutoff when texels are scaled and end at 1."""
    corners, weights = around
    between = (np.minimum(corners * scale, 65535) * weights).sum(axis=0)
    return int(np.count_nonzero(between > cutoff - 0.5))


def around_points(level: U16, wrap: str | tuple[str, str]) -> tuple[F64, F64]:
    """The four texels (4, N) around each of points that are spread evenly over a level, and their weights.

    Based on: Roberts, M., "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
    """
    number = np.arange(N_COVERAGE_POINTS)
    pairs, shares = [], []
    for n, step, how in zip(level.shape, (0.7548776662466927, 0.5698402909980532), wrap[::-1], strict=True):
        place = (0.5 + number * step) % 1 * n - 0.5
        first = np.floor(place)
        pair = np.stack([first, first + 1]).astype(np.intp)
        pairs.append(pair % n if how == "repeat" else pair.clip(0, n - 1))
        shares.append(np.stack([1 - (place - first), place - first]))
    (rows, columns), (down, right) = pairs, shares
    corners = level[rows[:, None], columns].astype(np.float64)
    return corners.reshape(4, -1), (down[:, None] * right).reshape(4, -1)
