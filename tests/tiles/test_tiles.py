"""Windows of huge rasters: stitched together they are the whole, to the bit."""

import itertools
import os
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import topleft as tl

RNG = np.random.default_rng(20)
POINTS = RNG.uniform(-10, 90, (60, 3))
TRIANGLES = RNG.integers(0, 60, (50, 3)).astype(np.int32)
SIZE = (83, 61)
GRID = tl.Grid(SIZE, (0.0, 83.0 / 3, 10.0, 10.0 + 61.0 / 3))
COLORS = RNG.integers(0, 256, (50, 4)).astype(np.uint8)
OF_VERTICES = RNG.normal(size=60)
IN_PIXELS = np.column_stack([GRID.to_pixels(POINTS), POINTS[:, 2]])


def stitched(raster):
    """The raster, put together of its windows."""
    whole = np.empty(raster.shape, raster.dtype)
    for window in raster:
        whole[window.slices] = window.pixels
    return whole


def same(found, wished):
    """Whether arrays have the same bytes."""
    return found.dtype == wished.dtype and found.shape == wished.shape and found.tobytes() == wished.tobytes()


#: The verb that draws the whole, by what tiles are asked for.
VERBS = {
    "labels": lambda **how: tl.rasterize(IN_PIXELS, TRIANGLES, SIZE, **how).triangle,
    "depth": lambda **how: tl.rasterize(IN_PIXELS, TRIANGLES, SIZE, **how).depth,
    "coverage": lambda **how: tl.coverage(IN_PIXELS, TRIANGLES, SIZE, **how),
    "overdraw": lambda **how: tl.overdraw(IN_PIXELS, TRIANGLES, SIZE, **how),
    "fill": lambda values, **how: tl.fill(IN_PIXELS, TRIANGLES, values, SIZE, **how),
    "field": lambda values, **how: tl.field((POINTS, TRIANGLES), values, GRID, **how),
    "height_map": lambda **how: tl.height_map((POINTS, TRIANGLES), GRID, **how),
}

#: Options of each, by a name that begins with the verb's.
KINDS = {
    "labels": {},
    "labels farthest": {"depth_test": "greater"},
    "labels later": {"depth_test": None},
    "depth": {"background_depth": 7.5},
    "coverage": {},
    "coverage area": {"sampling": "area"},
    "coverage msaa4": {"sampling": "msaa4"},
    "coverage outer": {"sampling": "outer"},
    "coverage inner": {"sampling": "inner"},
    "overdraw": {},
    "overdraw area": {"sampling": "area"},
    "fill": {"values": COLORS, "background": (1, 2, 3, 4)},
    "fill over": {"values": COLORS, "blend": "over"},
    "fill area": {"values": COLORS, "sampling": "area"},
    "fill vertices": {"values": OF_VERTICES},
    "fill labels": {"values": np.arange(50) + 70000, "dtype": np.int32, "background": -5},
    "labels exact": {"subpixel_bits": "exact"},
    "labels later exact": {"depth_test": None, "subpixel_bits": "exact"},
    "depth exact": {"subpixel_bits": "exact"},
    "coverage exact": {"subpixel_bits": "exact"},
    "overdraw exact": {"subpixel_bits": "exact"},
    "field exact": {"values": OF_VERTICES, "subpixel_bits": "exact"},
    "height_map exact": {"subpixel_bits": "exact"},
    "fill exact": {"values": COLORS, "subpixel_bits": "exact"},
    "field": {"values": OF_VERTICES},
    "field of faces": {"values": np.arange(50, dtype=np.int16), "nodata": -1},
    "field of vectors": {"values": IN_PIXELS[:, :2].astype(np.float32)},
    "field of vectors of faces": {"values": np.arange(150, dtype=np.int16).reshape(50, 3), "nodata": -1},
    "height_map": {},
    "height_map lower": {"surface": "lower"},
}


def asked(name, **view):
    """What tiles are asked for, and the whole that the verb draws."""
    kind, options = name.split()[0], KINDS[name] | view
    return {"kind": kind, **options}, VERBS[kind](**options)


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("window", [7, (32, 16), 100])
def test_stitched_windows_are_the_whole(name, window):
    options, wished = asked(name)
    raster = tl.tiles((POINTS, TRIANGLES), GRID, window=window, **options)
    assert (raster.shape, raster.dtype) == (wished.shape, wished.dtype)
    assert same(stitched(raster), wished)


