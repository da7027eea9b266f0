"""Pictures and buffers to files, whole or not at all.

Input: an array, or several by name. Output: PNG, JPEG, WebP, TIFF, .npy or .npz, by the end of the file's name.
"""

from __future__ import annotations

import io
import os
import re
import struct
from collections.abc import Mapping
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.arrays import as_array
from topleft._core.base.defaults import SUFFIXES
from topleft._core.base.georeference import geo_tags, nodata_tag
from topleft._core.base.grid import Grid
from topleft._core.base.remote import Location, RemotePath, as_location
from topleft._core.base.tiff import Tags
from topleft._core.base.whole_file import write_whole
from topleft._meshes.io import png, tiff
from topleft.errors import ImageError

BYTES = ("uint8 (H, W)", "uint8 (H, W, 3)", "uint8 (H, W, 4)")
NUMBERS = (
    *BYTES,
    "uint16 (H, W)",
    "int32 (H, W)",
    "int64 (H, W)",
    *(f"float{n} (H, W{k})" for k in ("", ", K") for n in (32, 64)),
)
HOLDS: Mapping[str, tuple[str, ...]] = {
    ".png": (*BYTES, "uint8 (H, W, 2)", "uint16 (H, W)"),
    ".jpg": BYTES,
    ".jpeg": BYTES,
    ".webp": BYTES,
    ".tif": NUMBERS,
    ".tiff": NUMBERS,
}

PILLOW_OPTIONS: Mapping[str, tuple[str, dict[str, Any]]] = {
    ".jpg": ("JPEG", {"quality": 92, "subsampling": 0}),
    ".jpeg": ("JPEG", {"quality": 92, "subsampling": 0}),
    ".webp": ("WEBP", {"lossless": True}),  # ids and normals must survive
}

#: Pixels a side that libjpeg and WebP encode.
MOST_SIDE = {".jpg": 65_500, ".jpeg": 65_500, ".webp": 16_383}


RECORD = "topleft:made"
"""The word before the record of a file."""

ENDS_BYTES, MOST_OF_RECORD = 1 << 16, 1 << 15
"""Records lie in the first or the last bytes of a file; a longer one is not written."""


def save_image(
    path: str | os.PathLike[str],
    image: npt.NDArray[Any] | Mapping[str, npt.NDArray[Any]],
    *,
    background: tuple[int, int, int] = (255, 255, 255),
    text: Mapping[str, str] | None = None,
    grid: Grid | None = None,
) -> None:
    """Write a picture or a raw buffer; the file appears whole or not at all.

    Parameters
    ----------
    path : path or URL
        PNG, JPEG, WebP (lossless), TIFF, .npy or .npz, by the end of the name. A file of that name is replaced. A URL
        is whatever fsspec can write to, "s3://bucket/name.png".
    image : (H, W), (H, W, 3) or (H, W, 4) uint8, or (H, W) bool
        The picture; a mask becomes 0 and 255. PNG also holds (H, W, 2) uint8, grey with alpha, and (H, W) uint16; TIFF
        also (H, W) of uint16, int32, int64, float32 or float64, and (H, W, K) of floats, a page a channel. For .npy
        any array, for .npz any array or several by name. PNG holds neither ids nor floats: they are refused, for they
        would have to be scaled, which `ViewLayers.save` does (ids plus 1, distances in millimetres); .tif and .npy hold
        both.
    background : (3,) of 0 to 255
        The colour behind in JPEG, which has no alpha.
    text : mapping of str to str, optional
        Notes that go into a PNG, by keyword; Latin-1.
    grid : Grid, optional
        Where the picture lies: a TIFF then is a GeoTIFF with its transform, CRS and number of no data.

    Raises
    ------
    ImageError
        If the format is unknown or cannot hold the array, the text or the grid.
    ValueError
        If the picture has another size than the grid, or the CRS no EPSG code.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import topleft as tl
    >>> mask = tl.coverage([(0, 0), (4, 0), (0, 4)], [(0, 1, 2)], (4, 4))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tl.save_image(Path(folder, "mask.png"), mask)
    ...     Path(folder, "mask.png").exists()
    True
    """
    write_image(as_location("path", path), image, background=background, text=text, grid=grid)


