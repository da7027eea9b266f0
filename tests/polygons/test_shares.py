"""Areas of polygons and the table of overlaps: near fractions, and to the last bit where they must be."""

import sys
import tracemalloc
import warnings
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, kept, on
from hypothesis import given, settings
from polygon_cases import SIZE, cells, square, star, wild_polygon, wild_seeds

import topleft as tl
from topleft._core import engine
from topleft._core.base import memory
from topleft._core.polygons import overlap
from topleft._core.polygons.draw import cells_for
from topleft._core.polygons.polygons import frame_of
from topleft._core.polygons.prepared import Prepared, prepare
from topleft._core.polygons.rings import as_rings
from topleft.methods.reference import polygons as ref

UNIT = 2.0**-24
polygon_areas = kept(ref.polygon_areas)


def dense(table):
    width, height = table.size
    pictures = np.zeros((len(table), height * width), np.float32)
    pictures[table.polygons, table.pixels] = table.areas
    return pictures.reshape(len(table), height, width)


@ON_EACH_ISA
@pytest.mark.parametrize("rule", ["evenodd", "nonzero"])
@settings(max_examples=40)
@given(wild_seeds)
def test_areas_of_wild_rings_are_within_bound(isa, rule, seed):
    polygon = wild_polygon(np.random.default_rng(seed))
    exact = np.array([[float(a) for a in row] for row in polygon_areas(polygon, SIZE, rule)])
    n_edges = sum(len(ring) for ring in polygon)
    with on(isa):
        areas = tl.polygons(polygon, SIZE, rule=rule, sampling="area")
        table = tl.overlap([polygon], SIZE, rule=rule)
    assert abs(areas - exact).max() <= UNIT * (1 + n_edges)
    assert (dense(table)[0] == areas).all()


@pytest.mark.parametrize("reach", [3e5, 1e9, 1e15])
def test_areas_of_rings_that_reach_far_out_are_within_bound(reach):
    rng = np.random.default_rng(5)
    for k in range(20):
        ring = rng.uniform(-1, 1, (3 + k % 3, 2)) * reach
        ring[0] = rng.uniform(0, 5, 2)
        exact = np.array([[float(a) for a in row] for row in polygon_areas([ring], SIZE)])
        assert abs(tl.polygons(ring, SIZE, sampling="area") - exact).max() <= 7 * UNIT


def test_areas_of_cells_sum_to_one_in_each_pixel():
    size = 300, 200
    points, rings, owners = cells(400, size)
    table = tl.overlap((points, rings, owners), size)
    sums = np.bincount(table.pixels, table.areas.astype(float), size[0] * size[1])
    assert (sums == 1).all()
    following = np.roll(points, -1, axis=0)
    following[rings[1:] - 1] = points[rings[:-1]]
    twice = np.add.reduceat(points[:, 0] * following[:, 1] - following[:, 0] * points[:, 1], rings[:-1])
    assert table.totals() == pytest.approx(abs(twice) / 2, abs=1e-5)


def test_area_of_a_ring_that_crosses_itself_is_that_of_the_rule():
    """A pentagram: five points, wound round twice in the middle."""
    angles = np.arange(5) * 4 * np.pi / 5
    ring = 20 + 18 * np.stack([np.sin(angles), np.cos(angles)], 1)
    for rule in ("evenodd", "nonzero"):
        exact = sum(float(a) for row in polygon_areas([ring], (40, 40), rule) for a in row)
        assert tl.polygons(ring, (40, 40), rule=rule, sampling="area").sum(dtype=float) == pytest.approx(
            exact, abs=1e-5
        )


def chords(n, size):
    """A ring of n points, of which each edge crosses three of four others."""
    turns = 2.4 * np.arange(n)
    return np.round((np.stack([np.cos(turns), np.sin(turns)], 1) * 0.45 + 0.5) * size * 256) / 256


