"""Writes pyramids of Deep Zoom: tiles of PNG, down to one pixel, for viewers of large pictures.

Input: a raster, and how its numbers become colours. Output: NAME.dzi and the folder NAME_files.

Based on: Deep Zoom File Format Overview, Microsoft, 2008.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from topleft._apps.tiles.folders import MANIFEST, Folder, fingerprints_at, only_writer, write_own
from topleft._apps.tiles.levels import Written, blocks_with_pixels, halved, write_levels
from topleft._apps.tiles.store import TileStore, Writing, begin, n_levels_to
from topleft._core.base.array_types import U8, Array
from topleft._core.base.arrays import as_count, shown
from topleft._core.base.color import id_colors
from topleft._core.base.remote import as_location
from topleft.annex.files import png
from topleft.annex.windows import WindowedRaster


class DeepZoomStore(TileStore):
    """Tiles of PNG. Deep Zoom counts levels from one pixel on."""

    is_filled = False

    def name(self, level: int, row: int, column: int) -> str:
        """The name of a tile, by its row and column among tiles."""
        return f"{self.n_levels - 1 - level}/{column}_{row}.png"

    def encoded(self, pixels: Array) -> bytes:
        """Return a tile as it is stored."""
        return png.encode(pixels)

    def decoded(self, content: bytes) -> Array:
        """Return the pixels of a tile."""
        from PIL import Image

        with Image.open(io.BytesIO(content)) as image:
            image.verify()  # the checksums of its chunks, which reading ignores
        with Image.open(io.BytesIO(content)) as image:
            return np.asarray(image)


def write_deepzoom(
    raster: WindowedRaster,
    path: str | os.PathLike[str],
    tile: int,
    colors: Callable[[Array], U8] | None,
    writing: Writing,
) -> Written:
    """`Tiles.to_deepzoom`."""
    file = as_location("path", path)
    if not isinstance(file, Path):
        raise ValueError(f"path must be on this machine, got {path!r}: to_zarr writes to URLs")
    if file.suffix != ".dzi":
        raise ValueError(f"path must end in .dzi, got {file.name!r}")
    side, window = as_count("tile", tile), raster.window_size
    if side & (side - 1):
        raise ValueError(f"tile must be a power of 2, got {side}")
    if any(w % (2 * side) and w < length for w, length in zip(window, raster.size, strict=True)):
        raise ValueError(f"window must have sides of whole pairs of tiles, of {2 * side} pixels, got {window}")
    if not (raster.size[0] and raster.size[1]):
        raise ValueError(f"Deep Zoom has pixels, got a raster of {raster.size[0]} x {raster.size[1]}")
    if not (colors is None or callable(colors)):
        raise TypeError(f"colors must be a function of an array, got {shown(colors)}")
    paint = painting(raster) if colors is None else colors
    ground = checked(paint(raster.painter.blank((1, 1))), (1, 1))
    n_levels = n_levels_to(raster.size, 1)
    folder = Folder(file.with_name(f"{file.stem}_files"))
    store = DeepZoomStore(
        folder, raster.size, window, (side, side), ground.shape[2:], np.dtype(np.uint8), ground[0, 0], n_levels
    )
    fingerprint = f"{raster.fingerprint} deepzoom 2 {side} {ground.tolist()}"

    def prepare(pixels: Array) -> U8:
        return checked(paint(pixels), pixels.shape[:2])

    with only_writer(file):
        there = fingerprints_at(folder, file)
        if not begin(raster, store, there, fingerprint, writing, prepare=prepare):
            file.unlink(missing_ok=True)
            folder.put(MANIFEST, fingerprint.encode())
        written = write_levels(raster, store, writing, halve=halved_colors, prepare=prepare)
        fill_blanks(raster, store, ground)
        width, height = raster.size
        description = (
            f'<?xml version="1.0" encoding="UTF-8"?>\n<!-- topleft: {fingerprint}; -->\n'
            '<Image xmlns="http://schemas.microsoft.com/deepzoom/2008" '
            f'Format="png" Overlap="0" TileSize="{side}"><Size Width="{width}" Height="{height}"/></Image>\n'
        )
        write_own(file, lambda out: out.write(description.encode()))
    return written


def fill_blanks(raster: WindowedRaster, store: DeepZoomStore, ground: U8) -> None:
    """Write the tiles that no triangle touches: viewers ask for all."""
    contents: dict[tuple[int, ...], bytes] = {}
    for level, blocks in enumerate(blocks_with_pixels(raster, store.n_levels)):
        for block in np.argwhere(~blocks).tolist():
            blank = np.broadcast_to(ground[0, 0], store.shape_of(level, *block))
            for r, c in store.tiles_of(level, *block):
                tile, name = blank[store.location_of(r, c, *block)], store.name(level, r, c)
                if tile.shape not in contents:
                    contents[tile.shape] = store.encoded(tile)
                if not store.folder.has(name):
                    store.folder.put(name, contents[tile.shape])


def painting(raster: WindowedRaster) -> Callable[[Array], U8]:
    """Return the function that makes colours of the pixels of a kind."""
    if raster.kind == "labels":
        return partial(label_colors, empty=raster.painter.empty)
    if raster.dtype == bool:
        return lambda mask: mask.view(np.uint8) * np.uint8(255)
    if raster.kind == "coverage":
        return lambda share: np.rint(share * np.float32(255)).astype(np.uint8)
    if raster.kind == "overdraw":
        return lambda counts: np.rint(np.minimum(counts, 255)).astype(np.uint8)
    if raster.kind in ("depth", "field", "height_map") and not raster.painter.channels:
        low, high = raster.range_of_values
        return partial(greys, empty=raster.painter.empty, low=low, high=high)
    if raster.dtype == np.uint8 and raster.shape[2:] in ((), (2,), (3,), (4,)):
        return lambda pixels: pixels
    raise ValueError(f"colors must say how {raster.dtype} of kind {raster.kind!r} becomes uint8")


def greys(values: Array, empty: Any, low: float, high: float) -> U8:
    """Greys (H, W, 2) from black at the lowest value to white at the highest, transparent where there is none."""
    is_there = ~np.isnan(values) if values.dtype.kind == "f" and np.isnan(empty) else values != empty
    numbers = np.where(is_there, values, low).astype(np.float64)
    shade = (numbers - low) * (255 / (high - low)) if high > low else np.full(values.shape, 128.0)
    return np.stack([np.rint(shade.clip(0, 255)) * is_there, is_there * 255], axis=-1).astype(np.uint8)


def halved_colors(pixels: U8) -> U8:
    """Return colours of half the size: the mean of four, weighted by alpha."""
    if pixels.shape[2:] not in ((2,), (4,)):
        return halved(pixels, None, is_mean=True)
    height, width = pixels.shape[:2]
    even = np.pad(pixels, [(0, height % 2), (0, width % 2), (0, 0)], "edge").astype(np.uint32)
    even[..., :-1] *= even[..., -1:]
    total = even[::2, ::2] + even[::2, 1::2] + even[1::2, ::2] + even[1::2, 1::2]
    alpha = np.maximum(total[..., -1:], 1)
    return np.concatenate([(total[..., :-1] + alpha // 2) // alpha, (total[..., -1:] + 2) >> 2], axis=-1).astype(
        np.uint8
    )


def label_colors(labels: Array, empty: int) -> U8:
    """A colour (H, W, 4) for each label, transparent for nothing."""
    names, at = np.unique(labels, return_inverse=True)
    palette = np.zeros((len(names), 4), np.uint8)
    palette[:, :3] = id_colors(names)
    palette[:, 3] = 255
    palette[names == empty] = 0
    return palette[at.reshape(labels.shape)]


def checked(pixels: Any, size: tuple[int, ...]) -> U8:
    """Return the result of a user's `colors` function, if it is a picture."""
    array = np.asarray(pixels)
    if array.dtype != np.uint8 or array.shape[:2] != size or array.shape[2:] not in ((), (1,), (2,), (3,), (4,)):
        raise ValueError(f"colors must give uint8 {(*size, 3)}, say, got {array.dtype} {array.shape}")
    return array[..., 0] if array.shape[2:] == (1,) else array
