"""The exact reference against tiny pictures that are written out: one rule a test, worked by hand."""

from fractions import Fraction

import numpy as np
import pytest

from topleft.methods import reference as ref

ONE = [[0, 1, 2]]
F = Fraction


def rows(picture):
    """A picture of small counts as strings, '.' for 0."""
    return ["".join("." if n == 0 else str(n) for n in row) for row in np.asarray(picture).astype(int).tolist()]


def test_reference_module_imports_nothing_of_ours():
    assert [name for name in vars(ref) if getattr(vars(ref)[name], "__module__", "").startswith("topleft")] == [
        name for name in vars(ref) if getattr(vars(ref)[name], "__module__", "") == ref.__name__
    ]
    assert "engine" not in vars(ref)


# ---- snap -----------------------------------------------------------------------------------------------------------


def test_snap_ties_go_to_even():
    ties = [[0.5, 1.5], [2.5, -0.5], [-1.5, -2.5]]
    assert ref.snap(ties, 0) == [(0, 2), (2, 0), (-2, -2)]


def test_snap_8_bits_counts_256ths():
    assert ref.snap([[1.0, 1 / 256], [1 / 512, 3 / 512]], 8) == [(256, 1), (0, 2)]


def test_snap_16_bits_keeps_what_8_bits_lose():
    assert ref.snap([[2**-16, 1 + 2**-16]], 16) == [(1, 65537)]
    assert ref.snap([[2**-16, 1 + 2**-16]], 8) == [(0, 256)]


def test_snap_large_integers_are_shifted_exactly():
    assert ref.snap(np.array([[2**54 - 1, -(2**53) - 1]]), 8) == [((2**54 - 1) * 256, -(2**53 + 1) * 256)]


def test_round_to_float32_agrees_with_numpy_on_doubles():
    values = np.random.default_rng(1).standard_normal(500) * 2.0 ** np.random.default_rng(2).integers(-160, 140, 500)
    with np.errstate(over="ignore"):
        expected = values.astype(np.float32).astype(float).tolist()
    assert [ref.round_to_float32(F(v)) for v in values.tolist()] == expected


# ---- fill rule ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("triangle", [[0, 1, 2], [1, 2, 0], [2, 1, 0], [0, 2, 1]])
def test_coverage_edges_through_centres_belong_to_top_and_left(triangle):
    # The legs lie on the centres of row 0 and column 0 (top and left: drawn); the hypotenuse passes centres, too (not).
    vertices = [[0.5, 0.5], [3.5, 0.5], [0.5, 3.5]]
    assert rows(ref.coverage(vertices, [triangle], (4, 4))) == ["111.", "11..", "1...", "...."]


@pytest.mark.parametrize("triangle", [[0, 1, 2], [2, 1, 0]])
def test_coverage_bottom_and_right_edges_through_centres_are_not_drawn(triangle):
    # Legs on the centres of row 3 (bottom) and column 3 (right), the hypotenuse through centres is a left edge.
    vertices = [[3.5, 0.5], [3.5, 3.5], [0.5, 3.5]]
    assert rows(ref.coverage(vertices, [triangle], (4, 4))) == ["....", "..1.", ".11.", "...."]


def test_overdraw_square_of_mixed_windings_covers_each_sample_once():
    vertices = [[0.5, 0.5], [3.5, 0.5], [3.5, 3.5], [0.5, 3.5]]
    assert rows(ref.overdraw(vertices, [[0, 1, 2], [0, 3, 2]], (4, 4))) == ["111.", "111.", "111.", "...."]


def test_overdraw_fan_round_a_centre_covers_it_once():
    vertices = [[1.5, 1.5], [0, 0], [3, 0], [3, 3], [0, 3]]
    fan = [[0, 1, 2], [0, 3, 2], [0, 3, 4], [4, 0, 1]]
    assert rows(ref.overdraw(vertices, fan, (3, 3))) == ["111", "111", "111"]


def test_coverage_edge_one_square_subpixel_off_a_centre_decides_it():
    # The slanted edge passes the centre (128, 128) at half a sub-pixel: below it, above it.
    below = np.array([[0, 0], [256, 257], [0, 257]]) / 256
    above = np.array([[0, 0], [256, 255], [0, 255]]) / 256
    assert rows(ref.coverage(below, ONE, (1, 1))) == ["."]
    assert rows(ref.coverage(above, ONE, (1, 1))) == ["1"]


