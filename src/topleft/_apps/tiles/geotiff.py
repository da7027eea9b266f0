"""Writes cloud-optimised GeoTIFF: tiles, compressed, with overviews, all directories before the pixels.

Input: a raster. Output: one file. The tiles of each window are compressed where it is drawn and wait in a folder beside
the file; a second pass makes the overviews of them, and a third puts all together: the directories first, then the
tiles, those of the smallest overview first and the full resolution last.

It is written here and not by tifffile or rasterio: tifffile puts a directory behind the pixels that it describes, so
its files are not cloud-optimised, and GDAL's COG driver copies a raster that is written already, which takes the disk
twice, cannot go on after a kill, and brings 60 MB of libraries. The tests read the files with both.

Based on: TIFF, Revision 6.0, Adobe, 1992; BigTIFF, 2007; OGC GeoTIFF Standard, 1.1, 2019; OGC Cloud Optimized GeoTIFF
Standard, 1.0, 2023; Adobe Photoshop TIFF Technical Note 3, 2005 (the predictor of floats).
"""

from __future__ import annotations

import os
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from topleft._apps.tiles.folders import MANIFEST, Folder, fingerprints_at, only_writer, write_own
from topleft._apps.tiles.levels import Written, blocks_with_pixels, write_levels
from topleft._apps.tiles.store import TileStore, Writing, begin, level_size, n_levels_to
from topleft._core.base.array_types import Array
from topleft._core.base.arrays import as_count
from topleft._core.base.georeference import geo_tags, nodata_tag
from topleft._core.base.options import check_choice
from topleft._core.base.remote import as_location
from topleft._core.base.tiff import LIMIT_CLASSIC, Tags, directory, directory_bytes, header
from topleft.annex.windows import WindowedRaster

COMPRESSIONS = ("deflate", "none")


@dataclass(frozen=True)
class TiffStore(TileStore):
    """Tiles of a TIFF, each a file until all are there."""

    compression: str

    def name(self, level: int, row: int, column: int) -> str:
        """The name of a tile, by its row and column among tiles."""
        return f"{level}/{row}_{column}"

    def encoded(self, pixels: Array) -> bytes:
        """Return a tile as it is stored."""
        if self.compression == "none":
            return pixels.astype(self.dtype.newbyteorder("<"), copy=False).tobytes()
        return zlib.compress(differences(pixels), 1)

    def decoded(self, content: bytes) -> Array:
        """Return the pixels of a tile."""
        shape = (*self.tile, *self.channels)
        if self.compression == "none":
            return np.frombuffer(content, self.dtype.newbyteorder("<")).reshape(shape)
        return sums(np.frombuffer(zlib.decompress(content), np.uint8), shape, self.dtype)

    @property
    def predictor(self) -> int:
        """The number of the predictor: none, differences, differences of the bytes of floats."""
        return 1 if self.compression == "none" else 3 if self.dtype.kind == "f" else 2


def differences(pixels: Array) -> bytes:
    """Return rows of pixels as differences to the pixel before; of floats byte by byte, the high bytes first."""
    height, width = pixels.shape[:2]
    if pixels.dtype.kind == "f":
        n_bytes = pixels.dtype.itemsize
        big = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder(">")).view(np.uint8)
        planes: Array = big.reshape(height, -1, n_bytes).transpose(0, 2, 1).reshape(height, -1)
        step = pixels[0, 0].size
        out = planes.copy()
        out[:, step:] = planes[:, step:] - planes[:, :-step]
        return out.tobytes()
    unsigned = np.dtype(f"<u{pixels.dtype.itemsize}")
    values = np.ascontiguousarray(pixels).view(unsigned).reshape(height, width, -1)
    out = values.copy()
    np.subtract(values[:, 1:], values[:, :-1], out=out[:, 1:])
    return out.tobytes()


