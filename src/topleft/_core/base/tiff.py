"""The bytes of a TIFF that hold no pixels: its header and its directories, little-endian, plain or big.

Input: the tags of a directory, by number. Output: bytes.

Based on: TIFF, Revision 6.0, Adobe, 1992; BigTIFF, 2007.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

Tags = dict[int, tuple[str, Any]]
"""By their number: the letter of `struct`, and the numbers."""

LIMIT_CLASSIC = 1 << 32
"""Bytes that offsets of a plain TIFF reach."""

TYPES = {"H": (3, 2), "I": (4, 4), "d": (12, 8), "s": (2, 1), "Q": (16, 8)}
"""The number and the size of a type, by the letter of `struct`."""

NUMPY = {"H": "u2", "I": "u4", "Q": "u8", "d": "f8"}


def header(is_big: bool) -> bytes:
    """The first bytes of a file, right before its first directory."""
    return struct.pack("<2sHHHQ", b"II", 43, 8, 0, 16) if is_big else struct.pack("<2sHI", b"II", 42, 8)


def directory_bytes(tags: Tags, is_big: bool) -> int:
    """How many bytes a directory takes, with the values that do not fit into it."""
    entry, inline, ends = (20, 8, 16) if is_big else (12, 4, 6)
    sizes = [TYPES[letter][1] * len(values) for letter, values in tags.values()]
    return ends + entry * len(tags) + sum(-(-size // 8) * 8 for size in sizes if size > inline)


def directory(tags: Tags, at: int, following: int, is_big: bool) -> bytes:
    """The bytes of a directory that lies at a place in the file; `following`: where the next one lies."""
    entry, inline = (20, 8) if is_big else (12, 4)
    head = struct.pack("<Q" if is_big else "<H", len(tags))
    tail = struct.pack("<Q" if is_big else "<I", following)
    entries, outside = [], []
    outside_at = at + len(head) + entry * len(tags) + len(tail)
    for number, (letter, values) in tags.items():
        content = bytes(values) if letter == "s" else np.asarray(values).astype(f"<{NUMPY[letter]}").tobytes()
        field = content.ljust(inline, b"\0")
        if len(content) > inline:
            field = struct.pack("<Q" if is_big else "<I", outside_at)
            padded = content.ljust(-(-len(content) // 8) * 8, b"\0")
            outside.append(padded)
            outside_at += len(padded)
        entries.append(struct.pack("<HHQ" if is_big else "<HHI", number, TYPES[letter][0], len(values)) + field)
    return b"".join([head, *entries, tail, *outside])
