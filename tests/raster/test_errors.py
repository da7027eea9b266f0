"""Each message names the argument, the wish and the fact; nothing is drawn before everything is checked."""

import re

import numpy as np
import pytest

import topleft as tl

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]
HALVES = [[0, 1, 2], [0, 2, 3]]
SIZE = (4, 4)


def raises(kind, message):
    return pytest.raises(kind, match=re.escape(message))


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        ([0, 1, 2], "vertices must have shape (V, 2), (V, 3) or (V, 4), got (3,)"),
        (np.zeros((4, 5)), "vertices must have shape (V, 2), (V, 3) or (V, 4), got (4, 5)"),
        ([[0, 0], [1]], "vertices must be array_like, got rows of different lengths"),
    ],
)
def test_vertices_of_wrong_shape_raise(vertices, message):
    with raises(ValueError, message):
        tl.coverage(vertices, HALVES, SIZE)


@pytest.mark.parametrize("vertices", [[["a", "b"]], np.zeros((4, 2), complex), np.zeros((4, 2), bool), [[None, None]]])
def test_vertices_of_wrong_dtype_raise(vertices):
    with raises(TypeError, "vertices must be real numbers, got dtype"):
        tl.coverage(vertices, [[0, 0, 0]], SIZE)


def test_vertices_with_transform_need_three_columns():
    with raises(ValueError, "vertices must have shape (V, 3) when transform is given, got (4, 2)"):
        tl.coverage(SQUARE, HALVES, SIZE, transform=np.eye(4))


@pytest.mark.parametrize("triangles", [[0, 1, 2], [[0, 1]], np.zeros((2, 3, 1), int)])
def test_triangles_of_wrong_shape_raise(triangles):
    with raises(ValueError, f"triangles must have shape (T, 3), got {np.shape(triangles)}"):
        tl.coverage(SQUARE, triangles, SIZE)


def test_triangles_of_floats_raise():
    with raises(TypeError, "triangles must be integers, got dtype float64"):
        tl.coverage(SQUARE, [[0.0, 1.0, 2.0]], SIZE)


@pytest.mark.parametrize("index", [-1, 4, 2**31, 2**32, 2**63 - 1])
def test_index_outside_the_vertices_names_the_row(index):
    triangles = np.array([[0, 1, 2], [0, index, 3]], np.int64)
    message = f"triangles must hold indices in [0, 4), the number of vertices; row 1 is [0, {index}, 3]"
    with raises(IndexError, message):
        tl.coverage(SQUARE, triangles, SIZE)


def test_uint64_index_outside_the_vertices_raises():
    with raises(IndexError, "row 0 is [0, 1, 18446744073709551615]"):
        tl.coverage(SQUARE, np.array([[0, 1, 2**64 - 1]], np.uint64), SIZE)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_vertex_not_finite_names_the_first_row(value):
    vertices = np.array(SQUARE, float)
    vertices[[2, 3], 1] = value
    with raises(ValueError, f"vertices must be finite where a triangle uses them, got [4.0, {value}] in row 2"):
        tl.coverage(vertices, [[1, 0, 3], [0, 1, 2]], SIZE)


@pytest.mark.parametrize("bits", [0, 8, 16])
def test_vertex_beyond_the_fixed_point_range_names_the_row(bits):
    vertices = np.array(SQUARE, float)
    vertices[1, 0] = 2.0 ** (62 - bits)
    message = f"vertices must lie within 2**{62 - bits} pixels of 0 with {bits} sub-pixel bits"
    with raises(ValueError, message) as caught:
        tl.coverage(vertices, HALVES, SIZE, subpixel_bits=bits)
    assert "row 1" in str(caught.value)
    vertices[1, 0] = np.nextafter(vertices[1, 0], 0)
    assert tl.coverage(vertices, HALVES, SIZE, subpixel_bits=bits)[0].all()


