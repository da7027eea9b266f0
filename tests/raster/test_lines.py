"""Wireframes: tiny pictures written out, the exact reference on every instruction set, and what hides lines."""

import numpy as np
import pytest
from comparing import assert_exact, assert_same
from engine_cases import ON_EACH_ISA, THREADS, assert_same_everywhere, kept, on, one_by_one
from strategies import CLIP_SCENES, PIXEL_SCENES, soup, with_depth

import topleft as tl
from topleft._core.base.memory import FreshMemory
from topleft._core.raster import lines
from topleft._core.raster.snap import snap_mesh
from topleft._core.raster.view import View
from topleft.methods.reference import lines as ref

TRIANGLE = [[0.5, 0.5], [4.5, 0.5], [0.5, 4.5]]
ONE = [[0, 1, 2]]
wireframe, smooth_wireframe = kept(ref.wireframe), kept(ref.smooth_wireframe)
COVERAGE_SLACK = 2.0**-23  # float64 from exact integers; float32 rounds the square, its root and the difference


def rows(picture):
    return ["".join("1" if value else "." for value in row) for row in picture]


def segment(a, b, size, **options):
    """One line: a triangle whose third corner is its first."""
    return tl.wireframe([a, b], [[0, 1, 0]], size, **options)


# ---- pixels ---------------------------------------------------------------------------------------------------------


def test_wireframe_triangle_is_its_three_edges():
    assert rows(tl.wireframe(TRIANGLE, ONE, (5, 5))) == ["11111", "1..1.", "1.1..", "11...", "1...."]


def test_line_half_a_step_is_taken():
    assert rows(segment((0, 0), (4, 2), (5, 3))) == ["1....", ".11..", "...11"]
    assert rows(segment((4, 2), (0, 0), (5, 3))) == ["1....", ".11..", "...11"]


def test_line_ends_are_the_pixels_that_hold_the_vertices():
    assert rows(segment((1.99, 0.99), (3.0, 1.0), (5, 2))) == [".1...", "..11."]


def test_line_within_a_pixel_is_a_point():
    assert rows(segment((1.2, 0.2), (1.8, 0.9), (3, 1))) == [".1."]
    assert rows(tl.wireframe([[1, 0]], [[0, 0, 0]], (3, 1))) == [".1."]


def test_line_far_beyond_the_frame_keeps_its_pixels():
    far = 2**53
    assert rows(segment((-far, -far), (far, far), (3, 3))) == ["1..", ".1.", "..1"]
    assert rows(segment((-far, 1), (far, 1), (3, 3))) == ["...", "111", "..."]


def test_edges_are_listed_once_by_ascending_lower_index():
    triangles = np.random.default_rng(1).integers(0, 30, (400, 3))
    view = View.parse((9, 9), {})
    snapped = snap_mesh(FreshMemory(), np.zeros((30, 2)), triangles, view, with_depth=False, out=None)
    edges = lines.list_edges(FreshMemory(), snapped)
    expected = {tuple(sorted(pair)) for a, b, c in triangles.tolist() for pair in ((a, b), (b, c), (c, a))}
    assert sorted((int(e) & 0xFFFFFFFF, int(e) >> 32) for e in edges) == sorted(expected)
    assert (np.diff((edges & np.uint64(0xFFFFFFFF)).astype(int)) >= 0).all()


def test_wireframe_of_nothing_is_empty():
    assert not tl.wireframe([], [], (3, 2)).any()
    assert tl.wireframe(TRIANGLE, ONE, (0, 2)).shape == (2, 0)


def test_textbook_loop_may_start_anywhere():
    for b in ((9, 4), (-9, 4), (4, 9), (-4, 9), (0, 0), (7, 7), (8, 4)):
        whole = list(ref.line_pixels((0, 0), b))
        assert [p for k in range(len(whole)) for p in ref.line_pixels((0, 0), b, k, k)] == whole


# ---- the exact reference --------------------------------------------------------------------------------------------


@ON_EACH_ISA
@one_by_one("name", [*PIXEL_SCENES, *CLIP_SCENES])
def test_wireframe_equals_reference(name, isa):
    for seed in range(6):
        scene = (PIXEL_SCENES | CLIP_SCENES)[name](np.random.default_rng(seed))
        expected = wireframe(*scene.arrays, **scene.view)
        with on(isa):
            for n in THREADS:
                assert_exact(tl.wireframe(*scene.arrays, threads=n, **scene.view), expected)