def test_coverage_0_bits_snaps_to_pixel_corners():
    vertices = [[0.4, -0.4], [2.6, 0.5], [0.0, 3.4]]  # becomes (0, 0), (3, 0), (0, 3)
    assert rows(ref.coverage(vertices, ONE, (3, 3), subpixel_bits=0)) == ["11.", "1..", "..."]


def test_coverage_16_bits_sees_2_to_the_minus_16():
    tip = 0.5 + 2**-16
    vertices = [[0, 0], [tip, 0], [tip, 1], [0, 1]]
    square = [[0, 1, 2], [0, 2, 3]]
    assert rows(ref.coverage(vertices, square, (1, 1), subpixel_bits=16)) == ["1"]
    assert rows(ref.coverage(vertices, square, (1, 1), subpixel_bits=15)) == ["."]  # 0.5: a right edge on the centre


def test_coverage_degenerate_after_the_snap_is_nothing():
    vertices = [[0, 0], [3, 3], [1.5, 1.5 + 1 / 1024], [0, 0]]
    assert not ref.coverage(vertices, [[0, 1, 2], [0, 1, 3], [2, 2, 2]], (3, 3)).any()


def test_coverage_far_vertices_stay_exact():
    far = 2**54 - 1
    vertices = np.array([[-far, -far], [far, far], [-far, far]])  # the diagonal passes every centre on it: a right edge
    assert rows(ref.coverage(vertices, ONE, (3, 3))) == ["...", "1..", "11."]


# ---- who wins -------------------------------------------------------------------------------------------------------

TWO = [[0, 0], [2, 0], [0, 2], [2, 2]]  # (0, 1, 2) covers one sample of a 2 x 2 frame, (0, 1, 3) three


def test_ids_without_depth_the_later_wins():
    assert ref.ids(TWO, [[0, 1, 3], [0, 1, 2]], (2, 2)).tolist() == [[1, 0], [-1, 0]]
    assert ref.ids(TWO, [[0, 1, 2], [0, 1, 3]], (2, 2)).tolist() == [[1, 1], [-1, 1]]


def layers(*depths):
    """Triangles that cover a 1 x 1 frame, one a depth."""
    vertices = [[x, y, z] for z in depths for x, y in [(0, 0), (3, 0), (0, 3)]]
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


@pytest.mark.parametrize(("depth_test", "winner"), [("less", 1), ("greater", 2), (None, 3)])
def test_ids_with_depth_nearest_wins(depth_test, winner):
    assert ref.ids(*layers(0.5, 0.25, 0.75, 0.5), (1, 1), depth_test=depth_test).tolist() == [[winner]]


@pytest.mark.parametrize("depth_test", ["less", "greater"])
def test_ids_with_equal_depth_lower_index_wins(depth_test):
    assert ref.ids(*layers(0.5, 0.5, 0.5), (1, 1), depth_test=depth_test).tolist() == [[0]]


def test_ids_depths_equal_in_float32_are_equal():
    assert ref.ids(*layers(1 + 2**-30, 1.0), (1, 1)).tolist() == [[0]]


def test_depth_is_the_plane_at_the_centre():
    vertices = [[0, 0, 0.0], [4, 0, 4.0], [0, 4, 8.0]]  # z = x + 2y
    expected = [[F(3, 2), F(5, 2), F(7, 2), None], [F(7, 2), F(9, 2), None, None]]
    assert ref.depth(vertices, ONE, (4, 2)).tolist() == expected


# ---- view -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("cull", "expected"), [("none", ["1"]), ("back", ["1"]), ("front", ["."])])
def test_coverage_cull_front_is_counter_clockwise_with_y_up(cull, expected):
    vertices = [[0, 0], [0, 3], [3, 0]]  # down, then right and up: counter-clockwise on the screen
    assert rows(ref.coverage(vertices, ONE, (1, 1), cull=cull)) == expected
    swapped = {"none": expected, "back": ["."], "front": ["1"]}[cull]
    assert rows(ref.coverage(vertices, [[0, 2, 1]], (1, 1), cull=cull)) == swapped


def test_coverage_window_is_the_crop():
    vertices = [[0.3, -2.0], [7.9, 1.2], [2.2, 8.8]]
    whole = ref.coverage(vertices, ONE, (9, 9))
    assert (ref.coverage(vertices, ONE, (4, 3), origin=(2, 1)) == whole[1:4, 2:6]).all()
    around = ref.coverage(vertices, ONE, (12, 12), origin=(-2, -3))
    assert (around[3:, 2:11] == whole[:9]).all()


