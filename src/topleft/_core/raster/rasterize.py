"""Draws masks, counts and visibility buffers.

Each verb checks its arguments, snaps the mesh (read, transform, snap, clip), chooses a route and draws.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import as_number, as_out
from topleft._core.base.memory import Memory, MemoryOf, check_fits, empty
from topleft._core.base.options import Sampling, Sink, parse
from topleft._core.base.threads import run_parts
from topleft._core.raster import choices
from topleft._core.raster.choices import Drawing, Route
from topleft._core.raster.classic import draw_classic
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.sampling import (
    SamplePass,
    draw_planes,
    draw_sorted,
    lay_background,
    sample_positions,
    sum_areas,
)
from topleft._core.raster.snap import Snapped, snap_mesh, snap_to_cover
from topleft._core.raster.view import View
from topleft.typing import DepthTestOption


def draw(
    memory: Memory,
    snapped: Snapped,
    view: View,
    drawing: Drawing,
    pixels: NDArray[Any],
    *,
    depth: NDArray[np.float32] | None = None,
    earlier_wins: bool = False,
) -> None:
    """Clear contiguous buffers and draw a mesh into them, in bands of rows."""
    (width, height), (sink, n_parts, is_sliced, is_bounded, in_bands) = view.size, drawing
    if 0 in view.size:
        return
    covered: NDArray[np.uint64] | None = None
    samples: NDArray[np.int32] | None = None
    if sink is Sink.SAMPLES:
        samples = sample_positions(view.sampling.n_samples, view.grid_bits)
    if sink in (Sink.MASK, Sink.SAMPLES):
        n_samples = 1 if samples is None else len(samples)
        covered = memory.scratch("covered", engine.Target.covered_shape(height, width, n_samples), np.uint64)
    bounds = memory.empty("bounds", engine.Target.bounds_shape(height, width), np.float32) if is_bounded else None
    target = engine.Target(sink, pixels, depth, covered, samples, earlier_wins, bounds)

    def draw_rows(first: int, end: int) -> int:
        return snapped.mesh.draw(target, first, end - first)

    if in_bands:
        own = SamplePass(memory, snapped.mesh, sample_positions(1, view.grid_bits), n_parts)
        is_bad = draw_sorted(own, [target], (height, width))
    elif is_sliced and snapped.can_slice:
        is_bad = max(draw_sliced(memory, snapped, target, height, n_parts)) >= 0
    else:
        is_bad = max(run_parts(draw_rows, height, n_parts)) >= 0
    if is_bad:
        snapped.refuse()
    view.mark("draw")


def draw_sliced(memory: Memory, snapped: Snapped, target: engine.Target, height: int, n_parts: int) -> list[int]:
    """Draw as `draw` does: each thread a slice of the triangles into its rows, then what others list for it."""
    mesh, n = snapped.mesh, snapped.n_triangles
    rows = [height * i // n_parts for i in range(n_parts + 1)]
    starts = [n * i // n_parts for i in range(n_parts + 1)]
    room: NDArray[np.int32] = memory.scratch("outside", (n + 16 * n_parts,), np.int32)
    outside = [room[starts[i] + 16 * i : starts[i + 1] + 16 * (i + 1)] for i in range(n_parts)]

    def draw_own(i: int, _: int) -> tuple[int, int]:
        return mesh.draw_slice(target, rows[i], rows[i + 1] - rows[i], starts[i], outside[i])

    def draw_found(i: int, _: int) -> None:
        finders = [k for k in range(n_parts) if k != i]
        for k in finders:
            mesh.draw_listed(target, rows[i], rows[i + 1] - rows[i], outside[k][: counts[k]], k == finders[-1])

    bad_rows, counts = zip(*run_parts(draw_own, n_parts, n_parts), strict=True)
    if max(bad_rows) < 0:
        run_parts(draw_found, n_parts, n_parts)
    return list(bad_rows)


class Canvas(NamedTuple):
    """An array to return, and the contiguous aligned array that is drawn into: the returned array where that is both.

    As a context it returns both, and at its end both hold the picture.
    """

    result: NDArray[Any]
    canvas: NDArray[Any]

    @classmethod
    def of(
        cls, memory: Memory, name: str, out: object, shape: tuple[int, ...], dtype: type, *, keep: bool = False
    ) -> Canvas:
        """Take the caller's array, if there is one, or memory of that name.

        `keep`: pixels of `out` stay where nothing is drawn.
        """
        result = memory.empty(name, shape, dtype) if out is None else as_out("out", out, shape, dtype)
        canvas = result if result.flags.carray else empty(shape, dtype)
        if keep and canvas is not result:
            canvas[...] = result
        return cls(result, canvas)

    def __enter__(self) -> Canvas:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self.drawn()

    def drawn(self) -> NDArray[Any]:
        """Return the picture, where it is to be."""
        if self.canvas is not self.result:
            self.result[...] = self.canvas
        return self.result


def draw_area(
    memory: Memory, name: str, snapped: Snapped, view: View, out: object, *, is_clamped: bool
) -> NDArray[np.float32]:
    """Return the area that triangles cover of each pixel, or at most 1 of it."""
    with Canvas.of(memory, f"{name} area", out, view.size[::-1], np.float32) as (result, canvas):
        drawing = choices.drawing(view, snapped.work, Sink.COUNT)
        half_px = max(1, 1 << view.grid_bits >> 1) if drawing.in_bands else None
        if sum_areas(memory, snapped.mesh, canvas, drawing.n_threads, is_clamped=is_clamped, half_px=half_px):
            snapped.refuse()
    view.mark("draw")
    return result


def refuse_many(view: View, verb: str) -> None:
    """Raise an error for areas or squares where a pixel needs one triangle."""
    if view.sampling in (Sampling.AREA, Sampling.OUTER, Sampling.INNER):
        raise ValueError(f"sampling {str(view.sampling)!r} gives no ids: {verb} takes 'center' and 'msaa2' to 'msaa16'")


def draw_coverage(memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, out: object) -> NDArray[Any]:
    """Draw as `coverage` does, in this memory."""
    if view.classic:
        return draw_classic(view.classic, memory, vertices, triangles, view, Sink.MASK, out)
    snapped = snap_to_cover(memory, vertices, triangles, view, out=out)
    if view.sampling is Sampling.AREA:
        return draw_area(memory, "coverage", snapped, view, out, is_clamped=True)

    def draw_mask(sink: Sink, pixels: NDArray[Any], at: tuple[int, int]) -> None:
        seen = replace(snapped, mesh=snapped.mesh.at_sample(*at)) if any(at) else snapped
        draw(memory, seen, view, choices.drawing(view, snapped.work, sink), pixels)

    return draw_cover(memory, view, out, draw_mask)


def draw_cover(
    memory: Memory, view: View, out: object, draw_mask: Callable[[Sink, NDArray[Any], tuple[int, int]], None]
) -> NDArray[Any]:
    """Return where triangles are, or the share of samples that they cover.

    `draw_mask` draws them into pixels, as a sample sees them that lies so far from the centre, in sub-pixels.
    """
    n, shape = view.sampling.n_samples, view.size[::-1]
    name, dtype = ("coverage share", np.float32) if n > 1 else ("coverage", np.bool_)
    with Canvas.of(memory, name, out, shape, dtype) as (result, canvas):
        if n == 1 or not view.is_exact:
            draw_mask(Sink.SAMPLES if n > 1 else Sink.MASK, canvas, (0, 0))
        else:  # which the kernel of several samples does not draw
            canvas[...] = 0.0
            mask: NDArray[np.bool_] = memory.scratch("sample mask", shape, np.bool_)
            for x, y in sample_positions(n, view.grid_bits).tolist() if canvas.size else ():
                draw_mask(Sink.MASK, mask, (x, y))
                np.add(canvas, 1.0 / n, out=canvas, where=mask)  # exact: n is a power of two
    return result


def draw_sample_counts(memory: Memory, snapped: Snapped, view: View, out: object) -> NDArray[np.int32]:
    """Return how many triangles cover each sample, (H, W, S): a plane a sample in memory."""
    n, (width, height) = view.sampling.n_samples, view.size
    planes = memory.empty("sample counts", (n, height, width), np.int32)
    drawing = choices.drawing(view, snapped.work, Sink.COUNT)
    for plane, at in zip(planes, sample_positions(n, view.grid_bits).tolist(), strict=True):
        draw(memory, replace(snapped, mesh=snapped.mesh.at_sample(*at)), view, drawing, plane)
    counts = np.moveaxis(planes, 0, -1)
    if out is None:
        return counts
    result = as_out("out", out, counts.shape, np.int32)
    result[...] = counts
    return result


def draw_overdraw(memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, out: object) -> NDArray[Any]:
    """Draw as `overdraw` does, in this memory."""
    if view.classic:
        return draw_classic(view.classic, memory, vertices, triangles, view, Sink.COUNT, out)
    snapped = snap_to_cover(memory, vertices, triangles, view, out=out)
    if view.sampling is Sampling.AREA:
        return draw_area(memory, "overdraw", snapped, view, out, is_clamped=False)
    if view.sampling.n_samples > 1:
        return draw_sample_counts(memory, snapped, view, out)
    with Canvas.of(memory, "overdraw", out, view.size[::-1], np.int32) as (result, canvas):
        draw(memory, snapped, view, choices.drawing(view, snapped.work, Sink.COUNT), canvas)
    return result


def draw_all_samples(
    own: SamplePass,
    snapped: Snapped,
    view: View,
    sink: Sink,
    pixels: NDArray[np.int32],
    depth: NDArray[np.float32] | None,
    *,
    in_bands: bool = True,
) -> None:
    """Clear (S, H, W) planes and draw the view of each sample; `in_bands`: of all samples, where that can be."""
    if 0 in view.size:
        return
    is_near = in_bands and snapped.n_triangles > 0 and choices.can_slice(view)
    if draw_planes(own, sink, pixels, depth, is_near=is_near):
        snapped.refuse()
    view.mark("draw")


class FragmentOptions(NamedTuple):
    """The options of `rasterize` that other verbs do not have."""

    test: DepthTestOption | None
    background: float  # depth where nothing is
    ids_out: object
    depth_out: object

    @classmethod
    def parse(cls, depth_test: str | None, background_depth: float | None, out: object) -> FragmentOptions:
        """Check the options of a call."""
        test = None if depth_test is None else parse(DepthTestOption, "depth_test", depth_test)
        if background_depth is None:
            background_depth = -np.inf if test == "greater" else np.inf
        background_depth = as_number("background_depth", background_depth)
        try:
            ids_out, depth_out = (None, None) if out is None else cast("tuple[object, object]", out)
        except (TypeError, ValueError):
            raise TypeError(f"out must be a pair (triangle, depth) of arrays, got {type(out).__name__}") from None
        is_both = isinstance(ids_out, np.ndarray) and isinstance(depth_out, np.ndarray)
        if is_both and np.shares_memory(ids_out, depth_out):  # fields of a structured array share none
            raise ValueError("out must be two arrays, got a pair that shares memory")
        return cls(test, background_depth, ids_out, depth_out)


#: The options of a call that names none.
DEFAULT_OPTIONS = FragmentOptions("less", np.inf, None, None)


def fragment_options(
    view: View, depth_test: DepthTestOption | None, background_depth: float | None, out: object
) -> FragmentOptions:
    """Check the options of `rasterize`, and that the view can have ids."""
    view.refuse_classic("depth")
    refuse_many(view, "rasterize")
    return FragmentOptions.parse(depth_test, background_depth, out)


def draw_fragments(
    memory: Memory,
    vertices: ArrayLike,
    triangles: ArrayLike,
    view: View,
    options: FragmentOptions,
    names: NDArray[np.int32] | None = None,
) -> Fragments:
    """Draw as `rasterize` does, in this memory; with `names` triangle i is called names[i], which ascend."""
    if view.sampling.n_samples > 1:  # their attributes are computed from the snapped mesh on first access
        memory = MemoryOf(memory, "samples")
    out = None if options.ids_out is None and options.depth_out is None else (options.ids_out, options.depth_out)
    snapped = snap_mesh(memory, vertices, triangles, view, with_depth=True, out=out)
    if names is not None:
        snapped = replace(snapped, mesh=snapped.mesh.named(names))
    route, drawing = choices.route(view, snapped.work, options.test, wants_depth=options.depth_out is not None)
    return ROUTES[route](memory, snapped, view, options, drawing).drawn_from(vertices, triangles, view)


def draw_labels(memory: Memory, snapped: Snapped, view: View, options: FragmentOptions, drawing: Drawing) -> Fragments:
    """Draw ids of triangles at depth 0; depth is written on first access."""
    with Canvas.of(memory, "triangle", options.ids_out, view.size[::-1], np.int32) as (ids, canvas):
        draw(memory, snapped, view, drawing, canvas)
    return Fragments(ids, options.background, snapped.mesh, snapped.n_vertices, snapped.n_triangles)


def draw_flat(memory: Memory, snapped: Snapped, view: View, options: FragmentOptions, drawing: Drawing) -> Fragments:
    """Draw ids of triangles that all lie at one depth, and write it where they are."""
    earlier_wins = choices.earlier_wins(options.test, has_depth=snapped.work.has_depth)
    flat_depth = choices.first_depth(snapped.given.points, has_depth=snapped.work.has_depth)
    ids, depth = buffers_of(memory, view, options)
    draw(memory, snapped, view, drawing, ids.canvas, earlier_wins=earlier_wins)

    def set_depth(first: int, end: int) -> None:
        n_rows, background = end - first, options.background
        engine.set_flat_depth(ids.canvas, depth.canvas, first, n_rows, earlier_wins, flat_depth, background)

    run_parts(set_depth, view.size[1], drawing.n_threads)
    view.mark("depth")
    return Fragments(ids.drawn(), depth.drawn(), snapped.mesh, snapped.n_vertices, snapped.n_triangles)


def draw_depth(memory: Memory, snapped: Snapped, view: View, options: FragmentOptions, drawing: Drawing) -> Fragments:
    """Draw ids and depth, compared at each sample."""
    ids, depth = buffers_of(memory, view, options)
    draw(memory, snapped, view, drawing, ids.canvas, depth=depth.canvas)
    lay_background(ids.canvas, depth.canvas, drawing.sink, options.background)
    return Fragments(ids.drawn(), depth.drawn(), snapped.mesh, snapped.n_vertices, snapped.n_triangles)


def draw_samples(memory: Memory, snapped: Snapped, view: View, options: FragmentOptions, drawing: Drawing) -> Fragments:
    """Draw ids and depth of every sample."""
    (width, height), n = view.size, view.sampling.n_samples
    own = SamplePass(memory, snapped.mesh, sample_positions(n, view.grid_bits), drawing.n_threads)
    check_fits((n, height, width), np.int32, np.float32)
    ids, depth = planes_of(memory, view)
    draw_all_samples(own, snapped, view, drawing.sink, ids, depth)
    lay_background(ids, depth, drawing.sink, options.background)
    copy_planes(ids, depth, options)
    return Fragments.of_samples(ids, depth, own.meshes, snapped.n_vertices, snapped.n_triangles)


def planes_of(memory: Memory, view: View) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return ids and depth of all samples to draw into, (S, H, W)."""
    (width, height), n = view.size, view.sampling.n_samples
    shape = n, height, width
    return memory.empty("sample ids", shape, np.int32), memory.empty("sample depth", shape, np.float32)


def copy_planes(ids: NDArray[np.int32], depth: NDArray[np.float32], options: FragmentOptions) -> None:
    """Write planes of samples to the arrays that a caller gave, (H, W, S)."""
    for name, out, planes in (("triangle", options.ids_out, ids), ("depth", options.depth_out, depth)):
        if out is not None:
            n, height, width = planes.shape
            result = as_out(f"out {name}", out, (height, width, n), planes.dtype.type)
            result[...] = np.moveaxis(planes, 0, -1)


ROUTES = {Route.LABELS: draw_labels, Route.FLAT: draw_flat, Route.DEPTH: draw_depth, Route.SAMPLES: draw_samples}


def buffers_of(memory: Memory, view: View, options: FragmentOptions) -> tuple[Canvas, Canvas]:
    """Return where ids and depth are drawn."""
    shape = view.size[::-1]
    if options.ids_out is None and options.depth_out is None:
        check_fits(shape, np.int32, np.float32)
    ids = Canvas.of(memory, "triangle", options.ids_out, shape, np.int32)
    return ids, Canvas.of(memory, "depth", options.depth_out, shape, np.float32)
