"""Tells how much a mesh that Draco has compressed declares, before it is unpacked.

Input: its bytes. Output: numbers of triangles and vertices. A mesh of 180,000 triangles may have 450 bytes.

Based on: F. Galligan and others, "Draco Bitstream Specification", version 2.2, 2019: header, metadata, connectivity.
"""

from __future__ import annotations

from topleft.errors import MeshError

HAS_METADATA = 0x8000
MOST_DEEP = 32
SEQUENTIAL = 0


class _DracoBytes:
    """Bytes that are read one after the other; those beyond the end are an IndexError."""

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
                raise MeshError("a number of what Draco has compressed has no end")
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


def declared_by_draco(content: bytes) -> tuple[int, int]:
    """Triangles and vertices of a mesh; there may be more vertices after all, three for each triangle.

    Raises
    ------
    MeshError
        If it is no mesh of the version that glTF takes.
    """
    head = content[:11]
    if head[:5] != b"DRACO" or head[5:7] != b"\2\2" or len(head) < 11 or head[7] != 1:
        raise MeshError("what is compressed is no mesh of Draco 2.2")
    rest = _DracoBytes(content, 11)
    try:
        if int.from_bytes(head[9:11], "little") & HAS_METADATA:
            for _ in range(rest.number()):  # of attributes, by their number, then of the mesh
                rest.number()
                rest.skip_metadata()
            rest.skip_metadata()
        if head[8] == SEQUENTIAL:
            n_triangles, n_vertices = rest.number(), rest.number()
        else:
            rest.byte()  # the way of the traversal
            n_vertices, n_triangles = rest.number(), rest.number()
    except IndexError:
        raise MeshError("what Draco has compressed is cut off") from None
    return n_triangles, n_vertices