@ON_EACH_ISA
@pytest.mark.parametrize("reach", [3, 40, 5000, 2.0**22, 2.0**40, 2.0**53])
def test_wireframe_lines_of_any_length_equal_reference(reach, isa):
    rng = np.random.default_rng(int(np.log2(reach)))
    for _ in range(8):
        size = tuple(rng.integers(1, 150, 2).tolist())
        origin = tuple(rng.integers(-(2**53), 2**53, 2).tolist()) if reach > 2**50 else (7, -9)
        middle = np.multiply(origin, rng.integers(0, 2)) + rng.uniform(0, 100, (60, 2))
        xy = middle + rng.uniform(-reach, reach, (60, 2))
        scene = soup(xy, size, origin=origin, cull=str(rng.choice(["none", "back", "front"])))
        expected = wireframe(*scene.arrays, **scene.view)
        with on(isa):
            assert_exact(tl.wireframe(*scene.arrays, threads=3, **scene.view), expected)


@pytest.mark.parametrize("bits", [0, 1, 16])
def test_wireframe_at_the_limits_of_fixed_point_equals_reference(bits):
    limit = np.nextafter(2.0 ** (62 - bits), 0)
    xy = np.array([[-limit, -limit], [limit, limit], [-limit, limit], [limit, 3], [4, -limit], [0, limit / 3]])
    triangles = [[0, 1, 2], [3, 4, 5], [0, 3, 5], [2, 4, 1]]
    for origin in ((0, 0), (-3, -2), (2 ** (61 - bits) - 9, 2 ** (61 - bits) - 9)):
        view = {"subpixel_bits": bits, "origin": origin}
        assert_exact(tl.wireframe(xy, triangles, (9, 8), **view), ref.wireframe(xy, triangles, (9, 8), **view))


def test_line_from_the_near_plane_to_the_eye_is_a_point():
    """Either end may lie on the plane."""
    for ends in ((0, 1, 0), (1, 0, 1)):
        scene = [[0, 0, -1], [0.9, 0, -2]], [ends], (3, 3)
        for draw in (tl.wireframe, ref.wireframe):
            assert rows(draw(*scene, transform=np.eye(4))) == ["...", ".1.", "..."]


@ON_EACH_ISA
def test_antialiased_equals_exact_distances(isa):
    for name in ("few_bits", "slivers", "snap_degenerates", "window_of_soup", "clip_soup", "floor"):
        scene = (PIXEL_SCENES | CLIP_SCENES)[name](np.random.default_rng(1), 6)
        exact = smooth_wireframe(*scene.arrays, **scene.view)
        with on(isa):
            got = tl.wireframe(*scene.arrays, antialias=True, **scene.view)
        assert got.dtype == np.float32
        assert abs(got - exact).max() <= COVERAGE_SLACK


@pytest.mark.parametrize("reach", [300, 2.0**18, 2.0**30, 2.0**52])
def test_antialiased_lines_of_any_length_equal_exact_distances(reach):
    rng = np.random.default_rng(5)
    xy = np.concatenate([rng.uniform(-reach, reach, (4, 2)), rng.uniform(0, 12, (4, 2))])
    triangles = rng.permuted(np.arange(8)[None].repeat(4, 0), axis=1)[:, :3]
    exact = ref.smooth_wireframe(xy, triangles, (12, 10))
    assert exact.any()
    assert abs(tl.wireframe(xy, triangles, (12, 10), antialias=True) - exact).max() <= COVERAGE_SLACK


def test_antialiased_is_the_same_everywhere():
    rng = np.random.default_rng(6)
    reach = rng.choice([2, 10, 60, 400, 2.0**20], (300, 1, 1), p=[0.4, 0.3, 0.2, 0.09, 0.01])
    mesh = soup((rng.uniform(0, 100, (300, 1, 2)) + rng.uniform(-1, 1, (300, 3, 2)) * reach).reshape(-1, 2), (90, 70))

    def draw(size, **view):
        return [tl.wireframe(mesh.vertices, mesh.triangles, size, antialias=True, **view)]

    assert_same_everywhere(draw, mesh.size, [((40, 30), (31, 22))], (1, 3))


# ---- what hides lines -----------------------------------------------------------------------------------------------


