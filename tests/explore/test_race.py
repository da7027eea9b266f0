"""The live atlas: its counts are those of the record of the atlas, and its pictures hold what is counted."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from topleft._apps.explore.race import HANDLERS, entries, lists, value_at
from topleft._apps.explore.session import Content, Session
from topleft.scene_families import FAMILIES, Axis

RECORD = Path(__file__).parents[2] / "benchmarks" / "records" / "atlas.json"
COLORS = {"another triangle shows": (204, 121, 167), "a gap": (213, 94, 0), "drawn more than once": (20, 130, 210)}


@pytest.fixture
def race(page):
    return lambda family, positions, seed=0: page.call("race.js", "race", view_of(family, positions, seed))


@pytest.fixture
def column(page):
    return lambda family, positions, seed=0: page.call("race.js", "raceColumn", view_of(family, positions, seed))


def view_of(family, positions, seed):
    return {"family": family, "positions": positions, "seed": seed}


def test_page_is_told_every_family_and_method():
    told = lists()
    assert list(told["families"]) == list(FAMILIES)
    assert [row["name"] for row in told["entries"]] == [entry.name for entry in entries()]
    assert told["families"]["far"]["axes"][0]["is_continuous"]
    assert not told["families"]["hub"]["axes"][0]["is_continuous"]
    json.dumps(told)


def test_production_methods_are_right_where_bresenham_is_not(race):
    told = race("edge", [3.0])
    rows = {row["name"]: row for row in told["rows"]}
    assert {rows[name]["text"] for name in ("auto", "edge", "scanline")} == {"right"}
    assert rows["bresenham_scanline"]["text"].endswith(" wrong")
    assert told["values"] == ["2^-6"]
    assert [len(picture) for picture in told["pictures"]] == [64 * 64 * 4] * len(rows)


def test_pictures_hold_what_is_counted(race):
    told = race("sliver", [2.0], 1)
    for row, pixels in zip(told["rows"], told["pictures"], strict=True):
        picture = np.array(pixels).reshape(64, 64, 4)
        is_marked = {name: (picture == (*color, 255)).all(axis=-1) for name, color in COLORS.items()}
        assert sum(marked.sum() for marked in is_marked.values()) == row["bad"]
        n_gaps, n_twice = is_marked["a gap"].sum(), is_marked["drawn more than once"].sum()
        assert row["title"] == f"{row['bad']} of 4096 pixels: {n_gaps} gaps, {n_twice} drawn more than once"


@pytest.mark.skipif(not RECORD.exists(), reason="the records of the benchmarks are not here")
@pytest.mark.parametrize(("family", "i"), [("edge", 4), ("fan", 1)])
def test_faults_add_up_to_the_record_of_the_atlas(race, column, family, i):
    record = json.loads(RECORD.read_text(encoding="utf-8"))
    rows = {row["entry"]: row for row in record["maps"] if row["family"] == family}
    facts = next(row for row in record["families"] if row["name"] == family)
    sums, n_edge_px = dict.fromkeys(rows, 0), 0
    for seed in range(facts["n_scenes"]):
        n_edge_px += column(family, [i], seed)["n_edge_px"]
        for row in race(family, [i], seed)["rows"]:
            sums[row["name"]] += sum(map(int, re.findall(r"(\d+) (?:gaps|drawn)", row["title"])))
    assert n_edge_px == facts["n_px"][i]
    assert sums == {name: row["gaps"][i] + row["overdrawn"][i] for name, row in rows.items()}


def test_column_is_the_same_as_the_pictures(race, column):
    rows = race("hub", [1.0])["rows"]
    for cell, row in zip(column("hub", [1.0])["cells"], rows, strict=True):
        assert cell["title"].startswith(f"{row['bad']} wrong pixels")
        assert (cell["color"] != "") == (row["bad"] > 0)
        assert ("gaps" in cell["kind"]) == (": 0 gaps" not in row["title"])


def test_method_that_refuses_says_why(race, column):
    told = race("far", [12.0])
    rows = {row["name"]: row for row in told["rows"]}
    assert rows["zigzag"]["text"] == "refuses"
    assert rows["zigzag"]["title"].startswith("origin must lie within")
    assert not any(told["pictures"][-1])
    assert column("far", [12.0])["cells"][-1]["kind"] == "refused"


def test_slider_goes_between_values_by_their_ratio():
    axis = Axis("thickness", {"1": 1.0, "2^-2": 0.25})
    assert value_at(axis, 0.5) == ("0.5", 0.5)
    assert value_at(axis, 1.0) == ("2^-2", 0.25)
    assert value_at(axis, 7.0) == ("2^-2", 0.25)
    assert value_at(Axis("triangles", {"4": 4, "16": 16}), 0.5) == ("8", 8)
    assert value_at(Axis("where", {"centre": (0, 0), "corner": (1, 1)}), 0.4) == ("centre", (0, 0))
    assert value_at(Axis("distance", {"1e-9": 1e-9, "0": 0.0}), 0.6) == ("0", 0.0)


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        ({"family": "near", "positions": [0]}, "family must be one of 'far', .*got 'near'"),
        ({"family": "far", "positions": [0, 1]}, "family 'far' has 1 parameters, got 2 positions"),
        ({"family": "far", "positions": [float("nan")]}, "positions must be finite"),
        ({"family": "far", "positions": [0], "seed": -1}, "seed from 0 to 99"),
    ],
)
def test_wrong_request_is_refused_with_a_sentence(request_, message):
    with pytest.raises(ValueError, match=message):
        HANDLERS["race.scene"](Session(Content()), {"seed": 0, **request_})
