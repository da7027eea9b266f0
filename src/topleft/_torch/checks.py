"""Checks of tensors, and tensors of one dtype."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor
from torch.autograd.forward_ad import unpack_dual

#: The largest id that float32 counts up to; the bits of larger ones are counted on from there.
LAST_EXACT_ID = 1 << 24
BITS_OF_LAST = 0x4B800000


def is_tensor(value: object) -> bool:
    """Tell whether this is a tensor of PyTorch."""
    return isinstance(value, Tensor)


def is_cube_map(tex: object) -> bool:
    """Tell whether this is a tensor (B, 6, N, N, C)."""
    return isinstance(tex, Tensor) and tex.ndim == 5 and tex.shape[1] == 6 and tex.shape[2] == tex.shape[3] > 0


def len_of(tensor: Tensor) -> int:
    """Return the number of pictures of (B, N, K), 1 for (N, K)."""
    return tensor.shape[0] if tensor.ndim == 3 else 1


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
        hint = f": pass {name}.float() / 255" if value.dtype == torch.uint8 and kinds is KINDS else ""
        raise TypeError(f"{name} must be {kinds[1]}, got {value.dtype}{hint}")
    if not has_shape:
        raise ValueError(f"{name} must have shape {wish}, got {tuple(value.shape)}")
    if not torch.compiler.is_compiling() and unpack_dual(value).tangent is not None:
        raise NotImplementedError(f"{name} must have no tangent: topleft.torch has gradients by backward() alone")


def check_tri(tri: Tensor) -> None:
    """Check triangles, but for their indices."""
    check("tri", tri, "(T, 3)", is_tensor(tri) and tri.ndim == 2 and tri.shape[1] == 3, INTS)


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
