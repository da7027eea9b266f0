"""Reads STL, binary and text. Normals of its triangles are not read: their corners say the same.

Input: a file, unchecked. Output: a `Mesh` in which each triangle has vertices of its own.

Based on: 3D Systems, "StereoLithography Interface Specification", 1988.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from topleft._io.references import InputFile, numbers_of_text
from topleft._model.mesh import Mesh
from topleft.errors import MeshError

N_HEADER_BYTES, N_TRIANGLE_BYTES = 84, 50


def read_stl(source: InputFile) -> list[Mesh]:
    """The triangles of an STL file, in one mesh; none if it has none.

    Raises
    ------
    MeshError
        If the file is broken.
    """
    content = source.path.read_bytes()
    n = int.from_bytes(content[80:84], "little") if len(content) >= N_HEADER_BYTES else 0
    n_bytes = N_HEADER_BYTES + N_TRIANGLE_BYTES * n
    # Binary files may begin with "solid", too.
    if content.lstrip()[:5].lower() == b"solid" and len(content) != n_bytes:
        corners = _corners_of_text(content)
    elif len(content) < N_HEADER_BYTES or n_bytes > len(content):
        n_there = max(0, len(content) - N_HEADER_BYTES) // N_TRIANGLE_BYTES
        raise MeshError(f"it has {n_there} of {n} triangles")
    else:
        rows = np.frombuffer(content, np.dtype([("", "V12"), ("corners", "<f4", 9), ("", "V2")]), n, N_HEADER_BYTES)
        corners = rows["corners"].reshape(-1, 3)
    source.check_n_vertices(len(corners))
    return [Mesh(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))] if len(corners) else []


def mapped_corners(path: Path) -> np.ndarray[tuple[int, int], np.dtype[np.float32]] | None:
    """The nine numbers of each triangle (T, 9) of a binary file, mapped; None of a text.

    Raises
    ------
    MeshError
        If the file is broken.
    """
    n_file = path.stat().st_size
    with open(path, "rb") as file:
        header = file.read(N_HEADER_BYTES)
    n = int.from_bytes(header[80:84], "little") if len(header) == N_HEADER_BYTES else 0
    n_bytes = N_HEADER_BYTES + N_TRIANGLE_BYTES * n
    if header.lstrip()[:5].lower() == b"solid" and n_file != n_bytes:
        return None
    if len(header) < N_HEADER_BYTES or n_bytes > n_file:
        raise MeshError(f"it has {max(0, n_file - N_HEADER_BYTES) // N_TRIANGLE_BYTES} of {n} triangles")
    if not n:
        raise MeshError("it has no triangles")
    rows = np.memmap(path, np.dtype([("", "V12"), ("corners", "<f4", 9), ("", "V2")]), "r", N_HEADER_BYTES, (n,))
    return rows["corners"]


def _corners_of_text(content: bytes) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """The numbers after each "vertex"."""
    content = content.lower().replace(b"\r", b"\n")
    lines = re.sub(rb"(?m)^[ \t]*(?:outer|end|facet|solid)[^\n]*$", b"", content)
    numbers = numbers_of_text(lines.replace(b"vertex", b" "))
    if len(numbers) % 9:
        raise MeshError(f"it has {len(numbers)} numbers, which are not 9 a triangle")
    return numbers.reshape(-1, 3)
