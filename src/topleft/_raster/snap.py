"""Snaps a mesh: vertices go through transform, snap and clip; indices are made int32 and checked.

Or takes it as it is: vertices in pixels as float64, which no grid moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import _engine
from topleft._base.arrays import apart_from, as_matrix, as_triangles, as_vertices, bad_triangle
from topleft._base.memory import Memory, empty
from topleft._base.threads import run_parts
from topleft._raster import choices
from topleft._raster.view import View

__all__ = ["Snapped", "snap_mesh", "snap_to_cover"]

SPECIAL, BAD, WIDE = np.iinfo(np.int32).min, 0, 1  # x_fx and y_fx of vertices that are not narrow: csrc/topleft.h
NO_RECORDS = np.empty(0, np.uint8)
UNCHECKED = -2  # instead of the row of a bad triangle; -1: there is none


@dataclass(frozen=True, slots=True)
class Snapped:
    """A mesh after the snap: ready to be drawn into any buffer of the view's size."""

    mesh: _engine.SnappedMesh
    triangles: NDArray[np.int32]  # whose indices may still have to be checked
    triangles_given: ArrayLike
    points: NDArray[Any]  # the vertices, contiguous, before the snap
    source: _engine.Source
    records: NDArray[np.uint8]  # after it: `tl_vertex` in csrc
    pieces: _engine.Pieces | None

    @property
    def n_vertices(self) -> int:
        """Vertices of the mesh, used or not."""
        return len(self.points)

    @property
    def n_triangles(self) -> int:
        """Triangles of the mesh, before any of them is cut."""
        return len(self.triangles)

    @property
    def can_share(self) -> bool:
        """Whether threads can each take some of the triangles."""
        return True

    @property
    def has_depth(self) -> bool:
        """Whether vertices have a depth of their own; otherwise all of them lie at 0."""
        return self.source.is_clip_space or self.points.shape[1] == 3

    def check_indices(self) -> None:
        """Raise an error for the first triangle that names a vertex that does not exist."""
        row = _engine.first_bad_row(self.triangles, self.n_vertices)
        if row >= 0:
            raise bad_triangle(self.triangles_given, row, self.n_vertices)


@dataclass(frozen=True, slots=True)
class Unsnapped(Snapped):
    """A mesh whose vertices stay where they are: `mesh.exact` has them."""

    has_pieces: bool = False  # of triangles that a clip plane cuts

    @property
    def can_share(self) -> bool:
        """Whether threads can each take some of the triangles."""
        return not self.has_pieces

    def check_indices(self) -> None:
        """Raise an error for the first triangle with an index or a vertex that cannot be drawn."""
        Snapped.check_indices(self)
        check_finite(self.points, self.triangles, with_depth=False)


class Vertices(NamedTuple):
    """Snapped vertices, and how many of them cannot be drawn, or lie outside of a clip plane."""

    records: NDArray[np.uint8]
    wide: NDArray[np.int64] | None  # (V, 2): positions beyond 2**30 sub-pixels
    n_bad: int
    n_clipped: int


def snap_mesh(
    memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, *, with_depth: bool, out: object
) -> Snapped:
    """Take arrays through transform, snap and clip.

    Indices are checked where they are read anyway, while drawing; before that only when an error may not leave a trace
    in the caller's `out`, or when the vertices need a closer look.

    Raises
    ------
    ValueError
        If a vertex that a triangle uses is not finite, or lies beyond 2**62 sub-pixels.
    IndexError
        If a triangle names a vertex that does not exist, and indices are checked here.
    """
    if view.is_exact:
        return take_mesh(memory, vertices, triangles, view, with_depth=with_depth, out=out)
    points, source = transform(vertices, view, out)
    triangles = apart_from(out, "triangles", triangles)
    indices, bad_row = index(memory, triangles, len(points), view)
    view.mark("input")
    n = len(points) if len(indices) and 0 not in view.size else 0
    viewport = view.engine_viewport() if source.is_clip_space and n else None
    records, wide, n_bad, n_clipped = snap(memory, source, n, len(indices), view, viewport, with_depth=with_depth)
    view.mark("vertices")
    if bad_row == UNCHECKED and (out is not None or n == 0 or n_bad or n_clipped):
        bad_row = _engine.first_bad_row(indices, len(points))
    if bad_row >= 0:
        raise bad_triangle(triangles, bad_row, len(points))
    if n_bad:
        check_used_vertices(points, records, indices, view)
    pieces = None
    if viewport is not None and choices.must_cut(n_clipped):
        pieces = _engine.Pieces(source, records, indices, viewport)
    view.mark("clip")
    if view.grid_bits > view.subpixel_bits:
        wide, is_bad = refine(records, wide, pieces, view.grid_bits - view.subpixel_bits)
        if is_bad:
            check_used_vertices(points, records, indices, view)
    drawn = indices if n else indices[:0]
    if view.single_sided is not None and n:
        is_single, cull = view.single_sided
        seen = _engine.SnappedMesh(source, records, wide, drawn, pieces, view.how._replace(cull=cull), viewport)
        drawn = without_sides(seen, drawn, is_single, view.threads)
    mesh = _engine.SnappedMesh(source, records, wide, drawn, pieces, view.how, viewport)
    return Snapped(mesh, indices, triangles, points, source, records, pieces)


