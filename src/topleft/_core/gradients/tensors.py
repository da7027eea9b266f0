"""Tensors of a visibility buffer: attributes and textures of its pixels, smooth silhouettes; and backward.

Arrays are contiguous, float32 or float64, all of a call the same; the caller checks shapes. B pictures; an array
of vertices, attributes or texels may have one for all of them. A function with `_vjp` returns the products of a
gradient of the results with the Jacobian: gradients of the arguments, in their dtype.

Based on: Laine, S., Hellsten, J., Karras, T., Seol, Y., Lehtinen, J., Aila, T., "Modular Primitives for
High-Performance Differentiable Rendering", ACM Transactions on Graphics, 2020.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.arrays import INT32_MAX, shown
from topleft._core.base.cached import cached_property
from topleft._core.base.memory import empty
from topleft._core.base.threads import run_parts
from topleft._core.gradients.bands import Array, Band, Bands, Room, Sums
from topleft.typing import BoundaryOption, EdgesOption


class TexelFilter(IntEnum):
    """How a texture is looked up: `tl_texel_filter`."""

    NEAREST = 0
    LINEAR = 1
    LINEAR_MIPMAP_NEAREST = 2
    LINEAR_MIPMAP_LINEAR = 3


class TexelsBeyond(IntEnum):
    """The wrap mode of a texture: `tl_texel_edge`."""

    WRAP = 0
    CLAMP = 1
    ZERO = 2
    CUBE = 3


class EdgeRule(IntEnum):
    """Which rule makes silhouettes smooth: `tl_pair_rule`."""

    SILHOUETTE = 0
    AREA = 1
    STRAIGHT_THROUGH = 2


def as_rule(edges: object) -> EdgeRule:
    """Return the rule of a word."""
    if not isinstance(edges, str) or edges not in get_args(EdgesOption):
        raise ValueError(f"edges must be 'silhouette', 'area' or 'straight-through', got {shown(edges)}")
    return EdgeRule[edges.replace("-", "_").upper()]


@dataclass(frozen=True)
class PixelGrid:
    """Pictures (B, H, W) of triangles (T, 3), int32; vertices and attributes have fewer than `n_rows` rows."""

    tri: NDArray[np.int32]
    n_pictures: int
    height: int
    width: int
    threads: int | None = None
    in_pixels: bool = False
    """Whether x/w and y/w count pixels; otherwise they run from -1 to 1 across the picture, as z/w does."""

    def __post_init__(self) -> None:
        check_counted("tri", self.tri.shape)

    @cached_property
    def bands(self) -> Bands:
        """The bands of all pictures."""
        return Bands(self.n_pictures, self.height, self.width, self.threads)

    def view(self, pos: Array) -> engine.GradientView:
        """Return the engine's view of a picture with these vertices (V, 4)."""
        size = self.width, self.height
        whole = 1 / max(1, self.width), 1 / max(1, self.height)
        scale, shift = ((0.5, 0.5), (0.0, 0.0)) if self.in_pixels else (whole, (-1.0, -1.0))
        return engine.GradientView(pos, self.tri, size, scale, shift, np.inf if self.in_pixels else 1.0)

    def views(self, pos: Array) -> list[engine.GradientView]:
        """Return the views of all pictures that have pixels, of vertices (B or 1, V, 4)."""
        return [self.view(of(pos, i)) for i in range(self.n_pictures if self.width and self.height else 0)]

    def shape(self, *columns: int) -> tuple[int, ...]:
        """Return the shape of a tensor of pixels."""
        return (self.n_pictures, self.height, self.width, *columns)

    def refuse(self, found: Sequence[int]) -> None:
        """Raise an error for the largest id that a band has met of a triangle that does not exist; -1: none."""
        bad = max(found, default=-1)
        if bad >= 0:
            raise IndexError(f"rast must hold ids of the {len(self.tri)} triangles of tri plus 1, got {bad + 1}")


def check_counted(name: str, shape: tuple[int, ...]) -> None:
    """Raise an error unless int32 counts the numbers of an array, as lanes do to find them."""
    if math.prod(shape) > INT32_MAX:
        raise ValueError(f"{name} must have at most {INT32_MAX} numbers a picture, got shape {shape}")


