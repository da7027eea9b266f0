"""Draws points as discs or squares: the nearest in every pixel.

Input: positions in pixels or clip space, sizes. Output: `PointFragments`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import as_array, as_count, as_point_size, as_real, as_vertices
from topleft._core.base.memory import FRESH, Memory, check_fits
from topleft._core.base.options import Sink, parse
from topleft._core.base.threads import count_threads, run_parts
from topleft._core.raster import choices
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.rasterize import refuse_many
from topleft._core.raster.sampling import sample_positions
from topleft._core.raster.snap import refine, snap, source_of
from topleft._core.raster.view import View, ViewOptions
from topleft.typing import DepthTestOption, PointShapeOption

MOST_POINT_PX = 1 << 14
"""The largest size of a point, pixels: squares of it in sub-pixels stay below 2**60."""

FARTHEST_WINDOW_FX = 1 << 40
"""A window that begins farther from pixel 0, in sub-pixels, shows no point: these lie within 2**30."""


class PointFragments(Fragments):
    """The visibility buffer of points that `points` returns, and `rasterize_mesh` of `Points`.

    Attributes
    ----------
    point : ndarray of int32, shape (H, W)
        Index of the point that shows in the pixel, -1 where there is none; equal to `triangle` and `id`.
    depth, mask, instance, samples_triangle, samples_depth
        As in `Fragments`, of points. The depth of a point is that of its centre.

    Examples
    --------
    >>> import topleft as tl
    >>> frags = tl.points([(1, 1, 0.5), (3, 1, 0.25)], (4, 2), point_size=2, shape="square")
    >>> frags.point.tolist()
    [[0, 0, 1, 1], [0, 0, 1, 1]]
    """

    _subject_kind = "Points"

    def __init__(self, ids: NDArray[np.int32], depth: NDArray[np.float32], n_points: int) -> None:
        """Take planes (S, H, W), a plane for each sample.

        Raises
        ------
        ValueError
            If ids and depth have other shapes or differ in theirs, or a number of points is negative.
        TypeError
            If ids are not int32, depth is not float32, or the number is none.
        """
        ids, depth = as_array("ids", ids), as_array("depth", depth)
        if ids.dtype != np.int32 or depth.dtype != np.float32:
            raise TypeError(f"ids and depth must be int32 and float32, got {ids.dtype} and {depth.dtype}")
        if ids.ndim != 3 or not len(ids) or ids.shape != depth.shape:
            raise ValueError(f"ids and depth must have one shape (S, H, W), got {ids.shape} and {depth.shape}")
        n_points = as_count("n_points", n_points, smallest=0)
        self.id, self._depth = ids[0], depth[0]
        self._n_vertices = self._n_triangles = n_points
        self._planes = ids, depth

    def __repr__(self) -> str:
        height, width = self.id.shape
        return f"PointFragments({width}x{height}, {self._n_vertices} points)"

    @property
    def point(self) -> NDArray[np.int32]:
        """Index of the point that shows in the pixel, int32 (H, W), -1 where there is none."""
        return self.id

    def _of_sample(self, k: int, ids: NDArray[Any], depth: NDArray[np.float32]) -> PointFragments:  # noqa: ARG002
        return PointFragments(ids[None], depth[None], self._n_vertices)

    def barycentric(self) -> NDArray[np.float32]:
        """Raise a `ValueError`: a point has no corners."""
        raise ValueError("points have no barycentric weights")

    def _checked(self, values: Any) -> NDArray[np.float32]:
        array, n = as_real("values", values).astype(np.float32), self._n_vertices
        if array.ndim not in (1, 2) or len(array) != n:
            raise ValueError(f"values must have shape ({n}, K) or ({n},), got {array.shape}")
        return array

    def _interpolated(self, array: NDArray[np.float32], background: float) -> NDArray[np.float32]:
        out = np.full((*self.id.shape, *array.shape[1:]), background, np.float32)
        out[self.mask] = array[self.id[self.mask]]
        return out

    def _derivatives(self, array: NDArray[np.float32]) -> NDArray[np.float32]:  # noqa: ARG002
        raise ValueError("derivatives are those of triangles: a point has one value")


def points(
    positions: ArrayLike,
    size: int | tuple[int, int],
    *,
    point_size: ArrayLike = 1.0,
    shape: PointShapeOption = "square",
    depth_test: DepthTestOption = "less",
    **view: Unpack[ViewOptions],
) -> PointFragments:
    """The visibility buffer of points: which of them shows in each pixel, and how deep.

    Parameters
    ----------
    positions : (N, 2), (N, 3) or (N, 4) array_like of real numbers
        As the vertices of `coverage`: pixels, pixels and depth, or clip space; with `transform` (N, 3) in object space.
    size : (width, height), pixels
    point_size : float or (N,) array_like
        Pixels, positive, at most 16384: the diameter of a disc, the side of a square.
    shape : {"square", "disc"}
        The shape that a point covers.
    depth_test : {"less", "greater"}
        Which point is kept: the one with the smaller depth, or with the larger one; at equal depth that of lower index.
    **view
        Options that all verbs share; see `coverage`. Points have no side to `cull` and no `method`.

    Returns
    -------
    PointFragments
        ``.point`` (H, W) int32 with -1 for none, ``.depth`` (H, W) float32 with +inf for none (-inf with "greater"),
        ``.mask`` (H, W) bool, ``.interpolate(values)``; with several samples a pixel also those of each.

    Raises
    ------
    ValueError
        If an array has another shape, a position is not finite, a size is none, or an option is unknown.
    TypeError
        If an array holds another kind of number.

    Notes
    -----
    Centres are snapped as vertices are, sizes rounded to whole sub-pixels; then all is exact. A sample belongs to a
    disc if it is no farther from the centre than half its size; to a square if it lies in it, or on its left or upper
    side; and to any point if it lies in the square of one pixel round its centre, left and upper side included. So
    each point in the picture shows in the pixel that it lies in, on the edge of two in the left or upper one, unless
    another hides it. All of a point has the depth of its centre. A point with its centre outside of the near or far
    plane is not drawn.

    Examples
    --------
    >>> import topleft as tl
    >>> tl.points([[1.5, 1.5], [4.5, 1.5]], (6, 3), point_size=[3, 1], shape="disc").point
    array([[ 0,  0,  0, -1, -1, -1],
           [ 0,  0,  0, -1,  1, -1],
           [ 0,  0,  0, -1, -1, -1]], dtype=int32)
    """
    checked = View.parse(size, view, why_snapped="the corners of points lie on the grid")
    refuse_many(checked, "points")
    checked.refuse_classic("points")
    if checked.cull:
        raise ValueError("points have no side to cull")
    kind, test = parse(PointShapeOption, "shape", shape), parse(DepthTestOption, "depth_test", depth_test)
    n_points = (as_array("positions", positions).shape or (0,))[0]
    sizes = as_point_size("point_size", point_size, n_points)
    largest = float(np.max(sizes, initial=0.0))
    if largest > MOST_POINT_PX:
        raise ValueError(f"point_size must be at most {MOST_POINT_PX} pixels, got {largest:g}")
    is_farthest = test == "greater"
    return draw_points(FRESH, positions, sizes, kind, checked, is_farthest=is_farthest)


def draw_points(
    memory: Memory,
    positions: ArrayLike,
    sizes_px: float | NDArray[np.float64],
    shape: PointShapeOption,
    view: View,
    *,
    is_farthest: bool = False,
) -> PointFragments:
    """Draw as `points` does, by checked options, in this memory; larger sizes are cut to the largest."""
    (width, height), n_samples = view.size, view.sampling.n_samples
    check_fits((n_samples, height, width), np.int32, np.float32)
    ids: NDArray[np.int32] = memory.empty("sample ids", (n_samples, height, width), np.int32)
    depth: NDArray[np.float32] = memory.empty("sample depth", (n_samples, height, width), np.float32)
    array = as_vertices(positions, has_transform=view.transform is not None)
    n_points = len(array)
    is_near = all(abs(at) << view.grid_bits < FARTHEST_WINDOW_FX for at in view.origin)
    frags = PointFragments(ids, depth, n_points)
    if 0 in view.size:
        return frags
    records = snap_points(memory, array, view) if is_near else np.empty(0, np.uint8)
    sizes = sizes_in_fx(sizes_px, view.grid_bits)
    samples: list[tuple[int, int]] = sample_positions(n_samples, view.grid_bits).tolist()
    sink = Sink.FARTHEST if is_farthest else Sink.NEAREST
    for at, own_ids, own_depth in zip(samples, ids, depth, strict=True):
        target = engine.Target(sink, own_ids, own_depth, None)
        draw_rows = rows_of(records, sizes, shape, at, target, view)
        run_parts(draw_rows, height, count_threads(view.threads, n_points))
    return frags


def rows_of(
    records: NDArray[np.uint8],
    sizes_fx: tuple[int, NDArray[np.int32] | None],
    shape: PointShapeOption,
    at: tuple[int, int],
    target: engine.Target,
    view: View,
) -> Callable[[int, int], None]:
    """Return a function that draws rows [first, end) of points, as one sample sees them."""
    is_disc = shape == "disc"

    def draw_rows(first: int, end: int) -> None:
        engine.draw_cloud(records, *sizes_fx, is_disc, *at, target, view.origin, view.grid_bits, first, end - first)

    return draw_rows


def snap_points(memory: Memory, array: NDArray[Any], view: View) -> NDArray[np.uint8]:
    """The records of all points; points that cannot be drawn are marked."""
    source, n = source_of(array, view), len(array)
    viewport = view.engine_viewport() if source.is_clip_space and n else None
    records, _, n_bad, _ = snap(
        memory, source, n, choices.threads_to_snap(view.threads, n, 0), view, viewport, with_depth=True
    )
    if n_bad:
        bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
        if len(bad):
            raise ValueError(f"positions must be finite, got {array[bad[0]].tolist()} in row {bad[0]}")
    if view.grid_bits > view.subpixel_bits:
        refine(records, None, None, view.grid_bits - view.subpixel_bits)
    return records


def sizes_in_fx(sizes_px: float | NDArray[np.float64], bits: int) -> tuple[int, NDArray[np.int32] | None]:
    """Sizes in whole sub-pixels: one size, or the size of each point."""
    fx = np.minimum(np.rint(np.asarray(sizes_px) * 2.0**bits), float(min(MOST_POINT_PX << bits, (1 << 30) - 1)))
    if fx.ndim == 0:
        return int(fx), None
    return 0, np.ascontiguousarray(fx, np.int32)