@pytest.mark.parametrize("value", [2**54, -(2**54), 2**63 - 1, -(2**63)])
@pytest.mark.parametrize("axis", [0, 1])
def test_integer_vertex_beyond_the_fixed_point_range_raises(value, axis):
    with raises(ValueError, "vertices must lie within 2**54 pixels of 0"):
        tl.coverage(np.roll([[0, 0], [value, 0], [0, 4]], axis, 1), [[0, 1, 2]], SIZE)


def test_uint64_vertex_beyond_int64_raises():
    with raises(ValueError, "vertices must lie within 2**54 pixels of 0"):
        tl.coverage(np.array([[0, 0], [2**64 - 1, 0], [0, 4]], np.uint64), [[0, 1, 2]], SIZE)


@pytest.mark.parametrize("x_px", [4, 2.0**40])
@pytest.mark.parametrize("depth", [np.nan, np.inf, 1e300])
def test_depth_that_float32_cannot_hold_raises_only_where_depth_is_used(depth, x_px):
    vertices = [[0, 0, 0], [x_px, 0, depth], [0, 4, 0]]
    assert tl.coverage(vertices, [[0, 1, 2]], SIZE).any()
    with pytest.raises(ValueError, match="in row 1"):
        tl.rasterize(vertices, [[0, 1, 2]], SIZE)


def test_clip_vertex_not_finite_names_the_row():
    vertices = np.eye(4)
    vertices[3, 3] = np.inf
    with raises(ValueError, "got [0.0, 0.0, 0.0, inf] in row 3"):
        tl.coverage(vertices, [[0, 1, 3]], SIZE)


def test_transform_that_overflows_names_the_row():
    vertices = np.array([[0, 0, 0], [3e38, 0, 0], [0, 1, 0]], np.float32)
    with raises(ValueError, "vertices must stay finite under transform"):
        tl.coverage(vertices, [[0, 1, 2]], SIZE, transform=np.diag([10, 1, 1, 1]))


@pytest.mark.parametrize(
    ("transform", "kind", "message"),
    [
        (np.eye(3), ValueError, "transform must have shape (4, 4), got (3, 3)"),
        (np.full((4, 4), np.nan), ValueError, "transform must be finite"),
        (np.full((4, 4), "x"), TypeError, "transform must be real numbers"),
        (np.full((4, 4), 1e300), ValueError, "transform must fit float32"),
    ],
)
def test_bad_transform_raises(transform, kind, message):
    with raises(kind, message):
        tl.coverage(np.zeros((3, 3), np.float32), [[0, 1, 2]], SIZE, transform=transform)


def test_vertices_that_no_triangle_uses_are_never_looked_at():
    vertices = np.array([*SQUARE, [np.nan, 0], [np.inf, 1e300]])
    assert tl.coverage(vertices, HALVES, SIZE).all()
    clip = np.array([[-1, 1, 0, 1], [1, 1, 0, 1], [1, -1, 0, 1], [-1, -1, 0, 1], [np.nan] * 4])
    assert tl.coverage(clip, HALVES, SIZE).all()


@pytest.mark.parametrize(
    ("size", "kind", "message"),
    [
        ("4", TypeError, "size must be two integers (width, height), or one for a square, got '4'"),
        (-1, ValueError, "size must be (width, height) in 0..2147483647, got (-1, -1)"),
        ((4.5, 4), TypeError, "size must be two integers (width, height), or one for a square, got (4.5, 4)"),
        ((4, -1), ValueError, "size must be (width, height) in 0..2147483647, got (4, -1)"),
        ((1, 2, 3), TypeError, "got (1, 2, 3); the shape of a picture begins with its height: image.shape[1::-1] is"),
    ],
)
def test_bad_size_raises(size, kind, message):
    with raises(kind, message):
        tl.coverage(SQUARE, HALVES, size)


