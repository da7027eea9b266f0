"""The exact references of samples and conservative coverage: tiny pictures, and the definitions put another way."""

from fractions import Fraction

import numpy as np
import pytest
from comparing import assert_same
from strategies import few_bits, floor, on_centres, slivers

from topleft.methods import reference as ref
from topleft.methods.reference import sampling as sampling

ONE = [[0, 1, 2]]
COUNTS = (1, 2, 4, 8, 16)


def scenes(bits, seed=3):
    """Small scenes that run through centres, corners and borders of pixels."""
    rng = np.random.default_rng(seed)
    for make in (few_bits, on_centres, slivers):
        scene = make(rng, 6)
        yield *scene.arrays, scene.view | {"subpixel_bits": bits, "origin": (2, 3)}


# ---- several samples a pixel ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", COUNTS)
def test_positions_are_distinct_and_each_of_1_to_16_sits_alone_in_its_row_and_column(n):
    x, y = zip(*sampling.SAMPLE_POSITIONS[n], strict=True)
    assert len(x) == n
    assert set(x + y) <= set(range(-8, 8))
    assert len(set(x)) == len(set(y)) == n


def test_positions_are_those_of_vulkan_in_sixteenths_from_the_corner():
    corner = {n: [(x + 8, y + 8) for x, y in at] for n, at in sampling.SAMPLE_POSITIONS.items()}
    assert corner[2] == [(12, 12), (4, 4)]
    assert corner[4] == [(6, 2), (14, 6), (2, 10), (10, 14)]
    assert corner[8] == [(9, 5), (7, 11), (13, 9), (5, 3), (3, 13), (1, 7), (11, 15), (15, 1)]
    assert corner[16] == [
        (9, 9), (7, 5), (5, 10), (12, 7), (3, 6), (10, 13), (13, 11), (11, 3),
        (6, 14), (8, 1), (4, 2), (2, 12), (0, 8), (15, 4), (14, 15), (1, 0),
    ]  # fmt: skip


def test_sample_coverage_half_a_pixel_2_samples():
    left, top = [[0, 0], [0.5, 0], [0.5, 1], [0, 1]], [[0, 0], [1, 0], [1, 0.5], [0, 0.5]]
    square = [[0, 1, 2], [0, 2, 3]]
    assert sampling.sample_coverage(left, square, (1, 1), 2).tolist() == [[[False, True]]]
    assert sampling.sample_coverage(top, square, (1, 1), 2).tolist() == [[[False, True]]]


def test_sample_coverage_edge_through_a_sample_belongs_to_top_and_left():
    at = 0.5 - 4 / 16  # the second of two samples is (at, at): the first vertex, and the last
    assert sampling.sample_coverage([[at, at], [1, at], [at, 1]], ONE, (1, 1), 2).tolist() == [[[False, True]]]
    assert sampling.sample_coverage([[at, 0], [at, at], [0, at]], ONE, (1, 1), 2).tolist() == [[[False, False]]]


def test_sample_coverage_0_bits_keeps_positions_between_the_grid():
    # Below the diagonal of the pixel, which runs through no sample of four: those with x < y.
    assert sampling.sample_coverage([[0, 0], [1, 1], [0, 1]], ONE, (1, 1), 4, subpixel_bits=0).tolist() == [
        [[False, False, True, True]]
    ]


@pytest.mark.parametrize("bits", [0, 1, 7, 8, 16])
def test_sample_coverage_is_that_of_centres_when_the_vertices_move_instead(bits):
    for vertices, triangles, size, view in scenes(bits, seed=bits):
        fixed = np.array(ref.snap(vertices, bits)) / 2.0**bits
        for n in (4, 16):
            got = sampling.sample_coverage(vertices, triangles, size, n, **view)
            for k, offset in enumerate(sampling.SAMPLE_POSITIONS[n]):
                moved = fixed - np.array(offset) / 16
                expected = ref.coverage(moved, triangles, size, **view | {"subpixel_bits": bits + 4})
                assert_same(got[..., k], expected)


@pytest.mark.parametrize("bits", [0, 8])
def test_one_sample_is_the_centre(bits):
    for vertices, triangles, size, view in scenes(bits):
        got = sampling.sample_coverage(vertices, triangles, size, 1, **view)
        assert_same(got[..., 0], ref.coverage(vertices, triangles, size, **view))