def snap_to_cover(memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, *, out: object) -> Snapped:
    """Take arrays as `snap_mesh` does, for a picture that asks nothing but which samples are covered.

    On a fine grid float lanes draw the snapped vertices as they do vertices that are not snapped: the same picture.
    """
    found = snap_for_floats(memory, vertices, triangles, view, out) if choices.pays_float_lanes(view) else None
    return found or snap_mesh(memory, vertices, triangles, view, with_depth=False, out=out)


def snap_for_floats(
    memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, out: object
) -> Unsnapped | None:
    """Return pixels rounded to the grid as float64; None for clip space, and where a vertex leaves the range."""
    points, source = transform(vertices, view, out)
    triangles = apart_from(out, "triangles", triangles)
    n = len(points)
    if source.is_clip_space or not n or 0 in view.size:
        return None
    indices, bad_row = index(memory, triangles, n, view)
    taken = memory.empty("points", points.shape, np.float64)

    def take_part(first: int, end: int) -> int:
        return source.take(first, end, taken, view.subpixel_bits)

    if sum(run_parts(take_part, n, choices.threads_to_snap(view.threads, n, len(indices)))):
        return None
    if bad_row == UNCHECKED and out is not None:
        bad_row = _engine.first_bad_row(indices, n)
    if bad_row >= 0:
        raise bad_triangle(triangles, bad_row, n)
    exact = _engine.UnsnappedPoints(taken, indices)
    mesh = _engine.SnappedMesh(source, NO_RECORDS, None, indices, None, view.how, None, exact=exact)
    return Unsnapped(mesh, indices, triangles, points, source, NO_RECORDS, None)


def take_mesh(
    memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, *, with_depth: bool, out: object
) -> Unsnapped:
    """Take arrays as they are: for ``subpixel_bits="exact"``.

    Indices and positions are checked while drawing, or here where an error may not leave a trace in the caller's `out`.
    """
    points, source = transform(vertices, view, out)
    triangles = apart_from(out, "triangles", triangles)
    indices, bad_row = index(memory, triangles, len(points), view)
    view.mark("input")
    n = len(points) if len(indices) and 0 not in view.size else 0
    if source.is_clip_space and n:
        return project_mesh(memory, triangles, view, points, source, indices, bad_row, must_check=out is not None)
    has_depth = with_depth and points.shape[1] == 3
    taken, n_bad = take_points(memory, source, points, n, len(indices), view, must_check=out is not None or has_depth)
    view.mark("vertices")
    if bad_row == UNCHECKED and (out is not None or n == 0 or n_bad):
        bad_row = _engine.first_bad_row(indices, len(points))
    if bad_row >= 0:
        raise bad_triangle(triangles, bad_row, len(points))
    if n_bad:
        check_finite(points, indices, with_depth=has_depth)
    mesh = exact_mesh(source, taken, indices if n else indices[:0], None, view, None)
    return Unsnapped(mesh, indices, triangles, points, source, NO_RECORDS, None)


def exact_mesh(
    source: _engine.Source,
    points: NDArray[np.float64],
    triangles: NDArray[np.int32],
    pieces: _engine.ExactPieces | None,
    view: View,
    viewport: _engine.Viewport | None,
) -> _engine.SnappedMesh:
    """Return a mesh of points in pixels, without the sides that are not drawn."""
    exact = _engine.UnsnappedPoints(points, triangles, pieces)
    if view.single_sided is not None and len(points):
        is_single, cull = view.single_sided
        how = view.how._replace(cull=cull)
        seen = _engine.SnappedMesh(source, NO_RECORDS, None, triangles, None, how, viewport, exact=exact)
        triangles = without_sides(seen, triangles, is_single, view.threads)
        exact = _engine.UnsnappedPoints(points, triangles, pieces)
    return _engine.SnappedMesh(source, NO_RECORDS, None, triangles, None, view.how, viewport, exact=exact)


