"""Snaps a mesh: vertices go through transform, snap and clip; indices are made int32 and checked.

Or takes it as it is: vertices in pixels as float64, which no grid moves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, NoReturn, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import apart_from, as_triangles, as_vertices, check_rows, narrow_triangles
from topleft._core.base.memory import Memory, empty
from topleft._core.base.threads import run_parts
from topleft._core.raster import choices
from topleft._core.raster.choices import Work
from topleft._core.raster.view import RasterState, View

SPECIAL, BAD, WIDE = np.iinfo(np.int32).min, 0, 1  # x_fx and y_fx of vertices that are not narrow: csrc/topleft.h
NO_RECORDS = np.empty(0, np.uint8)


class MeshArrays(NamedTuple):
    """Vertices and triangles as kernels take them: contiguous, of known dtypes."""

    points: NDArray[Any]
    source: engine.Source
    triangles: NDArray[np.int32]
    triangles_given: ArrayLike
    is_checked: bool  # whether all triangles name vertices that there are
    n_threads: int  # that vertices are worth

    def check_first(self, *, is_due: bool) -> None:
        """Check indices before they are drawn if that is due, unless they have been."""
        if is_due and not self.is_checked:
            self.check_indices()

    def check_indices(self) -> None:
        """Raise an error for the first triangle that names a vertex that does not exist."""
        check_rows(self.triangles, len(self.points), self.triangles_given)


@dataclass(slots=True)
class Snapped:
    """A mesh after the snap, or without one in `mesh.exact`: ready to be drawn into any buffer of the view's size."""

    mesh: engine.SnappedMesh
    given: MeshArrays
    records: NDArray[np.uint8]  # `tl_vertex` in csrc
    pieces: engine.Pieces | None
    size: tuple[int, int]  # of the view, pixels
    can_slice: bool = True  # whether threads can each take some of the triangles
    work: Work = field(init=False)

    def __post_init__(self) -> None:
        given = self.given
        self.work = Work(self.mesh, given.points, given.source.is_clip_space, len(given.triangles), self.size)

    @property
    def n_vertices(self) -> int:
        """Vertices of the mesh, used or not."""
        return len(self.given.points)

    @property
    def n_triangles(self) -> int:
        """Triangles of the mesh, before any of them is cut."""
        return len(self.given.triangles)

    def refuse(self) -> NoReturn:
        """Raise an error for the first triangle with an index or a vertex that cannot be drawn."""
        self.given.check_indices()
        if self.mesh.exact is not None:  # no vertex was checked before
            check_finite(self.given.points, self.given.triangles, with_depth=False)
        refuse_changed()


def refuse_changed() -> NoReturn:
    """Raise the error for an index that was out of range while it was drawn, and now is not."""
    raise IndexError(
        "triangles must hold indices of vertices while they are drawn, got some that did not, and now do: nobody may "
        "write to them during a call"
    )


class SnappedVertices(NamedTuple):
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
    given = read(memory, vertices, triangles, view, out)
    view.mark("input")
    if view.is_exact:
        return read_exact(memory, given, view, with_depth=with_depth, must_check=out is not None)
    return snap_input(memory, given, view, with_depth=with_depth, must_check=out is not None)


def snap_to_cover(memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, *, out: object) -> Snapped:
    """Take arrays as `snap_mesh` does, for a picture of coverage alone.

    On a fine grid float lanes draw the snapped vertices as they do vertices that are not snapped: the same picture.
    """
    if not choices.pays_float_lanes(view):
        return snap_mesh(memory, vertices, triangles, view, with_depth=False, out=out)
    given, must_check = read(memory, vertices, triangles, view, out), out is not None
    found = snap_for_floats(memory, given, view, must_check=must_check)
    return found or snap_input(memory, given, view, with_depth=False, must_check=must_check)


def read(memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, out: object) -> MeshArrays:
    """Return arrays as kernels take them, copied where they may share memory with `out`; int64 indices are checked."""
    points = as_vertices(apart_from(out, "vertices", vertices), has_transform=view.transform is not None)
    triangles = apart_from(out, "triangles", triangles)
    if view.static is not None:
        is_checked, indices = True, view.static.drawn_triangles
    else:
        native = as_triangles(triangles)
        is_checked = native.dtype == np.int64
        if is_checked:
            room = memory.scratch("triangles", native.shape, np.int32)
            n_threads = choices.threads_to_convert(view.threads, len(native))
            narrow_triangles(native, triangles, len(points), room, n_threads)
        indices = room if is_checked else cast("NDArray[np.int32]", native)
    n_threads = choices.threads_to_snap(view.threads, len(points), len(indices))
    return MeshArrays(points, source_of(points, view), indices, triangles, is_checked, n_threads)


def source_of(points: NDArray[Any], view: View) -> engine.Source:
    """Return contiguous vertices with the matrix that the snap applies to each of them."""
    return engine.Source(points, view.transform, is_affine(view.transform))


def is_affine(matrix: NDArray[Any] | None) -> bool:
    """Tell whether every w is 1 behind a transform, so that attributes are interpolated without 1/w."""
    return matrix is not None and matrix[3].tolist() == [0, 0, 0, 1]