@ON_EACH_ISA
@pytest.mark.parametrize("rule", ["evenodd", "nonzero"])
@pytest.mark.parametrize(("n", "size"), [(24, (3, 2)), (44, (1, 1))])
def test_areas_of_rings_that_cross_in_each_pixel_are_within_bound(isa, rule, n, size):
    """Up to 700 crossings a pixel."""
    ring = chords(n, np.array(size))
    exact = np.array([[float(a) for a in row] for row in polygon_areas([ring], size, rule)])
    with on(isa):
        assert abs(tl.polygons(ring, size, rule=rule, sampling="area") - exact).max() <= UNIT


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("sampling", ["area", "outer", "inner"])
def test_rings_that_cross_too_often_are_refused(sampling, threads):
    ring, how = chords(101, 40), {"sampling": sampling, "threads": threads}
    drawn, n = [[ring], [ring]], 2 * n_crossings(ring)
    picture = tl.polygons(drawn, (40, 40), max_crossings=n + 2 * len(ring), **how)
    assert (picture == tl.polygons(drawn, (40, 40), **how)).all()
    with pytest.raises(ValueError, match=f"rings must cross at most {n - 1:,} times .* max_crossings= allows more"):
        tl.polygons(drawn, (40, 40), max_crossings=n - 1, **how)


def n_crossings(ring):
    a, b = ring, np.roll(ring, -1, axis=0)

    def sides(p, q, r):
        d, e = q - p, r - p
        return np.sign(d[..., 0] * e[..., 1] - d[..., 1] * e[..., 0])

    of_starts, of_ends = sides(a[:, None], b[:, None], a[None]), sides(a[:, None], b[:, None], b[None])
    return int(((of_starts * of_ends < 0) & (of_starts * of_ends < 0).T).sum()) // 2


def test_crossings_outside_of_the_window_are_not_counted():
    ring = chords(101, 40)
    n = n_crossings(ring) // 2
    with pytest.raises(ValueError, match=f"at most {n:,} times"):
        tl.overlap([[ring]], (40, 40), max_crossings=n)
    assert len(tl.overlap([[ring]], (3, 3), max_crossings=n, origin=(28, 18)).areas) > 0


def test_edges_that_crowd_a_pixel_count_as_crossings():
    """A zigzag of parallel edges, each of which enters and leaves the pixel by itself."""
    n = 2000
    at = np.arange(n)
    middle = np.stack([0.5 + at / n, 1.5 - at / n], axis=1)
    zigzag = np.where(at[:, None] % 2, middle + 3, middle - 3)
    ring = np.concatenate([zigzag, [(5, 5), (6, 6), (6, 5), (5, 6), (5, -9)]])
    how = {"subpixel_bits": 12, "sampling": "area"}
    assert tl.polygons(ring, 2, max_crossings=10**9, **how).shape == (2, 2)
    with pytest.raises(ValueError, match="cross or crowd a pixel more often"):
        tl.polygons(ring, 2, max_crossings=10_000, **how)


@pytest.mark.parametrize(("value", "error"), [(0, "at least 1, got 0"), (1.5, "must be an integer")])
def test_max_crossings_is_a_number(value, error):
    with pytest.raises((TypeError, ValueError), match=error):
        tl.polygons([(0, 0), (4, 0), (4, 4)], (5, 5), max_crossings=value)


def test_assumed_valid_polygons_are_the_same_to_the_bit():
    rng = np.random.default_rng(8)
    for turn in (1, -1):
        shell = np.round(256 * star(500, 90, 0.2)) / 256
        hole = np.round(256 * (34 + star(50, 22, 0.1))) / 256
        rings = [shell, hole[::turn] + np.round(rng.uniform(-1, 1, 2) * 16) / 16]
        for sampling in ("area", "outer", "inner"):
            checked = tl.polygons(rings, (90, 90), sampling=sampling)
            assert (tl.polygons(rings, (90, 90), sampling=sampling, assume_valid=True) == checked).all()


@ON_EACH_ISA
def test_table_is_the_same_on_each_thread_and_instruction_set(isa):
    rng = np.random.default_rng(6)
    drawn = [wild_polygon(rng, (50, 40)) for _ in range(40)]
    expected = tl.overlap(drawn, (50, 40), threads=1)
    with on(isa):
        for threads in range(1, 9):
            table = tl.overlap(drawn, (50, 40), threads=threads)
            for name in ("starts", "pixels", "areas"):
                assert (getattr(table, name) == getattr(expected, name)).all()


