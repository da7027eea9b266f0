"""Faces: normals of triangles and of vertices, the side that these are on, the box round a mesh.

Input: vertices and triangles. Output: arrays whose bits depend neither on the machine nor on the number of threads.

Based on: Thurmer, G., and C. A. Wuthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics
Tools 3(1), 1998 (normals weighted by the angle at the vertex).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._base.arrays import bad_triangle
from topleft._base.threads import count_threads, run_parts

__all__ = [
    "angle_weighted_normals", "box_of_triangles", "color_rows", "face_normal_rows", "face_normals", "moved",
    "turned_faces", "unit_or_zero", "unit_rows",
]  # fmt: skip

FloatArray = npt.NDArray[np.floating[Any]]
F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]

MIN_PER_THREAD = 50_000
"""Triangles or vertices that are worth a thread: a millisecond, where the first use of the pool takes four."""

MAX_THREADS_OF_VERTICES = 8
"""Each thread that sums the normals of vertices goes through all triangles."""


def angle_weighted_normals(vertices: FloatArray, triangles: I32, *, threads: int | None = None) -> F64:
    """Unit normals (V, 3) float64 of a mesh: the faces round a vertex count by the angle they have there.

    Parameters
    ----------
    vertices : (V, 3) float
    triangles : (T, 3) int32, counter-clockwise seen from outside
    threads : int, optional
        Never changes a bit.

    Returns
    -------
    (V, 3) float64
        (0, 0, 0) where no face with an area meets the vertex, or where the faces cancel.

    Raises
    ------
    IndexError
        If a triangle names a vertex that does not exist.

    Notes
    -----
    The weight makes the normal independent of how a flat face is cut into triangles, which weights of one a
    triangle, or of its area, do not. Angles are within 2**-50 of their value, relative, where the sides are exact in
    float64; sums are in the order of the faces. Any scale will do: sides are measured by their longest.

    References
    ----------
    G. Thurmer and C. A. Wuthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1),
    1998.
    """
    points, corners = _contiguous(vertices), np.ascontiguousarray(triangles, np.int32)
    source, out = _engine.Source(points), np.empty((len(points), 3))

    def add_up(first: int, end: int) -> int:
        return _engine.vertex_normals(source, corners, first, end, out)

    n_threads = min(_threads(len(corners), None), MAX_THREADS_OF_VERTICES) if threads is None else threads
    _check(run_parts(add_up, len(points), n_threads), corners, len(points))
    return out


def face_normals(vertices: FloatArray, triangles: I32, *, threads: int | None = None) -> F64:
    """Unit normals (T, 3) float64 of the triangles, on the side from which they run counter-clockwise.

    (0, 0, 0) for a triangle without area.
    """
    out = np.empty((len(triangles), 3))

    def measure(source: _engine.Source, corners: I32, first: int, end: int) -> int:
        return _engine.face_normals(source, corners, first, end, out, None)

    _over_faces(vertices, triangles, threads, measure)
    return out


def face_normal_rows(vertices: FloatArray, triangles: I32, *, threads: int | None = None) -> F32:
    """The same as rows (T, 4) float32, the last number 1."""
    rows = np.empty((len(triangles), 4), np.float32)

    def measure(source: _engine.Source, corners: I32, first: int, end: int) -> int:
        return _engine.face_normals(source, corners, first, end, None, rows)

    _over_faces(vertices, triangles, threads, measure)
    return rows


def turned_faces(vertices: FloatArray, triangles: I32, normals: F32, *, threads: int | None = None) -> U8:
    """(T,) uint8: 1 where the normals (V, 4) of the corners, added up, point to the other side than the triangle."""
    turned = np.empty(len(triangles), np.uint8)
    if len(normals) != len(vertices):
        raise ValueError(f"normals must have shape ({len(vertices)}, 4), got {normals.shape}")

    def compare(source: _engine.Source, corners: I32, first: int, end: int) -> int:
        return _engine.find_turned(source, corners, first, end, normals, turned)

    _over_faces(vertices, triangles, threads, compare)
    return turned


def box_of_triangles(vertices: FloatArray, triangles: I32, *, threads: int | None = None) -> F64:
    """Lowest and highest corner (2, 3) float64 of at least one triangle."""
    boxes = []

    def measure(source: _engine.Source, corners: I32, first: int, end: int) -> int:
        box = np.empty(6)
        boxes.append(box)
        return _engine.box_of_faces(source, corners, first, end, box)

    _over_faces(vertices, triangles, threads, measure)
    both = np.reshape(boxes, (-1, 2, 3))
    return np.stack([both[:, 0].min(axis=0), both[:, 1].max(axis=0)])


def unit_or_zero(vectors: FloatArray) -> F64:
    """Vectors (N, 3) scaled to length 1, float64; zero stays zero, and what is not finite becomes zero."""
    out = np.empty((len(vectors), 3))
    _over_rows(vectors, lambda source, first, end: _engine.unit_vectors(source, None, first, end, out, None))
    return out


def unit_rows(vectors: FloatArray, turn: F64 | None = None) -> F32:
    """The same as rows (N, 4) float32, the last number 1; of `vectors @ turn` where there is a matrix (3, 3)."""
    rows = np.empty((len(vectors), 4), np.float32)
    matrix = None if turn is None else np.ascontiguousarray(turn, np.float64)
    _over_rows(vectors, lambda source, first, end: _engine.unit_vectors(source, matrix, first, end, None, rows))
    return rows


def moved(points: FloatArray, matrix: F64) -> F64:
    """Points (N, 3), float64, moved by an affine matrix (4, 4)."""
    out = np.empty((len(points), 3))
    rows = np.ascontiguousarray(matrix, np.float64)
    _over_rows(points, lambda source, first, end: _engine.move_points(source, rows, first, end, out))
    return out


def color_rows(colors: U8) -> F32:
    """Rows (N, 4) float32 of colours (N, 3) or (N, 4): red, green, blue, and 1."""
    rows = np.empty((len(colors), 4), np.float32)
    n_threads = _threads(len(colors), None)
    run_parts(lambda first, end: _engine.color_rows(colors, first, end, rows), len(colors), n_threads)
    return rows


def _over_rows(rows: FloatArray, work: Callable[[_engine.Source, int, int], None]) -> None:
    source = _engine.Source(_contiguous(rows))
    run_parts(lambda first, end: work(source, first, end), len(rows), _threads(len(rows), None))


def _over_faces(
    vertices: FloatArray, triangles: I32, threads: int | None, work: Callable[[_engine.Source, I32, int, int], int]
) -> None:
    points, corners = _contiguous(vertices), np.ascontiguousarray(triangles, np.int32)
    source, n_threads = _engine.Source(points), _threads(len(corners), threads)
    rows = run_parts(lambda first, end: work(source, corners, first, end), len(corners), n_threads)
    _check(rows, corners, len(points))


def _threads(n: int, threads: int | None) -> int:
    """How many threads some triangles or vertices are worth."""
    return max(1, min(count_threads(None, n), n // MIN_PER_THREAD)) if threads is None else threads


def _contiguous(rows: FloatArray) -> FloatArray:
    return np.ascontiguousarray(rows, rows.dtype if rows.dtype in (np.float32, np.float64) else np.float64)


def _check(bad_rows: list[int], triangles: I32, n_vertices: int) -> None:
    """The caller's array may have changed since it was checked."""
    if max(bad_rows) >= 0:
        raise bad_triangle(triangles, min(row for row in bad_rows if row >= 0), n_vertices)