def n_to_draw(given: MeshArrays, view: View) -> int:
    """Return how many vertices are needed: all of them, or none where there is nothing to draw."""
    return len(given.points) if len(given.triangles) and 0 not in view.size else 0


def snap_input(memory: Memory, given: MeshArrays, view: View, *, with_depth: bool, must_check: bool) -> Snapped:
    """Snap and clip arrays that have been read, as `snap_mesh` does."""
    points, source, indices = given.points, given.source, given.triangles
    n = n_to_draw(given, view)
    viewport = view.engine_viewport() if source.is_clip_space and n else None
    records, wide, n_bad, n_clipped = snap(memory, source, n, given.n_threads, view, viewport, with_depth=with_depth)
    view.mark("vertices")
    given.check_first(is_due=must_check or bool(n == 0 or n_bad or n_clipped))
    if n_bad:
        check_used_vertices(points, records, indices, view)
    pieces = None
    if viewport is not None and n_clipped:
        pieces = engine.Pieces(source, records, indices, viewport)
    view.mark("clip")
    if view.grid_bits > view.subpixel_bits:
        wide, is_bad = refine(records, wide, pieces, view.grid_bits - view.subpixel_bits)
        if is_bad:
            check_used_vertices(points, records, indices, view)

    def made(triangles: NDArray[np.int32], how: RasterState) -> engine.SnappedMesh:
        return engine.SnappedMesh(source, records, wide, triangles, pieces, how, viewport)

    return Snapped(without_sides(made, indices if n else indices[:0], view), given, records, pieces, view.size)


def snap_for_floats(memory: Memory, given: MeshArrays, view: View, *, must_check: bool) -> Snapped | None:
    """Return pixels rounded to the grid as float64; None for clip space, and where a vertex leaves the range."""
    points, source, indices = given.points, given.source, given.triangles
    if source.is_clip_space or not len(points) or 0 in view.size:
        return None
    taken = memory.scratch("points", points.shape, np.float64)

    def take_part(first: int, end: int) -> int:
        return source.take(first, end, taken, view.subpixel_bits)

    if sum(run_parts(take_part, len(points), given.n_threads)):
        return None
    given.check_first(is_due=must_check)
    return exact_mesh(given, taken, indices, None, view, None)


def read_exact(memory: Memory, given: MeshArrays, view: View, *, with_depth: bool, must_check: bool) -> Snapped:
    """Take arrays as they are: for ``subpixel_bits="exact"``.

    Indices and positions are checked while drawing, or here where an error may not leave a trace in the caller's `out`.
    """
    points, source, indices = given.points, given.source, given.triangles
    n = n_to_draw(given, view)
    if source.is_clip_space and n:
        return project_mesh(memory, given, view, must_check=must_check)
    has_depth = with_depth and points.shape[1] == 3
    taken, n_bad = take_points(memory, given, n, must_check=must_check or has_depth)
    view.mark("vertices")
    given.check_first(is_due=must_check or bool(n == 0 or n_bad))
    if n_bad:
        check_finite(points, indices, with_depth=has_depth)
    return exact_mesh(given, taken, indices if n else indices[:0], None, view, None)


def project_mesh(memory: Memory, given: MeshArrays, view: View, *, must_check: bool) -> Snapped:
    """Take clip space to pixels, and cut triangles, without a snap."""
    points, source, indices = given.points, given.source, given.triangles
    n, viewport = len(points), view.engine_viewport()
    projected = memory.scratch("points", (n, engine.PLACED), np.float64)

    def project_part(first: int, end: int) -> tuple[int, int, int]:
        return source.project(first, end, viewport, projected, None)

    counts = run_parts(project_part, n, given.n_threads)
    n_bad, _, n_clipped = map(sum, zip(*counts, strict=True))
    view.mark("vertices")
    given.check_first(is_due=must_check or bool(n_bad or n_clipped))
    if n_bad:
        check_projected(points, projected, indices)
    pieces = None
    if n_clipped:
        pieces = engine.Pieces(source, projected, indices, viewport)
    view.mark("clip")
    return exact_mesh(given, projected, indices, pieces, view, viewport)


def exact_mesh(
    given: MeshArrays,
    points: NDArray[np.float64],
    triangles: NDArray[np.int32],
    pieces: engine.Pieces | None,
    view: View,
    viewport: engine.Viewport | None,
) -> Snapped:
    """Return a mesh of points in pixels, without the sides that are not drawn."""

    def made(triangles: NDArray[np.int32], how: RasterState) -> engine.SnappedMesh:
        exact = engine.UnsnappedPoints(points, triangles, pieces)
        return engine.SnappedMesh(given.source, NO_RECORDS, None, triangles, None, how, viewport, exact=exact)

    mesh = without_sides(made, triangles, view)
    return Snapped(mesh, given, NO_RECORDS, None, view.size, can_slice=pieces is None)