def test_table_in_many_blocks_is_the_same_on_each_thread(monkeypatch):
    rng = np.random.default_rng(9)
    drawn = [wild_polygon(rng, (50, 40)) for _ in range(60)]
    expected = tl.overlap(drawn, (50, 40), threads=1)
    monkeypatch.setattr(overlap, "MAX_BLOCK_ENTRIES", 300)
    for at_once in (5000, 1 << 28):
        monkeypatch.setattr(overlap, "MAX_ENTRIES_AT_ONCE", at_once)
        for threads in (1, 2, 3, 8):
            table = tl.overlap(drawn, (50, 40), threads=threads)
            for name in ("starts", "pixels", "areas"):
                assert (getattr(table, name) == getattr(expected, name)).all()


@pytest.mark.parametrize("size", [(1, 5), (5, 1), (1, 1)])
def test_table_of_one_column_or_row_is_that_part_of_a_wider_one(size):
    ring = [(-3, -2), (0.75, -2), (9, 3.5), (0.25, 7)]
    areas = dense(tl.overlap([[ring]], (5, 5)))[0, : size[1], : size[0]]
    assert (dense(tl.overlap([[ring]], size))[0] == areas).all()
    assert areas.any()


def test_table_of_a_range_leaves_the_polygons_behind_it():
    rings = as_rings([[square(i, 1, i + 1, 2)] for i in range(1, 7)])
    found, frame = frame_of(rings, (9, 9), (0, 0), 8, 1, 1, 100)
    prepared = prepare(memory.FRESH, found, frame, is_nonzero=False)
    prepared.certify(assume_valid=False)
    starts, pixels, areas = np.full(7, -1), np.empty(200, np.int32), np.empty(200, np.float32)
    cells_of_rows = np.full(cells_for(prepared, 9), engine.CELL_CLEAR, np.int32)
    starts[0] = 0
    prepared.compiled.list_shares(0, 4, starts, pixels, areas, cells_of_rows, prepared.piece_scratch())
    assert starts.tolist() == [0, 1, 2, 3, 4, -1, -1]


def test_table_that_a_thread_cannot_finish_raises(monkeypatch):
    """Those that wait for its block end."""
    calls = []

    def fail_late(prepared):
        calls.append(1)
        if len(calls) == 2:
            raise MemoryError("no more")
        return prepared_piece_scratch(prepared)

    prepared_piece_scratch = Prepared.piece_scratch
    monkeypatch.setattr(overlap, "MAX_BLOCK_ENTRIES", 300)
    monkeypatch.setattr(Prepared, "piece_scratch", fail_late)
    drawn = [square(i, 0, i + 20, 20) for i in range(40)]
    with pytest.raises(MemoryError, match="no more"):
        tl.overlap([[ring] for ring in drawn], (60, 20), threads=3)


CROSSING = [(0, 0), (5, 2**17 - 10), (0, 2**17 - 10), (5, 0)]  # eight bytes for each of its rows, in each thread


def test_memory_for_rings_that_meet_is_asked_for_with_its_bytes(monkeypatch):
    monkeypatch.setattr(memory, "fits", lambda shape, *_: shape[0] < 2**16)
    with pytest.raises(MemoryError, match=r"no memory for [12],\d{3},\d{3} bytes, which this size or scene needs"):
        tl.overlap([[CROSSING]], (9, 2**17))


def test_fewer_threads_draw_where_memory_is_scarce(monkeypatch):
    expected = tl.overlap([[CROSSING], [CROSSING]], (9, 2**17), threads=1)
    made, real = [], Prepared.piece_scratch
    monkeypatch.setattr(memory, "fits", lambda shape, *_: shape[0] < 3)
    for module in (memory, overlap):
        monkeypatch.setattr(module, "check_fits", lambda *_: None)
    monkeypatch.setattr(Prepared, "piece_scratch", lambda self: made.append(1) or real(self))
    table = tl.overlap([[CROSSING]] * 2, (9, 2**17), threads=8)
    assert (table.areas == expected.areas).all()
    assert len(made) == 2
    monkeypatch.setattr(overlap, "fits", lambda *_: False)  # for rows of its own
    table = tl.overlap([[CROSSING]] * 2, (9, 2**17), threads=8)
    assert (table.areas == expected.areas).all()
    assert len(made) == 3


