"""Time against error: the exact pictures that errors are counted with, tiny runs of the commands, the page."""

import json
from pathlib import Path

import numpy as np
import pytest
from benchmarks import cli
from benchmarks.accuracy import study as accuracy
from benchmarks.accuracy.filling import samplings
from benchmarks.accuracy.options import AccuracyOptions
from benchmarks.accuracy.stability import CHANGES, count_flips, touch
from benchmarks.accuracy.tables import with_no_snap
from benchmarks.scenes.families import FAMILIES, NO_SNAP, Entry, entries, in_cells

import topleft as tl
from topleft import scenes
from topleft.methods.reference.integers import ExactPicture

SIZE = (12, 11)
METHODS = ["auto", "row_crossing/cull-front", "float_barycentric"]
CHARTS = [f"accuracy-{name}" for name in ("peers", "coverage", "antialiasing", "depth")]
CHARTS += [f"speed-{name}" for name in ("sizes", "tutorial")]


@pytest.mark.parametrize("name", FAMILIES)
def test_family_in_cells_no_triangle_meets_another(name):
    vertices, triangles = in_cells(FAMILIES[name], 1, 700)
    assert ExactPicture(vertices, triangles, (700, 700)).count.max() == 1


def test_entries_every_method_that_fills_at_every_precision():
    found = entries()
    assert {entry.method for entry in found if entry.bits is None} >= {"lerp_scanline", "float_barycentric/float64"}
    assert [entry.precision for entry in found if entry.method == "auto"] == ["0", "4", "8", "12", "16"]
    assert Entry("point_in_triangle").precision == "whole px"
    assert not any("wireframe" in entry.method for entry in found)


@pytest.mark.parametrize("method", ["row_crossing/cull-back", "row_crossing/cull-front"])
def test_entry_orient_turns_triangles_the_way_the_method_draws(method):
    entry = Entry(method)
    for order in ([0, 1, 2], [0, 2, 1]):
        scene = np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]]), np.array([order], np.int32)
        assert tl.coverage(*entry.orient(scene), SIZE, method=method).any()


@pytest.mark.parametrize("change", [change.name for change in CHANGES])
def test_touch_changes_little_and_keeps_the_triangles(change):
    vertices, triangles = scenes.planar_mesh(20, 64, 64)
    touched = touch(change, (vertices, triangles), 64)
    assert np.abs(touched.scene[0] - vertices).max() <= 1
    assert (touched.scene[1] == triangles[touched.ids]).all()
    assert (change == "reorder") == bool((touched.scene[0] == vertices).all())


def test_count_flips_shifted_picture_compares_what_both_show():
    before = np.arange(12, dtype=np.int32).reshape(3, 4)
    after = np.roll(before, (1, 1), (0, 1))
    assert count_flips(before, after, 1) == 0
    assert count_flips(before, after, 0) == 12


@pytest.fixture(scope="module")
def tiny():
    """A tiny run."""
    options = AccuracyOptions(
        METHODS, ["broken"], rounds=1, seconds=0, edge_px=1, frame_px=320, scale=0.001, max_threads=2
    )
    return accuracy.run_accuracy(options)


def test_accuracy_record_has_a_row_for_each_method_family_and_precision(tiny):
    assert json.loads(json.dumps(tiny)) == tiny
    assert len(tiny["coverage"]) == len(FAMILIES) * 7  # five precisions of auto, one of each of the others
    assert all(row["ns_triangle"] > 0 for row in tiny["coverage"])
    assert {row["sampling"] for row in tiny["antialiasing"] if "sampling" in row} == set(samplings())


def test_accuracy_more_bits_are_less_wrong(tiny):
    wrong = [row["wrong_px"] for row in tiny["coverage"] if (row["family"], row["method"]) == ("small", "auto")]
    assert wrong[0] > wrong[1] > wrong[2] >= wrong[4]


def test_stability_engine_is_watertight_and_takes_any_order(tiny):
    rows = [row for row in tiny["stability"] if row["method"] in ("exact", "auto")]
    faults = ("missed", "overdrawn", "far_missed", "far_overdrawn", "pixel", "reorder")
    assert [row[fault] for row in rows for fault in faults] == [0] * 42
    assert [row["wrong"] for row in rows if row["precision"] == "exact"] == [0]


def test_stability_inclusive_spans_overdraw(tiny):
    (row,) = (row for row in tiny["stability"] if row["method"].startswith("row_crossing"))
    assert row["overdrawn"] > 0
    assert row["reorder"] > 0


@pytest.mark.parametrize("family", FAMILIES)
def test_chart_no_snap_is_the_first_mark_of_those_without_a_wrong_pixel(family):
    """Of the record that the page's chart is drawn from: the engine, and next to nobody near it."""
    record = json.loads((Path(accuracy.__file__).parents[1] / "records/accuracy.json").read_text())
    rows = [*with_no_snap(record), *record["pure"], *record["peers"]]
    right = sorted((row["ns_triangle"], row.get("precision")) for row in rows
                   if row["family"] == family and row.get("wrong_px") == 0)  # fmt: skip
    assert right[0][1] == NO_SNAP
    assert right[1][0] > 5 * right[0][0]


def test_accuracy_command_writes_what_report_prints(tmp_path, capsys):
    target = tmp_path / "record.json"
    little = ["--repeats", "1", "--seconds", "0", "--edge-pixels", "1", "--frame", "310", "--scale", "0.001",
              "--peer", "--part", "slivers", "sizes"]  # fmt: skip
    assert cli.main(["accuracy", *little, "--method", "lerp_scanline", "-o", str(target)]) == 0
    printed = capsys.readouterr().out
    assert "`lerp_scanline`" in printed
    assert cli.main(["report", str(target)]) == 0
    assert capsys.readouterr().out == printed


def test_charts_command_draws_svg(tiny, tmp_path, capsys):
    some = tiny | {"families": tiny["families"][:1]}
    (tmp_path / "tiny.json").write_text(json.dumps(some))
    assert cli.main(["charts", str(tmp_path / "tiny.json"), "-o", str(tmp_path / "images")]) == 0
    names = [f"{name}.svg" for name in CHARTS]
    assert sorted(path.name for path in (tmp_path / "images").iterdir()) == sorted(names)


def test_pareto_front_keeps_what_nothing_beats():
    from benchmarks.accuracy.charts import pareto_front

    assert list(pareto_front([(3, 1), (1, 5), (2, 6), (4, 1), (2, 4)])) == [(1, 5), (2, 4), (3, 1)]
