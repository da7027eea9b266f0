"""Ctrl-C, and other signals, while a kernel draws: heard soon, and nothing that is kept is left in disorder."""

import os
import re
import signal
import threading
import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from comparing import assert_same

import topleft as tl

KERNELS = Path(__file__).parents[2] / "csrc/kernels.h"
SIZE = (2000, 2000)
LATEST_S = 0.5  # of the CPU, for each thread; it takes below 0.2, and by the clock longer on a machine that does others


def random_triangles(n, extent_px):
    rng = np.random.default_rng(1)
    corners = rng.random((n, 1, 2)) * SIZE + (rng.random((n, 3, 2)) - 0.5) * 2 * extent_px
    vertices = np.column_stack([corners.reshape(-1, 2), rng.random(3 * n)])
    return vertices, np.arange(3 * n, dtype=np.int32).reshape(-1, 3)


def chords(n):
    """A ring from side to side of the picture."""
    return np.random.default_rng(3).random((n, 2)) * SIZE


def crossing_star(n):
    """A ring whose corners are out of order: its pixels are resolved one by one."""
    rng = np.random.default_rng(4)
    angles = np.linspace(0, 2 * np.pi, n) + rng.normal(0, 5e-4, n)
    radius = 800 + rng.normal(0, 20, n)
    return 1000 + radius[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)


@cache
def large():
    return random_triangles(100_000, 2000)


@cache
def small():
    return random_triangles(1_000_000, 30)


def flat():
    return large()[0][:, :2], large()[1]


def many_polygons():
    return flat()[0], np.arange(0, 300_001, 3), np.arange(100_001)


@cache
def ball_fragments():
    return tl.rasterize_mesh(BALL, VIEWER, (3000, 3000))


@cache
def buffer():
    return tl.rasterize(large()[0], large()[1][:100], SIZE)


THIN = np.array([[-1e12, -1e12 - 9e3, 0.0], [1e12, 1e12 - 9e3, 0.5], [0.0, 9e3, 1.0]])
COLORS = np.random.default_rng(2).integers(0, 256, (100_000, 4), dtype=np.uint8)
BALL = tl.Mesh(*tl.scenes.shape("icosphere"))
VIEWER = tl.Camera.look_at((0, 0, 1.2), (0, 0, 0))
SHEET = tl.Mesh(np.eye(3), [[0, 1, 2]], uv=[[0, 0], [1, 0], [0, 1]])
LIGHTS = [tl.Light((x, 1, 3), kind="point", space="eye") for x in range(400)]