def project_mesh(
    memory: Memory,
    triangles: ArrayLike,
    view: View,
    points: NDArray[Any],
    source: _engine.Source,
    indices: NDArray[np.int32],
    bad_row: int,
    *,
    must_check: bool,
) -> Unsnapped:
    """Take clip space to pixels, and cut triangles, without a snap."""
    n, viewport = len(points), view.engine_viewport()
    projected = memory.empty("points", (n, 3), np.float64)

    def project_part(first: int, end: int) -> tuple[int, int]:
        return source.project_points(first, end, viewport, projected)

    counts = run_parts(project_part, n, choices.threads_to_snap(view.threads, n, len(indices)))
    n_bad, n_clipped = map(sum, zip(*counts, strict=True))
    view.mark("vertices")
    if bad_row == UNCHECKED and (must_check or n_bad or n_clipped):
        bad_row = _engine.first_bad_row(indices, n)
    if bad_row >= 0:
        raise bad_triangle(triangles, bad_row, n)
    if n_bad:
        check_projected(points, projected, indices)
    pieces = None
    if choices.must_cut(n_clipped):
        pieces = _engine.ExactPieces(source, projected, indices, viewport)
    view.mark("clip")
    mesh = exact_mesh(source, projected, indices, pieces, view, viewport)
    return Unsnapped(mesh, indices, triangles, points, source, NO_RECORDS, None, has_pieces=pieces is not None)


def take_points(
    memory: Memory,
    source: _engine.Source,
    points: NDArray[Any],
    n: int,
    n_triangles: int,
    view: View,
    *,
    must_check: bool,
) -> tuple[NDArray[np.float64], int]:
    """Return the first `n` points as float64, and how many of their numbers cannot be drawn, if that was looked at."""
    is_same = points.dtype == np.float64
    if not n or (is_same and not must_check):
        return points[:n].astype(np.float64, copy=False), 0
    taken = points if is_same else memory.empty("points", (n, points.shape[1]), np.float64)

    def take_part(first: int, end: int) -> int:
        return source.take(first, end, None if is_same else taken)

    return taken, sum(run_parts(take_part, n, choices.threads_to_snap(view.threads, n, n_triangles)))


def transform(vertices: ArrayLike, view: View, out: object = None) -> tuple[NDArray[Any], _engine.Source]:
    """Return vertices as a contiguous array, and the same with the matrix that the snap applies to each of them."""
    points = as_vertices(apart_from(out, "vertices", vertices), has_transform=view.transform is not None)
    if view.transform is None:
        return points, _engine.Source(points)
    matrix = as_matrix(view.transform, points.dtype)
    return points, _engine.Source(points, matrix, choices.is_affine(matrix))


def index(memory: Memory, triangles: ArrayLike, n_vertices: int, view: View) -> tuple[NDArray[np.int32], int]:
    """Return triangles as int32, and the first that names a vertex that does not exist, if that was looked at."""
    if view.plan is not None:
        return view.plan.triangles_of(triangles, n_vertices), -1
    given = as_triangles(triangles)
    if given.dtype == np.int32:
        return cast("NDArray[np.int32]", given), UNCHECKED
    indices: NDArray[np.int32] = memory.empty("triangles", given.shape, np.int32)
    wide = cast("NDArray[np.int64]", given)

    def narrow(first: int, end: int) -> int:
        row = _engine.narrow_triangles(wide[first:end], n_vertices, indices[first:end])
        return first + row if row >= 0 else -1

    n = len(given)
    bad_rows = run_parts(narrow, n, choices.threads_to_convert(view.threads, n))
    return indices, next((row for row in bad_rows if row >= 0), -1)


def snap(
    memory: Memory,
    source: _engine.Source,
    n: int,
    n_triangles: int,
    view: View,
    viewport: _engine.Viewport | None,
    *,
    with_depth: bool,
) -> Vertices:
    """Transform, project and snap the first `n` vertices in one pass; a second one where some are wide."""
    records = memory.empty("records", (n * _engine.VERTEX_BYTES,), np.uint8)
    if not n:
        return Vertices(records, None, 0, 0)
    wide: NDArray[np.int64] | None = None

    def snap_part(first: int, end: int) -> tuple[int, int, int]:
        if viewport is not None:
            return source.project(first, end, viewport, records, wide)
        return source.snap(first, end, view.subpixel_bits, with_depth, records, wide)

    counts = run_parts(snap_part, n, choices.threads_to_snap(view.threads, n, n_triangles))
    n_bad, n_wide, n_clipped = map(sum, zip(*counts, strict=True))
    if n_wide:
        wide = empty((n, 2), np.int64)
        snap_part(0, n)
    return Vertices(records, wide, n_bad, n_clipped)