@pytest.mark.parametrize(("most", "squares_listed"), [(1300, 3), (2100, 5), (9000, 12)])
def test_table_that_grows_beyond_memory_is_refused(monkeypatch, most, squares_listed):
    """Linux gives each part of it, and ends the process when they are written."""
    real, listed = memory.check_fits, []

    def check_fits(shape, *dtypes):
        if shape[0] > most:
            raise MemoryError(f"no memory for {shape[0]}")
        real(shape, *dtypes)

    def list_range(*arguments):
        listed.append(arguments[2])
        real_list(*arguments)

    real_list = overlap.list_range
    monkeypatch.setattr(overlap, "MAX_ENTRIES_AT_ONCE", 400)
    monkeypatch.setattr(overlap, "check_fits", check_fits)
    monkeypatch.setattr(overlap, "list_range", list_range)
    drawn = [[square(0, 0, 20, 20)]] * 12  # 400 entries each
    with pytest.raises(MemoryError, match="no memory for"):
        tl.overlap(drawn, (60, 20))
    assert len(listed) == squares_listed


def test_table_of_a_window_is_that_of_the_picture_there():
    rng = np.random.default_rng(7)
    drawn = [wild_polygon(rng, (30, 20)) for _ in range(20)]
    whole = dense(tl.overlap(drawn, (30, 20)))
    assert (dense(tl.overlap(drawn, (9, 7), origin=(11, 5))) == whole[:, 5:12, 11:20]).all()


def test_entries_ascend_and_none_is_zero():
    table = tl.overlap(cells(50, (80, 60)), (80, 60))
    for a, b in zip(table.starts, table.starts[1:], strict=False):
        assert (np.diff(table.pixels[a:b]) > 0).all()
    assert table.areas.min() > 0
    assert table.areas.max() <= 1


def test_triangles_of_a_mesh_are_polygons():
    vertices, triangles = [(0, 0), (4, 0), (4, 3), (0, 3)], [[0, 1, 2], [0, 3, 2]]
    table = tl.overlap(vertices, (4, 3), triangles=triangles)
    assert table.totals().tolist() == [6, 6]
    assert (dense(table).sum(axis=0) == 1).all()
    areas = [tl.coverage(vertices, [t], (4, 3), sampling="area") for t in triangles]
    assert (dense(table) == areas).all()


def test_table_sums_means_and_spreads():
    table = tl.overlap([[square(0, 0, 2, 1)], [square(1.5, 0, 3, 2)], [square(9, 9, 10, 10)]], (3, 2))
    raster = np.array([[1.0, 2, 3], [np.nan, 5, 6]])
    assert table.sums(raster).tolist() == [3, 0.5 * 2 + 3 + 0.5 * 5 + 6, 0]
    assert table.means(raster)[:2].tolist() == [1.5, 12.5 / 3]
    assert np.isnan(table.means(raster)[2])
    assert table.spread([2, 10, 1]).tolist() == [[2, 7, 10], [0, 5, 10]]


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int16, np.int64])
def test_pixels_without_data_do_not_count(dtype):
    table = tl.overlap([[square(0, 0, 2, 1)], [square(1.5, 0, 3, 2)], [square(2, 1, 3, 2)]], (3, 2))
    raster = np.array([[1, 2, -9999], [5, -9999, -9999]], dtype)
    assert table.means(raster, nodata=-9999).tolist()[:2] == [1.5, 2]
    assert np.isnan(table.means(raster, nodata=-9999.0)[2])
    assert table.sums(raster, nodata=np.float64(-9999)).tolist() == [3, 1, 0]
    masked = np.ma.masked_equal(raster, -9999)
    assert table.means(masked).tolist()[:2] == [1.5, 2]
    assert table.sums(masked, nodata=1).tolist() == [2, 1, 0]
    assert (
        table.sums(np.ma.array(raster)).tolist() == table.sums(raster).tolist() == [3, 1 - 4 * 4999.5 - 4999.5, -9999]
    )