def write_image(
    place: Location, image: npt.NDArray[Any] | Mapping[str, npt.NDArray[Any]], *,
    background: tuple[int, int, int] = (255, 255, 255), text: Mapping[str, str] | None = None, grid: Grid | None = None,
    record: tuple[str, ...] = (),
) -> None:  # fmt: skip
    """`save_image`, with a record that `read_record` returns: a note in the file, or behind the array of .npy."""
    suffix = place.suffix.lower()
    if suffix not in SUFFIXES:
        raise ImageError(f"cannot write {str(place)!r}: format {place.suffix!r} is none of {' '.join(SUFFIXES)}")
    if text and suffix != ".png":
        raise ImageError(f"cannot write {str(place)!r}: text goes into .png only")
    if grid is not None and suffix not in (".tif", ".tiff"):
        raise ImageError(f"cannot write {str(place)!r}: a grid goes into .tif only")
    note = b""
    if record:
        import json  # which few programs need

        listed = json.dumps(record)
        note = f"{RECORD} {listed}".encode() if len(listed) < MOST_OF_RECORD else b""
    if suffix == ".npz":
        arrays: dict[str, Any] = dict(image) if isinstance(image, Mapping) else {"image": image}
        write_whole(place, lambda file: _write_npz(file, arrays, note))
        return
    if isinstance(image, Mapping):
        raise ImageError(f"cannot write {str(place)!r}: several arrays by name need .npz")
    picture = as_array("image", image)
    if suffix == ".npy":
        write_whole(place, lambda file: _write_npy(file, picture, note))
        return
    if picture.dtype == np.bool_:
        picture = np.where(picture, np.uint8(255), np.uint8(0))
    picture = picture.astype(picture.dtype.newbyteorder("="), copy=False)
    _check_holds(place, picture)
    if suffix == ".png":
        notes = {**(text or {}), **({RECORD: listed} if note else {})}
        write_whole(place, lambda file: file.writelines(png.pieces(picture, text=notes)))
        return
    if suffix in (".tif", ".tiff"):
        tags: Tags = {} if grid is None else _geo_tags(grid, picture)
        tags |= {270: ("s", note + b"\0")} if note else {}  # ImageDescription
        write_whole(place, lambda file: file.writelines(tiff.pieces(picture, tags)))
        return
    if suffix in (".jpg", ".jpeg") and picture.shape[2:] == (4,):
        picture = composite(picture, background)
    from PIL import Image  # 10 ms that PNG does without

    kind, options = PILLOW_OPTIONS[suffix]
    if note:
        exif = Image.Exif()
        exif[270] = note.decode()  # ImageDescription
        options = {**options, "exif": exif}
    # In memory first: Pillow's JPEG encoder does not notice a disk that is full.
    encoded = io.BytesIO()
    Image.fromarray(picture).save(encoded, format=kind, **options)
    write_whole(place, lambda file: file.write(encoded.getbuffer()))


def _write_npy(file: IO[bytes], array: npt.NDArray[Any], note: bytes) -> None:
    np.save(file, array, allow_pickle=False)
    file.write(note)


def _write_npz(file: IO[bytes], arrays: dict[str, Any], note: bytes) -> None:
    np.savez_compressed(file, **arrays)
    file.seek(-2, os.SEEK_END)
    file.write(struct.pack("<H", len(note)) + note)  # the comment of the archive


def read_record(path: Location) -> tuple[str, ...]:
    """The record of a file of `write_image`; empty where there is no such file, or no record in it."""
    import json

    try:
        if isinstance(path, RemotePath):
            ends = path.ends(ENDS_BYTES)
        else:
            with path.open("rb") as file:
                ends = file.read(ENDS_BYTES)
                file.seek(max(len(ends), file.seek(0, os.SEEK_END) - ENDS_BYTES))
                ends += file.read()
        found = re.search(rf"{RECORD}[\0 ](\[.*)", ends.decode("latin-1"), re.DOTALL)
        record = () if found is None else tuple(json.JSONDecoder().raw_decode(found[1])[0])
    except (OSError, ValueError, RecursionError):
        return ()
    return record if all(isinstance(word, str) for word in record) else ()


def _geo_tags(grid: Grid, picture: npt.NDArray[Any]) -> Tags:
    """The tags of a GeoTIFF."""
    if picture.shape[:2] != grid.size[::-1]:
        raise ValueError(f"image must have the shape of the grid, {grid.size[::-1]}, got {picture.shape[:2]}")
    nodata: Tags = {} if grid.nodata is None else {42113: nodata_tag(grid.nodata)}
    return geo_tags(grid.crs, grid.transform) | nodata


def composite(image: npt.NDArray[np.uint8], background: tuple[int, int, int]) -> npt.NDArray[np.uint8]:
    """The RGBA picture (H, W, 4) laid over one colour: (H, W, 3) uint8, mixed as the numbers stand (sRGB)."""
    alpha = image[..., 3:].astype(np.uint32)
    mixed = image[..., :3] * alpha + np.asarray(background, dtype=np.uint32) * (255 - alpha)
    return ((mixed + 127) // 255).astype(np.uint8)


def _check_holds(path: Location, image: npt.NDArray[Any]) -> None:
    """Raise an error for an image that the format cannot hold."""
    kinds = HOLDS[path.suffix.lower()]
    channels = "".join(f", {n}" for n in image.shape[2:])
    found = {f"{image.dtype} (H, W{channels})", f"{image.dtype} (H, W{', K' * (image.ndim - 2)})"}
    if image.ndim < 2 or not found & set(kinds):
        others = ".npy holds it as it is" if kinds is NUMBERS else ".tif and .npy hold ids and floats"
        if path.suffix.lower() == ".png":
            cure = "(255 * share).astype('uint8')" if image.dtype.kind == "f" else "(ids + 1).astype('uint16')"
            others += f", .png holds {cure}"
        raise ImageError(
            f"cannot write {str(path)!r}: {path.suffix} holds {', '.join(kinds)}; got {image.dtype} {image.shape}"
            + f"; {others}" * (image.dtype.kind in "if")
        )
    most = MOST_SIDE.get(path.suffix.lower())
    if most is not None and max(image.shape[:2]) > most:
        raise ImageError(
            f"cannot write {str(path)!r}: {path.suffix} holds sides of at most {most} pixels, got {image.shape[:2]}"
        )
    if image.size == 0:
        raise ImageError(f"cannot write {str(path)!r}: a picture of shape {image.shape} has no pixels")
