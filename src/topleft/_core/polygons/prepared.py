"""Polygons ready to be drawn: points on the grid of sub-pixels, boxes, and whether rings meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.defaults import MAX_CROSSINGS
from topleft._core.base.memory import SCRATCH, Memory, times_that_fit
from topleft._core.base.threads import available_threads, run_parts
from topleft._core.polygons.rings import RingSet

#: The least points, and pixels, for each thread: with less, a thread is done before the next has started.
MIN_POINTS_PER_THREAD = 50_000
MIN_PIXELS_PER_THREAD = 1 << 20


@dataclass(frozen=True, slots=True)
class Frame:
    """The window to draw, and the grid that points snap to."""

    size: tuple[int, int]
    origin: tuple[int, int]
    subpixel_bits: int
    grid_bits: int  # of the grid that holds points and samples
    threads: int | None
    max_crossings: int = MAX_CROSSINGS


@dataclass(frozen=True, slots=True)
class Prepared:
    """Snapped polygons in a window."""

    compiled: engine.SnappedPolygons
    most_edges: int  # of a polygon
    n_points: int
    frame: Frame

    def __len__(self) -> int:
        return self.compiled.n_polygons

    @property
    def n_threads(self) -> int:
        """How many threads to draw with."""
        return threads_for(self.frame, self.n_points)

    def certify(self, *, assume_valid: bool) -> None:
        """Test which polygons have rings that do not meet, and compute the sign of each ring's area."""
        compiled, n = self.compiled, len(self)
        compiled.make_weights(self.frame.max_crossings)
        n_words = 0 if assume_valid else compiled.certify_words()

        def certify_part(first: int, end: int) -> None:
            compiled.certify(first, end, None if assume_valid else SCRATCH.scratch("chains", (n_words,), np.int64))

        run_parts(certify_part, n, min(self.n_threads, n))

    def pieces_shape(self) -> tuple[int, int, int] | None:
        """Return the most parts of edges of polygons with rings that meet, and the sides of their boxes."""
        is_simple = self.compiled.which_are_simple()
        if is_simple.all():
            return None
        boxes = self.compiled.boxes_px[~is_simple]
        width, height = (boxes[:, 2:].astype(np.int64) - boxes[:, :2]).max(axis=0).tolist()
        return max(4096, self.most_edges), height, width

    def threads_with_pieces(self) -> int:
        """Return how many threads to draw with: `n_threads`, or as many as have memory for `pieces_shape`."""
        shape = self.pieces_shape()
        if shape is None:
            return self.n_threads
        n_words = shape[0] * (engine.PIECE_BYTES // 8 + engine.PIECE_WORDS) + shape[1] + shape[2]
        return times_that_fit(self.n_threads, (n_words,), np.int64)

    def piece_scratch(self) -> engine.PieceScratch | None:
        """Return scratch for polygons with rings that meet, None where all rings stay apart."""
        shape = self.pieces_shape()
        return None if shape is None else engine.PieceScratch(*shape)


def threads_for(frame: Frame, n_points: int) -> int:
    """Return how many threads to draw a picture with."""
    if frame.threads is not None:
        return frame.threads
    n_worth = max(n_points // MIN_POINTS_PER_THREAD, frame.size[0] * frame.size[1] // MIN_PIXELS_PER_THREAD)
    return 1 if n_worth < 2 else min(available_threads(), n_worth)


def prepare(memory: Memory, rings: RingSet, frame: Frame, *, is_nonzero: bool) -> Prepared:
    """Snap the points of polygons and compute their boxes."""
    points, n = rings.points, len(rings.points)
    source = engine.Source(points)
    columns: npt.NDArray[np.int32] = memory.scratch("polygon points", (2, n + engine.POLYGON_PAD), np.int32)
    x, y = columns[0], columns[1]
    wide: npt.NDArray[np.int64] | None = None
    how = frame.subpixel_bits, frame.grid_bits, *frame.origin

    def snap(first: int, end: int) -> tuple[int, int]:
        return engine.snap_points(source, first, end, *how, x, y, wide)

    n_threads = threads_for(frame, n)
    if n:
        counts = run_parts(snap, n, n_threads)
        bad, n_wide = counts[0] if len(counts) == 1 else (sum(column) for column in zip(*counts, strict=True))
        if bad:
            raise bad_point(rings, x[:n], frame)
        if n_wide:
            wide = np.zeros((n, 2), np.int64)
            snap(0, n)
    sides = rings.rings, rings.polygons, *frame.size
    compiled = engine.SnappedPolygons(x, y, wide, *sides, frame.grid_bits, is_nonzero, rings.unions)
    most = max(run_parts(compiled.bound, len(rings), n_threads)) if len(rings) else 0
    return Prepared(compiled, most, n, frame)


def bad_point(rings: RingSet, x: npt.NDArray[np.int32], frame: Frame) -> ValueError:
    """Return the error for the first point that cannot be drawn."""
    limit = 2.0 ** (60 - frame.grid_bits)
    for i in np.flatnonzero(x == np.iinfo(np.int32).min).tolist():
        at = rings.points[i]
        if not np.isfinite(at).all():
            return ValueError(f"rings must be finite, got {at.tolist()} in point {i}")
        if not (abs(at.astype(float) - frame.origin) < limit).all():
            return ValueError(
                f"rings must lie within 2**{60 - frame.grid_bits} pixels of the window with {frame.grid_bits} "
                f"sub-pixel bits, got {at.tolist()} in point {i}"
            )
    return ValueError("rings must lie within the range of fixed point")
