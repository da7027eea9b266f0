"""Reads PLY: polygons and strips of triangles, text and binary, with normals, colours and texture coordinates.

Input: a file, unchecked. Output: a `Mesh`, or none where nothing has faces; no memory is taken for more than it holds.

Based on: Turk, G., "The PLY Polygon File Format", 1994; names of properties as MeshLab, Blender and Stanford's scans
have them.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import I64, Array
from topleft._meshes.io.faces import mesh_of_faces
from topleft._meshes.io.references import Cloud, InputFile, numbers_of_text, whole_numbers
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.texture import Texture
from topleft.errors import MeshError

DTYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8", "long": "i4", "ulong": "u4", "int64": "i8", "uint64": "u8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
MAX_HEADER_BYTES = 1 << 20


@dataclass
class _Property:
    """One number of each row of an element, or a list of them."""

    name: str
    dtype: np.dtype[Any]
    count_dtype: np.dtype[Any] | None = None


@dataclass
class _Element:
    name: str
    n: int
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(own.count_dtype is not None for own in self.properties)


@dataclass(frozen=True)
class _List:
    """Lists of numbers, one a row, one after the other."""

    values: Array
    lengths: I64


Rows = dict[str, Any]
"""An element: arrays (N,) by the name of the property, and lists."""


def read_ply(source: InputFile) -> list[Mesh]:
    """The faces of a PLY file, in one mesh; none, and a cloud of its points, if it has none."""
    content = source.content()
    order, elements, textures, start = _header(content)
    for element in elements:
        if element.name == "vertex":
            source.budget.spend("max_vertices", element.n)
        elif element.n and element.name not in ("face", "tristrips", "edge", "camera", "obj_info"):
            source.notes.add("elements not read", element.name)
        source.budget.spend("max_lines", min(element.n, len(content)))
    found = _found(content, order, elements, start, source)
    vertex = found.get("vertex")
    if vertex is None:
        raise MeshError("it has no vertices")
    corners, n_corners, faces = _corners(found, source)
    source.budget.spend("max_triangles", int(np.maximum(n_corners - 2, 0).sum()))
    if not len(n_corners):
        positions = _together(vertex, (("x", "y", "z"),))
        if positions is not None and len(positions):
            source.clouds.append(Cloud(positions, _colors(vertex), _together(vertex, (("nx", "ny", "nz"),))))
        return []
    mesh = _mesh(vertex, corners, n_corners, faces, source)
    del content, found, vertex, corners, n_corners, faces  # before a texture needs memory, too
    return [] if mesh is None else [_textured(mesh, textures, source)]


def _found(content: bytes, order: str, elements: list[_Element], start: int, source: InputFile) -> dict[str, Rows]:
    """The elements by name."""
    if order:
        body = _Bytes(content, start, "<" if order == "<" else ">")
        return {element.name: body.rows(element) for element in elements}
    numbers = _Numbers(content[start:])
    error: MeshError | None = None
    found: dict[str, Rows] = {}
    try:
        found = {element.name: numbers.rows(element) for element in elements}
    except MeshError as raised:
        error = raised
    if error is None and not numbers.n_left:
        return found
    lines = [line for line in content[start:].splitlines() if line.strip()]
    if len(lines) == sum(element.n for element in elements):  # each row has its line: longer than the header says
        ends = np.cumsum([element.n for element in elements]).tolist()
        for element, end in zip(elements, ends, strict=True):
            rows = [_row(line, element) for line in lines[end - element.n : end]]
            found[element.name] = _Numbers(b" ".join(rows)).rows(element)
        source.notes.add("rows with more numbers than the header says, which are not read")
    elif error is not None:
        raise error
    return found


def _row(line: bytes, element: _Element) -> bytes:
    """The numbers of a line that the header declares."""
    words, n = line.split(), 0
    for own in element.properties:
        if own.count_dtype is not None and n < len(words):
            n += _length(float(words[n]))
        n += 1
    if n > len(words):
        raise MeshError(f"a row of {element.name} has {len(words)} of {n} numbers")
    return b" ".join(words[:n])


def mapped_elements(path: Path) -> tuple[dict[str, Array], Array, dict[str, Array]] | None:
    """Numbers of the vertices by name (V,), the triangles (T, 3) and numbers of these (T,) of a binary file, mapped.

    None where faces are no triangles, or something else stands before them.
    """
    with open(path, "rb") as file:
        order, elements, _, at = _header(file.read(MAX_HEADER_BYTES))
    n_bytes, found = path.stat().st_size, {}
    byte_order: Literal["<", ">"] = "<" if order == "<" else ">"
    for element in elements if order else []:
        fields: list[Any] = []
        for i, own in enumerate(element.properties):
            if own.count_dtype is not None:
                fields.append((f"n{i}", own.count_dtype.newbyteorder(byte_order)))
            k = 1 if own.count_dtype is None else 3
            fields.append((f"{i}", own.dtype.newbyteorder(byte_order), *((k,) if k > 1 else ())))
        if element.has_lists and element.name != "face":
            return None
        dtype = np.dtype(fields)
        if at + dtype.itemsize * element.n > n_bytes:
            if element.has_lists:
                return None
            raise MeshError(f"it ends within its {element.n} rows of {element.name}")
        rows = np.memmap(path, dtype, "r", at, (element.n,)) if element.n and fields else np.empty(0, dtype)
        at += dtype.itemsize * element.n
        found[element.name] = {own.name: (rows, i) for i, own in enumerate(element.properties)}
        if element.name == "face":
            break
    names = [name for name in ("vertex_indices", "vertex_index") if name in found.get("face", {})]
    vertex = found.get("vertex", {})
    if not names or not {"x", "y", "z"} <= vertex.keys():
        return None
    rows, i = found["face"][names[0]]
    if rows.dtype.names is None or any(
        (rows[first : first + (1 << 20)][name] != 3).any()
        for name in rows.dtype.names
        if name.startswith("n")
        for first in range(0, len(rows), 1 << 20)
    ):
        return None
    if not len(rows):
        return None
    of_vertices = {name: block[f"{k}"] for name, (block, k) in vertex.items()}
    return of_vertices, rows[f"{i}"], {name: rows[f"{k}"] for name, (_, k) in found["face"].items() if k != i}


def _header(content: bytes) -> tuple[str, list[_Element], list[str], int]:
    """The order of bytes ("": text), the elements, the names of textures, and where the header ends."""
    if content[:3] != b"ply":
        raise MeshError("it does not begin with ply")
    stream = io.BytesIO(content[:MAX_HEADER_BYTES])
    order: str | None = None
    elements: list[_Element] = []
    textures: list[str] = []
    for line in stream:
        words = line.decode("latin-1").split()
        match words:
            case ["end_header"]:
                if order is None:
                    raise MeshError("its header names no format")
                return order, elements, textures, stream.tell()
            case ["format", kind, _] if kind in ORDERS:
                order = ORDERS[kind]
            case ["comment" | "obj_info", "TextureFile", *name]:
                textures.append(" ".join(name))
            case ["element", name, n] if n.isdecimal() and len(n) < 16:
                elements.append(_Element(name, int(n)))
            case ["property", "list", count, kind, name] if elements and {count, kind} <= DTYPES.keys():
                elements[-1].properties.append(_Property(name, np.dtype(DTYPES[kind]), np.dtype(DTYPES[count])))
            case ["property", kind, name] if elements and kind in DTYPES:
                elements[-1].properties.append(_Property(name, np.dtype(DTYPES[kind])))
            case ["element" | "property" | "format", *_]:
                raise MeshError(f"its header says {' '.join(words)[:60]!r}")
            case _:  # comments, also those that go on in a second line
                pass
    raise MeshError("its header does not end")


class _Numbers:
    """A body of text."""

    def __init__(self, content: bytes) -> None:
        self._values = numbers_of_text(content)
        self._at = 0

    @property
    def n_left(self) -> int:
        """How many numbers nobody has read."""
        return len(self._values) - self._at

    def rows(self, element: _Element) -> Rows:
        """The next element."""
        n, width = element.n, len(element.properties)
        left = len(self._values) - self._at
        if n * width > left:
            raise MeshError(f"it ends within its {n} rows of {element.name}")
        if not element.has_lists:
            block = self._values[self._at : self._at + n * width].reshape(n, width)
            self._at += n * width
            return {own.name: _cast(block[:, i], own.dtype) for i, own in enumerate(element.properties)}
        starts: list[list[int]] = [[] for _ in element.properties]
        lengths: list[list[int]] = [[] for _ in element.properties]
        values, end = self._values, len(self._values)
        if width == 1 and n:  # every list is as long as the first?
            k = _length(values[self._at])
            block = values[self._at : self._at + n * (k + 1)]
            if len(block) == n * (k + 1) and (block[:: k + 1] == k).all():
                self._at += n * (k + 1)
                lists = _listed(block.reshape(n, k + 1)[:, 1:].ravel(), element.properties[0].dtype)
                return {element.properties[0].name: _List(lists, np.full(n, k))}
        at = self._at
        for _ in range(n):
            for i, own in enumerate(element.properties):
                k = 1
                if own.count_dtype is not None:
                    if at >= end:
                        raise MeshError(f"it ends within its {n} rows of {element.name}")
                    k = _length(values[at])
                    at += 1
                starts[i].append(at)
                lengths[i].append(k)
                at += k
        if at > end:
            raise MeshError(f"it ends within its {n} rows of {element.name}")
        self._at = at
        made: Rows = {}
        for i, own in enumerate(element.properties):
            first, many = np.array(starts[i], np.int64), np.array(lengths[i], np.int64)
            picked = values[_ranges(first, many)]
            is_list = own.count_dtype is not None
            made[own.name] = _List(_listed(picked, own.dtype), many) if is_list else _cast(picked, own.dtype)
        return made


def _cast(values: Array, dtype: np.dtype[Any]) -> Array:
    """The numbers of a text as the kind that the header says."""
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        values = np.nan_to_num(values).clip(limits.min, limits.max)
    return values.astype(dtype)


def _listed(values: Array, dtype: np.dtype[Any]) -> Array:
    """The entries of lists of a text; those that shall be integers, which are corners of faces, as they stand."""
    return values if dtype.kind in "iu" else values.astype(dtype)


def _length(value: float) -> int:
    if not 0 <= value < 1 << 40 or value != int(value):
        raise MeshError(f"a list of it has {value:g} entries")
    return int(value)


def _ranges(starts: I64, lengths: I64) -> I64:
    """start, start + 1, ... of each, `lengths` of them, one after the other."""
    ends = np.cumsum(lengths)
    return (
        np.arange(int(ends[-1]) if len(ends) else 0) - np.repeat(ends - lengths, lengths) + np.repeat(starts, lengths)
    )


class _Bytes:
    """A body of binary numbers."""

    def __init__(self, content: bytes, start: int, order: Literal["<", ">"]) -> None:
        self._bytes = np.frombuffer(content, np.uint8)
        self._at = start
        self._order: Literal["<", ">"] = order

    def rows(self, element: _Element) -> Rows:
        """The next element."""
        if not element.has_lists:
            return self._plain(element)
        if element.n == 0:
            return {own.name: _List(np.zeros(0), np.zeros(0, np.int64)) for own in element.properties}
        made = self._of_one_length(element)
        return self._walked(element) if made is None else made

    def _plain(self, element: _Element) -> Rows:
        dtype = np.dtype([(f"{i}", own.dtype.newbyteorder(self._order)) for i, own in enumerate(element.properties)])
        block = self._block(dtype, element)
        self._at += dtype.itemsize * element.n
        return {own.name: block[f"{i}"] for i, own in enumerate(element.properties)}

    def _block(self, dtype: np.dtype[Any], element: _Element) -> Array:
        if dtype.itemsize * element.n > len(self._bytes) - self._at:
            raise MeshError(f"it ends within its {element.n} rows of {element.name}")
        return np.frombuffer(self._bytes.data, dtype, element.n, self._at)

    def _of_one_length(self, element: _Element) -> Rows | None:
        """The rows if all lists of a property are as long as in the first row."""
        fields: list[Any] = []
        at = self._at
        for i, own in enumerate(element.properties):
            dtype, k = own.dtype.newbyteorder(self._order), 1
            if own.count_dtype is not None:
                count = own.count_dtype.newbyteorder(self._order)
                k = self._count(at, count, element)
                fields.append((f"n{i}", count))
                at += count.itemsize
            if k * dtype.itemsize > len(self._bytes) - at:
                raise MeshError(f"it ends within its {element.n} rows of {element.name}")
            fields.append((f"{i}", dtype, (k,)))
            at += k * dtype.itemsize
        dtype = np.dtype(fields)
        if dtype.itemsize * element.n > len(self._bytes) - self._at:
            return None
        block = self._block(dtype, element)
        made: Rows = {}
        for i, own in enumerate(element.properties):
            values = block[f"{i}"]
            if own.count_dtype is None:
                made[own.name] = values[:, 0]
                continue
            if not (block[f"n{i}"] == values.shape[1]).all():
                return None
            made[own.name] = _List(values.ravel(), np.full(element.n, values.shape[1]))
        self._at += dtype.itemsize * element.n
        return made

    def _count(self, at: int, dtype: np.dtype[Any], element: _Element) -> int:
        if at + dtype.itemsize > len(self._bytes):
            raise MeshError(f"it ends within its {element.n} rows of {element.name}")
        return _length(float(np.frombuffer(self._bytes.data, dtype, 1, at)[0]))

    def _walked(self, element: _Element) -> Rows:
        """The rows one by one: where a list begins is known from the lengths of those before."""
        n, content, order = element.n, self._bytes.tobytes(), "big" if self._order == ">" else "little"
        least = sum((own.count_dtype or own.dtype).itemsize for own in element.properties)
        if n * least > len(content) - self._at:
            raise MeshError(f"it ends within its {n} rows of {element.name}")
        starts: list[list[int]] = [[] for _ in element.properties]
        lengths: list[list[int]] = [[] for _ in element.properties]
        shapes = [(i, own.dtype.itemsize, own.count_dtype) for i, own in enumerate(element.properties)]
        at, end = self._at, len(content)
        for _ in range(n):
            for i, size, count in shapes:
                k = 1
                if count is not None:
                    if count.kind == "f":
                        k = self._count(at, count.newbyteorder(self._order), element)
                    else:
                        k = int.from_bytes(content[at : at + count.itemsize], order, signed=count.kind == "i")  # type: ignore[arg-type]
                    at += count.itemsize
                starts[i].append(at)
                lengths[i].append(k)
                at += k * size
                if k < 0 or at > end:
                    raise MeshError(f"it ends within its {n} rows of {element.name}")
        self._at = at
        made: Rows = {}
        for i, own in enumerate(element.properties):
            first, many = np.array(starts[i], np.int64), np.array(lengths[i], np.int64)
            dtype = own.dtype.newbyteorder(self._order)
            at_bytes = _ranges(first, many * dtype.itemsize)
            values = self._bytes[at_bytes].view(dtype)
            made[own.name] = values if own.count_dtype is None else _List(values, many)
        return made


def _corners(found: dict[str, Rows], source: InputFile) -> tuple[I64, I64, Rows]:
    """The corners of all faces, how many each has, and the element that may give them colours."""
    faces = found.get("face", {})
    for name in ("vertex_indices", "vertex_index"):
        if isinstance(faces.get(name), _List):
            rows = faces[name]
            return whole_numbers(rows.values), rows.lengths, faces
    strips = found.get("tristrips", {})
    for name in ("vertex_indices", "vertex_index"):
        if isinstance(strips.get(name), _List):
            source.budget.check("max_triangles", len(strips[name].values))
            triangles = triangles_of_strips(whole_numbers(strips[name].values), strips[name].lengths)
            return triangles.ravel(), np.full(len(triangles), 3), {}
    return np.zeros(0, np.int64), np.zeros(0, np.int64), {}


def triangles_of_strips(values: I64, lengths: I64) -> I64:
    """The triangles (T, 3) of strips, which also end at -1; those of a strip turn all one way."""
    ends = np.zeros(len(values) + 1, np.bool_)
    ends[np.cumsum(lengths)] = True
    is_break = values < 0
    starts_strip = ends[:-1].copy()
    starts_strip[:1] = True
    starts_strip[1:] |= is_break[:-1]
    place = np.arange(len(values))
    first = np.maximum.accumulate(np.where(starts_strip, place, 0))
    if len(values) < 3:
        return np.zeros((0, 3), np.int64)
    at = np.arange(len(values) - 2)
    is_whole = (first[2:] == first[:-2]) & ~is_break[2:] & ~is_break[1:-1] & ~is_break[:-2]
    at = at[is_whole]
    triangles = np.stack([values[at], values[at + 1], values[at + 2]], axis=1)
    is_odd = (at - first[at]) % 2 == 1
    triangles[is_odd] = triangles[is_odd][:, [1, 0, 2]]
    a, b, c = triangles.T
    return triangles[(a != b) & (b != c) & (a != c)]


def _mesh(vertex: Rows, corners: I64, n_corners: I64, face: Rows, source: InputFile) -> Mesh | None:
    positions = _together(vertex, (("x", "y", "z"),))
    if positions is None:
        raise MeshError("its vertices have no x, y and z")
    on_corners, uv_of_corners = face.get("texcoord"), None
    if isinstance(on_corners, _List) and (on_corners.lengths == 2 * n_corners).all():
        uv_of_corners = on_corners.values.reshape(-1, 2)
    return mesh_of_faces(
        source, positions, corners, n_corners, normals=_together(vertex, (("nx", "ny", "nz"),)), colors=_colors(vertex),
        uv=_together(vertex, UV_NAMES), uv_of_corners=uv_of_corners, colors_of_faces=_colors(face),
    )  # fmt: skip


def _textured(mesh: Mesh, textures: list[str], source: InputFile) -> Mesh:
    """The mesh with the texture that a comment names."""
    if not textures or mesh.uv is None:
        return mesh
    if len(textures) > 1:
        source.notes.add("textures but the first not read", textures[1])
    picture = source.picture(textures[0])
    if picture is None:
        return mesh
    return replace(mesh, materials=(Material(texture=Texture(picture[..., :3])),))


UV_NAMES = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))


def _together(rows: Rows, choices: tuple[tuple[str, ...], ...]) -> Array | None:
    """The columns of the first choice that is there, (N, K) float."""
    for names in choices:
        if all(isinstance(rows.get(name), np.ndarray) for name in names):
            dtype = np.result_type(*(rows[name].dtype for name in names))
            kept = np.float32 if dtype.kind == "f" and dtype.itemsize == 4 else np.float64
            return np.stack([rows[name].astype(kept, copy=False) for name in names], axis=1)
    return None


def _colors(rows: Rows) -> npt.NDArray[np.uint8] | None:
    """SRGB and opacity (N, 4), of bytes, of 16 bits, or of 0 to 1."""
    for prefix in ("", "diffuse_"):
        names = [prefix + name for name in ("red", "green", "blue")]
        if not all(isinstance(rows.get(name), np.ndarray) for name in names):
            continue
        columns = [rows[name] for name in names]
        alpha = rows.get(prefix + "alpha", rows.get("alpha"))
        if isinstance(alpha, np.ndarray):
            columns.append(alpha)
        bytes_ = np.full((len(columns[0]), 4), 255, np.uint8)
        dtype = columns[0].dtype
        scale = 1.0
        if dtype == np.uint16 or dtype.newbyteorder("=") == np.uint16:
            scale = 1 / 257
        elif dtype.kind == "f":
            most = max((float(np.nanmax(column, initial=0)) for column in columns), default=0.0)
            scale = 255.0 if most <= 1 else 1.0
        for i, column in enumerate(columns):
            if column.dtype == np.uint8:
                bytes_[:, i] = column
            else:
                with np.errstate(all="ignore"):
                    bytes_[:, i] = np.rint(np.nan_to_num(column.astype(np.float64) * scale).clip(0, 255))
        return bytes_
    return None
