"""Areas of polygons and the table of overlaps: near fractions, and to the last bit where they must be."""

import tracemalloc

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on
from hypothesis import given
from polygon_cases import SIZE, cells, square, star, wild_polygon, wild_seeds

import topleft as tl
from topleft._core.base import memory
from topleft._core.polygons import overlap
from topleft._core.polygons.prepared import Prepared
from topleft.methods.reference import polygons as ref

UNIT = 2.0**-24


def dense(table):
    width, height = table.size
    pictures = np.zeros((len(table), height * width), np.float32)
    pictures[table.polygons, table.pixels] = table.areas
    return pictures.reshape(len(table), height, width)


@ON_EACH_ISA
@pytest.mark.parametrize("rule", ["evenodd", "nonzero"])
@given(wild_seeds)
def test_areas_of_wild_rings_are_within_bound(isa, rule, seed):
    polygon = wild_polygon(np.random.default_rng(seed))
    exact = np.array([[float(a) for a in row] for row in ref.polygon_areas(polygon, SIZE, rule)])
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
        exact = np.array([[float(a) for a in row] for row in ref.polygon_areas([ring], SIZE)])
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
        exact = sum(float(a) for row in ref.polygon_areas([ring], (40, 40), rule) for a in row)
        assert tl.polygons(ring, (40, 40), rule=rule, sampling="area").sum(dtype=float) == pytest.approx(
            exact, abs=1e-5
        )


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


def test_table_is_a_sparse_matrix():
    pytest.importorskip("scipy")
    table = tl.overlap(cells(20, (30, 20)), (30, 20))
    matrix = table.to_scipy()
    assert matrix.shape == (20, 600)
    assert (matrix.toarray().reshape(20, 20, 30) == dense(table)).all()
    assert matrix.has_canonical_format


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