def take_points(memory: Memory, given: MeshArrays, n: int, *, must_check: bool) -> tuple[NDArray[np.float64], int]:
    """Return the first `n` points as float64, and how many of their numbers cannot be drawn, if that was checked."""
    points, source = given.points, given.source
    is_same = points.dtype == np.float64
    if not n or (is_same and not must_check):
        return points[:n].astype(np.float64, copy=False), 0
    taken = points if is_same else memory.scratch("points", (n, points.shape[1]), np.float64)

    def take_part(first: int, end: int) -> int:
        return source.take(first, end, None if is_same else taken)

    return taken, sum(run_parts(take_part, n, given.n_threads))


def snap(
    memory: Memory,
    source: engine.Source,
    n: int,
    n_threads: int,
    view: View,
    viewport: engine.Viewport | None,
    *,
    with_depth: bool,
) -> SnappedVertices:
    """Transform, project and snap the first `n` vertices in one pass; a second one where some are wide."""
    records = memory.scratch("records", (n * engine.VERTEX_BYTES,), np.uint8)
    if not n:
        return SnappedVertices(records, None, 0, 0)
    wide: NDArray[np.int64] | None = None

    def snap_part(first: int, end: int) -> tuple[int, int, int]:
        if viewport is not None:
            return source.project(first, end, viewport, records, wide)
        return source.snap(first, end, view.subpixel_bits, with_depth, records, wide)

    counts = run_parts(snap_part, n, n_threads)
    n_bad, n_wide, n_clipped = map(sum, zip(*counts, strict=True))
    if n_wide:
        wide = empty((n, 2), np.int64)
        wide.fill(0)
        snap_part(0, n)
    return SnappedVertices(records, wide, n_bad, n_clipped)


def without_sides(
    made: Callable[[NDArray[np.int32], RasterState], engine.SnappedMesh], triangles: NDArray[np.int32], view: View
) -> engine.SnappedMesh:
    """Return a mesh of the triangles, after triangles that show the side that is not drawn are collapsed."""
    if view.single_sided is not None and len(triangles):
        is_single, cull = view.single_sided
        seen = made(triangles, view.raster_state._replace(cull=cull))
        left: NDArray[np.int32] = empty(triangles.shape, np.int32)
        n_parts = choices.threads_to_convert(view.threads, len(triangles))
        run_parts(lambda first, end: seen.drop_sides(is_single, first, end, left), len(triangles), n_parts)
        triangles = left
    return made(triangles, view.raster_state)


def refine(
    records: NDArray[np.uint8], wide: NDArray[np.int64] | None, pieces: engine.Pieces | None, n_bits: int
) -> tuple[NDArray[np.int64] | None, bool]:
    """Shift vertices and pieces in place to the grid of the samples, which is `n_bits` finer.

    Returns the table of wide vertices, made now if it is first needed now, and whether a vertex has left the
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
    i = engine.first_bad(records, triangles)
    if i < 0:
        return
    if view.transform is not None:
        raise bad_vertex(points, i, "stay finite under transform")
    if abs(points[i, :2].astype(float)).max() < 2.0 ** (62 - view.grid_bits):
        raise bad_vertex(points, i, "have a depth that float32 can hold")
    bits = view.grid_bits
    raise bad_vertex(points, i, f"lie within 2**{62 - bits} pixels of 0 with {bits} sub-pixel bits")


def check_projected(points: NDArray[Any], projected: NDArray[np.float64], triangles: NDArray[np.int32]) -> None:
    """Raise an error for the first vertex that is not finite behind its transform, if a triangle uses it."""
    used = corners_of(triangles, np.isnan(projected[:, 0]) & (projected[:, 1] == BAD))
    if used.size:
        raise bad_vertex(points, used.min(), "stay finite under transform")


def check_finite(points: NDArray[Any], triangles: NDArray[np.int32], *, with_depth: bool) -> None:
    """Raise an error for the first used vertex with numbers that cannot be drawn unsnapped."""
    limit = 2.0**53 if points.dtype.kind == "i" else np.inf
    is_far = np.any(~(abs(points[:, :2].astype(float)) <= limit), axis=1)
    is_bad = is_far | ~np.isfinite(points).all(axis=1)
    if with_depth:
        is_bad |= ~(abs(points[:, 2].astype(float)) <= np.finfo(np.float32).max)
    used = corners_of(triangles, is_bad)
    if used.size:
        i = used.min()
        wish = "lie within 2**53 as integers for 'exact'" if is_far[i] else "have a depth that float32 can hold"
        raise bad_vertex(points, i, wish)


def corners_of(triangles: NDArray[np.int32], is_meant: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the used vertices where `is_meant`; clipped, because another thread may change `triangles`."""
    own = np.clip(triangles, 0, len(is_meant) - 1)
    return own[is_meant[own]]


def bad_vertex(points: NDArray[Any], i: int, wish: str) -> ValueError:
    """Return the error for a vertex that a triangle uses: it must be finite, and fulfil `wish`."""
    row = points[i]
    wish = wish if np.isfinite(row).all() else "be finite where a triangle uses them"
    return ValueError(f"vertices must {wish}, got {row.tolist()} in row {i}")
