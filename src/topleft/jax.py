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
from typing import Any

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


def like(*arrays: Array) -> Any:
    """Return the same of arrays that results look like."""
    found = tuple(shape_of(one.dtype, *one.shape) for one in arrays)
    return found if len(found) > 1 else found[0]


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


def no_gradient(array: Array) -> Any:
    """Return the gradient of integers, as JAX has it."""
    return np.zeros(array.shape, jax.dtypes.float0)


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
    found: tuple[Array, Array] = points(as_pair("resolution", resolution), pos, tri)
    return found


def ids_of(size: tuple[int, int], pos: Any, tri: Any) -> list[Any]:
    """Return the ids of pictures, row 0 on top."""
    return [draw(one, tri, size[::-1]).triangle for one in pos]


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def points(size: tuple[int, int], pos: Array, tri: Array) -> Any:
    """Return `rast` and `rast_db`."""

    def run(pos: Any, tri: Any) -> Any:
        grid = PixelGrid(as_checked_triangles(tri, pos.shape[1]), len(pos), *size)
        ids = [(one, 0) for one in ids_of(size, pos, tri)]
        return tensors.points(grid, pos, ids, is_flipped=True, with_db=True)

    return call(run, (shape_of(pos.dtype, len(pos), *size, 4),) * 2, pos, tri)


def points_forward(size: tuple[int, int], pos: Array, tri: Array) -> Any:
    """Return the same, and what backward takes."""
    rast, rast_db = points(size, pos, tri)
    return (rast, rast_db), (pos, tri, rast)


def points_backward(size: tuple[int, int], kept: Any, g: Any) -> Any:  # noqa: ARG001
    """Return the gradients of `pos` and of `tri`."""

    def run(pos: Any, tri: Any, rast: Any, g_rast: Any, g_db: Any) -> Any:
        return tensors.points_vjp(grid_of(tri, rast, pos.shape[1]), pos, rast, g_rast, g_db)

    return call(run, like(kept[0]), *kept, *g), no_gradient(kept[1])


points.defvjp(points_forward, points_backward)


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
    found: tuple[Array, Array] = values(rows.astype(dtype), rast.astype(dtype), tri, slopes)
    return found


def table_of(attr: Array, n: int) -> Array:
    """Return attributes of n pictures as (1 or n, V, K)."""
    rows = attr if attr.ndim == 3 else attr[None]
    check("attr", attr, f"(V, K), (1, V, K) or ({n}, V, K)", attr.ndim in (2, 3) and len(rows) in (1, n))
    return rows


@partial(jax.custom_vjp)
def values(attr: Array, rast: Array, tri: Array, rast_db: Array) -> Any:
    """Return attributes, and what they change by."""
    n, has_db = attr.shape[2], rast_db.shape[3] > 0

    def run(attr: Any, rast: Any, tri: Any, rast_db: Any) -> Any:
        grid = grid_of(tri, rast, attr.shape[1])
        return tensors.values(grid, attr, rast, rast_db if has_db else None, range(n) if has_db else ())

    shapes = shape_of(attr.dtype, *rast.shape[:3], n), shape_of(attr.dtype, *rast.shape[:3], 2 * n * has_db)
    return call(run, shapes, attr, rast, tri, rast_db)


def values_forward(*given: Array) -> Any:
    """Return the same, and what backward takes."""
    return values(*given), given


def values_backward(kept: Any, g: Any) -> Any:
    """Return the gradients of what `values` takes."""
    attr, rast, tri, rast_db = kept
    n, has_db = attr.shape[2], rast_db.shape[3] > 0

    def run(attr: Any, rast: Any, tri: Any, rast_db: Any, g_out: Any, g_da: Any) -> Any:
        grid = grid_of(tri, rast, attr.shape[1])
        slopes = (rast_db, g_da, range(n)) if has_db else ()
        g_attr, g_rast, g_db = tensors.values_vjp(grid, attr, rast, g_out, *slopes)
        return g_attr, g_rast, np.zeros_like(rast_db) if g_db is None else g_db

    g_attr, g_rast, g_db = call(run, like(attr, rast, rast_db), *kept, *g)
    return g_attr, g_rast, no_gradient(tri), g_db


values.defvjp(values_forward, values_backward)


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
    return texels(modes, *(one.astype(dtype) for one in (*where, *levels)))


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


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def texels(modes: Modes, *given: Array) -> Any:
    """Return a texture at each pixel."""
    shape = shape_of(given[0].dtype, *given[0].shape[:3], given[-1].shape[-1])
    return call(lambda *given: tensors.texels(look_of(modes, *given)), shape, *given)


