"""Writes Zarr, version 3: one array, or a group of levels in the manner of OME-Zarr.

Input: a raster. Output: `zarr.json` and the chunks, each whole or not there. The format is small enough to be written
here: chunks are then renamed into place, compressed in the thread that draws them, and no package is needed.

Based on: Zarr core specification, version 3.0, 2023; OME-Zarr, Next-generation file format specifications, 0.5, 2024.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from topleft._apps.tiles.folders import Folder, folder_of, only_writer
from topleft._apps.tiles.levels import Written, write_levels
from topleft._apps.tiles.store import TileStore, Writing, begin, level_size
from topleft._core.base.array_types import Array
from topleft._core.base.arrays import as_count, as_size
from topleft._core.base.options import check_choice
from topleft._core.base.remote import as_location
from topleft.annex.windows import WindowedRaster
from topleft.errors import MissingPackageError

COMPRESSIONS = ("gzip", "zstd", "none")


@dataclass(frozen=True)
class ZarrStore(TileStore):
    """Tiles as chunks of Zarr arrays."""

    encode: Callable[[bytes], bytes]
    decode: Callable[[bytes], bytes]

    def name(self, level: int, row: int, column: int) -> str:
        """The name of a chunk, by its row and column among chunks."""
        tail = "/0" * len(self.channels)
        return ("" if self.n_levels == 1 else f"{level}/") + f"c/{row}/{column}{tail}"

    def encoded(self, pixels: Array) -> bytes:
        """Return a chunk as it is stored."""
        return self.encode(np.ascontiguousarray(pixels, self.dtype.newbyteorder("<")).data)  # type: ignore[arg-type]

    def decoded(self, content: bytes) -> Array:
        """Return the pixels of a chunk."""
        pixels = np.frombuffer(self.decode(content), self.dtype.newbyteorder("<"))
        return pixels.reshape(*self.tile[::-1], *self.channels)


def write_zarr(
    raster: WindowedRaster,
    path: str | os.PathLike[str],
    chunk: int | tuple[int, int] | None,
    compression: str,
    levels: int,
    writing: Writing,
    storage: dict[str, Any] | None,
) -> Written:
    """`Tiles.to_zarr`."""
    n_levels = as_count("levels", levels)
    window = raster.window_size
    size = window if chunk is None else as_size(chunk, "chunk", smallest=1)
    if any(w % side and w < length for w, side, length in zip(window, size, raster.size, strict=True)):
        raise ValueError(f"chunk must divide the windows of {window[0]} x {window[1]} pixels, got {size}")
    if n_levels > 1 and any(w % 2 and w < length for w, length in zip(window, raster.size, strict=True)):
        raise ValueError(f"window must have even sides for several levels, got {window[0]} x {window[1]}")
    encode, decode, codec = codec_of(compression)
    folder = folder_of(path, storage)
    store = ZarrStore(
        folder, raster.size, window, size, raster.painter.channels, raster.dtype, raster.painter.empty, n_levels,
        encode, decode,
    )  # fmt: skip
    fingerprint = f"{raster.fingerprint} zarr {size} {compression} {n_levels}"
    with only_writer(as_location("path", path)):
        there: list[tuple[object, str | None]] = [(path, fingerprint_in(folder))] if folder.exists() else []
        begin(raster, store, there, fingerprint, writing)
        write_metadata(raster, store, codec, fingerprint)
        return write_levels(raster, store, writing)


def codec_of(compression: str) -> tuple[Callable[[bytes], bytes], Callable[[bytes], bytes], list[dict[str, Any]]]:
    """Return the functions that compress and decompress chunks, and the codecs of the metadata."""
    check_choice("compression", compression, COMPRESSIONS)
    if compression == "none":
        return bytes, bytes, []
    if compression == "gzip":
        return gzipped, lambda content: zlib.decompress(content, 31), [
            {"name": "gzip", "configuration": {"level": 1}}
        ]  # fmt: skip
    try:
        from numcodecs.zstd import Zstd
    except ImportError:
        raise MissingPackageError("compression 'zstd' needs the package zarr: pip install zarr") from None
    codec = Zstd(level=1)
    return codec.encode, codec.decode, [{"name": "zstd", "configuration": {"level": 1, "checksum": False}}]


def gzipped(content: bytes) -> bytes:
    """Return a gzip member without a time: the same bytes at any time."""
    deflate = zlib.compressobj(1, zlib.DEFLATED, 31)
    return deflate.compress(content) + deflate.flush()


def fingerprint_in(folder: Folder) -> str | None:
    """The entry of topleft in the metadata; None if there is none."""
    try:
        return str(json.loads(folder.get("zarr.json") or b"")["attributes"]["topleft"]["fingerprint"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def json_number(value: Any) -> Any:
    """A fill value as Zarr has it."""
    number = np.asarray(value).ravel()[0].item()
    if isinstance(number, float):
        if np.isnan(number):
            return "NaN"
        if np.isinf(number):
            return "Infinity" if number > 0 else "-Infinity"
    return number


def write_metadata(raster: WindowedRaster, store: ZarrStore, codec: list[dict[str, Any]], fingerprint: str) -> None:
    """Write zarr.json of all levels."""
    own: dict[str, Any] = {"fingerprint": fingerprint, "kind": raster.kind}
    if raster.grid is not None:
        own |= {"extent": list(raster.grid.extent), "y": raster.grid.y}
    arrays = []
    for level in range(store.n_levels):
        width, height = level_size(store.size, level)
        channels = list(store.channels)
        arrays.append({
            "zarr_format": 3,
            "node_type": "array",
            "shape": [height, width, *channels],
            "data_type": str(store.dtype),
            "chunk_grid": {
                "name": "regular", "configuration": {"chunk_shape": [*store.tile[::-1], *channels]}
            },
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
            "fill_value": json_number(store.empty),
            "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, *codec],
            "dimension_names": ["y", "x", "channel"][: 2 + len(channels)],
            "attributes": {},
        })  # fmt: skip
    if store.n_levels == 1:
        arrays[0]["attributes"] = {"topleft": own}
        store.folder.put("zarr.json", _json(arrays[0]))
        return
    # The fingerprint first: after a kill here `resume` knows the raster.
    attributes = {"topleft": own, "ome": _multiscales(raster, store)}
    store.folder.put("zarr.json", _json({"zarr_format": 3, "node_type": "group", "attributes": attributes}))
    for level, array in enumerate(arrays):
        store.folder.put(f"{level}/zarr.json", _json(array))


def _multiscales(raster: WindowedRaster, store: ZarrStore) -> dict[str, Any]:
    """The levels as OME-Zarr lists them: a pixel of level k is 2**k of those of level 0."""
    step = (1.0, 1.0) if raster.grid is None else raster.grid.pixel_size[::-1]
    tail = [1.0] * len(store.channels)
    axes = [{"name": name, "type": "space"} for name in "yx"]
    axes += [{"name": "channel", "type": "channel"}] * len(store.channels)
    datasets = []
    for level in range(store.n_levels):
        scale = [step[0] * 2**level, step[1] * 2**level, *tail]
        shift = [step[0] * (2**level - 1) / 2, step[1] * (2**level - 1) / 2, *([0.0] * len(tail))]
        transforms = [{"type": "scale", "scale": scale}, {"type": "translation", "translation": shift}]
        datasets.append({"path": str(level), "coordinateTransformations": transforms})
    return {"version": "0.5", "multiscales": [{"name": raster.kind, "axes": axes, "datasets": datasets}]}


def _json(value: Any) -> bytes:
    return json.dumps(value, indent=1).encode()