@pytest.mark.parametrize("nodata", [0.1, -3.4028234663852886e38, float("nan"), float("inf")])
def test_no_data_is_told_in_the_dtype_of_the_raster(nodata):
    table = tl.overlap([[square(0, 0, 2, 1)]], (2, 1))
    assert table.means(np.array([[4, nodata]], np.float32), nodata=nodata).tolist() == [4]
    assert table.means(np.array([[4, 8]], np.uint8), nodata=nodata).tolist() == [6]


def test_no_data_that_a_raster_names_itself_does_not_count():
    table = tl.overlap([[square(0, 0, 2, 1)]], (2, 1))

    class Raster:
        def __init__(self, **attrs):
            self.attrs = attrs

        def __array__(self, dtype=None, copy=None):
            return np.array([[4, -1]], np.float32)

    for said in ({"_FillValue": -1}, {"nodatavals": (-1.0,)}, {"missing_value": np.float32(-1)}, {"nodata": -1}):
        assert table.means(Raster(**said)).tolist() == [4]
    for said in ({}, {"nodata": None}, {"_FillValue": "none"}, {"nodatavals": ()}):
        assert table.means(Raster(**said)).tolist() == [1.5]

    class Dataset:
        count = 1

        def read(self, band, masked):
            assert (band, masked) == (1, True)
            return np.ma.masked_equal([[4, -1]], -1)

    assert table.means(Dataset()).tolist() == [4]
    Dataset.count = 3
    with pytest.raises(ValueError, match=r"raster must have one band, got 3: pass raster.read\(1, masked=True\)"):
        table.means(Dataset())


@pytest.mark.parametrize("dims", [("x", "y"), ("lon", "lat"), ("band", "Easting", "Northing")])
def test_raster_with_columns_first_is_refused(dims):
    class Raster:
        def __array__(self, dtype=None, copy=None):
            return np.ones((2, 2))

    raster, table = Raster(), tl.overlap([[square(0, 0, 2, 1)]], (2, 2))
    raster.dims = dims
    with pytest.raises(
        ValueError, match=rf"raster must have its rows along {dims[-1]}, got dimensions .*: transpose it"
    ):
        table.means(raster)
    raster.dims = dims[::-1]
    assert table.means(raster).tolist() == [1]


@pytest.mark.parametrize("nodata", ["x", [1, 2], 1j])
def test_no_data_that_is_no_number_is_refused(nodata):
    with pytest.raises(TypeError, match="nodata must be a number"):
        tl.overlap([[square(0, 0, 2, 1)]], (2, 1)).means([[1, 2]], nodata=nodata)


@pytest.mark.parametrize("seed", range(4))
def test_statistics_are_those_of_numpy_with_the_areas_as_weights(seed):
    """One polygon far away, pixels without data, numbers that stand often: each statistic is that of a plain loop."""
    rng = np.random.default_rng(seed)
    rings = [[np.cumsum(rng.normal(size=(9, 2)), axis=0) * 3 + rng.uniform(0, 30, 2)] for _ in range(20)]
    rings.append([square(900, 900, 905, 905)])
    table = tl.overlap(rings, (32, 30))
    raster = rng.integers(0, 4, (30, 32)).astype(np.float64)
    raster[rng.random(raster.shape) < 0.2] = -9999
    q = [0.0, 0.25, 0.5, 0.9, 1.0]
    found = {
        "count": table.counts(raster, nodata=-9999),
        "min": table.minima(raster, nodata=-9999),
        "max": table.maxima(raster, nodata=-9999),
        "stdev": table.stdevs(raster, nodata=-9999),
        "majority": table.majorities(raster, nodata=-9999),
    }
    quantiles, medians = table.quantiles(raster, q, nodata=-9999), table.quantiles(raster, nodata=-9999)
    for i, (first, end) in enumerate(pairwise(table.starts.tolist())):
        values, areas = raster.ravel()[table.pixels[first:end]], table.areas[first:end].astype(np.float64)
        values, areas = values[values != -9999], areas[values != -9999]
        assert found["count"][i] == pytest.approx(areas.sum())
        if not len(values):
            assert all(np.isnan(found[name][i]) for name in ("min", "max", "stdev", "majority"))
            assert np.isnan([*quantiles[i], medians[i]]).all()
            continue
        assert (found["min"][i], found["max"][i]) == (values.min(), values.max())
        mean = np.average(values, weights=areas)
        assert found["stdev"][i] == pytest.approx(np.sqrt(np.average((values - mean) ** 2, weights=areas)))
        assert found["majority"][i] == np.argmax(np.bincount(values.astype(int), areas))
        order = np.argsort(values, kind="stable")
        reached = np.cumsum(areas[order])
        expected = [values[order][np.argmax(reached >= share * reached[-1] - 1e-9)] for share in q]
        assert quantiles[i].tolist() == expected
        assert medians[i] == expected[2]


