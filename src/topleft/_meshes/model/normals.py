"""Faces: normals of triangles, of vertices and of creased corners, the side that these are on, the box round a mesh.

Also transforms points and normals by a matrix. Input: vertices and triangles, or rows. Output: arrays whose bits depend
neither on the machine nor on the number of threads.

Based on: Thurmer, G., and C. A. Wuthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics
Tools 3(1), 1998 (normals weighted by the angle at the vertex).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, F64, I32, U8
from topleft._core.base.arrays import as_checked_triangles, as_frozen, refuse_rows
from topleft._core.base.threads import run_parts, threads_of_rows

FloatArray = npt.NDArray[np.floating[Any]]

MAX_THREADS_OF_VERTICES = 8
"""Each thread that sums the normals of vertices goes through all triangles."""


EQUAL_ANGLE_DEG = 1 / 16
"""Angles that are so little larger than the crease angle do not crease: a cylinder of 12 sides, whose numbers a file
rounds, is round all over at 30 degrees, or at no edge."""


class CornerNormals(NamedTuple):
    """Normals of corners: a table, and the row of it that each corner has."""

    rows: F64
    """(N, 3): of the V vertices, each over all its triangles, then those of creased corners. Unit length, or 0."""

    of_corner: I32
    """(T, 3): the row that each corner has."""

    vertex_of_row: I32
    """(N - V,): a vertex at the place of each row behind those of the vertices."""


def creased_normals(
    vertices: FloatArray,
    triangles: I32,
    crease_deg: float,
    places: tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]] | None = None,
    *,
    threads: int | None = None,
) -> tuple[F64, CornerNormals | None]:
    """Normals of vertices, and of corners where edges bend by more than an angle.

    `places`: the result of `coincident` for the vertices, of which those of a group count as one. Returns the normals
    (V, 3) over all triangles at each vertex, and those of corners, None where no vertex has different ones.

    Two corners of a vertex belong together when their triangles share a side at that vertex and the angle between their
    normals is at most the crease angle, or 1/16 degree more; so do corners that a chain of such pairs joins. A corner's
    normal is that of `angle_weighted_normals`, over the corners that belong together. Sides are told by their vertices,
    not by their direction: any two of the triangles at a side that has three or more are compared, and at one that has
    more than 32 none. A triangle without area stands for an edge: its sides at a vertex count as one, and its own
    corners have the normals of their vertices.
    """
    n_vertices, n_triangles = len(vertices), len(triangles)
    if n_triangles >= 1 << 28:
        raise ValueError(f"a mesh with a crease angle must have fewer than 2**28 triangles, got {n_triangles}")
    own = as_checked_triangles(triangles, n_vertices)
    if not n_triangles:
        return np.zeros((n_vertices, 3)), None
    first, group = (None, None) if places is None else places
    points = _contiguous(vertices if first is None else vertices[first])
    corners = own if group is None else group.astype(np.int32)[own]
    source, n_threads = engine.Source(points), threads_of_rows(n_triangles, threads)
    normals, angles = np.empty((n_triangles, 3)), np.empty((n_triangles, 3))
    run_parts(lambda a, b: engine.face_angles(source, corners, a, b, normals, angles), n_triangles, n_threads)
    least_cosine, _ = engine.cosine_and_sine(min(crease_deg + EQUAL_ANGLE_DEG, 180.0))
    fans = engine.Fans(corners, len(points), normals, angles, least_cosine)
    groups, n_groups = np.empty((n_triangles, 3), np.int32), np.empty(len(points), np.int32)
    run_parts(lambda a, b: fans.find_creases(a, b, groups, n_groups), len(points), n_threads)
    starts = np.zeros(len(points) + 1, np.int32)
    np.cumsum(n_groups, out=starts[1:])
    n_more = int(starts[-1])
    rows, of_places = np.empty((n_vertices + n_more, 3)), np.empty((len(points), 3))
    of_corner = np.empty((n_triangles, 3), np.int32) if n_more else None
    more = rows[n_vertices:]

    def add_up(a: int, b: int) -> None:
        fans.sum_creases(a, b, starts, groups, own, n_vertices, of_places, more, of_corner)

    run_parts(add_up, len(points), n_threads)
    rows[:n_vertices] = of_places if group is None else of_places[group]
    if of_corner is None:
        return rows, None
    places_of_rows = np.repeat(np.arange(len(points)), n_groups)
    vertex_of_row = (places_of_rows if first is None else first[places_of_rows]).astype(np.int32)
    return rows[:n_vertices], CornerNormals(rows, of_corner, vertex_of_row)


def angle_weighted_normals(vertices: FloatArray, triangles: I32, *, threads: int | None = None) -> F64:
    """Unit normals (V, 3) float64 of a mesh: the faces round a vertex count by the angle they have there.

    (0, 0, 0) where no face with an area meets the vertex, or where the faces cancel. The weight makes the normal
    independent of how a flat face is cut into triangles, which weights of one a triangle, or of its area, do not
    (G. Thurmer and C. A. Wuthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1),
    1998). Angles are within 2**-48 radians where the sides are exact in float64; sums are in the order of the faces.
    Any scale will do: sides are measured by their longest.
    """
    points, corners = _contiguous(vertices), as_frozen(np.ascontiguousarray(triangles, np.int32))
    source, out = engine.Source(points), np.empty((len(points), 3))

    def add_up(first: int, end: int) -> int:
        return engine.vertex_normals(source, corners, first, end, out)

    n_threads = min(threads_of_rows(len(corners)), MAX_THREADS_OF_VERTICES) if threads is None else threads
    refuse_rows(run_parts(add_up, len(points), n_threads), corners, len(points))
    return out


def face_normals(vertices: FloatArray, triangles: I32, *, threads: int | None = None) -> F64:
    """Unit normals (T, 3) float64 of the triangles, on the side from which they run counter-clockwise.

    (0, 0, 0) for a triangle without area.
    """
    out = np.empty((len(triangles), 3))
    _measure_faces(vertices, triangles, threads, out, None)
    return out


def face_normal_rows(vertices: FloatArray, triangles: I32, *, threads: int | None = None) -> F32:
    """Unit normals of the triangles as rows (T, 4) float32, the last number 1."""
    rows = np.empty((len(triangles), 4), np.float32)
    _measure_faces(vertices, triangles, threads, None, rows)
    return rows


def _measure_faces(
    vertices: FloatArray, triangles: I32, threads: int | None, out: F64 | None, rows: F32 | None
) -> None:
    def measure(source: engine.Source, corners: I32, first: int, end: int) -> int:
        return engine.face_normals(source, corners, first, end, out, rows)

    _over_faces(vertices, triangles, threads, measure)


def turned_faces(
    vertices: FloatArray, triangles: I32, normals: F32, row_of_corner: I32 | None = None, *, threads: int | None = None
) -> U8:
    """(T,) uint8: 1 where the normals of the corners, added up, point to the other side than the triangle.

    `normals` are (V, 4), or rows (N, 4), with each corner's in `row_of_corner` (T, 3).
    """
    turned = np.empty(len(triangles), np.uint8)
    if len(normals) != len(vertices) and row_of_corner is None:
        raise ValueError(f"normals must have shape ({len(vertices)}, 4), got {normals.shape}")

    def compare(source: engine.Source, corners: I32, first: int, end: int) -> int:
        rows = corners if row_of_corner is None else row_of_corner
        return engine.find_turned(source, corners, first, end, normals, rows, turned)

    _over_faces(vertices, triangles, threads, compare)
    return turned


def box_of_triangles(vertices: FloatArray, triangles: I32, *, threads: int | None = None) -> F64:
    """Lowest and highest corner (2, 3) float64 of at least one triangle."""
    boxes = []

    def measure(source: engine.Source, corners: I32, first: int, end: int) -> int:
        box = np.empty(6)
        boxes.append(box)
        return engine.box_of_faces(source, corners, first, end, box)

    _over_faces(vertices, triangles, threads, measure)
    both = np.reshape(boxes, (-1, 2, 3))
    return both[0] if len(both) == 1 else np.stack([both[:, 0].min(axis=0), both[:, 1].max(axis=0)])


def unit_or_zero(vectors: FloatArray) -> F64:
    """Vectors (N, 3) scaled to length 1, float64; zero stays zero, and rows that are not finite become zero."""
    return _row_by_row(vectors, lambda source, a, b, out: engine.unit_vectors(source, None, a, b, out, None))


def unit_rows(vectors: FloatArray, turn: F64 | None = None) -> F32:
    """Vectors scaled to length 1 as rows (N, 4) float32, the last number 1; first multiplied by `turn` (3, 3)."""
    matrix = None if turn is None else np.ascontiguousarray(turn, np.float64)
    return _row_by_row(
        vectors, lambda source, a, b, out: engine.unit_vectors(source, matrix, a, b, None, out), 4, np.float32
    )


def moved(points: FloatArray, matrix: F64) -> F64:
    """Points (N, 3), float64, moved by an affine matrix (4, 4)."""
    rows = np.ascontiguousarray(matrix, np.float64)
    return _row_by_row(points, lambda source, a, b, out: engine.move_points(source, rows, a, b, out))


def turn_of_normals(view: F64) -> F64:
    """The matrix (3, 3) that takes rows of normals to eye space, up to their lengths: the inverse of that of points.

    Its numbers are sums of products, the same on every machine.
    """
    (a, b, c), (d, e, f), (g, h, i) = view[:3, :3].tolist()
    adjugate = [
        [e * i - f * h, c * h - b * i, b * f - c * e],
        [f * g - d * i, a * i - c * g, c * d - a * f],
        [d * h - e * g, b * g - a * h, a * e - b * d],
    ]
    return np.array(adjugate) * math.copysign(1.0, engine.determinant(view[:3, :3]))


def _row_by_row(
    rows: FloatArray, work: Callable[[engine.Source, int, int, Any], None], n_columns: int = 3, dtype: Any = np.float64
) -> npt.NDArray[Any]:
    """The output of `work` on ranges of the rows, by threads."""
    source, out = engine.Source(_contiguous(rows)), np.empty((len(rows), n_columns), dtype)
    run_parts(lambda first, end: work(source, first, end, out), len(rows), threads_of_rows(len(rows)))
    return out


def _over_faces(
    vertices: FloatArray, triangles: I32, threads: int | None, work: Callable[[engine.Source, I32, int, int], int]
) -> None:
    points, corners = _contiguous(vertices), as_frozen(np.ascontiguousarray(triangles, np.int32))
    source, n_threads = engine.Source(points), threads_of_rows(len(corners), threads)
    rows = run_parts(lambda first, end: work(source, corners, first, end), len(corners), n_threads)
    refuse_rows(rows, corners, len(points))  # the caller's array may have changed since it was checked


def _contiguous(rows: FloatArray) -> FloatArray:
    return np.ascontiguousarray(rows, rows.dtype if rows.dtype.char in "fd" else np.float64)
