"""What must not change a picture: order, names and turn of vertices, windows, methods, instruction sets, threads."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same, assert_same_buffers, buffers
from engine_cases import ON_EACH_ISA, on, one_by_one, sharing
from hypothesis import given
from strategies import CLIP_SCENES, PIXEL_SCENES, clip_scenes, jittered_grid, pixel_scenes, soup, with_depth

import topleft as tl

MAKERS = pytest.mark.parametrize("make", (PIXEL_SCENES | CLIP_SCENES).values(), ids=PIXEL_SCENES | CLIP_SCENES)
PIXEL = pytest.mark.parametrize("make", PIXEL_SCENES.values(), ids=PIXEL_SCENES)


def scenes_of(make, n=3):
    """Seeded scenes; those in pixels get a depth, so that every verb has work to do."""
    for seed in range(n):
        rng = np.random.default_rng(1000 + seed)
        scene = make(rng)
        yield (with_depth(scene, rng, flat=bool(rng.integers(2))) if scene.vertices.shape[1] == 2 else scene), rng


# ---- triangles ------------------------------------------------------------------------------------------------------


@MAKERS
def test_permuted_triangles_keep_coverage_overdraw_and_depth(make):
    for scene, rng in scenes_of(make):
        order = rng.permutation(len(scene.triangles))
        permuted = replace(scene, triangles=scene.triangles[order])
        for verb in (tl.coverage, tl.overdraw):
            assert_same(verb(*permuted.arrays, **scene.view), verb(*scene.arrays, **scene.view))
        for depth_test in ("less", "greater"):
            got = tl.rasterize(*permuted.arrays, depth_test=depth_test, **scene.view)
            assert_same(got.depth, tl.rasterize(*scene.arrays, depth_test=depth_test, **scene.view).depth)


@PIXEL
def test_shift_by_whole_pixels_with_the_window_keeps_every_buffer(make):
    for scene, rng in scenes_of(make):
        if abs(scene.vertices[:, :2]).max() > 2**20:  # beyond, the shift itself would round
            continue
        shift = 2 * rng.integers(-5000, 5000, 2)  # even: with 0 bits an odd shift turns the ties of the snap round
        origin = np.add(scene.view.get("origin", (0, 0)), shift)
        moved = np.floor((scene.vertices[:, :2] + shift) * 2.0**18) / 2.0**18  # so that the shift back is exact
        there = np.hstack([moved, scene.vertices[:, 2:]])
        here = np.hstack([moved - shift, scene.vertices[:, 2:]])
        view = scene.view | {"origin": tuple(origin.tolist())}
        assert_same_buffers(buffers(replace(scene, vertices=there, view=view)), buffers(replace(scene, vertices=here)))


@pytest.mark.parametrize("far", [2**29 - 40, 2**30, 2**31 - 40, 2**40])
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_shift_beyond_the_pixels_that_int32_counts_keeps_coverage_and_colors(far, sampling):
    rng = np.random.default_rng(far)
    here, triangles = rng.integers(-640, 4736, (60, 2)) / 64, np.arange(60).reshape(-1, 3)
    colors = rng.integers(0, 256, (20, 4), np.uint8)
    view = {"sampling": sampling, "threads": 3}
    there = view | {"origin": (far, -far)}
    assert_same(
        tl.coverage(here + (far, -far), triangles, (64, 64), **there), tl.coverage(here, triangles, (64, 64), **view)
    )
    assert_same(
        tl.fill(here + (far, -far), triangles, colors, (64, 64), **there),
        tl.fill(here, triangles, colors, (64, 64), **view),
    )


# ---- windows --------------------------------------------------------------------------------------------------------


def check_windows(scene, rng):
    """Any window of the picture holds the crop of every buffer, background included."""
    x0, y0 = scene.view.get("origin", (0, 0))
    width, height = scene.size
    viewport = scene.view.get("viewport", scene.size)
    whole = buffers(scene, viewport=viewport)
    for _ in range(3):
        left, top = int(rng.integers(width)), int(rng.integers(height))
        size = int(rng.integers(1, width - left + 1)), int(rng.integers(1, height - top + 1))
        window = buffers(replace(scene, size=size), viewport=viewport, origin=(x0 + left, y0 + top))
        crop = {k: v[top : top + size[1], left : left + size[0]] for k, v in whole.items()}
        assert_same_buffers(window, crop)


@MAKERS
def test_window_equals_crop(make):
    for scene, rng in scenes_of(make):
        check_windows(scene, rng)


@given(pixel_scenes(n_components=3) | clip_scenes())
def test_window_of_any_scene_equals_crop(scene):
    check_windows(scene, np.random.default_rng(0))


def test_window_far_from_the_picture_is_empty():
    scene = jittered_grid(np.random.default_rng(0))
    for origin in [(2**40, 0), (-(2**40), 0), (0, 2**40), (0, -(2**40)), (2**52, -(2**52)), (28, 0), (0, -28)]:
        assert not tl.overdraw(*scene.arrays, origin=origin).any() or abs(origin[0] + origin[1]) == 28


# ---- the same call in other ways ------------------------------------------------------------------------------------


@MAKERS
def test_edge_and_scanline_give_every_buffer_alike(make):
    for scene, _ in scenes_of(make, 5):
        expected = buffers(scene, method="edge")
        assert_same_buffers(buffers(scene, method="scanline"), expected)
        assert_same_buffers(buffers(scene), expected)


@ON_EACH_ISA
@pytest.mark.parametrize("method", ["auto", "edge", "scanline"])
def test_least_triangle_covers_the_sample_in_its_corner(method, isa):
    with on(isa):
        drawn = tl.overdraw(np.array([[128, 128], [129, 128], [128, 129]]) / 256, [[0, 1, 2]], (1, 1), method=method)
    assert drawn.tolist() == [[1]]


@MAKERS
def test_threads_give_every_buffer_alike(make):
    for scene, _ in scenes_of(make):
        expected = buffers(scene, threads=1)
        for threads, is_sliced in ((2, False), (3, True), (8, False)):
            with sharing(is_sliced):
                assert_same_buffers(buffers(scene, threads=threads), expected)


@ON_EACH_ISA
def test_instruction_sets_give_every_buffer_alike(isa):
    for make in (PIXEL_SCENES | CLIP_SCENES).values():
        for scene, _ in scenes_of(make, 4):
            with on("scalar"):
                expected = buffers(scene)
            with on(isa):
                assert_same_buffers(buffers(scene), expected)


def test_rasterizer_used_for_many_scenes_equals_the_functions():
    todo = [replace(scene, size=(16, 12)) for make in CLIP_SCENES.values() for scene, _ in scenes_of(make, 3)]
    todo += [replace(scene, size=(16, 12)) for make in PIXEL_SCENES.values() for scene, _ in scenes_of(make, 3)]
    rasterizer = tl.Rasterizer((16, 12))
    for scene in todo:
        arrays = scene.arrays[:2]
        colors = np.arange(3 * len(scene.triangles), dtype=np.uint8).reshape(-1, 3)
        assert_same(rasterizer.coverage(*arrays, **scene.view), tl.coverage(*scene.arrays, **scene.view))
        assert_same(rasterizer.overdraw(*arrays, **scene.view), tl.overdraw(*scene.arrays, **scene.view))
        got = rasterizer.fill(*arrays, colors, per="triangle", **scene.view)
        assert_same(got, tl.fill(*arrays, colors, scene.size, per="triangle", **scene.view))
        assert_same(rasterizer.rasterize(*arrays, **scene.view).depth, tl.rasterize(*scene.arrays, **scene.view).depth)


# ---- arrays ---------------------------------------------------------------------------------------------------------


def layouts(array):
    """The same numbers in memory in other ways."""
    strided = np.zeros((2 * array.shape[0], 3 * array.shape[1]), array.dtype)
    strided[::2, ::3] = array
    backwards = np.ascontiguousarray(array[::-1])[::-1]
    read_only = array.copy()
    read_only.flags.writeable = False
    swapped = array.astype(array.dtype.newbyteorder())
    unaligned = np.frombuffer(b"x" + array.tobytes(), np.uint8)[1:].view(array.dtype).reshape(array.shape)
    return {
        "strided": strided[::2, ::3], "backwards": backwards, "read-only": read_only, "byte-swapped": swapped,
        "Fortran": np.asfortranarray(array), "unaligned": unaligned, "list": array.tolist(),
    }  # fmt: skip


@MAKERS
def test_any_layout_gives_the_same_picture_and_is_not_modified(make):
    scene, _ = next(scenes_of(make, 1))
    expected = tl.rasterize(*scene.arrays, **scene.view)
    corners = layouts(np.asarray(scene.triangles))
    for name, vertices in layouts(scene.vertices).items():
        if name == "list" and scene.vertices.dtype == np.float32:
            continue  # a list is float64, and so is its transform
        before = np.array(vertices, copy=True), np.array(corners[name], copy=True)
        got = tl.rasterize(vertices, corners[name], scene.size, **scene.view)
        assert_same(got.triangle, expected.triangle)
        assert_same(got.depth, expected.depth)
        assert (np.array_equal(vertices, before[0]), np.array_equal(corners[name], before[1])) == (True, True)


@one_by_one("dtype", ["f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", ">f4", ">i2", ">u8"])
@pytest.mark.parametrize("n_components", [2, 3, 4])
def test_any_vertex_dtype_gives_the_same_picture(dtype, n_components):
    rng = np.random.default_rng(2)
    xyzw = np.hstack([rng.integers(0, 40, (60, 2)), rng.integers(0, 3, (60, 1)), rng.integers(1, 5, (60, 1))])
    scene = soup(xyzw[:, :n_components].astype(float), (36, 33), viewport=(3, 5), near_clip=False, far_clip=False)
    expected = tl.rasterize(*scene.arrays, **scene.view)
    got = tl.rasterize(scene.vertices.astype(dtype), scene.triangles, scene.size, **scene.view)
    assert expected.mask.any()
    assert_same(got.triangle, expected.triangle)
    assert_same(got.depth, expected.depth)


@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", ">i4", ">u2"])
def test_any_triangle_dtype_gives_the_same_picture(dtype):
    scene = jittered_grid(np.random.default_rng(2))
    got = tl.rasterize(scene.vertices, scene.triangles.astype(dtype), scene.size).triangle
    assert_same(got, tl.rasterize(*scene.arrays).triangle)
