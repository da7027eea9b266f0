"""PNG files: from a picture to the bytes of the file, which are the same on every machine.

Input: an array of uint8 (grey, grey with alpha, RGB, RGBA) or of uint16 (grey). Output: the file, in pieces.

The engine filters and compresses, `csrc/pixels/png.c`.

Based on: Portable Network Graphics (PNG) Specification, Third Edition, W3C, 2025.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.memory import empty
from topleft.errors import ImageError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
COLOR_TYPES = {(): 0, (2,): 4, (3,): 2, (4,): 6}
"""Colour types of the header, by the axes after height and width."""

ZLIB_HEADER, LAST_BLOCK = b"\x78\x01", b"\x03\x00"  # RFC 1950; a block of nothing

BAND_BYTES = 1 << 20
"""Rows are compressed by so much at a time, each with separate codes."""


def encode(image: npt.NDArray[Any], *, text: Mapping[str, str] | None = None) -> bytes:
    r"""Return the bytes of a PNG file.

    `image`: (H, W), (H, W, 2), (H, W, 3) or (H, W, 4) uint8, grey to RGBA, or (H, W) uint16, of any layout; `text`:
    keywords of 1 to 79 characters, and notes in Latin-1.

    >>> import numpy as np
    >>> encode(np.zeros((2, 2), np.uint8))[:8]
    b'\x89PNG\r\n\x1a\n'
    """
    return b"".join(pieces(image, text=text))


def pieces(image: npt.NDArray[Any], *, text: Mapping[str, str] | None = None) -> Iterator[bytes]:
    """Yield the bytes of `encode` piece by piece, so that a large picture is not copied as a whole."""
    image = np.asarray(image)
    kinds = COLOR_TYPES if image.dtype == np.uint8 else {(): 0} if image.dtype == np.uint16 else {}
    if image.ndim < 2 or image.shape[2:] not in kinds:
        raise ImageError(
            "PNG holds uint8 of shape (H, W), (H, W, 2), (H, W, 3) or (H, W, 4) and uint16 of shape (H, W), "
            f"got {image.dtype} of shape {image.shape}"
        )
    height, width = image.shape[:2]
    if not image.size:
        raise ImageError(f"a picture of shape {image.shape} has no pixels")
    header = struct.pack(">IIBBBBB", width, height, 8 * image.dtype.itemsize, kinds[image.shape[2:]], 0, 0, 0)
    start = SIGNATURE + _chunk(b"IHDR", header) + b"".join(_text_chunk(*item) for item in (text or {}).items())
    row_bytes, pixel_bytes = image[0].size * image.itemsize, image[0, 0].size * image.itemsize
    n_rows = min(height, max(1, BAND_BYTES // row_bytes))
    row, block = np.empty(1 + row_bytes, np.uint8), empty((engine.png_room(n_rows, row_bytes),), np.uint8)
    above, adler = np.zeros(row_bytes, np.uint8), 1
    for first in range(0, height, n_rows):
        rows = _bytes_of(image[first : first + n_rows])
        n, adler = engine.encode_rows(rows, above, pixel_bytes, adler, row, block)
        is_last = first + n_rows >= height
        end = LAST_BLOCK + struct.pack(">I", adler) if is_last else b""
        data = _chunk(b"IDAT", b"" if first else ZLIB_HEADER, block[:n].data, end)
        yield b"".join((b"" if first else start, data, _chunk(b"IEND") if is_last else b""))
        above = rows[-1]


def _bytes_of(rows: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Rows (N, B) uint8 as they stand in the file: samples of 16 bits with the high byte first."""
    in_order = np.ascontiguousarray(rows, np.uint8 if rows.dtype == np.uint8 else ">u2")
    return in_order.view(np.uint8).reshape(len(rows), -1)


def _chunk(name: bytes, *parts: bytes | memoryview) -> bytes:
    crc = zlib.crc32(name)
    for part in parts:
        crc = zlib.crc32(part, crc)
    return b"".join((struct.pack(">I", sum(map(len, parts))), name, *parts, struct.pack(">I", crc)))


def _text_chunk(keyword: str, text: str) -> bytes:
    try:
        key, value = keyword.encode("latin-1"), text.encode("latin-1")
    except UnicodeEncodeError:
        raise ImageError(f"text of a PNG must be Latin-1, got {keyword!r}: {text!r}") from None
    if not 1 <= len(key) <= 79 or b"\0" in key + value:
        raise ImageError(f"a keyword of a PNG has 1 to 79 characters and no text has a NUL, got {keyword!r}: {text!r}")
    return _chunk(b"tEXt", key + b"\0" + value)
