"""The arrays of a glTF file: accessors over views of buffers, dense or sparse, whole or normalized numbers.

Input: the JSON and the binary chunk, both unchecked. Output: arrays (N, K); nothing outside of a buffer is read, and
no memory is taken for more than the buffers hold.

Based on: Khronos Group, "glTF 2.0 Specification", 2021, 3.6.
"""

from __future__ import annotations

import base64
import binascii
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import Array
from topleft._meshes.io.references import InputFile
from topleft.errors import MeshError

Tree = dict[str, Any]

DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
N_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def entry(tree: Tree, kind: str, index: Any) -> Tree:
    """A row of a list of the file."""
    rows = tree.get(kind, [])
    if not isinstance(rows, list) or isinstance(index, bool) or not isinstance(index, int):
        raise MeshError(f"{kind}[{index!r}] is no entry of a list")
    if not 0 <= index < len(rows):
        raise MeshError(f"{kind}[{index}] is not one of {len(rows)}")
    if not isinstance(rows[index], dict):
        raise MeshError(f"{kind}[{index}] is no object")
    return rows[index]


def whole(row: Tree, name: str, default: int | None = None) -> int:
    """A whole number, not negative, of an object."""
    value = row.get(name, default)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << 53:
        raise MeshError(f"{name} must be a whole number, got {value!r}"[:120])
    return value


