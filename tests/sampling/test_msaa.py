"""Several samples a pixel: each is the engine's own picture, seen from the sample."""

import copy

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, kept, mixed, on, one_by_one, sharing
from strategies import CLIP_SCENES, PIXEL_SCENES, Scene, few_bits, floor, on_centres, slivers, with_depth

import topleft as tl
from topleft._core.raster.sampling import POSITIONS
from topleft.methods.reference import sampling as ref

sample_coverage, sample_ids = kept(ref.sample_coverage), kept(ref.sample_ids)
COUNTS = (2, 4, 8, 16)
SCENES = {name: f for name, f in (PIXEL_SCENES | CLIP_SCENES).items() if name not in ("far_away", "far_integers")}


def draw(scene, n, verb=tl.coverage, **view):
    return verb(*scene.arrays, **(scene.view | {"sampling": f"msaa{n}"} | view))


def shares(covered):
    """Covered samples of each pixel, of all."""
    return covered.sum(-1, dtype=np.float32) / np.float32(covered.shape[-1])


def seen_from(scene, at):
    """The scene with its vertices moved, as the pixel centre sees it that the sample takes the place of."""
    moved = np.asarray(scene.vertices, np.float64).copy()
    moved[:, :2] -= np.array(at) / 16
    return Scene(moved, scene.triangles, scene.size, scene.view)


def test_positions_are_those_of_the_reference():
    assert ref.SAMPLE_POSITIONS == POSITIONS


# ---- coverage -------------------------------------------------------------------------------------------------------


@ON_EACH_ISA
@pytest.mark.parametrize("name", SCENES)
def test_coverage_is_the_share_of_samples_of_the_reference(isa, name):
    scene = SCENES[name](np.random.default_rng(21))
    if name == "guard_band":
        scene.view["subpixel_bits"] = 8
    expected = sample_coverage(*scene.arrays, 4, **scene.view)
    with on(isa):
        for method in ("auto", "edge"):
            assert_same(draw(scene, 4, method=method), shares(expected))
            assert_same(draw(scene, 4, tl.overdraw, method=method) > 0, expected)


@ON_EACH_ISA
@pytest.mark.parametrize("n", COUNTS)
@one_by_one("bits", [0, 1, 2, 3, 4, 5, 8, 9, 16])
def test_coverage_each_precision_is_that_of_the_reference(isa, n, bits):
    rng = np.random.default_rng(bits)
    with on(isa):
        for make in (few_bits, on_centres, slivers):
            scene = make(rng, 4)
            view = scene.view | {"subpixel_bits": bits, "origin": (2, 3)}
            assert_same(draw(scene, n, **view), shares(sample_coverage(*scene.arrays, n, **view)))


@ON_EACH_ISA
@pytest.mark.parametrize("bits", [4, 8, 16])
def test_coverage_all_sizes_is_that_of_centres_when_vertices_move(isa, bits):
    scene = mixed(np.random.default_rng(bits), 300, (190, 150), bits=bits, origin=(-40, 7))
    snapped = np.rint(scene.vertices[:, :2] * 2.0**bits) / 2.0**bits
    scene = Scene(snapped, scene.triangles, scene.size, scene.view)
    for n in COUNTS:
        with on(isa):
            expected = np.stack([tl.overdraw(*(at := seen_from(scene, p)).arrays, **at.view) for p in POSITIONS[n]], -1)
            for threads in THREADS:
                with sharing(threads > 2):
                    assert_same(draw(scene, n, threads=threads), shares(expected > 0))
            assert_same(draw(scene, n, tl.overdraw), expected)


def test_coverage_coarse_grid_beyond_the_range_of_the_samples_is_an_error():
    far = [[0, 0], [2.0**59, 0], [0, 2.0**59]]
    assert tl.coverage(far, [[0, 1, 2]], (1, 1), subpixel_bits=0).all()
    with pytest.raises(ValueError, match=r"within 2\*\*58 pixels of 0 with 4 sub-pixel bits"):
        tl.coverage(far, [[0, 1, 2]], (1, 1), subpixel_bits=0, sampling="msaa4")


