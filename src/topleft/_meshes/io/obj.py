"""Reads OBJ: all of a file in a few passes over its bytes, whatever the number of groups and materials.

Input: a file, unchecked. Output: `Mesh` parts: one, or two where only some of the faces have normals.

Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1, 1995.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from topleft._core.base.array_types import F64, I64, U8
from topleft._meshes.io.faces import note_small_faces
from topleft._meshes.io.mtl import read_mtl
from topleft._meshes.io.references import Cloud, InputFile, numbers_of_text, utf8_of
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.polygons import triangulate
from topleft.errors import MeshError

BLANKS = bytes.maketrans(b"\t\v\f\r", b"   \n")
NEWLINE, BLANK, SLASH = 10, 32, 47
NONE = -1
"""The index of a corner that names no texture coordinates, or no normal."""

UNREAD = {
    b"l": "lines not drawn",
    b"p": "points not drawn",
    b"curv": "curves not drawn",
    b"surf": "free-form surfaces not drawn",
    b"call": "files that it calls not read",
}


def read_obj(source: InputFile) -> list[Mesh]:
    """The faces of an OBJ file, cut into triangles, in the order of the file; a `MeshError` if it is broken."""
    content = source.content()
    source.budget.spend("max_lines", content.count(b"\n") + content.count(b"\r"))
    text = _Text(content)
    source.budget.spend("max_vertices", len(text.lines_of(b"v")))
    positions, colors = _positions(*text.numbers(b"v"))
    uv, normals = (_columns(*text.numbers(key), n) for key, n in ((b"vt", 2), (b"vn", 3)))
    corners, n_corners = _faces(text, (len(positions), len(uv), len(normals)), source)
    for key, note in UNREAD.items():
        if text.lines_of(key).size:
            source.notes.add(note)
    if not len(n_corners):
        if len(positions) and not text.lines_of(b"l").size:
            source.clouds.append(Cloud(positions, colors))
        return []
    source.budget.spend("max_triangles", int(np.maximum(n_corners - 2, 0).sum()))
    materials, row_of_face = _materials(text, source)
    note_small_faces(source, n_corners)
    triangles, faces = triangulate(positions, corners[:, 0], n_corners)
    rows = None if row_of_face is None else row_of_face[faces]
    if rows is not None and len(uv):
        is_bare = (corners[:, 1] == NONE)[triangles].any(axis=1)
        if not is_bare.all() and any(materials[row].texture is not None for row in np.unique(rows[is_bare])):
            source.notes.add("textures not spread on faces without texture coordinates")
    has_normal = (corners[:, 2] != NONE)[triangles].all(axis=1)
    parts = []
    for with_normals in (True, False):
        chosen = has_normal if with_normals else ~has_normal
        if not chosen.any():
            continue
        own = triangles if chosen.all() else triangles[chosen]
        own_rows = rows if rows is None or chosen.all() else rows[chosen]
        parts.append(_mesh(own, corners, positions, colors, uv, normals if with_normals else None, materials, own_rows))
    return parts


def _mesh(
    triangles: I64, corners: I64, positions: F64, colors: U8 | None, uv: F64, normals: F64 | None,
    materials: tuple[Material, ...], rows: I64 | None,
) -> Mesh:  # fmt: skip
    """Triangles whose corners name positions, texture coordinates and normals, as vertices that have all of them."""
    used = corners[triangles.ravel()]
    names = [used[:, 0]]
    if len(uv) and (used[:, 1] != NONE).any():
        names.append(used[:, 1])
    else:
        uv = np.zeros((0, 2))
    if normals is not None:
        names.append(used[:, 2])
    if all(name is names[0] or np.array_equal(name, names[0]) for name in names):
        vertices = np.arange(len(positions))
        at, uv_at, normal_at = names[0], vertices, vertices
        if len(uv) and len(uv) != len(positions):
            uv = np.resize(uv, (len(positions), 2))
        if normals is not None and len(normals) != len(positions):
            normals = np.resize(normals, (len(positions), 3))
    else:
        first, at = distinct(names)
        vertices = used[first, 0]
        uv_at, normal_at = used[first, 1], used[first, 2]
    own_uv = own_normals = None
    if len(uv):
        own_uv = np.where((uv_at == NONE)[:, None], 0, uv[uv_at])
    if normals is not None:
        own_normals = normals[normal_at]
    return Mesh(
        positions[vertices], at.astype(np.int32).reshape(-1, 3), own_normals,
        None if colors is None else colors[vertices], own_uv, materials,
        None if rows is None else rows.astype(np.int32),
    )  # fmt: skip


def distinct(names: list[I64]) -> tuple[I64, I64]:
    """Rows of different names, in the order of their first use, and which of them each row has."""
    key = names[0].copy()
    for name in names[1:]:
        n_others = int(name.max()) + 2
        if int(key.max()) + 1 > (1 << 62) // n_others:
            key = np.unique(key, return_inverse=True)[1]
        key *= n_others
        key += name + 1
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return first[order], place[group]


class _Text:
    """The text of a file, in lines by their first word.

    Lines that go on after a backslash are joined, blanks at their beginnings are gone.
    """

    def __init__(self, content: bytes) -> None:
        content = utf8_of(content)
        if b"\0" in content:
            raise MeshError("it is not text")
        if b"\\" in content:
            content = re.sub(rb"\\\r?\n", b" ", content)
        content = content.translate(BLANKS) + b"\n\n"
        if content[:1] == b" " or b"\n " in content:
            content = re.sub(rb"(?m)^ +", b"", content)
        self._bytes = np.frombuffer(content, np.uint8).copy()
        self._content = content
        ends = np.flatnonzero(self._bytes == NEWLINE)
        self._starts = np.concatenate([[0], ends[:-1] + 1])
        self._ends = ends
        last = len(content) - 1
        first, second, third = (self._bytes[np.minimum(self._starts + i, last)] for i in range(3))
        is_short, is_long = second <= BLANK, third <= BLANK
        v = first == ord("v")
        self._rows = {
            b"v": np.flatnonzero(v & is_short),
            b"vt": np.flatnonzero(v & (second == ord("t")) & is_long),
            b"vn": np.flatnonzero(v & (second == ord("n")) & is_long),
            b"f": np.flatnonzero((first == ord("f")) & (is_short | ((second == ord("o")) & is_long))),
            b"l": np.flatnonzero((first == ord("l")) & is_short),
            b"p": np.flatnonzero((first == ord("p")) & is_short),
        }
        self._first = first

    def lines_of(self, key: bytes) -> I64:
        """Which lines begin with that word."""
        if key not in self._rows:
            candidates = np.flatnonzero(self._first == key[0])
            has_key = [self._words(row)[:1] == [key] for row in candidates.tolist()]
            self._rows[key] = candidates[np.array(has_key, np.bool_)]
        return self._rows[key]

    def rest_of(self, row: int) -> str:
        """The line without its first word."""
        words = self._content[self._starts[row] : self._ends[row]].split(None, 1)
        return words[1].strip().decode("utf-8", errors="replace") if len(words) > 1 else ""

    def _words(self, row: int) -> list[bytes]:
        return self._content[self._starts[row] : self._ends[row]].split(None, 1)

    def bodies(self, key: bytes) -> U8:
        """The bytes of the lines of that word, with blanks in place of it and of comments."""
        rows = self.lines_of(key)
        if not len(rows):
            return np.zeros(0, np.uint8)
        starts, ends = self._starts[rows], self._ends[rows] + 1
        if len(rows) == int(rows[-1] - rows[0]) + 1:  # they follow each other, as they mostly do
            body = self._bytes[starts[0] : ends[-1]].copy()
        else:
            steps = np.zeros(len(self._bytes) + 1, np.int8)
            steps[starts] = 1
            steps[ends] -= 1
            body = self._bytes[np.cumsum(steps[:-1], dtype=np.int8).view(np.bool_)]
        lengths = ends - starts
        at = np.cumsum(lengths) - lengths
        body[at] = BLANK
        if len(key) > 1 or key == b"f":  # "fo" is an old name of "f"
            body[at[: len(at)] + 1] = np.where(body[at + 1] == NEWLINE, NEWLINE, BLANK)
        if (body == ord("#")).any():
            body = np.frombuffer(re.sub(rb"#[^\n]*", b"", body.tobytes()), np.uint8).copy()
        return body

    def numbers(self, key: bytes) -> tuple[F64, I64]:
        """All numbers of the lines of that word, and how many each line has."""
        body = self.bodies(key)
        return numbers_of_text(body.tobytes()), words_of_lines(body)


def words_of_lines(body: U8) -> I64:
    """How many words each line has."""
    line_ends = np.flatnonzero(body == NEWLINE)
    return _counts(_starts_of_words(body), line_ends)


def _starts_of_words(body: U8) -> I64:
    is_word = body > BLANK
    is_word[1:] &= ~(is_word[:-1])
    return np.flatnonzero(is_word)


def _counts(places: I64, ends: I64) -> I64:
    """How many of the places, ascending, lie between each end and the end before it."""
    counts = np.searchsorted(places, ends)
    counts[1:] -= counts[:-1].copy()
    return counts


def _columns(numbers: F64, n_of_line: I64, n: int) -> F64:
    """The first n numbers of each line (L, n); 0 where it has fewer."""
    if not len(n_of_line):
        return np.zeros((0, n))
    k = int(n_of_line[0])
    if k >= n and (n_of_line == k).all():
        return numbers.reshape(-1, k)[:, :n]
    starts = np.cumsum(n_of_line) - n_of_line
    columns = np.zeros((len(n_of_line), n))
    for i in range(n):
        has = n_of_line > i
        columns[has, i] = numbers[starts[has] + i]
    return columns


def _positions(numbers: F64, n_of_line: I64) -> tuple[F64, U8 | None]:
    """Positions (V, 3), and the colours (V, 4) that follow them; white where others have a colour."""
    if len(n_of_line) and int(n_of_line.min()) < 3:
        row = int((n_of_line < 3).argmax())
        raise MeshError(f"its vertex {row + 1} has {n_of_line[row]} of 3 numbers")
    positions = np.ascontiguousarray(_columns(numbers, n_of_line, 3))
    if int(n_of_line.max(initial=0)) < 6:
        return positions, None
    values = _columns(numbers, n_of_line, 7)[:, 3:]
    values[n_of_line < 6] = 0
    with np.errstate(invalid="ignore"):
        bytes_ = np.nan_to_num(values * (255 if values.max() <= 1 else 1)).clip(0, 255)
    bytes_[n_of_line < 6], bytes_[n_of_line < 7, 3] = 255, 255
    return positions, np.rint(bytes_).astype(np.uint8)


def _faces(text: _Text, n_above_all: tuple[int, int, int], source: InputFile) -> tuple[I64, I64]:
    """The corners (C, 3) of all faces, as rows of positions, texture coordinates and normals, and how many each has."""
    body = text.bodies(b"f")
    n_corners = words_of_lines(body)
    corners = _indices(body)
    if int(n_corners.sum()) != len(corners):
        raise MeshError("a face of it is no list of indices")
    rows = text.lines_of(b"f")
    for column, key in enumerate((b"v", b"vt", b"vn")):
        own = corners[:, column]
        is_relative = own < 0
        if is_relative.any():  # they count back from the line that they stand in
            above = np.searchsorted(text.lines_of(key), rows)
            own[is_relative] += np.repeat(above, n_corners)[is_relative] + 1
            if (own[is_relative] <= 0).any():
                raise MeshError(f"a face names a {key.decode()} line before the first")
        n = n_above_all[column]
        if len(own) and int(own.max()) > n:
            if column:
                source.notes.add(
                    {b"vt": "texture coordinates", b"vn": "normals"}[key] + " that faces name and that are not there"
                )
                own[own > n] = 0
                continue
            raise MeshError(f"a face names {key.decode()} {int(own.max())} of {n}")
    if len(corners) and int(corners[:, 0].min()) < 1:
        raise MeshError("a face names v 0: they count from 1")
    return corners - 1, n_corners


def _indices(body: U8) -> I64:
    """Corners (C, 3) of the words v, v/vt, v//vn and v/vt/vn as they stand; 0 where there is none."""
    starts = _starts_of_words(body)
    corners = np.zeros((len(starts), 3), np.int64)
    if not len(starts):
        return corners
    slashes = np.flatnonzero(body == SLASH)
    if not len(slashes):
        values = numbers_of_text(body.tobytes(), np.int64)
        if len(values) != len(starts):
            raise MeshError("a face of it is no list of indices")
        corners[:, 0] = values
        return corners
    doubles = slashes[:-1][np.diff(slashes) == 1]
    next_starts = np.append(starts[1:], len(body))
    kinds = 3 * _counts(slashes, next_starts) + _counts(doubles, next_starts)
    numbers = body.copy()
    numbers[slashes] = BLANK
    is_one = bool((kinds == kinds[0]).all())
    for kind in kinds[:1].tolist() if is_one else np.unique(kinds).tolist():
        columns = COLUMNS_OF_KIND.get(kind)
        if columns is None:
            raise MeshError("a face of it is no list of indices")
        own = kinds == kind
        if is_one:
            values = numbers_of_text(numbers.tobytes(), np.int64)
        else:
            lengths = np.diff(np.append(starts, len(body)))
            # bytes before the first word are left out
            values = numbers_of_text(numbers[starts[0] :][np.repeat(own, lengths)].tobytes(), np.int64)
        if len(values) != len(columns) * int(own.sum()):
            corners[own] = [_corner(body, start) for start in starts[own].tolist()]
            continue
        for i, column in enumerate(columns):
            corners[own, column] = values[i :: len(columns)]
    return corners