def without_sides(
    mesh: _engine.SnappedMesh, triangles: NDArray[np.int32], is_single: NDArray[np.uint8], threads: int | None
) -> NDArray[np.int32]:
    """Return triangles, those collapsed that are single-sided and turned the way that the mesh culls."""
    left: NDArray[np.int32] = empty(triangles.shape, np.int32)
    n_parts = choices.threads_to_convert(threads, len(triangles))
    run_parts(lambda first, end: mesh.drop_sides(is_single, first, end, left), len(triangles), n_parts)
    return left


def refine(
    records: NDArray[np.uint8], wide: NDArray[np.int64] | None, pieces: _engine.Pieces | None, n_bits: int
) -> tuple[NDArray[np.int64] | None, bool]:
    """Shift vertices and pieces in place to the grid of the samples, which is `n_bits` finer.

    Returns the table of wide vertices, a new one if there was none and one is needed, and whether a vertex has left the
    range; such vertices are marked.
    """
    if pieces:
        refine(pieces.arrays[0], pieces.arrays[1], None, n_bits)  # type: ignore[index]
    xy = records.view(np.int32).reshape(-1, 4)[:, :2]
    is_special = xy[:, 0] == SPECIAL
    is_wide = is_special & (xy[:, 1] == WIDE)
    leaves = ~is_special & (np.abs(xy) >= 2 ** (30 - n_bits)).any(axis=1)
    stays = ~is_special & ~leaves
    xy[stays] <<= np.int32(n_bits)
    is_wide |= leaves
    if not is_wide.any():
        return wide, False
    if wide is None:
        wide = np.zeros((len(xy), 2), np.int64)
    wide[leaves] = xy[leaves]
    is_far = is_wide & (np.abs(wide) >= 2 ** (62 - n_bits)).any(axis=1)
    wide[is_wide] <<= n_bits
    xy[is_wide] = SPECIAL, WIDE
    xy[is_far] = SPECIAL, BAD
    return wide, bool(is_far.any())


def check_used_vertices(
    points: NDArray[Any], records: NDArray[np.uint8], triangles: NDArray[np.int32], view: View
) -> None:
    """Raise an error for the first vertex that cannot be drawn, if a triangle uses it."""
    i = _engine.first_bad(records, triangles)
    if i < 0:
        return
    row = points[i]
    if not np.isfinite(row).all():
        raise ValueError(f"vertices must be finite where a triangle uses them, got {row.tolist()} in row {i}")
    if view.transform is not None:
        raise ValueError(f"vertices must stay finite under transform, got {row.tolist()} in row {i}")
    if abs(row[:2].astype(float)).max() < 2.0 ** (62 - view.grid_bits):
        raise ValueError(f"vertices must have a depth that float32 can hold, got {row.tolist()} in row {i}")
    raise ValueError(
        f"vertices must lie within 2**{62 - view.grid_bits} pixels of 0 with {view.grid_bits} sub-pixel bits, "
        f"got {row.tolist()} in row {i}"
    )


def check_projected(points: NDArray[Any], projected: NDArray[np.float64], triangles: NDArray[np.int32]) -> None:
    """Raise an error for the first vertex that is not finite behind its transform, if a triangle uses it."""
    is_bad = np.isnan(projected[:, 0]) & (projected[:, 1] == BAD)
    used = triangles[is_bad[triangles]]
    if not used.size:
        return
    i = used.min()
    row = points[i]
    if not np.isfinite(row).all():
        raise ValueError(f"vertices must be finite where a triangle uses them, got {row.tolist()} in row {i}")
    raise ValueError(f"vertices must stay finite under transform, got {row.tolist()} in row {i}")


def check_finite(points: NDArray[Any], triangles: NDArray[np.int32], *, with_depth: bool) -> None:
    """Raise an error for the first vertex whose numbers cannot be drawn as they are, if a triangle uses it."""
    is_bad = ~(abs(points[:, :2].astype(float)) <= (2.0**53 if points.dtype.kind == "i" else np.inf)).all(axis=1)
    is_bad |= ~np.isfinite(points).all(axis=1)
    if with_depth:
        is_bad |= ~(abs(points[:, 2].astype(float)) <= np.finfo(np.float32).max)
    used = triangles[is_bad[triangles]]
    if not used.size:
        return
    i = used.min()
    row = points[i]
    if not np.isfinite(row).all():
        raise ValueError(f"vertices must be finite where a triangle uses them, got {row.tolist()} in row {i}")
    if points.dtype.kind == "i" and abs(row[:2].astype(float)).max() > 2.0**53:
        raise ValueError(f"vertices must lie within 2**53 as integers for 'exact', got {row.tolist()} in row {i}")
    raise ValueError(f"vertices must have a depth that float32 can hold, got {row.tolist()} in row {i}")
