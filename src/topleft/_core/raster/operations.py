"""The operations of tensors, with backward: `topleft.torch` and `topleft.jax` make each a function of their arrays.

Arrays are contiguous, those of floats of a call all float32 or all float64; the caller has checked their shapes. Names
and shapes are those of `topleft.torch`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core.base.arrays import as_checked_triangles
from topleft._core.gradients import tensors
from topleft._core.gradients.bands import MIN_PX_PER_THREAD, Array
from topleft._core.gradients.pictures import AttributePictures
from topleft._core.gradients.tensors import EdgeRule, Outline, PixelGrid, TexelFilter, TexelLook, TexelsBeyond
from topleft._core.raster.verbs import rasterize as draw

#: Shapes and dtypes of results: the dtype of one of the arrays, or its name.
Shapes = Sequence[tuple[tuple[int, ...], Any]]


class Call(NamedTuple):
    """Numbers of a call: its options, how many threads it may use, and backward which gradients are wanted."""

    options: Sequence[int]
    threads: int
    needs: Sequence[bool] = ()

    def threads_of(self, n_px: int) -> int:
        """Return how many threads are worth so many pixels."""
        return max(1, min(self.threads, n_px // MIN_PX_PER_THREAD))

    def grid_of(self, tri: Array, shape: Sequence[int], n_rows: int) -> PixelGrid:
        """Return the pictures (B, H, W) of triangles whose vertices are checked to exist."""
        b, h, w = shape
        return PixelGrid(as_checked_triangles(tri, n_rows), b, h, w, self.threads_of(b * h * w))


class Operation(NamedTuple):
    """A function of arrays, and backward.

    "?" after a name of `given`: it may be None; "*" after the last one: a list. `run(call, *given)` returns arrays of
    the `shapes` that belong to the options and to what is given; the first `n_out` of `results` are given out.
    `vjp(call, *kept, *gradients of these)` returns the gradients of what `gradients` names, None for those not wanted;
    of a list one for each. It takes None for a result that was not kept, and for a gradient of zeros.
    """

    name: str
    given: str
    results: str
    gradients: str
    kept: str
    shapes: Callable[..., Shapes]
    run: Callable[..., Sequence[Array]]
    vjp: Callable[..., Sequence[Array | None]]
    n_out: int = 1


def draw_points(call: Call, pos: Array, tri: Array, ranges: Array | None, ids: Array | None) -> tuple[Array, Array]:
    """Return `rast` and `rast_db` of what is drawn, or of ids (B, H, W) within each range; row 0 of ids is on top."""
    height, width, with_db, threads = call.options
    vertices = pos if pos.ndim == 3 else pos[None]
    n = len(vertices if ranges is None else ranges)
    grid = call.grid_of(tri, (n, height, width), pos.shape[-2])
    spans = [(0, len(tri))] * n if ranges is None else ranges.tolist()
    if ids is None:
        parts = [grid.tri[first : first + count] for first, count in spans]
        pictures = ids_of(call, grid, vertices, parts, threads)
    else:
        pictures = list(ids)
    drawn = [(one, first) for one, (first, _) in zip(pictures, spans, strict=True)]
    return tensors.points(grid, vertices, drawn, is_flipped=True, with_db=bool(with_db))


def ids_of(
    call: Call, grid: PixelGrid, vertices: Array, triangles: Sequence[Array], threads: int
) -> list[NDArray[np.int32]]:
    """Return which triangles the pictures show, row 0 on top."""
    size, n = (grid.width, grid.height), threads or call.threads_of(grid.height * grid.width)
    return [draw(tensors.of(vertices, i), one, size, threads=n).triangle for i, one in enumerate(triangles)]


def points_vjp(call: Call, pos: Array, tri: Array, rast: Array, g_rast: Array | None, g_db: Array | None) -> Any:
    """Return the gradient of `pos`."""
    grid = call.grid_of(tri, rast.shape[:3], pos.shape[-2])
    g = np.zeros_like(rast) if g_rast is None else g_rast
    slopes = None if g_db is None or not g_db.size else g_db
    found = tensors.points_vjp(grid, pos if pos.ndim == 3 else pos[None], rast, g, slopes)
    return (found.reshape(pos.shape),)


def points_shapes(options: Sequence[int], pos: Any, tri: Any, ranges: Any, ids: Any) -> Shapes:  # noqa: ARG001
    """Return those of `rast` and `rast_db`."""
    n = len(pos if ranges is None else ranges)
    return [((n, options[0], options[1], columns), pos.dtype) for columns in (4, 4 * bool(options[2]))]


#: Options: height, width, whether `rast_db` is wanted, and threads that draw, 0 for as many as pay.
RASTERIZE = Operation(
    "rasterize", "pos tri ranges? ids?", "rast rast_db", "pos", "pos tri rast",
    points_shapes, draw_points, points_vjp, n_out=2,
)  # fmt: skip


def values(call: Call, attr: Array, rast: Array, tri: Array, rast_db: Array | None) -> tuple[Array, Array]:
    """Return attributes, and what those wanted change by."""
    grid = call.grid_of(tri, rast.shape[:3], attr.shape[1])
    return tensors.values(grid, attr, rast, rast_db, call.options)


def values_vjp(
    call: Call, attr: Array, rast: Array, tri: Array, rast_db: Array | None, g_out: Array | None, g_da: Array | None
) -> tuple[Array, Array, Array | None]:
    """Return the gradients of attributes, of `rast` and of `rast_db`."""
    grid = call.grid_of(tri, rast.shape[:3], attr.shape[1])
    g = np.zeros(grid.shape(attr.shape[2]), attr.dtype) if g_out is None else g_out
    db, da = (None, None) if g_da is None or not call.options else (rast_db, g_da)
    return tensors.values_vjp(grid, attr, rast, g, db, da, call.options)


#: Options: the columns whose derivatives are wanted.
INTERPOLATE = Operation(
    "interpolate", "attr rast tri rast_db?", "out out_da", "attr rast rast_db", "attr rast tri rast_db?",
    lambda wanted, attr, rast, *_: [((*rast.shape[:3], n), attr.dtype) for n in (attr.shape[2], 2 * len(wanted))],
    values, values_vjp, n_out=2,
)  # fmt: skip


def look_of(call: Call, uv: Array, uv_da: Array | None, bias: Array | None, levels: Sequence[Array]) -> TexelLook:
    """Return how a texture is looked up, and where."""
    how, beyond = TexelFilter(call.options[0]), TexelsBeyond(call.options[1])
    return TexelLook(levels, how, beyond, uv, uv_da, bias, call.threads_of(math.prod(uv.shape[:3])))


def texels_vjp(
    call: Call, uv: Array, uv_da: Array | None, bias: Array | None, levels: Sequence[Array], g_out: Array
) -> list[Array | None]:
    """Return the gradients of uv, of the footprints, of the biases and of the levels."""
    look, of_levels = look_of(call, uv, uv_da, bias, levels), any(call.needs[3:])
    g_levels, *where = tensors.texels_vjp(look, g_out, of_levels=of_levels, of_places=any(call.needs[:3]))
    return [*where, *(g_levels if of_levels else [None] * len(levels))]


#: Options: filter and boundary.
TEXTURE = Operation(
    "texture", "uv uv_da? bias? levels*", "out", "uv uv_da bias levels", "uv uv_da? bias? levels*",
    lambda _, uv, uv_da, bias, levels: [((*uv.shape[:3], levels[0].shape[-1]), uv.dtype)],  # noqa: ARG005
    lambda call, *given: [tensors.texels(look_of(call, *given))],
    texels_vjp,
)  # fmt: skip


def outlined(call: Call, pos: Array, rast: Array, tri: Array, across: Array | None) -> tuple[PixelGrid, Outline]:
    """Return the pictures, and the silhouette edges of their triangles."""
    grid = call.grid_of(tri, rast.shape[:3], pos.shape[1])
    return grid, tensors.outline_of(grid, pos, known_across(grid, across))


def known_across(grid: PixelGrid, across: Array | None) -> NDArray[np.int32]:
    """Return what lies across edges: what is given, or has to be found."""
    return tensors.halves_across(grid.tri) if across is None else np.ascontiguousarray(across, np.int32)


def smooth(call: Call, color: Array, rast: Array, pos: Array, tri: Array, across: Array | None) -> list[Array]:
    """Return the picture with smooth silhouettes, and the outline."""
    grid, outline = outlined(call, pos, rast, tri, across)
    out = tensors.smooth(grid, EdgeRule(call.options[0]), outline, pos, rast, color)
    return [out, outline.places, outline.edges]


def smooth_vjp(
    call: Call, color: Array, rast: Array, pos: Array, tri: Array, across: Array | None, places: Array | None,
    edges: Array | None, g_out: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the gradients of the colours and of `pos`."""
    if places is None or edges is None:
        grid, outline = outlined(call, pos, rast, tri, across)
    else:
        grid = call.grid_of(tri, rast.shape[:3], pos.shape[1])
        outline = Outline(known_across(grid, across), places, edges)
    return tensors.smooth_vjp(grid, EdgeRule(call.options[0]), outline, pos, rast, color, g_out)


