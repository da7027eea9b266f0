"""PyTorch tensors on the CPU, in the calls and the conventions of nvdiffrast: `import topleft.torch as dr`.

In and out: tensors of float32 (or float64) on the CPU, read without a copy. Each function is one call of the engine,
which also computes its gradients, in float64, with the same bits for every number of threads. They are custom operators
of PyTorch (``torch.ops.topleft``), so `torch.compile` and `torch.vmap` take them. Needs PyTorch 2.5:
``pip install 'topleft[torch]'``.

What differs from the rest of `topleft`: row 0 is the bottom row, resolutions are (height, width), ids are 1 more and
stand in a channel of floats, depth is z/w in -1..1, and row 0 of a texture is v = 0.

Based on: Laine, S., Hellsten, J., Karras, T., Seol, Y., Lehtinen, J., Aila, T., "Modular Primitives for
High-Performance Differentiable Rendering", ACM Transactions on Graphics, 2020.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from topleft import DepthLayers, peel
from topleft import rasterize as draw
from topleft._core.base.arrays import as_pair, check_rows
from topleft._core.base.threads import parse_threads
from topleft._core.gradients import tensors
from topleft._core.gradients.bands import MIN_PX_PER_THREAD
from topleft._core.gradients.tensors import EdgeRule, PixelGrid, TexelFilter, TexelLook, TexelsBeyond
from topleft.errors import MissingPackageError
from topleft.typing import BoundaryOption, EdgesOption, FilterModeOption

try:
    import torch
    from torch import Tensor
except ImportError:
    raise MissingPackageError("topleft.torch needs PyTorch: pip install torch") from None

__all__ = [
    "DepthPeeler",
    "RasterizeContext",
    "RasterizeCudaContext",
    "RasterizeGLContext",
    "antialias",
    "antialias_construct_topology_hash",
    "get_log_level",
    "interpolate",
    "rasterize",
    "set_log_level",
    "texture",
    "texture_construct_mip",
]

#: The largest id that float32 counts up to; the bits of larger ones are counted on from there.
LAST_EXACT_ID = 1 << 24
BITS_OF_LAST = 0x4B800000

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
    derivatives are those of the vertices as given, computed in float64 and clamped: weights to a sum of at most 1, z/w
    to -1..1. float32 counts to 2**24: bits of larger ids are counted on from those of 2**24, as in nvdiffrast.

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
    ids = draw_ids(pos.detach(), tri, ranges, height, width, glctx.threads or 0)
    return points(glctx, pos, tri, ranges, ids, grad_db=grad_db)


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
        height, width = self._resolution
        k = self._n_shown
        if k == MOST_LAYERS:
            raise ValueError(f"a DepthPeeler has at most {MOST_LAYERS} layers")
        if k >= (len(self._layers[0]) if self._layers else 0):
            options: Any = {
                "layers": max(FIRST_LAYERS, 2 * k),
                "threads": threads_of(self._context.threads, width * height),
            }
            pos, tri, ranges = self._mesh
            self._layers = [peel(v, t, (width, height), **options) for v, t in each(pos.detach(), tri, ranges)]
        ids = torch.from_numpy(joined([layers.planes[0][k] for layers in self._layers], (height, width)))
        self._n_shown += 1
        return points(self._context, *self._mesh, ids, grad_db=self._grad_db)


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
    out, out_da = interpolate_values(attrs, points_of, tri, slopes, wanted)
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
    check_texture(tex, uv, uv_da, mip_level_bias, boundary_mode)
    has_level = uv_da is not None or mip_level_bias is not None
    if filter_mode == "auto":
        filter_mode = "linear-mipmap-linear" if has_level else "linear"
    if filter_mode not in ("nearest", "linear", "linear-mipmap-nearest", "linear-mipmap-linear"):
        raise ValueError(
            "filter_mode must be 'auto', 'nearest', 'linear', 'linear-mipmap-nearest' or 'linear-mipmap-linear', "
            f"got {filter_mode!r}"
        )
    made: Sequence[Tensor] = ()
    if filter_mode not in ("nearest", "linear"):
        if not has_level:
            raise ValueError(f"filter_mode={filter_mode!r} needs uv_da or mip_level_bias")
        is_cube = boundary_mode == "cube"
        made = texture_construct_mip(tex, max_mip_level, is_cube) if mip is None else as_mip(tex, mip, max_mip_level)
    at, footprint, bias, *levels = same_dtype(uv, uv_da if made else None, mip_level_bias if made else None, tex, *made)
    how = TexelFilter[filter_mode.replace("-", "_").upper()] if made else TexelFilter.LINEAR
    how = TexelFilter.NEAREST if filter_mode == "nearest" else how
    beyond = TexelsBeyond[boundary_mode.upper()]
    return look_up(levels, at, footprint, bias, int(how), int(beyond))


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
    if max_mip_level is not None and max_mip_level < 0:
        raise ValueError(f"max_mip_level must be at least 0, got {max_mip_level}")
    levels: list[Tensor] = []
    last = tex
    while max(last.shape[-3:-1]) > 1 and (max_mip_level is None or len(levels) < max_mip_level):
        for axis in (tex.ndim - 3, tex.ndim - 2):
            n = last.shape[axis]
            if n > 1 and n % 2:
                raise ValueError(
                    f"tex must have sides that halve down to level {len(levels) + 1}, got {tuple(tex.shape[-3:-1])}; "
                    f"max_mip_level={len(levels)} stops before"
                )
            last = last.unflatten(axis, (n // 2, 2)).mean(axis + 1) if n > 1 else last
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
    if edges not in get_args(EdgesOption):
        raise ValueError(f"edges must be 'silhouette', 'area' or 'straight-through', got {edges!r}")
    across = halves_across(tri) if topology_hash is None else topology_hash
    if across.shape != tri.shape:
        raise ValueError(f"topology_hash must have shape {tuple(tri.shape)}, got {tuple(across.shape)}")
    given, points_of, vertices = same_dtype(color, (rast, len(tri)), pos)
    rule, mesh = EdgeRule[edges.replace("-", "_").upper()], vertices if vertices.ndim == 3 else vertices[None]
    out = smooth(given, points_of, mesh, tri, across, int(rule), float(pos_gradient_boost))
    return out.to(color.dtype)


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
        not on it, -1 if there is none.

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
    return halves_across(tri)


# Operators: tensors to the engine and back. `threads` is that of a context, 0 where PyTorch's number counts.


def threads_of(threads: int | None, n_px: int) -> int:
    """Return how many threads draw some pixels: those asked for, or as many of PyTorch's as pay."""
    return threads or max(1, min(torch.get_num_threads(), n_px // MIN_PX_PER_THREAD))


def numpy_of(tensor: Tensor | None) -> Any:
    """Return the array that a tensor is, contiguous; None for None."""
    return None if tensor is None else tensor.detach().resolve_neg().contiguous().numpy()


def triangles_of(tri: Tensor, n_vertices: int) -> NDArray[np.int32]:
    """Return triangles whose vertices exist."""
    if tri.dtype == torch.int64 and tri.numel() and not -(2**31) <= int(tri.min()) <= int(tri.max()) < 2**31:
        raise IndexError(f"triangles must hold indices in [0, {n_vertices}), got {int(tri.min())} to {int(tri.max())}")
    array: NDArray[np.int32] = numpy_of(tri.to(torch.int32))
    check_rows(array, n_vertices)
    return array


def grid_of(tri: Tensor, pixels: Tensor, n_vertices: int) -> PixelGrid:
    """Return the pictures (B, H, W, ...) of triangles."""
    b, h, w = pixels.shape[:3]
    return PixelGrid(triangles_of(tri, n_vertices), b, h, w, threads_of(0, b * h * w))


def each(pos: Tensor, tri: Tensor, ranges: Tensor | None) -> list[tuple[Any, Any]]:
    """Return of each picture its vertices and triangles; arrays share the memory of the tensors."""
    vertices, triangles = numpy_of(pos), numpy_of(tri)
    if ranges is None:
        return [(one, triangles) for one in vertices]
    return [(vertices, triangles[first : first + count]) for first, count in ranges.tolist()]


def joined(pictures: list[NDArray[np.int32]], shape: tuple[int, ...]) -> NDArray[np.int32]:
    """Return pictures as one array; of one picture itself."""
    return (
        pictures[0][None] if len(pictures) == 1 else np.stack(pictures) if pictures else np.empty((0, *shape), np.int32)
    )


def operator(signature: str, fake: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Make an operator of a function; `fake` tells the shapes of its results. A sample of `torch.vmap` is a call."""

    def made(function: Callable[..., Any]) -> Any:
        op = torch.library.custom_op(f"topleft::{function.__name__}", function, mutates_args=(), schema=signature)
        op.register_fake(fake)

        def one_by_one(info: Any, in_dims: Sequence[Any], *args: Any) -> tuple[Any, Any]:
            found = [op(*sample(args, in_dims, i)) for i in range(info.batch_size)]
            if isinstance(found[0], Tensor):
                return torch.stack(found), 0
            return type(found[0])(map(torch.stack, zip(*found, strict=True))), type(found[0])(0 for _ in found[0])

        op.register_vmap(one_by_one)
        return op

    return made


def sample(args: Sequence[Any], dims: Sequence[Any], i: int) -> list[Any]:
    """Return the arguments of one sample of a batch."""
    return [
        sample(arg, dim, i) if isinstance(arg, list | tuple) and isinstance(dim, list | tuple)
        else arg if dim is None else arg.select(dim, i)
        for arg, dim in zip(args, dims, strict=True)
    ]  # fmt: skip


def once(*_: Any) -> None:
    """Refuse gradients of gradients."""
    raise NotImplementedError("topleft.torch has first derivatives: gradients of its gradients are not computed")


def like(tensor: Tensor | None, other: Tensor) -> Tensor:
    """Return memory as a tensor has it, or none."""
    return other.new_empty(0) if tensor is None else torch.empty_like(tensor, memory_format=torch.contiguous_format)


def tensor_of(array: Any, other: Tensor) -> Tensor:
    """Return the tensor that an array is, without elements for None."""
    return other.new_empty(0) if array is None else torch.from_numpy(array)


@operator(
    "(Tensor pos, Tensor tri, Tensor? ranges, int height, int width, int threads) -> Tensor",
    lambda pos, tri, ranges, height, width, threads: pos.new_empty(  # noqa: ARG005
        (len(pos if ranges is None else ranges), height, width), dtype=torch.int32
    ),
)
def draw_ids(pos: Tensor, tri: Tensor, ranges: Tensor | None, height: int, width: int, threads: int) -> Tensor:
    """Return which triangle of its range shows in each pixel, int32 (B, H, W), -1 for none; row 0 on top."""
    n = threads_of(threads, height * width)
    drawn = [draw(v, t, (width, height), threads=n).triangle for v, t in each(pos, tri, ranges)]
    return torch.from_numpy(joined(drawn, (height, width)))


@operator(
    "(Tensor pos, Tensor tri, Tensor ids, Tensor? ranges, bool with_db) -> (Tensor, Tensor)",
    lambda pos, tri, ids, ranges, with_db: (  # noqa: ARG005
        pos.new_empty((*ids.shape, 4)),
        pos.new_empty((*ids.shape, 4 if with_db else 0)),
    ),
)
def points_of_ids(pos: Tensor, tri: Tensor, ids: Tensor, ranges: Tensor | None, with_db: bool) -> tuple[Tensor, Tensor]:
    """Return `rast` and `rast_db`."""
    grid = grid_of(tri, ids, pos.shape[-2])
    firsts = [0] * len(ids) if ranges is None else ranges[:, 0].tolist()
    vertices = numpy_of(pos if ranges is None else pos[None])
    pictures = list(zip(numpy_of(ids), firsts, strict=True))
    rast, rast_db = tensors.points(grid, vertices, pictures, is_flipped=True, with_db=with_db)
    return torch.from_numpy(rast), torch.from_numpy(rast_db)


@operator(
    "(Tensor pos, Tensor tri, Tensor rast, Tensor g_rast, Tensor? g_db) -> Tensor",
    lambda pos, tri, rast, g_rast, g_db: like(pos, pos),  # noqa: ARG005
)
def points_vjp(pos: Tensor, tri: Tensor, rast: Tensor, g_rast: Tensor, g_db: Tensor | None) -> Tensor:
    """Return the gradient of `pos`."""
    vertices = pos if pos.ndim == 3 else pos[None]
    slopes = numpy_of(g_db) if g_db is not None and g_db.numel() else None
    grid = grid_of(tri, rast, pos.shape[-2])
    found = tensors.points_vjp(grid, numpy_of(vertices), numpy_of(rast), numpy_of(g_rast), slopes)
    return torch.from_numpy(found).reshape(pos.shape)


@operator(
    "(Tensor attr, Tensor rast, Tensor tri, Tensor? rast_db, int[] wanted) -> (Tensor, Tensor)",
    lambda attr, rast, tri, rast_db, wanted: (  # noqa: ARG005
        attr.new_empty((*rast.shape[:3], attr.shape[2])),
        attr.new_empty((*rast.shape[:3], 2 * len(wanted))),
    ),
)
def interpolate_values(
    attr: Tensor, rast: Tensor, tri: Tensor, rast_db: Tensor | None, wanted: list[int]
) -> tuple[Tensor, Tensor]:
    """Return attributes, and what they change by."""
    grid = grid_of(tri, rast, attr.shape[1])
    out, out_da = tensors.values(grid, numpy_of(attr), numpy_of(rast), numpy_of(rast_db), wanted)
    return torch.from_numpy(out), torch.from_numpy(out_da)


@operator(
    "(Tensor attr, Tensor rast, Tensor tri, Tensor? rast_db, int[] wanted, Tensor g_out, Tensor? g_da)"
    " -> (Tensor, Tensor, Tensor)",
    lambda attr, rast, tri, rast_db, wanted, g_out, g_da: (  # noqa: ARG005
        like(attr, attr),
        like(rast, attr),
        like(rast if g_da is not None else None, attr),
    ),
)
def interpolate_vjp(
    attr: Tensor,
    rast: Tensor,
    tri: Tensor,
    rast_db: Tensor | None,
    wanted: list[int],
    g_out: Tensor,
    g_da: Tensor | None,
) -> tuple[Tensor, Tensor, Tensor]:
    """Return the gradients of `attr`, `rast` and `rast_db`."""
    grid = grid_of(tri, rast, attr.shape[1])
    slopes = numpy_of(rast_db if g_da is not None else None)
    given = numpy_of(attr), numpy_of(rast), numpy_of(g_out), slopes, numpy_of(g_da)
    g_attr, g_rast, g_db = tensors.values_vjp(grid, *given, wanted)
    return torch.from_numpy(g_attr), torch.from_numpy(g_rast), tensor_of(g_db, attr)


def look_of(
    levels: Sequence[Tensor], uv: Tensor, uv_da: Tensor | None, bias: Tensor | None, how: int, beyond: int
) -> TexelLook:
    """Return what the engine looks up."""
    where = numpy_of(uv), numpy_of(uv_da), numpy_of(bias)
    return TexelLook(
        [numpy_of(one) for one in levels],
        TexelFilter(how),
        TexelsBeyond(beyond),
        *where,
        threads_of(0, uv[..., 0].numel()),
    )


@operator(
    "(Tensor[] levels, Tensor uv, Tensor? uv_da, Tensor? bias, int how, int beyond) -> Tensor",
    lambda levels, uv, uv_da, bias, how, beyond: uv.new_empty((*uv.shape[:3], levels[0].shape[-1])),  # noqa: ARG005
)
def look_up(
    levels: Sequence[Tensor], uv: Tensor, uv_da: Tensor | None, bias: Tensor | None, how: int, beyond: int
) -> Tensor:
    """Return a texture at each pixel."""
    return torch.from_numpy(tensors.texels(look_of(levels, uv, uv_da, bias, how, beyond)))


@operator(
    "(Tensor[] levels, Tensor uv, Tensor? uv_da, Tensor? bias, int how, int beyond, Tensor g_out) -> Tensor[]",
    lambda levels, uv, uv_da, bias, how, beyond, g_out: [  # noqa: ARG005
        *(like(one, uv) for one in levels), like(uv, uv), like(uv_da, uv), like(bias, uv)
    ],
)  # fmt: skip
def look_up_vjp(
    levels: Sequence[Tensor],
    uv: Tensor,
    uv_da: Tensor | None,
    bias: Tensor | None,
    how: int,
    beyond: int,
    g_out: Tensor,
) -> list[Tensor]:
    """Return the gradients of the levels, of uv, of the footprints and of the biases."""
    look = look_of(levels, uv, uv_da, bias, how, beyond)
    g_levels, *where = tensors.texels_vjp(look, numpy_of(g_out))
    return [*map(torch.from_numpy, g_levels), *(tensor_of(one, uv) for one in where)]


#: Triangles, and what lies across their edges, of the last calls.
known: deque[tuple[NDArray[np.int32], NDArray[np.int32]]] = deque(maxlen=4)


@operator("(Tensor tri) -> Tensor", lambda tri: tri.new_empty(tri.shape, dtype=torch.int32))
def halves_across(tri: Tensor) -> Tensor:
    """Return the triangle across each edge."""
    own = numpy_of(tri.to(torch.int32))
    for triangles, across in list(known):
        if triangles.shape == own.shape and np.array_equal(triangles, own):
            return torch.from_numpy(across.copy())
    found = tensors.halves_across(own)
    known.append((own.copy(), found))
    return torch.from_numpy(found.copy())


@operator(
    "(Tensor color, Tensor rast, Tensor pos, Tensor tri, Tensor across, int rule, float boost) -> Tensor",
    lambda color, rast, pos, tri, across, rule, boost: like(color, color),  # noqa: ARG005
)
def smooth(
    color: Tensor,
    rast: Tensor,
    pos: Tensor,
    tri: Tensor,
    across: Tensor,
    rule: int,
    boost: float,  # noqa: ARG001
) -> Tensor:
    """Return the picture with smooth silhouettes."""
    grid = grid_of(tri, rast, pos.shape[1])
    arrays = map(numpy_of, (pos, rast, across.to(torch.int32), color))
    return torch.from_numpy(tensors.smooth(grid, EdgeRule(rule), *arrays))


@operator(
    "(Tensor color, Tensor rast, Tensor pos, Tensor tri, Tensor across, int rule, Tensor g_out) -> (Tensor, Tensor)",
    lambda color, rast, pos, tri, across, rule, g_out: (like(color, color), like(pos, pos)),  # noqa: ARG005
)
def smooth_vjp(
    color: Tensor, rast: Tensor, pos: Tensor, tri: Tensor, across: Tensor, rule: int, g_out: Tensor
) -> tuple[Tensor, Tensor]:
    """Return the gradients of the colours and of `pos`."""
    grid = grid_of(tri, rast, pos.shape[1])
    arrays = map(numpy_of, (pos, rast, across.to(torch.int32), color, g_out))
    g_color, g_pos = tensors.smooth_vjp(grid, EdgeRule(rule), *arrays)
    return torch.from_numpy(g_color), torch.from_numpy(g_pos)


# What backward calls


def filled(gradient: Tensor | None, shape: Sequence[int], other: Tensor) -> Tensor:
    """Return a gradient, zeros for None."""
    return other.new_zeros(shape) if gradient is None else gradient


def keep_points(ctx: Any, inputs: Sequence[Any], output: Sequence[Tensor]) -> None:
    """Keep what `points_vjp` takes."""
    ctx.set_materialize_grads(False)
    ctx.save_for_backward(inputs[0], inputs[1], output[0])


def pull_points(ctx: Any, g_rast: Tensor | None, g_db: Tensor | None) -> tuple[Any, ...]:
    """Return the gradients of what `points_of_ids` takes."""
    pos, tri, rast = ctx.saved_tensors
    return points_vjp(pos, tri, rast, filled(g_rast, rast.shape, rast), g_db), None, None, None, None


def keep_values(ctx: Any, inputs: Sequence[Any], output: Sequence[Tensor]) -> None:  # noqa: ARG001
    """Keep what `interpolate_vjp` takes."""
    ctx.set_materialize_grads(False)
    attr, rast, tri, rast_db, ctx.wanted = inputs
    ctx.save_for_backward(attr, rast, tri, rast_db)


def pull_values(ctx: Any, g_out: Tensor | None, g_da: Tensor | None) -> tuple[Any, ...]:
    """Return the gradients of what `interpolate_values` takes."""
    attr, rast, tri, rast_db = ctx.saved_tensors
    given = filled(g_out, (*rast.shape[:3], attr.shape[2]), attr)
    has_da = g_da is not None and len(ctx.wanted) > 0
    g_attr, g_rast, g_db = interpolate_vjp(attr, rast, tri, rast_db, ctx.wanted, given, g_da if has_da else None)
    return g_attr, g_rast, None, g_db if has_da else None, None


def keep_look(ctx: Any, inputs: Sequence[Any], output: Tensor) -> None:  # noqa: ARG001
    """Keep what `look_up_vjp` takes."""
    levels, uv, uv_da, bias, ctx.how, ctx.beyond = inputs
    ctx.n_levels = len(levels)
    ctx.save_for_backward(uv, uv_da, bias, *levels)


def pull_look(ctx: Any, g_out: Tensor) -> tuple[Any, ...]:
    """Return the gradients of what `look_up` takes."""
    uv, uv_da, bias, *levels = ctx.saved_tensors
    found = look_up_vjp(levels, uv, uv_da, bias, ctx.how, ctx.beyond, g_out)
    g_uv, g_da, g_bias = found[ctx.n_levels :]
    return (
        found[: ctx.n_levels], g_uv, None if uv_da is None else g_da, None if bias is None else g_bias, None, None
    )  # fmt: skip


def keep_edges(ctx: Any, inputs: Sequence[Any], output: Tensor) -> None:  # noqa: ARG001
    """Keep what `smooth_vjp` takes."""
    *kept, ctx.rule, ctx.boost = inputs
    ctx.save_for_backward(*kept)


def pull_edges(ctx: Any, g_out: Tensor) -> tuple[Any, ...]:
    """Return the gradients of what `smooth` takes."""
    g_color, g_pos = smooth_vjp(*ctx.saved_tensors, ctx.rule, g_out)
    return g_color, None, g_pos if ctx.boost == 1 else ctx.boost * g_pos, None, None, None, None


points_of_ids.register_autograd(pull_points, setup_context=keep_points)
interpolate_values.register_autograd(pull_values, setup_context=keep_values)
look_up.register_autograd(pull_look, setup_context=keep_look)
smooth.register_autograd(pull_edges, setup_context=keep_edges)
for vjp in (points_vjp, interpolate_vjp, look_up_vjp, smooth_vjp):
    vjp.register_autograd(once)


def points(
    glctx: RasterizeContext, pos: Tensor, tri: Tensor, ranges: Tensor | None, ids: Tensor, *, grad_db: bool
) -> tuple[Tensor, Tensor]:
    """Return `rast` and `rast_db` of ids (B, H, W) with row 0 on top."""
    rast, rast_db = points_of_ids(pos, tri, ids, ranges, glctx.output_db)
    return rast, rast_db if grad_db else rast_db.detach()


# Checks


def is_tensor(value: object) -> bool:
    """Tell whether this is a tensor of PyTorch."""
    return isinstance(value, Tensor)


def is_cube_map(tex: object) -> bool:
    """Tell whether this is a tensor (B, 6, N, N, C)."""
    return isinstance(tex, Tensor) and tex.ndim == 5 and tex.shape[1] == 6 and tex.shape[2] == tex.shape[3] > 0


def len_of(tensor: Tensor) -> int:
    """Return the number of pictures of (B, N, K), 1 for (N, K)."""
    return len(tensor) if tensor.ndim == 3 else 1


#: What tensors may hold, and the words for it; those of attributes, textures and colours come in half precision, too.
FLOATS = (torch.float32, torch.float64), "float32 or float64"
INTS = (torch.int32, torch.int64), "int32 or int64"
KINDS = (*FLOATS[0], torch.float16, torch.bfloat16), "float16, bfloat16, float32 or float64"


def check(name: str, value: object, wish: str, has_shape: object, kinds: tuple[tuple[Any, ...], str] = FLOATS) -> None:
    """Raise an error unless this is a tensor of numbers on the CPU that has the shape wished for."""
    if not isinstance(value, Tensor):
        raise TypeError(f"{name} must be a torch.Tensor, got {type(value).__name__}")
    if value.device.type != "cpu":
        raise TypeError(f"{name} must be on the CPU, got device {str(value.device)!r}: pass {name}.cpu()")
    if value.dtype not in kinds[0]:
        hint = f": pass {name}.float() / 255" if value.dtype == torch.uint8 else ""
        raise TypeError(f"{name} must be {kinds[1]}, got {value.dtype}{hint}")
    if not has_shape:
        raise ValueError(f"{name} must have shape {wish}, got {tuple(value.shape)}")


def check_tri(tri: Tensor) -> None:
    """Check triangles, but for their indices."""
    check("tri", tri, "(T, 3)", is_tensor(tri) and tri.ndim == 2 and tri.shape[1] == 3, INTS)


def check_mesh(glctx: object, pos: Tensor, tri: Tensor, ranges: Tensor | None) -> None:
    """Check what `rasterize` is given."""
    if not isinstance(glctx, RasterizeContext):
        raise TypeError(f"glctx must be a RasterizeContext, got {type(glctx).__name__}")
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


def same_dtype(*given: Any) -> list[Any]:
    """Return tensors in the widest of their dtypes, float32 at least; None stays.

    A pair is `rast` with the number of its triangles, whose ids change with the dtype.
    """
    kinds = [one[0].dtype if isinstance(one, tuple) else one.dtype for one in given if one is not None]
    dtype = torch.float64 if torch.float64 in kinds else torch.float32
    return [
        None if one is None else with_ids(one[0], one[1], dtype) if isinstance(one, tuple) else one.to(dtype)
        for one in given
    ]


def with_ids(rast: Tensor, n_triangles: int, dtype: torch.dtype) -> Tensor:
    """Return `rast` in another dtype: float32 counts up to 2**24, and from there on its bits are counted."""
    if rast.dtype == dtype or n_triangles <= LAST_EXACT_ID:
        return rast.to(dtype)
    bits = rast[..., 3].detach().contiguous().view(torch.int32).double() - BITS_OF_LAST + LAST_EXACT_ID
    ids = torch.where(rast[..., 3] > LAST_EXACT_ID, bits, rast[..., 3].double())
    return torch.cat([rast[..., :3].to(dtype), ids[..., None]], -1)


def check_texture(tex: Tensor, uv: Tensor, uv_da: Tensor | None, bias: Tensor | None, boundary_mode: str) -> None:
    """Check what `texture` is given."""
    if boundary_mode not in get_args(BoundaryOption):
        raise ValueError(f"boundary_mode must be 'wrap', 'clamp', 'zero' or 'cube', got {boundary_mode!r}")
    is_cube = boundary_mode == "cube"
    n_axes = 3 if is_cube else 2
    check("uv", uv, f"(B, H, W, {n_axes})", is_tensor(uv) and uv.ndim == 4 and uv.shape[3] == n_axes)
    n_pictures = len(uv)
    if is_cube:
        wish = f"(1, 6, N, N, C) or ({n_pictures}, 6, N, N, C) with boundary_mode 'cube'"
        fits = is_cube_map(tex) and len(tex) in (1, n_pictures)
    else:
        wish = f"(1, Ht, Wt, C) or ({n_pictures}, Ht, Wt, C)"
        fits = is_tensor(tex) and tex.ndim == 4 and len(tex) in (1, n_pictures) and 0 not in tex.shape[1:]
    check("tex", tex, wish, fits, KINDS)
    of_uv_da = (*uv.shape[:3], 2 * n_axes)
    for name, given, shape in (("uv_da", uv_da, of_uv_da), ("mip_level_bias", bias, tuple(uv.shape[:3]))):
        if given is not None:
            check(name, given, str(tuple(shape)), is_tensor(given) and tuple(given.shape) == tuple(shape))


def as_mip(tex: Tensor, mip: Sequence[Tensor], max_mip_level: int | None) -> Sequence[Tensor]:
    """Check the levels after a texture."""
    height, width = tex.shape[-3:-1]
    for k, level in enumerate(mip):
        height, width = max(1, height // 2), max(1, width // 2)
        wish = (*tex.shape[:-3], height, width, tex.shape[-1])
        check(f"mip[{k}]", level, str(wish), is_tensor(level) and tuple(level.shape) == wish, KINDS)
    return mip[:max_mip_level]


def as_diff_attrs(diff_attrs: str | Sequence[int] | None, n_attrs: int) -> list[int]:
    """Return the columns whose derivatives are wanted."""
    if diff_attrs is None:
        return []
    if isinstance(diff_attrs, str):
        if diff_attrs != "all":
            raise ValueError(f"diff_attrs must be 'all', integers or None, got {diff_attrs!r}")
        return list(range(n_attrs))
    wanted = [int(k) for k in diff_attrs]
    if any(not -n_attrs <= k < n_attrs for k in wanted):
        raise IndexError(f"diff_attrs must lie in [0, {n_attrs}), the number of attributes, got {wanted}")
    return [k % n_attrs for k in wanted]