# ---- attributes -----------------------------------------------------------------------------------------------------


def test_barycentric_pixel_space_is_linear():
    vertices = [[0, 0], [4, 0], [0, 4]]
    for triangle, order in [([0, 1, 2], [0, 1, 2]), ([0, 2, 1], [0, 2, 1])]:
        weights = ref.barycentric(vertices, [triangle], (2, 1)).tolist()
        expected = [[F(6, 8), F(1, 8), F(1, 8)], [F(4, 8), F(3, 8), F(1, 8)]]
        assert weights == [[[w[k] for k in order] for w in expected]]


def test_barycentric_clip_space_is_perspective_correct():
    # A triangle whose vertices project to (0, 0), (2, 0), (0, 2) pixels with w = 1, 2, 4: shares E/w.
    vertices = [[-1, 1, 0, 1], [2, 2, 0, 2], [-4, -4, 0, 4]]
    weights = ref.barycentric(vertices, ONE, (2, 2))[0, 0].tolist()
    shares = [F(1, 2), F(1, 4) / 2, F(1, 4) / 4]
    assert weights == [s / sum(shares) for s in shares]


def test_interpolate_per_vertex_and_per_corner_agree():
    vertices, values = [[0, 0], [4, 0], [0, 4]], [[0.0, 1.0], [8.0, 1.0], [0.0, 1.0]]
    expected = [[[1, 1], [3, 1]]]
    assert ref.interpolate(vertices, ONE, values, (2, 1)).tolist() == expected
    assert ref.interpolate(vertices, ONE, [values], (2, 1)).tolist() == expected


def test_fill_gouraud_rounds_ties_to_even():
    vertices = [[0, 0], [4, 0], [0, 4]]  # weights of vertex 1 along row 0: 1/8, 3/8, 5/8
    colors = np.array([[0], [4], [0]], np.uint8)  # 0.5, 1.5, 2.5
    assert ref.fill(vertices, ONE, colors, (4, 1), per="vertex", background=9)[..., 0].tolist() == [[0, 2, 2, 9]]


def test_fill_flat_draws_later_over_earlier():
    colors = np.array([[10, 20], [30, 40]], np.uint8)
    picture = ref.fill(TWO, [[0, 1, 3], [0, 1, 2]], colors, (2, 2), per="triangle")
    assert picture.tolist() == [[[30, 40], [10, 20]], [[0, 0], [10, 20]]]


# ---- clip space -----------------------------------------------------------------------------------------------------


def corners_px(vertices, size, **view):
    """Snapped pixel positions, depths and weights of the pieces of one triangle."""
    pieces = ref.pieces(vertices, ONE, size, subpixel_bits=8, **view)
    return [[(v.xy_fx[0] / 256, v.xy_fx[1] / 256, v.z) for v in piece.vertices] for piece in pieces]


def test_pieces_clip_space_maps_y_up_to_rows_down():
    vertices = [[-1, 1, -1, 1], [1, 1, 0, 1], [-2, -2, 2, 2]]
    assert corners_px(vertices, (8, 4)) == [[(0, 0, 0.0), (8, 0, 0.5), (0, 4, 1.0)]]


def test_pieces_zero_to_one_takes_depth_as_it_is():
    vertices = [[-1, 1, 0, 1], [1, 1, 0.25, 1], [-2, -2, 2, 2]]
    assert corners_px(vertices, (8, 4), clip_depth="zero_to_one") == [[(0, 0, 0.0), (8, 0, 0.25), (0, 4, 1.0)]]


def test_pieces_viewport_places_the_whole_picture():
    vertices = [[-1, 1, 0, 1], [1, 1, 0, 1], [-1, -1, 0, 1]]
    assert corners_px(vertices, (2, 2), viewport=(8, 4)) == corners_px(vertices, (8, 4))


def test_pieces_near_plane_cuts_one_vertex_off():
    # Two cuts half-way to the vertex behind the near plane: a quad, drawn from its first corner.
    vertices = [[0, 0, 0, 1], [1, 0, 0, 1], [0, 1, -2, 1]]
    expected = [[(4, 4, 0.5), (8, 4, 0.5), (6, 2, 0.0)], [(4, 4, 0.5), (6, 2, 0.0), (4, 2, 0.0)]]
    assert corners_px(vertices, (8, 8)) == expected
    assert corners_px(vertices, (8, 8), near_clip=False) == [[(4, 4, 0.5), (8, 4, 0.5), (4, 0, -0.5)]]