def test_sample_ids_and_depth_are_those_at_each_sample():
    ramp = [[0, 0, 0.0], [4, 0, 4.0], [0, 4, 0.0], [0, 0, 0.5], [4, 0, 0.5], [0, 4, 0.5]]  # depth x, depth 1/2
    both = [[0, 1, 2], [3, 4, 5]]
    assert sampling.sample_ids(ramp, both, (1, 1), 2).tolist() == [[[1, 0]]]
    assert sampling.sample_depth(ramp, both, (1, 1), 2).tolist() == [[[Fraction(1, 2), Fraction(1, 4)]]]
    assert sampling.sample_ids(ramp, both, (1, 1), 1).tolist() == [[[0]]]  # equal at the centre: the lower index


def test_sample_ids_of_cut_triangles_lie_where_the_samples_are_covered():
    scene = floor(np.random.default_rng(4), 2, 8)
    ids = sampling.sample_ids(*scene.arrays, 4, **scene.view)
    covered = sampling.sample_coverage(*scene.arrays, 4, **scene.view)
    assert covered.any()
    assert_same(ids >= 0, covered)


# ---- conservative coverage ------------------------------------------------------------------------------------------


def test_outer_touching_a_side_or_a_corner_is_not_meeting():
    square = [[1, 1], [2, 1], [2, 2], [1, 2]]
    got = sampling.outer(square, [[0, 1, 2], [0, 2, 3]], (3, 3))
    assert got.astype(int).tolist() == [[0, 0, 0], [0, 1, 0], [0, 0, 0]]


def test_outer_sliver_between_centres_meets_every_square_on_its_way():
    got = sampling.outer([[0.1, 0.1], [2.9, 1.1], [2.9, 1.2]], ONE, (3, 2))
    assert got.astype(int).tolist() == [[1, 1, 1], [0, 0, 1]]


def test_inner_border_counts_as_inside():
    got = sampling.inner([[0, 0], [3, 0], [0, 3]], ONE, (3, 3))
    assert got.astype(int).tolist() == [[1, 1, 0], [1, 0, 0], [0, 0, 0]]
    less = sampling.inner([[0, 1 / 256], [3, 0], [0, 3]], ONE, (3, 3))
    assert less.astype(int).tolist() == [[0, 0, 0], [1, 0, 0], [0, 0, 0]]


@pytest.mark.parametrize("bits", [0, 1, 2, 8])
def test_outer_is_positive_area_and_inner_the_whole_square(bits):
    for vertices, triangles, size, view in scenes(bits):
        area = np.zeros(size[::-1], object)
        for piece in ref.pieces(vertices, triangles, size, subpixel_bits=bits):
            corners = [(Fraction(v.xy_fx[0], 2**bits) - 2, Fraction(v.xy_fx[1], 2**bits) - 3) for v in piece.vertices]
            for row, column in np.ndindex(area.shape):
                area[row, column] = max(area[row, column], clipped_area(corners, column, row))
        assert_same(sampling.outer(vertices, triangles, size, **view), area > 0)
        assert_same(sampling.inner(vertices, triangles, size, **view), area == 1)


@pytest.mark.parametrize("bits", [0, 3, 8, 16])
def test_inner_lies_in_every_sample_and_every_sample_in_outer(bits):
    for vertices, triangles, size, view in scenes(bits, seed=5):
        inner = sampling.inner(vertices, triangles, size, **view)
        outer = sampling.outer(vertices, triangles, size, **view)
        samples = sampling.sample_coverage(vertices, triangles, size, 16, **view)
        centre = ref.coverage(vertices, triangles, size, **view)
        assert not (inner & ~centre).any()
        assert not (centre & ~outer).any()
        assert not (inner[..., None] & ~samples).any()
        assert not (samples & ~outer[..., None]).any()


def clipped_area(corners, column, row):
    """Area of a triangle inside a pixel, by cutting it with the four sides in turn."""
    for axis, low in ((0, column), (1, row)):
        for sign, limit in ((1, low), (-1, low + 1)):
            kept = []
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
                da, db = sign * (a[axis] - limit), sign * (b[axis] - limit)
                if da >= 0:
                    kept.append(a)
                if da * db < 0:
                    kept.append(tuple(p + (q - p) * Fraction(da, da - db) for p, q in zip(a, b, strict=True)))
            corners = kept
    crosses = (a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    return abs(sum(crosses, Fraction(0))) / 2
