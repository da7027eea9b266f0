"""Pictures and numbers as TIFF: strips of rows, compressed by deflate, all directories before the pixels.

Input: a picture of bytes, or numbers of any type, and tags. Output: the bytes of a file. Pillow, which writes the other
formats, has no floats of 64 bits.

Based on: TIFF, Revision 6.0, Adobe, 1992; Adobe Photoshop TIFF Technical Notes, 2002 (deflate).
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.tiff import LIMIT_CLASSIC, Tags, directory, directory_bytes, header

STRIP_BYTES = 1 << 18
"""Bytes of rows that are compressed together: readers take memory for one strip."""


def pieces(picture: npt.NDArray[Any], more: Tags | None = None) -> Iterator[bytes]:
    """Yield the bytes of a TIFF: a page of a picture of bytes, or for each channel; `more`: tags of the first."""
    is_picture = picture.ndim == 3 and picture.dtype == np.uint8
    pages = [picture] if picture.ndim == 2 or is_picture else list(np.moveaxis(picture, -1, 0))
    strips = [_strips(page) for page in pages]
    is_big = sum(len(strip) + 16 for own in strips for strip in own) + 4096 * len(pages) >= LIMIT_CLASSIC
    tags = [_tags(page, own, 0, is_big, more) for page, own in zip(pages, strips, strict=True)]
    starts = np.cumsum([len(header(is_big)), *(directory_bytes(own, is_big) for own in tags)]).tolist()
    at = starts.pop()
    yield header(is_big)
    for page, own, start, following in zip(pages, strips, starts, [*starts[1:], 0], strict=True):
        yield directory(_tags(page, own, at, is_big, more), start, following, is_big)
        at += sum(map(len, own))
        more = None
    for own in strips:
        yield from own


def _n_rows(page: npt.NDArray[Any]) -> int:
    """Rows of a strip."""
    return max(1, min(len(page), STRIP_BYTES // page[0].nbytes))


def _strips(page: npt.NDArray[Any]) -> list[bytes]:
    little, n_rows = page.dtype.newbyteorder("<"), _n_rows(page)
    return [zlib.compress(page[i : i + n_rows].astype(little).tobytes()) for i in range(0, len(page), n_rows)]


def _tags(page: npt.NDArray[Any], strips: list[bytes], at: int, is_big: bool, more: Tags | None) -> Tags:
    """The tags of a page with strips that lie in the file from a place on."""
    (height, width), n = page.shape[:2], page[0, 0].size
    lengths = np.array([len(strip) for strip in strips], np.int64)
    offsets = at + np.cumsum(lengths) - lengths
    tags: Tags = {
        256: ("I", [width]),
        257: ("I", [height]),
        258: ("H", [8 * page.dtype.itemsize] * n),
        259: ("H", [8]),  # deflate
        262: ("H", [2 if n > 1 else 1]),  # RGB, or black is 0
        273: ("Q" if is_big else "I", offsets),
        277: ("H", [n]),
        278: ("I", [_n_rows(page)]),
        279: ("I", lengths),
        339: ("H", [{"u": 1, "i": 2, "f": 3}[page.dtype.kind]] * n),
    }
    if n == 4:
        tags[338] = ("H", [2])  # alpha that the colours are not multiplied by
    return dict(sorted((tags | (more or {})).items()))
