"""Snaps a mesh: vertices go through transform, snap and clip; indices are made int32 and checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import _engine
from topleft._base.arrays import apart_from, as_matrix, as_triangles, as_vertices, bad_triangle
from topleft._base.memory import Memory
from topleft._base.threads import run_parts
from topleft._raster import choices
from topleft._raster.sampling import refine_grid
from topleft._raster.view import View

__all__ = ["Snapped", "snap_mesh"]


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
    def has_depth(self) -> bool:
        """Whether vertices have a depth of their own; otherwise all of them lie at 0."""
        return self.source.is_clip_space or self.points.shape[1] == 3

    def check_indices(self) -> None:
        """Raise an error for the first triangle that names a vertex that does not exist."""
        check_indices(self.triangles, self.triangles_given, len(self.points))


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
    vertices, triangles = apart_from(out, "vertices", vertices), apart_from(out, "triangles", triangles)
    points, source = transform(vertices, view)
    indices, is_checked = index(memory, triangles, len(points), view)
    view.mark("input")
    n = len(points) if len(indices) and 0 not in view.size else 0
    viewport = view.engine_viewport() if source.is_clip_space and n else None
    records, wide, n_bad, n_clipped = snap(memory, source, n, len(indices), view, viewport, with_depth=with_depth)
    view.mark("vertices")
    if not is_checked and (out is not None or n == 0 or n_bad or n_clipped):
        check_indices(indices, triangles, len(points))
    if n_bad:
        check_used_vertices(points, records, indices, view)
    pieces = None
    if viewport is not None and choices.must_cut(n_clipped):
        pieces = _engine.Pieces(source, records, indices, viewport)
    view.mark("clip")
    if view.grid_bits > view.subpixel_bits:
        wide = refine(points, records, wide, indices, pieces, view)
    drawn = indices if n else indices[:0]
    mesh = _engine.SnappedMesh(source, records, wide, drawn, pieces, view.how, viewport)
    return Snapped(mesh, indices, triangles, points, source, records, pieces)


def transform(vertices: ArrayLike, view: View) -> tuple[NDArray[Any], _engine.Source]:
    """Return vertices as a contiguous array, and the same with the matrix that the snap applies to each of them."""
    points = as_vertices(vertices, has_transform=view.transform is not None)
    if view.transform is None:
        return points, _engine.Source(points)
    matrix = as_matrix(view.transform, points.dtype)
    return points, _engine.Source(points, matrix, choices.is_affine(matrix))


def index(memory: Memory, triangles: ArrayLike, n_vertices: int, view: View) -> tuple[NDArray[np.int32], bool]:
    """Return triangles as int32, and whether their indices have been checked on the way."""
    if view.plan is not None:
        return view.plan.triangles_of(triangles, n_vertices), True
    given = as_triangles(triangles)
    if given.dtype == np.int32:
        return cast("NDArray[np.int32]", given), False
    indices: NDArray[np.int32] = memory.empty("triangles", given.shape, np.int32)
    wide = cast("NDArray[np.int64]", given)

    def narrow(first: int, end: int) -> int:
        row = _engine.narrow_triangles(wide[first:end], n_vertices, indices[first:end])
        return first + row if row >= 0 else -1

    n = len(given)
    for row in run_parts(narrow, n, choices.threads_to_convert(view.threads, n)):
        if row >= 0:
            raise bad_triangle(triangles, row, n_vertices)
    return indices, True


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
        wide = np.empty((n, 2), np.int64)
        snap_part(0, n)
    return Vertices(records, wide, n_bad, n_clipped)


def refine(
    points: NDArray[Any],
    records: NDArray[np.uint8],
    wide: NDArray[np.int64] | None,
    triangles: NDArray[np.int32],
    pieces: _engine.Pieces | None,
    view: View,
) -> NDArray[np.int64] | None:
    """Shift vertices and pieces to the grid of the samples; returns the table of wide vertices."""
    n_bits = view.grid_bits - view.subpixel_bits
    if pieces:
        refine_grid(pieces.arrays[0], pieces.arrays[1], n_bits)  # type: ignore[index]
    wide, is_bad = refine_grid(records, wide, n_bits)
    if is_bad:
        check_used_vertices(points, records, triangles, view)
    return wide


def check_indices(triangles: NDArray[np.int32], triangles_given: ArrayLike, n_vertices: int) -> None:
    """Raise an error for the first triangle that names a vertex that does not exist."""
    row = _engine.first_bad_row(triangles, n_vertices)
    if row >= 0:
        raise bad_triangle(triangles_given, row, n_vertices)


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
