"""Resolves MSAA: averages the samples of each pixel, their values or the light that they stand for.

With straight alpha colours count as much as they are opaque: the mean of premultiplied colours, made straight again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft import _engine
from topleft._base.color import srgb_tables
from topleft._base.memory import Memory
from topleft._base.options import Resolve, parse
from topleft._base.threads import run_parts
from topleft._raster.view import View

__all__ = ["parse_resolve", "resolve_colors", "resolve_flat", "resolve_gouraud"]


def parse_resolve(resolve: object, colors: NDArray[Any], view: View, *, is_straight: bool) -> _engine.Transfer | None:
    """Return what is averaged; None when it is the values as they are.

    Raises
    ------
    ValueError
        If the option is unknown, or light is asked for and the colours are no uint8.
    """
    is_linear = parse(Resolve, "resolve", resolve) is Resolve.LINEAR
    if is_linear and colors.dtype != np.uint8:
        raise ValueError(
            f"resolve 'linear' takes sRGB colours of uint8, got {colors.dtype}: float32 is averaged as it is"
        )
    n_channels = 1 if colors.ndim == 1 else colors.shape[1]
    if view.sampling.n_samples == 1 or not (is_linear or is_straight):
        return None
    return _engine.Transfer(srgb_tables() if is_linear else None, n_channels - (n_channels in (2, 4)), is_straight)


def resolve_flat(
    labels: NDArray[np.int32],
    colors: NDArray[Any],
    pixels: NDArray[Any],
    transfer: _engine.Transfer | None,
    n_threads: int,
) -> None:
    """Write the mean colour of the triangles that the samples see, labels (S, H, W), over (H, W[, C]) pixels."""
    palette = _engine.Palette(colors, transfer)

    def resolve_rows(first: int, end: int) -> None:
        palette.mean_flat(labels, pixels, first, end - first)

    run_parts(resolve_rows, labels.shape[1], n_threads)


def resolve_gouraud(
    memory: Memory,
    meshes: list[_engine.SnappedMesh],
    labels: NDArray[np.int32],
    colors: NDArray[Any],
    pixels: NDArray[Any],
    transfer: _engine.Transfer | None,
    n_threads: int,
) -> None:
    """Write the mean of the colours at the samples, interpolated at each of them, over (H, W[, C]) pixels."""
    n_channels = 1 if colors.ndim == 1 else colors.shape[1]
    painted = memory.empty("sample colors", (len(labels), *pixels.shape), colors.dtype)
    palette = _engine.as_bytes(colors)

    def resolve_rows(first: int, end: int) -> None:
        painted[:, first:end] = pixels[first:end]
        for mesh, own, picture in zip(meshes, labels, painted, strict=True):
            flat = _engine.as_bytes(picture)
            mesh.paint(own, palette, flat, first, end - first, False, colors.dtype == np.uint8, n_channels)
        _engine.mean_colors(painted, pixels, first, end - first, n_channels, transfer)

    run_parts(resolve_rows, labels.shape[1], n_threads)


def resolve_colors(
    painted: NDArray[Any], pixels: NDArray[Any], transfer: _engine.Transfer | None, n_threads: int
) -> None:
    """Write the mean of what the samples hold, (S, H, W[, C]), over (H, W[, C]) pixels."""
    n_channels = 1 if pixels.ndim == 2 else pixels.shape[2]

    def resolve_rows(first: int, end: int) -> None:
        _engine.mean_colors(painted, pixels, first, end - first, n_channels, transfer)

    run_parts(resolve_rows, len(pixels), n_threads)
