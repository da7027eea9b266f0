"""Reads the sizes that a mesh compressed by Draco declares, before it is unpacked.

Input: its bytes. Output: numbers of triangles and vertices, and the bytes of each vertex. A mesh of 180,000 triangles
may have 450 bytes, and attributes of 480 MB may have 58 kB. They follow the connectivity, which is skipped.

Based on: F. Galligan and others, "Draco Bitstream Specification", version 2.2, 2019: header, metadata, connectivity,
attributes, symbols; J. Duda, "Asymmetric Numeral Systems", 2014.
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np

from topleft.errors import MeshError

HAS_METADATA = 0x8000
MOST_DEEP = 32
SEQUENTIAL, STANDARD, VALENCE, COMPRESSED, TAGGED = 0, 0, 2, 0, 0
N_VALENCES = 6
MOST_TAGS = 1 << 20
"""Tags are read one by one, in Python; symbols have tags where there are few of them."""
TAG_BITS, TAG_BASE = 12, 1 << 14
BYTES_OF_TYPE = (0, 4, 4, 4, 4, 4, 4, 8, 8, 4, 8, 4)
"""Bytes of int8, uint8, int16, ... uint64, float32, float64, bool while unpacked; no type has number 0."""


class DracoSize(NamedTuple):
    """The sizes that a mesh declares."""

    n_triangles: int
    n_vertices: int
    n_rows: int
    """The most vertices that there may be after all: three for each triangle, where attributes have seams."""
    row_bytes: int
    """Of all attributes of a vertex, while they are unpacked."""


class DracoBytes:
    """Bytes that are read one after the other; reading beyond the end is an IndexError."""

    def __init__(self, content: bytes, at: int) -> None:
        self._content = content
        self._at = at

    def skip(self, n: int) -> None:
        self._at += n

    def byte(self) -> int:
        self._at += 1
        return self._content[self._at - 1]

    def number(self) -> int:
        """A number of 7 bits a byte, the lowest first."""
        value, shift = 0, 0
        while (byte := self.byte()) & 0x80:
            value |= (byte & 0x7F) << shift
            shift += 7
            if shift > 63:
                raise MeshError("a number in Draco's data has no end")
        return value | byte << shift

    def skip_metadata(self, deep: int = 0) -> None:
        """Skip entries, and the metadata below."""
        for _ in range(self.number()):
            self.skip(self.byte())
            self.skip(self.number())
        for _ in range(self.number()):
            self.skip(self.byte())
            if deep == MOST_DEEP:
                raise MeshError("its Draco metadata is nested too deep")
            self.skip_metadata(deep + 1)

    def skip_numbers(self, n: int) -> None:
        """Skip n numbers of 7 bits a byte."""
        ends = np.flatnonzero(np.frombuffer(self._content, np.uint8)[self._at :] < 0x80)
        if n > len(ends):
            raise IndexError
        self.skip(int(ends[n - 1]) + 1 if n else 0)

    def skip_bits(self) -> None:
        """Skip bits of equal probability."""
        self.byte()
        self.skip(self.number())

    def skip_symbols(self, n: int) -> None:
        """Skip n symbols. If they are tagged, their bits follow the tags, which have to be read to be counted."""
        if n == 0:
            return
        is_tagged = self.byte() == TAGGED
        if is_tagged and n > MOST_TAGS:
            raise MeshError(f"Draco's data has {n} symbols with tags, more than {MOST_TAGS}")
        if not is_tagged:
            self.byte()  # the bits of the largest
        chances = self._chances()
        n_bytes = self.number()
        first = self._at
        self.skip(n_bytes)
        if is_tagged:
            self.skip((sum(_tags(self._content[first : self._at], chances, n)) + 7) // 8)

    def _chances(self) -> list[int]:
        """How often each symbol comes."""
        n, chances = self.number(), list[int]()
        while len(chances) < n:
            head = self.byte()
            if head & 3 == 3:
                chances += [0] * ((head >> 2) + 1)
            else:
                chances.append(head >> 2 | sum(self.byte() << 8 * k + 6 for k in range(head & 3)))
        return chances


def _tags(packed: bytes, chances: list[int], n: int) -> list[int]:
    """Unpack n tags, from the end of their bytes on."""
    if sum(chances) != 1 << TAG_BITS:
        raise MeshError("tags in Draco's data have no probabilities")
    before = [0, *accumulate(chances)]
    tag_of = [tag for tag, chance in enumerate(chances) for _ in range(chance)]
    at = len(packed) - 1 - (packed[-1] >> 6)
    state = (int.from_bytes(packed[at:], "little") & (1 << 8 * (len(packed) - at) - 2) - 1) + TAG_BASE
    tags = []
    for _ in range(n):
        while state < TAG_BASE and at > 0:
            at -= 1
            state = state << 8 | packed[at]
        high, low = divmod(state, 1 << TAG_BITS)
        tag = tag_of[low]
        state = high * chances[tag] + low - before[tag]
        tags.append(tag)
    return tags


def _skip_indices(rest: DracoBytes, n_triangles: int, n_vertices: int) -> None:
    """Skip the corners of triangles that follow each other as they are."""
    if rest.byte() == COMPRESSED:
        rest.skip_symbols(3 * n_triangles)
    elif 1 << 16 <= n_vertices < 1 << 21:
        rest.skip_numbers(3 * n_triangles)
    else:
        rest.skip(3 * n_triangles * (1 if n_vertices < 1 << 8 else 2 if n_vertices < 1 << 16 else 4))


def _skip_walk(rest: DracoBytes, traversal: int) -> bool:
    """Skip the walk from triangle to triangle (Edgebreaker); returns whether there may be seams."""
    if traversal not in (STANDARD, VALENCE):
        raise MeshError(f"the data is no mesh of Draco 2.2 (traversal {traversal})")
    n_with_seams = rest.byte()
    for _ in range(2):  # symbols, and symbols where the walk splits
        rest.number()
    n_splits = rest.number()
    if n_splits:
        rest.skip_numbers(2 * n_splits)
        rest.skip((n_splits + 7) // 8)
    if traversal == STANDARD:
        rest.skip(rest.number())
    for _ in range(1 + n_with_seams):
        rest.skip_bits()
    for _ in range(N_VALENCES if traversal == VALENCE else 0):
        rest.skip_symbols(rest.number())
    return n_with_seams > 0


def _row_bytes(rest: DracoBytes, bytes_of_decoder: int) -> int:
    """The bytes that all attributes have for a vertex, while they are unpacked."""
    n_decoders, total = rest.byte(), 0
    rest.skip(bytes_of_decoder * n_decoders)
    for _ in range(n_decoders):
        n = rest.number()
        for _ in range(n):
            rest.byte()  # its attribute
            total += BYTES_OF_TYPE[rest.byte()] * rest.byte()
            rest.byte()  # whether it is normalized
            rest.number()
        rest.skip(n)  # how each is coded
    return total


def declared_by_draco(content: bytes) -> DracoSize:
    """The sizes that a mesh declares, which it need not hold."""
    head = content[:11]
    if head[:5] != b"DRACO" or head[5:7] != b"\2\2" or len(head) < 11 or head[7] != 1:
        raise MeshError("the data is no mesh of Draco 2.2")
    rest = DracoBytes(content, 11)
    try:
        if int.from_bytes(head[9:11], "little") & HAS_METADATA:
            for _ in range(rest.number()):  # of attributes, by their number, then of the mesh
                rest.number()
                rest.skip_metadata()
            rest.skip_metadata()
        if head[8] == SEQUENTIAL:
            n_triangles, n_vertices = rest.number(), rest.number()
            _skip_indices(rest, n_triangles, n_vertices)
            return DracoSize(n_triangles, n_vertices, n_vertices, _row_bytes(rest, bytes_of_decoder=0))
        traversal = rest.byte()
        n_vertices, n_triangles = rest.number(), rest.number()
        has_seams = _skip_walk(rest, traversal)
        n_rows = max(n_vertices, 3 * n_triangles) if has_seams else n_vertices
        return DracoSize(n_triangles, n_vertices, n_rows, _row_bytes(rest, bytes_of_decoder=3))
    except IndexError:
        raise MeshError("Draco's data is cut off") from None
