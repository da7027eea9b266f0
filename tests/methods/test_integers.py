"""The fast exact picture is that of the fractions, sample by sample, whatever its coordinates are kept in."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from topleft import scenes
from topleft.methods import reference
from topleft.methods.reference import area, sampling
from topleft.methods.reference.integers import ExactPicture, areas, in_units, projected, snapped, turns

SIZE, ORIGIN = (9, 7), (2, -1)

#: Halves and quarters put vertices and edges on samples; other numbers do not.
COORDINATES = st.one_of(
    st.integers(-8, 48).map(lambda n: n / 4), st.floats(-3, 14, width=32), st.just(1e7), st.just(-1e-9)
)
POINTS = st.lists(st.tuples(COORDINATES, COORDINATES), min_size=3, max_size=6)
DEPTHS = st.lists(st.sampled_from([0.0, 0.25, 0.5, 1.0, 1 / 3]), min_size=6, max_size=6)
CORNERS = st.lists(st.tuples(*[st.integers(0, 2)] * 3), min_size=1, max_size=4)


def random_scene(bits, seed, size=(12, 11)):
    """Triangles on a grid of 2**-bits px, degenerate ones among them."""
    rng = np.random.default_rng(seed)
    vertices = np.rint(rng.uniform(-3, np.add(size, 3), (9, 2)) * 2.0**bits) / 2.0**bits
    return vertices, rng.integers(0, 9, (6, 3)).astype(np.int32)


def assert_same_as_fractions(exact, vertices, triangles, size, **view):
    assert exact.count.tolist() == reference.overdraw(vertices, triangles, size, **view).tolist()
    assert exact.triangle.tolist() == reference.ids(vertices, triangles, size, depth_test=None, **view).tolist()


# ---- samples --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bits", [0, 1, 4, 8, 16])
@pytest.mark.parametrize("seed", range(5))
def test_exact_picture_on_a_grid_is_that_of_fractions(bits, seed):
    vertices, triangles = random_scene(bits, seed)
    exact = ExactPicture(vertices, triangles, (12, 11))
    assert exact.xy.dtype == np.int64
    assert_same_as_fractions(exact, vertices, triangles, (12, 11), subpixel_bits=bits)


@given(POINTS, CORNERS, st.sampled_from([1, 2, 4]), st.sampled_from(["none", "back", "front"]))
def test_exact_picture_anywhere_is_that_of_fractions(points, corners, n_samples, cull):
    vertices, triangles = np.array(points), np.array(corners) + len(points) - 3
    for sample in sampling.SAMPLE_POSITIONS[n_samples]:
        exact = ExactPicture(vertices, triangles, SIZE, origin=ORIGIN, sample=sample, cull=cull)
        view = {"origin": ORIGIN, "sample": sample, "subpixel_bits": "exact", "cull": cull}
        assert_same_as_fractions(exact, vertices, triangles, SIZE, **view)


@given(POINTS, CORNERS, DEPTHS, st.sampled_from(["none", "back", "front"]), st.sampled_from(["exact", 8]))
def test_exact_picture_with_depth_is_that_of_fractions(points, corners, depths, cull, bits):
    vertices = np.column_stack([np.array(points), depths[: len(points)]])
    triangles = np.array(corners) + len(points) - 3
    tests = ("less", "greater")
    exact = ExactPicture(snapped(vertices, bits), triangles, SIZE, origin=ORIGIN, cull=cull, depth_tests=tests)
    for test in tests:
        view = {"origin": ORIGIN, "subpixel_bits": bits, "cull": cull, "depth_test": test}
        assert exact.ids[test].tolist() == reference.ids(vertices, triangles, SIZE, **view).tolist()
        depth, _ = exact.depth(exact.ids[test])
        found = reference.depth(vertices, triangles, SIZE, **view)
        expected = np.array([[np.nan if z is None else float(z) for z in row] for row in found])
        np.testing.assert_allclose(depth, expected, rtol=0, atol=2.0**-46)


@pytest.mark.parametrize("bits", [0, 8, "exact"])
@pytest.mark.parametrize("far", [2**20, 2**45, 10**15, 10**18])
def test_exact_picture_far_away_is_that_of_fractions(far, bits):
    vertices, triangles = random_scene(8, 1)
    vertices, origin = vertices + float(far), (far, far)
    exact = ExactPicture(snapped(vertices, bits), triangles, (12, 11), origin=origin)
    assert_same_as_fractions(exact, vertices, triangles, (12, 11), origin=origin, subpixel_bits=bits)


@pytest.mark.parametrize("factor", [1e200, 1e-200])
def test_exact_picture_of_products_beyond_float64_is_that_of_fractions(factor):
    vertices, triangles = random_scene(30, 5)
    vertices[::2] *= factor
    exact = ExactPicture(vertices, triangles, SIZE)
    assert_same_as_fractions(exact, vertices, triangles, SIZE, subpixel_bits="exact")


def test_exact_picture_vertex_one_ulp_beyond_a_centre_covers_it():
    for x, is_covered in ((2.5, False), (np.nextafter(2.5, 3), True)):  # the right corner is open
        exact = ExactPicture([[0.0, 0.0], [x, 1.5], [0.0, 3.0]], [[0, 1, 2]], (4, 4))
        assert exact.count[1, 2] == is_covered


def test_exact_picture_edge_through_a_centre_last_bit_decides():
    for nudge, counts in ((-np.inf, [1, 1]), (0.1, [0, 1]), (np.inf, [0, 0])):
        vertices = [[0.1, np.nextafter(0.1, nudge)], [1000.3, 1000.3], [0.1, 2000.0]]
        pictures = [
            ExactPicture(vertices, [[0, 1, 2]], (1, 1), origin=(300, 300), rule=rule)
            for rule in ("top-left", "bottom-right")
        ]
        assert [int(one.count[0, 0]) for one in pictures] == counts


def test_exact_picture_bottom_right_is_top_left_turned_half_round():
    vertices, triangles = random_scene(1, 2)
    turned = ExactPicture(np.array([12, 11]) - vertices, triangles, (12, 11)).count[::-1, ::-1]
    assert ExactPicture(vertices, triangles, (12, 11), rule="bottom-right").count.tolist() == turned.tolist()


def test_exact_picture_of_a_large_box_is_that_of_its_parts():
    vertices, triangles = np.array([[-7.0, -9], [700, 11.5], [30.25, 650]]), np.array([[0, 1, 2]])
    whole = ExactPicture(vertices, triangles, (640, 600)).count
    parts = [ExactPicture(vertices, triangles, (40, 600), origin=(x, 0)).count for x in range(0, 640, 40)]
    assert np.hstack(parts).tolist() == whole.tolist()


# ---- vertices -------------------------------------------------------------------------------------------------------


def test_snapped_by_kind():
    vertices = np.array([[-1.75, 2.5], [1 / 3, 3.0]])
    assert snapped(vertices, "px").tolist() == [[-0.5, 2.5], [0.5, 3.5]]
    assert snapped(vertices, 0).tolist() == [[-2, 2], [0, 3]]
    assert (snapped(vertices, "8") * 256).tolist() == [[-448, 640], [85, 768]]
    assert snapped(vertices, "float32").tolist() == vertices.astype(np.float32).tolist()
    assert snapped(vertices, "exact").tolist() == vertices.tolist()
    assert snapped([[1 / 3, 1 / 3, 1 / 3]], 4).tolist() == [[0.3125, 0.3125, 1 / 3]]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_projected_is_the_vertices_of_the_reference(dtype):
    vertices = np.random.default_rng(3).uniform(-1, 1, (9, 3)).astype(dtype)
    matrix = np.array([[0.6, 0.1, 0, 0.1], [0, 0.7, 0.1, 0], [0, 0.1, 0.5, 0.2], [0, 0, 0.2, 1.9]])
    pieces = reference.pieces(vertices, np.arange(9).reshape(3, 3), SIZE, transform=matrix)
    expected = [[*(x / 256 for x in v.xy_fx), v.z] for piece in pieces for v in piece.vertices]
    assert projected(vertices, SIZE, 8, matrix).tolist() == expected


def test_projected_vertices_beyond_a_plane_are_refused():
    with pytest.raises(ValueError, match="vertices must lie inside the clip planes"):
        projected([[0.0, 0, 2, 1]], SIZE)


def test_turns_of_slivers_are_those_of_fractions():
    vertices = np.array([[0.1, 0.1], [1000.3, 1000.3], [0.2, 0.2], [0.3, np.nextafter(0.3, 1)], [0.3, 0.3]])
    triangles = [[0, 1, 2], [0, 1, 3], [1, 0, 3], [0, 1, 4]]
    assert turns(vertices[triangles]).tolist() == [0, 1, -1, 0]


@pytest.mark.parametrize(("value", "origin", "dtype"), [
    (0.5, 0, np.int64), (2.0**-16, 0, np.int64), (2.0**24, 0, np.int64), (2.0**30, 2**30, np.int64),
    (2.0**-17, 0, np.float64), (1 / 3, 0, np.float64), (2.0**26, 0, np.float64), (1e300, 0, np.float64),
    (1e18, 10**18, object), (1 / 3, 2**50, object),
])  # fmt: skip
def test_units_are_integers_where_edge_functions_fit_and_where_centres_are_no_floats(value, origin, dtype):
    corners, first, step = in_units(np.array([[[value, 0.25 + origin]]]), (origin, origin), (0, 0))
    assert corners.dtype == first.dtype == dtype
    left, sample = (Fraction(one) for one in (corners.tolist()[0][0][0], first.tolist()[0]))
    assert (left - sample) / step == Fraction(value) - origin - Fraction(1, 2)


# ---- squares --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", [8, 10])
@pytest.mark.parametrize("seed", range(20))
def test_is_edge_agrees_with_a_segment_cut_by_fractions(seed, unit):
    p, q = np.random.default_rng(seed).integers(-unit, 3 * unit + 1, (2, 2)) / unit
    exact = ExactPicture([p, q, q], [[0, 1, 2]], (3, 3))
    expected = [[is_segment_left(p, q, column, row) for column in range(3)] for row in range(3)]
    assert exact.is_edge.tolist() == expected
    assert not exact.count.any()


def is_segment_left(p, q, column, row):
    """Whether part of p to q lies in the square, by Liang and Barsky's cut."""
    first, last = Fraction(0), Fraction(1)
    for start, end, low in zip(map(Fraction, p.tolist()), map(Fraction, q.tolist()), (column, row), strict=True):
        if start == end:
            if not low <= start <= low + 1:
                return False
            continue
        cuts = sorted([(low - start) / (end - start), (low + 1 - start) / (end - start)])
        first, last = max(first, cuts[0]), min(last, cuts[1])
    return first <= last


def test_exact_picture_of_a_mesh_covers_each_pixel_once():
    exact = ExactPicture(*scenes.planar_mesh(200, 64, 48), (64, 48))
    assert (exact.count == 1).all()
    assert 0 < exact.is_edge.sum() < exact.is_edge.size


@pytest.mark.parametrize("bits", [0, 1, 8])
@pytest.mark.parametrize("seed", range(3))
def test_areas_on_the_grid_are_those_of_the_reference(bits, seed):
    vertices, triangles = random_scene(bits, seed)
    expected = area.area(vertices, triangles, (12, 11), subpixel_bits=bits).astype(float)
    assert np.abs(areas(vertices, triangles, (12, 11)) - expected).max() < 1e-9  # what `areas` promises