#: Options: the rule of edges.
ANTIALIAS = Operation(
    "antialias", "color rast pos tri across?", "out places edges", "color pos",
    "color rast pos tri across? places edges",
    lambda _, color, rast, pos, tri, across: [  # noqa: ARG005
        (tuple(color.shape), color.dtype), ((*pos.shape[:2], 2), "float64"), ((pos.shape[0], tri.shape[0]), "int32"),
    ],
    smooth, smooth_vjp,
)  # fmt: skip


def pictures_of(
    call: Call, shape: Sequence[int], rule: int, pos: Array, tri: Array, attr: Array, across: Array | None,
    ids: NDArray[np.int32] | None = None, threads: int = 0,
) -> AttributePictures:  # fmt: skip
    """Return pictures (B, H, W) of attributes of a mesh, whose ids are drawn unless they are known."""
    grid = call.grid_of(tri, shape, min(pos.shape[1], attr.shape[1]))
    if ids is None:
        drawn = ids_of(call, grid, pos, [grid.tri] * len(pos), threads)
        ids = drawn[0][None] if len(drawn) == 1 else np.stack(drawn) if drawn else np.empty(grid.shape(), np.int32)
    else:  # a copy: another thread may write to saved tensors
        ids = np.clip(ids, -1, len(grid.tri) - 1)
    return AttributePictures(grid, EdgeRule(rule), known_across(grid, across), pos, ids, attr)