def of(arrays: Array, picture: int) -> Array:
    """Return the array of a picture, where there may be one for all."""
    return arrays[picture if len(arrays) > 1 else 0]


def points(
    grid: PixelGrid, pos: Array, ids: Sequence[tuple[NDArray[np.int32], int]], *, is_flipped: bool, with_db: bool
) -> tuple[Array, Array]:
    """Return `rast` (B, H, W, 4): weights of the first two corners, z/w and the id plus 1; and `rast_db`.

    `pos` (B or 1, V, 4). `ids`: of each picture (H, W), and the number added to them; row 0 is on top if they are
    flipped. `rast_db` (B, H, W, 4) is du/dX, du/dY, dv/dX, dv/dY, or has no columns.
    """
    rast, rast_db = empty(grid.shape(4), pos.dtype), empty(grid.shape(4 if with_db else 0), pos.dtype)
    views = grid.views(pos)

    def work(band: Band) -> None:
        i, (own, first) = band.picture, ids[band.picture]
        slopes = rast_db[i] if with_db else None
        views[i].points(own, is_flipped, first, rast[i], slopes, band.first, band.end)

    grid.bands.run(work)
    return rast, rast_db


def points_vjp(grid: PixelGrid, pos: Array, rast: Array, g_rast: Array, g_db: Array | None) -> Array:
    """Return the gradient of `pos`."""
    out, views = np.zeros(pos.shape, pos.dtype), grid.views(pos)
    room = Room(grid.bands.n_px, (Sums(pos.shape[1], 4, 3), Sums(len(grid.tri), engine.SUMS_OF_POINTS, 1)))

    def work(band: Band, sums: list[engine.GradientSums]) -> int:
        i = band.picture
        slopes = None if g_db is None else g_db[i]
        return views[i].points_vjp(rast[i], g_rast[i], slopes, sums[1], sums[0], band.first, band.end)

    grid.refuse(grid.bands.add_up(room, work, [(out,)]))
    return out


def values(
    grid: PixelGrid, attr: Array, rast: Array, rast_db: Array | None = None, wanted: Sequence[int] = ()
) -> tuple[Array, Array]:
    """Return attributes (B or 1, V, K) at pixels (B, H, W, K), and the slopes of those `wanted`, (B, H, W, 2 N)."""
    check_counted("attr", attr.shape[1:])
    out = empty(grid.shape(attr.shape[2]), attr.dtype)
    out_da = empty(grid.shape(2 * len(wanted)), attr.dtype)
    view, columns = grid.view(np.empty((0, 4), attr.dtype)), np.asarray(wanted, np.int32)

    def work(band: Band) -> int:
        i = band.picture
        slopes = (None, None) if rast_db is None else (rast_db[i], out_da[i])
        arrays = rast[i], slopes[0], out[i], slopes[1]
        return view.values(of(attr, i), columns, arrays, None, band.first, band.end)

    grid.refuse(grid.bands.run(work))
    return out, out_da


def values_vjp(
    grid: PixelGrid,
    attr: Array,
    rast: Array,
    g_out: Array,
    rast_db: Array | None = None,
    g_da: Array | None = None,
    wanted: Sequence[int] = (),
) -> tuple[Array, Array, Array | None]:
    """Return the gradients of `attr`, `rast` and `rast_db`, the last None without `g_da`."""
    check_counted("attr", attr.shape[1:])
    g_attr, g_rast = np.zeros(attr.shape, attr.dtype), empty(rast.shape, attr.dtype)
    g_db = None if g_da is None else empty(rast.shape, attr.dtype)
    view, columns = grid.view(np.empty((0, 4), attr.dtype)), np.asarray(wanted if g_da is not None else (), np.int32)

    def work(band: Band, sums: list[engine.GradientSums]) -> int:
        i = band.picture
        db, da, g = (None if one is None else one[i] for one in (rast_db, g_da, g_db))
        arrays = rast[i], db, g_out[i], da, g_rast[i], g
        return view.values(of(attr, i), columns, arrays, sums[0], band.first, band.end)

    grid.refuse(grid.bands.add_up(Room(grid.bands.n_px, (Sums(attr.shape[1], attr.shape[2], 3),)), work, [(g_attr,)]))
    return g_attr, g_rast, g_db


