"""The classics behind the verbs: the way in, what is refused, windows, memory; kernels against their pure twins."""

from importlib import import_module

import numpy as np
import pytest

import topleft as tl
from topleft.methods import CLASSICS, find_method, load_kernel
from topleft.methods.classics.classic_kernels import FORMS, draw

EVERY_CLASSIC = pytest.mark.parametrize("name", CLASSICS)
SUBPIXEL = [name for name, method in CLASSICS.items() if method.has_subpixel_bits]
TWINS = list(CLASSICS)
ONE = [[0, 1, 2]]


def soup(seed, n=8, low=-12, high=36, *, whole=False):
    xy = np.random.default_rng(seed).uniform(low, high, (3 * n, 2))
    return np.round(xy) if whole else xy, np.arange(3 * n).reshape(-1, 3)


# ---- kernels and twins ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TWINS)
def test_kernel_equals_its_pure_twin(name):
    module, _, variant = name.partition("/")
    twin = import_module(f"topleft.methods.twins.{module}").overdraw
    size = (25, 23)
    for seed in range(12):
        small = soup(seed, low=0, high=4, whole=True)  # mostly without area
        for vertices, triangles in (soup(seed), soup(seed, whole=True), small, soup(seed, low=-900, high=900)):
            expected = twin(vertices, triangles, size, variant)
            assert np.array_equal(tl.overdraw(vertices, triangles, size, method=name), expected)


@EVERY_CLASSIC
def test_kernel_knows_the_variants_of_the_registry(name):
    first, _, variant = name.partition("/")
    assert load_kernel(CLASSICS[name])[1] == variant
    assert set(FORMS[first]) == {other.partition("/")[2] for other in CLASSICS if other.partition("/")[0] == first}


def test_kernel_of_another_name_is_refused():
    with pytest.raises(ValueError, match="method must be one of 'bresenham_scanline', 'edge_increment'"):
        draw("zag", np.zeros((3, 2)), np.zeros((1, 3), np.int32), np.zeros(4, np.uint8), (0, 0, 2, 2), 0)


# ---- verbs ----------------------------------------------------------------------------------------------------------


@EVERY_CLASSIC
def test_coverage_is_where_something_was_drawn(name):
    scene = (*soup(1), (24, 20))
    covered = tl.coverage(*scene, method=name)
    assert (covered.dtype, covered.shape) == (bool, (20, 24))
    assert np.array_equal(covered, tl.overdraw(*scene, method=name) > 0)


@EVERY_CLASSIC
def test_fill_shows_the_last_triangle_over_the_background(name):
    vertices, triangles = soup(2)
    colors = np.arange(1, 9, dtype=np.uint8)
    picture = tl.fill(vertices, triangles, colors, (24, 20), background=99, method=name)
    expected = np.full((20, 24), 99, np.uint8)
    for triangle, color in zip(triangles, colors, strict=True):
        expected[tl.coverage(vertices, [triangle], (24, 20), method=name)] = color
    assert np.array_equal(picture, expected)


@EVERY_CLASSIC
def test_window_is_the_crop_of_the_whole_picture(name):
    vertices, triangles = soup(3, high=60)
    whole = tl.overdraw(vertices, triangles, (60, 60), method=name, origin=(-10, -10))
    window = tl.overdraw(vertices, triangles, (21, 17), method=name, origin=(13, 9))
    assert np.array_equal(window, whole[19:36, 23:44])


def test_out_is_drawn_and_returned_whatever_its_strides():
    vertices, triangles = soup(4)
    expected = tl.overdraw(vertices, triangles, (24, 20), method="row_crossing")
    for out in (np.full((20, 24), 7, np.int32), np.full((24, 20), 7, np.int32).T):
        assert tl.overdraw(vertices, triangles, (24, 20), method="row_crossing", out=out) is out
        assert np.array_equal(out, expected)


def test_fill_out_without_background_is_drawn_over():
    vertices, triangles = [[0, 0], [3, 0], [0, 3]], ONE
    out = np.full((4, 4, 3), 5, np.uint8)
    assert tl.fill(vertices, triangles, [[1, 2, 3]], (4, 4), method="point_in_triangle", out=out) is out
    assert out[:, :, 0].tolist() == [[1, 1, 1, 1], [1, 1, 1, 5], [1, 1, 5, 5], [1, 5, 5, 5]]