SAMPLINGS = "'center', 'msaa2', 'msaa4', 'msaa8', 'msaa16', 'area', 'outer', 'inner'"


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"sampling": "msaa3"}, ValueError, f"sampling must be one of {SAMPLINGS}, got 'msaa3'"),
        ({"method": "magic"}, ValueError, "method must be one of 'auto', 'edge', 'scanline', got 'magic'"),
        ({"cull": True}, ValueError, "cull must be one of 'none', 'back', 'front', got True"),
        ({"clip_depth": "gl"}, ValueError, "clip_depth must be one of 'minus_one_to_one', 'zero_to_one', got 'gl'"),
        ({"subpixel_bits": 17}, ValueError, "subpixel_bits must be in 0..16, got 17"),
        ({"subpixel_bits": 8.0}, TypeError, "subpixel_bits must be an integer, got 8.0"),
        ({"origin": (0.5, 0)}, TypeError, "origin must be two integers, got (0.5, 0)"),
        ({"origin": (2**53, 0)}, ValueError, "origin must lie within 9007199254740992 pixels of 0"),
        ({"viewport": (0, 4)}, ValueError, "viewport must be (width, height) in 1..2147483647, got (0, 4)"),
        ({"threads": 0}, ValueError, "threads must be at least 1, got 0"),
        ({"threads": 1.5}, TypeError, "threads must be an integer or None, got 1.5"),
        ({"treads": 2}, TypeError, "unknown option 'treads'; the options are origin, viewport, "),
    ],
)
def test_bad_option_raises(options, kind, message):
    with raises(kind, message):
        tl.coverage(SQUARE, HALVES, SIZE, **options)


def test_option_of_another_type_raises_after_an_equal_one_was_taken():
    tl.coverage(SQUARE, HALVES, SIZE, subpixel_bits=8, threads=1)
    for options in ({"subpixel_bits": 8.0, "threads": 1}, {"subpixel_bits": 8, "threads": 1.0}):
        with raises(TypeError, "must be an integer"):
            tl.coverage(SQUARE, HALVES, SIZE, **options)


def test_bad_number_of_threads_in_the_environment_raises(monkeypatch):
    monkeypatch.setenv("TOPLEFT_NUM_THREADS", "many")
    with raises(ValueError, "TOPLEFT_NUM_THREADS must be a positive integer, got 'many'"):
        tl.coverage(SQUARE, HALVES, SIZE)


@pytest.mark.parametrize(
    ("out", "kind", "message"),
    [
        ([[False]], TypeError, "out must be a NumPy array, got list"),
        (np.zeros((4, 5), bool), ValueError, "out must have shape (4, 4) and dtype bool, got (4, 5) and bool"),
        (np.zeros((4, 4), np.int8), ValueError, "out must have shape (4, 4) and dtype bool, got (4, 4) and int8"),
    ],
)
def test_bad_out_raises(out, kind, message):
    with raises(kind, message):
        tl.coverage(SQUARE, HALVES, SIZE, out=out)


def test_read_only_out_raises():
    out = np.zeros((4, 4), bool)
    out.flags.writeable = False
    with raises(ValueError, "out must be writeable, got a read-only array"):
        tl.coverage(SQUARE, HALVES, SIZE, out=out)


def test_error_leaves_out_as_it_was():
    out = np.full((4, 4, 3), 7, np.uint8)
    with pytest.raises(IndexError):
        tl.fill(SQUARE, [[0, 1, 2], [0, 1, 9]], np.zeros((2, 3), np.uint8), SIZE, out=out)
    with pytest.raises(ValueError, match="finite"):
        tl.fill([*SQUARE, [np.nan, 0]], [[0, 1, 2], [0, 1, 4]], np.zeros((2, 3), np.uint8), SIZE, out=out)
    assert (out == 7).all()


