"""Every verb against the exact reference: `==` for integers, a derived bound for floats."""

from math import gcd

import comparing
import numpy as np
import pytest
from engine_cases import one_by_one
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import (
    CLIP_SCENES,
    PIXEL_SCENES,
    clip_scenes,
    fan,
    jittered_grid,
    partner,
    pixel_scenes,
    soup,
    sphere_round_the_eye,
    with_depth,
)

import topleft as tl

PIXEL = pytest.mark.parametrize("make", PIXEL_SCENES.values(), ids=PIXEL_SCENES)
CLIP = pytest.mark.parametrize("make", CLIP_SCENES.values(), ids=CLIP_SCENES)
EITHER = pytest.mark.parametrize("make", (PIXEL_SCENES | CLIP_SCENES).values(), ids=PIXEL_SCENES | CLIP_SCENES)
DEPTH_TEST = pytest.mark.parametrize("depth_test", ["less", "greater", None])


def scenes(make, n):
    """n scenes of a generator, each with the random numbers that it was made from."""
    for seed in range(n):
        rng = np.random.default_rng(seed)
        yield make(rng), rng


# ---- coverage and overdraw ------------------------------------------------------------------------------------------


@EITHER
def test_overdraw_adversarial_scene_equals_reference(make):
    for scene, _ in scenes(make, 6):
        comparing.check_overdraw(scene)


@settings(max_examples=100)
@given(pixel_scenes() | clip_scenes())
def test_overdraw_any_scene_equals_reference(scene):
    comparing.check_overdraw(scene)


@pytest.mark.parametrize("dtype", [np.int64, np.float64, np.float32])
@pytest.mark.parametrize("bits", [0, 8, 16])
def test_overdraw_at_the_border_of_narrow_vertices_equals_reference(dtype, bits):
    """Vertices below 2**30 sub-pixels, at it, and up to twice as far take different ways."""
    narrow = 2.0 ** (30 - bits)
    for far in (
        narrow - 128,
        narrow - 1,
        narrow,
        narrow + 1,
        narrow + 128,
        2 * narrow - 128,
        2 * narrow,
        2 * narrow + 256,
    ):
        xy = np.array(
            [[-far, 1 - far], [far, 7 + far], [-far, far], [7 - far, -far], [far, 7 - far], [far, -far]], dtype
        )
        comparing.check_overdraw(soup(xy, (12, 12), subpixel_bits=bits))


@one_by_one("bits", range(17))
def test_overdraw_each_number_of_bits_equals_reference(bits):
    xy = np.random.default_rng(bits).uniform(-6, 18, (90, 2))
    comparing.check_overdraw(soup(xy, (12, 12), subpixel_bits=bits))


def test_overdraw_meshes_that_fill_the_frame_cover_each_sample_once():
    for make in (jittered_grid, sphere_round_the_eye):
        for scene, _ in scenes(make, 8):
            assert (comparing.check_overdraw(scene) == 1).all()


@pytest.mark.parametrize("make", [jittered_grid, fan], ids=lambda f: f.__name__)
def test_overdraw_large_picture_equals_int64_reference(make):
    scene = make(np.random.default_rng(5), 200 if make is fan else 30, 700)
    counts, ids = comparing.overdraw_int64(scene)
    for method in comparing.METHODS:
        comparing.assert_exact(tl.overdraw(*scene.arrays, method=method), counts)
        comparing.assert_exact(tl.rasterize(*scene.arrays, method=method).triangle, ids)


def test_overdraw_large_soups_equal_int64_reference():
    for seed, reach in enumerate([0.01, 0.1, 1.0, 8.0]):
        rng = np.random.default_rng(seed)
        n = int(40 / max(reach, 0.1))
        xy = rng.uniform(0, 900, (n, 1, 2)) + rng.uniform(-900, 900, (n, 3, 2)) * reach
        scene = soup(xy.reshape(-1, 2), (900, 700), origin=(13, -5))
        counts, ids = comparing.overdraw_int64(scene)
        for method in comparing.METHODS:
            comparing.assert_exact(tl.overdraw(*scene.arrays, method=method, **scene.view), counts)
            comparing.assert_exact(tl.rasterize(*scene.arrays, method=method, **scene.view).triangle, ids)


def test_reference_and_int64_reference_agree():
    for scene, _ in scenes(jittered_grid, 5):
        counts, ids = comparing.overdraw_int64(scene)
        assert (counts == comparing.ref.overdraw(*scene.arrays)).all()
        assert (ids == comparing.ref.ids(*scene.arrays)).all()


# ---- ids and depth --------------------------------------------------------------------------------------------------


@PIXEL
def test_rasterize_painters_order_equals_reference(make):
    for scene, _ in scenes(make, 3):
        comparing.check_painters_ids(scene)


@DEPTH_TEST
@PIXEL
def test_rasterize_flat_depths_with_ties_equal_reference(make, depth_test):
    for scene, rng in scenes(make, 2):
        comparing.check_ids(with_depth(scene, rng, flat=True), depth_test)


@PIXEL
def test_rasterize_sloping_depths_within_bound(make):
    for scene, rng in scenes(make, 2):
        comparing.check_fragments(with_depth(scene, rng))