def check_texture(
    check: Callable[..., None], tex: Any, uv: Any, uv_da: Any, bias: Any, boundary_mode: str, more: Sequence[Any] = ()
) -> None:
    """Check how a texture (1 or B, ...) is looked up, and where: (B, H, W, ...).

    `check` is given a name, what goes by it, the shape wished for, whether it has that; and for `tex` also `more`.
    """
    if boundary_mode not in get_args(BoundaryOption):
        raise ValueError(f"boundary_mode must be 'wrap', 'clamp', 'zero' or 'cube', got {boundary_mode!r}")
    is_cube = boundary_mode == "cube"
    n_axes = 3 if is_cube else 2
    of_pixels, of_texels = (tuple(getattr(one, "shape", ())) for one in (uv, tex))
    check("uv", uv, f"(B, H, W, {n_axes})", len(of_pixels) == 4 and of_pixels[3] == n_axes)
    n, one = of_pixels[0], "6, N, N, C" if is_cube else "Ht, Wt, C"
    fits = len(of_texels) == n_axes + 2 and of_texels[0] in (1, n) and 0 not in of_texels[1:]
    if is_cube:
        fits = fits and of_texels[1] == 6 and of_texels[2] == of_texels[3]
    check("tex", tex, f"(1, {one}) or ({n}, {one})" + " with boundary_mode 'cube'" * is_cube, fits, *more)
    of_pixels = of_pixels[:3]
    for name, given, shape in (("uv_da", uv_da, (*of_pixels, 2 * n_axes)), ("mip_level_bias", bias, of_pixels)):
        if given is not None:
            check(name, given, str(shape), tuple(getattr(given, "shape", ())) == shape)


def as_filter(filter_mode: object, words: Sequence[str], *, has_level: bool) -> TexelFilter:
    """Return the filter of one of some words; a mipmap needs to know the level."""
    if filter_mode not in words:
        raise ValueError(
            f"filter_mode must be {', '.join(map(repr, words[:-1]))} or {words[-1]!r}, got {shown(filter_mode)}"
        )
    found = TexelFilter[str(filter_mode).replace("-", "_").upper()]
    if found > TexelFilter.LINEAR and not has_level:
        raise ValueError(f"filter_mode={filter_mode!r} needs uv_da or mip_level_bias")
    return found


@dataclass(frozen=True)
class TexelLook:
    """How a texture is looked up, and where: levels (B or 1, ...); uv (B, H, W, 2 or 3), footprints, biases."""

    levels: Sequence[Array]
    filter: TexelFilter
    beyond: TexelsBeyond
    uv: Array
    uv_da: Array | None = None
    bias: Array | None = None
    threads: int | None = None

    def of_picture(self, picture: int) -> list[Array]:
        """Return the levels of a picture as the engine takes them, (1 or 6, H, W, C)."""
        one = [of(level, picture) for level in self.levels]
        return one if self.beyond is TexelsBeyond.CUBE else [level[None] for level in one]

    @property
    def grid(self) -> PixelGrid:
        """The pixels that look."""
        b, h, w = self.uv.shape[:3]
        return PixelGrid(np.empty((0, 3), np.int32), b, h, w, self.threads)

    def arrays(self, picture: int, *more: Array | None) -> tuple[Array | None, ...]:
        """Return a picture as the engine takes it."""
        return tuple(None if one is None else one[picture] for one in (self.uv, self.uv_da, self.bias, *more))