@pytest.mark.parametrize("name", ["labels", "coverage", "overdraw area", "fill"])
@pytest.mark.parametrize("view", [{"subpixel_bits": 0}, {"subpixel_bits": 16}, {"cull": "back"}])
def test_options_of_verbs_are_kept(name, view):
    options, wished = asked(name, **view)
    assert same(stitched(tl.tiles((POINTS, TRIANGLES), GRID, window=16, **options)), wished)


@given(
    seed=st.integers(0, 2**32),
    size=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    window=st.tuples(st.integers(1, 45), st.integers(1, 45)),
    scale=st.sampled_from([3.0, 40.0, 1e5, 1e9, 1e14]),
    flat=st.booleans(),
    threads=st.sampled_from([1, 3]),
)
@settings(max_examples=60, deadline=None)
def test_any_window_of_any_mesh_is_the_crop(seed, size, window, scale, flat, threads):
    rng = np.random.default_rng(seed)
    points = rng.normal(20, scale, (12, 3))
    points[:4, :2] = rng.integers(-50, 90, (4, 2)) / 2  # on pixel centres and corners
    if flat:
        points[:, 2] = 0.25
    triangles = rng.integers(0, 12, (14, 3))
    for options, wished in (
        ({"kind": "labels"}, tl.rasterize(points, triangles, size).triangle),
        ({"kind": "depth"}, tl.rasterize(points, triangles, size).depth),
        ({"kind": "coverage", "sampling": "outer"}, tl.coverage(points, triangles, size, sampling="outer")),
        ({"kind": "overdraw"}, tl.overdraw(points, triangles, size)),
    ):
        assert same(stitched(tl.tiles((points, triangles), size, window=window, threads=threads, **options)), wished)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.int64])
def test_vertices_in_pixels_keep_their_dtype(dtype):
    points = (IN_PIXELS * 1.25).astype(dtype)
    wished = tl.rasterize(points, TRIANGLES, SIZE).triangle
    assert same(stitched(tl.tiles((points, TRIANGLES), SIZE, window=20)), wished)


@pytest.mark.parametrize("corner", [1e7, 2.0**22, 2.0**30, 2.0**31 - 200])
def test_windows_far_from_the_origin_agree_to_the_bit(corner):
    """Beyond 2**22 px vertices take the 128-bit path with 8 sub-pixel bits."""
    rng = np.random.default_rng(3)
    points = rng.uniform(0, 100, (40, 3)) + [corner, corner / 2, 0]
    triangles = rng.integers(0, 40, (60, 3))
    x, y = int(corner), int(corner / 2)
    raster = tl.tiles((points, triangles), (2**31 - 1, 2**31 - 1), window=(1 << 20, 1 << 20))
    wished = tl.rasterize(points, triangles, (90, 80), origin=(x + 3, y + 5)).triangle
    assert (wished >= 0).any()
    assert same(raster[y + 5 : y + 85, x + 3 : x + 93], wished)
    parts = [raster[y + 5 + r : y + 25 + r, x + 3 : x + 93] for r in range(0, 80, 20)]
    assert same(np.concatenate(parts), wished)


def test_far_coordinates_on_a_grid_lose_nothing():
    """UTM at a millimetre: the difference to the corner is taken before anything is rounded."""
    rng = np.random.default_rng(4)
    points = rng.uniform(0, 0.2, (40, 3)) + [500000.0, 5.5e6, 0]
    triangles = rng.integers(0, 40, (60, 3))
    grid = tl.Grid((10_000_000, 9_000_000), (490000.0, 500000.2, 5.4955e6, 5.5045e6))
    raster = tl.tiles((points, triangles), grid, window=1 << 16)
    (x0, y0), (x1, y1) = grid.to_pixels(points).min(axis=0).astype(int), grid.to_pixels(points).max(axis=0).astype(int)
    whole = tl.rasterize(
        np.column_stack([grid.to_pixels(points), points[:, 2]]), triangles, (x1 - x0, y1 - y0), origin=(x0, y0)
    ).triangle
    assert same(raster[y0:y1, x0:x1], whole)


