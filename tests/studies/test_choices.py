"""The benchmark of choices at a tiny size: ways are forced, draw the same bits, and are put into tables and a chart."""

import json

import numpy as np
import pytest
from benchmarks import cli
from benchmarks.choices import measure as bench
from benchmarks.choices import tables as choices_tables
from benchmarks.choices.scenes import Scene, scenes
from benchmarks.choices.ways import CHOICES
from benchmarks.harness.ways import Way, answers_of, check_same_bits, take_rounds
from benchmarks.scenes.arrays import strewn_arrays

from topleft._core.raster.costs import cost_table

FIRST = {scene.kind: scene.name for scene in reversed(list(scenes(0.02)))}
TINY = bench.ChoiceOptions(scenes=list(FIRST.values()), rounds=1, seconds=0.0, scale=0.02)


@pytest.fixture(scope="module")
def record():
    """Every choice and the first scenes of each kind, at a fiftieth of the size."""
    return bench.run_choices(TINY)


def flat_scene(size=(300, 300)):
    """Triangles that cover a picture several times, at one depth."""
    return Scene("flat", "flat z", lambda: strewn_arrays(400, 60, size, 0.5), size)


def test_every_choice_is_measured(record):
    assert list(choices_tables.by_choice(record)) == list(CHOICES)
    assert all(row["ratio"] >= 1 and row["others"] for row in record["rows"])


def test_every_kind_of_scene_is_measured(record):
    assert {row["kind"] for row in record["rows"]} == {scene.kind for scene in scenes(0.02)}


@pytest.mark.parametrize(("choice", "chosen"), [("depth test", "ids alone"), ("method", "auto"), ("shares", "bands")])
def test_first_way_is_that_of_the_planner(choice, chosen):
    ways = CHOICES[choice](flat_scene())
    assert ways[0].name == chosen
    assert ways[0].forced == {}
    assert all(way.name != chosen for way in ways[1:])


@pytest.mark.parametrize(("n", "names"), [(9, ["1 thread", "2 threads"]), (9000, ["2 threads", "1 thread"])])
def test_threads_are_chosen_as_if_there_were_two(n, names):
    scene = Scene("flat", "flat z", lambda: strewn_arrays(n, 60, (300, 300), 0.5), (300, 300))
    assert [way.name for way in CHOICES["threads"](scene)] == names


def test_way_puts_its_value_in_place_and_back():
    before = cost_table().shared_item
    with Way("", lambda: (), {"shared_item": 7.0}).in_force():
        assert cost_table().shared_item == 7.0
    assert cost_table().shared_item == before


def test_forced_depth_test_is_another_decision():
    chosen, other = CHOICES["depth test"](flat_scene())
    found = [len(answers_of("common_depth", way.draw, **way.forced)) for way in (chosen, other)]
    assert found == [1, 0]  # where depths are compared, nobody asks which they are


def test_other_bits_are_an_error():
    ways = [Way("a", lambda: (np.zeros(3),)), Way("b", lambda: (np.array([0.0, -0.0, 0]),))]
    with pytest.raises(AssertionError, match="'b' draws other bits than 'a'"):
        check_same_bits("flat", ways)


def test_ratio_is_that_of_the_best_way():
    clock = iter(np.arange(1000.0)).__next__
    slow = Way("slow", lambda: (clock(), clock())[:0])
    fast = Way("fast", lambda: ())
    took = take_rounds([slow, fast], 3, 0.0, clock)
    assert (took[0] / took[1] == 3).all()


def test_hopeless_way_sits_out():
    clock = iter(np.arange(1000.0)).__next__
    slow = Way("slow", lambda: tuple(clock() for _ in range(9))[:0])
    assert [len(some) for some in take_rounds([Way("", lambda: ()), slow], 5, 0.0, clock)] == [5, 1]


def test_rows_replace_those_of_the_same_scene(record):
    row = record["rows"][0] | {"ratio": 7.0}
    again = bench.with_rows(record, [row])
    assert len(again["rows"]) == len(record["rows"])
    assert again["rows"][0]["ratio"] == 7.0


def test_tables_hold_each_choice_and_scene(record):
    summary = choices_tables.summary_text(record)
    assert all(f"| {name} " in summary for name in CHOICES)
    assert "no way" in choices_tables.misses_text({"rows": []}).lower()


def test_chart_has_a_row_for_each_choice(record, tmp_path):
    from benchmarks.choices.charts import chart_choices, draw_charts

    labels = [label.get_text() for label in chart_choices(record).axes[0].get_yticklabels()]
    assert labels == list(CHOICES)
    assert [path.name for path in draw_charts(record, tmp_path)] == ["choices.svg"]


def test_command_measures_and_adds_to_its_file(tmp_path, capsys):
    out = tmp_path / "choices.json"
    tiny = ["--repeats", "1", "--scale", "0.02", "-o", str(out)]
    for choice in ("method", "sorting"):
        assert cli.main(["choices", "--choice", choice, "--scene", "orthographic 10k", *tiny]) == 0
    assert {row["choice"] for row in json.loads(out.read_text())["rows"]} == {"method", "sorting"}
    assert cli.main(["choices", "--choice", "none such", *tiny]) == 2
    assert "--choice must be some of method" in capsys.readouterr().err