@pytest.mark.parametrize(
    ("colors", "options", "kind", "message"),
    [
        (np.zeros((3, 3)), {}, ValueError, "colors must have 2 rows, one per triangle, or 4, one per vertex, got 3"),
        (np.zeros((4, 3)), {"per": "triangle"}, ValueError, "colors must have 2 rows, one per triangle, got 4"),
        (np.zeros((2, 3)), {"per": "vertex"}, ValueError, "colors must have 4 rows, one per vertex, got 2"),
        (np.zeros((2, 5)), {}, ValueError, "with C in 1..4, got (2, 5)"),
        (np.zeros((2, 0)), {}, ValueError, "with C in 1..4, got (2, 0)"),
        ([[0, 0, 256], [0, 0, 0]], {}, ValueError, "colors must lie in 0..255 when they are integers, got 0..256"),
        ([["r"], ["g"]], {}, TypeError, "colors must be uint8 or float32, got dtype"),
        (np.zeros((2, 3)), {"per": "face"}, ValueError, "per must be one of 'auto', 'triangle', 'vertex', got 'face'"),
        (np.zeros((2, 3), int), {"background": 300}, ValueError, "background must be whole numbers in 0..255"),
        (np.zeros((2, 3)), {"background": [1, 2]}, ValueError,
         "background must be one number or have shape (3,), got (2,)"),
        (np.zeros((2, 3)), {"background": "red"}, TypeError, "background must be real numbers"),
    ],
)  # fmt: skip
def test_bad_colors_raise(colors, options, kind, message):
    with raises(kind, message):
        tl.fill(SQUARE, HALVES, colors, SIZE, **options)


def test_colors_that_fit_both_raise_unless_told():
    ring = [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]]
    colors = np.full((4, 1), 5, np.uint8)
    with raises(ValueError, "colors has 4 rows, and there are as many triangles as vertices: say per="):
        tl.fill(SQUARE, ring, colors, SIZE)
    assert (
        tl.fill(SQUARE, ring, colors, SIZE, per="vertex") == tl.fill(SQUARE, ring, colors, SIZE, per="triangle")
    ).all()


def test_bad_depth_test_raises():
    with raises(ValueError, "depth_test must be one of 'less', 'greater', got 'never'"):
        tl.rasterize(SQUARE, HALVES, SIZE, depth_test="never")


def test_rasterize_out_that_is_no_pair_raises():
    with raises(TypeError, "out must be a pair (triangle, depth) of arrays, got int"):
        tl.rasterize(SQUARE, HALVES, SIZE, out=3)


def test_rasterize_out_of_one_memory_raises():
    ids = np.zeros(SIZE[::-1], np.int32)
    with raises(ValueError, "out must be two arrays, got a pair that shares memory"):
        tl.rasterize(SQUARE, HALVES, SIZE, out=(ids, ids.view(np.float32)))
    both = np.zeros(SIZE[::-1], [("id", np.int32), ("depth", np.float32)])
    tl.rasterize(SQUARE, HALVES, SIZE, out=(both["id"], both["depth"]))
    assert np.array_equal(both["id"], tl.rasterize(SQUARE, HALVES, SIZE).triangle)


@pytest.mark.parametrize("values", [np.zeros(3), np.zeros((2, 3)), np.zeros((4, 3, 1)), np.zeros((2, 3, 1, 1)), 5.0])
def test_values_of_wrong_shape_raise(values):
    frags = tl.rasterize(SQUARE, HALVES, SIZE)
    with raises(ValueError, "values must have shape (V,), (V, K) or (T, 3, K) with V = 4 and T = 2, got"):
        frags.interpolate(values)


def test_values_of_wrong_dtype_raise():
    with raises(TypeError, "values must be real numbers, got dtype"):
        tl.rasterize(SQUARE, HALVES, SIZE).interpolate(["a", "b", "c", "d"])


@pytest.mark.parametrize("verb", ["coverage", "overdraw", "rasterize", "wireframe", "peel"])
@pytest.mark.parametrize("size", [(2**31 - 1, 2**31 - 1), (2**31 - 1, 2**20)])
def test_a_picture_that_no_memory_holds_is_refused_with_the_bytes(verb, size):
    words = r"no memory for (an array|2 arrays) of [\d,]+ bytes( together)?, which this size or scene needs"
    with pytest.raises(MemoryError, match=words):
        getattr(tl, verb)([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]], size)