@ON_EACH_ISA
def test_coverage_coarse_grid_takes_vertices_beyond_the_narrow_range(isa):
    far = [[-(2**29) + 3, -5], [2**29 - 1, 4], [7, 2**40]]
    with on(isa):
        got = tl.coverage(far, [[0, 1, 2]], (9, 9), subpixel_bits=0, sampling="msaa8")
    assert_same(got, shares(sample_coverage(far, [[0, 1, 2]], (9, 9), 8, subpixel_bits=0)))


# ---- ids and depth --------------------------------------------------------------------------------------------------


def assert_same_fragments(got, expected):
    assert_same(got.triangle, expected.triangle)
    assert_same(got.depth.view(np.int32), expected.depth.view(np.int32))


@ON_EACH_ISA
@pytest.mark.parametrize("name", SCENES)
def test_ids_are_those_of_the_reference(isa, name):
    rng = np.random.default_rng(22)
    scene = SCENES[name](rng)
    if name == "guard_band":
        scene.view["subpixel_bits"] = 8
    tests = (None,)
    if name in PIXEL_SCENES:
        scene, tests = with_depth(scene, rng, flat=True), (None, "less", "greater")
    for depth_test in tests:
        expected = sample_ids(*scene.arrays, 2, depth_test=depth_test, **scene.view)
        for method in ("auto", "scanline"):
            with on(isa):
                frags = draw(scene, 2, tl.rasterize, depth_test=depth_test, method=method)
            assert_same(frags.samples_triangle, expected)


@ON_EACH_ISA
@pytest.mark.parametrize("level", [True, False])
def test_fragments_all_sizes_are_those_of_centres_when_vertices_move(isa, level):
    scene = mixed(np.random.default_rng(9), 400, (190, 150), level=level, origin=(-40, 7))
    scene.vertices[:, :2] = np.rint(scene.vertices[:, :2] * 256) / 256
    with on(isa):
        for n, threads in zip(COUNTS, (1, *THREADS), strict=True):
            for depth_test in ("less", "greater", None):
                frags = draw(scene, n, tl.rasterize, depth_test=depth_test, threads=threads)
                for k, at in enumerate(POSITIONS[n]):
                    moved = seen_from(scene, at)
                    expected = tl.rasterize(*moved.arrays, depth_test=depth_test, **moved.view)
                    assert_same_fragments(frags.sample(k), expected)
                    assert_same(frags.samples_triangle[..., k], expected.triangle)
                    assert_same(frags.samples_depth[..., k], expected.depth)
                    assert_same(frags.sample(k).barycentric(), expected.barycentric())


@pytest.mark.parametrize("bits", [0, 2])
def test_ids_of_cut_triangles_on_a_coarse_grid_are_those_of_the_reference(bits):
    scene = floor(np.random.default_rng(6), 4, 16)
    scene.view["subpixel_bits"] = bits
    frags = draw(scene, 4, tl.rasterize)
    assert (frags.samples_triangle >= 0).any()
    assert_same(frags.samples_triangle, sample_ids(*scene.arrays, 4, depth_test="less", **scene.view))


def test_fragments_of_cut_triangles_keep_their_attributes():
    scene = floor(np.random.default_rng(6), 4, 16)
    frags = draw(scene, 8, tl.rasterize)
    for k in range(8):
        weights = frags.sample(k).barycentric()
        assert_same(weights.sum(-1) > 0.5, frags.samples_triangle[..., k] >= 0)


def test_fragments_are_those_of_the_first_sample():
    scene = mixed(np.random.default_rng(2), 50, (40, 30))
    frags = draw(scene, 4, tl.rasterize)
    assert_same_fragments(frags, frags.sample(0))
    assert_same(frags.interpolate(scene.vertices), frags.sample(0).interpolate(scene.vertices))
    center = tl.rasterize(*scene.arrays, **scene.view)
    assert_same(center.samples_triangle[..., 0], center.triangle)
    assert_same_fragments(center.sample(0), center)


