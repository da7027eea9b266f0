"""Writes Zarr, version 3: a group that xarray opens, with coarser levels in groups below, in the manner of OME-Zarr.

Input: a raster. Output: `zarr.json` and the chunks, each whole or not there. The format is small enough to be written
here: chunks are then renamed into place, compressed in the thread that draws them, and no package is needed.

Based on: Zarr core specification, version 3.0, 2023; OME-Zarr, Next-generation file format specifications, 0.5, 2024.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from topleft._apps.tiles.folders import Folder, folder_of, only_writer
from topleft._apps.tiles.levels import Written, write_levels
from topleft._apps.tiles.store import TileStore, Writing, begin, level_size
from topleft._core.base.array_types import F64, Array
from topleft._core.base.arrays import as_count, as_size
from topleft._core.base.grid import Grid
from topleft._core.base.options import check_choice
from topleft._core.base.remote import as_location
from topleft.annex.windows import WindowedRaster
from topleft.errors import MissingPackageError

COMPRESSIONS = ("gzip", "zstd", "none")


@dataclass(frozen=True)
class ZarrStore(TileStore):
    """Tiles as chunks of Zarr arrays."""

    kind: str  # the name of the array
    encode: Callable[[bytes], bytes]
    decode: Callable[[bytes], bytes]

    def group(self, level: int) -> str:
        """Where the arrays of a level are: level 0 is the store itself."""
        return f"{level}/" if level else ""

    def name(self, level: int, row: int, column: int) -> str:
        """The name of a chunk, by its row and column among chunks."""
        return f"{self.group(level)}{self.kind}/c/{row}/{column}" + "/0" * len(self.channels)

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
        raster.kind, encode, decode,
    )  # fmt: skip
    crs = None if raster.grid is None else raster.grid.crs
    fingerprint = f"{raster.fingerprint} zarr 2 {size} {compression} {n_levels} {crs}"
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
    """Write zarr.json of all groups and arrays, and the coordinates."""
    own: dict[str, Any] = {"fingerprint": fingerprint, "kind": raster.kind}
    if raster.grid is not None:
        own |= {"extent": list(raster.grid.extent), "y": raster.grid.y}
    attributes = {"topleft": own} | ({"ome": _multiscales(raster, store)} if store.n_levels > 1 else {})
    levels = [_arrays(raster, store, level, codec) for level in range(store.n_levels)]
    below: dict[str, Any] = {}
    for level, arrays in enumerate(levels):
        below |= {str(level): _group({}, arrays)} if level else {}
        below |= {f"{store.group(level)}{name}": array for name, array in arrays.items()}
    # The fingerprint first: after a kill here `resume` knows the raster.
    for name, entry in ("", _group(attributes, below)), *below.items():
        store.folder.put(f"{name}/zarr.json".removeprefix("/"), _json(entry))
    if raster.grid is not None:
        for level in range(store.n_levels):
            for name, centers in zip("xy", _centers(raster.grid, store, level), strict=True):
                store.folder.put(f"{store.group(level)}{name}/c/0", centers.tobytes())


def _group(attributes: dict[str, Any], below: dict[str, Any]) -> dict[str, Any]:
    """The metadata of a group, and of all below it: xarray reads them in one request."""
    listed = {"kind": "inline", "must_understand": False, "metadata": below}
    return {"zarr_format": 3, "node_type": "group", "attributes": attributes, "consolidated_metadata": listed}


def _centers(grid: Grid, store: ZarrStore, level: int) -> tuple[F64, F64]:
    """The x of the columns and the y of the rows of a level."""
    right, _, x, _, down, y = grid.transform
    columns, rows = (np.arange(n) + 0.5 for n in level_size(store.size, level))
    return np.add(x, columns * (right * 2**level), dtype="<f8"), np.add(y, rows * (down * 2**level), dtype="<f8")


def _arrays(raster: WindowedRaster, store: ZarrStore, level: int, codec: list[dict[str, Any]]) -> dict[str, Any]:
    """The metadata of the arrays of a level, by name."""
    (width, height), channels = level_size(store.size, level), list(store.channels)
    grid, told = raster.grid, raster.painter.nodata
    attributes = {} if told is None else {"nodata": json_number(told)}
    attributes |= {} if grid is None else {"grid_mapping": "spatial_ref", "coordinates": "spatial_ref"}
    dims, shape = ["y", "x", "channel"][: 2 + len(channels)], [height, width, *channels]
    arrays = {
        raster.kind: _array(
            store.dtype, dims, shape, [*store.tile[::-1], *channels], json_number(store.empty), codec, attributes
        )
    }
    if grid is not None:
        right, _, x, _, down, y = grid.transform
        place = {"GeoTransform": " ".join(map(repr, (x, right * 2**level, 0.0, y, 0.0, down * 2**level)))}
        place |= {} if grid.crs is None else {"spatial_ref": grid.crs}
        number = np.dtype(np.float64)
        arrays["x"] = _array(number, ["x"], [width], [max(width, 1)], "NaN")
        arrays["y"] = _array(number, ["y"], [height], [max(height, 1)], "NaN")
        arrays["spatial_ref"] = _array(np.dtype(np.int64), [], [], [], 0, attributes=place)
    return arrays


def _array(
    dtype: np.dtype[Any], dims: list[str], shape: list[int], chunk: list[int], fill: Any,
    codec: Sequence[dict[str, Any]] = (), attributes: Mapping[str, Any] = MappingProxyType({}),
) -> dict[str, Any]:  # fmt: skip
    """The metadata of an array."""
    return {
        "zarr_format": 3,
        "node_type": "array",
        "shape": shape,
        "data_type": str(dtype),
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": fill,
        "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, *codec],
        "dimension_names": dims,
        "attributes": dict(attributes),
    }


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
        datasets.append({"path": f"{store.group(level)}{store.kind}", "coordinateTransformations": transforms})
    return {"version": "0.5", "multiscales": [{"name": raster.kind, "axes": axes, "datasets": datasets}]}


def _json(value: Any) -> bytes:
    return json.dumps(value, indent=1).encode()