def sums(content: npt.NDArray[np.uint8], shape: tuple[int, ...], dtype: np.dtype[Any]) -> Array:
    """Undo `differences`."""
    height, width = shape[:2]
    if dtype.kind == "f":
        n_bytes, step = dtype.itemsize, int(np.prod(shape[2:], dtype=int))
        order: Array = np.cumsum(content.reshape(height, -1, step), axis=1, dtype=np.uint8).reshape(height, n_bytes, -1)
        big = np.ascontiguousarray(order.transpose(0, 2, 1)).view(dtype.newbyteorder(">"))
        return big.reshape(shape).astype(dtype)
    unsigned = np.dtype(f"<u{dtype.itemsize}")
    values = np.cumsum(content.view(unsigned).reshape(height, width, -1), axis=1, dtype=unsigned)
    return values.view(dtype).reshape(shape)


def write_geotiff(
    raster: WindowedRaster,
    path: str | os.PathLike[str],
    crs: str | int | None,
    nodata: float | None,
    compression: str,
    tile: int,
    overviews: bool,
    writing: Writing,
) -> Written:
    """`Tiles.to_geotiff`."""
    file = as_location("path", path)
    if not isinstance(file, Path):
        raise ValueError(f"path must be on this machine, got {path!r}: to_zarr writes to URLs")
    check_choice("compression", compression, COMPRESSIONS)
    side, window = as_count("tile", tile), raster.window_size
    if side % 16:
        raise ValueError(f"tile must be a multiple of 16, got {side}")
    if any(w % side and w < length for w, length in zip(window, raster.size, strict=True)):
        raise ValueError(f"window must have sides of whole tiles, of {side} pixels, got {window[0]} x {window[1]}")
    if not (raster.size[0] and raster.size[1]):
        raise ValueError(f"a GeoTIFF has pixels, got a raster of {raster.size[0]} x {raster.size[1]}")
    if not file.absolute().parent.is_dir():
        raise FileNotFoundError(f"cannot write {str(file)!r}: its folder is not there")
    if raster.grid is None and crs is not None:
        raise ValueError(f"crs is for a raster on a Grid, got {crs!r} for one in pixels")
    own_crs = raster.grid.crs if raster.grid is not None and crs is None else crs
    geo = {} if raster.grid is None else geo_tags(own_crs, raster.grid.transform)
    dtype = np.dtype(np.uint8) if raster.dtype == bool else raster.dtype
    if nodata is not None:
        raster = raster.with_nodata(nodata)
    told = raster.painter.nodata
    n_levels = n_levels_to(raster.size, side) if overviews else 1
    if n_levels > 1 and any(w % (2 * side) and w < n for w, n in zip(window, raster.size, strict=True)):
        raise ValueError(f"window must have sides of whole pairs of tiles, of {2 * side} pixels, got {window}")
    folder = Folder(file.with_name(file.name + ".parts"))
    store = TiffStore(
        folder, raster.size, window, (side, side), raster.painter.channels, dtype, raster.painter.empty, n_levels,
        compression,
    )  # fmt: skip
    place = "-".join(map(str, geo.get(34735, ("H", []))[1]))
    fingerprint = f"{raster.fingerprint} tiff 2 {side} {compression} {n_levels} {told} {place}"
    with only_writer(file):
        there = fingerprints_at(folder, file)
        goes_on = begin(raster, store, there, fingerprint, writing, n_copies=2)
        if goes_on and there[0][0] == file:  # the file is finished, no part is left
            n_windows = int((raster.index.counts > 0).sum())
            return Written(0, n_windows, raster.n_windows - n_windows)
        folder.put(MANIFEST, fingerprint.encode())
        written = write_levels(raster, store, writing)
        tags = {**geo, 305: ("s", f"topleft: {fingerprint};".encode() + b"\0")}
        write_own(file, lambda out: assemble(raster, store, out, told, tags))
        folder.remove()
    return written


@dataclass
class LevelTiles:
    """Where the tiles of a level lie in the file."""

    offsets: npt.NDArray[np.int64]  # (rows, columns)
    lengths: npt.NDArray[np.int64]
    is_blank: npt.NDArray[np.bool_]


