"""From the caller's arrays to snapped vertices and checked indices: transform, clip and snap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import _engine
from topleft._base.arrays import as_matrix, as_triangles, as_vertices, bad_triangle
from topleft._base.memory import Memory
from topleft._base.threads import run_parts
from topleft._raster import choices
from topleft._raster.sampling import refine_grid
from topleft._raster.view import View

__all__ = ["Snapped", "check_triangles", "snap_scene"]


@dataclass(frozen=True, slots=True)
class Snapped:
    """A scene after the snap: ready to be drawn into any buffer of the view's size."""

    scene: _engine.Scene
    triangles: ArrayLike
    corners: NDArray[np.int32]
    n_vertices: int
    n_triangles: int
    has_depth: bool
    inputs: choices.Inputs


def snap_scene(
    memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, *, with_depth: bool, out: object
) -> Snapped:
    """Take arrays through transform, clip and snap.

    Indices are checked where they are read anyway, while drawing; before that only when an error may not leave a trace
    in the caller's `out`, or when the vertices need a closer look.

    Raises
    ------
    ValueError
        If a vertex that a triangle uses is not finite, or lies beyond 2**62 sub-pixels.
    IndexError
        If a triangle names a vertex that does not exist, and indices are checked here.
    """
    points = as_vertices(vertices, has_transform=view.transform is not None)
    matrix = None if view.transform is None else as_matrix(view.transform, points.dtype)
    is_affine = choices.is_affine(matrix)
    source = _engine.Source(points, matrix, is_affine)
    corners, is_checked = index_triangles(memory, triangles, len(points), view)
    view.mark("input")
    n_triangles = len(corners)
    n = len(points) if n_triangles and 0 not in view.size else 0
    records = memory.empty("records", (n * _engine.VERTEX_BYTES,), np.uint8)
    engine_view = view.engine_view() if source.is_clip_space and n else None

    def snap(first: int, end: int) -> tuple[int, int, int]:
        if engine_view:
            return source.project(first, end, engine_view, records, wide)
        return source.snap(first, end, view.subpixel_bits, with_depth, records, wide)

    wide: NDArray[np.int64] | None = None
    bad = clipped = 0
    if n:
        n_parts = choices.threads_to_snap(view.threads, n, n_triangles)
        bad, n_wide, clipped = (sum(counts) for counts in zip(*run_parts(snap, n, n_parts), strict=True))
        if n_wide:
            wide = np.empty((n, 2), np.int64)
            snap(0, n)
    view.mark("vertices")
    if not is_checked and (out is not None or n == 0 or bad or clipped):
        check_triangles(triangles, corners, len(points))
    if bad:
        check_used_vertices(points, records, corners, view)
    pieces = None
    if engine_view is not None and choices.must_cut(clipped):
        pieces = _engine.Pieces(source, records, corners, engine_view)
    view.mark("clip")
    if view.grid_bits > view.subpixel_bits:
        wide = refine_scene(points, records, wide, corners, pieces, view)
    drawn = corners if n else corners[:0]
    how = (*view.origin, view.grid_bits, view.cull, view.method, view.test)
    if view.single_sided is not None and n:
        is_single, cull = view.single_sided
        seen = _engine.Scene(source, records, wide, drawn, pieces, *view.origin, view.grid_bits, cull, 0)
        drawn = without_sides(seen, drawn, is_single, view.threads)
    scene = _engine.Scene(source, records, wide, drawn, pieces, *how, engine_view)
    has_depth = source.is_clip_space or points.shape[1] == 3
    inputs = choices.Inputs(points, records, pieces, source.is_clip_space, is_affine)
    return Snapped(scene, triangles, corners, len(points), n_triangles, has_depth, inputs)


def without_sides(
    scene: _engine.Scene, corners: NDArray[np.int32], is_single: NDArray[np.uint8], threads: int | None
) -> NDArray[np.int32]:
    """Return triangles, those collapsed that are single-sided and turned the way that the scene culls."""
    left = np.empty_like(corners)
    n_parts = choices.threads_to_convert(threads, len(corners))
    run_parts(lambda first, end: scene.drop_sides(is_single, first, end, left), len(corners), n_parts)
    return left


def refine_scene(
    points: NDArray[Any],
    records: NDArray[np.uint8],
    wide: NDArray[np.int64] | None,
    corners: NDArray[np.int32],
    pieces: _engine.Pieces | None,
    view: View,
) -> NDArray[np.int64] | None:
    """Shift vertices and pieces to the grid of the samples; returns the table of wide vertices."""
    n_bits = view.grid_bits - view.subpixel_bits
    if pieces:
        refine_grid(pieces.arrays[0], pieces.arrays[1], n_bits)  # type: ignore[index]
    wide, is_bad = refine_grid(records, wide, n_bits)
    if is_bad:
        check_used_vertices(points, records, corners, view)
    return wide


def index_triangles(
    memory: Memory, triangles: ArrayLike, n_vertices: int, view: View
) -> tuple[NDArray[np.int32], bool]:
    """Return triangles as int32, and whether their indices have been checked on the way."""
    if view.plan is not None:
        return view.plan.corners_of(triangles, n_vertices), True
    indices = as_triangles(triangles)
    if indices.dtype == np.int32:
        return cast("NDArray[np.int32]", indices), False
    corners: NDArray[np.int32] = memory.empty("triangles", indices.shape, np.int32)
    wide = cast("NDArray[np.int64]", indices)

    def narrow(first: int, end: int) -> int:
        row = _engine.narrow_triangles(wide[first:end], n_vertices, corners[first:end])
        return first + row if row >= 0 else -1

    n = len(indices)
    rows = run_parts(narrow, n, choices.threads_to_convert(view.threads, n))
    for row in rows:
        if row >= 0:
            raise bad_triangle(triangles, row, n_vertices)
    return corners, True


def check_triangles(triangles: ArrayLike, corners: NDArray[np.int32], n_vertices: int) -> None:
    """Raise an error for the first triangle that names a vertex that does not exist."""
    row = _engine.first_bad_row(corners, n_vertices)
    if row >= 0:
        raise bad_triangle(triangles, row, n_vertices)


def check_used_vertices(
    points: NDArray[Any], records: NDArray[np.uint8], corners: NDArray[np.int32], view: View
) -> None:
    """Raise an error for the first vertex that cannot be drawn, if a triangle uses it."""
    i = _engine.first_bad(records, corners)
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
