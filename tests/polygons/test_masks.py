"""Masks, labels and squares of polygons are those of the exact reference, on each instruction set."""

from fractions import Fraction

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, kept, on
from hypothesis import given, settings
from polygon_cases import SIZE, star, wild_polygon, wild_seeds

import topleft as tl
from topleft._core.base.options import Sampling
from topleft._core.raster.sampling import POSITIONS
from topleft.methods.reference import polygons as ref

polygon_areas = kept(ref.polygon_areas)
polygon_mask = kept(ref.polygon_mask)

RULES = ["evenodd", "nonzero"]
ON_EACH_RULE = pytest.mark.parametrize("rule", RULES)


def squares(polygon, size, rule, **view):
    areas = polygon_areas(polygon, size, rule, **view)
    return {
        "outer": np.array([[a > 0 for a in row] for row in areas]),
        "inner": np.array([[a == 1 for a in row] for row in areas]),
    }


@ON_EACH_ISA
@ON_EACH_RULE
@given(wild_seeds)
def test_mask_of_wild_rings_equals_reference(isa, rule, seed):
    polygon = wild_polygon(np.random.default_rng(seed))
    with on(isa):
        assert (tl.polygons(polygon, SIZE, rule=rule) == polygon_mask(polygon, SIZE, rule)).all()


@ON_EACH_RULE
@settings(max_examples=60)
@given(wild_seeds)
def test_squares_of_wild_rings_equal_reference(rule, seed):
    polygon = wild_polygon(np.random.default_rng(seed))
    exact = squares(polygon, SIZE, rule)  # slow: once for all sets
    for isa in tl.build_info()["isa_available"]:
        with on(isa):
            for sampling, expected in exact.items():
                assert (tl.polygons(polygon, SIZE, rule=rule, sampling=sampling) == expected).all(), (isa, sampling)


@ON_EACH_ISA
@pytest.mark.parametrize("left", [0, 1, 63, 64, 65])
@pytest.mark.parametrize("right", [63, 64, 65, 128, 129])
def test_squares_of_runs_that_end_near_whole_words_equal_reference(isa, left, right):
    """Bits of a row stand in words of 64."""
    size = 131, 3
    for ring in ([(left, 0), (right, 0), (right, 3)], [(left, 0), (right, 1), (right, 2), (left, 2)]):
        if left < right:
            exact = squares([np.array(ring, float)], size, "evenodd")
            with on(isa):
                for sampling, expected in exact.items():
                    assert (tl.polygons(ring, size, sampling=sampling) == expected).all()


@ON_EACH_ISA
@ON_EACH_RULE
@settings(max_examples=40)
@given(wild_seeds)
def test_labels_of_wild_polygons_are_the_last_masks(isa, rule, seed):
    rng = np.random.default_rng(seed)
    drawn = [wild_polygon(rng) for _ in range(5)]
    expected = np.full(SIZE[::-1], -1)
    for i, polygon in enumerate(drawn):
        expected[polygon_mask(polygon, SIZE, rule)] = i
    with on(isa):
        assert (tl.polygons(drawn, SIZE, rule=rule, values="index") == expected).all()
        assert (tl.polygons(drawn, SIZE, rule=rule) == (expected >= 0)).all()


@ON_EACH_ISA
@pytest.mark.parametrize("bits", [0, 1, 3, 12, 16])
def test_mask_on_each_grid_equals_reference(isa, bits):
    for seed in range(25):
        polygon = wild_polygon(np.random.default_rng(seed), SIZE, min(bits, 10))
        for rule in RULES:
            exact = polygon_mask(polygon, SIZE, rule, subpixel_bits=bits)
            with on(isa):
                assert (tl.polygons(polygon, SIZE, rule=rule, subpixel_bits=bits) == exact).all()


@ON_EACH_ISA
@pytest.mark.parametrize("reach", [1e4, 3e5, 1e9, 1e15])
def test_rings_that_reach_far_out_equal_reference(isa, reach):
    rng = np.random.default_rng(4)
    for _ in range(20):
        ring = rng.uniform(-1, 1, (5, 2)) * reach
        ring[0] = rng.uniform(0, 5, 2)
        for rule in RULES:
            exact = polygon_mask([ring], SIZE, rule)
            touched = squares([ring], SIZE, rule)
            with on(isa):
                assert (tl.polygons(ring, SIZE, rule=rule) == exact).all()
                for sampling, expected in touched.items():
                    assert (tl.polygons(ring, SIZE, rule=rule, sampling=sampling) == expected).all()


def test_picture_far_from_the_origin_is_that_at_the_origin():
    for seed in range(20):
        polygon = wild_polygon(np.random.default_rng(seed))
        far = [ring + [1e15, -1e15] for ring in polygon]  # multiples of 1/8 alone survive
        near = [ring - [1e15, -1e15] for ring in far]
        origin = (10**15, -(10**15))
        for sampling in ("center", "msaa4", "area", "outer", "inner"):
            expected = tl.polygons(near, SIZE, sampling=sampling, subpixel_bits=3)
            assert (tl.polygons(far, SIZE, sampling=sampling, subpixel_bits=3, origin=origin) == expected).all()


