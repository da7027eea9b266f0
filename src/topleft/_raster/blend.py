"""Blending: colours of triangles into a picture, one triangle after the other, in bands of rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft import _engine
from topleft._base.memory import Memory
from topleft._base.options import Alpha, Blend, Sampling, parse
from topleft._base.threads import run_parts
from topleft._raster.view import View

__all__ = ["Blending", "blend_colors"]

BLEND_CODES = {mode: code for code, mode in enumerate(Blend)}  # tl_blend in csrc/topleft.h


@dataclass(frozen=True, slots=True)
class Blending:
    """How `fill` puts a colour into a pixel."""

    mode: Blend
    alpha: Alpha
    by_area: bool
    has_alpha: bool

    @classmethod
    def parse(cls, mode: object, alpha: object, colors: NDArray[Any], view: View) -> Blending:
        """Check the options of a call.

        Raises
        ------
        ValueError
            If an option is unknown, "over" lacks alpha, or a classic is to blend.
        """
        n_channels = 1 if colors.ndim == 1 else colors.shape[1]
        modes = parse(Blend, "blend", mode), parse(Alpha, "alpha", alpha)
        chosen = cls(*modes, by_area=view.sampling is Sampling.AREA, has_alpha=n_channels in (2, 4))
        if chosen.mode is Blend.OVER and not chosen.has_alpha:
            raise ValueError(
                f"colors must have 2 or 4 channels, the last of them alpha, for blend 'over', got {n_channels}"
            )
        if view.classic and chosen.mode is not Blend.REPLACE:
            raise ValueError(f"blend must be 'replace' for method {view.classic.name!r}, got {str(chosen.mode)!r}")
        return chosen

    @property
    def is_needed(self) -> bool:
        """False when a triangle simply replaces what its samples held."""
        return self.by_area or self.mode is not Blend.REPLACE

    @property
    def is_straight(self) -> bool:
        """Whether the mode treats the last channel as alpha that colours have not been multiplied by."""
        return self.has_alpha and self.alpha is Alpha.STRAIGHT and self.mode in (Blend.OVER, Blend.REPLACE)


def blend_colors(
    memory: Memory,
    scene: _engine.Scene,
    colors: NDArray[Any],
    pixels: NDArray[Any],
    blending: Blending,
    n_threads: int,
    *,
    is_flat: bool,
    ground: NDArray[Any] | None = None,
) -> bool:
    """Blend a scene into contiguous pixels; returns whether a triangle has an index outside the vertices.

    `ground`, for uint8: the colour that all pixels get before.
    """
    height, width = pixels.shape[:2]
    n_parts = min(height, n_threads)
    n_channels, is_u8 = 1 if colors.ndim == 1 else colors.shape[1], colors.dtype == np.uint8
    flat, palette = _engine.as_bytes(pixels), _engine.as_bytes(colors)
    packed = memory.empty("packed", (height * width,), np.int32) if is_u8 and n_channels != 4 else None
    n_cells = _engine.blend_cells(width)
    cells = memory.constant("cells", n_parts * n_cells, _engine.CELL_CLEAR) if blending.by_area else None
    under = None if ground is None else _engine.as_bytes(np.full(pixels.shape[2:] or 1, ground))
    code, is_premultiplied = BLEND_CODES[blending.mode], blending.alpha is Alpha.PREMULTIPLIED

    def blend_part(i: int, _: int) -> int:
        first, end = height * i // n_parts, height * (i + 1) // n_parts
        own = None if cells is None else cells[n_cells * i : n_cells * (i + 1)]
        return scene.blend(
            flat, width, first, end - first, palette, n_channels, is_u8, is_flat,
            code, is_premultiplied, under, packed, own,
        )  # fmt: skip

    return max(run_parts(blend_part, n_parts, n_parts)) >= 0
