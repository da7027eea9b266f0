"""Operators of PyTorch that draw attributes with smooth silhouettes in one, and what backward calls.

`threads` is that of a context, 0 where PyTorch's number counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from topleft import rasterize as draw
from topleft._core.gradients.pictures import AttributePictures
from topleft._core.gradients.tensors import EdgeRule, PixelGrid
from topleft._torch.operators import joined, like, numpy_of, once, operator, threads_of, triangles_of


def grid_of_mesh(pos: Tensor, tri: Tensor, attr: Tensor, size: tuple[int, int], threads: int) -> PixelGrid:
    """Return the pictures (B, H, W) of a mesh, whose triangles have rows in `pos` and `attr`."""
    triangles = triangles_of(tri, min(pos.shape[1], attr.shape[1]))
    return PixelGrid(triangles, pos.shape[0], *size, threads_of(threads, pos.shape[0] * size[0] * size[1]))


def draw_pictures(
    pos: Tensor, tri: Tensor, attr: Tensor, across: Tensor, size: tuple[int, int], rule: int, threads: int
) -> AttributePictures:
    """Draw which triangles show, row 0 on top; `size` is height and width."""
    grid, vertices = grid_of_mesh(pos, tri, attr, size, threads), numpy_of(pos)
    n = threads_of(threads, size[0] * size[1])
    ids = joined([draw(one, grid.tri, size[::-1], threads=n).triangle for one in vertices], size)
    return AttributePictures(grid, EdgeRule(rule), numpy_of(across.to(torch.int32)), vertices, ids, numpy_of(attr))


@operator(
    "(Tensor pos, Tensor tri, Tensor attr, Tensor target, Tensor across, int rule, int threads)"
    " -> (Tensor, Tensor, Tensor)",
    lambda pos, tri, attr, target, across, rule, threads: (  # noqa: ARG005
        pos.new_empty(()),
        like(pos, pos),
        like(attr, attr),
    ),
)
def squares(
    pos: Tensor, tri: Tensor, attr: Tensor, target: Tensor, across: Tensor, rule: int, threads: int
) -> tuple[Tensor, Tensor, Tensor]:
    """Return the mean squared difference from pictures, and the gradients of `pos` and `attr`."""
    pictures = draw_pictures(pos, tri, attr, across, (target.shape[1], target.shape[2]), rule, threads)
    loss, *gradients = pictures.squares(numpy_of(target))
    g_pos, g_attr = map(torch.from_numpy, gradients)
    return torch.tensor(loss, dtype=pos.dtype), g_pos, g_attr


@operator(
    "(Tensor pos, Tensor tri, Tensor attr, Tensor across, int height, int width, int rule, int threads, bool keeps)"
    " -> (Tensor, Tensor, Tensor)",
    lambda pos, tri, attr, across, height, width, rule, threads, keeps: (  # noqa: ARG005
        pos.new_empty((len(pos), height, width, attr.shape[2])),
        pos.new_empty((len(pos), height, width), dtype=torch.int32),
        pos.new_empty(0, dtype=torch.int64),
    ),
)
def draw_attributes(
    pos: Tensor,
    tri: Tensor,
    attr: Tensor,
    across: Tensor,
    height: int,
    width: int,
    rule: int,
    threads: int,
    keeps: bool,
) -> tuple[Tensor, Tensor, Tensor]:
    """Return pictures of attributes with smooth silhouettes, their ids, and for backward what they show, if it is kept.

    It has as many words as the picture needs, so it is not kept where sizes are to be known before: compiled.
    """
    pictures = draw_pictures(pos, tri, attr, across, (height, width), rule, threads)
    drawn, seen = pictures.picture()
    words = pictures.pack(seen) if keeps else np.empty(0, np.int64)
    return torch.from_numpy(drawn), torch.from_numpy(pictures.ids), torch.from_numpy(words)


@operator(
    "(Tensor pos, Tensor tri, Tensor attr, Tensor ids, Tensor words, Tensor across, int rule, int threads,"
    " Tensor g_out) -> (Tensor, Tensor)",
    lambda pos, tri, attr, ids, words, across, rule, threads, g_out: (like(pos, pos), like(attr, attr)),  # noqa: ARG005
)
def draw_attributes_vjp(
    pos: Tensor,
    tri: Tensor,
    attr: Tensor,
    ids: Tensor,
    words: Tensor,
    across: Tensor,
    rule: int,
    threads: int,
    g_out: Tensor,
) -> tuple[Tensor, Tensor]:
    """Return the gradients of `pos` and `attr`."""
    grid = grid_of_mesh(pos, tri, attr, (ids.shape[1], ids.shape[2]), threads)
    arrays = (numpy_of(one) for one in (across.to(torch.int32), pos, ids, attr))
    pictures = AttributePictures(grid, EdgeRule(rule), *arrays)
    g_pos, g_attr = pictures.vjp(numpy_of(g_out), pictures.unpack(numpy_of(words)))
    return torch.from_numpy(g_pos), torch.from_numpy(g_attr)


def keep_squares(ctx: Any, inputs: Sequence[Any], output: Sequence[Tensor]) -> None:  # noqa: ARG001
    """Keep the gradients, which `squares` has found."""
    ctx.set_materialize_grads(False)
    ctx.mark_non_differentiable(*output[1:])
    ctx.save_for_backward(*output[1:])


def pull_squares(ctx: Any, g_loss: Tensor, *_: Any) -> tuple[Any, ...]:
    """Return the gradients of what `squares` takes."""
    g_pos, g_attr = ctx.saved_tensors
    return g_loss * g_pos, None, g_loss * g_attr, None, None, None, None


def keep_pictures(ctx: Any, inputs: Sequence[Any], output: Sequence[Tensor]) -> None:
    """Keep what `draw_attributes_vjp` takes."""
    pos, tri, attr, across, _, _, ctx.rule, ctx.threads, _ = inputs
    ctx.set_materialize_grads(False)
    ctx.mark_non_differentiable(*output[1:])
    ctx.save_for_backward(pos, tri, attr, *output[1:], across)


def pull_pictures(ctx: Any, g_out: Tensor | None, *_: Any) -> tuple[Any, ...]:
    """Return the gradients of what `draw_attributes` takes."""
    if g_out is None:
        return (None,) * 9
    g_pos, g_attr = draw_attributes_vjp(*ctx.saved_tensors, ctx.rule, ctx.threads, g_out)
    return g_pos, None, g_attr, *(None,) * 6


squares.register_autograd(pull_squares, setup_context=keep_squares)
draw_attributes.register_autograd(pull_pictures, setup_context=keep_pictures)
draw_attributes_vjp.register_autograd(once)