def test_slices_are_those_of_the_whole():
    raster = tl.tiles((POINTS, TRIANGLES), GRID, window=16)
    whole = tl.rasterize(IN_PIXELS, TRIANGLES, SIZE).triangle
    for key in [
        np.s_[:], np.s_[3], np.s_[-1, -2], np.s_[5:40, 7:70], np.s_[::3, 4::5], np.s_[..., 2:9], np.s_[60:10],
        np.s_[10:10, :], np.s_[-20:, :-30],
    ]:  # fmt: skip
        assert np.array_equal(raster[key], whole[key]), key
    colors = tl.tiles((POINTS, TRIANGLES), GRID, kind="fill", values=COLORS, window=16)
    assert np.array_equal(colors[3:9, 4, 1], tl.fill(IN_PIXELS, TRIANGLES, COLORS, SIZE)[3:9, 4, 1])
    with pytest.raises(IndexError, match="steps of slices of a raster must be positive"):
        raster[::-1]
    with pytest.raises(IndexError, match=r"a raster of shape \(61, 83\) has no 3 indices"):
        raster[1, 2, 3]


def test_reused_windows_are_the_same():
    raster = tl.tiles((POINTS, TRIANGLES), GRID, window=(30, 20), kind="field", values=OF_VERTICES)
    fresh = list(raster)
    for kept, window in itertools.zip_longest(raster.windows(reuse=True), fresh):
        assert same(np.ascontiguousarray(kept.pixels), window.pixels)
    assert (repr(fresh[-1]), fresh[-1].n_triangles > 0) == ("Window(row 3, column 2: 23x1 at (60, 60))", True)


def test_windows_without_triangles_are_blank():
    raster = tl.tiles(([[50.0, 50], [60, 50], [50, 60]], [[0, 1, 2]]), (1000, 1000), window=100)
    drawn = [(window.row, window.column) for window in raster if window.n_triangles]
    assert drawn == [(0, 0)]
    assert (raster[500:600, 500:600] == -1).all()


@pytest.mark.parametrize("points", [[[-50.0, -50], [-10, -50], [-50, -10]], [[1e12, 0], [2e12, 5], [1e12, 9]]])
def test_triangles_outside_everywhere_draw_nothing(points):
    raster = tl.tiles((points, [[0, 1, 2]]), (64, 64), window=16)
    assert (stitched(raster) == -1).all()
    assert raster.index.n_spans == 0


@pytest.mark.parametrize("size", [(0, 5), (5, 0), (0, 0)])
def test_raster_without_pixels_has_no_windows(size):
    raster = tl.tiles((POINTS, TRIANGLES), size)
    assert (list(raster), raster[:].shape) == ([], size[::-1])


def test_mesh_without_triangles_is_blank():
    raster = tl.tiles((np.empty((0, 2)), np.empty((0, 3), int)), (20, 10), kind="overdraw", window=8)
    assert same(stitched(raster), np.zeros((10, 20), np.int32))


def test_explain_counts_windows_and_spans():
    text = tl.tiles((POINTS, TRIANGLES), GRID, window=16).explain()
    assert text.startswith("Tiles(labels: 83x61 int32, 6x4 windows of 16x16 pixels, 50 triangles)\n")
    assert "index: " in text
    assert "in memory" in text


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"window": 0}, ValueError, r"window must be \(width, height\) in 1..2147483647, got \(0, 0\)"),
        ({"window": (5, -1)}, ValueError, "window must be"),
        ({"kind": "edges"}, ValueError, "kind must be "),
        ({"kind": "fill"}, ValueError, "kind 'fill' needs values"),
        ({"kind": "field"}, ValueError, "kind 'field' needs values"),
        ({"kind": "labels", "values": COLORS}, ValueError, "values are for the kinds 'fill' and 'field'"),
        ({"kind": "labels", "transform": np.eye(4)}, TypeError, "kind 'labels' has no option 'transform'; its options"),
        ({"kind": "coverage", "sampling": "often"}, ValueError, "sampling must be one of"),
        ({"kind": "overdraw", "sampling": "msaa4"}, ValueError, "sampling must be of one number a pixel"),
        ({"kind": "depth", "depth_test": "more"}, ValueError, "depth_test must be one of"),
        ({"kind": "height_map", "surface": "inner"}, ValueError, "surface must be"),
        ({"kind": "field", "values": [1.0]}, ValueError, "values must have shape"),
        ({"kind": "field", "values": "speed"}, ValueError, r"values must be a \.npy file or .* \(none\), got 'speed'"),
        ({"kind": "fill", "values": COLORS[:3]}, ValueError, "colors must have 50 rows, one per triangle, or 60"),
        ({"memory": 0}, ValueError, "memory must be at least 1"),
        ({"threads": 0}, ValueError, "threads must be at least 1"),
        ({"extent": (0, 1, 0, 1)}, ValueError, "a Grid says extent"),
        ({"subpixel_bits": 17}, ValueError, "subpixel_bits must be in 0..16"),
    ],
)
def test_wrong_options_are_told(options, error, message):
    with pytest.raises(error, match=message):
        tl.tiles((POINTS, TRIANGLES), GRID, **options)


