"""Arrays of JAX on the CPU, with gradients, in the conventions of `topleft.torch`: `import topleft.jax as dr`.

Each function is one call of the engine through `jax.pure_callback`, so `jax.jit`, `jax.grad` and `jax.vmap` take it;
gradients are first derivatives, with the same bits in every run. Needs JAX: ``pip install jax``.

Row 0 is the bottom row, resolutions are (height, width), ids are 1 more and stand in a channel of floats, depth is z/w
in -1..1, and row 0 of a texture is v = 0. Shapes are those of `topleft.torch`, with a batch of B pictures; a wrong one
raises an error there, an index that does not exist when the call runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from topleft import rasterize as draw
from topleft._core.base.arrays import as_checked_triangles, as_pair
from topleft._core.gradients import tensors
from topleft._core.gradients.pictures import AttributePictures
from topleft._core.gradients.tensors import (
    EdgeRule,
    PixelGrid,
    TexelFilter,
    TexelLook,
    TexelsBeyond,
    as_filter,
    as_rule,
    check_texture,
    halved_axes,
)
from topleft.errors import MissingPackageError
from topleft.typing import BoundaryOption, EdgesOption

try:
    import jax
    import jax.numpy as jnp
except ImportError:
    raise MissingPackageError("topleft.jax needs JAX: pip install jax") from None

__all__ = ["antialias", "interpolate", "rasterize", "render", "texture"]

Array = Any


def call(function: Callable[..., Any], shapes: Any, *args: Array) -> Any:
    """Call the engine with NumPy arrays; a sample of `jax.vmap` is a call."""

    def on_arrays(*given: Any) -> Any:
        return function(*(np.ascontiguousarray(one) for one in given))

    return jax.pure_callback(on_arrays, shapes, *args, vmap_method="sequential")


def shape_of(dtype: Any, *shape: int) -> Any:
    """Return what JAX knows of a result."""
    return jax.ShapeDtypeStruct(shape, dtype)


def grid_of(tri: Any, pixels: Any, n_vertices: int) -> PixelGrid:
    """Return the pictures (B, H, W, ...) of triangles."""
    b, h, w = pixels.shape[:3]
    return PixelGrid(as_checked_triangles(tri, n_vertices), b, h, w)


def check(name: str, array: Array, wish: str, fits: object) -> None:
    """Raise an error unless an array is float32 or float64 and has the shape wished for."""
    if array.dtype not in (np.float32, np.float64):
        raise TypeError(f"{name} must be float32 or float64, got {array.dtype}")
    if not fits:
        raise ValueError(f"{name} must have shape {wish}, got {array.shape}")


class Operation(NamedTuple):
    """A call of the engine with arrays, by some options; and backward.

    `run` returns results of the `shapes`, of which the first `n_out` are given out. `vjp` takes the arrays, the results
    numbered in `kept` and the gradients of what was given out, and returns those of the arrays of floats.
    """

    shapes: Callable[..., tuple[Any, ...]]
    run: Callable[..., tuple[Any, ...]]
    vjp: Callable[..., tuple[Any, ...]]
    n_out: int = 1
    kept: tuple[int, ...] = ()


@partial(jax.custom_vjp, nondiff_argnums=(0, 1))
def operate(operation: Operation, options: Any, *given: Array) -> tuple[Array, ...]:
    """Return what an operation gives out."""
    return operate_forward(operation, options, *given)[0]


def operate_forward(operation: Operation, options: Any, *given: Array) -> tuple[tuple[Array, ...], Any]:
    """Return the same, and what backward takes."""
    found = call(partial(operation.run, options), operation.shapes(options, *given), *given)
    return found[: operation.n_out], (given, [found[i] for i in operation.kept])


def operate_backward(operation: Operation, options: Any, kept: Any, g: tuple[Array, ...]) -> tuple[Any, ...]:
    """Return the gradients of what an operation takes; integers have theirs as JAX wants it."""
    given, results = kept
    is_real = [jnp.issubdtype(one.dtype, jnp.floating) for one in given]
    shapes = tuple(shape_of(one.dtype, *one.shape) for one, real in zip(given, is_real, strict=True) if real)
    found = iter(call(partial(operation.vjp, options), shapes, *given, *results, *g))
    return tuple(
        next(found) if real else np.zeros(one.shape, jax.dtypes.float0)
        for one, real in zip(given, is_real, strict=True)
    )


operate.defvjp(operate_forward, operate_backward)


def rasterize(pos: Array, tri: Array, resolution: Sequence[int]) -> tuple[Array, Array]:
    """Return which triangle shows in each pixel, where in it the pixel lies, and the derivatives of that.

    Parameters
    ----------
    pos : array of float32 or float64, shape (B, V, 4)
        Clip space, y up, -w <= z <= w.
    tri : array of int32, shape (T, 3)
        Indices of vertices.
    resolution : (int, int)
        Height and width.

    Returns
    -------
    (array, array), shapes (B, H, W, 4)
        Weights u and v of the first two corners, z/w, and the id plus 1, 0 where nothing is; and du/dX, du/dY, dv/dX,
        dv/dY. Gradients of both reach `pos`.

    Raises
    ------
    TypeError, ValueError
        For a wrong dtype or shape.
    """
    check("pos", pos, "(B, V, 4)", pos.ndim == 3 and pos.shape[2] == 4)
    rast, rast_db = operate(POINTS, as_pair("resolution", resolution), pos, tri)
    return rast, rast_db


def ids_of(size: tuple[int, int], pos: Any, tri: Any) -> list[Any]:
    """Return the ids of pictures, row 0 on top."""
    return [draw(one, tri, size[::-1]).triangle for one in pos]


def points(size: tuple[int, int], pos: Any, tri: Any) -> tuple[Any, Any]:
    """Return `rast` and `rast_db`."""
    grid = PixelGrid(as_checked_triangles(tri, pos.shape[1]), len(pos), *size)
    return tensors.points(grid, pos, [(one, 0) for one in ids_of(size, pos, tri)], is_flipped=True, with_db=True)


def points_vjp(_: tuple[int, int], pos: Any, tri: Any, rast: Any, g_rast: Any, g_db: Any) -> tuple[Any]:
    """Return the gradient of `pos`."""
    return (tensors.points_vjp(grid_of(tri, rast, pos.shape[1]), pos, rast, g_rast, g_db),)


POINTS = Operation(
    lambda size, pos, _: (shape_of(pos.dtype, len(pos), *size, 4),) * 2, points, points_vjp, n_out=2, kept=(0,)
)


def interpolate(attr: Array, rast: Array, tri: Array, rast_db: Array | None = None) -> tuple[Array, Array]:
    """Return attributes of the vertices at each pixel, and how they change from pixel to pixel.

    Parameters
    ----------
    attr : array of float32 or float64, shape (V, K), (1, V, K) or (B, V, K)
        A row a vertex.
    rast, rast_db : arrays, shape (B, H, W, 4)
        What `rasterize` returned; without `rast_db` there are no derivatives.
    tri : array of int32, shape (T, 3)
        Indices of rows of `attr`.

    Returns
    -------
    (array, array), shapes (B, H, W, K) and (B, H, W, 2 K)
        Perspective-correct, 0 where there is no triangle; dA/dX and dA/dY of each attribute, or no columns.

    Raises
    ------
    TypeError, ValueError
        For a wrong dtype or shape.
    """
    check("rast", rast, "(B, H, W, 4)", rast.ndim == 4 and rast.shape[3] == 4)
    rows = table_of(attr, len(rast))
    dtype = jnp.result_type(rows, rast)
    slopes = jnp.zeros((*rast.shape[:3], 0), dtype) if rast_db is None else rast_db.astype(dtype)
    out, out_da = operate(VALUES, None, rows.astype(dtype), rast.astype(dtype), tri, slopes)
    return out, out_da


def table_of(attr: Array, n: int) -> Array:
    """Return attributes of n pictures as (1 or n, V, K)."""
    rows = attr if attr.ndim == 3 else attr[None]
    check("attr", attr, f"(V, K), (1, V, K) or ({n}, V, K)", attr.ndim in (2, 3) and len(rows) in (1, n))
    return rows


def slopes_of(attr: Any, rast_db: Any) -> tuple[Any, range]:
    """Return the derivatives of the weights, None without columns, and of which attributes they are wanted."""
    return (rast_db, range(attr.shape[2])) if rast_db.shape[3] else (None, range(0))


def values_shapes(_: None, attr: Any, rast: Any, tri: Any, rast_db: Any) -> tuple[Any, Any]:  # noqa: ARG001
    """Return the shapes of attributes, and of what they change by."""
    n, of_pixels = attr.shape[2], rast.shape[:3]
    return shape_of(attr.dtype, *of_pixels, n), shape_of(attr.dtype, *of_pixels, 2 * n * (rast_db.shape[3] > 0))


def values(_: None, attr: Any, rast: Any, tri: Any, rast_db: Any) -> tuple[Any, Any]:
    """Return attributes, and what they change by."""
    return tensors.values(grid_of(tri, rast, attr.shape[1]), attr, rast, *slopes_of(attr, rast_db))


def values_vjp(_: None, attr: Any, rast: Any, tri: Any, rast_db: Any, g_out: Any, g_da: Any) -> tuple[Any, Any, Any]:
    """Return the gradients of attributes, of `rast` and of `rast_db`."""
    slopes, wanted = slopes_of(attr, rast_db)
    given = g_out, slopes, g_da if wanted else None, wanted
    g_attr, g_rast, g_db = tensors.values_vjp(grid_of(tri, rast, attr.shape[1]), attr, rast, *given)
    return g_attr, g_rast, np.zeros_like(rast_db) if g_db is None else g_db


VALUES = Operation(values_shapes, values, values_vjp, n_out=2)


def texture(
    tex: Array,
    uv: Array,
    filter_mode: str = "linear",
    boundary_mode: BoundaryOption = "wrap",
    *,
    uv_da: Array | None = None,
    mip_level_bias: Array | None = None,
    max_mip_level: int | None = None,
) -> Array:
    """Return what a texture is at each pixel.

    Parameters
    ----------
    tex : array of float32 or float64, shape (B or 1, Ht, Wt, C); of a cube map (B or 1, 6, N, N, C)
        Row 0 is at v = 0.
    uv : array, shape (B, H, W, 2); of a cube map directions (B, H, W, 3)
        Where to look.
    filter_mode : "nearest", "linear", "linear-mipmap-nearest" or "linear-mipmap-linear"
        The nearest texel, the four next to a point, or those of the nearest halving or of two.
    boundary_mode : "wrap", "clamp", "zero" or "cube"
        What lies beyond 0 and 1.
    uv_da : array, shape (B, H, W, 4); of a cube map (B, H, W, 6), optional
        What `uv` changes by from pixel to pixel, of `interpolate`: finds the level of a mipmap.
    mip_level_bias : array, shape (B, H, W), optional
        Is added to the level; without `uv_da` it is the level.
    max_mip_level : int, optional
        The last level; without it the last is 1 x 1.

    Returns
    -------
    array, shape (B, H, W, C)
        Gradients reach `tex`, `uv`, `uv_da` and `mip_level_bias`.

    Raises
    ------
    TypeError, ValueError
        For a wrong dtype or shape, an unknown mode, a mipmap filter without `uv_da` or `mip_level_bias`, or a side of a
        level that is odd and not 1.
    """
    how = as_filter(filter_mode, FILTERS, has_level=uv_da is not None or mip_level_bias is not None)
    check_texture(check, tex, uv, uv_da, mip_level_bias, boundary_mode)
    levels, where = [tex], [uv]
    if how > TexelFilter.LINEAR:
        levels = halvings(tex, max_mip_level)
        where += [one for one in (uv_da, mip_level_bias) if one is not None]
    dtype = jnp.result_type(tex, *where)
    modes = how, TexelsBeyond[boundary_mode.upper()], len(where), uv_da is not None
    return operate(TEXELS, modes, *(one.astype(dtype) for one in (*where, *levels)))[0]


#: The words of `TexelFilter`.
FILTERS = tuple(one.name.lower().replace("_", "-") for one in TexelFilter)


def halvings(tex: Array, max_mip_level: int | None) -> list[Array]:
    """Return the levels of a mipmap: each texel is the mean of those that it covers."""
    levels = [tex]
    for axes in halved_axes(tex.shape, max_mip_level):
        last = levels[-1]
        for axis in axes:
            last = last.reshape(*last.shape[:axis], last.shape[axis] // 2, 2, *last.shape[axis + 1 :]).mean(axis)
        levels.append(last)
    return levels


#: Filter, boundary, how many arrays say where to look, and whether footprints are among them.
Modes = tuple[TexelFilter, TexelsBeyond, int, bool]


def look_of(modes: Modes, *given: Any) -> TexelLook:
    """Return what the engine looks up: `given` are uv, footprints, biases, and levels."""
    how, beyond, n, has_da = modes
    where = list(given[:n]) if has_da or n == 1 else [given[0], None, given[1]]
    return TexelLook(given[n:], how, beyond, *where)


def texels_vjp(modes: Modes, *given: Any) -> tuple[Any, ...]:
    """Return the gradients of what a texture is looked up with: those of its pixels are the last of `given`."""
    g_levels, *where = tensors.texels_vjp(look_of(modes, *given[:-1]), given[-1])
    return *(one for one in where if one is not None), *g_levels


TEXELS = Operation(
    lambda _, *given: (shape_of(given[0].dtype, *given[0].shape[:3], given[-1].shape[-1]),),
    lambda modes, *given: (tensors.texels(look_of(modes, *given)),),
    texels_vjp,
)


def antialias(color: Array, rast: Array, pos: Array, tri: Array, *, edges: EdgesOption = "silhouette") -> Array:
    """Return a picture with smooth silhouettes, which lets gradients of a silhouette reach `pos`.

    Parameters
    ----------
    color : array of float32 or float64, shape (B, H, W, C)
        The picture.
    rast : array, shape (B, H, W, 4)
        What `rasterize` returned.
    pos : array, shape (B, V, 4) or (1, V, 4)
        What was drawn.
    tri : array of int32, shape (T, 3)
        What was drawn.
    edges : {"silhouette", "area", "straight-through"}
        As for `antialias` of `topleft.torch`; "area" for meshes of small triangles.

    Returns
    -------
    array, shape (B, H, W, C)
        Gradients reach `color` and `pos`.

    Raises
    ------
    TypeError, ValueError
        For a wrong dtype or shape, or an unknown rule.
    """
    check("color", color, "(B, H, W, C)", color.ndim == 4)
    check("rast", rast, f"{(*color.shape[:3], 4)}", rast.shape == (*color.shape[:3], 4))
    fits = pos.ndim == 3 and pos.shape[2] == 4 and len(pos) in (1, len(color))
    check("pos", pos, f"(1, V, 4) or ({len(color)}, V, 4)", fits)
    dtype = jnp.result_type(color, rast, pos)
    return operate(SMOOTH, as_rule(edges), color.astype(dtype), rast.astype(dtype), pos.astype(dtype), tri)[0]


def outline_of(grid: PixelGrid, pos: Any) -> tensors.Outline:
    """Return what the edges of triangles are."""
    return tensors.outline_of(grid, pos, tensors.halves_across(grid.tri))


def smooth(rule: EdgeRule, color: Any, rast: Any, pos: Any, tri: Any) -> tuple[Any]:
    """Return the picture with smooth silhouettes."""
    grid = grid_of(tri, rast, pos.shape[1])
    return (tensors.smooth(grid, rule, outline_of(grid, pos), pos, rast, color),)


def smooth_vjp(rule: EdgeRule, color: Any, rast: Any, pos: Any, tri: Any, g: Any) -> tuple[Any, Any, Any]:
    """Return the gradients of the picture, of `rast`, which are 0, and of the vertices."""
    grid = grid_of(tri, rast, pos.shape[1])
    g_color, g_pos = tensors.smooth_vjp(grid, rule, outline_of(grid, pos), pos, rast, color, g)
    return g_color, np.zeros_like(rast), g_pos


SMOOTH = Operation(lambda _, color, *__: (shape_of(color.dtype, *color.shape),), smooth, smooth_vjp)


def render(pos: Array, tri: Array, attr: Array, resolution: Sequence[int], *, edges: EdgesOption = "area") -> Array:
    """Return pictures of a mesh for a loss of your own: `rasterize`, `interpolate` and `antialias` in one.

    Parameters
    ----------
    pos : array of float32 or float64, shape (B, V, 4)
        As in `rasterize`.
    tri : array of int32, shape (T, 3)
        Indices of rows of `pos` and of `attr`.
    attr : array of float32 or float64, shape (V, K), (1, V, K) or (B, V, K)
        Colours, or other numbers, of the vertices; a column of ones for the silhouette.
    resolution : (int, int)
        Height and width.
    edges : {"area", "silhouette", "straight-through"}
        As in `antialias`.

    Returns
    -------
    array, shape (B, H, W, K)
        Row 0 is the bottom row; 0 where nothing is. Gradients reach `pos` and `attr`.

    Raises
    ------
    TypeError, ValueError
        For a wrong dtype or shape, or an unknown rule.

    Examples
    --------
    >>> pos = jnp.array([[[-1.0, -2, 0, 1], [0.25, -2, 0, 1], [0.25, 4, 0, 1], [-1, 4, 0, 1]]])
    >>> tri = jnp.array([[0, 1, 2], [0, 2, 3]])
    >>> render(pos, tri, jnp.ones((4, 1)), (1, 4)).ravel()
    Array([1. , 1. , 0.5, 0. ], dtype=float32)
    """
    check("pos", pos, "(B, V, 4)", pos.ndim == 3 and pos.shape[2] == 4)
    rows, size = table_of(attr, len(pos)), as_pair("resolution", resolution)
    dtype = jnp.result_type(pos, rows)
    return operate(DRAWN, (size, as_rule(edges)), pos.astype(dtype), tri, rows.astype(dtype))[0]


#: Height and width, and the rule of edges.
Drawing = tuple[tuple[int, int], EdgeRule]


def pictures_of(drawing: Drawing, pos: Any, tri: Any, attr: Any, ids: Any) -> AttributePictures:
    """Return what the engine draws of a mesh, and leads back."""
    grid = grid_of(tri, ids, min(pos.shape[1], attr.shape[1]))
    return AttributePictures(grid, drawing[1], tensors.halves_across(grid.tri), pos, ids, attr)


def drawn_shapes(drawing: Drawing, pos: Any, tri: Any, attr: Any) -> tuple[Any, Any]:  # noqa: ARG001
    """Return the shapes of pictures, and of the ids of their pixels."""
    of_pixels = len(pos), *drawing[0]
    return shape_of(pos.dtype, *of_pixels, attr.shape[2]), shape_of(np.int32, *of_pixels)


def drawn(drawing: Drawing, pos: Any, tri: Any, attr: Any) -> tuple[Any, Any]:
    """Return pictures of attributes with smooth silhouettes, and the ids of their pixels."""
    ids = np.empty((len(pos), *drawing[0]), np.int32)
    for own, one in zip(ids, ids_of(drawing[0], pos, tri), strict=True):
        own[...] = one
    return pictures_of(drawing, pos, tri, attr, ids).picture()[0], ids


def drawn_vjp(drawing: Drawing, pos: Any, tri: Any, attr: Any, ids: Any, g: Any) -> tuple[Any, Any]:
    """Return the gradients of the vertices and of the attributes."""
    return pictures_of(drawing, pos, tri, attr, ids).vjp(g)


DRAWN = Operation(drawn_shapes, drawn, drawn_vjp, kept=(1,))