def halved_axes(shape: Sequence[int], max_mip_level: int | None) -> list[list[int]]:
    """Return the axes that each coarser level of a mipmap halves, from the end: -3 and -2 of (.., height, width, C).

    Raises
    ------
    ValueError
        If a side of a level is odd and not 1, or the last level is below 0.
    """
    if max_mip_level is not None and max_mip_level < 0:
        raise ValueError(f"max_mip_level must be at least 0, got {max_mip_level}")
    sides = {axis: shape[axis] for axis in (-3, -2)}
    levels: list[list[int]] = []
    while max(sides.values()) > 1 and (max_mip_level is None or len(levels) < max_mip_level):
        axes = [axis for axis, n in sides.items() if n > 1]
        if any(sides[axis] % 2 for axis in axes):
            raise ValueError(
                f"tex must have sides that halve down to level {len(levels) + 1}, got {tuple(shape[-3:-1])}; "
                f"max_mip_level={len(levels)} stops before"
            )
        sides |= {axis: sides[axis] // 2 for axis in axes}
        levels.append(axes)
    return levels


def texels(look: TexelLook) -> Array:
    """Return a texture at each pixel, (B, H, W, C)."""
    grid, dtype = look.grid, look.uv.dtype
    out = empty(grid.shape(look.levels[0].shape[-1]), dtype)
    view, codes = grid.view(np.empty((0, 4), dtype)), (int(look.filter), int(look.beyond))

    def work(band: Band) -> None:
        i = band.picture
        view.texels(look.of_picture(i), codes, look.arrays(i, out), band.first, band.end)

    grid.bands.run(work)
    return out


def texels_vjp(
    look: TexelLook, g_out: Array, *, of_levels: bool = True, of_places: bool = True
) -> tuple[list[Array], Array | None, Array | None, Array | None]:
    """Return the gradients of the levels, of uv, of the footprints and of the biases.

    Without `of_levels` the first list is empty; without `of_places` the others are None.
    """
    grid, dtype = look.grid, look.uv.dtype
    view, codes = grid.view(np.empty((0, 4), dtype)), (int(look.filter), int(look.beyond))
    n_channels, n_pictures = g_out.shape[3], len(look.levels[0])
    ends = np.cumsum([math.prod(level.shape[1:-1]) for level in look.levels])
    places = (look.uv, look.uv_da, look.bias) if of_places else (None,) * 3
    g_uv, g_da, g_bias = (None if one is None else empty(one.shape, dtype) for one in places)

    g_texels = np.zeros((n_pictures, ends[-1] if of_levels else 0, n_channels), dtype)

    per_px = 8 if look.filter is TexelFilter.LINEAR_MIPMAP_LINEAR else 4
    of_texels = Sums(g_texels.shape[1], -(-n_channels // 4) * 4, per_px)

    def work(band: Band, sums: list[engine.GradientSums]) -> None:
        i = band.picture
        arrays = look.arrays(i, g_out, g_uv, g_da, g_bias)
        view.texels_vjp(look.of_picture(i), codes, arrays, sums[0] if sums else None, band.first, band.end)

    room = Room(grid.bands.n_px, (of_texels,) if of_levels else ())
    grid.bands.add_up(room, work, [(g_texels,)] if of_levels else [])
    parts = np.split(g_texels, ends[:-1], axis=1) if of_levels else []
    g_levels = [part.reshape(level.shape) for part, level in zip(parts, look.levels, strict=of_levels)]
    return g_levels, g_uv, g_da, g_bias


#: Triangles whose outline is worth a thread: 0.1 ms.
MIN_TRIANGLES_PER_PART = 10_000


@dataclass(frozen=True)
class Outline:
    """Silhouette edges in pictures, of `outline_of`: `across` (T, 3), `places` (B or 1, V, 2), `edges` (B or 1, T)."""

    across: NDArray[np.int32]
    places: NDArray[np.float64]
    edges: NDArray[np.int32]

    def of_picture(self, picture: int) -> tuple[Array, Array, Array]:
        """Return the outline's arrays for one picture."""
        return self.across, of(self.places, picture), of(self.edges, picture)


def outline_of(grid: PixelGrid, pos: Array, across: NDArray[np.int32]) -> Outline:
    """Return the silhouette edges of triangles and the places of vertices; `across` is that of `halves_across`."""
    n, n_threads = len(pos), grid.bands.threads
    places, edges = empty((*pos.shape[:2], 2), np.float64), empty((n, len(grid.tri)), np.int32)
    sides, views = empty(edges.shape, np.int32), [grid.view(one) for one in pos]
    n_parts = max(1, min(n_threads, len(grid.tri) // MIN_TRIANGLES_PER_PART))

    for has_sides in (False, True) if n else ():

        def write(i: int, _: int, *, has_sides: bool = has_sides) -> None:
            k, part = divmod(i, n_parts)
            views[k].outline((across, places[k], edges[k]), sides[k], has_sides, part, n_parts)

        run_parts(write, n * n_parts, n * n_parts, n_threads)
    return Outline(across, places, edges)


def scratch_of(width: int) -> tuple[tuple[int, int], type[np.int32]]:
    """Return shape and dtype of the ids of rows that the search for edges works on."""
    return (3, width + engine.IDS_ROOM), np.int32


def smooth(grid: PixelGrid, rule: EdgeRule, outline: Outline, pos: Array, rast: Array, color: Array) -> Array:
    """Return colours (B, H, W, C) with smooth silhouettes."""
    out, views = empty(color.shape, color.dtype), grid.views(pos)

    def work(band: Band) -> None:
        i, scratch = band.picture, empty(*scratch_of(grid.width))
        arrays = rast[i], color[i], out[i]
        views[i].edges(outline.of_picture(i), scratch, int(rule), arrays, None, band.first, band.end)

    grid.bands.run(work)
    return out


def smooth_vjp(
    grid: PixelGrid, rule: EdgeRule, outline: Outline, pos: Array, rast: Array, color: Array, g_out: Array
) -> tuple[Array, Array]:
    """Return the gradients of the colours and of `pos`."""
    g_color, g_pos = empty(color.shape, color.dtype), np.zeros(pos.shape, pos.dtype)
    views, room = grid.views(pos), Room(grid.bands.n_px, (Sums(pos.shape[1], 4, 6),), (scratch_of(grid.width),))

    def work(band: Band, made: list[Any]) -> None:
        i, (sums, scratch) = band.picture, made
        arrays = rast[i], color[i], g_out[i], g_color[i]
        views[i].edges(outline.of_picture(i), scratch, int(rule), arrays, sums, band.first, band.end)

    grid.bands.add_up(room, work, [(g_pos,)])
    return g_color, g_pos


#: Triangles, and what lies across their edges, of the last calls.
known: deque[tuple[NDArray[np.int32], NDArray[np.int32]]] = deque(maxlen=4)


def halves_across(tri: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return what `find_halves_across` does, of the last meshes as it was found; it is not to be written to.

    Another thread may write to `tri` meanwhile: what is kept is of a copy.
    """
    for triangles, across in list(known):
        if triangles.shape == tri.shape and np.array_equal(triangles, tri):
            return across
    triangles = tri.copy()
    found = find_halves_across(triangles)
    known.append((triangles, found))
    return found


def find_halves_across(tri: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return for each edge 3 * the triangle across it + its opposite corner there, int32 (T, 3); -1: none.

    Column i is the edge opposite to corner i. Of three or more triangles at an edge each looks at the next; there, and
    where two triangles are wound differently, it is -2 less that.
    """
    start, end = tri[:, [1, 2, 0]].ravel(), tri[:, [2, 0, 1]].ravel()
    key = np.minimum(start, end).astype(np.int64) << 32 | np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    starts = start[order]
    is_last = np.ones(len(key), np.bool_)  # of the half-edges at an edge
    is_last[:-1] = np.diff(key[order]) != 0
    is_first = np.roll(is_last, 1)
    following = np.roll(order, -1)
    following[is_last] = order[is_first]
    is_odd = starts == start[following]
    if (is_middle := ~(is_first | is_last)).any():
        edge = np.cumsum(is_first) - 1
        is_odd |= np.bincount(edge[is_middle], minlength=len(key))[edge] > 0
    found = np.empty(len(key), np.int32)
    found[order] = np.where(is_odd, -2 - following, following)
    found[order[is_first & is_last]] = -1
    return found.reshape(tri.shape)