@ON_EACH_ISA
@pytest.mark.parametrize("n_samples", [2, 4, 8, 16])
def test_several_samples_are_the_share_of_masks(isa, n_samples):
    for seed in range(8):
        polygon = wild_polygon(np.random.default_rng(seed))
        masks = [polygon_mask(polygon, SIZE, sample=at) for at in POSITIONS[n_samples]]
        with on(isa):
            share = tl.polygons(polygon, SIZE, sampling=f"msaa{n_samples}")
        assert share.dtype == np.float32
        assert (share == np.mean(masks, axis=0, dtype=np.float32)).all()


@pytest.mark.parametrize("sampling", [str(s) for s in Sampling])
@ON_EACH_RULE
def test_window_equals_crop(sampling, rule):
    rng = np.random.default_rng(2)
    drawn = [wild_polygon(rng, (40, 30)) for _ in range(6)]
    whole = tl.polygons(drawn, (40, 30), sampling=sampling, rule=rule)
    for x, y in [(0, 0), (7, 3), (21, 19), (-5, -4)]:
        window = tl.polygons(drawn, (13, 11), sampling=sampling, rule=rule, origin=(x, y))
        padded = np.pad(whole, 11 + 13)[y + 24 : y + 35, x + 24 : x + 37]
        inside = np.pad(np.ones_like(whole, bool), 24)[y + 24 : y + 35, x + 24 : x + 37]
        assert (window == padded)[inside].all()


@ON_EACH_ISA
@pytest.mark.parametrize("sampling", [str(s) for s in Sampling])
def test_threads_and_instruction_sets_change_no_bit(isa, sampling):
    rng = np.random.default_rng(3)
    drawn = [wild_polygon(rng, (70, 50)) for _ in range(30)]
    expected = tl.polygons(drawn, (70, 50), sampling=sampling, threads=1)
    with on(isa):
        for threads in range(1, 9):
            assert (tl.polygons(drawn, (70, 50), sampling=sampling, threads=threads) == expected).all()
            one = tl.polygons(drawn[:1], (70, 50), sampling=sampling, threads=threads)
            assert (one == tl.polygons(drawn[0], (70, 50), sampling=sampling, threads=1)).all()


@ON_EACH_ISA
@ON_EACH_RULE
def test_300_000_corners_equal_the_sum_of_parities(isa, rule):
    """Against crossings of whole rows in float64, which is exact for these."""
    side = 512
    ring = np.round(256 * star(300_000, side, 3.0, 2e-5)) / 256
    ends = np.roll(ring, -1, axis=0)
    with on(isa):
        mask = tl.polygons(ring, (side, side), rule=rule)
    for row in (70, 256, 411):
        y = row + 0.5
        is_passed = (ring[:, 1] <= y) != (ends[:, 1] <= y)
        a, b = ring[is_passed], ends[is_passed]
        x = a[:, 0] + (b[:, 0] - a[:, 0]) * (y - a[:, 1]) / (b[:, 1] - a[:, 1])
        near = np.abs(x - np.round(x - 0.5) - 0.5) < 1e-9  # decided by fractions
        for i in np.flatnonzero(near):
            (ax, ay), (bx, by) = (tuple(map(Fraction, p)) for p in (a[i], b[i]))
            x[i] = np.ceil(float(ax + (bx - ax) * (Fraction(y) - ay) / (by - ay)) - 0.5) + 0.5
        down = np.where(a[:, 1] < b[:, 1], 1, -1)
        columns = np.clip(np.ceil(x - 0.5), 0, side).astype(int)
        winding = np.cumsum(np.bincount(columns, down, side + 1)[:side]).round().astype(int)
        assert (mask[row] == (winding % 2 != 0 if rule == "evenodd" else winding != 0)).all()


def test_polygons_of_many_corners_among_small_ones_keep_their_order():
    """Each way of drawing labels: two columns a row, lists, bits."""
    side = 200
    rings = [
        np.round(256 * star(n, side, noise, seed=n)) / 256 + shift
        for n, noise, shift in [(5, 0, 0), (6000, 2, 20), (40, 9, -30), (900, 5, 10), (3, 0, 40), (5000, 1, -20)]
    ]
    for rule in RULES:
        expected = np.full((side, side), -1)
        for i, ring in enumerate(rings):
            expected[tl.polygons(ring, (side, side), rule=rule)] = i
        for threads in (1, 3):
            labels = tl.polygons([[r] for r in rings], (side, side), rule=rule, values="index", threads=threads)
            assert (labels == expected).all()