DRAWS = {
    "coverage by edges": lambda n: tl.coverage(*flat(), SIZE, method="edge", threads=n),
    "coverage by area": lambda n: tl.coverage(*flat(), SIZE, sampling="area", threads=n),
    "coverage of msaa16": lambda n: tl.coverage(*flat(), SIZE, sampling="msaa16", threads=n),
    "overdraw of squares": lambda n: tl.overdraw(*flat(), SIZE, sampling="outer", threads=n),
    "overdraw far away": lambda n: tl.overdraw(flat()[0] * 1e6 - 1e9, flat()[1], SIZE, threads=n),
    "rasterize": lambda n: tl.rasterize(*large(), SIZE, threads=n),
    "rasterize msaa16": lambda n: tl.rasterize(*small(), SIZE, sampling="msaa16", threads=n),
    "fill over": lambda n: tl.fill(*flat(), COLORS, SIZE, per="triangle", blend="over", threads=n),
    "fill over by area": lambda n: tl.fill(
        *flat(), COLORS, SIZE, per="triangle", blend="over", sampling="area", threads=n
    ),
    "peel": lambda n: tl.peel(*large(), SIZE, threads=n),
    "smooth wireframe": lambda n: tl.wireframe(*flat(), SIZE, antialias=True, threads=n),
    "mask of a polygon": lambda n: tl.polygons(chords(8_000_000), SIZE, threads=n),
    "mask of a nonzero polygon": lambda n: tl.polygons(chords(4_000_000), SIZE, rule="nonzero", threads=n),
    "labels of polygons": lambda n: tl.polygons(
        (chords(1_000_000), np.arange(0, 1_000_001, 100), np.arange(10_001)), SIZE, values="index", threads=n
    ),
    "area of a polygon": lambda n: tl.polygons(crossing_star(400_000), SIZE, sampling="area", threads=n),
    "table of a polygon": lambda n: tl.overlap([[crossing_star(400_000)]] * 2, SIZE, threads=n),
    "crossings in a pixel": lambda n: tl.polygons(chords(12_000) / 2000, 1, sampling="area", threads=n),
    "polygons": lambda n: tl.polygons(many_polygons(), SIZE, values="index", threads=n),
    "polygons by area": lambda n: tl.polygons(many_polygons(), SIZE, sampling="area", threads=n),
    "points": lambda n: tl.points(small()[0], SIZE, point_size=400.0, shape="disc", threads=n),
    "shade": lambda n: tl.shade(ball_fragments(), BALL, VIEWER, lights=LIGHTS, threads=n),
    "coverage exact": lambda n: tl.coverage(*flat(), SIZE, subpixel_bits="exact", threads=n),
    "overdraw exact far away": lambda n: tl.overdraw(
        flat()[0] * 1e6 - 1e9, flat()[1], SIZE, subpixel_bits="exact", threads=n
    ),
    "rasterize one exact triangle without a plane": lambda n: tl.rasterize(
        THIN, [[0, 1, 2]], (6000, 5000), subpixel_bits="exact", threads=n
    ),
    "rasterize exact msaa16": lambda n: tl.rasterize(
        *small(), SIZE, sampling="msaa16", subpixel_bits="exact", threads=n
    ),
    "table of triangles": lambda n: tl.overlap(flat()[0], SIZE, triangles=flat()[1], threads=n),
    "tiles": lambda n: list(tl.tiles(flat(), SIZE, kind="overdraw", sampling="area", window=500, threads=n)),
    "merge": lambda n: tl.merge([buffer()] * 3000, threads=n),
    "gradients of areas": lambda n: tl.area_vjp(*flat(), SIZE, np.ones(SIZE), threads=n),
    "bake from a source": lambda n: tl.bake(SHEET, "position", 2000, source=BALL, threads=n),
    "voxelize": lambda n: tl.voxelize(BALL, 600, samples=4, threads=n),
    "voxelize a surface": lambda n: tl.voxelize(large(), 300, solid=False, rule="touched", threads=n),
    "height_map": lambda n: tl.height_map(large(), tl.Grid(SIZE, (0, 2000, 0, 2000)), threads=n),
}


@pytest.fixture(scope="module", autouse=True)
def scenes_are_made():
    """Before the clock of an interrupt runs, and not while tests are collected."""
    for make in (large, small, ball_fragments, buffer):
        make()


#: The draw that is interrupted in a kernel.
HEARD = {
    "draw_mesh": "coverage by edges", "draw_area": "coverage by area", "blend": "fill over",
    "draw_lines": "smooth wireframe", "draw_cloud": "points", "shade": "shade", "mask_even_odd": "mask of a polygon",
    "mask_nonzero": "mask of a nonzero polygon", "label_polygons": "labels of polygons",
    "share_polygons": "polygons by area",
    "grad_area": "gradients of areas", "nearest_of_points": "bake from a source", "count_columns": "voxelize",
    "fill_columns": "voxelize", "touch_voxels": "voxelize a surface",
}  # fmt: skip

#: Kernels that ask, or end between two calls, with what bounds a call; no draw above takes its time in them.
IN_PARTS = {
    "asks between rows or triangles": "fill_large_shapes shade_samples certify_polygons cut_faces",
    "4 MB of bits": "expand_columns scatter_columns",
    "a band of 65,536 pixels": "grad_points grad_points_vjp grad_values grad_values_vjp grad_texels grad_texels_vjp "
    "grad_edges grad_picture",
    "a window of a raster, or the triangles of a block": "list_spans sort_spans count_windows take_corners",
    "some points of a surface": "find_reach",
    "an encoded block of rows": "encode_rows",
}

#: One pass over vertices, triangles, texels or pixels of a finished picture: it ends first (docs/guide/trust.md).
PASSES = """snap project clip mark_vertices place_on_curve sort_keys cut_clusters measure_clusters survey_clusters
find_shown first_bad first_bad_row narrow_triangles take_points count_classes bin list_bins set_inverse_w
drop_sides list_edges set_flat_depth find_instances list_column_runs
count_runs write_counts inverse_ws barycentric interpolate fill_slopes fill_texels levels_seen halve_rows paint_flat
paint_gouraud mean_flat mean_colors composite fill_points list_planes fill_planes shade_normals cut_out vertex_normals
face_normals find_turned face_angles list_corners find_creases sum_creases box_of_faces unit_vectors move_points
color_rows bend_vertices see_points find_bent split_bent group_rows build_tree set_feet snap_points bound_polygons
sort_polygons trust_polygons touch_texels average_texels find_in_rows find_gutter copy_texels add_taken grad_sides
mark_silhouettes write_levels"""