def assemble(raster: WindowedRaster, store: TiffStore, out: IO[bytes], nodata: float | None, more: Tags) -> None:
    """Write the file of the parts: header, directories, tiles of the smallest level first."""
    blank = store.encoded(store.filled(np.empty((0, 0, *store.channels), store.dtype)))
    blocks = blocks_with_pixels(raster, store.n_levels)
    levels = [lengths_of(store, level, own, len(blank)) for level, own in enumerate(blocks)]
    n_bytes = sum(int(own.lengths[~own.is_blank].sum()) + len(blank) for own in levels)
    n_tiles = sum(own.lengths.size for own in levels)
    is_big = n_bytes + 16 * n_tiles + 4096 * len(levels) >= LIMIT_CLASSIC
    tags = [tags_of(store, level, own, is_big, nodata, more) for level, own in enumerate(levels)]
    at = len(header(is_big))
    starts = []
    for own_tags in tags:
        starts.append(at)
        at += directory_bytes(own_tags, is_big)
    for own in reversed(levels):
        at = place_tiles(own, len(blank), at)
    out.write(header(is_big))
    for level, own in enumerate(levels):
        following = starts[level + 1] if level + 1 < len(starts) else 0
        out.write(directory(tags_of(store, level, own, is_big, nodata, more), starts[level], following, is_big))
    for level in reversed(range(store.n_levels)):
        own = levels[level]
        if own.is_blank.any():
            out.write(blank)
        for row, column in np.argwhere(~own.is_blank).tolist():
            name = store.name(level, row, column)
            content = store.content(name)
            if len(content) != own.lengths[row, column]:
                raise OSError(f"{store.folder.place(name)} has changed while the raster was written")
            out.write(content)


def lengths_of(store: TiffStore, level: int, blocks: npt.NDArray[np.bool_], n_blank: int) -> LevelTiles:
    """The lengths of the tiles of a level, from the sizes of their parts."""
    (n_columns, n_rows), (columns, rows) = store.n_tiles_of_block(), store.n_tiles(level)
    is_blank = ~blocks.repeat(n_rows, axis=0).repeat(n_columns, axis=1)[:rows, :columns]
    lengths = np.full((rows, columns), n_blank, np.int64)
    for row, column in np.argwhere(~is_blank).tolist():
        name = store.name(level, row, column)
        try:
            lengths[row, column] = os.path.getsize(store.folder.place(name))
        except FileNotFoundError:
            raise store.gone(name) from None
    return LevelTiles(np.zeros((rows, columns), np.int64), lengths, is_blank)


def place_tiles(own: LevelTiles, n_blank: int, at: int) -> int:
    """Set the offsets of the tiles of a level, from a place in the file on; return their end."""
    own.offsets[own.is_blank] = at  # blank tiles share one
    lengths = own.lengths[~own.is_blank]
    ends = at + (n_blank if own.is_blank.any() else 0) + np.cumsum(lengths)
    own.offsets[~own.is_blank] = ends - lengths
    return int(ends[-1]) if len(ends) else at + n_blank


def tags_of(
    store: TiffStore, level: int, own: LevelTiles, is_big: bool, nodata: float | None, more: Tags
) -> Tags:  # fmt: skip
    """The tags of a directory: the letter of their type, and their numbers."""
    width, height = level_size(store.size, level)
    n = int(np.prod(store.channels, dtype=int))
    is_rgb = n in (3, 4) and store.dtype == np.uint8
    kind = {"u": 1, "b": 1, "i": 2, "f": 3}[store.dtype.kind]
    extra = n - (3 if is_rgb else 1)
    tags: Tags = {
        254: ("I", [1 if level else 0]),
        256: ("I", [width]),
        257: ("I", [height]),
        258: ("H", [8 * store.dtype.itemsize] * n),
        259: ("H", [1 if store.compression == "none" else 8]),
        262: ("H", [2 if is_rgb else 1]),
        277: ("H", [n]),
        284: ("H", [1]),
        317: ("H", [store.predictor]),
        322: ("I", [store.tile[0]]),
        323: ("I", [store.tile[1]]),
        324: ("Q" if is_big else "I", own.offsets.ravel()),
        325: ("I", own.lengths.ravel()),
        339: ("H", [kind] * n),
    }
    if extra:
        tags[338] = ("H", [2 if extra == 1 and store.dtype == np.uint8 else 0] * extra)
    if level == 0:
        tags |= more
    if nodata is not None:
        tags[42113] = nodata_tag(nodata)
    return dict(sorted(tags.items()))
