"""Operations of tensors, with backward, and their options: what `topleft.torch` and `topleft.jax` make theirs."""

from topleft._core.gradients.tensors import (
    TexelFilter,
    TexelsBeyond,
    as_filter,
    as_rule,
    check_texture,
    halved_axes,
    halves_across,
)
from topleft._core.raster.operations import (
    ANTIALIAS,
    INTERPOLATE,
    RASTERIZE,
    RENDER,
    SQUARES,
    TEXTURE,
    Call,
    Operation,
    times,
)

__all__ = [
    "ANTIALIAS",
    "INTERPOLATE",
    "RASTERIZE",
    "RENDER",
    "SQUARES",
    "TEXTURE",
    "Call",
    "Operation",
    "TexelFilter",
    "TexelsBeyond",
    "as_filter",
    "as_rule",
    "check_texture",
    "halved_axes",
    "halves_across",
    "times",
]
