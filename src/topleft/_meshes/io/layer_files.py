"""Layers to files: as they are where the format holds them, as scaled integers in PNG.

Input: arrays by name, from `render_layers`. Output: a file for each, or one .npz.

In a PNG a layer that is no picture holds whole numbers, and its text chunks tell their meaning:

    number = topleft:offset + topleft:scale * value        value 0 where nothing is, in 16 bits
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import Array
from topleft._core.base.arrays import as_number
from topleft._core.base.defaults import SUFFIXES
from topleft._core.base.remote import Location, as_location, location_of
from topleft._meshes.io.images import write_image
from topleft.errors import ImageError

RANGES = {"camera_normal": (-1.0, 1.0), "world_normal": (-1.0, 1.0), "barycentric": (0.0, 1.0)}
"""Layers of three channels that eight bits show: the values of 0 and 255."""

LENGTHS = ("distance", "ray_distance")
MILLIMETRE = 0.001
"""Units of a step of length, if none are given: as most datasets of depth have."""

LARGEST = 65535


def layer_paths(destination: Location, names: Sequence[str]) -> dict[str, Location]:
    """Return the file of each layer: `{layer}` in the name stands for the layer; .npz holds all of them."""
    text = str(destination)
    if destination.suffix.lower() not in SUFFIXES:
        known = " ".join(SUFFIXES)
        raise ImageError(f"cannot write {text!r}: format {destination.suffix!r} is none of {known}")
    if destination.suffix.lower() != ".npz" and "{layer}" not in text and len(names) > 1:
        raise ImageError(f"{len(names)} layers need {{layer}} in the name, or .npz, got {text!r}")
    if "{layer}" not in text:
        return dict.fromkeys(names, destination)
    return {name: location_of(text.replace("{layer}", name)) for name in names}


def save_layers(
    destination: str | os.PathLike[str],
    layers: Mapping[str, Array],
    *,
    depth_scale: float = MILLIMETRE,
    matrix: npt.NDArray[np.float64] | None = None,
    background: tuple[int, int, int] = (255, 255, 255),
    record: tuple[str, ...] = (),
) -> tuple[Location, ...]:
    """Write layers, each file whole or not at all; returns the files.

    Parameters
    ----------
    destination : path or URL
        `{layer}` in the name stands for the name of the layer. The end tells the format:

        * .npz, .npy: the arrays as they are.
        * .tif, .tiff: pictures and masks (0 and 255) of 8 bits; all else as it is, float32 or int32; of several
          channels each is a page.
        * .png: pictures and masks as in TIFF; normals and barycentrics of 8 bits. Numbers (H, W) of 16 bits, 0 where
          nothing is: ids plus 1; distances in thousandths, millimetres if units are metres; depth that lies in
          0 to 1, as 1 to 65535; others from the least, 1, to the greatest, 65535.
        * .jpg, .webp: pictures and masks.
    layers : mapping of str to ndarray
    depth_scale : float
        Units of a step of distances in PNG.
    matrix : (4, 4) float64, optional
        Clip space from the world; goes into .npz with the layers, as `clip_from_world`. Its planes are not those of the
        depth of a camera that has none.
    background : (3,) of 0 to 255
        The colour behind in JPEG.
    record : tuple of str
        A note for `read_record`.
    """
    place = as_location("path", destination)
    if not 0 < as_number("depth_scale", depth_scale) < np.inf:
        raise ValueError(f"depth_scale must be positive and finite, got {depth_scale}")
    paths = layer_paths(place, list(layers))
    if place.suffix.lower() == ".npz" and "{layer}" not in str(place):
        write_image(place, layers if matrix is None else {**layers, "clip_from_world": matrix}, record=record)
        return (place,)
    # All are converted before the first is written: a layer that does not fit leaves no file.
    stored = {name: _stored(paths[name], name, array, depth_scale) for name, array in layers.items()}
    for name, (array, text) in stored.items():
        write_image(paths[name], array, background=background, text=text, record=record)
    return tuple(paths.values())


def _stored(path: Location, name: str, array: Array, depth_scale: float) -> tuple[Array, dict[str, str] | None]:
    """The array as the file holds it, and notes on its scale."""
    suffix = path.suffix.lower()
    if suffix in (".npy", ".npz") or array.dtype == np.uint8:
        return array, None
    if array.dtype == np.bool_:
        return array.view(np.uint8) * np.uint8(255), None
    if suffix in (".tif", ".tiff"):
        return array, None
    if suffix == ".png" and name in RANGES:
        low, high = RANGES[name]
        step = (high - low) / 255
        return np.rint((array - low) / step).clip(0, 255).astype(np.uint8), _notes(name, step, low)
    if suffix == ".png" and array.ndim == 2 and array.size:
        return _numbers_of_16_bits(path, name, array, depth_scale)
    raise ImageError(
        f"cannot write {str(path)!r}: {path.suffix} cannot hold the layer {name!r}, {array.dtype} {array.shape}; "
        "take .npz or .tiff"
    )


def _numbers_of_16_bits(
    path: Location, name: str, array: Array, depth_scale: float
) -> tuple[npt.NDArray[np.uint16], dict[str, str]]:
    """Numbers in equal steps; 0 where they are not finite, or ids that are -1."""
    if array.dtype == np.int32:
        _check_steps(path, name, 1.0, np.array([array.min(), array.max()], np.int64) + 1)
        return (array + 1).astype(np.uint16), _notes(name, 1, -1)
    is_there = np.isfinite(array)
    numbers = array[is_there].astype(np.float64)
    if name in LENGTHS:
        step, offset = depth_scale, 0.0
        steps = np.rint(numbers / step)
    else:
        ends = (float(numbers.min()), float(numbers.max())) if numbers.size else (0.0, 1.0)
        if name == "depth" and 0 <= ends[0] <= ends[1] <= 1:
            ends = 0.0, 1.0
        step = (ends[1] - ends[0]) / (LARGEST - 1)
        offset = ends[0] - step
        steps = 1 + np.rint((numbers - ends[0]) / step) if step else np.ones(numbers.shape)
    _check_steps(path, name, step, steps)
    values = np.zeros(array.shape, np.uint16)
    values[is_there] = steps
    return values, _notes(name, step, offset)


def _check_steps(path: Location, name: str, step: float, steps: npt.NDArray[Any]) -> None:
    """Raise an error for numbers that 16 bits do not hold."""
    low, high = steps.min(initial=0), steps.max(initial=0)
    if not (low >= 0 and high <= LARGEST):
        raise ImageError(
            f"cannot write {str(path)!r}: {name} must lie in 0 to {LARGEST} steps of {step:g} for a PNG, "
            f"got {low:g} to {high:g}; take .tiff"
            + ", or depth_scale=1 where units are millimetres"
            * (name in LENGTHS)
        )


def _notes(name: str, scale: float, offset: float) -> dict[str, str]:
    return {"topleft:layer": name, "topleft:scale": repr(scale), "topleft:offset": repr(offset)}
