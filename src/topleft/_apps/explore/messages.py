"""Packs requests and replies: a JSON header, then the bytes of arrays.

A frame, for either direction: the length of the header (4 bytes, little-endian), the header as UTF-8, padded with
spaces to a multiple of 8 bytes, then each part, padded with zeros to a multiple of 8, so that a page can view them as
typed arrays without a copy. The header holds `parts`, the lengths of the parts; the header of a reply `arrays`, too:
dtype, shape and part of each array by its name.
"""

from __future__ import annotations

import json
import math
import struct
from typing import Any, NoReturn

import numpy as np

from topleft._apps.explore.session import Reply, Request

MAX_HEADER_BYTES = 4 << 20
"""Of a request: a thousand triangles and their vertices need a tenth of it."""


MAX_DIGITS = 18
"""Of integers, so that int64 holds them."""


def split(reply: Reply) -> tuple[dict[str, Any], list[memoryview]]:
    """Return the header of a reply and its parts, as a notebook sends them."""
    parts: list[memoryview] = []
    arrays: dict[str, dict[str, Any]] = {}
    for name, value in reply.arrays.items():
        array = np.frombuffer(value, np.uint8) if isinstance(value, bytes) else np.ascontiguousarray(value)
        if array.dtype == np.bool_:
            array = array.view(np.uint8)
        arrays[name] = {"dtype": array.dtype.name, "shape": array.shape, "part": len(parts)}
        parts.append(array.reshape(-1).view(np.uint8).data)
    return {**reply.header, "arrays": arrays}, parts


def pack(header: dict[str, Any], parts: list[memoryview]) -> bytes:
    """Return a frame."""
    text = json.dumps({**header, "parts": [len(part) for part in parts]}, separators=(",", ":")).encode()
    text += b" " * (-(4 + len(text)) % 8)
    pieces: list[bytes | memoryview] = [struct.pack("<I", len(text)), text]
    for part in parts:
        pieces += [part, bytes(-len(part) % 8)]
    return b"".join(pieces)


def unpack(frame: bytes) -> Request:
    """Return the request in a frame."""
    if len(frame) < 4:
        raise ValueError(f"a message must begin with the length of its header, got {len(frame)} bytes")
    (length,) = struct.unpack_from("<I", frame)
    if length > min(len(frame) - 4, MAX_HEADER_BYTES):
        raise ValueError(f"a message must hold its header of at most {MAX_HEADER_BYTES} bytes, got {length}")
    header = read_header(frame[4 : 4 + length])
    lengths = header.pop("parts", [])
    if not isinstance(lengths, list) or not all(type(n) is int and n >= 0 for n in lengths):
        raise ValueError("parts must be a list of lengths")
    view, start, parts = memoryview(frame), 4 + length, []
    for n in lengths:
        if start + n > len(frame):
            raise ValueError(f"a message must hold its parts, got {len(frame)} bytes for parts of {lengths[:9]}")
        parts.append(view[start : start + n])
        start += n + -n % 8
    return {**header, "parts": parts}


def read_header(text: bytes | str) -> dict[str, Any]:
    """Return the JSON object of a header."""

    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"numbers must be finite, got {constant}")

    def finite(digits: str) -> float:
        if math.isinf(number := float(digits)):
            refuse(digits)
        return number

    def countable(digits: str) -> int:
        if len(digits) > MAX_DIGITS:
            refuse(f"one of {len(digits)} digits")
        return int(digits)

    try:
        header = json.loads(text, parse_constant=refuse, parse_float=finite, parse_int=countable)
    except RecursionError:
        raise ValueError("a message must not be nested so deeply") from None
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ValueError(f"a message must begin with JSON: {error}") from None
    if not isinstance(header, dict):
        raise ValueError(f"a message must begin with a JSON object, got {type(header).__name__}")
    return header
