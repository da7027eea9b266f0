"""Points: discs and squares against the exact reference, on each instruction set, with any threads, in any window."""

from fractions import Fraction

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, assert_same_everywhere, kept, on

import topleft as tl
from topleft._core.raster.sampling import POSITIONS
from topleft.methods.reference.points import points

SIZE = (23, 17)
exact_points = kept(points)


def strewn(seed, n=60):
    """Points in and about the picture, some on edges and corners of pixels, with depths of which some are equal."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-4, 28, (n, 2))
    places[::3] = np.round(places[::3] * 2) / 2
    return np.column_stack([places, rng.integers(0, 4, n) / 4])


@pytest.mark.parametrize("shape", ["disc", "square"])
@pytest.mark.parametrize("sizes", [0.3, 1, 2, 3, 7.5, "each"])
@ON_EACH_ISA
def test_points_cover_what_the_exact_reference_covers(isa, sizes, shape):
    positions = strewn(1)
    own = np.random.default_rng(2).choice([0.1, 1, 2, 2.5, 6, 40], len(positions)) if sizes == "each" else sizes
    with on(isa):
        found = tl.points(positions, SIZE, point_size=own, shape=shape)
    ids, depth = exact_points(positions, SIZE, point_size=own, shape=shape)

    assert_same(found.point, ids)
    assert_same(found.depth, depth)


@pytest.mark.parametrize("bits", [0, 4, 16])
@pytest.mark.parametrize("shape", ["disc", "square"])
def test_points_are_exact_with_any_number_of_sub_pixel_bits(bits, shape):
    positions = strewn(3)
    found = tl.points(positions, SIZE, point_size=3, shape=shape, subpixel_bits=bits, depth_test="greater")
    ids, depth = exact_points(positions, SIZE, point_size=3, shape=shape, subpixel_bits=bits, depth_test="greater")

    assert_same(found.point, ids)
    assert_same(found.depth, depth)


@pytest.mark.parametrize("shape", ["disc", "square"])
def test_samples_see_points_as_the_exact_reference_does(shape):
    positions = strewn(4)
    found = tl.points(positions, SIZE, point_size=2.5, shape=shape, sampling="msaa4")
    for k, (x, y) in enumerate(POSITIONS[4]):
        at = Fraction(x, 16), Fraction(y, 16)
        ids, depth = exact_points(positions, SIZE, point_size=2.5, shape=shape, sample=at)
        assert_same(found.samples_triangle[..., k], ids)
        assert_same(found.samples_depth[..., k], depth)
        assert_same(found.sample(k).point, ids)


def test_points_have_the_same_bits_everywhere():
    rng = np.random.default_rng(5)
    positions, sizes = rng.uniform(-10, 210, (5000, 3)), rng.uniform(0.1, 9, 5000)

    def draw(size, **view):
        found = tl.points(positions, size, point_size=sizes, shape="disc", **view)
        return found.point, found.depth

    assert_same_everywhere(draw, (200, 150), [((5, 3), (9, 7)), ((90, 40), (110, 109))])


def test_a_point_too_small_for_any_sample_shows_in_its_pixel():
    for place in ((4.0, 3.0), (3.01, 2.99), (3.99, 2.5)):
        for shape in ("disc", "square"):
            assert np.argwhere(tl.points([place], (6, 5), point_size=1e-6, shape=shape).mask).tolist() == [[2, 3]]


def test_clip_space_points_stand_where_vertices_do():
    rng = np.random.default_rng(7)
    positions = rng.uniform(-1, 1, (200, 3))
    camera = tl.Camera.look_at((0.5, 0.4, 1.2), near=0.3, far=2)
    places = camera.project(positions, (64, 48))
    is_seen = (places[:, 2] >= 0) & (places[:, 2] <= 1) & ((positions @ camera.view[2, :3] + camera.view[2, 3]) < 0)
    found = tl.points(positions, (64, 48), transform=camera.clip_from_world((64, 48)), point_size=2)
    expected = tl.points(places[is_seen], (64, 48), point_size=2)

    assert_same(found.mask, expected.mask)
    assert_same(found.point[found.mask], np.flatnonzero(is_seen)[expected.point[expected.mask]].astype(np.int32))


def test_interpolate_spreads_the_values_of_points():
    found = tl.points([[0.5, 0.5], [2.5, 0.5]], (4, 1))

    assert found.interpolate([3, 5], background=-1).tolist() == [[3, -1, 5, -1]]
    assert found.interpolate([[3, 1], [5, 2]])[0, 2].tolist() == [5, 2]


def test_an_empty_picture_and_no_points_are_served():
    assert tl.points([[0, 0]], (0, 3)).point.shape == (3, 0)
    assert not tl.points(np.empty((0, 2)), (4, 3)).mask.any()


def test_a_point_far_out_is_not_drawn():
    assert not tl.points([[1e15, 0], [-1e30, 2]], (4, 3), point_size=100).mask.any()
    assert not tl.points([[1, 1]], (4, 3), origin=(2**45, 0)).mask.any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"point_size": 0}, "point_size must be finite and positive, got 0"),
        ({"point_size": [1, 2, 3]}, r"point_size must be one number or have shape \(2,\), got \(3,\)"),
        ({"point_size": 20000}, "point_size must be at most 16384 pixels, got 20000"),
        ({"shape": "star"}, "shape must be one of 'disc', 'square', got 'star'"),
        ({"cull": "back"}, "points have no side to cull"),
        ({"sampling": "area"}, "sampling 'area' gives no ids: points takes"),
    ],
)
def test_options_that_points_do_not_have_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        tl.points([[0, 0], [1, 1]], (4, 3), **options)


def test_positions_must_be_finite():
    with pytest.raises(ValueError, match=r"positions must be finite, got .* in row 1"):
        tl.points([[0, 0], [np.nan, 1]], (4, 3))


def test_points_have_no_corners():
    with pytest.raises(ValueError, match="points have no barycentric weights"):
        tl.points([[0, 0]], (4, 3)).barycentric()
    with pytest.raises(ValueError, match=r"values must have shape \(1, K\) or \(1,\), got \(2,\)"):
        tl.points([[0, 0]], (4, 3)).interpolate([1, 2])


IDS, DEPTH = np.zeros((1, 8, 10), np.int32), np.zeros((1, 8, 10), np.float32)


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ((IDS, DEPTH[:, :4], 5), ValueError, r"one shape \(S, H, W\), got \(1, 8, 10\) and \(1, 4, 10\)"),
        ((IDS[0], DEPTH[0], 5), ValueError, r"one shape \(S, H, W\), got \(8, 10\)"),
        ((IDS[:0], DEPTH[:0], 5), ValueError, r"one shape \(S, H, W\), got \(0, 8, 10\)"),
        ((IDS.astype(np.int64), DEPTH, 5), TypeError, "must be int32 and float32, got int64 and float32"),
        ((IDS, DEPTH.astype(float), 5), TypeError, "must be int32 and float32, got int32 and float64"),
        ((IDS, DEPTH, 1.5), TypeError, "n_points must be an integer"),
        ((IDS, DEPTH, -1), ValueError, "n_points must be at least 0, got -1"),
    ],
)
def test_planes_that_do_not_fit_are_told(given, error, message):
    with pytest.raises(error, match=message):
        tl.PointFragments(*given)
