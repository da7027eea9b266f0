"""The pipeline as named stages, and what each verb does with it.

arrays -> transform -> clip -> snap -> draw
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import _engine
from topleft.area import sum_areas
from topleft.arrays import as_background, as_colors, as_out
from topleft.classic import draw_classic, fill_classic, refuse_classic
from topleft.fragments import Fragments
from topleft.memory import Memory
from topleft.methods import METHODS
from topleft.models import DepthTest, Per, Sampling, Sink, parse
from topleft.resolve import parse_resolve, resolve_flat, resolve_gouraud
from topleft.sampling import draw_planes, sample_positions
from topleft.snapped import Snapped, check_triangles, snap_scene
from topleft.threads import count_threads, run_parts
from topleft.view import View

__all__ = ["draw_coverage", "draw_fill", "draw_fragments", "draw_overdraw"]


#: Triangles times threads. With fewer, threads that each set up every triangle are done before they have met twice.
MIN_TRIANGLES_TO_SHARE = 1_000_000


def draw(
    memory: Memory,
    snapped: Snapped,
    view: View,
    sink: Sink,
    pixels: NDArray[Any],
    *,
    depth: NDArray[np.float32] | None = None,
) -> None:
    """Clear contiguous buffers and draw a scene into them, in bands of rows."""
    width, height = view.size
    if 0 in view.size:
        return
    covered: NDArray[np.uint64] | None = None
    samples: NDArray[np.int32] | None = None
    if sink is Sink.SAMPLES:
        samples = sample_positions(view.sampling.n_samples, view.grid_bits)
    if sink in (Sink.MASK, Sink.SAMPLES):
        n_samples = 1 if samples is None else len(samples)
        covered = memory.empty("covered", _engine.Target.covered_shape(height, width, n_samples), np.uint64)
    target = _engine.Target(sink, pixels, depth, covered, samples)
    n_parts = min(height, count_threads(view.threads, snapped.n_triangles))

    def draw_rows(first: int, end: int) -> int:
        return snapped.scene.draw(target, first, end - first)

    if is_shared(snapped, view, n_parts, sink):
        bad_rows = draw_shared(memory, snapped, target, height, n_parts)
    else:
        bad_rows = run_parts(draw_rows, height, n_parts)
    if max(bad_rows) >= 0:
        check_triangles(snapped.triangles, snapped.corners, snapped.n_vertices)


def is_shared(snapped: Snapped, view: View, n_parts: int, sink: Sink) -> bool:
    """Tell whether each thread is to take a share of the triangles instead of setting up all of them."""
    pays = snapped.n_triangles * n_parts >= MIN_TRIANGLES_TO_SHARE
    fits_lanes = sink is not Sink.SAMPLES or view.grid_bits <= 8
    return n_parts > 1 and pays and fits_lanes and can_share(view)


def can_share(view: View) -> bool:
    """Tell whether a pass over a scene can draw some of its triangles."""
    width, height = view.size
    is_near = max(map(abs, view.origin)) < 2**29 and width * height < 2**31
    fits_lanes = not view.test or view.subpixel_bits <= 8
    return is_near and fits_lanes and view.method == METHODS["auto"].code


def draw_shared(memory: Memory, snapped: Snapped, target: _engine.Target, height: int, n_parts: int) -> list[int]:
    """Draw as `draw` does: each part a share of the triangles into its own rows, then what others have found for it."""
    scene, n = snapped.scene, snapped.n_triangles
    rows = [height * i // n_parts for i in range(n_parts + 1)]
    shares = [n * i // n_parts for i in range(n_parts + 1)]
    room: NDArray[np.int32] = memory.empty("others", (n + 16 * n_parts,), np.int32)
    others = [room[shares[i] + 16 * i : shares[i + 1] + 16 * (i + 1)] for i in range(n_parts)]

    def draw_own(i: int, _: int) -> tuple[int, int]:
        return scene.draw_share(target, rows[i], rows[i + 1] - rows[i], shares[i], others[i])

    def draw_found(i: int, _: int) -> None:
        finders = [k for k in range(n_parts) if k != i]
        for k in finders:
            scene.draw_listed(target, rows[i], rows[i + 1] - rows[i], others[k][: counts[k]], k == finders[-1])

    bad_rows, counts = zip(*run_parts(draw_own, n_parts, n_parts), strict=True)
    if max(bad_rows) < 0:
        run_parts(draw_found, n_parts, n_parts)
    return list(bad_rows)


def paint(
    memory: Memory,
    snapped: Snapped,
    view: View,
    colors: NDArray[Any],
    pixels: NDArray[Any],
    transfer: _engine.Transfer | None = None,
    *,
    is_flat: bool,
) -> None:
    """Draw coloured triangles over contiguous pixels: first which triangle shows in each, then its colour."""
    width, height = view.size
    if not (width and height and snapped.n_triangles):
        return
    if view.sampling.n_samples > 1:
        paint_samples(memory, snapped, view, colors, pixels, transfer, is_flat=is_flat)
        return
    labels = memory.empty("labels", (height, width), np.int32)
    draw(memory, snapped, view, Sink.LABEL, labels)
    palette, flat = _engine.as_bytes(colors), _engine.as_bytes(pixels)
    n_channels = 1 if colors.ndim == 1 else colors.shape[1]

    def paint_rows(first: int, end: int) -> None:
        snapped.scene.paint(labels, palette, flat, first, end - first, is_flat, colors.dtype == np.uint8, n_channels)

    run_parts(paint_rows, height, count_threads(view.threads, snapped.n_triangles))


def paint_samples(
    memory: Memory,
    snapped: Snapped,
    view: View,
    colors: NDArray[Any],
    pixels: NDArray[Any],
    transfer: _engine.Transfer | None,
    *,
    is_flat: bool,
) -> None:
    """Draw coloured triangles over contiguous pixels, each pixel the mean of its samples."""
    width, height = view.size
    positions = sample_positions(view.sampling.n_samples, view.grid_bits)
    labels: NDArray[np.int32] = memory.empty("sample labels", (len(positions), height, width), np.int32)
    draw_all_samples(memory, snapped, view, positions, Sink.LABEL, labels, None)
    n_threads = count_threads(view.threads, snapped.n_triangles)
    if is_flat:
        resolve_flat(labels, colors, pixels, transfer, n_threads)
        return
    scenes = [snapped.scene.seen_from(x, y) for x, y in positions.tolist()]
    resolve_gouraud(memory, scenes, labels, colors, pixels, transfer, n_threads)


@contextmanager
def canvas_of(
    memory: Memory, name: str, out: object, shape: tuple[int, ...], dtype: type, *, keep: bool = False
) -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
    """Give the array to return and a contiguous aligned one to draw into; afterwards both are the same picture.

    `keep`: what is in `out` shows through where nothing is drawn.
    """
    result = memory.empty(name, shape, dtype) if out is None else as_out("out", out, shape, dtype)
    canvas = result if result.flags.carray else np.empty(shape, dtype)
    if keep and canvas is not result:
        canvas[...] = result
    yield result, canvas
    if canvas is not result:
        result[...] = canvas


def draw_area(
    memory: Memory, name: str, snapped: Snapped, view: View, out: object, *, is_clamped: bool
) -> NDArray[np.float32]:
    """Return the area that triangles cover of each pixel, or at most 1 of it."""
    with canvas_of(memory, f"{name} area", out, view.size[::-1], np.float32) as (result, canvas):
        n_threads = count_threads(view.threads, snapped.n_triangles)
        if sum_areas(memory, snapped.scene, canvas, n_threads, is_clamped=is_clamped):
            check_triangles(snapped.triangles, snapped.corners, snapped.n_vertices)
    return result


def refuse_many(view: View, verb: str) -> None:
    """Raise an error where a pixel needs one triangle, and areas or squares are of many."""
    if view.sampling in (Sampling.AREA, Sampling.OUTER, Sampling.INNER):
        raise ValueError(f"sampling {str(view.sampling)!r} gives no ids: {verb} takes 'center' and 'msaa2' to 'msaa16'")


def draw_coverage(memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, out: object) -> NDArray[Any]:
    """`coverage`, on the memory given."""
    if view.classic:
        return draw_classic(view.classic, memory, vertices, triangles, view, Sink.MASK, out)
    snapped = snap_scene(memory, vertices, triangles, view, with_depth=False, out=out)
    if view.sampling is Sampling.AREA:
        return draw_area(memory, "coverage", snapped, view, out, is_clamped=True)
    if view.sampling.n_samples > 1:
        with canvas_of(memory, "coverage share", out, view.size[::-1], np.float32) as (result, canvas):
            draw(memory, snapped, view, Sink.SAMPLES, canvas)
        return result
    with canvas_of(memory, "coverage", out, view.size[::-1], np.bool_) as (result, canvas):
        draw(memory, snapped, view, Sink.MASK, canvas)
    return result


def draw_sample_counts(memory: Memory, snapped: Snapped, view: View, out: object) -> NDArray[np.int32]:
    """Return how many triangles cover each sample, (H, W, S): a plane a sample in memory."""
    n, (width, height) = view.sampling.n_samples, view.size
    planes = memory.empty("sample counts", (n, height, width), np.int32)
    for plane, at in zip(planes, sample_positions(n, view.grid_bits).tolist(), strict=True):
        seen = replace(snapped, scene=snapped.scene.seen_from(*at))
        draw(memory, seen, view, Sink.COUNT, plane)
    counts = np.moveaxis(planes, 0, -1)
    if out is None:
        return counts
    result = as_out("out", out, counts.shape, np.int32)
    result[...] = counts
    return result


def draw_overdraw(memory: Memory, vertices: ArrayLike, triangles: ArrayLike, view: View, out: object) -> NDArray[Any]:
    """`overdraw`, on the memory given."""
    if view.classic:
        return draw_classic(view.classic, memory, vertices, triangles, view, Sink.COUNT, out)
    snapped = snap_scene(memory, vertices, triangles, view, with_depth=False, out=out)
    if view.sampling is Sampling.AREA:
        return draw_area(memory, "overdraw", snapped, view, out, is_clamped=False)
    if view.sampling.n_samples > 1:
        return draw_sample_counts(memory, snapped, view, out)
    with canvas_of(memory, "overdraw", out, view.size[::-1], np.int32) as (result, canvas):
        draw(memory, snapped, view, Sink.COUNT, canvas)
    return result


def colors_are_flat(n_colors: int, snapped: Snapped, per: str) -> bool:
    """Tell whether a row of colours belongs to a triangle; otherwise it belongs to a vertex."""
    choice = parse(Per, "per", per)
    n_triangles = snapped.n_triangles
    fits_triangles, fits_vertices = n_colors == n_triangles, n_colors == snapped.n_vertices
    if choice is Per.AUTO and fits_triangles and fits_vertices and n_colors:
        raise ValueError(
            f"colors has {n_colors} rows, and there are as many triangles as vertices: "
            "say per='triangle' or per='vertex'"
        )
    if choice is not Per.VERTEX and fits_triangles:
        return True
    if choice is not Per.TRIANGLE and fits_vertices:
        return False
    wish = {
        Per.TRIANGLE: f"{n_triangles} rows, one per triangle",
        Per.VERTEX: f"{snapped.n_vertices} rows, one per vertex",
        Per.AUTO: f"{n_triangles} rows, one per triangle, or {snapped.n_vertices}, one per vertex",
    }[choice]
    raise ValueError(f"colors must have {wish}, got {n_colors}")


def draw_fill(
    memory: Memory,
    vertices: ArrayLike,
    triangles: ArrayLike,
    colors: ArrayLike,
    view: View,
    per: str,
    background: ArrayLike | None,
    out: object,
    resolve: str = "values",
) -> NDArray[Any]:
    """`fill`, on the memory given."""
    refuse_many(view, "fill")
    palette = as_colors(colors)
    transfer = parse_resolve(resolve, palette.dtype, 1 if palette.ndim == 1 else palette.shape[1])
    if view.classic:
        return fill_classic(view.classic, memory, vertices, triangles, palette, view, per, background, out)
    snapped = snap_scene(memory, vertices, triangles, view, with_depth=False, out=out)
    is_flat = colors_are_flat(len(palette), snapped, per)
    shape = (*view.size[::-1], *palette.shape[1:])
    ground = as_background(background, palette)
    with canvas_of(memory, "fill", out, shape, palette.dtype.type, keep=ground is None) as (result, canvas):
        if ground is not None:
            canvas[...] = ground
        elif out is None:
            canvas.fill(0)
        paint(memory, snapped, view, palette, canvas, transfer, is_flat=is_flat)
    return result


def draw_samples(
    memory: Memory,
    snapped: Snapped,
    view: View,
    sink: Sink,
    background_depth: float | None,
    ids_out: object,
    depth_out: object,
) -> Fragments:
    """Return the visibility buffer of every sample: a plane a sample in memory."""
    (width, height), n = view.size, view.sampling.n_samples
    positions = sample_positions(n, view.grid_bits)
    ids: NDArray[np.int32] = memory.empty("sample ids", (n, height, width), np.int32)
    depth: NDArray[np.float32] = memory.empty("sample depth", (n, height, width), np.float32)
    draw_all_samples(memory, snapped, view, positions, sink, ids, depth)
    if background_depth is not None:
        depth[ids < 0] = background_depth
    for name, out, planes in (("triangle", ids_out, ids), ("depth", depth_out, depth)):
        if out is not None:
            result = as_out(f"out {name}", out, (height, width, n), planes.dtype.type)
            result[...] = np.moveaxis(planes, 0, -1)
    scenes = [snapped.scene.seen_from(x, y) for x, y in positions.tolist()]
    return Fragments.of_samples(ids, depth, scenes, snapped.n_vertices, snapped.n_triangles)


def draw_all_samples(
    memory: Memory,
    snapped: Snapped,
    view: View,
    positions: NDArray[np.int32],
    sink: Sink,
    pixels: NDArray[np.int32],
    depth: NDArray[np.float32] | None,
) -> None:
    """Clear (S, H, W) planes and draw what each sample sees."""
    width, height = view.size
    if not (width and height):
        return
    n_threads = min(height, count_threads(view.threads, snapped.n_triangles))
    is_near = snapped.n_triangles > 0 and can_share(view)
    if draw_planes(
        memory, snapped.scene, snapped.n_triangles, positions, sink, pixels, depth, n_threads, is_near=is_near
    ):
        check_triangles(snapped.triangles, snapped.corners, snapped.n_vertices)


def draw_fragments(
    memory: Memory,
    vertices: ArrayLike,
    triangles: ArrayLike,
    view: View,
    depth_test: str | None,
    background_depth: float | None,
    out: object,
) -> Fragments:
    """`rasterize`, on the memory given."""
    refuse_classic(view, "depth")
    refuse_many(view, "rasterize")
    test = None if depth_test is None else parse(DepthTest, "depth_test", depth_test)
    if out is None:
        ids_out = depth_out = None
    else:
        try:
            ids_out, depth_out = out  # type: ignore[misc]
        except (TypeError, ValueError):
            raise TypeError(f"out must be a pair (triangle, depth) of arrays, got {type(out).__name__}") from None
    snapped = snap_scene(memory, vertices, triangles, view, with_depth=True, out=out)
    sink = {None: Sink.PAINT, DepthTest.LESS: Sink.NEAREST, DepthTest.GREATER: Sink.FARTHEST}[test]
    if not snapped.has_depth:
        sink = Sink.PAINT
        background_depth = -np.inf if test is DepthTest.GREATER and background_depth is None else background_depth
    if view.sampling.n_samples > 1:
        return draw_samples(memory, snapped, view, sink, background_depth, ids_out, depth_out)
    shape = view.size[::-1]
    with (
        canvas_of(memory, "triangle", ids_out, shape, np.int32) as (ids, ids_canvas),
        canvas_of(memory, "depth", depth_out, shape, np.float32) as (depth, depth_canvas),
    ):
        draw(memory, snapped, view, sink, ids_canvas, depth=depth_canvas)
        if background_depth is not None:
            depth_canvas[ids_canvas < 0] = background_depth
    return Fragments(ids, depth, snapped.scene, snapped.n_vertices, snapped.n_triangles)
