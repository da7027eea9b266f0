"""What goes in and what comes out: empty scenes, `out=`, kept memory, colours, backgrounds."""

import numpy as np
import pytest

import topleft as tl
from topleft._core.base import arrays, threads
from topleft._core.base.memory import FreshMemory
from topleft._core.raster import classic
from topleft._core.raster.rasterize import Canvas
from topleft.methods import CLASSICS, load_kernel

SQUARE = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], float)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
LEFT = [[0, 3, 1]]  # the half of the square at the top left corner
SIZE = (4, 4)
LEFT_MASK = np.array([[1, 1, 1, 0], [1, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]], bool)


@pytest.mark.parametrize("size", [(0, 0), (0, 3), (3, 0), (5, 3)])
@pytest.mark.parametrize(("vertices", "triangles"), [([], []), (SQUARE, []), (np.empty((0, 4)), np.empty((0, 3), int))])
def test_scene_without_triangles_gives_empty_pictures(size, vertices, triangles):
    shape = size[::-1]
    frags = tl.rasterize(vertices, triangles, size)
    np.testing.assert_array_equal(frags.triangle, np.full(shape, -1, np.int32))
    np.testing.assert_array_equal(frags.depth, np.full(shape, np.inf, np.float32))
    np.testing.assert_array_equal(frags.mask, np.zeros(shape, bool))
    np.testing.assert_array_equal(frags.barycentric(), np.zeros((*shape, 3), np.float32))
    np.testing.assert_array_equal(tl.coverage(vertices, triangles, size), np.zeros(shape, bool))
    np.testing.assert_array_equal(tl.overdraw(vertices, triangles, size), np.zeros(shape, np.int32))
    colors = np.zeros((len(triangles), 3), np.uint8)
    np.testing.assert_array_equal(tl.fill(vertices, triangles, colors, size), np.zeros((*shape, 3), np.uint8))


@pytest.mark.parametrize("size", [(0, 0), (0, 3), (3, 0)])
def test_frame_without_pixels_gives_empty_pictures_of_that_shape(size):
    shape = size[::-1]
    frags = tl.rasterize(SQUARE, HALVES, size)
    assert frags.triangle.shape == frags.depth.shape == tl.coverage(SQUARE, HALVES, size).shape == shape
    assert frags.interpolate(np.zeros((2, 3, 5))).shape == (*shape, 5)
    assert tl.fill(SQUARE, HALVES, np.zeros((2, 3)), size).shape == (*shape, 3)


@pytest.mark.parametrize("layout", ["C", "F", "strided", "reversed"])
def test_out_of_any_layout_is_filled_and_returned(layout):
    store = np.ones((8, 8), bool, order="F" if layout == "F" else "C")
    out = {"strided": store[::2, 1::2], "reversed": store[3::-1, 3::-1]}.get(layout, store[:4, :4])
    result = tl.coverage(SQUARE, LEFT, SIZE, out=out)
    assert result is out
    np.testing.assert_array_equal(out, LEFT_MASK)
    assert store.sum() == 64 - 16 + 6


def unaligned(array):
    """A copy that begins one byte behind where its dtype wants to."""
    copy = np.zeros(array.nbytes + 1, np.uint8)[1:].view(array.dtype).reshape(array.shape)
    copy[...] = array
    return copy


@pytest.mark.parametrize(
    ("coerce", "values"),
    [
        (lambda a: arrays.as_vertices(a, has_transform=False), SQUARE),
        (arrays.as_triangles, HALVES),
        (arrays.as_triangles, HALVES.astype(np.int32)),
        (arrays.as_transform, np.eye(4)),
        (arrays.as_colors, SQUARE.astype(np.float32)),
        (lambda a: arrays.as_values(a, 4, 2), SQUARE.astype(np.float32)),
    ],
)
def test_unaligned_array_comes_to_the_kernels_aligned(coerce, values):
    result = coerce(unaligned(values))
    assert result.flags.aligned
    np.testing.assert_array_equal(result, values)


def test_unaligned_out_is_filled_through_an_aligned_canvas():
    ids, depth = unaligned(np.zeros((4, 4), np.int32)), unaligned(np.zeros((4, 4), np.float32))
    with Canvas.of(FreshMemory(), "triangle", ids, (4, 4), np.int32) as (result, canvas):
        assert canvas.flags.aligned
    frags = tl.rasterize(SQUARE, LEFT, SIZE, out=(ids, depth))
    assert result is frags.triangle is ids
    np.testing.assert_array_equal(ids, np.where(LEFT_MASK, 0, -1))
    np.testing.assert_array_equal(depth, np.where(LEFT_MASK, 0, np.inf))
    np.testing.assert_array_equal(frags.barycentric().sum(-1), LEFT_MASK)


def test_unaligned_out_of_a_classic_is_filled_through_an_aligned_canvas(monkeypatch):
    draw, variant = load_kernel(CLASSICS["zigzag"])
    addresses = []

    def draw_there(points, corners, pixels, *how):
        addresses.append(pixels.ctypes.data)
        draw(points, corners, pixels, *how)

    monkeypatch.setattr(classic, "load_kernel", lambda _: (draw_there, variant))
    counts = unaligned(np.full((4, 4), 9, np.int32))
    assert tl.overdraw(SQUARE, LEFT, SIZE, method="zigzag", out=counts) is counts
    assert [address % 4 for address in addresses] == [0]
    np.testing.assert_array_equal(counts, tl.overdraw(SQUARE, LEFT, SIZE, method="zigzag"))


