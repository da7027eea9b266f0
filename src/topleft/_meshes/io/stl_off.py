"""Reads STL, binary and text, and OFF: triangles and polygons, and little else.

Normals of STL are not read: the corners of its triangles say the same. The first word of OFF names the values of
its vertices: colours, normals, texture coordinates.

Input: a file, unchecked. Output: a `Mesh`, or none where nothing has faces; no memory is taken for more than it holds.

Based on: 3D Systems, "StereoLithography Interface Specification", 1988; The Geometry Center, "OFF", Geomview manual,
1996; files of Princeton, libigl and MeshLab.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import I64, Array
from topleft._meshes.io.faces import mesh_of_faces
from topleft._meshes.io.references import Cloud, InputFile, numbers_of_text, whole_numbers
from topleft._meshes.model.mesh import Mesh
from topleft.errors import MeshError

N_HEADER_BYTES, N_TRIANGLE_BYTES = 84, 50
ROWS = np.dtype([("", "V12"), ("corners", "<f4", 9), ("color", "<u2")])
HEAD = re.compile(rb"\s*((?:ST)?C?N?(4?)(n?)OFF)?(?=[\s\d]|$)", re.IGNORECASE)


def read_stl(source: InputFile) -> list[Mesh]:
    """The triangles of an STL file, in one mesh; none if it has none."""
    content = source.content()
    n, colors = _n_triangles(content[:N_HEADER_BYTES], len(content)), None
    if n is None:
        corners = _corners_of_text(content)
    else:
        rows = np.frombuffer(content, ROWS, n, N_HEADER_BYTES)
        if len(content) > N_HEADER_BYTES + N_TRIANGLE_BYTES * n:
            source.notes.add("bytes after the last triangle that its header counts not read")
        corners, colors = rows["corners"].reshape(-1, 3), _stl_colors(rows["color"], content[:N_HEADER_BYTES])
    source.budget.spend("max_vertices", len(corners))
    source.budget.spend("max_triangles", len(corners) // 3)
    faces = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    return [Mesh(corners, faces, None, colors)] if len(corners) else []


def _stl_colors(values: Array, header: bytes) -> npt.NDArray[np.uint8] | None:
    """Colours (3 T, 4) of 15 bits: of Magics, whose header has the colour of the others, or of VisCAM: else white."""
    magics = re.search(rb"COLOR=(...)(.)", header, re.DOTALL)
    has_color = (values < 1 << 15) & values.any() if magics else values >= 1 << 15
    if magics is None and not has_color.any():
        return None
    rest = magics[1] + (magics[2].strip(b"\0") or b"\xff") if magics else b"\xff" * 4  # opacity of 0 says nothing
    colors = np.full((len(values), 4), np.frombuffer(rest, np.uint8))
    channels = values[has_color, None] >> np.array((0, 5, 10), np.uint16) & 31
    colors[has_color, :3] = np.rint((channels if magics else channels[:, ::-1]) * (255 / 31))
    return np.repeat(colors, 3, axis=0)


def mapped_corners(path: Path) -> np.ndarray[tuple[int, int], np.dtype[np.float32]] | None:
    """The nine numbers of each triangle (T, 9) of a binary file, mapped; None of a text."""
    with open(path, "rb") as file:
        n = _n_triangles(file.read(N_HEADER_BYTES), path.stat().st_size)
    if n == 0:
        raise MeshError("it has no triangles")
    return None if n is None else np.memmap(path, ROWS, "r", N_HEADER_BYTES, (n,))["corners"]


def _n_triangles(header: bytes, n_bytes: int) -> int | None:
    """How many triangles a binary file of so many bytes has; None of a text."""
    n = int.from_bytes(header[80:84], "little") if len(header) == N_HEADER_BYTES else 0
    n_wanted = N_HEADER_BYTES + N_TRIANGLE_BYTES * n
    if header.lstrip()[:5].lower() == b"solid" and n_bytes != n_wanted:  # binary files may begin so, too
        return None
    if n_wanted > n_bytes:
        raise MeshError(f"it has {max(0, n_bytes - N_HEADER_BYTES) // N_TRIANGLE_BYTES} of {n} triangles")
    return n


def _corners_of_text(content: bytes) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """The numbers after each "vertex"."""
    content = content.lower().replace(b"\r", b"\n")
    lines = re.sub(rb"(?m)^[ \t]*(?:outer|end|facet|solid)[^\n]*$", b"", content)
    numbers = numbers_of_text(lines.replace(b"vertex", b" "))
    if len(numbers) % 9:
        raise MeshError(f"it has {len(numbers)} numbers, which are not 9 a triangle")
    return numbers.reshape(-1, 3)


def read_off(source: InputFile) -> list[Mesh]:
    """The faces of an OFF file, in one mesh; none, and a cloud of its points, if it has none."""
    content = re.sub(rb"#[^\r\n]*", b"", source.content()).replace(b"\r", b"\n")
    head = HEAD.match(content)
    if head is None:
        raise MeshError("it does not begin with OFF")
    word = (head[1] or b"").upper()
    if head[2] or head[3]:
        raise MeshError("its points have more than three dimensions")
    rest = content[head.end() :]
    if word and rest.split(None, 1)[:1] == [b"BINARY"]:
        raise MeshError(f"cannot read {str(source.path)!r}: it is a binary OFF: save it as text")
    counts = re.match(rb"\s*(\d{1,15})\s+(\d{1,15})(?:[ \t]+\d{1,15})?", rest)
    if counts is None:
        raise MeshError("it does not say how many vertices and faces it has")
    n_vertices, n_faces = int(counts[1]), int(counts[2])
    source.budget.spend("max_vertices", n_vertices)
    source.budget.spend("max_lines", content.count(b"\n"))
    body = rest[counts.end() :].lstrip()
    try:
        values = numbers_of_text(body)
    except MeshError:
        raise MeshError("a number of it is none") from None
    lines: list[bytes] = []
    width = len(body.split(b"\n", 1)[0].split())
    faces = _faces_of_one_size(values[n_vertices * width :], n_faces)
    if faces is None or faces[2] is not None:
        lines = [line for line in body.split(b"\n") if line.strip()]
    if len(lines) > n_vertices + n_faces:  # numbers on a further line are no colours
        faces = None
    if faces is None and len(lines) == n_vertices + n_faces:
        faces = _faces_of_lines(lines[n_vertices:], source)
    if faces is None:  # rows that go over several lines, or some that are left over: corners, and no colours
        width = 3 + 3 * (b"N" in word) + 4 * (b"C" in word) + 2 * word.startswith(b"ST")
        if n_vertices * width > len(values):
            raise MeshError(f"it ends within its {n_vertices} vertices")
        faces = _faces_of_numbers(source, values[n_vertices * width :].tolist(), n_faces)
    numbers = values[: n_vertices * width]
    if len(numbers) != n_vertices * width or (n_vertices and width < 3):
        raise MeshError(f"it ends within its {n_vertices} vertices")
    return _meshes(source, word, numbers.reshape(n_vertices, max(width, 3)), *faces)


Faces = tuple[I64, I64, Array | None]
"""The corners of all faces, how many each has, and colours (F, 3 or 4) if some have one; NaN: none."""


def _faces_of_one_size(values: Array, n_faces: int) -> Faces | None:
    """Faces with as many corners each, and as many numbers of a colour; None if they have not."""
    if not n_faces or len(values) % n_faces or not len(values):
        return (np.zeros(0, np.int64), np.zeros(0, np.int64), None) if not n_faces and not len(values) else None
    rows = values.reshape(n_faces, -1)
    n_colors = rows.shape[1] - 1 - rows[0, 0]
    if n_colors not in (0, 3, 4) or not (rows[:, 0] == rows[0, 0]).all():
        return None
    k = int(rows[0, 0])
    return whole_numbers(rows[:, 1 : k + 1].ravel()), np.full(n_faces, k), rows[:, k + 1 :] if n_colors else None


def _faces_of_lines(lines: list[bytes], source: InputFile) -> Faces:
    """Faces with a line for each."""
    rows = [line.split() for line in lines]
    counts = whole_numbers(numbers_of_text(b" ".join(row[0] for row in rows)))
    if not all(0 <= n < len(row) for n, row in zip(counts.tolist(), rows, strict=True)):
        raise MeshError("a face has fewer corners than it says")
    corners = [word for n, row in zip(counts.tolist(), rows, strict=True) for word in row[1 : n + 1]]
    colors = [row[n + 1 :] for n, row in zip(counts.tolist(), rows, strict=True)]
    table = np.full((len(rows), 4), np.nan)
    for n in (3, 4):
        own = [i for i, color in enumerate(colors) if len(color) == n]
        table[own, :n] = numbers_of_text(b" ".join(word for i in own for word in colors[i])).reshape(-1, n)
    if any(len(color) not in (0, 3, 4) for color in colors):
        source.notes.add("colours of faces by a map of colours not read")
    return whole_numbers(numbers_of_text(b" ".join(corners))), counts, table


def _faces_of_numbers(source: InputFile, values: list[float], n_faces: int) -> Faces:
    """Faces one after the other."""
    if n_faces > len(values):
        raise MeshError(f"it ends within its {n_faces} faces")
    corners: list[float] = []
    counts: list[int] = []
    at = 0
    for _ in range(n_faces):
        if at >= len(values) or not 0 <= values[at] <= len(values) - at - 1:
            raise MeshError(f"it ends within its {n_faces} faces")
        counts.append(int(values[at]))
        corners += values[at + 1 : at + 1 + counts[-1]]
        at += counts[-1] + 1
    if at < len(values):
        source.notes.add("numbers after the last face that its header counts not read")
    return whole_numbers(np.array(corners, np.float64)), np.array(counts, np.int64), None


def _bytes(values: Array) -> npt.NDArray[np.uint8] | None:
    """SRGB bytes of colours of whole numbers of 0 to 255, or of 0 to 1; 255 for NaN, None if all are."""
    if np.isnan(values).all():
        return None
    scales = []
    for part in (np.nan_to_num(values[:, :3]), np.nan_to_num(values[:, 3:])):  # opacity may be 0 to 1 behind bytes
        scales.append(1 if (part == np.rint(part)).all() and part.max(initial=0) > 1 else 255)
    scaled = values * np.repeat(scales, (3, 1))[: values.shape[1]]
    return np.rint(np.nan_to_num(scaled, nan=255).clip(0, 255)).astype(np.uint8)


def _meshes(
    source: InputFile, word: bytes, rows: Array, corners: I64, n_corners: I64, of_faces: Array | None
) -> list[Mesh]:  # fmt: skip
    """The mesh of the rows of vertices and of the faces."""
    positions, at = rows[:, :3], 3
    normals = colors = uv = None
    if b"N" in word and rows.shape[1] >= at + 3:
        normals, at = rows[:, at : at + 3], at + 3
    n_uv = 2 if word.startswith(b"ST") and rows.shape[1] >= at + 2 else 0
    n_colors = min(rows.shape[1] - at - n_uv, 4)
    if n_colors >= 3:
        colors = _bytes(rows[:, at : at + n_colors])
    if n_uv:
        uv = rows[:, -2:]
    source.budget.spend("max_triangles", int(np.maximum(n_corners - 2, 0).sum()))
    table = None if of_faces is None else _bytes(of_faces)
    mesh = mesh_of_faces(
        source, positions, corners, n_corners, normals=normals, colors=colors, uv=uv, colors_of_faces=table
    )
    if mesh is None and not len(corners) and len(positions):
        source.clouds.append(Cloud(positions, _opaque(colors), normals))
    return [] if mesh is None else [mesh]


def _opaque(colors: Array | None) -> Array | None:
    if colors is None or colors.shape[1] == 4:
        return colors
    return np.column_stack([colors, np.full(len(colors), 255, np.uint8)])