def draw_attributes(call: Call, pos: Array, tri: Array, attr: Array, across: Array | None) -> list[Array]:
    """Return pictures of attributes with smooth silhouettes, their ids, and for backward what they show, if wanted.

    That has as many words as the picture needs, so it is not wanted where sizes are to be known before.
    """
    height, width, rule, threads, keeps = call.options
    shape = len(pos), height, width
    pictures = pictures_of(call, shape, rule, pos, tri, attr, across, threads=threads)
    drawn, seen = pictures.picture()
    return [drawn, pictures.ids, pictures.pack(seen) if keeps else np.empty(0, np.int64)]


def attributes_vjp(
    call: Call, pos: Array, tri: Array, attr: Array, across: Array | None, ids: NDArray[np.int32],
    words: NDArray[np.int64] | None, g_out: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the gradients of `pos` and `attr`."""
    pictures = pictures_of(call, ids.shape, call.options[2], pos, tri, attr, across, ids)
    return pictures.vjp(g_out, None if words is None else pictures.unpack(words))


#: Options: height, width, the rule of edges, threads that draw, 0 for as many as pay, whether `words` are wanted.
RENDER = Operation(
    "render", "pos tri attr across?", "out ids words", "pos attr", "pos tri attr across? ids words",
    lambda options, pos, tri, attr, across: [  # noqa: ARG005
        ((len(pos), options[0], options[1], attr.shape[2]), pos.dtype),
        ((len(pos), options[0], options[1]), "int32"), ((0,), "int64"),
    ],
    draw_attributes, attributes_vjp,
)  # fmt: skip


def squares(call: Call, pos: Array, tri: Array, attr: Array, target: Array, across: Array | None) -> list[Array]:
    """Return the mean squared difference from pictures, and the gradients of `pos` and `attr`."""
    rule, threads = call.options
    pictures = pictures_of(call, target.shape[:3], rule, pos, tri, attr, across, threads=threads)
    loss, *gradients = pictures.squares(target)
    return [np.array(loss, pos.dtype), *gradients]


def times(_: Call, *arrays: Array) -> list[Array]:
    """Return the gradients that were kept, times that of the result, which is a number."""
    return [arrays[-1] * one for one in arrays[:-1]]


#: Options: the rule of edges, and threads that draw, 0 for as many as pay.
SQUARES = Operation(
    "squares", "pos tri attr target across?", "loss g_pos g_attr", "pos attr", "g_pos g_attr",
    lambda _, pos, tri, attr, *__: [((), pos.dtype), *((tuple(one.shape), one.dtype) for one in (pos, attr))],  # noqa: ARG005
    squares, times,
)  # fmt: skip