@pytest.mark.parametrize("n_channels", [None, 1, 2, 3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_flat_fill_draws_over_out_and_shows_it_elsewhere(n_channels, dtype):
    shape = () if n_channels is None else (n_channels,)
    color = np.arange(10, 10 + (n_channels or 1)).reshape(shape).astype(dtype)
    out = np.full((4, 4, *shape), 7, dtype)
    tl.fill(SQUARE, LEFT, color[None], SIZE, out=out)
    np.testing.assert_array_equal(out[LEFT_MASK], np.broadcast_to(color, (6, *shape)))
    assert (out[~LEFT_MASK] == 7).all()


@pytest.mark.parametrize(
    ("dtype", "expected"), [(np.float64, np.float32), (np.float16, np.float32), (np.int64, np.uint8)]
)
def test_fill_colors_of_other_dtypes_become_float32_or_uint8(dtype, expected):
    picture = tl.fill(SQUARE, HALVES, np.array([[1, 2, 3], [4, 5, 6]], dtype), SIZE)
    assert picture.dtype == expected
    assert picture[3, 0].tolist() == [4, 5, 6]


@pytest.mark.parametrize(("depth_test", "empty"), [("less", np.inf), ("greater", -np.inf), (None, np.inf)])
def test_background_depth_stands_where_nothing_is(depth_test, empty):
    assert tl.rasterize(SQUARE, LEFT, SIZE, depth_test=depth_test).depth[3, 3] == empty
    frags = tl.rasterize(SQUARE, LEFT, SIZE, depth_test=depth_test, background_depth=5)
    np.testing.assert_array_equal(frags.depth, np.where(LEFT_MASK, 0, 5))


def test_rasterizer_gives_the_same_and_reuses_its_memory():
    rasterizer = tl.Rasterizer(SIZE)
    first = rasterizer.coverage(SQUARE, HALVES)
    assert first.all()
    second = rasterizer.coverage(SQUARE, LEFT)
    assert np.shares_memory(first, second)
    np.testing.assert_array_equal(second, LEFT_MASK)
    np.testing.assert_array_equal(rasterizer.overdraw(SQUARE, LEFT), LEFT_MASK)
    np.testing.assert_array_equal(rasterizer.fill(SQUARE, LEFT, [3]), 3 * LEFT_MASK)
    np.testing.assert_array_equal(rasterizer.rasterize(SQUARE, LEFT).mask, LEFT_MASK)


def test_module_level_calls_keep_scratch_until_it_is_released():
    from topleft._core.base import memory

    tl.release_memory()
    tl.fill(SQUARE, HALVES, [1, 2], SIZE)
    kept = memory.SCRATCH.threads.kept._blocks
    assert set(kept) == {"labels", "records", "triangles"}
    records = kept["records"]
    tl.coverage(SQUARE, LEFT, SIZE)
    assert kept["records"] is records
    tl.release_memory()
    assert memory.SCRATCH.threads.kept is None


def test_module_level_calls_do_not_keep_more_than_the_bound(monkeypatch):
    from topleft._core.base import memory

    tl.release_memory()
    monkeypatch.setattr(memory, "MAX_SCRATCH_BYTES", 63)
    tl.fill(SQUARE, HALVES, [1, 2], SIZE)  # 4 records of 16 bytes, 16 labels of 4, 6 indices of 4
    assert set(memory.SCRATCH.threads.kept._blocks) == {"triangles"}
    tl.release_memory()


@pytest.mark.parametrize("n_bytes", [0, 1, 4 << 20, (4 << 20) + 1, 9_000_001])
def test_large_memory_is_aligned_to_huge_pages(n_bytes):
    from topleft._core.base.memory import allocate

    block = allocate(n_bytes)
    assert block.size >= n_bytes
    assert n_bytes < 4 << 20 or block.ctypes.data % (2 << 20) == 0


def test_attributes_survive_a_change_of_the_inputs():
    vertices, triangles = SQUARE.copy(), HALVES.astype(np.int32)
    frags = tl.rasterize(vertices, triangles, SIZE)
    expected = frags.barycentric()
    vertices[:] = np.nan
    np.testing.assert_array_equal(frags.barycentric(), expected)


def test_attributes_of_one_id_and_one_index_too_many_are_empty():
    triangles = HALVES.astype(np.int32)
    frags = tl.rasterize(SQUARE, triangles[:1], SIZE)
    frags.triangle[0, 3] = 1  # a row of the array behind the one that was drawn
    assert (frags.barycentric()[0, 3] == 0).all()
    triangles[0] = [0, 1, 4]
    assert (frags.barycentric() == 0).all()


def test_environment_sets_the_number_of_threads(monkeypatch):
    monkeypatch.setenv("TOPLEFT_NUM_THREADS", "5")
    assert threads.available_threads() == 5


def test_float16_vertices_are_transformed_in_float64():
    rng = np.random.default_rng(5)
    vertices, matrix = rng.uniform(-1, 1, (90, 3)).astype(np.float16), np.eye(4) + rng.uniform(-0.2, 0.2, (4, 4))
    triangles = np.arange(90).reshape(-1, 3)
    half = tl.rasterize(vertices, triangles, (32, 32), transform=matrix)
    double = tl.rasterize(vertices.astype(np.float64), triangles, (32, 32), transform=matrix)
    np.testing.assert_array_equal(half.depth, double.depth)