def test_wrong_sizes_are_told():
    with pytest.raises(TypeError, match=r"size must be \(width, height\) or a Grid, or extent or pixel_size be given"):
        tl.tiles((POINTS, TRIANGLES))
    with pytest.raises(ValueError, match="size must be"):
        tl.tiles((POINTS, TRIANGLES), (2**31, 5))
    with pytest.raises(ValueError, match=r"a height map needs points of shape \(V, 3\)"):
        tl.tiles((POINTS[:, :2], TRIANGLES), GRID, kind="height_map")
    with pytest.raises(ValueError, match="a mesh without triangles has no extent"):
        tl.tiles((POINTS, TRIANGLES[:0]), pixel_size=1.0)


def test_grid_round_a_mesh_is_that_of_field():
    raster = tl.tiles((POINTS, TRIANGLES), pixel_size=0.5, window=32)
    assert raster.grid == tl.Grid.around((POINTS, TRIANGLES), pixel_size=0.5)


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("reuse", [False, True])
def test_windows_come_in_order_whatever_draws_them(threads, reuse):
    raster = tl.tiles((POINTS, TRIANGLES), GRID, window=16, threads=threads)
    whole = tl.rasterize(IN_PIXELS, TRIANGLES, SIZE).triangle
    places = []
    for window in raster.windows(reuse=reuse):
        places.append((window.row, window.column))
        assert np.array_equal(window.pixels, whole[window.slices])
    assert places == list(itertools.product(range(4), range(6)))


def test_windows_may_be_left_early():
    raster = tl.tiles((POINTS, TRIANGLES), GRID, window=8, threads=3)
    before = threading.active_count()
    windows = raster.windows()
    for _ in range(4):
        next(windows)
    windows.close()
    assert threading.active_count() <= before
    assert np.array_equal(stitched(raster), tl.rasterize(IN_PIXELS, TRIANGLES, SIZE).triangle)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="only where processes fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_windows_go_on_in_a_forked_child():
    raster = tl.tiles((POINTS, TRIANGLES), GRID, window=16, threads=2)
    whole = tl.rasterize(IN_PIXELS, TRIANGLES, SIZE).triangle
    windows = raster.windows()
    next(windows)
    child = os.fork()
    if not child:
        is_good = all(np.array_equal(window.pixels, whole[window.slices]) for window in windows)
        os._exit(0 if is_good else 1)
    assert os.waitpid(child, 0)[1] == 0


def test_error_of_a_later_block_comes_in_its_turn(monkeypatch):
    monkeypatch.setattr("topleft._meshes.windows.spans.BLOCK", 8)
    points = POINTS.copy()
    points[TRIANGLES[41, 0]] = np.nan
    points[TRIANGLES[20, 0]] = np.nan
    first = int(np.argmax(np.isnan(points[TRIANGLES]).any(axis=(1, 2))))
    with pytest.raises(ValueError, match=f"in triangle {first}, block {first // 16 + 1} of 4"):
        next(iter(tl.tiles((points, TRIANGLES), GRID, window=16, threads=4)))


def test_windows_without_number_are_told():
    raster = tl.tiles(([[0, 0], [6, 0], [0, 6]], [[0, 1, 2]]), 2**31 - 1, window=1)
    with pytest.raises(MemoryError, match=r"no memory for 2 arrays of [\d,]+ bytes together"):
        raster[:1, :1]


def test_values_by_name_are_those_of_the_file(tmp_path):
    points, triangles = np.array([[0.0, 0], [6, 0], [0, 6]]), [[0, 1, 2]]
    np.save(tmp_path / "depth.npy", [1.0, 2.0, 3.0])
    named = tl.tiles((points, triangles), (6, 6), kind="field", values=tmp_path / "depth.npy", window=4)
    given = tl.tiles((points, triangles), (6, 6), kind="field", values=[1.0, 2.0, 3.0], window=4)
    assert np.array_equal(named[:, :], given[:, :], equal_nan=True)
