"""Meshes of any size, read in blocks: arrays, arrays in files, binary PLY and STL, blocks of triangles.

Input: arrays or `numpy.memmap`, the name of a file, or an iterator of blocks. Output: a `Triangles`, which gives the
corners of any triangles without holding all of them. A file is mapped, not read; blocks of an iterator are first
written to two files.

Based on: 3D Systems, "StereoLithography Interface Specification", 1988; Turk, G., "The PLY Polygon File Format", 1994.
"""

from __future__ import annotations

import hashlib
import mmap
import os
import tempfile
import weakref
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import I32, Array
from topleft._core.base.arrays import INT32_MAX, as_aligned, as_array, as_path, as_plane_points, shown
from topleft._core.base.memory import FRESH, Memory
from topleft._meshes.io.limits.npy import check_header
from topleft._meshes.io.load import MESHIO_READERS, load, load_cells
from topleft._meshes.io.ply import mapped_elements
from topleft._meshes.io.stl_off import mapped_corners
from topleft._meshes.model.cells import data_of
from topleft._meshes.scene.adapt import as_polygons
from topleft.errors import MeshError
from topleft.typing import PerOption

BLOCK = 1 << 17
"""Triangles that are read at a time: 3 MB of corners."""

HASH_ROWS = 1 << 20

INDICES = (np.int32, np.int64)
"""Dtypes of indices that the engine reads."""


class Triangles(Protocol):
    """Triangles that are read by their indices."""

    n: int
    n_components: int
    faces: Array | None
    n_faces: int
    n_vertices: int

    def corners(self, which: slice | I32, memory: Memory = FRESH) -> Array:
        """The corners (N, 3, C) of triangles, in memory of the caller or in a fresh array."""

    def indices(self, which: slice | I32) -> Array:
        """The vertices (N, 3) of triangles."""

    def parts(self) -> Iterator[Array]:
        """All that the mesh consists of, in pieces, to be hashed."""


DataByName = Callable[[str], tuple[Array, PerOption]]
"""The values of a name, and which parts of the mesh they are of; a `ValueError` lists the names that there are."""