def test_depth_hides_what_lies_behind_by_more_than_the_bias():
    ends = [[0, 0, 0.0], [4, 0, 4.0]]  # depths 0 to 4 along a row
    wall = np.full((1, 5), 2, np.float32)
    assert rows(tl.wireframe(ends, [[0, 1, 0]], (5, 1), depth=wall, depth_bias=0)) == ["111.."]
    assert rows(tl.wireframe(ends, [[0, 1, 0]], (5, 1), depth=wall, depth_bias=1)) == ["1111."]
    assert rows(tl.wireframe(ends, [[0, 1, 0]], (5, 1), depth=wall, depth_bias=-1)) == ["11..."]
    assert rows(tl.wireframe(ends, [[0, 1, 0]], (5, 1), depth=wall, depth_bias=0, depth_test="greater")) == ["..111"]


@ON_EACH_ISA
@pytest.mark.parametrize("depth_test", ["less", "greater"])
def test_hidden_lines_equal_reference(depth_test, isa):
    for name in ("fan", "few_bits", "window_of_soup", "clip_soup", "floor"):
        scene = (PIXEL_SCENES | CLIP_SCENES)[name](np.random.default_rng(2), 8)
        scene = scene if name in CLIP_SCENES else with_depth(scene, np.random.default_rng(3))
        frags = tl.rasterize(*scene.arrays, depth_test=depth_test, **scene.view)
        hidden = {"depth_test": depth_test, "depth_bias": 2.0**-4}
        expected = wireframe(*scene.arrays, depth=frags.depth, **hidden, **scene.view)
        with on(isa):
            assert_exact(tl.wireframe(*scene.arrays, depth=frags, threads=2, **hidden, **scene.view), expected)


@ON_EACH_ISA
@pytest.mark.parametrize("depth_test", ["less", "greater"])
def test_hidden_antialiased_lines_equal_exact_distances(depth_test, isa):
    scene = CLIP_SCENES["clip_soup"](np.random.default_rng(2), 6)
    frags = tl.rasterize(*scene.arrays, depth_test=depth_test, **scene.view)
    hidden = {"depth": frags.depth, "depth_test": depth_test, "antialias": True}
    exact = smooth_wireframe(*scene.arrays, depth=frags.depth, depth_test=depth_test, **scene.view)
    with on(isa):
        assert abs(tl.wireframe(*scene.arrays, **hidden, **scene.view) - exact).max() <= COVERAGE_SLACK


# ---- the call -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("antialias", [False, True])
def test_wireframe_out_of_any_layout_and_rasterizer_give_the_same(antialias):
    expected = tl.wireframe(TRIANGLE, ONE, (5, 5), antialias=antialias)
    out = np.ones((5, 10), expected.dtype)[:, ::2]
    assert tl.wireframe(TRIANGLE, ONE, (5, 5), antialias=antialias, out=out) is out
    rasterizer = tl.Rasterizer((5, 5))
    again = rasterizer.wireframe(TRIANGLE, ONE, antialias=antialias)
    assert_same(out, expected)
    assert_same(again, expected)
    assert np.shares_memory(again, rasterizer.wireframe(TRIANGLE, ONE, antialias=antialias))


def test_wireframe_errors_name_the_argument():
    with pytest.raises(IndexError, match=r"row 1 is \[0, 1, 3\]"):
        tl.wireframe(TRIANGLE, [[0, 1, 2], [0, 1, 3]], (5, 5))
    with pytest.raises(ValueError, match=r"depth must have the shape of the picture, \(5, 4\), got \(4, 5\)"):
        tl.wireframe(TRIANGLE, ONE, (4, 5), depth=np.zeros((4, 5), np.float32))
    with pytest.raises(TypeError, match="depth must be Fragments or a float32 array, got dtype float64"):
        tl.wireframe(TRIANGLE, ONE, (5, 5), depth=np.zeros((5, 5)))
    with pytest.raises(ValueError, match="depth_bias must be finite, got nan"):
        tl.wireframe(TRIANGLE, ONE, (5, 5), depth_bias=np.nan)
    with pytest.raises(ValueError, match="depth_test must be one of"):
        tl.wireframe(TRIANGLE, ONE, (5, 5), depth_test="equal")
    with pytest.raises(ValueError, match="dtype float32, got"):
        tl.wireframe(TRIANGLE, ONE, (5, 5), antialias=True, out=np.zeros((5, 5), bool))
