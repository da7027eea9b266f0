"""Reads PLY: polygons and strips of triangles, text and binary, with normals, colours and texture coordinates.

Input: a file, unchecked. Output: a `Mesh`, or none where nothing has faces; no memory is taken for more than it holds.

Based on: Turk, G., "The PLY Polygon File Format", 1994; names of properties as MeshLab, Blender and Stanford's scans
have them.
"""

from __future__ import annotations

import io
import struct
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

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
STRUCT_CODES = {
    "i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f4": "f", "f8": "d",
}  # fmt: skip
UV_NAMES = (
    ("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t"), ("texcoord_u", "texcoord_v"),
    ("tex_u", "tex_v"), ("texcoord_x", "texcoord_y"), ("u0", "v0"), ("s0", "t0"),
)  # fmt: skip
NORMAL_NAMES = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"), ("normalx", "normaly", "normalz"))
COLOR_NAMES = (
    ("red", "green", "blue", "alpha"), ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("r", "g", "b", "a"), ("color_red", "color_green", "color_blue", "color_alpha"),
)  # fmt: skip
LEFT_OVER = "content after the last row that its header counts not read"

COLUMNS = {
    "vertex": (("x", "y", "z"), UV_NAMES, NORMAL_NAMES, COLOR_NAMES),
    "face": (("vertex_indices", "vertex_index", "texcoord"), (), (), COLOR_NAMES),
}
"""Properties that are read, and choices of such, of which the first that is whole is read."""


@dataclass
class _Property:
    """One number of each row of an element, or a list of them."""

    name: str
    dtype: np.dtype[Any]
    count_dtype: np.dtype[Any] | None = None

    def none(self) -> Array | _List:
        """The values of no rows."""
        return np.zeros(0, self.dtype) if self.count_dtype is None else _List(np.zeros(0), np.zeros(0, np.int64))

    def stored(self, order: str) -> _Property:
        """The property with the dtypes of the body, which are float64 in a text."""

        def of(dtype: np.dtype[Any]) -> np.dtype[Any]:
            return dtype.newbyteorder("<" if order == "<" else ">") if order else np.dtype(np.float64)

        return _Property(self.name, of(self.dtype), None if self.count_dtype is None else of(self.count_dtype))


@dataclass
class _Element:
    name: str
    n: int
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(prop.count_dtype is not None for prop in self.properties)

    def stored(self, order: str) -> _Element:
        """The element with the dtypes of the body."""
        return _Element(self.name, self.n, [prop.stored(order) for prop in self.properties])

    def layout(self, lengths: list[int]) -> np.dtype[Any]:
        """A row whose lists have these lengths: property i is the field "i", the length of its list the field "ni"."""
        fields: list[Any] = []
        for i, (prop, k) in enumerate(zip(self.properties, lengths, strict=True)):
            if prop.count_dtype is None:
                fields.append((f"{i}", prop.dtype))
            else:
                fields += [(f"n{i}", prop.count_dtype), (f"{i}", prop.dtype, (k,))]
        return np.dtype(fields)


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
        elif element.n and element.name not in ("face", "tristrips", "camera", "obj_info"):
            source.notes.add(*("lines not drawn",) if element.name == "edge" else ("elements not read", element.name))
        for name in _unread(element) if element.n and element.name in COLUMNS else ():
            source.notes.add(f"properties of {element.name} not read", name)
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
            source.clouds.append(Cloud(positions, _colors(vertex), _together(vertex, NORMAL_NAMES)))
        return []
    mesh = _mesh(vertex, corners, n_corners, faces, source)
    del content, found, vertex, corners, n_corners, faces  # before a texture needs memory, too
    return [] if mesh is None else [_textured(mesh, textures, source)]


def _unread(element: _Element) -> list[str]:
    """The names of the properties of vertices or faces that are not read."""
    names = [prop.name for prop in element.properties]
    plain, uv, normals, colors = COLUMNS[element.name]
    read = set(plain)
    for choices in (uv, normals):
        read.update(next((choice for choice in choices if set(choice) <= set(names)), ()))
    color = next((choice for choice in colors if set(choice[:3]) <= set(names)), ())
    read.update((*color, "alpha") if color else ())
    return [name for name in names if name not in read]


def _found(content: bytes, order: str, elements: list[_Element], start: int, source: InputFile) -> dict[str, Rows]:
    """The elements by name."""
    if order:
        body = _Body(np.frombuffer(content, np.uint8), start)
        stored = {element.name: body.rows(element.stored(order)) for element in elements}
        if body.n_left:
            source.notes.add(LEFT_OVER)
        return stored
    body = _Body(numbers_of_text(content[start:]))
    error: MeshError | None = None
    found: dict[str, Rows] = {}
    try:
        found = {element.name: _rows_of_text(body, element) for element in elements}
    except MeshError as raised:
        error = raised
    if error is None and not body.n_left:
        return found
    lines = [line for line in content[start:].splitlines() if line.strip()]
    if len(lines) == sum(element.n for element in elements):  # each row has its line: longer than the header says
        ends = np.cumsum([element.n for element in elements]).tolist()
        for element, end in zip(elements, ends, strict=True):
            rows = [_row(line, element) for line in lines[end - element.n : end]]
            found[element.name] = _rows_of_text(_Body(numbers_of_text(b" ".join(rows))), element)
        source.notes.add("rows with more numbers than the header says, which are not read")
    elif error is not None:
        raise error
    else:
        source.notes.add(LEFT_OVER)
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
    for element in elements if order else []:
        if element.has_lists and element.name != "face":
            return None
        dtype = element.stored(order).layout([3] * len(element.properties))
        if at + dtype.itemsize * element.n > n_bytes:
            if element.has_lists:
                return None
            raise MeshError(f"it ends within its {element.n} rows of {element.name}")
        rows = np.memmap(path, dtype, "r", at, (element.n,)) if element.n and dtype.names else np.empty(0, dtype)
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
            case _:  # comments, also such as continue in a second line
                pass
    raise MeshError("its header does not end")