def test_stdev_of_infinite_pixels_is_nan_without_a_warning():
    found = tl.overlap([[square(0, 0, 2, 2)]], (2, 2))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(found.stdevs(np.full((2, 2), np.inf))).all()


def test_tables_are_equal_to_themselves_alone():
    one, other = (tl.overlap([[square(0, 0, 2, 2)]], (2, 2)) for _ in range(2))
    assert one == one
    assert one != other
    assert len({one, other}) == 2


def test_majority_of_equal_areas_is_the_least_number():
    table = tl.overlap([[square(0, 0, 2, 1)], [square(5, 5, 6, 6)]], (2, 1))
    found = table.majorities([[7, 3]])
    assert found[0] == 3
    assert np.isnan(found[1])


@pytest.mark.parametrize("q", [-0.1, 1.5, np.nan, [[0.5]]])
def test_quantiles_beyond_0_and_1_are_refused(q):
    with pytest.raises(ValueError, match="q must be one number from 0 to 1 or several"):
        tl.overlap([[square(0, 0, 2, 1)]], (2, 1)).quantiles([[1, 2]], q)


def test_polygons_of_another_crs_are_told():
    utm, degrees = tl.Grid((4, 4), (5e5, 6e5, 5e6, 6e6)), tl.Grid((4, 4), (10, 11, 45, 46))
    lonlat, metres = [[square(10, 45, 11, 46)]], [[square(5e5, 5e6, 6e5, 6e6)]]
    said = "no polygon meets a pixel of the grid: the polygons lie in x 10 to 11, y 45 to 46, the grid in x 500000 to "
    with pytest.warns(UserWarning, match=f"^{said}.*the polygons may be degrees, the grid cannot: transform"):
        assert not len(tl.overlap(lonlat, utm).areas)
    with pytest.warns(UserWarning, match="the grid may be degrees, the polygons cannot"):
        assert not tl.polygons(metres, degrees).any()
    with pytest.warns(UserWarning, match="are they of another CRS than the grid"):
        assert (tl.polygons([[square(5, 5, 6, 6)]], degrees, values="index") == -1).all()


def test_polygons_of_which_one_meets_the_grid_are_not_told():
    grid = tl.Grid((4, 4), (10, 11, 45, 46))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tl.overlap([[square(0, 0, 1, 1)], [square(10, 45, 10.1, 45.1)]], grid)
        tl.overlap([], grid)
        tl.overlap([[square(9, 9, 10, 10)]], (4, 4))
        tl.overlap([[square(10, 45, 10.1, 45.1)]], grid, origin=(50, 50))


def test_table_is_a_sparse_matrix():
    pytest.importorskip("scipy")
    table = tl.overlap(cells(20, (30, 20)), (30, 20))
    matrix = table.to_scipy()
    assert matrix.shape == (20, 600)
    assert (matrix.toarray().reshape(20, 20, 30) == dense(table)).all()
    assert matrix.has_canonical_format


def test_table_is_a_sparse_array_of_pictures(monkeypatch):
    try:
        from sparse import COO
    except ImportError:  # numba comes with it, so the gate has it not: what it is given is what the picture is made of
        COO = None
        monkeypatch.setitem(sys.modules, "sparse", SimpleNamespace(COO=lambda *given, **_: given))
    table = tl.overlap(cells(20, (30, 20)), (30, 20))
    found = table.to_sparse()
    if COO is None:
        places, areas, shape = found
        pictures = np.zeros(shape, areas.dtype)
        pictures[tuple(places)] = areas
    else:
        assert isinstance(found, COO)
        pictures = found.todense()
    assert pictures.dtype == np.float32
    assert (pictures == dense(table)).all()