COLUMNS_OF_KIND = {0: [0], 3: [0, 1], 7: [0, 2], 6: [0, 1, 2]}
"""Which of position, texture coordinates and normal a word has, by three times its slashes plus its double slashes."""


def _corner(body: U8, start: int) -> list[int]:
    """One word, which may end in a slash."""
    word = body[start : start + 80].tobytes().split()[0].decode("latin-1").split("/")
    return [int(part) if part else 0 for part in (*word, "", "")[:3]]


def _materials(text: _Text, source: InputFile) -> tuple[tuple[Material, ...], I64 | None]:
    """The materials that faces use, in the order of their first use, and the row of each face."""
    uses = text.lines_of(b"usemtl")
    if not len(uses):
        return (), None
    known = _library(text, source)
    faces = text.lines_of(b"f")
    at = np.searchsorted(uses, faces)  # 0: before the first
    rows_of_use: list[int] = [NONE]
    rows: dict[str, int] = {}
    for line in uses.tolist():
        rows_of_use.append(rows.setdefault(text.rest_of(line), len(rows)))
    names = list(rows)
    use_of_face = np.array(rows_of_use)[at]
    if not any(name in known for name in names):
        has_library = text.lines_of(b"mtllib").size > 0
        is_told = any("material libraries" in line for line in source.notes.lines)  # which are missing
        for name in () if is_told else names:
            source.notes.add("materials not in its libraries" if has_library else "materials without a library", name)
        return (), None
    materials: list[Material] = []
    place = np.zeros(len(names) + 1, np.int64)
    order = use_of_face[np.sort(np.unique(use_of_face, return_index=True)[1])].tolist()
    unknown = NONE  # the place of the one material for all names that no library has
    for row in order:
        if row != NONE and names[row] in known:
            source.budget.spend("max_nodes", 1)
            place[row] = len(materials)
            materials.append(known[names[row]]())
            continue
        if row != NONE:
            source.notes.add("materials not in its libraries", names[row])
        if unknown == NONE:
            unknown = len(materials)
            materials.append(Material())
        place[row] = unknown
    return tuple(materials), place[use_of_face]


def _library(text: _Text, source: InputFile) -> dict[str, Callable[[], Material]]:
    known: dict[str, Callable[[], Material]] = {}
    read: set[Path] = set()
    for rest in dict.fromkeys(text.rest_of(line) for line in text.lines_of(b"mtllib").tolist()):
        names = [rest] if rest.lower().endswith(".mtl") and rest.lower().count(".mtl") == 1 else rest.split() or [rest]
        for name in names:
            path = source.find(name, "material libraries")
            if path is None:
                continue
            if path.resolve() not in read:
                read.add(path.resolve())
                content = source.read_at(path, name, "material libraries") or b""
                known |= read_mtl(utf8_of(content).decode("utf-8", errors="replace"), path.parent, source)
    return known
