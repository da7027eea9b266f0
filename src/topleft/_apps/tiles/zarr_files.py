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
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from topleft._apps.tiles.folders import DiskFolder, Folder, check_space, folder_of
from topleft._apps.tiles.levels import Progress, Written, check_executor, halved, level_size, write_levels
from topleft._core.base.arrays import as_count, as_size, check_progress
from topleft._core.base.options import check_choice
from topleft.errors import MissingPackageError

if TYPE_CHECKING:
    from topleft._apps.tiles.tiles import Tiles

__all__ = ["write_zarr"]

Array = npt.NDArray[Any]

COMPRESSIONS = ("gzip", "zstd", "none")


@dataclass(frozen=True)
class ZarrLayout:
    """Blocks of pixels as chunks of Zarr arrays."""

    folder: Folder
    size: tuple[int, int]
    window: tuple[int, int]
    chunk: tuple[int, int]
    channels: tuple[int, ...]
    dtype: np.dtype[Any]
    empty: Any
    n_levels: int
    encode: Callable[[bytes], bytes]
    decode: Callable[[bytes], bytes]

    def name(self, level: int, row: int, column: int) -> str:
        """The name of a chunk, by its row and column among chunks."""
        tail = "/0" * len(self.channels)
        return ("" if self.n_levels == 1 else f"{level}/") + f"c/{row}/{column}{tail}"

    def chunks_of(self, level: int, row: int, column: int) -> list[tuple[int, int]]:
        """The chunks of a block that lie in the level."""
        (w, h), (cw, ch), (width, height) = self.window, self.chunk, level_size(self.size, level)
        rows = range(row * (h // ch), min((row + 1) * (h // ch), -(-height // ch)))
        columns = range(column * (w // cw), min((column + 1) * (w // cw), -(-width // cw)))
        return [(r, c) for r in rows for c in columns]

    def seen_from_elsewhere(self) -> ZarrLayout:
        """The same layout for processes that run in other folders."""
        return replace(self, folder=self.folder.absolute())

    def is_there(self, level: int, row: int, column: int) -> bool:
        """Whether all chunks of a block are there."""
        return all(self.folder.has(self.name(level, r, c)) for r, c in self.chunks_of(level, row, column))

    def write(self, level: int, row: int, column: int, pixels: Array) -> None:
        """Write the chunks of a block."""
        (w, h), (cw, ch) = self.window, self.chunk
        for r, c in self.chunks_of(level, row, column):
            y, x = r * ch - row * h, c * cw - column * w
            part = pixels[y : y + ch, x : x + cw]
            if part.shape[:2] != (ch, cw):  # chunks of the border are as large as others
                whole = np.empty((ch, cw, *self.channels), self.dtype)
                whole[...] = self.empty
                whole[: part.shape[0], : part.shape[1]] = part
                part = whole
            content = np.ascontiguousarray(part, self.dtype.newbyteorder("<"))
            self.folder.put(self.name(level, r, c), self.encode(content.data))  # type: ignore[arg-type]

    def read(self, level: int, row: int, column: int, shape: tuple[int, ...]) -> Array:
        """Return the pixels of a block that is there."""
        (w, h), (cw, ch) = self.window, self.chunk
        pixels = np.empty(shape, self.dtype)
        for r, c in self.chunks_of(level, row, column):
            content = self.folder.get(self.name(level, r, c))
            if content is None:
                raise OSError(f"chunk {self.name(level, r, c)} has gone while the raster was written")
            part = np.frombuffer(self.decode(content), self.dtype.newbyteorder("<")).reshape(ch, cw, *self.channels)
            y, x = r * ch - row * h, c * cw - column * w
            own = pixels[y : y + ch, x : x + cw]
            own[...] = part[: own.shape[0], : own.shape[1]]
        return pixels


def write_zarr(
    raster: Tiles,
    path: str | os.PathLike[str],
    chunk: int | tuple[int, int] | None,
    compression: str,
    levels: int,
    resume: bool,
    progress: Progress | bool | None,
    executor: Any,
    storage: dict[str, Any] | None,
) -> Written:
    """`Tiles.to_zarr`."""
    check_progress(progress)
    check_executor(executor)
    n_levels = as_count("levels", levels)
    window = raster.window_size
    size = window if chunk is None else as_size(chunk, "chunk", smallest=1)
    if window[0] % size[0] or window[1] % size[1]:
        raise ValueError(f"chunk must divide the windows of {window[0]} x {window[1]} pixels, got {size}")
    check_halves(window, n_levels, raster.size)
    encode, decode, codec = codec_of(compression)
    folder = folder_of(path, storage)
    empty = raster.painter.empty
    layout = ZarrLayout(
        folder, raster.size, window, size, raster.painter.channels, raster.dtype, empty, n_levels, encode, decode
    )
    words = f"zarr {size} {compression} {n_levels}"
    fingerprint = f"{raster.fingerprint} {words}"
    found = folder.get("zarr.json")
    if found is not None or folder.exists():
        check_resumable(found, fingerprint, str(path), resume)
    if isinstance(folder, DiskFolder):
        if found is None:
            check_space(folder.path, bytes_of(raster, n_levels, compression == "none"), f"a raster of {raster.shape}")
        else:
            folder.sweep()
    write_metadata(raster, layout, codec, fingerprint)
    return write_levels(
        raster,
        layout,
        dtype=raster.dtype,
        blank=empty,
        halve=lambda pixels: halved(pixels, raster.painter.nodata, is_mean=raster.has_means),
        progress=progress,
        executor=executor,
    )


def codec_of(compression: str) -> tuple[Callable[[bytes], bytes], Callable[[bytes], bytes], list[dict[str, Any]]]:
    """How chunks are compressed and read, and what metadata says of it."""
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
        raise MissingPackageError("compression 'zstd' needs the package zarr: pip install 'topleft[tiles]'") from None
    codec = Zstd(level=1)
    return codec.encode, codec.decode, [{"name": "zstd", "configuration": {"level": 1, "checksum": False}}]


def gzipped(content: bytes) -> bytes:
    """Return a gzip member without a time: the same bytes at any time."""
    deflate = zlib.compressobj(1, zlib.DEFLATED, 31)
    return deflate.compress(content) + deflate.flush()


def check_halves(window: tuple[int, int], n_levels: int, size: tuple[int, int]) -> None:
    """Raise an error unless windows of a raster of several have halves.

    Raises
    ------
    ValueError
        If not.
    """
    if n_levels > 1 and any(w % 2 and w < length for w, length in zip(window, size, strict=True)):
        raise ValueError(f"window must have even sides for several levels, got {window[0]} x {window[1]}")


def check_resumable(found: bytes | None, fingerprint: str, path: str, resume: bool) -> None:
    """Raise an error unless a run may go on with what is there.

    Raises
    ------
    FileExistsError
        If something is there and nobody said to go on with it.
    ValueError
        If it is of another run.
    """
    if not resume:
        raise FileExistsError(f"{path} exists: resume=True goes on with it, if it is of this raster; else remove it")
    try:
        kept = json.loads(found or b"")["attributes"]["topleft"]["fingerprint"]
    except (ValueError, KeyError, TypeError):
        kept = None
    if kept != fingerprint:
        raise ValueError(
            f"{path} is not of this raster: the mesh, an option or the size of windows differs; write elsewhere"
        )


def bytes_of(raster: Tiles, n_levels: int, is_plain: bool) -> int:
    """How many bytes a raster takes at most on disk.

    Where it is compressed and the plain size would not fit, the fullest window tells by how much it shrinks.
    """
    counts = raster.index.counts
    w, h = raster.window_size
    n = int((counts > 0).sum()) * w * h * raster.dtype.itemsize * int(np.prod(raster.painter.channels, dtype=int))
    if not is_plain and n > 1 << 28:
        row, column = np.unravel_index(int(np.argmax(counts)), counts.shape)
        sample = raster.draw_window(int(row), int(column))
        n = int(n * min(1.0, 1.25 * len(gzipped(np.ascontiguousarray(sample).data)) / sample.nbytes))  # type: ignore[arg-type]
    return n + (n // 3 if n_levels > 1 else 0)


def json_number(value: Any) -> Any:
    """A fill value as Zarr has it."""
    number = np.asarray(value).ravel()[0].item()
    if isinstance(number, float):
        if np.isnan(number):
            return "NaN"
        if np.isinf(number):
            return "Infinity" if number > 0 else "-Infinity"
    return number


def write_metadata(raster: Tiles, layout: ZarrLayout, codec: list[dict[str, Any]], fingerprint: str) -> None:
    """Write zarr.json of all levels."""
    own: dict[str, Any] = {"fingerprint": fingerprint, "kind": raster.kind}
    if raster.grid is not None:
        own |= {"extent": list(raster.grid.extent), "y": raster.grid.y}
    arrays = []
    for level in range(layout.n_levels):
        width, height = level_size(layout.size, level)
        channels = list(layout.channels)
        arrays.append({
            "zarr_format": 3,
            "node_type": "array",
            "shape": [height, width, *channels],
            "data_type": str(layout.dtype),
            "chunk_grid": {
                "name": "regular", "configuration": {"chunk_shape": [layout.chunk[1], layout.chunk[0], *channels]}
            },
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
            "fill_value": json_number(layout.empty),
            "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, *codec],
            "dimension_names": ["y", "x", "channel"][: 2 + len(channels)],
            "attributes": {},
        })  # fmt: skip
    if layout.n_levels == 1:
        arrays[0]["attributes"] = {"topleft": own}
        layout.folder.put("zarr.json", _json(arrays[0]))
        return
    # First what tells whose this is: a run that is killed here goes on.
    attributes = {"topleft": own, "ome": _multiscales(raster, layout)}
    layout.folder.put("zarr.json", _json({"zarr_format": 3, "node_type": "group", "attributes": attributes}))
    for level, array in enumerate(arrays):
        layout.folder.put(f"{level}/zarr.json", _json(array))


def _multiscales(raster: Tiles, layout: ZarrLayout) -> dict[str, Any]:
    """What OME-Zarr says of levels: a pixel of level k is 2**k of those of level 0."""
    step = (1.0, 1.0) if raster.grid is None else raster.grid.pixel_size[::-1]
    tail = [1.0] * len(layout.channels)
    axes = [{"name": name, "type": "space"} for name in "yx"]
    axes += [{"name": "channel", "type": "channel"}] * len(layout.channels)
    datasets = []
    for level in range(layout.n_levels):
        scale = [step[0] * 2**level, step[1] * 2**level, *tail]
        shift = [step[0] * (2**level - 1) / 2, step[1] * (2**level - 1) / 2, *([0.0] * len(tail))]
        transforms = [{"type": "scale", "scale": scale}, {"type": "translation", "translation": shift}]
        datasets.append({"path": str(level), "coordinateTransformations": transforms})
    return {"version": "0.5", "multiscales": [{"name": raster.kind, "axes": axes, "datasets": datasets}]}


def _json(value: Any) -> bytes:
    return json.dumps(value, indent=1).encode()