def texels_forward(modes: Modes, *given: Array) -> Any:
    """Return the same, and what backward takes."""
    return texels(modes, *given), given


def texels_backward(modes: Modes, kept: Any, g: Array) -> Any:
    """Return the gradients of what `texels` takes."""

    def run(*given: Any) -> Any:
        g_levels, *where = tensors.texels_vjp(look_of(modes, *given[:-1]), given[-1])
        return *(one for one in where if one is not None), *g_levels

    return call(run, tuple(shape_of(one.dtype, *one.shape) for one in kept), *kept, g)


texels.defvjp(texels_forward, texels_backward)


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
    return smooth(as_rule(edges), color.astype(dtype), rast.astype(dtype), pos.astype(dtype), tri)


def outline_of(grid: PixelGrid, pos: Any) -> tensors.Outline:
    """Return what the edges of triangles are."""
    return tensors.outline_of(grid, pos, tensors.halves_across(grid.tri))


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def smooth(rule: EdgeRule, color: Array, rast: Array, pos: Array, tri: Array) -> Any:
    """Return the picture with smooth silhouettes."""

    def run(color: Any, rast: Any, pos: Any, tri: Any) -> Any:
        grid = grid_of(tri, rast, pos.shape[1])
        return tensors.smooth(grid, rule, outline_of(grid, pos), pos, rast, color)

    return call(run, like(color), color, rast, pos, tri)


def smooth_forward(rule: EdgeRule, color: Array, rast: Array, pos: Array, tri: Array) -> Any:
    """Return the same, and what backward takes."""
    return smooth(rule, color, rast, pos, tri), (color, rast, pos, tri)


def smooth_backward(rule: EdgeRule, kept: Any, g: Array) -> Any:
    """Return the gradients of what `smooth` takes."""
    color, rast, pos, tri = kept

    def run(color: Any, rast: Any, pos: Any, tri: Any, g: Any) -> Any:
        grid = grid_of(tri, rast, pos.shape[1])
        return tensors.smooth_vjp(grid, rule, outline_of(grid, pos), pos, rast, color, g)

    g_color, g_pos = call(run, like(color, pos), *kept, g)
    return g_color, jnp.zeros_like(rast), g_pos, no_gradient(tri)


smooth.defvjp(smooth_forward, smooth_backward)


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
    return drawn((size, as_rule(edges)), pos.astype(dtype), tri, rows.astype(dtype))


#: Height and width, and the rule of edges.
Drawing = tuple[tuple[int, int], EdgeRule]


def pictures_of(drawing: Drawing, pos: Any, tri: Any, attr: Any, ids: Any) -> AttributePictures:
    """Return what the engine draws of a mesh, and leads back."""
    grid = grid_of(tri, ids, min(pos.shape[1], attr.shape[1]))
    return AttributePictures(grid, drawing[1], outline_of(grid, pos), pos, ids, attr)


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def drawn(drawing: Drawing, pos: Array, tri: Array, attr: Array) -> Any:
    """Return pictures of attributes with smooth silhouettes."""
    return drawn_forward(drawing, pos, tri, attr)[0]


def drawn_forward(drawing: Drawing, pos: Array, tri: Array, attr: Array) -> Any:
    """Return the same, and what backward takes: the ids of pixels among it."""
    of_pixels = len(pos), *drawing[0]

    def run(pos: Any, tri: Any, attr: Any) -> Any:
        ids = np.concatenate(
            [np.empty((0, *drawing[0]), np.int32), *(one[None] for one in ids_of(drawing[0], pos, tri))]
        )
        return pictures_of(drawing, pos, tri, attr, ids).picture()[0], ids

    shapes = shape_of(pos.dtype, *of_pixels, attr.shape[2]), shape_of(np.int32, *of_pixels)
    out, ids = call(run, shapes, pos, tri, attr)
    return out, (pos, tri, attr, ids)


def drawn_backward(drawing: Drawing, kept: Any, g: Array) -> Any:
    """Return the gradients of what `drawn` takes."""
    pos, tri, attr, _ = kept
    g_pos, g_attr = call(lambda *given: pictures_of(drawing, *given[:4]).vjp(given[4]), like(pos, attr), *kept, g)
    return g_pos, no_gradient(tri), g_attr


drawn.defvjp(drawn_forward, drawn_backward)
