"""The rest of the accuracy record: peers and pure twins in turns, depth, sizes, threads, tutorials; no time matters."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from benchmarks.accuracy import pure
from benchmarks.accuracy import study as accuracy
from benchmarks.accuracy.depth import BITS, FORMATS, RATIOS, clip_scene, covered, make_sheets
from benchmarks.accuracy.filling import areas, measure_family
from benchmarks.accuracy.options import AccuracyOptions
from benchmarks.accuracy.scaling import shortest_of, thread_counts
from benchmarks.accuracy.sizes import equilateral
from benchmarks.accuracy.tutorial import eleven_triangles, per_second
from benchmarks.harness.turns import SLOW_MS, SLOW_ROUNDS, take_turns
from benchmarks.scenes.families import FAMILIES, in_cells

FRAME_PX = 128
LITTLE = AccuracyOptions(["auto", "point_in_triangle"], [], rounds=1, seconds=0, edge_px=1, frame_px=320, scale=0.001)


def test_take_turns_slow_ones_take_fewer_rounds():
    calls = {"slow": 0, "fast": 0}

    def turn_of(name, ms):
        def turn(seconds):
            calls[name] += 1
            return [ms]

        return turn

    slow, fast = take_turns([turn_of("slow", 2 * SLOW_MS), turn_of("fast", 1.0)], 5, 0.0)
    assert calls == {"slow": 1 + SLOW_ROUNDS, "fast": 6}  # and one to warm up
    assert (slow.tolist(), fast.tolist()) == ([2 * SLOW_MS] * SLOW_ROUNDS, [1.0] * 5)


@pytest.fixture(scope="module")
def family():
    """A tiny family with a peer that works, one that draws nothing, and one that does not exist here."""
    from benchmarks.peers import load_peer

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(load_peer("cairo"), "MODULE", "no_such_module")
        options = AccuracyOptions(LITTLE.methods, ["pillow", "broken", "cairo"], 1, 0, 1, 320, 0.001)
        return measure_family(FAMILIES["slivers"], options)


def test_peers_are_wrong_where_they_draw_nothing_and_skipped_by_name(family):
    rows = {row["peer"]: row for row in family["peers"]}
    assert rows["cairo"]["skipped"] == "pycairo is not installed"
    own = {(row["method"], row["precision"]): row["wrong_px"] for row in family["coverage"]}
    assert own["auto", "16"] <= own["auto", "8"] < rows["pillow"]["wrong_px"]
    assert rows["broken"]["wrong_px"] > own["auto", "8"]
    assert all(rows[name]["ns_triangle"] > 0 for name in ("pillow", "broken"))


def test_smooth_peers_are_between_one_sample_and_the_exact_area(family):
    rms = {row.get("peer") or row["sampling"]: row.get("rms") for row in family["antialiasing"]}
    assert rms["area"] < rms["msaa16"] < rms["msaa4"] < rms["center"]
    assert rms["area"] < rms["pillow"] < rms["broken"]
    assert rms["cairo"] is None


def test_pure_twins_have_the_error_of_their_kernels(family):
    kernels = {(row["method"], row["precision"]): row["wrong_px"] for row in family["coverage"]}
    assert {row["twin"] for row in family["pure"]} == {"exact reference", "point_in_triangle, pure"}
    assert all(row["wrong_px"] == kernels[row["method"], row["precision"]] for row in family["pure"])


@pytest.mark.parametrize("twin", pure.TWINS, ids=lambda twin: twin.name)
def test_pure_twin_draws_what_its_kernel_draws(twin, monkeypatch):
    scene, size = in_cells(FAMILIES["medium"], 1, 64), (64, 64)
    pure.check(twin, scene, size)
    wrong = twin.overdraw(twin.entry.orient(scene), size)
    wrong[3, 4] += 1
    monkeypatch.setattr(pure.Twin, "overdraw", lambda *_: wrong)
    with pytest.raises(RuntimeError, match=f"^{twin.name} must draw what {twin.entry.method} draws, 1 pixels differ"):
        pure.check(twin, scene, size)


def test_sheets_behind_is_behind_by_fractions_and_has_the_same_corners():
    sheets = make_sheets(BITS[-1], RATIOS[-1], FRAME_PX)
    vertices, _ = clip_scene(sheets, FRAME_PX, False)
    pairs = vertices.reshape(-1, 2, 3, 4)
    for i in range(0, len(pairs), 7):
        scale = 1 + Fraction(1, 2 ** BITS[-1])
        front, behind = (pairs[i][k] for k in (int(sheets.is_behind_first[i]), 1 - int(sheets.is_behind_first[i])))
        for a, b in zip(front[:, [0, 1, 3]].ravel().tolist(), behind[:, [0, 1, 3]].ravel().tolist(), strict=True):
            assert Fraction(b) == Fraction(a) * scale


def test_sheets_lie_between_the_planes_and_cover_pixels():
    for ratio in RATIOS:
        sheets = make_sheets(BITS[0], ratio, FRAME_PX)
        assert sheets.front_w.min() >= 1
        assert sheets.behind_w.max() <= ratio
    i_cell, weights = covered(sheets, FRAME_PX)
    assert set(i_cell.tolist()) == set(range(64))
    assert (weights >= 0).all()


@pytest.mark.parametrize("name", FORMATS)
def test_depth_formats_tell_far_sheets_apart_and_mix_up_near_ones(name):
    far, near = make_sheets(3, 100, FRAME_PX), make_sheets(BITS[-1], RATIOS[1], FRAME_PX)
    pixels = covered(far, FRAME_PX)
    assert FORMATS[name](far, FRAME_PX, pixels) == 0
    assert 0.4 < FORMATS[name](near, FRAME_PX, pixels) / len(pixels[0]) < 0.6


def test_depth_more_bits_are_better_and_reversed_depth_is_best():
    sheets = make_sheets(14, RATIOS[1], FRAME_PX)
    pixels = covered(sheets, FRAME_PX)
    share = {name: count(sheets, FRAME_PX, pixels) for name, count in FORMATS.items()}
    assert share["topleft, reversed"] == 0 < share["topleft"] <= share["float32 arithmetic"]
    assert share["24-bit integer"] < share["16-bit integer"]


@pytest.mark.parametrize("area_px", [0.1, 1000.0])
def test_equilateral_has_its_area_and_stays_in_the_frame(area_px):
    scene = equilateral(20, area_px, 256)
    assert np.allclose(areas(scene), area_px, rtol=1e-9)  # float64 coordinates up to 256
    assert (scene[0] >= 0).all()
    assert (scene[0] <= 256).all()


def test_thread_counts_double_up_to_the_machine():
    assert [thread_counts(n) for n in (1, 2, 3, 8, 12)] == [[1], [1, 2], [1, 2, 3], [1, 2, 4, 8], [1, 2, 4, 8, 12]]


def test_shortest_of_a_turn():
    assert shortest_of(lambda seconds: [3.0, seconds, 2.0])(1.5) == [1.5]


def test_eleven_triangles_many_times_over():
    vertices, triangles = eleven_triangles(3)
    assert (len(vertices), triangles.shape) == (33, (33, 3))
    assert (triangles[:11] == triangles[22:]).all()


def test_per_second_of_fills_that_noise_hides_is_what_the_clock_tells():
    assert per_second(2.0, 0.5) == {"calls": 500.0, "fills": 2000.0}
    assert per_second(2.0, -0.5) == {"calls": 500.0, "fills": 1e9}


def test_accuracy_part_replaces_its_rows_alone():
    record = accuracy.run_accuracy(replace(LITTLE, parts=["slivers", "sizes", "small"]))
    assert [row["name"] for row in record["families"]] == ["small", "slivers"]
    before, sizes = json.loads(json.dumps(record)), record["sizes"]
    again = accuracy.run_accuracy(replace(LITTLE, parts=["slivers"]), record)
    assert again["sizes"] is sizes
    assert [row["wrong_px"] for row in again["coverage"]] == [row["wrong_px"] for row in before["coverage"]]
    assert again["parts"].keys() == {"slivers", "sizes", "small"}


def test_accuracy_part_of_another_machine_is_refused():
    record = accuracy.run_accuracy(replace(LITTLE, parts=["sizes"]))
    with pytest.raises(ValueError, match=r"the record must be of the same isa to add to it, '.*', got 'mmx'"):
        accuracy.run_accuracy(replace(LITTLE, parts=["sizes"]), record | {"isa": "mmx"})