def test_each_kernel_is_interrupted_or_ends_first():
    kernels = re.findall(r"^TL_KERNEL\(\w+, (\w+),", KERNELS.read_text(), re.MULTILINE)
    assert sorted([*HEARD, *" ".join(IN_PARTS.values()).split(), *PASSES.split()]) == sorted(kernels)
    assert set(HEARD.values()) <= set(DRAWS)


def seconds_after_interrupt(draw):
    """Seconds of the CPU that a draw goes on after a Ctrl-C that comes while it lasts."""
    sent, has_ended = [], threading.Event()

    def interrupt():
        has_ended.wait(0.15)
        if not has_ended.is_set():  # a signal that comes later would end pytest
            sent.append(time.process_time())
            os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            draw()
        return time.process_time() - sent[0]
    finally:
        has_ended.set()
        thread.join()


@pytest.mark.parametrize(("name", "threads"), [(name, 1 + i % 2) for i, name in enumerate(DRAWS)])
def test_a_long_draw_interrupted_ends_soon(name, threads):
    assert seconds_after_interrupt(lambda: DRAWS[name](threads)) < threads * LATEST_S


@pytest.mark.parametrize("name", ["coverage by area", "fill over by area", "coverage of msaa16", "fill over"])
def test_a_draw_after_one_that_was_interrupted_is_right(name):
    few = flat()[0], flat()[1][:20]
    draws = {
        "coverage by area": lambda where: where.coverage(*few, sampling="area"),
        "coverage of msaa16": lambda where: where.coverage(*few, sampling="msaa16"),
        "fill over": lambda where: where.fill(*few, COLORS[:20], per="triangle", blend="over"),
        "fill over by area": lambda where: where.fill(*few, COLORS[:20], per="triangle", blend="over", sampling="area"),
    }
    kept = tl.Rasterizer(SIZE, threads=2)
    kept_draws = {
        "coverage by area": lambda: kept.coverage(*flat(), sampling="area"),
        "coverage of msaa16": lambda: kept.coverage(*flat(), sampling="msaa16"),
        "fill over": lambda: kept.fill(*flat(), COLORS, per="triangle", blend="over"),
        "fill over by area": lambda: kept.fill(*flat(), COLORS, per="triangle", blend="over", sampling="area"),
    }
    seconds_after_interrupt(kept_draws[name])
    assert_same(draws[name](kept), draws[name](tl.Rasterizer(SIZE, threads=1)))


def test_out_after_an_interrupt_changes_no_more():
    out = np.zeros(SIZE[::-1], np.int32)
    seconds_after_interrupt(lambda: tl.overdraw(*flat(), SIZE, threads=2, out=out))
    before = out.copy()
    time.sleep(0.3)
    assert_same(out, before)


def test_a_signal_whose_handler_draws_leaves_the_picture_as_it_is():
    few = np.ascontiguousarray(flat()[0][:1_500]), flat()[1][:500]
    others, n_drawn = random_triangles(300, 30), []
    began = time.perf_counter()
    expected = tl.overdraw(*few, SIZE, threads=1)
    soon = (time.perf_counter() - began) / 4

    def draw(*_):
        n_drawn.append(int(tl.coverage(*others, (100, 100), threads=1).sum()))

    before = signal.signal(signal.SIGALRM, draw)
    signal.setitimer(signal.ITIMER_REAL, soon)  # while the kernel draws
    try:
        got = tl.overdraw(*few, SIZE, threads=1)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert n_drawn
    assert_same(got, expected)


def test_an_error_of_a_signal_handler_is_raised_by_the_draw():
    def complain(*_):
        raise TimeoutError("too long")

    before = signal.signal(signal.SIGALRM, complain)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    try:
        with pytest.raises(TimeoutError, match="too long"):
            tl.overdraw(*flat(), SIZE, threads=1)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
