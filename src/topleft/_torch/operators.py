"""Operators of PyTorch: each of an operation of `topleft.annex.tensors`, another one for its gradients."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from topleft.annex import tensors
from topleft.annex.tensors import Call, Operation


def numpy_of(tensor: Tensor | Sequence[Tensor] | None) -> Any:
    """Return the array that a tensor is, contiguous; a list for a list, None for None."""
    if isinstance(tensor, Tensor):
        return np.ascontiguousarray(tensor.numpy(force=True))
    return None if tensor is None else [numpy_of(one) for one in tensor]


def define(name: str, schema: str, function: Callable[..., Any], fake: Callable[..., Any]) -> Any:
    """Make an operator of a function; `fake` tells the shapes of its results. A sample of `torch.vmap` is a call."""
    op = torch.library.custom_op(f"topleft::{name}", function, mutates_args=(), schema=schema)
    op.register_fake(fake)

    def one_by_one(info: Any, in_dims: Sequence[Any], *args: Any) -> tuple[Any, Any]:
        found = [op(*sample(args, in_dims, i)) for i in range(info.batch_size)]
        if isinstance(found[0], Tensor):
            return stacked(found), 0
        return type(found[0])(map(stacked, zip(*found, strict=True))), type(found[0])(0 for _ in found[0])

    op.register_vmap(one_by_one)
    return op


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


def typed(names: str) -> str:
    """Return the types and names of arguments, as schemas have them, of those of an operation."""
    kinds = {"?": "Tensor? ", "*": "Tensor[] "}
    return "".join(f"{kinds.get(name[-1], 'Tensor ')}{name.rstrip('?*')}, " for name in names.split())


def called(op: Any) -> Callable[..., Any]:
    """Return a function that calls an operator, and refuses `torch.func` by name."""

    def call(*args: Any) -> Any:
        if torch.compiler.is_compiling():
            return op(*args)
        try:
            return op(*args)
        except RuntimeError as error:
            if "functorch transforms" not in str(error):
                raise
            raise NotImplementedError(
                "topleft.torch takes torch.autograd.grad and backward(), no torch.func.grad"
            ) from None

    return call


def flat(given: Sequence[Any]) -> list[Any]:
    """Return tensors, those of lists among them."""
    return [one for part in given for one in (part if isinstance(part, list | tuple) else [part])]


def kind_of(tensor: Tensor | None) -> tuple[torch.Size, torch.dtype] | None:
    """Return the shape and the dtype of a tensor."""
    return None if tensor is None else (tensor.shape, tensor.dtype)


def operator_of(operation: Operation) -> Any:
    """Make an operator of an operation, called with what it is given and with options, and register its gradients."""
    names, kept = ([one.rstrip("?*") for one in part.split()] for part in (operation.given, operation.kept))
    results, leading = operation.results.split(), operation.gradients.split()
    with_gradient = [names.index(name) for name in leading]

    def run(*args: Any) -> Any:
        *given, options = args
        made = operation.run(Call(options, torch.get_num_threads()), *map(numpy_of, given))
        found = tuple(map(torch.from_numpy, made))
        return found if len(found) > 1 else found[0]

    def fake(*args: Any) -> Any:
        *given, options = args
        made = tuple(
            given[0].new_empty(shape, dtype=getattr(torch, dtype) if isinstance(dtype, str) else dtype)
            for shape, dtype in operation.shapes(options, *given)
        )
        return made if len(made) > 1 else made[0]

    def vjp(*args: Any) -> list[Tensor]:
        *given, options, needs = args
        call = Call(options, torch.get_num_threads(), needs)
        found = operation.vjp(call, *map(numpy_of, given))
        of_what = flat([given[kept.index(name)] for name in leading])
        return [
            given[0].new_empty(0) if not is_needed else torch.zeros_like(own) if one is None else torch.from_numpy(one)
            for one, own, is_needed in zip(found, of_what, needs, strict=True)
        ]

    def fake_vjp(*args: Any) -> list[Tensor]:
        *given, _, needs = args
        of_what = flat([given[kept.index(name)] for name in leading])
        return [
            torch.empty_like(own, memory_format=torch.contiguous_format) if is_needed else given[0].new_empty(0)
            for own, is_needed in zip(of_what, needs, strict=True)
        ]

    def keep(ctx: Any, inputs: Sequence[Any], output: Any) -> None:
        outputs = output if isinstance(output, tuple) else (output,)
        known = dict(zip((*names, *results), (*inputs[:-1], *outputs), strict=True))
        ctx.set_materialize_grads(False)
        ctx.mark_non_differentiable(*outputs[operation.n_out :])
        ctx.options, given = inputs[-1], [known[name] for name in kept]
        ctx.n_listed = len(given[-1]) if isinstance(given[-1], list | tuple) else 0
        ctx.save_for_backward(*flat(given))
        ctx.saved_as = list(map(kind_of, flat(given)))

    def backward(ctx: Any, *g: Tensor | None) -> tuple[Any, ...]:
        found: list[Any] = [None] * len(names)
        n, given = ctx.n_listed, list(ctx.saved_tensors)
        if list(map(kind_of, given)) != ctx.saved_as:
            raise RuntimeError("tensors must come back from hooks of saved tensors as they were saved, got "
                               f"{[*map(kind_of, given)]}, not {ctx.saved_as}")  # fmt: skip
        if n:
            found[-1], given = [None] * n, [*given[:-n], given[-n:]]
        if operation.vjp is tensors.times:  # an operator would take longer
            if torch.is_grad_enabled():  # of create_graph=True: the factors would count as constants
                once()
            for i, own in zip(with_gradient, given, strict=True):
                found[i] = g[0] * own
        elif any(one is not None for one in g[: operation.n_out]):
            needs = flat([ctx.needs_input_grad[i] for i in with_gradient])
            made = backward_op(*given, *g[: operation.n_out], ctx.options, needs)
            own = [one if is_needed else None for one, is_needed in zip(made, needs, strict=True)]
            for i in with_gradient:
                found[i] = own.pop(0) if i < len(names) - 1 or not n else own
        return (*found, None)

    returned = "Tensor" if len(results) == 1 else f"({', '.join(['Tensor'] * len(results))})"
    op = define(operation.name, f"({typed(operation.given)}int[] options) -> {returned}", run, fake)
    op.register_autograd(backward, setup_context=keep)
    if operation.vjp is tensors.times:
        return called(op)
    given_back = typed(operation.kept) + typed(" ".join(f"g_{name}?" for name in results[: operation.n_out]))
    back = f"({given_back}int[] options, bool[] needs) -> Tensor[]"
    backward_op = define(f"{operation.name}_vjp", back, vjp, fake_vjp)
    backward_op.register_autograd(once)
    return called(op)


operations = tensors.ANTIALIAS, tensors.INTERPOLATE, tensors.RASTERIZE, tensors.RENDER, tensors.SQUARES, tensors.TEXTURE
antialias, interpolate, rasterize, render, squares, texture = map(operator_of, operations)
halves_across = define(
    "halves_across",
    "(Tensor tri) -> Tensor",
    lambda tri: torch.from_numpy(tensors.halves_across(numpy_of(tri.to(torch.int32))).copy()),
    lambda tri: tri.new_empty(tri.shape, dtype=torch.int32),
)
