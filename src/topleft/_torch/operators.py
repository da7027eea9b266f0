"""Operators of PyTorch: tensors to the engine and back, and what backward calls.

`threads` is that of a context, 0 where PyTorch's number counts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from topleft import rasterize as draw
from topleft._core.base.arrays import as_checked_triangles
from topleft._core.gradients import tensors
from topleft._core.gradients.bands import MIN_PX_PER_THREAD
from topleft._core.gradients.tensors import EdgeRule, PixelGrid, TexelFilter, TexelLook, TexelsBeyond


def threads_of(threads: int | None, n_px: int) -> int:
    """Return how many threads draw some pixels: those asked for, or as many of PyTorch's as pay."""
    return threads or max(1, min(torch.get_num_threads(), n_px // MIN_PX_PER_THREAD))


def numpy_of(tensor: Tensor | None) -> Any:
    """Return the array that a tensor is, contiguous; None for None."""
    return None if tensor is None else np.ascontiguousarray(tensor.numpy(force=True))


def triangles_of(tri: Tensor, n_vertices: int) -> NDArray[np.int32]:
    """Return triangles whose vertices exist, as a copy: another thread may write to `tri` during a call."""
    return as_checked_triangles(numpy_of(tri), n_vertices)


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
                return stacked(found), 0
            return type(found[0])(map(stacked, zip(*found, strict=True))), type(found[0])(0 for _ in found[0])

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


def stacked(samples: Sequence[Tensor]) -> Tensor:
    """Return samples as one tensor; shorter ones get zeros at their ends."""
    is_even = len({one.shape for one in samples}) == 1
    return torch.stack(list(samples)) if is_even else pad_sequence(list(samples), batch_first=True)


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
    "(Tensor pos, Tensor tri, Tensor? ranges, Tensor? ids, int height, int width, int threads, bool with_db)"
    " -> (Tensor, Tensor)",
    lambda pos, tri, ranges, ids, height, width, threads, with_db: tuple(  # noqa: ARG005
        pos.new_empty((len(pos if ranges is None else ranges), height, width, n)) for n in (4, 4 * with_db)
    ),
)
def rasterize_mesh(
    pos: Tensor,
    tri: Tensor,
    ranges: Tensor | None,
    ids: Tensor | None,
    height: int,
    width: int,
    threads: int,
    with_db: bool,
) -> tuple[Tensor, Tensor]:
    """Return `rast` and `rast_db` of what is drawn, or of ids (B, H, W) within each range; row 0 of ids is on top."""
    n = threads_of(threads, height * width)
    if ids is None:
        pictures = [draw(v, t, (width, height), threads=n).triangle for v, t in each(pos, tri, ranges)]
    else:
        pictures = list(numpy_of(ids))
    triangles = triangles_of(tri, pos.shape[-2])
    grid = PixelGrid(triangles, len(pictures), height, width, threads_of(0, len(pictures) * height * width))
    firsts = [0] * len(pictures) if ranges is None else ranges[:, 0].tolist()
    vertices = numpy_of(pos if ranges is None else pos[None])
    drawn = list(zip(pictures, firsts, strict=True))
    rast, rast_db = tensors.points(grid, vertices, drawn, is_flipped=True, with_db=with_db)
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
    "(Tensor[] levels, Tensor uv, Tensor? uv_da, Tensor? bias, int how, int beyond, Tensor g_out, bool of_levels,"
    " bool of_places) -> Tensor[]",
    lambda levels, uv, uv_da, bias, how, beyond, g_out, of_levels, of_places: [  # noqa: ARG005
        *(like(one if of_levels else None, uv) for one in levels),
        *(like(one if of_places else None, uv) for one in (uv, uv_da, bias)),
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
    of_levels: bool,
    of_places: bool,
) -> list[Tensor]:
    """Return the gradients of the levels, of uv, of the footprints and of the biases; those not wanted are empty."""
    look = look_of(levels, uv, uv_da, bias, how, beyond)
    g_levels, *where = tensors.texels_vjp(look, numpy_of(g_out), of_levels=of_levels, of_places=of_places)
    return [tensor_of(one, uv) for one in (*(g_levels if of_levels else [None] * len(levels)), *where)]


@operator("(Tensor tri) -> Tensor", lambda tri: tri.new_empty(tri.shape, dtype=torch.int32))
def halves_across(tri: Tensor) -> Tensor:
    """Return the triangle across each edge."""
    return torch.from_numpy(tensors.halves_across(numpy_of(tri.to(torch.int32))).copy())


@operator(
    "(Tensor pos, Tensor tri, Tensor across, int height, int width) -> (Tensor, Tensor)",
    lambda pos, tri, across, height, width: (  # noqa: ARG005
        pos.new_empty((*pos.shape[:2], 2), dtype=torch.float64),
        tri.new_empty((len(pos), len(tri)), dtype=torch.int32),
    ),
)
def outline(pos: Tensor, tri: Tensor, across: Tensor, height: int, width: int) -> tuple[Tensor, Tensor]:
    """Return where vertices are, and what the edges of triangles are."""
    grid = PixelGrid(triangles_of(tri, pos.shape[1]), len(pos), height, width, threads_of(0, len(pos) * height * width))
    found = tensors.outline_of(grid, numpy_of(pos), numpy_of(across.to(torch.int32)))
    return torch.from_numpy(found.places), torch.from_numpy(found.edges)


@operator(
    "(Tensor color, Tensor rast, Tensor pos, Tensor tri, Tensor[] outline, int rule, float boost) -> Tensor",
    lambda color, rast, pos, tri, outline, rule, boost: like(color, color),  # noqa: ARG005
)
def smooth(
    color: Tensor,
    rast: Tensor,
    pos: Tensor,
    tri: Tensor,
    outline: Sequence[Tensor],
    rule: int,
    boost: float,  # noqa: ARG001
) -> Tensor:
    """Return the picture with smooth silhouettes."""
    grid, edges = grid_of(tri, rast, pos.shape[1]), tensors.Outline(*map(numpy_of, outline))
    return torch.from_numpy(tensors.smooth(grid, EdgeRule(rule), edges, *map(numpy_of, (pos, rast, color))))


@operator(
    "(Tensor color, Tensor rast, Tensor pos, Tensor tri, Tensor[] outline, int rule, Tensor g_out) -> (Tensor, Tensor)",
    lambda color, rast, pos, tri, outline, rule, g_out: (like(color, color), like(pos, pos)),  # noqa: ARG005
)
def smooth_vjp(
    color: Tensor, rast: Tensor, pos: Tensor, tri: Tensor, outline: Sequence[Tensor], rule: int, g_out: Tensor
) -> tuple[Tensor, Tensor]:
    """Return the gradients of the colours and of `pos`."""
    grid, edges = grid_of(tri, rast, pos.shape[1]), tensors.Outline(*map(numpy_of, outline))
    g_color, g_pos = tensors.smooth_vjp(grid, EdgeRule(rule), edges, *map(numpy_of, (pos, rast, color, g_out)))
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
    """Return the gradients of what `rasterize_mesh` takes."""
    pos, tri, rast = ctx.saved_tensors
    if g_rast is None and g_db is None:
        return (None,) * 8
    return points_vjp(pos, tri, rast, filled(g_rast, rast.shape, rast), g_db), *(None,) * 7


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
    of_levels, *of_places = ctx.needs_input_grad[:4]
    wanted = any(of_levels) if isinstance(of_levels, list | tuple) else of_levels, any(of_places)
    found = look_up_vjp(levels, uv, uv_da, bias, ctx.how, ctx.beyond, g_out, *wanted)
    g_levels, where = found[: ctx.n_levels], found[ctx.n_levels :]
    return (
        g_levels if wanted[0] else [None] * ctx.n_levels,
        *(one if is_wanted else None for one, is_wanted in zip(where, of_places, strict=True)),
        None,
        None,
    )


def keep_edges(ctx: Any, inputs: Sequence[Any], output: Tensor) -> None:  # noqa: ARG001
    """Keep what `smooth_vjp` takes."""
    *kept, outline, ctx.rule, ctx.boost = inputs
    ctx.save_for_backward(*kept, *outline)


def pull_edges(ctx: Any, g_out: Tensor) -> tuple[Any, ...]:
    """Return the gradients of what `smooth` takes."""
    *given, across, places, edges = ctx.saved_tensors
    g_color, g_pos = smooth_vjp(*given, [across, places, edges], ctx.rule, g_out)
    return g_color, None, g_pos if ctx.boost == 1 else ctx.boost * g_pos, None, [None] * 3, None, None


rasterize_mesh.register_autograd(pull_points, setup_context=keep_points)
interpolate_values.register_autograd(pull_values, setup_context=keep_values)
look_up.register_autograd(pull_look, setup_context=keep_look)
smooth.register_autograd(pull_edges, setup_context=keep_edges)
for vjp in (points_vjp, interpolate_vjp, look_up_vjp, smooth_vjp):
    vjp.register_autograd(once)
