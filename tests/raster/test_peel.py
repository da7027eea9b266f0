"""Depth peeling: every triangle that covers a centre, sorted, and nothing else."""

import numpy as np
import pytest
from comparing import assert_exact, assert_same
from engine_cases import ON_EACH_ISA, THREADS, assert_same_everywhere, kept, mixed, on
from strategies import CLIP_SCENES, PIXEL_SCENES, with_depth

import topleft as tl
from topleft._core.raster import peel as peel_module
from topleft.methods.reference import peel as ref

LAST = {"less": np.inf, "greater": -np.inf}
layers = kept(ref.layers)


@kept
def one_by_one(scene, depth_test, n):
    """The layers by definition: each triangle drawn alone, then all samples of a pixel sorted."""
    drawn = [
        tl.rasterize(scene.vertices, scene.triangles[i : i + 1], scene.size, **scene.view)
        for i in range(len(scene.triangles))
    ]
    depth = np.stack([frags.depth for frags in drawn], -1)
    ids = np.where(np.isfinite(depth), np.arange(len(drawn), dtype=np.int32), -1)
    nearness = np.where(ids < 0, np.inf, -depth if depth_test == "greater" else depth)
    order = np.argsort(nearness, axis=-1, kind="stable")[..., :n]
    ids, depth = (np.take_along_axis(array, order, -1) for array in (ids, depth))
    return ids.astype(np.int32), np.where(ids < 0, np.float32(LAST[depth_test]), depth).astype(np.float32)


@ON_EACH_ISA
@pytest.mark.parametrize("depth_test", LAST)
@pytest.mark.parametrize("name", PIXEL_SCENES)
def test_peel_ids_and_depths_are_those_of_the_reference(isa, name, depth_test):
    rng = np.random.default_rng(5)
    scene = with_depth(PIXEL_SCENES[name](rng), rng, flat=True)
    expected = layers(*scene.arrays, 5, depth_test=depth_test, **scene.view)
    with on(isa):
        got = tl.peel(*scene.arrays, layers=5, depth_test=depth_test, **scene.view)
    assert_exact(got.triangle, expected[0])
    assert_same(got.depth, expected[1])


@ON_EACH_ISA
@pytest.mark.parametrize("n", [1, 3, 16])
@pytest.mark.parametrize("depth_test", LAST)
def test_peel_all_sizes_are_the_triangles_drawn_one_by_one(isa, n, depth_test):
    scene = mixed(np.random.default_rng(n), 1200, (60, 40), level=n == 3, origin=(-7, 11))
    expected = one_by_one(scene, depth_test, n)
    assert (expected[0][..., min(n, 3) - 1] >= 0).sum() > 200
    with on(isa):
        for threads in THREADS:
            got = tl.peel(*scene.arrays, layers=n, depth_test=depth_test, threads=threads, **scene.view)
            assert_same(got.triangle, expected[0])
            assert_same(got.depth, expected[1])


@ON_EACH_ISA
@pytest.mark.parametrize("name", CLIP_SCENES)
def test_peel_clip_space_first_layer_is_the_visibility_buffer(isa, name):
    scene = CLIP_SCENES[name](np.random.default_rng(8))
    with on(isa):
        got, seen = tl.peel(*scene.arrays, layers=16, **scene.view), tl.rasterize(*scene.arrays, **scene.view)
        assert_same(got.layer(0).triangle, seen.triangle)
        assert_same(got.layer(0).depth, seen.depth)
        assert_same(got.count, np.minimum(tl.overdraw(*scene.arrays, **scene.view), 16))


def test_peel_each_layer_is_seen_when_those_before_are_gone():
    scene = mixed(np.random.default_rng(4), 2000, (40, 30))
    got = tl.peel(*scene.arrays, layers=4, **scene.view)
    assert got.count.max() == 4
    for row, col in [(3, 4), (10, 20), (25, 33), (14, 14), *np.argwhere(got.count == 4)[:4]]:
        gone = []
        for k in range(4):
            left = np.setdiff1d(np.arange(2000), gone)
            seen = tl.rasterize(scene.vertices, scene.triangles[left], scene.size, **scene.view)
            i = seen.triangle[row, col]
            assert got.triangle[row, col, k] == (left[i] if i >= 0 else -1)
            assert got.depth[row, col, k] == seen.depth[row, col]
            gone += [left[i]] if i >= 0 else []