class Accessors:
    """The arrays of a file by their index, each decoded once; `blob` is the binary chunk of a GLB."""

    def __init__(self, tree: Tree, blob: bytes | None, source: InputFile) -> None:
        self._tree = tree
        self._blob = blob
        self._source = source
        self._buffers: dict[int, npt.NDArray[np.uint8]] = {}
        self._arrays: dict[int, Array] = {}

    def array(self, index: Any) -> Array:
        """The array (N, K) of an accessor: integers as they are, float32, and normalized integers as float32.

        A `MeshError` if it is no valid accessor, or lies beyond its buffer.
        """
        row = entry(self._tree, "accessors", index)
        if index not in self._arrays:
            self._arrays[index] = self._decoded(row, index, 0, self.shape(index)[0])
        return self._arrays[index]

    def rows(self, index: Any, first: int, end: int) -> Array:
        """Rows [first, end) of `array(index)`; no others are decoded, unless the accessor is sparse."""
        row = entry(self._tree, "accessors", index)
        if "sparse" in row or index in self._arrays:
            return self.array(index)[first:end]
        return self._decoded(row, index, first, end)

    def shape(self, index: Any) -> tuple[int, int]:
        """The shape (N, K) of `array(index)`, which is not decoded."""
        row = entry(self._tree, "accessors", index)
        kind = row.get("type")
        if kind not in N_COMPONENTS or row.get("componentType") not in DTYPES:
            raise MeshError(f"accessors[{index}] is of {kind!r} and {row.get('componentType')!r}, which is no type")
        return whole(row, "count"), N_COMPONENTS[kind]

    def view(self, index: Any) -> npt.NDArray[np.uint8]:
        """The bytes of a view of a buffer."""
        row = entry(self._tree, "bufferViews", index)
        buffer = self._buffer(row.get("buffer"))
        start, size = whole(row, "byteOffset", 0), whole(row, "byteLength")
        if start + size > len(buffer):
            raise MeshError(f"bufferViews[{index}] ends at byte {start + size} of a buffer of {len(buffer)}")
        return buffer[start : start + size]

    def _decoded(self, row: Tree, index: int, first: int, end: int) -> Array:
        """Rows [first, end) of an accessor, which are all of them if it is sparse."""
        (n_all, n_columns), dtype, n = self.shape(index), np.dtype(DTYPES[row["componentType"]]), end - first
        sparse = row.get("sparse")
        self._source.budget.check("max_vertices", n // (3 if n_columns == 1 else 1))
        if not 0 <= first <= end <= n_all:
            raise MeshError(f"accessors[{index}] has {n_all} rows, and its row {end - 1} is read")
        if "bufferView" in row:
            stride = whole(entry(self._tree, "bufferViews", row["bufferView"]), "byteStride", 0)
            start = whole(row, "byteOffset", 0) + first * (stride or n_columns * dtype.itemsize)
            values = self._rows(row["bufferView"], start, n, n_columns, dtype, stride)
        else:
            self._source.budget.spend("max_unpacked_bytes", n * n_columns * dtype.itemsize)
            values = np.zeros((n, n_columns), dtype)
        if sparse is not None:
            places = sparse["indices"]
            n_set = whole(sparse, "count")
            at_dtype = np.dtype(DTYPES[places["componentType"]])
            at = self._rows(places["bufferView"], whole(places, "byteOffset", 0), n_set, 1, at_dtype, 0)
            source = sparse["values"]
            new = self._rows(source["bufferView"], whole(source, "byteOffset", 0), n_set, n_columns, dtype, 0)
            self._source.budget.spend("max_nodes", 1)  # reading a sparse accessor takes as long as reading a primitive
            self._source.budget.spend("max_unpacked_bytes", values.nbytes + new.nbytes)  # several may share a view
            if n_set and int(at.max()) >= n:
                raise MeshError(f"accessors[{index}] sets row {int(at.max())} of {n}")
            values = values.copy()
            values[at[:, 0].astype(np.intp)] = new
        if not row.get("normalized"):
            return values
        self._source.budget.spend("max_unpacked_bytes", 4 * values.size)
        return normalized(values)

    def _rows(self, view: Any, offset: int, n: int, n_columns: int, dtype: np.dtype[Any], stride: int) -> Array:
        """Rows of numbers of a view, `stride` bytes from one to the next (0: without gaps)."""
        data = self.view(view)
        size = dtype.itemsize
        width = n_columns * size
        stride = stride or width
        if n and offset + stride * (n - 1) + width > len(data):
            raise MeshError(f"an accessor of {n} rows of {width} bytes ends beyond its {len(data)} bytes")
        if n == 0:
            return np.zeros((0, n_columns), dtype)
        return np.ndarray((n, n_columns), dtype, data.data, offset, (stride, size))

    def _buffer(self, index: Any) -> npt.NDArray[np.uint8]:
        row = entry(self._tree, "buffers", index)
        if index not in self._buffers:
            if "uri" in row:
                content = uri_content(row["uri"], self._source, "buffers")
            else:
                content = self._blob if index == 0 else None  # the binary chunk is the first buffer
            if content is None:
                name = str(row.get("uri", f"buffers[{index}]"))[:80]
                but = "".join(f", but by {str(each)[:80]}, which is not read" for each in row.get("extensions", {}))
                raise MeshError(f"cannot read {str(self._source.path)!r}: its buffer {name!r} is not there{but}")
            if len(content) < whole(row, "byteLength"):
                raise MeshError(f"buffers[{index}] has {len(content)} of its {row['byteLength']} bytes")
            self._buffers[index] = np.frombuffer(content, np.uint8)
        return self._buffers[index]


def normalized(values: Array) -> Array:
    """Whole numbers as float32 of -1 or 0 to 1; others as they are."""
    if values.dtype.kind == "f":
        return values
    steps = np.float32(np.iinfo(values.dtype).max)
    return np.maximum(values / steps, np.float32(-1)).astype(np.float32, copy=False)


def uri_content(uri: Any, source: InputFile, what: str) -> bytes | None:
    """The bytes of a URI: of a file beside the mesh, or the bytes in it."""
    if not isinstance(uri, str):
        raise MeshError(f"a uri of {what} must be text, got {uri!r}"[:120])
    if not uri.startswith("data:"):
        return source.read(unquote(uri), what)
    head, comma, body = uri.partition(",")
    if not comma:
        raise MeshError(f"a data: URI of {what} has no data")
    if not head.endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return base64.b64decode(body if "%" not in body else unquote(body))
    except binascii.Error as error:
        raise MeshError(f"a data: URI of {what} is broken ({error})") from error