def far_slivers(rng, n=30, side=20):
    """Triangles of three halves of a square sub-pixel round a pixel's centre, 2**36 pixels long: E beyond 2**53."""
    corners = []
    for _ in range(n):
        a, b = (int(rng.integers(-(2**bits), 2**bits)) | 1 for bits in (44, 12))
        b += next(k for k in range(0, 1000, 2) if gcd(a, b + k) == 1)
        u, v = np.array([a, b]), np.array(partner(a, b))
        corners.append(rng.integers(0, side, 2) * 256 + 128 + np.array([u, v, -u - v])[:, :: rng.choice([1, -1])])
    return soup(np.concatenate(corners) / 256, (side, side))


def test_rasterize_far_slivers_within_bound():
    for scene, rng in scenes(far_slivers, 4):
        comparing.check_fragments(with_depth(scene, rng))


@CLIP
def test_rasterize_clip_space_depths_within_bound(make):
    for scene, _ in scenes(make, 3):
        comparing.check_fragments(scene)


@given(pixel_scenes(n_components=3) | clip_scenes())
def test_rasterize_any_scene_within_bound(scene):
    comparing.check_fragments(scene)


# ---- attributes -----------------------------------------------------------------------------------------------------


@EITHER
def test_interpolate_within_bound(make):
    for scene, rng in scenes(make, 2):
        comparing.check_attributes(scene, rng.uniform(-100, 100, (len(scene.vertices), 2)).astype(np.float32))


@given(pixel_scenes() | clip_scenes(), st.integers(0, 2**32 - 1))
def test_interpolate_any_scene_within_bound(scene, seed):
    values = np.random.default_rng(seed).uniform(-1, 1, (len(scene.vertices), 1)).astype(np.float32)
    comparing.check_attributes(scene, values)


# ---- fill -----------------------------------------------------------------------------------------------------------


@EITHER
def test_fill_flat_equals_reference(make):
    for scene, rng in scenes(make, 2):
        colors = rng.integers(0, 256, (len(scene.triangles), rng.integers(1, 5)), np.uint8)
        comparing.check_fill_uint8(scene, colors, "triangle")


@PIXEL
def test_fill_gouraud_uint8_equals_reference(make):
    for scene, rng in scenes(make, 2):
        colors = rng.integers(0, 256, (len(scene.vertices), rng.integers(1, 5)), np.uint8)
        comparing.check_fill_uint8(scene, colors, "vertex")


@pytest.mark.parametrize("exponent", [2, 8, 20, 24, 30, 45, 51])
def test_fill_gouraud_uint8_ties_of_large_triangles_equal_reference(exponent):
    rng = np.random.default_rng(exponent)
    for shift in (0.5, 3.5, 3.5 - 1 / 256, 3.5 + 1 / 256):
        reach = int(rng.integers(2**exponent, 2 ** (exponent + 1)))
        corner = reach * np.array([[-1, -1], [1, -1], [-1, 3]])  # values change with x alone, and tie in its middle
        first, second = rng.integers(0, 256, (2, 4))
        colors = np.array([first, second | 1 ^ first & 1, first], np.uint8)
        comparing.check_fill_uint8(soup(corner + [shift, 0], (8, 3)), colors, "vertex")


def test_fill_gouraud_uint8_ties_that_float64_misses_equal_reference():
    rng = np.random.default_rng(0)
    for tenths in (1, 3, 5, 7, 9) * 20:  # of 255: halves
        unit = int(rng.integers(1, 2**20)) / 256
        corner = unit * np.array([[-tenths, -1], [10 - tenths, -1], [-tenths, 20]])
        scene = soup(corner + 0.5, (1, 1))
        comparing.check_fill_uint8(scene, np.array([[0], [255], [0]], np.uint8), "vertex")


@given(pixel_scenes(), st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_fill_any_gouraud_uint8_equals_reference(scene, seed, n_channels):
    rng = np.random.default_rng(seed)
    colors = rng.choice([0, 1, 2, 127, 128, 254, 255], (len(scene.vertices), n_channels)).astype(np.uint8)
    comparing.check_fill_uint8(scene, colors, "vertex")


@EITHER
def test_fill_gouraud_float32_within_bound(make):
    for scene, rng in scenes(make, 2):
        comparing.check_fill_float32(scene, rng.uniform(-3, 3, (len(scene.vertices), 3)).astype(np.float32))


@CLIP
def test_fill_gouraud_uint8_clip_space_but_for_ties_equals_reference(make):
    for scene, rng in scenes(make, 2):
        comparing.check_fill_uint8_cut(scene, rng.integers(0, 256, (len(scene.vertices), 3), np.uint8))


# ---- nothing to see -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("w", [-1.0, -1e-300, 0.0, 1e-300])
def test_rasterize_all_behind_the_eye_is_nothing(w):
    rng = np.random.default_rng(0)
    positions = rng.uniform(-1, 1, (60, 4)) * [1, 1, 1, 0] + [0, 0, 0, w]
    scene = soup(positions, (9, 7), near_clip=False, far_clip=False)
    assert not comparing.check_overdraw(scene).any()
    assert (tl.rasterize(*scene.arrays, **scene.view).triangle == -1).all()
