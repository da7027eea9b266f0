"""Layers on disk: all of them as .npz, one of them as PNG or TIFF.

Input: arrays by name. Output: a file, whole or not at all.
"""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.errors import ImageError

__all__ = ["SUFFIXES", "save_layers"]

SUFFIXES = (".npz", ".png", ".tif", ".tiff")

MILLIMETRES = 1000.0
"""Steps of a unit of length, if none are given: what datasets of depth mostly have."""

LENGTHS = ("distance", "ray_distance")
IDS = ("triangle", "instance")


def save_layers(
    path: str | os.PathLike[str],
    layers: Mapping[str, npt.NDArray[Any]],
    layer: str | None = None,
    *,
    scale: float | None = None,
) -> None:
    """Write layers to a file, which appears whole or not at all.

    Parameters
    ----------
    path : path
        The end of its name tells the format:

        * .npz: all layers, or the one named, as they are.
        * .png: uint8 pictures and masks (0 and 255) with 8 bits. Numbers (H, W) with 16 bits, 0 where nothing is:
          "triangle" and "instance" plus 1, other layers times `scale`, rounded to nearest.
        * .tif, .tiff: uint8 pictures and masks as in PNG; all else as it is, float32 or int32; of several channels each
          is a page.
    layers : mapping of str to array
    layer : str, optional
        Which one; not needed where there is one alone.
    scale : float, optional
        For PNG of 16 bits: steps a unit. "distance" and "ray_distance" have 1000, millimetres if units are metres;
        "depth" has 65535, the whole range.

    Raises
    ------
    ImageError
        If the format is unknown or cannot hold the layer.
    ValueError
        If it is not said which layer is meant, there is no such layer, or numbers exceed 16 bits.
    OSError
        If the file cannot be written.
    """
    from PIL import Image

    from topleft.images import write_whole

    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ImageError(f"cannot write {str(path)!r}: format {path.suffix!r} is none of {' '.join(SUFFIXES)}")
    if layer is not None and layer not in layers:
        raise ValueError(f"layer must be one of {', '.join(layers)}, got {layer!r}")
    if suffix == ".npz":
        arrays: dict[str, Any] = dict(layers) if layer is None else {layer: layers[layer]}
        write_whole(path, lambda file: np.savez_compressed(file, **arrays))
        return
    if layer is None and len(layers) != 1:
        raise ValueError(f"a {suffix} file holds one layer: say which one of {', '.join(layers)}")
    name = next(iter(layers)) if layer is None else layer
    array = layers[name]
    if not array.size:
        raise ImageError(f"cannot write {str(path)!r}: layer {name!r} of shape {array.shape} has no pixels")
    if array.dtype == np.bool_:
        array = array.astype(np.uint8) * np.uint8(255)
    if suffix == ".png" and array.dtype != np.uint8:
        array = as_uint16(path, name, array, scale)
    channels = [array] if array.ndim == 2 or array.dtype == np.uint8 else list(np.moveaxis(array, -1, 0))
    pages = [Image.fromarray(np.ascontiguousarray(channel)) for channel in channels]

    encoded = io.BytesIO()  # Pillow reads back what it has written of several pages
    if suffix == ".png":
        pages[0].save(encoded, format="PNG")
    else:
        pages[0].save(encoded, format="TIFF", save_all=True, append_images=pages[1:])
    write_whole(path, lambda file: file.write(encoded.getbuffer()))


def as_uint16(path: Path, name: str, array: npt.NDArray[Any], scale: float | None) -> npt.NDArray[np.uint16]:
    """Return a layer (H, W) in steps of 16 bits, 0 where nothing is."""
    if array.ndim != 2:
        raise ImageError(f"cannot write {str(path)!r}: PNG holds 16 bits of (H, W) alone, {name!r} has {array.shape}")
    if name in IDS:
        steps = array.astype(np.float64) + 1
    else:
        factor = (MILLIMETRES if name in LENGTHS else 65535.0) if scale is None else float(scale)
        steps = np.rint(np.where(np.isfinite(array), array, 0).astype(np.float64) * factor)
    low, high = float(steps.min()), float(steps.max())
    if not (low >= 0 and high <= 65535):
        raise ValueError(f"{name} must lie in 0 to 65535 steps for a PNG, got {low:g} to {high:g}; scale= changes them")
    return steps.astype(np.uint16)