def test_depth_column_is_not_looked_at():
    vertices, triangles = soup(6)
    deep = np.column_stack([vertices, np.full(len(vertices), np.nan)])
    for method in ("bresenham_scanline", "float_barycentric"):
        expected = tl.overdraw(vertices, triangles, (24, 20), method=method)
        assert np.array_equal(tl.overdraw(deep, triangles, (24, 20), method=method), expected)


@EVERY_CLASSIC
@pytest.mark.parametrize("size", [(0, 5), (5, 0), (1, 1)])
def test_small_frames_and_empty_scenes_are_fine(name, size):
    vertices, triangles = soup(7)
    assert tl.overdraw(vertices, triangles, size, method=name).shape == size[::-1]
    assert not tl.overdraw([], [], size, method=name).any()


# ---- what is refused ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"transform": np.eye(4)}, "method 'row_crossing' takes vertices in pixels, got a transform"),
        ({"sampling": "area"}, "sampling must be 'center' for method 'row_crossing', got 'area'"),
        ({"cull": "back"}, "cull must be 'none' for method 'row_crossing'"),
        ({"subpixel_bits": 4}, "method 'row_crossing' has no sub-pixel bits, got subpixel_bits=4"),
    ],
)
def test_option_that_a_classic_lacks_raises(options, message):
    with pytest.raises(ValueError, match=message):
        tl.coverage(np.zeros((3, 3)), ONE, (4, 4), method="row_crossing", **options)


def test_clip_space_raises():
    with pytest.raises(ValueError, match=r"takes vertices in pixels, \(V, 2\) or \(V, 3\), got shape \(3, 4\)"):
        tl.coverage(np.zeros((3, 4)), ONE, (4, 4), method="point_in_triangle")


def test_rasterize_with_a_classic_raises():
    with pytest.raises(ValueError, match="method 'lerp_scanline' has no depth; use 'auto', 'edge' or 'scanline'"):
        tl.rasterize(np.zeros((3, 3)), ONE, (4, 4), method="lerp_scanline")


def test_fill_per_vertex_raises_and_leaves_out_alone():
    out = np.full((4, 4), 5, np.uint8)
    with pytest.raises(ValueError, match="colors must have 1 rows, one per triangle, for method 'zigzag', got 3"):
        tl.fill([[0, 0], [4, 0], [0, 4]], ONE, np.zeros(3, np.uint8), (4, 4), background=0, method="zigzag", out=out)
    assert (out == 5).all()


def test_unknown_variant_raises():
    with pytest.raises(ValueError, match="got 'zigzag/fast'; methods to compare with are 'point_in_triangle', "):
        tl.coverage([], [], (4, 4), method="zigzag/fast")


@EVERY_CLASSIC
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_vertex_that_is_not_finite_raises_when_used(name, bad):
    vertices = [[0, 0], [4, 0], [0, 4], [1, bad]]
    tl.coverage(vertices, ONE, (4, 4), method=name)
    with pytest.raises(ValueError, match=r"finite where a triangle uses them, got \[1.0, .*\] in row 3"):
        tl.coverage(vertices, [[0, 1, 3]], (4, 4), method=name)


@pytest.mark.parametrize("name", [name for name, method in CLASSICS.items() if np.isfinite(method.limit)])
def test_vertex_beyond_the_limit_raises(name):
    limit = CLASSICS[name].limit / (256 if name in SUBPIXEL else 1)
    with pytest.raises(ValueError, match=rf"vertices must lie within {limit:.0f} pixels of 0 for method '{name}', got"):
        tl.coverage([[0, 0], [4, 0], [0, -limit]], ONE, (4, 4), method=name)


def test_bad_index_raises():
    with pytest.raises(IndexError, match=r"triangles must hold indices in \[0, 3\)"):
        tl.coverage([[0, 0], [4, 0], [0, 4]], [[0, 1, 3]], (4, 4), method="row_crossing")


# ---- memory ---------------------------------------------------------------------------------------------------------


@EVERY_CLASSIC
def test_nothing_is_written_outside_the_frame(name):
    method = CLASSICS[name]
    limit = min(method.limit / (256 if method.has_subpixel_bits else 1), 1e300)
    rng = np.random.default_rng(8)
    guarded = np.full((40, 16), 77, np.int32)
    for scale in (3.0, 40.0, 1e4, 0.999 * limit):
        vertices = rng.uniform(-scale, scale, (60, 2))
        vertices[::5] = rng.uniform(0, 16, (12, 2))
        for origin in ((0, 0), (-7, 9), (2**40, -(2**40))):
            triangles = np.arange(60).reshape(-1, 3)
            tl.overdraw(vertices, triangles, (16, 16), method=name, origin=origin, out=guarded[12:28])
            assert (guarded[:12] == 77).all()
            assert (guarded[28:] == 77).all()