def test_fragments_background_and_out():
    one = ([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]], (2, 1))
    out = np.empty((1, 2, 2), np.int32), np.empty((1, 2, 2), np.float32)
    tl.rasterize(*one, sampling="msaa2", background_depth=5, out=out)
    assert out[0].tolist() == [[[-1, 0], [-1, -1]]]
    assert out[1].tolist() == [[[5, 1], [5, 5]]]
    flat = tl.rasterize([[0, 0], [1, 0], [0, 1]], *one[1:], sampling="msaa2", depth_test="greater")
    assert flat.samples_depth.tolist() == [[[-np.inf, 0], [-np.inf, -np.inf]]]


def test_fragments_empty_scene_or_picture():
    nothing = tl.rasterize(np.empty((0, 3)), np.empty((0, 3), int), (3, 2), sampling="msaa4")
    assert (nothing.samples_triangle == -1).all()
    assert tl.rasterize([[0, 0]] * 3, [[0, 1, 2]], (0, 2), sampling="msaa4").samples_depth.shape == (2, 0, 4)


def test_index_outside_the_vertices_is_an_error():
    for verb in (tl.coverage, tl.overdraw, tl.rasterize):
        with pytest.raises(IndexError, match="row 1"):
            verb([[0, 0], [1, 0], [0, 1]], [[0, 1, 2], [0, 1, 3]], (4, 4), sampling="msaa4")


def test_samples_outlive_what_other_verbs_do_with_the_memory():
    scene = mixed(np.random.default_rng(2), 50, (40, 30))
    expected = draw(scene, 4, tl.rasterize)
    rasterizer = tl.Rasterizer(scene.size)
    frags = rasterizer.rasterize(scene.vertices, scene.triangles, sampling="msaa4")
    for verb in (rasterizer.coverage, rasterizer.overdraw, rasterizer.rasterize):
        verb(scene.vertices[::-1] * 3, scene.triangles[::-1])
    assert_same(frags.samples_triangle, expected.samples_triangle)
    assert_same(frags.samples_depth, expected.samples_depth)


def test_a_copy_keeps_its_samples():
    frags = draw(mixed(np.random.default_rng(2), 50, (40, 30)), 4, tl.rasterize)
    found = copy.copy(frags)
    assert_same(found.samples_triangle, frags.samples_triangle)
    assert_same(found.sample(2).depth, frags.sample(2).depth)


# ---- large shapes ---------------------------------------------------------------------------------------------------


@ON_EACH_ISA
@pytest.mark.parametrize("n", COUNTS)
@pytest.mark.parametrize("width", [611, 640])
def test_large_shapes_are_the_share_of_samples_and_stay_in_their_rows(isa, n, width):
    size = (width, 24)
    corners = np.array(
        [[1.5, 1, 0.5], [width + 9, 3, 0.5], [width - 20, 40, 0.5], [40, 9, 0.1], [90, 20, 0.1], [30, 22, 0.1]]
    )
    triangles = np.array([[0, 1, 2], [3, 4, 5]])
    room = np.full(width * 24 + 64, 7, np.float32)
    out = room[32:-32].reshape(24, width)
    with on(isa):
        tl.coverage(corners[:, :2], triangles, size, sampling=f"msaa{n}", out=out)
        seen = tl.rasterize(corners, triangles, size, sampling=f"msaa{n}").samples_triangle
    assert_same(out, shares(seen >= 0))
    assert (room[:32] == 7).all()
    assert (room[-32:] == 7).all()


@ON_EACH_ISA
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_colors_inside_of_large_shapes_are_those_of_each_sample(isa, channels):
    corners = np.array([[1.5, 1], [150, 3], [70, 40], [40, 9], [90, 20], [30, 22]])
    colors = np.array([[40, 80, 120, 255], [200, 100, 50, 255]], np.uint8)[:, :channels]
    ground = np.array([9, 9, 9, 255])[:channels]
    with on(isa):
        seen = tl.rasterize(corners, [[0, 1, 2], [3, 4, 5]], (140, 30), sampling="msaa4", depth_test=None)
        picture = tl.fill(corners, [[0, 1, 2], [3, 4, 5]], colors, (140, 30), sampling="msaa4", background=ground)
    of_samples = np.where((ids := seen.samples_triangle)[..., None] < 0, ground, colors[ids].astype(int))
    mean = of_samples.sum(2) / 4
    assert_same(picture.reshape(30, 140, channels), np.rint(mean).astype(np.uint8))
