"""PyTorch tensors on the CPU, in the calls and the conventions of nvdiffrast: `import topleft.torch as dr`.

In and out: tensors of float32 (or float64) on the CPU, read without a copy. Which triangle shows in a pixel is decided
by the engine; what follows from it is computed by PyTorch, so gradients reach every input that nvdiffrast gives
gradients to. Needs PyTorch: ``pip install 'topleft[torch]'``.

What differs from the rest of `topleft`: row 0 is the bottom row, resolutions are (height, width), ids are 1 more and
stand in a channel of floats, depth is z/w in -1..1, and row 0 of a texture is v = 0.

Based on: Laine, S., Hellsten, J., Karras, T., Seol, Y., Lehtinen, J., Aila, T., "Modular Primitives for
High-Performance Differentiable Rendering", ACM Transactions on Graphics, 2020.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, get_args

import numpy as np

from topleft._core.base.arrays import as_checked_triangles, as_pair
from topleft._core.base.memory import empty
from topleft._core.base.threads import parse_threads
from topleft._core.raster.peel import DepthLayers, peel
from topleft._core.raster.verbs import rasterize as draw
from topleft.errors import MissingPackageError
from topleft.typing import BoundaryOption, FilterModeOption

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
    "interpolate",
    "rasterize",
    "texture",
    "texture_construct_mip",
]

#: The largest id that float32 counts up to; the bits of larger ones are counted on from there.
LAST_EXACT_ID = 1 << 24
BITS_OF_LAST = 0x4B800000

#: How far, in pixels, an edge may pass by a pair of pixels that it has separated: what the snap may have moved.
CROSSING_SLACK = 1 / 16

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
        How many threads draw; None: as many as the process may use. Never changes a bit.

    Raises
    ------
    ValueError
        For another device, or a number of threads below 1.

    Examples
    --------
    >>> RasterizeContext(threads=1).output_db
    True
    """

    def __init__(self, device: object = None, *, output_db: bool = True, threads: int | None = None) -> None:
        if device is not None and torch.device(device).type != "cpu":
            raise ValueError(f"device must be 'cpu' or None, got {str(device)!r}: topleft draws on the CPU alone")
        self.output_db = bool(output_db)
        self.threads = parse_threads(threads)