@pytest.mark.parametrize("bits", [0, 8, 16])
@pytest.mark.parametrize("name", ["edge_increment", "zigzag"])
def test_edge_functions_at_the_limit_are_exact(name, bits):
    limit = 2.0**29 / 2 ** max(bits, 1) - 1
    rng = np.random.default_rng(bits)
    vertices = rng.choice([-limit, limit, 3.25, 8.5], (90, 2)) + rng.uniform(-0.5, 0.5, (90, 2))
    triangles = np.arange(90).reshape(-1, 3)
    expected = tl.overdraw(vertices, triangles, (16, 16), subpixel_bits=bits)
    assert expected.any()
    assert np.array_equal(tl.overdraw(vertices, triangles, (16, 16), subpixel_bits=bits, method=name), expected)


def test_integer_kernels_at_the_limit_agree():
    limit = 2.0**29 - 1
    vertices = np.random.default_rng(9).choice([-limit, limit, 3, 8], (90, 2))
    scene = vertices, np.arange(90).reshape(-1, 3), (16, 16)
    expected = tl.overdraw(vertices + 0.5, *scene[1:])
    assert expected.any()
    for name in ("point_in_triangle/top-left", "edge_increment/integer"):
        assert np.array_equal(tl.overdraw(*scene, method=name), expected)


# ---- lines ----------------------------------------------------------------------------------------------------------


def test_line_of_the_tutorial_splits_into_other_pixels():
    # Parts of a line need not lie on the pixels of the whole: (5, 6) here, (6, 6) there.
    whole = tl.bresenham_line(0, 0, 9, 10).tolist()
    assert whole == [[0, 0], [1, 1], [2, 2], [3, 3], [4, 4], [5, 5], [5, 6], [6, 7], [7, 8], [8, 9], [9, 10]]
    part = tl.bresenham_line(3, 3, 9, 10).tolist()
    assert part == [[3, 3], [4, 4], [5, 5], [6, 6], [6, 7], [7, 8], [8, 9], [9, 10]]


@pytest.mark.parametrize(("dx", "dy"), [(7, 3), (3, 7), (-7, 3), (-3, 7), (5, 5), (-5, 5), (0, 4), (0, 0)])
def test_line_runs_from_the_top_down_whatever_the_order(dx, dy):
    down = tl.bresenham_line(2, -1, 2 + dx, -1 + dy)
    assert (down.dtype, down.shape) == (np.int64, (max(abs(dx), dy) + 1, 2))
    assert down[0].tolist() == [2, -1]
    assert down[-1].tolist() == [2 + dx, -1 + dy]
    assert (np.diff(down[:, 1]) >= 0).all()
    assert np.abs(np.diff(down, axis=0)).max(initial=0) <= 1
    assert np.array_equal(tl.bresenham_line(2 + dx, -1 + dy, 2, -1), down)


def test_line_horizontal_keeps_its_direction():
    assert tl.bresenham_line(2, 1, 0, 1).tolist() == [[2, 1], [1, 1], [0, 1]]


def test_line_is_nowhere_further_than_half_a_pixel_off():
    for dx, dy in np.random.default_rng(10).integers(-40, 40, (50, 2)).tolist():
        x, y = tl.bresenham_line(0, 0, dx, dy).T
        assert (2 * np.abs(x * dy - y * dx) <= max(abs(dx), abs(dy))).all()


@pytest.mark.parametrize(
    ("ends", "kind", "message"),
    [
        ((0, 0, 1.5, 2), TypeError, r"x0, y0, x1 and y1 must be integers, got \(0, 0, 1.5, 2\)"),
        ((0, 0, 2**31 + 1, 0), ValueError, r"must lie within 2\*\*31 pixels of 0, got \(0, 0, 2147483649, 0\)"),
    ],
)
def test_line_bad_end_raises(ends, kind, message):
    with pytest.raises(kind, match=message):
        tl.bresenham_line(*ends)


def test_topleft_is_another_word_for_auto():
    triangle = [[1, 1], [9, 2], [3, 8]], [[0, 1, 2]], (10, 10)
    assert np.array_equal(tl.coverage(*triangle, method="topleft"), tl.coverage(*triangle))
    assert find_method("topleft") is find_method("auto")
