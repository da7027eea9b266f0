"""PyTorch tensors on the CPU, in the calls and the conventions of nvdiffrast: `import topleft.torch as dr`.

In and out: tensors of float32 (or float64) on the CPU, read without a copy. Each function is one call of the engine,
which also computes its gradients, with the same bits for every number of threads. They are custom operators
of PyTorch (``torch.ops.topleft``), so `torch.compile` and `torch.vmap` take them. Needs PyTorch 2.5:
``pip install torch``.

What differs from the rest of `topleft`: row 0 is the bottom row, resolutions are (height, width), ids are 1 more and
stand in a channel of floats, depth is z/w in -1..1, and row 0 of a texture is v = 0.

Based on: Laine, S., Hellsten, J., Karras, T., Seol, Y., Lehtinen, J., Aila, T., "Modular Primitives for
High-Performance Differentiable Rendering", ACM Transactions on Graphics, 2020.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, get_args

from topleft import DepthLayers, peel
from topleft._core.base.arrays import as_pair
from topleft._core.base.threads import parse_threads
from topleft.annex.tensors import Call, TexelFilter, TexelsBeyond, as_filter, as_rule, check_texture, halved_axes
from topleft.errors import MissingPackageError
from topleft.typing import BoundaryOption, EdgesOption, FilterModeOption, LossOption

try:
    import torch
    from torch import Tensor
except ImportError:
    raise MissingPackageError("topleft.torch needs PyTorch: pip install torch") from None

from topleft._torch import operators
from topleft._torch.checks import (
    INTS,
    KINDS,
    as_diff_attrs,
    as_mip,
    check,
    check_tri,
    is_cube_map,
    is_tensor,
    len_of,
    same_dtype,
)

__all__ = [
    "DepthPeeler",
    "RasterizeContext",
    "RasterizeCudaContext",
    "RasterizeGLContext",
    "antialias",
    "antialias_construct_topology_hash",
    "get_log_level",
    "interpolate",
    "photometric_loss",
    "rasterize",
    "render",
    "set_log_level",
    "texture",
    "texture_construct_mip",
]


def __dir__() -> list[str]:
    return list(__all__)


#: `DepthPeeler` draws so many layers at first, and doubles them up to what `topleft.peel` keeps.
FIRST_LAYERS, MOST_LAYERS = 4, 16


class RasterizeContext:
    """How `rasterize` draws.

    `RasterizeCudaContext` and `RasterizeGLContext` are the same class: programs for nvdiffrast name them.

    Parameters
    ----------
    device : optional
        None or "cpu".
    output_db : bool
        Whether `rasterize` returns the derivatives of the weights, too.
    threads : int or None
        How many threads draw; None: as many as PyTorch uses, where they pay. Never changes a bit.
    mode : "automatic" or "manual"
        For programs that call `set_context` and `release_context`, which do nothing: there is no context of a display.

    Raises
    ------
    ValueError
        For another device or mode, or a number of threads below 1.

    Examples
    --------
    >>> RasterizeContext(threads=1).output_db
    True
    """

    def __init__(
        self, device: object = None, *, output_db: bool = True, threads: int | None = None, mode: str = "automatic"
    ) -> None:
        if device is not None and torch.device(device).type != "cpu":
            raise ValueError(f"device must be 'cpu' or None, got {str(device)!r}: topleft draws on the CPU alone")
        if mode not in ("automatic", "manual"):
            raise ValueError(f"mode must be 'automatic' or 'manual', got {mode!r}")
        self.output_db = bool(output_db)
        self.threads = parse_threads(threads)

    def set_context(self) -> None:
        """Do nothing, for programs that hold a context of OpenGL."""

    def release_context(self) -> None:
        """Do nothing, as `set_context`."""


RasterizeCudaContext = RasterizeGLContext = RasterizeContext


#: What `set_log_level` was given.
log_level = [1]


def get_log_level() -> int:
    """Return the number that `set_log_level` was given, 1 before: topleft writes no log."""
    return log_level[0]


def set_log_level(level: int) -> None:
    """Keep a number for `get_log_level`, for programs that call it: topleft writes no log."""
    log_level[0] = int(level)


def rasterize(
    glctx: RasterizeContext,
    pos: Tensor,
    tri: Tensor,
    resolution: Sequence[int],
    ranges: Tensor | None = None,
    grad_db: bool = True,
) -> tuple[Tensor, Tensor]:
    """Return which triangle shows in each pixel, where in it the pixel lies, and the derivatives of that.

    Parameters
    ----------
    glctx : RasterizeContext
        Made once, used for many calls.
    pos : tensor of float32 or float64, shape (B, V, 4), or (V, 4) with `ranges`
        Clip space, y up, -w <= z <= w.
    tri : tensor of int32 or int64, shape (T, 3)
        Indices of vertices; either winding.
    resolution : (int, int)
        Height and width.
    ranges : tensor of int32 or int64, shape (B, 2), optional
        For each picture its first triangle and how many it has.
    grad_db : bool
        Whether gradients flow through the derivatives.

    Returns
    -------
    rast : tensor of the dtype of `pos`, shape (B, H, W, 4)
        Weight u of the triangle's first corner, v of its second (the third has 1 - u - v), z/w, and the id plus 1.
        Row 0 is the bottom row; 0 where nothing is.
    rast_db : tensor, shape (B, H, W, 4)
        du/dX, du/dY, dv/dX, dv/dY, with X to the right and Y up, in pixels. (B, H, W, 0) with ``output_db=False``.

    Raises
    ------
    TypeError
        For what is no tensor, is not on the CPU, or has a wrong dtype.
    ValueError
        For a wrong shape, or a vertex in use that is not finite.
    IndexError
        For a triangle that names a vertex that does not exist.

    Notes
    -----
    The engine decides the id after it has snapped vertices to 1/256 pixel, under the top-left rule. Weights, z/w and
    derivatives are those of the vertices as given, clamped: weights to a sum of at most 1, z/w to -1..1. Of float32 a
    run of pixels is set up in float64, and its pixels are float32: within 2**-21 of float64. float32 counts to 2**24:
    bits of larger ids are counted on from those of 2**24, as in nvdiffrast.

    Examples
    --------
    >>> pos = torch.tensor([[[-1.0, -1, 0, 1], [3, -1, 0, 1], [-1, 3, 0, 1]]])
    >>> rast, rast_db = rasterize(RasterizeContext(), pos, torch.tensor([[0, 1, 2]]), (2, 2))
    >>> rast[0, 0]
    tensor([[0.7500, 0.1250, 0.0000, 1.0000],
            [0.5000, 0.3750, 0.0000, 1.0000]])
    >>> rast_db[0, 0, 0]
    tensor([-0.2500, -0.2500,  0.2500,  0.0000])
    """
    check_mesh(glctx, pos, tri, ranges)
    height, width = as_pair("resolution", resolution)
    rast, rast_db = operators.rasterize(pos, tri, ranges, None, (height, width, glctx.output_db, glctx.threads or 0))
    return rast, rast_db if grad_db else rast_db.detach()


class DepthPeeler:
    """Layers of triangles, the nearest first: `rasterize`, again and again, without what was in front.

    Parameters
    ----------
    glctx, pos, tri, resolution, ranges, grad_db
        As in `rasterize`.

    Raises
    ------
    TypeError, ValueError, IndexError
        As in `rasterize`; `ValueError` for the 17th layer.

    Examples
    --------
    >>> pos = torch.tensor([[[-1.0, -1, z, 1], [3, -1, z, 1], [-1, 3, z, 1]] for z in (0.5, 0.0)]).reshape(1, 6, 4)
    >>> with DepthPeeler(RasterizeContext(), pos, torch.tensor([[0, 1, 2], [3, 4, 5]]), (1, 1)) as peeler:
    ...     [peeler.rasterize_next_layer()[0][..., 3].item() for _ in range(3)]
    [2.0, 1.0, 0.0]
    """

    def __init__(
        self,
        glctx: RasterizeContext,
        pos: Tensor,
        tri: Tensor,
        resolution: Sequence[int],
        ranges: Tensor | None = None,
        grad_db: bool = True,
    ) -> None:
        check_mesh(glctx, pos, tri, ranges)
        self._context, self._mesh, self._grad_db = glctx, (pos, tri, ranges), grad_db
        self._resolution = as_pair("resolution", resolution)
        self._layers: list[DepthLayers] = []
        self._n_shown = 0

    def __enter__(self) -> DepthPeeler:
        return self

    def __exit__(self, *_: object) -> None:
        self._layers = []

    def rasterize_next_layer(self) -> tuple[Tensor, Tensor]:
        """Return `rast` and `rast_db` of the next layer, as `rasterize` does."""
        (height, width), (pos, tri, ranges) = self._resolution, self._mesh
        k, threads = self._n_shown, self._context.threads or 0
        if k == MOST_LAYERS:
            raise ValueError(f"a DepthPeeler has at most {MOST_LAYERS} layers")
        if k >= (len(self._layers[0]) if self._layers else 0):
            n = threads or Call((), torch.get_num_threads()).threads_of(width * height)
            options: Any = {"layers": max(FIRST_LAYERS, 2 * k), "threads": n}
            vertices, triangles = operators.numpy_of(pos), operators.numpy_of(tri)
            meshes = [(one, triangles) for one in vertices] if ranges is None else [
                (vertices, triangles[first : first + count]) for first, count in ranges.tolist()
            ]  # fmt: skip
            self._layers = [peel(*mesh, (width, height), **options) for mesh in meshes]
        shown = [torch.from_numpy(layers.planes[0][k]) for layers in self._layers]
        ids = torch.stack(shown) if shown else torch.empty((0, height, width), dtype=torch.int32)
        self._n_shown += 1
        rast, rast_db = operators.rasterize(pos, tri, ranges, ids, (height, width, self._context.output_db, threads))
        return rast, rast_db if self._grad_db else rast_db.detach()


def interpolate(
    attr: Tensor,
    rast: Tensor,
    tri: Tensor,
    rast_db: Tensor | None = None,
    diff_attrs: str | Sequence[int] | None = None,
) -> tuple[Tensor, Tensor]:
    """Return attributes of the vertices at each pixel, and how they change from pixel to pixel.

    Parameters
    ----------
    attr : tensor of float32 or float64, shape (V, K), (1, V, K) or (B, V, K)
        A row a vertex.
    rast : tensor, shape (B, H, W, 4)
        What `rasterize` returned.
    tri : tensor of int32 or int64, shape (T, 3)
        Indices of rows of `attr`, in the order of the triangles that were drawn.
    rast_db : tensor, shape (B, H, W, 4), optional
        What `rasterize` returned; needed for `diff_attrs`.
    diff_attrs : "all" or sequence of int, optional
        Of which attributes the derivatives are wanted.

    Returns
    -------
    out : tensor, shape (B, H, W, K)
        Perspective-correct; 0 where there is no triangle.
    out_da : tensor, shape (B, H, W, 2 * len(diff_attrs))
        dA/dX and dA/dY of each attribute asked for; (B, H, W, 0) for none.

    Raises
    ------
    TypeError
        For what is no tensor, is not on the CPU, or has a wrong dtype.
    ValueError
        For a wrong shape, or `diff_attrs` without `rast_db`.
    IndexError
        For an attribute, a vertex or a triangle that does not exist.

    Examples
    --------
    >>> pos = torch.tensor([[[-1.0, -1, 0, 1], [3, -1, 0, 1], [-1, 3, 0, 1]]])
    >>> tri = torch.tensor([[0, 1, 2]])
    >>> rast, rast_db = rasterize(RasterizeContext(), pos, tri, (1, 2))
    >>> interpolate(torch.tensor([[0.0], [8.0], [0.0]]), rast, tri, rast_db, "all")
    (tensor([[[[1.],
              [3.]]]]), tensor([[[[2., 0.],
              [2., 0.]]]]))
    """
    check("attr", attr, "(V, K), (1, V, K) or (B, V, K)", attr_is := is_tensor(attr) and attr.ndim in (2, 3), KINDS)
    check("rast", rast, "(B, H, W, 4)", is_tensor(rast) and rast.ndim == 4 and rast.shape[3] == 4)
    n_pictures = rast.shape[0]
    check(
        "attr", attr, f"(V, K), (1, V, K) or ({n_pictures}, V, K)", attr_is and len_of(attr) in (1, n_pictures), KINDS
    )
    check_tri(tri)
    wanted = as_diff_attrs(diff_attrs, attr.shape[-1])
    if wanted and (rast_db is None or rast_db.shape != rast.shape):
        got = "None" if rast_db is None else tuple(rast_db.shape)
        raise ValueError(f"rast_db must have shape {tuple(rast.shape)} when diff_attrs is given, got {got}")
    given, points_of, slopes = same_dtype(attr, (rast, len(tri)), rast_db if wanted else None)
    attrs = given if given.ndim == 3 else given[None]
    out, out_da = operators.interpolate(attrs, points_of, tri, slopes, wanted)
    return out, out_da


def texture(
    tex: Tensor,
    uv: Tensor,
    uv_da: Tensor | None = None,
    mip_level_bias: Tensor | None = None,
    mip: Sequence[Tensor] | None = None,
    filter_mode: FilterModeOption = "auto",
    boundary_mode: BoundaryOption = "wrap",
    max_mip_level: int | None = None,
) -> Tensor:
    """Return what a texture is at each pixel.

    Parameters
    ----------
    tex : tensor of float32 or float64, shape (B, Ht, Wt, C) or (1, Ht, Wt, C); of a cube map (B or 1, 6, N, N, C)
        Row 0 is at v = 0. The centre of texel (i, j) is at u = (j + 0.5) / Wt, v = (i + 0.5) / Ht. The faces of a cube
        are those of +x, -x, +y, -y, +z and -z, laid out as OpenGL has them.
    uv : tensor, shape (B, H, W, 2); of a cube map (B, H, W, 3)
        Where to look; in a cube map along a direction of any length.
    uv_da : tensor, shape (B, H, W, 4), or (B, H, W, 6), optional
        du/dX, du/dY, dv/dX, dv/dY, of `interpolate`; of a cube map those of x, y and z.
    mip_level_bias : tensor, shape (B, H, W), optional
        Is added to the level; without `uv_da` it is the level.
    mip : sequence of tensors, optional
        The levels after `tex`, each half as high and wide: of `texture_construct_mip`, or your own.
    filter_mode : "auto", "nearest", "linear", "linear-mipmap-nearest" or "linear-mipmap-linear"
        "auto" is "linear-mipmap-linear" where `uv_da` or `mip_level_bias` is given, else "linear".
    boundary_mode : "wrap", "clamp", "zero" or "cube"
        What lies beyond 0 and 1. "cube": `tex` is a cube map, and colours run on across its edges.
    max_mip_level : int, optional
        The last level that is made and used.

    Returns
    -------
    tensor, shape (B, H, W, C)
        The level of a pixel is log2 of the longer axis of its footprint in texels. 0 where a direction has no length.

    Raises
    ------
    TypeError
        For what is no tensor, is not on the CPU, or has a wrong dtype.
    ValueError
        For a wrong shape, an unknown mode, a mipmap filter without `uv_da` or `mip_level_bias`, or a side of a level
        that is odd and not 1.

    Notes
    -----
    Beyond an edge of a cube lies the next face; beyond a corner nothing does, and the mean of the other three texels
    stands for the fourth. The table of faces is that of the OpenGL 4.6 specification, 8.13.

    Examples
    --------
    >>> tex = torch.tensor([[0.0, 4.0]]).reshape(1, 1, 2, 1)
    >>> u = torch.tensor([0.25, 0.5, 0.75, 1.0])
    >>> texture(tex, torch.stack([u, u], -1).reshape(1, 1, 4, 2)).flatten()
    tensor([0., 2., 4., 2.])
    """
    check_texture(check, tex, uv, uv_da, mip_level_bias, boundary_mode, (KINDS,))
    has_level = uv_da is not None or mip_level_bias is not None
    if filter_mode == "auto":
        filter_mode = "linear-mipmap-linear" if has_level else "linear"
    how = as_filter(filter_mode, get_args(FilterModeOption), has_level=has_level)
    made: Sequence[Tensor] = ()
    if how > TexelFilter.LINEAR:
        is_cube = boundary_mode == "cube"
        made = texture_construct_mip(tex, max_mip_level, is_cube) if mip is None else as_mip(tex, mip, max_mip_level)
    at, footprint, bias, *levels = same_dtype(uv, uv_da if made else None, mip_level_bias if made else None, tex, *made)
    how = how if made else min(how, TexelFilter.LINEAR)
    out: Tensor = operators.texture(at, footprint, bias, levels, (how, TexelsBeyond[boundary_mode.upper()]))
    return out


def texture_construct_mip(tex: Tensor, max_mip_level: int | None = None, cube_mode: bool = False) -> list[Tensor]:
    """Return the levels of a texture after the texture itself, for `mip` of `texture`.

    Parameters
    ----------
    tex : tensor of float32 or float64, shape (B, Ht, Wt, C), or (B, 6, N, N, C) with `cube_mode`
        Level 0.
    max_mip_level : int, optional
        The last level; without it the last is 1 x 1.
    cube_mode : bool
        Whether it is a cube map, whose faces are halved each by itself.

    Returns
    -------
    list of tensors, shapes (B, Ht/2, Wt/2, C), (B, Ht/4, Wt/4, C) and so on; (B, 6, N/2, N/2, C) and so on
        Each texel is the mean of those that it covers.

    Raises
    ------
    TypeError
        For what is no tensor, is not on the CPU, or has a wrong dtype.
    ValueError
        For a wrong shape, a side of a level that is odd and not 1, or a level below 0.

    Examples
    --------
    >>> [tuple(level.shape) for level in texture_construct_mip(torch.zeros(1, 2, 8, 3))]
    [(1, 1, 4, 3), (1, 1, 2, 3), (1, 1, 1, 3)]
    """
    if cube_mode:
        check("tex", tex, "(B, 6, N, N, C)", is_cube_map(tex), KINDS)
    else:
        check("tex", tex, "(B, Ht, Wt, C)", is_tensor(tex) and tex.ndim == 4 and 0 not in tex.shape[1:], KINDS)
    levels: list[Tensor] = []
    last = tex
    for axes in halved_axes(tex.shape, max_mip_level):
        for axis in axes:
            last = last.unflatten(axis, (-1, 2)).mean(axis)
        levels.append(last)
    return levels


def antialias(
    color: Tensor,
    rast: Tensor,
    pos: Tensor,
    tri: Tensor,
    topology_hash: Tensor | None = None,
    pos_gradient_boost: float = 1.0,
    *,
    edges: EdgesOption = "silhouette",
) -> Tensor:
    """Return a picture with smooth silhouettes, which lets gradients of a silhouette reach `pos`.

    Parameters
    ----------
    color : tensor of float32 or float64, shape (B, H, W, C)
        The picture.
    rast : tensor, shape (B, H, W, 4)
        What `rasterize` returned.
    pos : tensor, shape (B, V, 4), (1, V, 4) or (V, 4)
        What was drawn.
    tri : tensor of int32 or int64, shape (T, 3)
        What was drawn.
    topology_hash : tensor, shape (T, 3), optional
        Of `antialias_construct_topology_hash`, for the same `tri`; saves its time.
    pos_gradient_boost : float
        Multiplies the gradients of `pos`.
    edges : {"silhouette", "area", "straight-through"}
        "silhouette": the rule of nvdiffrast. "area": by the exact area of pixels, at all edges where a surface ends or
        folds, those of triangles below a pixel, too. "straight-through": the picture stays as it is, and gradients are
        those of Pidhorskyi et al.

    Returns
    -------
    tensor, shape (B, H, W, C)
        Pixels beside a silhouette are blended with their neighbour on the other side of it.

    Raises
    ------
    TypeError
        For what is no tensor, is not on the CPU, or has a wrong dtype.
    ValueError
        For a wrong shape.
    IndexError
        For a triangle that names a vertex that does not exist.

    Notes
    -----
    Two neighbours in a row or column that show different triangles are looked at. The nearer triangle is the one with
    the smaller z/w. Of its edges those count that are silhouettes (no triangle lies on the other side), are steeper
    than 45 degrees for neighbours in a row (flatter for a column), and pass between the two centres. With t the way
    from the centre of the nearer triangle's pixel to the edge, in pixels, the other pixel takes the share t - 1/2 of
    the nearer's colour; below 1/2 the nearer's pixel takes 1/2 - t of the other's. A triangle with a corner behind the
    eye is left as it is; at an edge of three or more triangles each looks at the next.

    With "area" a walk from the nearer centre towards the other goes from triangle to triangle until the surface ends or
    folds; each of the two pixels takes the exact share of it that lies beyond the line of that edge, and gradients are
    those of that share. Near 45 degrees rows and columns share an edge, by a weight that counts as constant.
    `docs/design/gradients.md` tells what is exact and what is not.

    With "straight-through" a triangle that hangs over its neighbour gets (gA + gB) (A - B) / 2 as the gradient of its
    point at the pixel's centre, A and B being the colours of the two pixels, gA and gB their gradients; where two
    triangles cut each other it gets none.

    References
    ----------
    S. Laine et al., Modular Primitives for High-Performance Differentiable Rendering, 2020; S. Pidhorskyi et al.,
    Rasterized Edge Gradients, 2024; T. Auzinger, M. Guthe, S. Jeschke, Analytic Anti-Aliasing of Linear Functions on
    Polytopes, 2012.

    Examples
    --------
    >>> pos = torch.tensor([[[-1.0, -2, 0, 1], [0.25, -2, 0, 1], [0.25, 4, 0, 1], [-1, 4, 0, 1]]])
    >>> tri = torch.tensor([[0, 1, 2], [0, 2, 3]])
    >>> rast, _ = rasterize(RasterizeContext(), pos, tri, (1, 4))
    >>> antialias((rast[..., 3:] > 0).float(), rast, pos, tri).flatten()
    tensor([1.0000, 1.0000, 0.5000, 0.0000])
    """
    check("color", color, "(B, H, W, C)", is_tensor(color) and color.ndim == 4, KINDS)
    wish = (*color.shape[:3], 4)
    check("rast", rast, str(tuple(wish)), is_tensor(rast) and tuple(rast.shape) == wish)
    fits = is_tensor(pos) and pos.ndim in (2, 3) and pos.shape[-1] == 4 and len_of(pos) in (1, len(color))
    check("pos", pos, f"(V, 4), (1, V, 4) or ({len(color)}, V, 4)", fits)
    check_tri(tri)
    rule = as_rule(edges)
    across = checked_hash(topology_hash, tri)
    given, points_of, mesh = same_dtype(color, (rast, len(tri)), pos if pos.ndim == 3 else pos[None])
    if pos_gradient_boost != 1:
        still = mesh.detach()
        mesh = still + pos_gradient_boost * (mesh - still)
    out: Tensor = operators.antialias(given, points_of, mesh, tri, across, (rule,))[0]
    return out.to(color.dtype)


def render(
    glctx: RasterizeContext,
    pos: Tensor,
    tri: Tensor,
    attr: Tensor,
    resolution: Sequence[int],
    topology_hash: Tensor | None = None,
    *,
    edges: EdgesOption = "area",
) -> Tensor:
    """Return pictures of a mesh for a loss of your own: `rasterize`, `interpolate` and `antialias` in one.

    It takes 0.5 to 0.75 of the time of the functions one after the other, and keeps the ids of pixels, their runs and
    edges instead of pictures. Its gradients differ from theirs by rounding, below 1e-6 of the largest.

    Parameters
    ----------
    glctx : RasterizeContext
        As in `rasterize`.
    pos : tensor of float32 or float64, shape (B, V, 4)
        As in `rasterize`.
    tri : tensor of int32 or int64, shape (T, 3)
        Indices of rows of `pos` and of `attr`.
    attr : tensor of float32 or float64, shape (V, K), (1, V, K) or (B, V, K)
        Colours, or other numbers, of the vertices; a column of ones for the silhouette.
    resolution : (int, int)
        Height and width.
    topology_hash : tensor, shape (T, 3), optional
        As in `antialias`.
    edges : {"area", "silhouette", "straight-through"}
        As in `antialias`.

    Returns
    -------
    tensor, shape (B, H, W, K)
        Row 0 is the bottom row; 0 where nothing is. Gradients reach `pos` and `attr`.

    Raises
    ------
    TypeError
        For what is no tensor, is not on the CPU, or has a wrong dtype.
    ValueError
        For a wrong shape, an unknown option, or a vertex in use that is not finite.
    IndexError
        For a triangle that names a vertex or a row of `attr` that does not exist.

    See Also
    --------
    photometric_loss : the same with the mean of squared differences from other pictures, which makes no picture.

    Examples
    --------
    >>> pos = torch.tensor([[[-1.0, -2, 0, 1], [0.25, -2, 0, 1], [0.25, 4, 0, 1], [-1, 4, 0, 1]]])
    >>> tri = torch.tensor([[0, 1, 2], [0, 2, 3]])
    >>> render(RasterizeContext(), pos, tri, torch.ones(4, 1), (1, 4)).flatten()
    tensor([1.0000, 1.0000, 0.5000, 0.0000])
    """
    check_drawn(glctx, pos, tri, attr)
    height, width = as_pair("resolution", resolution)
    across = checked_hash(topology_hash, tri)
    mesh, values = same_dtype(pos, attr if attr.ndim == 3 else attr[None])
    keeps = (
        not torch.compiler.is_compiling() and torch.is_grad_enabled() and (mesh.requires_grad or values.requires_grad)
    )
    options = height, width, as_rule(edges), glctx.threads or 0, keeps
    drawn: Tensor = operators.render(mesh, tri, values, across, options)[0]
    return drawn


def photometric_loss(
    glctx: RasterizeContext,
    pos: Tensor,
    tri: Tensor,
    attr: Tensor,
    target: Tensor,
    topology_hash: Tensor | None = None,
    *,
    loss: LossOption = "l2",
    edges: EdgesOption = "area",
) -> Tensor:
    """Return how far pictures of a mesh are off others: `rasterize`, `interpolate`, `antialias` and a loss in one.

    Rows are drawn, compared and led back a few at a time: no picture is kept, so it takes less time and memory than
    the functions one after the other. Its gradients differ from theirs by rounding, below 1e-6 of the largest.

    Parameters
    ----------
    glctx : RasterizeContext
        As in `rasterize`.
    pos : tensor of float32 or float64, shape (B, V, 4)
        As in `rasterize`.
    tri : tensor of int32 or int64, shape (T, 3)
        Indices of rows of `pos` and of `attr`.
    attr : tensor of float32 or float64, shape (V, K), (1, V, K) or (B, V, K)
        Colours, or other numbers, of the vertices; ones for a silhouette.
    target : tensor, shape (B, H, W, K)
        What the pictures are to be; row 0 is the bottom row. It gets no gradient.
    topology_hash : tensor, shape (T, 3), optional
        As in `antialias`.
    loss : {"l2"}
        The mean of the squared differences.
    edges : {"area", "silhouette", "straight-through"}
        As in `antialias`.

    Returns
    -------
    tensor, shape ()
        Gradients reach `pos` and `attr`.

    Raises
    ------
    TypeError
        For what is no tensor, is not on the CPU, or has a wrong dtype.
    ValueError
        For a wrong shape, an unknown option, or a vertex in use that is not finite.
    IndexError
        For a triangle that names a vertex or a row of `attr` that does not exist.

    Examples
    --------
    >>> pos = torch.tensor([[[-1.0, -1, 0, 1], [3, -1, 0, 1], [-1, 3, 0, 1]]], requires_grad=True)
    >>> context, tri = RasterizeContext(), torch.tensor([[0, 1, 2]])
    >>> photometric_loss(context, pos, tri, torch.ones(3, 1), torch.zeros(1, 2, 2, 1)).item()
    1.0
    """
    check_drawn(glctx, pos, tri, attr)
    b, k = pos.shape[0], attr.shape[-1]
    fits = is_tensor(target) and target.ndim == 4 and target.shape[0] == b and target.shape[3] == k
    check("target", target, f"({b}, H, W, {k})", fits)
    if loss not in get_args(LossOption):
        raise ValueError(f"loss must be 'l2', got {loss!r}: render() gives the pictures for a loss of your own")
    across = checked_hash(topology_hash, tri)
    mesh, values, wished = same_dtype(pos, attr if attr.ndim == 3 else attr[None], target.detach())
    options = as_rule(edges), glctx.threads or 0
    found: Tensor = operators.squares(mesh, tri, values, wished, across, options)[0]
    return found


def checked_hash(topology_hash: Tensor | None, tri: Tensor) -> Tensor | None:
    """Return what lies across edges, of the shape of `tri`."""
    if topology_hash is None or topology_hash.shape == tri.shape:
        return topology_hash
    raise ValueError(f"topology_hash must have shape {tuple(tri.shape)}, got {tuple(topology_hash.shape)}")


def antialias_construct_topology_hash(tri: Tensor) -> Tensor:
    """Return which triangle lies across each edge of each triangle, for `topology_hash` of `antialias`.

    Without it `antialias` looks whether it knows `tri`: it keeps those of the last few.

    Parameters
    ----------
    tri : tensor of int32 or int64, shape (T, 3)
        Indices of vertices.

    Returns
    -------
    tensor of int32, shape (T, 3)
        Column i belongs to the edge that corner i is not on: 3 times the other triangle there plus its corner that is
        not on it, -1 if there is none; -2 less that where the two are wound differently, or there are more.

    Raises
    ------
    TypeError, ValueError, IndexError
        As in `rasterize`.

    Examples
    --------
    >>> antialias_construct_topology_hash(torch.tensor([[0, 1, 2], [2, 1, 3]]))
    tensor([[ 5, -1, -1],
            [-1, -1,  0]], dtype=torch.int32)
    """
    check_tri(tri)
    across: Tensor = operators.halves_across(tri)
    return across


def check_drawn(glctx: object, pos: Tensor, tri: Tensor, attr: Tensor) -> None:
    """Check what `render` is given."""
    check_context(glctx)
    check("pos", pos, "(B, V, 4)", is_tensor(pos) and pos.ndim == 3 and pos.shape[2] == 4)
    check_tri(tri)
    is_table = is_tensor(attr) and attr.ndim in (2, 3) and len_of(attr) in (1, pos.shape[0])
    check("attr", attr, f"(V, K), with 1 or {pos.shape[0]} before", is_table)


def check_context(glctx: object) -> None:
    """Check the first argument of functions that draw."""
    if not isinstance(glctx, RasterizeContext):
        raise TypeError(f"glctx must be a RasterizeContext, got {type(glctx).__name__}")


def check_mesh(glctx: object, pos: Tensor, tri: Tensor, ranges: Tensor | None) -> None:
    """Check what `rasterize` is given."""
    check_context(glctx)
    if ranges is None:
        check("pos", pos, "(B, V, 4), or (V, 4) with ranges", is_tensor(pos) and pos.ndim == 3 and pos.shape[2] == 4)
        check_tri(tri)
        return
    check("pos", pos, "(V, 4) with ranges", is_tensor(pos) and pos.ndim == 2 and pos.shape[1] == 4)
    check_tri(tri)
    check("ranges", ranges, "(B, 2)", is_tensor(ranges) and ranges.ndim == 2 and ranges.shape[1] == 2, INTS)
    for i, (first, count) in enumerate(ranges.tolist()):
        if not 0 <= first <= first + count <= len(tri):
            raise ValueError(f"ranges must lie within the {len(tri)} triangles, row {i} is {[first, count]}")
