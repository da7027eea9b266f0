"""Layers to files: as they are where the format holds them, as scaled integers in PNG.

Input: arrays by name, from `draw_layers`. Output: a file for each, or one .npz.

In a PNG a layer that is no picture holds whole numbers, and its text chunks tell what they stand for:

    number = topleft:offset + topleft:scale * value        value 0 where nothing is
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.errors import ImageError
from topleft.images import SUFFIXES, save_image

__all__ = ["layer_paths", "save_layers"]

Array = npt.NDArray[Any]

DIRECTIONS = frozenset({"normals"})
"""Layers of unit vectors, which eight bits show: -1 to 1 as 0 to 255."""

LARGEST = 65535


def layer_paths(destination: Path, names: Sequence[str]) -> dict[str, Path]:
    """Return the file of each layer: `{layer}` in the name stands for the layer; .npz holds all of them.

    Raises
    ------
    ImageError
        If the format is unknown, or several layers would have one file that can hold one.
    """
    text = str(destination)
    if destination.suffix.lower() not in SUFFIXES:
        known = " ".join(SUFFIXES)
        raise ImageError(f"cannot write {text!r}: format {destination.suffix!r} is none of {known}")
    if destination.suffix.lower() != ".npz" and "{layer}" not in text and len(names) > 1:
        raise ImageError(f"{len(names)} layers need {{layer}} in the name, or .npz, got {text!r}")
    return {name: Path(text.replace("{layer}", name)) for name in names}


def save_layers(
    destination: Path,
    layers: Mapping[str, Array],
    *,
    matrix: npt.NDArray[np.float64] | None = None,
    background: tuple[int, int, int] = (255, 255, 255),
) -> tuple[Path, ...]:
    """Write layers, each file whole or not at all; returns the files.

    Parameters
    ----------
    destination : Path
        `{layer}` in the name stands for the name of the layer. The end tells the format: .npz and .npy hold the arrays
        as they are; TIFF colours, depth and ids; PNG colours, and 16-bit numbers for depth (linear from the
        nearest to the farthest) and ids (below 65,535), 8-bit ones for normals; JPEG and WebP colours.
    layers : mapping of str to ndarray
    matrix : (4, 4) float64, optional
        Clip space from the world; goes into .npz with the layers, as `clip_from_world`.
    background : (3,) of 0 to 255
        What shows through in JPEG.

    Raises
    ------
    ImageError
        If a format cannot hold a layer.
    OSError
        If a file cannot be written.
    """
    paths = layer_paths(destination, list(layers))
    if destination.suffix.lower() == ".npz" and "{layer}" not in str(destination):
        save_image(destination, layers if matrix is None else {**layers, "clip_from_world": matrix})
        return (destination,)
    # All are converted before the first is written: a layer that does not fit leaves no file.
    stored = {name: _stored(paths[name], name, array) for name, array in layers.items()}
    for name, (array, text) in stored.items():
        save_image(paths[name], array, background=background, text=text)
    return tuple(paths.values())


def _stored(path: Path, name: str, array: Array) -> tuple[Array, dict[str, str] | None]:
    """What goes into the file, and the notes that tell what it means."""
    suffix = path.suffix.lower()
    if suffix in (".npy", ".npz") or array.dtype == np.uint8:
        return array, None
    if suffix == ".png" and name in DIRECTIONS:
        return np.rint(127.5 * array + 127.5).astype(np.uint8), _notes(name, 1 / 127.5, -1.0)
    if suffix == ".png" and array.dtype == np.int32 and array.ndim == 2:
        return _ids_of_16_bits(path, array), _notes(name, 1, -1)
    if suffix == ".png" and array.dtype == np.float32 and array.ndim == 2:
        return _numbers_of_16_bits(name, array)
    if suffix in (".tif", ".tiff") and array.dtype in (np.int32, np.float32) and array.ndim == 2:
        return array, None
    raise ImageError(
        f"cannot write {str(path)!r}: {path.suffix} cannot hold the layer {name!r}, {array.dtype} {array.shape}; "
        "take .npz or .npy"
    )


def _ids_of_16_bits(path: Path, ids: npt.NDArray[np.int32]) -> npt.NDArray[np.uint16]:
    largest = int(ids.max(initial=-1))
    if largest >= LARGEST:
        raise ImageError(f"cannot write {str(path)!r}: PNG holds ids below {LARGEST}, got {largest}; take .tiff")
    return (ids + 1).astype(np.uint16)


def _numbers_of_16_bits(name: str, array: npt.NDArray[np.float32]) -> tuple[npt.NDArray[np.uint16], dict[str, str]]:
    """Numbers in equal steps from 1, the least, to 65535, the greatest; 0 where they are not finite."""
    is_there = np.isfinite(array)
    numbers = array[is_there].astype(np.float64)
    least, greatest = (float(numbers.min()), float(numbers.max())) if numbers.size else (0.0, 0.0)
    scale = (greatest - least) / (LARGEST - 1)
    values = np.zeros(array.shape, np.uint16)
    values[is_there] = 1 + (np.rint((numbers - least) / scale) if scale else 0)
    return values, _notes(name, scale, least - scale)


def _notes(name: str, scale: float, offset: float) -> dict[str, str]:
    return {"topleft:layer": name, "topleft:scale": repr(scale), "topleft:offset": repr(offset)}