def test_pieces_far_plane_cuts_two_vertices_off():
    vertices = [[0, 0, 0, 1], [1, 0, 2, 1], [0, 1, 2, 1]]
    assert corners_px(vertices, (8, 8)) == [[(4, 4, 0.5), (6, 4, 1.0), (4, 2, 1.0)]]


def test_pieces_neighbours_cut_their_edge_alike():
    a, b, c, d = [0.1, 0.7, 0.3, 1.1], [0.9, -0.4, -3.7, 0.6], [1.0, 1.0, 0.0, 1.0], [-1.0, -1.0, 0.0, 1.0]
    one = ref.pieces([a, b, c], ONE, (64, 64))
    other = ref.pieces([b, a, d], ONE, (64, 64))
    shared = {v.xy_fx for p in one for v in p.vertices} & {v.xy_fx for p in other for v in p.vertices}
    assert len(shared) == 2


@pytest.mark.parametrize("w", [-1.0, 0.0, -1e-300, 2.0**-501])
def test_pieces_behind_the_eye_is_nothing(w):
    vertices = [[0, 0, 0, w], [1, 0, 0, w], [0, 1, 0, w]]
    assert ref.pieces(vertices, ONE, (8, 8), near_clip=False, far_clip=False) == []


def test_pieces_guard_band_keeps_a_fixed_point_form():
    vertices = [[0, 0, 0, 1], [1e200, 0, 0, 1], [0, 1, 0, 1]]
    pieces = ref.pieces(vertices, ONE, (8, 8))
    assert max(abs(x) for p in pieces for v in p.vertices for x in v.xy_fx) in range(2**60 - 2**9, 2**60 + 2**12)


def test_barycentric_clipped_triangle_counts_in_the_source():
    # The near plane cuts a corner off; what is left is the same plane, so the weights are those of the whole triangle.
    vertices = [[-1, 1, 0, 1], [1, 1, 0, 1], [-1, -1, -2, 1]]
    whole = ref.barycentric(vertices, ONE, (4, 4), near_clip=False)
    cut = ref.barycentric(vertices, ONE, (4, 4))
    covered = ref.coverage(vertices, ONE, (4, 4))
    assert rows(covered) == ["111.", "11..", "....", "...."]
    assert (cut[covered] == whole[covered]).all()


def test_fan_dented_polygon_starts_where_no_triangle_turns_over():
    dented = [(0, 0), (10, 0), (10, 10), (6, 4)]  # the fan from (0, 0) turns once, the one from (6, 4) does not...
    polygon = [ref.Vertex(xy, 0.0, 1.0, (0.0, 0.0, 0.0)) for xy in dented]
    areas = [ref._signed_area(t) for t in ref._fan(polygon)]
    assert len(areas) == 2
    assert min(areas) > 0


def test_fan_without_an_apex_drops_what_turns_against_the_polygon():
    bow_tie = [(0, 0), (10, 0), (0, 8), (10, 9)]
    polygon = [ref.Vertex(xy, 0.0, 1.0, (0.0, 0.0, 0.0)) for xy in bow_tie]
    kept = ref._fan(polygon)
    assert [[v.xy_fx for v in t] for t in kept] == [[(0, 0), (10, 0), (0, 8)]]


def test_clip_turn_is_the_sign_of_the_determinant():
    for corners in np.random.default_rng(1).integers(-3, 4, (50, 3, 4)):
        determinant = np.linalg.det(corners[:, [0, 1, 3]])
        assert ref._clip_turn(*corners.tolist()) == -np.sign(round(determinant))


def test_transform_float32_rounds_each_operation():
    matrix = np.array([[1, 1, 0, 0], [0, 1, 0, 2**24], [0, 0, 1, 0], [0, 0, 0, 1]], float)
    point = [[1.0, 1e-9, 3.0]]
    assert ref.transform_to_clip(np.float32(point), matrix) == [[1.0, 2.0**24, 3.0, 1.0]]
    assert ref.transform_to_clip(point, matrix) == [[1.0 + 1e-9, 2.0**24 + 1e-9, 3.0, 1.0]]
