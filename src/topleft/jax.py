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

from topleft._core.base.arrays import as_pair
from topleft._core.base.threads import available_threads
from topleft.annex.tensors import (
    ANTIALIAS,
    INTERPOLATE,
    RASTERIZE,
    RENDER,
    TEXTURE,
    Call,
    Operation,
    TexelFilter,
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


def __dir__() -> list[str]:
    return list(__all__)


def call(function: Callable[..., Any], shapes: Any, *args: Any) -> Any:
    """Call the engine with NumPy arrays; a sample of `jax.vmap` is a call."""

    def on_arrays(*given: Any) -> Any:
        return function(*jax.tree.map(np.ascontiguousarray, given))

    return jax.pure_callback(on_arrays, shapes, *args, vmap_method="sequential")


def check(name: str, array: Array, wish: str, fits: object) -> None:
    """Raise an error unless an array is float32 or float64 and has the shape wished for."""
    if array.dtype not in (np.float32, np.float64):
        raise TypeError(f"{name} must be float32 or float64, got {array.dtype}")
    if not fits:
        raise ValueError(f"{name} must have shape {wish}, got {array.shape}")


@partial(jax.custom_vjp, nondiff_argnums=(0, 1))
def operate(operation: Operation, options: tuple[int, ...], *given: Any) -> tuple[Array, ...]:
    """Return what an operation gives out."""
    return operate_forward(operation, options, *given)[0]


def operate_forward(operation: Operation, options: tuple[int, ...], *given: Any) -> tuple[tuple[Array, ...], Any]:
    """Return what an operation gives out, and what backward takes: results of dtypes that JAX has."""
    shapes = operation.shapes(options, *given)
    is_held = [jax.dtypes.canonicalize_dtype(dtype) == dtype for _, dtype in shapes]

    def run(*arrays: Any) -> list[Any]:
        results = operation.run(Call(options, available_threads()), *arrays)
        return [one for one, held in zip(results, is_held, strict=True) if held]

    made = iter(
        call(run, [jax.ShapeDtypeStruct(*one) for one, held in zip(shapes, is_held, strict=True) if held], *given)
    )
    found = [next(made) if held else None for held in is_held]
    return tuple(found[: operation.n_out]), (given, found)


def operate_backward(
    operation: Operation, options: tuple[int, ...], kept: Any, g: tuple[Array, ...]
) -> tuple[Any, ...]:
    """Return the gradients of what an operation takes; integers have theirs as JAX wants it."""
    given, results = kept
    names = operation.given.replace("?", "").replace("*", "").split()
    known = dict(zip((*names, *operation.results.split()), (*given, *results), strict=True))
    wanted = operation.gradients.split()
    leaves, tree = jax.tree.flatten([known[name] for name in wanted])

    def vjp(*arrays: Any) -> list[Any]:
        found = operation.vjp(Call(options, available_threads(), [True] * len(wanted)), *arrays)
        return [one for one in found if one is not None]

    arrays = [known[name.rstrip("?*")] for name in operation.kept.split()]
    found = call(vjp, [jax.ShapeDtypeStruct(one.shape, one.dtype) for one in leaves], *arrays, *g)
    made = dict(zip(wanted, jax.tree.unflatten(tree, found), strict=True))
    return tuple(made[name] if name in made else jax.tree.map(no_gradient, known[name]) for name in names)


def no_gradient(array: Array) -> Array:
    """Return zeros, as JAX wants them of an array."""
    is_real = jnp.issubdtype(array.dtype, jnp.floating)
    return jnp.zeros_like(array) if is_real else np.zeros(array.shape, jax.dtypes.float0)


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
    rast, rast_db = operate(RASTERIZE, (*as_pair("resolution", resolution), True, 0), pos, tri, None, None)
    return rast, rast_db


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
    slopes, wanted = (None, 0) if rast_db is None else (rast_db.astype(dtype), rows.shape[2])
    out, out_da = operate(INTERPOLATE, tuple(range(wanted)), rows.astype(dtype), rast.astype(dtype), tri, slopes)
    return out, out_da


def table_of(attr: Array, n: int) -> Array:
    """Return attributes of n pictures as (1 or n, V, K)."""
    rows = attr if attr.ndim == 3 else attr[None]
    check("attr", attr, f"(V, K), (1, V, K) or ({n}, V, K)", attr.ndim in (2, 3) and len(rows) in (1, n))
    return rows


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
    levels = [tex]
    if how > TexelFilter.LINEAR:
        levels = halvings(tex, max_mip_level)
    else:
        uv_da = mip_level_bias = None
    dtype = jnp.result_type(tex, *(one for one in (uv, uv_da, mip_level_bias) if one is not None))
    given = jax.tree.map(lambda one: one.astype(dtype), (uv, uv_da, mip_level_bias, levels))
    return operate(TEXTURE, (how, TexelsBeyond[boundary_mode.upper()]), *given)[0]


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
    given = (one.astype(dtype) for one in (color, rast, pos))
    return operate(ANTIALIAS, (as_rule(edges),), *given, tri, None)[0]


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
    options = *size, as_rule(edges), 0, False
    return operate(RENDER, options, pos.astype(dtype), tri, rows.astype(dtype), None)[0]