def _rows_of_text(body: _Body, element: _Element) -> Rows:
    """The next element of a text, with the dtypes that the header declares."""
    rows = body.rows(element.stored(""))
    for prop in element.properties:
        values = rows[prop.name]
        if isinstance(values, _List):
            rows[prop.name] = replace(values, values=_listed(values.values, prop.dtype))
        else:
            rows[prop.name] = _cast(values, prop.dtype)
    return rows


def _cast(values: Array, dtype: np.dtype[Any]) -> Array:
    """The numbers of a text as the kind that the header says."""
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        values = np.nan_to_num(values).clip(limits.min, limits.max)
    return values.astype(dtype)


def _listed(values: Array, dtype: np.dtype[Any]) -> Array:
    """The entries of lists of a text; corners of faces, which the header calls integers, stay float64."""
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


class _Body:
    """What follows a header: bytes, or the numbers of a text, which are read as float64 whatever they stand for."""

    def __init__(self, items: Array, at: int = 0) -> None:
        self._items, self._at = items, at
        self._bytes = items.view(np.uint8).data

    @property
    def n_left(self) -> int:
        """How many items nobody has read."""
        return len(self._items) - self._at

    def rows(self, element: _Element) -> Rows:
        """The next element, with the dtypes of the body."""
        if not element.n:
            return {prop.name: prop.none() for prop in element.properties}
        least = sum((prop.count_dtype or prop.dtype).itemsize for prop in element.properties)
        if element.n * least > self._n_bytes_left:
            raise _short(element)
        found = self._of_one_length(element)
        return self._of_any_length(element) if found is None else found

    def _of_one_length(self, element: _Element) -> Rows | None:
        """The rows if all lists of a property are as long as in the first row."""
        _, lengths, _ = self._walked(element, 1)
        n, layout = element.n, element.layout([k for (k,) in lengths])
        if n * layout.itemsize > self._n_bytes_left:
            return None
        block = np.ndarray((n,), layout, self._bytes, self._at * self._items.itemsize)
        made: Rows = {}
        for i, (prop, (k,)) in enumerate(zip(element.properties, lengths, strict=True)):
            made[prop.name] = block[f"{i}"]
            if prop.count_dtype is not None:
                if not (block[f"n{i}"] == k).all():
                    return None
                made[prop.name] = _List(made[prop.name].ravel(), np.full(n, k))
        self._at += n * layout.itemsize // self._items.itemsize
        return made

    def _of_any_length(self, element: _Element) -> Rows:
        starts, lengths, self._at = self._walked(element, element.n)
        made: Rows = {}
        for prop, first, many in zip(element.properties, starts, lengths, strict=True):
            k, size = np.array(many, np.int64), prop.dtype.itemsize // self._items.itemsize
            values = self._items[_ranges(np.array(first, np.int64), k * size)].view(prop.dtype)
            made[prop.name] = values if prop.count_dtype is None else _List(values, k)
        return made

    def _walked(self, element: _Element, n: int) -> tuple[list[list[int]], list[list[int]], int]:
        """Where the values of each property begin in the next n rows, how many each has, and where the rows end.

        Row by row: where a list begins is known from the lengths of those before.
        """
        starts: list[list[int]] = [[] for _ in element.properties]
        lengths: list[list[int]] = [[] for _ in element.properties]
        item, content, at, end = self._items.itemsize, self._bytes, self._at, len(self._items)
        shapes = []
        for prop, first, many in zip(element.properties, starts, lengths, strict=True):
            count = None if prop.count_dtype is None else _reader(prop.count_dtype)
            shapes.append((prop.dtype.itemsize // item, count, first, many))
        for _ in range(n):
            for size, count, first, many in shapes:
                k = 1
                if count is not None:
                    after = at + count.size // item
                    if after > end:
                        raise _short(element)
                    k = _length(count.unpack_from(content, at * item)[0])
                    at = after
                first.append(at)
                many.append(k)
                at += k * size
            if at > end:
                raise _short(element)
        return starts, lengths, at

    @property
    def _n_bytes_left(self) -> int:
        return self.n_left * self._items.itemsize


def _reader(dtype: np.dtype[Any]) -> struct.Struct:
    """What reads a number of a dtype from bytes."""
    return struct.Struct(("<" if dtype.str[0] == "|" else dtype.str[0]) + STRUCT_CODES[dtype.str[1:]])


def _short(element: _Element) -> MeshError:
    return MeshError(f"it ends within its {element.n} rows of {element.name}")


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
    """The triangles (T, 3) of strips, which also end at -1; triangles of a strip turn all one way."""
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
        source, positions, corners, n_corners, normals=_together(vertex, NORMAL_NAMES), colors=_colors(vertex),
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
    for *names, opacity in COLOR_NAMES:
        if not all(isinstance(rows.get(name), np.ndarray) for name in names):
            continue
        columns = [rows[name] for name in names]
        alpha = rows.get(opacity, rows.get("alpha"))
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