RasterizeCudaContext = RasterizeGLContext = RasterizeContext


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
    meshes = as_meshes(glctx, pos, tri, ranges)
    height, width = as_pair("resolution", resolution)
    ids = empty((len(meshes.slices), height, width), np.int32)
    for picture, vertices, first, triangles in meshes.each():
        shown = draw(vertices, triangles, (width, height), threads=glctx.threads).triangle[::-1]
        np.add(shown, np.where(shown < 0, 0, first), out=ids[picture])
    return points_of_ids(glctx, meshes, ids, grad_db=grad_db)


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
        self._context, self._meshes, self._grad_db = glctx, as_meshes(glctx, pos, tri, ranges), grad_db
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
            options: Any = {"layers": max(FIRST_LAYERS, 2 * k), "threads": self._context.threads}
            self._layers = [peel(v, t, (width, height), **options) for _, v, _, t in self._meshes.each()]
        ids = empty((len(self._meshes.slices), height, width), np.int32)
        for (picture, _, first, _), layers in zip(self._meshes.each(), self._layers, strict=True):
            shown = layers.triangle[::-1, :, k]
            np.add(shown, np.where(shown < 0, 0, first), out=ids[picture])
        self._n_shown += 1
        return points_of_ids(self._context, self._meshes, ids, grad_db=self._grad_db)


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
    check("attr", attr, "(V, K), (1, V, K) or (B, V, K)", attr_is := is_tensor(attr) and attr.ndim in (2, 3))
    check("rast", rast, "(B, H, W, 4)", is_tensor(rast) and rast.ndim == 4 and rast.shape[3] == 4)
    n_pictures, height, width = rast.shape[:3]
    check("attr", attr, f"(V, K), (1, V, K) or ({n_pictures}, V, K)", attr_is and len_of(attr) in (1, n_pictures))
    n_vertices, n_attrs = attr.shape[-2:]
    corners_of = as_tri(tri, n_vertices)
    wanted = as_diff_attrs(diff_attrs, n_attrs)
    if wanted and (rast_db is None or rast_db.shape != rast.shape):
        got = "None" if rast_db is None else tuple(rast_db.shape)
        raise ValueError(f"rast_db must have shape {tuple(rast.shape)} when diff_attrs is given, got {got}")

    id_plus_1 = ids_of(rast).reshape(-1)
    pixels = id_plus_1.nonzero().squeeze(1)
    i_tri = id_plus_1[pixels] - 1
    if len(i_tri) and not 0 <= int(i_tri.min()) <= int(i_tri.max()) < len(tri):
        raise IndexError(f"rast must hold ids of the {len(tri)} triangles of tri plus 1, got {int(i_tri.max()) + 1}")
    rows = corners_of[i_tri].long()
    if len_of(attr) > 1:
        rows = rows + (pixels // (height * width) * n_vertices)[:, None]
    a0, a1, a2 = attr.reshape(-1, n_attrs)[rows].unbind(1)
    u, v, _, _ = rast.reshape(-1, 4)[pixels].split(1, 1)
    out = spread(a2 + u * (a0 - a2) + v * (a1 - a2), pixels, (n_pictures, height, width))
    if not wanted or rast_db is None:
        return out, out.new_zeros((n_pictures, height, width, 0))
    by_u, by_v = (a0 - a2)[:, wanted, None], (a1 - a2)[:, wanted, None]
    du, dv = rast_db.reshape(-1, 2, 2)[pixels].unbind(1)
    out_da = (by_u * du[:, None] + by_v * dv[:, None]).flatten(1)
    return out, spread(out_da, pixels, (n_pictures, height, width))


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
    n_pictures = check_texture(tex, uv, uv_da, mip_level_bias, boundary_mode)
    has_level = uv_da is not None or mip_level_bias is not None
    if filter_mode == "auto":
        filter_mode = "linear-mipmap-linear" if has_level else "linear"
    if filter_mode not in ("nearest", "linear", "linear-mipmap-nearest", "linear-mipmap-linear"):
        raise ValueError(
            "filter_mode must be 'auto', 'nearest', 'linear', 'linear-mipmap-nearest' or 'linear-mipmap-linear', "
            f"got {filter_mode!r}"
        )
    shape = (*uv.shape[:3], tex.shape[-1])
    picture = torch.arange(n_pictures).repeat_interleave(uv.shape[1] * uv.shape[2])
    picture = torch.zeros_like(picture) if len(tex) == 1 else picture
    points, footprint = uv.reshape(-1, uv.shape[3]), uv_da
    if boundary_mode == "cube":
        picture, points, footprint = face_points(picture, points, uv_da)
    if filter_mode in ("nearest", "linear"):
        return look_up(tex, picture, points, boundary_mode, nearest=filter_mode == "nearest").reshape(shape)
    if not has_level:
        raise ValueError(f"filter_mode={filter_mode!r} needs uv_da or mip_level_bias")
    is_cube = boundary_mode == "cube"
    made = texture_construct_mip(tex, max_mip_level, is_cube) if mip is None else as_mip(tex, mip, max_mip_level)
    levels = [tex, *made]
    level = mip_level(tex, footprint, mip_level_bias).clamp(0, len(levels) - 1)
    if filter_mode == "linear-mipmap-nearest":
        level = level.round()
    out = torch.zeros((len(points), tex.shape[-1]), dtype=torch.result_type(tex, uv))
    for k, texels in enumerate(levels):
        share = 1 - (level - k).abs()
        near = (share > 0).nonzero().squeeze(1)
        found = look_up(texels, picture[near], points[near], boundary_mode, nearest=False)
        out = out.index_add(0, near, (share[near, None] * found).to(out.dtype))
    return out.reshape(shape)


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
        check("tex", tex, "(B, 6, N, N, C)", is_cube_map(tex))
    else:
        check("tex", tex, "(B, Ht, Wt, C)", is_tensor(tex) and tex.ndim == 4 and 0 not in tex.shape[1:])
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
    eye is left as it is; an edge of three or more triangles counts as that of the first two.

    Examples
    --------
    >>> pos = torch.tensor([[[-1.0, -2, 0, 1], [0.25, -2, 0, 1], [0.25, 4, 0, 1], [-1, 4, 0, 1]]])
    >>> tri = torch.tensor([[0, 1, 2], [0, 2, 3]])
    >>> rast, _ = rasterize(RasterizeContext(), pos, tri, (1, 4))
    >>> antialias((rast[..., 3:] > 0).float(), rast, pos, tri).flatten()
    tensor([1.0000, 1.0000, 0.5000, 0.0000])
    """
    check("color", color, "(B, H, W, C)", is_tensor(color) and color.ndim == 4)
    wish = (*color.shape[:3], 4)
    check("rast", rast, str(tuple(wish)), is_tensor(rast) and tuple(rast.shape) == wish)
    fits = is_tensor(pos) and pos.ndim in (2, 3) and pos.shape[-1] == 4 and len_of(pos) in (1, len(color))
    check("pos", pos, f"(V, 4), (1, V, 4) or ({len(color)}, V, 4)", fits)
    corners_of = as_tri(tri, pos.shape[-2])
    opposite_of = antialias_construct_topology_hash(tri) if topology_hash is None else topology_hash
    if opposite_of.shape != tri.shape:
        raise ValueError(f"topology_hash must have shape {tuple(tri.shape)}, got {tuple(opposite_of.shape)}")
    boosted = pos.detach() + pos_gradient_boost * (pos - pos.detach()) if pos.requires_grad else pos
    vertices = boosted.reshape(-1, pos.shape[-2], 4)
    ids, depth = ids_of(rast), rast[..., 2].detach()
    out = flat = color.reshape(-1, color.shape[3])
    for is_column in (False, True):
        pairs = find_pairs(ids, depth, is_column=is_column)
        share, keeps = blend_shares(pairs, vertices, corners_of, opposite_of, ids.shape, is_column=is_column)
        target, source = (torch.where(keeps, *two) for two in ((pairs.far, pairs.near), (pairs.near, pairs.far)))
        out = out.index_add(0, target, (share[:, None] * (flat[source] - flat[target])).to(out.dtype))
    return out.reshape(color.shape)


def antialias_construct_topology_hash(tri: Tensor) -> Tensor:
    """Return the vertex across each edge of each triangle, for `topology_hash` of `antialias`.

    Parameters
    ----------
    tri : tensor of int32 or int64, shape (T, 3)
        Indices of vertices.

    Returns
    -------
    tensor of int64, shape (T, 3)
        Column i belongs to the edge that corner i is not on: the third corner of the other triangle there, -1 if none.

    Raises
    ------
    TypeError, ValueError, IndexError
        As in `rasterize`.

    Examples
    --------
    >>> antialias_construct_topology_hash(torch.tensor([[0, 1, 2], [2, 1, 3]]))
    tensor([[ 3, -1, -1],
            [-1, -1,  0]])
    """
    corners = as_tri(tri, None).numpy().astype(np.int64)
    ends = np.sort(np.stack([np.roll(corners, -1, 1), np.roll(corners, -2, 1)], -1).reshape(-1, 2), axis=1)
    key = ends[:, 0] << 32 | ends[:, 1]
    order = np.argsort(key, kind="stable")
    key, corner = key[order], corners.reshape(-1)[order]
    is_same = np.concatenate([key[1:] == key[:-1], [False]])[: len(key)]
    across = np.full(len(key), -1)
    before = np.roll(is_same, 1)
    across[before] = np.roll(corner, 1)[before]
    across[is_same] = np.roll(corner, -1)[is_same]  # the first of several edges looks to the second
    found = np.empty_like(across)
    found[order] = across
    return torch.from_numpy(found.reshape(corners.shape))


# What is drawn


class Meshes(NamedTuple):
    """Checked `pos`, `tri` and `ranges`, and the triangles of each picture as a slice of `tri`."""

    pos: Tensor
    tri: Tensor
    slices: list[slice]

    def each(self) -> list[tuple[int, Any, int, Any]]:
        """Return of each picture its number, vertices, first triangle and triangles; arrays share the memory."""
        pos, triangles = self.pos.detach().numpy(), self.tri.numpy()
        vertices = [pos] * len(self.slices) if pos.ndim == 2 else pos
        return [(i, vertices[i], part.start, triangles[part]) for i, part in enumerate(self.slices)]


def as_meshes(glctx: object, pos: Tensor, tri: Tensor, ranges: Tensor | None) -> Meshes:
    """Check what `rasterize` is given."""
    if not isinstance(glctx, RasterizeContext):
        raise TypeError(f"glctx must be a RasterizeContext, got {type(glctx).__name__}")
    if ranges is None:
        check("pos", pos, "(B, V, 4), or (V, 4) with ranges", is_tensor(pos) and pos.ndim == 3 and pos.shape[2] == 4)
        return Meshes(pos, as_tri(tri, None), [slice(0, len(tri))] * len(pos))
    check("pos", pos, "(V, 4) with ranges", is_tensor(pos) and pos.ndim == 2 and pos.shape[1] == 4)
    corners = as_tri(tri, None)
    check("ranges", ranges, "(B, 2)", is_tensor(ranges) and ranges.ndim == 2 and ranges.shape[1] == 2, is_int=True)
    slices = [slice(first, first + count) for first, count in ranges.tolist()]
    for i, part in enumerate(slices):
        if not 0 <= part.start <= part.stop <= len(tri):
            raise ValueError(f"ranges must lie within the {len(tri)} triangles, row {i} is {ranges[i].tolist()}")
    return Meshes(pos, corners, slices)


def points_of_ids(glctx: RasterizeContext, meshes: Meshes, ids: Any, *, grad_db: bool) -> tuple[Tensor, Tensor]:
    """Return `rast` and `rast_db` of ids (B, H, W), -1 for none."""
    height, width = ids.shape[1:]
    flat = torch.from_numpy(ids).reshape(-1)
    pixels = (flat >= 0).nonzero().squeeze(1)
    i_tri = flat[pixels].long()
    corners = meshes.tri[i_tri].long().T
    if meshes.pos.ndim == 3:
        corners = corners + pixels // (height * width) * meshes.pos.shape[1]
    x, y, z, w = meshes.pos.reshape(-1, 4)[corners].double().movedim(2, 0).contiguous()  # each (3, N)
    x_ndc = ((pixels % width).double() * 2 + 1) / width - 1
    y_ndc = ((pixels // width % height).double() * 2 + 1) / height - 1
    x, y = x - x_ndc * w, y - y_ndc * w

    # Twice the areas, times w, between the eye's ray and two corners, and how they change across the picture.
    (x1, y1, w1), (x2, y2, w2) = ([one.roll(-k, 0) for one in (x, y, w)] for k in (1, 2))
    area = x1 * y2 - y1 * x2
    total = nonzero(area.sum(0))
    weights = area / total
    zw = ((z * area).sum(0) / nonzero((w * area).sum(0))).clamp(-1, 1)
    uv = weights[:2].clamp(0, 1)
    uv = uv / uv.sum(0).clamp(min=1)
    channel = torch.from_numpy(floats_of_ids(i_tri.numpy() + 1, np.dtype(str(meshes.pos.dtype).split(".")[1])))
    rows = [*(one.to(meshes.pos.dtype) for one in (*uv, zw)), channel]
    rast = spread(torch.stack(rows, 1), pixels, ids.shape)
    if not glctx.output_db:
        return rast, rast.new_zeros((*ids.shape, 0))
    by_x, by_y = (2 / width) * (y1 * w2 - w1 * y2), (2 / height) * (w1 * x2 - x1 * w2)
    (u_x, v_x), (u_y, v_y) = ((by[:2] - weights[:2] * by.sum(0)) / total for by in (by_x, by_y))
    rows = [one.to(meshes.pos.dtype) for one in (u_x, u_y, v_x, v_y)]
    rast_db = spread(torch.stack(rows, 1), pixels, ids.shape)
    return rast, rast_db if grad_db else rast_db.detach()


def nonzero(values: Tensor) -> Tensor:
    """Return the values, 1 for 0."""
    return torch.where(values == 0, torch.ones_like(values), values)


def floats_of_ids(id_plus_1: Any, dtype: Any) -> Any:
    """Return ids as floats: their values up to 2**24, and from there on, in float32, counted bits."""
    floats = id_plus_1.astype(dtype)
    if dtype == np.float32 and id_plus_1.max(initial=0) > LAST_EXACT_ID:
        large = id_plus_1 > LAST_EXACT_ID
        floats.view(np.int32)[large] = id_plus_1[large] - LAST_EXACT_ID + BITS_OF_LAST
    return floats


def ids_of(rast: Tensor) -> Tensor:
    """Return the ids plus 1 of the last channel, int64 (B, H, W)."""
    floats = rast[..., 3].detach().contiguous()
    ids = floats.long()
    if floats.dtype == torch.float32 and floats.numel() and float(floats.max()) > LAST_EXACT_ID:
        bits = floats.view(torch.int32).long() - BITS_OF_LAST + LAST_EXACT_ID
        ids = torch.where(floats > LAST_EXACT_ID, bits, ids)
    return ids


def spread(rows: Tensor, pixels: Tensor, shape: Sequence[int]) -> Tensor:
    """Return a picture (*shape, K) that has these rows at these pixels, and 0 elsewhere."""
    n_pixels = int(np.prod(shape))
    if len(pixels) == n_pixels:
        return rows.reshape(*shape, rows.shape[1])
    return rows.new_zeros((n_pixels, rows.shape[1])).index_copy(0, pixels, rows).reshape(*shape, rows.shape[1])


# Textures


def mip_level(tex: Tensor, uv_da: Tensor | None, bias: Tensor | None) -> Tensor:
    """Return the level of each pixel, flat and not clamped: log2 of the longer axis of its footprint in texels."""
    if uv_da is None:
        return bias.reshape(-1)  # type: ignore[union-attr]
    height, width = tex.shape[-3:-1]
    s_x, s_y, t_x, t_y = (uv_da.reshape(-1, 4) * torch.tensor([width, width, height, height])).unbind(1)
    a, b, c = s_x**2 + t_x**2, s_y**2 + t_y**2, s_x * s_y + t_x * t_y
    major_squared = (a + b) / 2 + (((a - b) / 2) ** 2 + c**2).clamp(min=1e-30).sqrt()
    level = 0.5 * major_squared.clamp(min=1e-30).log2()
    return level if bias is None else level + bias.reshape(-1)


def look_up(tex: Tensor, picture: Tensor, uv: Tensor, boundary: str, *, nearest: bool) -> Tensor:
    """Return (N, C): a level (B, H, W, C) at points (N, 2) of the pictures (N,); of a cube map of its faces."""
    if boundary == "cube":
        return look_up_cube(tex, picture, uv, nearest=nearest)
    size = torch.tensor([tex.shape[2], tex.shape[1]])
    uv = torch.nan_to_num(uv, 0.0, 0.0, 0.0)
    if boundary == "wrap":
        uv = uv - uv.detach().floor()
    at = uv * size if nearest else uv * size - 0.5
    if boundary == "clamp":
        at = torch.minimum(at.clamp(min=0), (size - 1).to(at.dtype))
    elif boundary == "zero":
        at = torch.minimum(at.clamp(min=-2), (size + 1).to(at.dtype))
    low = at.detach().floor()
    first, texels = low.long(), tex.reshape(-1, tex.shape[3])

    def texel(dx: int, dy: int) -> Tensor:
        x_y = first + torch.tensor([dx, dy])
        inside = ((x_y >= 0) & (x_y < size)).all(1)
        x_y = x_y % size if boundary == "wrap" else x_y.minimum(size - 1).clamp(min=0)
        found = texels[(picture * size[1] + x_y[:, 1]) * size[0] + x_y[:, 0]]
        return found * inside[:, None] if boundary == "zero" else found

    if nearest:
        return texel(0, 0)
    right, up = (at - low).split(1, 1)
    below = torch.lerp(*same_dtype(texel(0, 0), texel(1, 0), right))
    above = torch.lerp(*same_dtype(texel(0, 1), texel(1, 1), right))
    return torch.lerp(*same_dtype(below, above, up))


#: The axes of each face of a cube, as rows: of u (its columns), of v (its rows), and from the middle to the face.
CUBE_FRAMES = (
    ((0, 0, -1), (0, -1, 0), (1, 0, 0)),
    ((0, 0, 1), (0, -1, 0), (-1, 0, 0)),
    ((1, 0, 0), (0, 0, 1), (0, 1, 0)),
    ((1, 0, 0), (0, 0, -1), (0, -1, 0)),
    ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
    ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
)


def face_of(directions: Tensor) -> Tensor:
    """Return the face (N,) of a cube that each direction (N, 3) meets."""
    x, y, z = directions.detach().abs().unbind(1)
    axis = torch.where(z > torch.maximum(x, y), 2, torch.where(y > x, 1, 0))
    return 2 * axis + (directions.detach().gather(1, axis[:, None])[:, 0] < 0)


def face_points(picture: Tensor, directions: Tensor, xyz_da: Tensor | None) -> tuple[Tensor, Tensor, Tensor | None]:
    """Return of directions the faces (N,), counted through the pictures, u and v on them (N, 2), and their `uv_da`.

    What meets no face gets -1.
    """
    face = face_of(directions)
    frames = torch.tensor(CUBE_FRAMES, dtype=directions.dtype)[face]
    along = (frames * directions[:, None]).sum(2)  # (N, 3): along u, along v, towards the face
    is_met = torch.isfinite(along).all(1) & (along[:, 2] > 0)
    along = torch.where(is_met[:, None], along, torch.ones_like(along))
    depth = along[:, 2:]
    uv = (along[:, :2] / depth / 2 + 0.5).clamp(0, 1)
    number = torch.where(is_met, 6 * picture + face, torch.full_like(face, -1))
    if xyz_da is None:
        return number, uv, None
    by = (frames[..., None] * xyz_da.reshape(-1, 1, 3, 2)).sum(2)  # (N, 3, 2): what `along` changes by
    slopes = (by[:, :2] - (along[:, :2] / depth)[..., None] * by[:, 2:]) / depth[..., None] / 2
    return number, uv, torch.where(is_met[:, None, None], slopes, torch.zeros_like(slopes)).reshape(-1, 4)


def look_up_cube(tex: Tensor, number: Tensor, uv: Tensor, *, nearest: bool) -> Tensor:
    """Return (N, C): a level (B, 6, N, N, C) at points (N, 2) of its faces (N,), 0 for face -1."""
    n, texels = tex.shape[2], tex.reshape(-1, tex.shape[4])
    is_met = (number >= 0)[:, None]
    number = number.clamp(min=0)
    at = uv * n if nearest else uv * n - 0.5
    low = at.detach().floor()
    first = low.long()

    def texel(dx: int, dy: int) -> tuple[Tensor, Tensor]:
        x_y, own = first + torch.tensor([dx, dy]), number
        is_beyond = (x_y < 0) | (x_y >= n)
        (beyond,) = (is_beyond.any(1) & ~is_beyond.all(1)).nonzero(as_tuple=True)
        if len(beyond):  # where the plane of the face runs on, seen from the middle of the cube, lies the next one
            middle = 2 * (x_y[beyond].double() + 0.5) / n - 1
            frames = torch.tensor(CUBE_FRAMES, dtype=torch.float64)[own[beyond] % 6]
            directions = (torch.cat([middle, torch.ones_like(middle[:, :1])], 1)[..., None] * frames).sum(1)
            next_face, next_uv, _ = face_points(own[beyond] // 6, directions, None)
            own = own.index_copy(0, beyond, next_face)
            x_y[beyond] = (next_uv * n).long().clamp(max=n - 1)
        x_y = x_y.clamp(0, n - 1)
        return texels[(own * n + x_y[:, 1]) * n + x_y[:, 0]], is_beyond.all(1, keepdim=True)

    if nearest:
        x_y = first.clamp(0, n - 1)
        return texels[(number * n + x_y[:, 1]) * n + x_y[:, 0]] * is_met
    quad, corners = (torch.stack(one) for one in zip(*(texel(k % 2, k // 2) for k in range(4)), strict=True))
    quad = torch.where(corners, torch.zeros_like(quad), quad)
    quad = torch.where(corners, quad.sum(0) / 3, quad)
    right, down = (at - low).split(1, 1)
    upper = torch.lerp(*same_dtype(quad[0], quad[1], right))
    lower = torch.lerp(*same_dtype(quad[2], quad[3], right))
    return torch.lerp(*same_dtype(upper, lower, down)) * is_met


def same_dtype(*tensors: Tensor) -> list[Tensor]:
    """Return tensors in the widest of their dtypes."""
    dtype = torch.float64 if any(one.dtype == torch.float64 for one in tensors) else torch.float32
    return [one.to(dtype) for one in tensors]


def check_texture(tex: Tensor, uv: Tensor, uv_da: Tensor | None, bias: Tensor | None, boundary_mode: str) -> int:
    """Check what `texture` is given; returns the number of pictures."""
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
    check("tex", tex, wish, fits)
    of_uv_da = (*uv.shape[:3], 2 * n_axes)
    for name, given, shape in (("uv_da", uv_da, of_uv_da), ("mip_level_bias", bias, tuple(uv.shape[:3]))):
        if given is not None:
            check(name, given, str(tuple(shape)), is_tensor(given) and tuple(given.shape) == tuple(shape))
    return n_pictures


def as_mip(tex: Tensor, mip: Sequence[Tensor], max_mip_level: int | None) -> Sequence[Tensor]:
    """Check the levels after a texture."""
    height, width = tex.shape[-3:-1]
    for k, level in enumerate(mip):
        height, width = max(1, height // 2), max(1, width // 2)
        wish = (*tex.shape[:-3], height, width, tex.shape[-1])
        check(f"mip[{k}]", level, str(wish), is_tensor(level) and tuple(level.shape) == wish)
    return mip[:max_mip_level]


# Silhouettes


class Pairs(NamedTuple):
    """Neighbours that show different triangles.

    Pixels (N,) of the whole batch on the near and on the far side, the near triangle (N,), and whether the far pixel
    is the left (or lower) one.
    """

    near: Tensor
    far: Tensor
    i_tri: Tensor
    is_mirrored: Tensor


def find_pairs(ids: Tensor, depth: Tensor, *, is_column: bool) -> Pairs:
    """Return the neighbours in rows, or in columns, of ids plus 1 (B, H, W) that differ."""
    step = ids.shape[2] if is_column else 1
    first, second = (ids[:, :-1], ids[:, 1:]) if is_column else (ids[..., :-1], ids[..., 1:])
    b, i, j = (first != second).nonzero(as_tuple=True)
    pixel = (b * ids.shape[1] + i) * ids.shape[2] + j
    other = pixel + step
    flat, z = ids.reshape(-1), depth.reshape(-1)
    is_mirrored = (flat[pixel] == 0) | ((flat[other] != 0) & (z[other] < z[pixel]))
    near, far = torch.where(is_mirrored, other, pixel), torch.where(is_mirrored, pixel, other)
    return Pairs(near, far, flat[near] - 1, is_mirrored)


def blend_shares(
    pairs: Pairs, vertices: Tensor, tri: Tensor, opposite_of: Tensor, shape: Sequence[int], *, is_column: bool
) -> tuple[Tensor, Tensor]:
    """Return of each pair the share (N,) of the other colour, and whether it is the far pixel that takes it."""
    _, height, width = shape
    picture = pairs.near // (height * width) if len(vertices) > 1 else torch.zeros_like(pairs.near)
    corners = vertices[picture[:, None], tri[pairs.i_tri].long()].double()
    across = opposite_of[pairs.i_tri]
    opposite = vertices[picture[:, None], across.clamp(min=0)].double().detach()
    own, x_y_w = corners.detach()[..., [0, 1, 3]], corners[..., [0, 1, 3]]
    ends = own.roll(-1, 1), own.roll(-2, 1)
    side, other_side = (torch.linalg.cross(*ends).mul(p).sum(2) for p in (own, opposite[..., [0, 1, 3]]))
    is_silhouette = (across < 0) | (side * other_side > 0)

    # In pixels from the near centre, the first axis towards the far centre.
    half = torch.tensor([width, height]).double() / 2
    center = torch.stack([pairs.near % width, pairs.near // width % height], 1).double() + 0.5
    w = nonzero(x_y_w[..., 2:])
    px = (x_y_w[..., :2] / w + 1) * half - center[:, None]
    along, beside = (px[..., 1], px[..., 0]) if is_column else (px[..., 0], px[..., 1])
    along = torch.where(pairs.is_mirrored[:, None], -along, along)
    (p1, q1), (p2, q2) = ([one.roll(-k, 1) for one in (along, beside)] for k in (1, 2))
    rise = q2 - q1
    run = (p2 - p1).abs()
    is_steep = rise.abs() > run if is_column else rise.abs() >= run  # at 45 degrees rows alone
    counts = is_silhouette & is_steep & ((q1 <= 0) != (q2 <= 0)) & (corners[..., 3] > 0).all(1, keepdim=True)
    crossing = torch.where(counts, p1 - q1 * (p2 - p1) / nonzero(rise), torch.full_like(rise, -1e9))
    t = crossing.amax(1)
    meets = (t > -CROSSING_SLACK) & (t < 1 + CROSSING_SLACK)
    shift = torch.where(meets, t.clamp(0, 1) - 0.5, torch.zeros_like(t))
    return shift.abs(), shift > 0


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


def check(name: str, value: object, wish: str, has_shape: object, *, is_int: bool = False) -> None:
    """Raise an error unless this is a tensor of numbers on the CPU that has the shape wished for."""
    if not isinstance(value, Tensor):
        raise TypeError(f"{name} must be a torch.Tensor, got {type(value).__name__}")
    if value.device.type != "cpu":
        raise TypeError(f"{name} must be on the CPU, got device {str(value.device)!r}: pass {name}.cpu()")
    wanted, words = (
        ((torch.int32, torch.int64), "int32 or int64")
        if is_int
        else ((torch.float32, torch.float64), "float32 or float64")
    )
    if value.dtype not in wanted:
        raise TypeError(f"{name} must be {words}, got {value.dtype}")
    if not has_shape:
        raise ValueError(f"{name} must have shape {wish}, got {tuple(value.shape)}")


def as_tri(tri: Tensor, n_vertices: int | None) -> Tensor:
    """Check triangles, and their indices where the number of vertices is given."""
    check("tri", tri, "(T, 3)", is_tensor(tri) and tri.ndim == 2 and tri.shape[1] == 3, is_int=True)
    if n_vertices is not None:
        as_checked_triangles(tri.numpy(), n_vertices)
    return tri


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