def test_sparse_array_without_its_package_gives_the_hint(monkeypatch):
    monkeypatch.setitem(sys.modules, "sparse", None)
    with pytest.raises(tl.MissingPackageError, match="to_sparse needs the package sparse: pip install sparse"):
        tl.overlap(cells(2, (3, 2)), (3, 2)).to_sparse()


def test_memory_of_a_table_is_used_again():
    drawn = cells(20, (30, 20))
    expected, first = tl.overlap(drawn, (30, 20)), tl.overlap(drawn, (30, 20))
    second = tl.overlap(drawn, (30, 20), out=first)
    assert np.shares_memory(first.pixels, second.pixels)
    assert (second.pixels == expected.pixels).all()


def test_colors_are_mixed_by_area():
    colors = np.array([[200, 0], [0, 100]], np.uint8)
    drawn = [[square(0, 0, 1.5, 1)], [square(0.5, 0, 3, 1)]]
    picture = tl.polygons(drawn, (3, 1), values=colors, sampling="area")
    assert picture.tolist() == [[[100, 50], [0, 100], [0, 100]]]


def test_colors_are_the_mean_of_samples():
    picture = tl.polygons(square(0, 0, 1.5, 1), (2, 1), values=[8.0], sampling="msaa4", background=4)
    assert picture.tolist() == [[8, 6]]


def test_memory_for_rings_that_meet_is_as_large_as_they_are():
    """A bow tie in a huge picture: scratch for all its rows would be 16 GiB."""
    bow_tie, side = [[2.5, 1], [9, 9.5], [9, 1], [2, 9]], 2**31 - 1
    small = tl.overlap([bow_tie], (12, 12))
    tracemalloc.start()
    try:
        table = tl.overlap([bow_tie], (side, side))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 4 << 20
    assert (table.areas == small.areas).all()
    rows, columns = np.divmod(small.pixels.astype(np.int64), 12)
    assert (table.pixels == rows * side + columns).all()


@pytest.mark.parametrize(
    ("starts", "pixels", "areas", "message"),
    [
        ([0], [0, 3], [0.5, 1], "starts must ascend from 0 to the 2 entries"),
        ([0, 1, 9], [0, 3], [0.5, 1], "starts must ascend from 0 to the 2 entries"),
        ([0, 2, 1, 2], [0, 3], [0.5, 1], "starts must ascend from 0 to the 2 entries"),
        ([-5, 1, 2], [0, 3], [0.5, 1], "starts must ascend from 0 to the 2 entries"),
        (np.empty(0, int), [0, 3], [0.5, 1], "starts must ascend from 0 to the 2 entries"),
        ([[0, 1, 2]], [0, 3], [0.5, 1], "starts must be an array of integers in one row"),
        ([0, 1, 2], [0, 3], [0.5], "areas must be as many as pixels, 2, got 1"),
        ([0, 1, 2], [0, 3], [1, 1], "areas must be an array of numbers in one row"),
        ([0, 1, 2], [0, 4], [0.5, 1], r"pixels must lie in 0\.\.3, got 0\.\.4"),
        ([0, 1, 2], [0, -1], [0.5, 1], r"pixels must lie in 0\.\.3, got -1\.\.0"),
        ([0, 1, 2], [0.0, 3.0], [0.5, 1], "pixels must be an array of integers in one row"),
    ],
)
@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_table_made_by_hand_that_is_none_is_refused(starts, pixels, areas, message, dtype):
    own = np.array(pixels)
    own = own.astype(dtype) if own.dtype.kind == "i" else own
    for use in (lambda table: table.sums(np.ones((2, 2))), lambda table: table.spread(np.ones(2))):
        with pytest.raises(ValueError, match=message):
            use(tl.Overlap(np.array(starts), own, np.array(areas), (2, 2)))


def test_table_made_by_hand_is_one():
    found = tl.Overlap(np.array([0, 1, 2]), np.array([0, 3], np.int32), np.array([0.5, 1], np.float32), (2, 2))
    assert found.sums([[1, 2], [3, 4]]).tolist() == [0.5, 4]