@dataclass
class IndexedTriangles:
    """Triangles of shared vertices, in memory or in mapped files."""

    columns: tuple[Array, ...]  # one array (V, C), or a column (V,) for each component
    triangles: Array
    faces: Array | None = None
    n_faces: int = 0
    owner: object = None  # removes temporary files
    data: DataByName | None = None  # of vertices or faces, in the file

    def __post_init__(self) -> None:
        first = self.columns[0]
        self.n, self.n_vertices = len(self.triangles), len(first)
        self.n_components = first.shape[1] if len(self.columns) == 1 else len(self.columns)
        self.n_faces = self.n_faces or self.n

    def indices(self, which: slice | I32) -> Array:
        """The vertices (N, 3) of triangles."""
        return np.asarray(self.triangles[which])

    def corners(self, which: slice | I32, memory: Memory = FRESH) -> Array:
        """The corners (N, 3, C) of triangles, in memory of the caller or in a fresh array."""
        points, triangles = self.columns[0], self.triangles
        if len(self.columns) == 1 and is_copied(points) and is_copied(triangles) and triangles.dtype in INDICES:
            first, end, _ = which.indices(self.n) if isinstance(which, slice) else (0, len(which), 1)
            corners: Array = memory.empty("corners", (end - first, 3, self.n_components), points.dtype)
            mesh = engine.StridedMesh(points, triangles)
            bad = mesh.take(None if isinstance(which, slice) else which, first, corners.reshape(-1).view(np.uint8))
            if bad >= 0:
                raise self._bad_index(which, bad)
            return corners
        rows = self.indices(which)
        if rows.size and not (rows.min() >= 0 and rows.max() < self.n_vertices):
            raise self._bad_index(which, int(np.argmax(((rows < 0) | (rows >= self.n_vertices)).any(axis=1))))
        flat = rows.ravel()
        if len(self.columns) == 1:
            return points[flat].reshape(len(rows), 3, self.n_components)
        return np.stack([column[flat] for column in self.columns], axis=-1).reshape(len(rows), 3, self.n_components)

    def _bad_index(self, which: slice | I32, bad: int) -> IndexError:
        number = (which.start or 0) + bad if isinstance(which, slice) else int(which[bad])
        return IndexError(
            f"triangles must hold indices in [0, {self.n_vertices}), the number of vertices; "
            f"row {number} is {self.triangles[number].tolist()}"
        )

    def parts(self) -> Iterator[Array]:
        """All that the mesh consists of, in pieces."""
        for array in (*self.columns, self.triangles):
            for first in range(0, len(array), HASH_ROWS):
                yield array[first : first + HASH_ROWS]

    def __getstate__(self) -> dict[str, Any]:
        state = {**vars(self), "columns": tuple(map(sent, self.columns)), "triangles": sent(self.triangles)}
        return {**state, "owner": None, "data": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        columns = tuple(map(received, state["columns"]))
        vars(self).update({**state, "columns": columns, "triangles": received(state["triangles"])})


def is_copied(array: Array) -> bool:
    """Whether the engine can copy rows of an array: native numbers that lie side by side, at any distance of rows."""
    return array.dtype.isnative and array.ndim == 2 and array.strides[1] == array.itemsize


class SeparateTriangles:
    """Triangles that share no vertices, in a mapped file: three corners after each other."""

    def __init__(self, rows: Array) -> None:
        self._rows = rows  # (T, 9)
        self.n = self.n_faces = len(rows)
        self.n_vertices, self.n_components = 3 * self.n, 3
        self.faces: Array | None = None

    def indices(self, which: slice | I32) -> Array:
        """The vertices (N, 3) of triangles, which share none."""
        numbers = np.arange(*which.indices(self.n)) if isinstance(which, slice) else which.astype(np.int64)
        return 3 * numbers[:, None] + np.arange(3)

    def corners(self, which: slice | I32, memory: Memory = FRESH) -> Array:  # noqa: ARG002
        """The corners (N, 3, 3) of triangles."""
        return np.array(self._rows[which], np.float32).reshape(-1, 3, 3)

    def parts(self) -> Iterator[Array]:
        """All that the mesh consists of, in pieces."""
        for first in range(0, self.n, HASH_ROWS):
            yield self._rows[first : first + HASH_ROWS]

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_rows": sent(self._rows)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update({**state, "_rows": received(state["_rows"])})


@dataclass(frozen=True)
class MappedArray:
    """The place of an array in a file, for other processes."""

    path: str
    offset: int
    dtype: Any
    shape: tuple[int, ...]
    strides: tuple[int, ...]


def sent(array: Array) -> Array | MappedArray:
    """Return where a mapped array lies in its file, for other processes to map; other arrays as they are."""
    base: Any = array
    while isinstance(base, np.ndarray) and base.base is not None and not isinstance(base.base, mmap.mmap):
        base = base.base
    if not (isinstance(base, np.memmap) and base.filename is not None and isinstance(base.base, mmap.mmap)):
        return np.asarray(array)
    offset = base.offset + array.ctypes.data - base.ctypes.data
    return MappedArray(os.fspath(base.filename), offset, array.dtype, array.shape, array.strides)


def received(array: Array | MappedArray) -> Array:
    """Return the array that `sent` described."""
    if not isinstance(array, MappedArray):
        return as_aligned(array)
    n_bytes = sum((n - 1) * step for n, step in zip(array.shape, array.strides, strict=True)) + array.dtype.itemsize
    if 0 in array.shape:
        return np.empty(array.shape, array.dtype)
    memory = np.memmap(array.path, np.uint8, "r", array.offset, (n_bytes,))
    return np.ndarray(array.shape, array.dtype, memory, 0, array.strides)


def open_triangles(mesh: Any, folder: str | os.PathLike[str] | None) -> Triangles:
    """Return the triangles of whatever `tiles` takes; anything else is a `TypeError`.

    A `MeshError` if a file is broken or has no triangles, a `ValueError` if arrays have the wrong shape.
    """
    if isinstance(mesh, IndexedTriangles | SeparateTriangles):
        return mesh
    if isinstance(mesh, str | os.PathLike):
        return triangles_of_file(as_path("mesh", mesh))
    if isinstance(mesh, tuple | list) and len(mesh) == 2 and all(isinstance(part, str | os.PathLike) for part in mesh):
        return of_arrays(mapped_npy(Path(mesh[0])), mapped_npy(Path(mesh[1])))
    if isinstance(mesh, Iterator):
        return triangles_of_blocks(mesh, folder)
    polygons = as_polygons(mesh)
    return of_arrays(polygons.points, polygons.triangles, polygons.faces, polygons.n_faces)


def of_arrays(points: Any, triangles: Any, faces: Array | None = None, n_faces: int = 0) -> IndexedTriangles:
    """Return triangles of arrays, with checked shapes and dtypes; mapped ones stay where they are."""
    points, triangles = as_plane_points("vertices", points), as_array("triangles", triangles)
    if triangles.size == 0 and triangles.ndim == 1:
        triangles = np.empty((0, 3), np.int32)
    if triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(f"triangles must have shape (T, 3), got {triangles.shape}")
    if triangles.dtype.kind not in "iu":
        raise TypeError(f"triangles must be integers, got dtype {triangles.dtype}")
    if len(triangles) > INT32_MAX:
        raise ValueError(f"triangles must have at most {INT32_MAX} rows, got {len(triangles)}")
    return IndexedTriangles((points,), triangles, faces, n_faces)


def mapped_npy(path: Path) -> Array:
    """Return the array of a .npy file, mapped."""
    try:
        with path.open("rb") as file:
            check_header(file, path.stat().st_size)
        return np.load(path, mmap_mode="r")
    except ValueError as error:
        raise MeshError(f"cannot read {path}: {error}") from None


def triangles_of_file(path: Path) -> Triangles:
    """Return the triangles of a file: binary STL and PLY are mapped, others are loaded."""
    suffix = path.suffix.lower()
    try:
        if suffix == ".stl" and (rows := mapped_corners(path)) is not None:
            return SeparateTriangles(rows)
        if suffix == ".ply" and (found := mapped_elements(path)) is not None:
            of_vertices, triangles, of_faces = found
            columns = of_vertices["x"], of_vertices["y"], of_vertices["z"]
            return IndexedTriangles(side_by_side(columns), triangles, data=partial(property_of, of_vertices, of_faces))
    except MeshError as error:
        raise MeshError(f"cannot read {path}: {error}") from None
    if suffix in MESHIO_READERS:
        theirs, polygons = load_cells(path)
        cells = of_arrays(polygons.points_in_space, polygons.triangles, polygons.faces, polygons.n_faces)
        return replace(cells, data=partial(data_of, theirs))
    mesh: Any = load(path)
    return open_triangles(mesh, None)


def property_of(of_vertices: Mapping[str, Array], of_faces: Mapping[str, Array], name: str) -> tuple[Array, PerOption]:
    """The values of a property of a PLY file, and which of both they are of."""
    if name in of_vertices:
        return of_vertices[name], "vertex"
    if name in of_faces:
        return of_faces[name], "triangle"
    there = [other for other, array in {**of_faces, **of_vertices}.items() if np.ndim(array) == 1]
    known = ", ".join(there) or "none"
    raise ValueError(f"values must be a .npy file or a property of the mesh's file ({known}), got {name!r}")


def side_by_side(columns: tuple[Array, ...]) -> tuple[Array, ...]:
    """Return one array (V, 3) of three columns that lie side by side in a file; others as they are."""
    x, dtype = columns[0], columns[0].dtype
    places = [column.__array_interface__["data"][0] - x.__array_interface__["data"][0] for column in columns]
    if any(column.dtype != dtype for column in columns) or places != [0, dtype.itemsize, 2 * dtype.itemsize]:
        return columns
    base: Any = x.base
    offset = x.__array_interface__["data"][0] - base.__array_interface__["data"][0]
    return (np.ndarray((len(x), 3), dtype, base, offset, (x.strides[0], dtype.itemsize)),)


def triangles_of_blocks(blocks: Iterator[Any], folder: str | os.PathLike[str] | None) -> IndexedTriangles:
    """Write blocks of (vertices, triangles) to two files, which are removed with the mesh, and map them.

    Triangles of a block name vertices of that block.
    """
    directory = tempfile.mkdtemp(prefix="topleft-", dir=folder)
    owner = _Temporary(directory)
    paths = [Path(directory, name) for name in ("vertices", "triangles")]
    shapes: list[Any] = []
    n_vertices = n_triangles = 0
    with open(paths[0], "xb") as vertex_file, open(paths[1], "xb") as triangle_file:
        for i, block in enumerate(blocks):
            if not (isinstance(block, tuple | list) and len(block) == 2):
                raise TypeError(f"blocks must be pairs (vertices, triangles), got {shown(block)} as block {i}")
            try:
                part = of_arrays(*block)
                rows = part.indices(slice(None))
                part.corners(slice(None))
            except (ValueError, TypeError, IndexError) as error:
                raise type(error)(f"block {i}: {error}") from None
            points = np.ascontiguousarray(part.columns[0])
            shapes = shapes or [points.dtype, points.shape[1]]
            if shapes != [points.dtype, points.shape[1]]:
                raise ValueError(f"block {i}: vertices must be {shapes[0]} (V, {shapes[1]}) as before")
            np.ascontiguousarray(rows.astype(np.int64) + n_vertices).tofile(triangle_file)
            points.tofile(vertex_file)
            n_vertices, n_triangles = n_vertices + len(points), n_triangles + len(rows)
    if n_triangles > INT32_MAX:
        raise ValueError(f"blocks must have at most {INT32_MAX} triangles together, got {n_triangles}")
    dtype, n_components = shapes or (np.dtype(np.float64), 2)
    mapped = [
        np.memmap(path, kind, "r", 0, shape) if shape[0] else np.empty(shape, kind)
        for path, kind, shape in zip(
            paths, (dtype, np.int64), ((n_vertices, n_components), (n_triangles, 3)), strict=True
        )
    ]
    return IndexedTriangles((mapped[0],), mapped[1], owner=owner)


class _Temporary:
    """A folder that is removed with this object."""

    def __init__(self, path: str) -> None:
        import shutil

        weakref.finalize(self, shutil.rmtree, path, ignore_errors=True)


def fingerprint_of(triangles: Triangles, arrays: dict[str, Array | None], words: object) -> str:
    """Return a hash of a mesh, the arrays that go with it, and options."""
    digest = hashlib.blake2b(repr(words).encode(), digest_size=16)
    for part in triangles.parts():
        digest.update(f"{part.dtype.str}{part.shape}".encode())
        digest.update(np.ascontiguousarray(part).data)
    for name, array in arrays.items():
        if array is not None:
            digest.update(f"{name}{array.dtype.str}{array.shape}".encode())
            for first in range(0, len(array), HASH_ROWS):
                digest.update(np.ascontiguousarray(array[first : first + HASH_ROWS]).data)
    return digest.hexdigest()