def test_peel_is_the_same_everywhere():
    mesh = mixed(np.random.default_rng(3), 900, (120, 90))

    def draw(size, **view):
        found = tl.peel(mesh.vertices, mesh.triangles, size, layers=6, subpixel_bits=8, **view)
        return found.triangle, found.depth

    assert_same_everywhere(draw, mesh.size, [((33, 21), (50, 40))])


@pytest.mark.parametrize("options", [{"origin": (2**31, 2**31)}, {"method": "edge"}, {"method": "scanline"}])
def test_peel_without_bins_is_the_same(options):
    scene = mixed(np.random.default_rng(9), 500, (50, 40))
    expected = tl.peel(*scene.arrays, layers=3, **scene.view)
    moved = scene.vertices + np.array([*options.get("origin", (0, 0)), 0])
    got = tl.peel(moved, *scene.arrays[1:], layers=3, **(scene.view | options))
    assert_same(got.triangle, expected.triangle)


def test_peel_bands_of_any_height_are_the_same(monkeypatch):
    scene = mixed(np.random.default_rng(6), 900, (90, 70))
    expected = tl.peel(*scene.arrays, layers=5, **scene.view)
    for n_bytes in (1, 5000, 1 << 30):
        monkeypatch.setattr(peel_module, "BAND_BYTES", n_bytes)
        got = tl.peel(*scene.arrays, layers=5, **scene.view)
        assert_same(got.triangle, expected.triangle)
        assert_same(got.depth, expected.depth)


def test_peel_cull_leaves_triangles_out():
    quads = [[0, 0, 1], [2, 0, 1], [0, 2, 1], [0, 0, 0], [0, 2, 0], [2, 0, 0]]
    both = tl.peel(quads, [[0, 1, 2], [3, 4, 5]], (1, 1), layers=2)
    front = tl.peel(quads, [[0, 1, 2], [3, 4, 5]], (1, 1), layers=2, cull="back")
    assert (both.triangle.tolist(), front.triangle.tolist()) == ([[[1, 0]]], [[[1, -1]]])


def test_peel_flat_vertices_are_sorted_by_index():
    got = tl.peel([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]] * 3, (2, 1), layers=2)
    assert got.triangle.tolist() == [[[0, 1], [-1, -1]]]
    assert got.depth.tolist() == [[[0, 0], [np.inf, np.inf]]]


def test_peel_layer_has_the_attributes_of_its_triangle():
    scene = mixed(np.random.default_rng(7), 400, (30, 20))
    values = np.random.default_rng(1).random((len(scene.vertices), 2))
    got = tl.peel(*scene.arrays, layers=2, **scene.view)
    behind = got.layer(1)
    row, col = np.argwhere(behind.mask)[5]
    i = behind.triangle[row, col]
    alone = tl.rasterize(scene.vertices, scene.triangles[i : i + 1], scene.size, **scene.view)
    assert_same(behind.interpolate(values)[row, col], alone.interpolate(values)[row, col])


@pytest.mark.parametrize("size", [(0, 3), (3, 0)])
def test_peel_empty_picture_has_its_shape(size):
    assert tl.peel([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], size, layers=3).triangle.shape == (size[1], size[0], 3)


def test_peel_no_triangles_is_background():
    got = tl.peel(np.zeros((0, 3)), np.zeros((0, 3), int), (2, 1), layers=2)
    assert (got.triangle == -1).all()
    assert (got.depth == np.inf).all()
    assert (len(got), repr(got)) == (2, "DepthLayers(2x1, 2 layers, 0 triangles)")


@pytest.mark.parametrize("layers", [0, 17])
def test_peel_number_of_layers_outside_the_range_is_refused(layers):
    with pytest.raises(ValueError, match=f"layers must lie in 1 to 16, got {layers}"):
        tl.peel([[0, 0]], [[0, 0, 0]], (1, 1), layers=layers)


def test_peel_number_of_layers_that_is_none_is_refused():
    with pytest.raises(TypeError, match=r"layers must be an integer, got 2\.5"):
        tl.peel([[0, 0]], [[0, 0, 0]], (1, 1), layers=2.5)


@pytest.mark.parametrize("sampling", ["msaa4", "area", "outer"])
def test_peel_other_samplings_are_refused(sampling):
    with pytest.raises(ValueError, match=f"sampling '{sampling}' gives no sorted layers: peel takes 'center'"):
        tl.peel([[0, 0]], [[0, 0, 0]], (1, 1), sampling=sampling)


@pytest.mark.parametrize("method", ["auto", "edge"])
def test_peel_index_outside_the_vertices_is_refused(method):
    with pytest.raises(IndexError, match="triangles"):
        tl.peel([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2], [0, 1, 3]], (4, 4), method=method)
