"""The live atlas: its counts are those of the record of the atlas, and what it sends fits the pictures."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from topleft._apps.explore import race
from topleft._apps.explore.race import COLORS, HANDLERS, entries, value_at
from topleft._apps.explore.session import Content, Session
from topleft.scene_families import FAMILIES, Axis

RECORD = Path(__file__).parents[2] / "benchmarks" / "records" / "atlas.json"


def ask(what="race.draw", **request):
    """The header and the arrays of an answer."""
    return HANDLERS[what](Session(Content()), request)


def test_page_is_told_every_family_and_method():
    header, _ = ask("race.families")
    assert list(header["families"]) == list(FAMILIES)
    assert header["methods"] == [entry.name for entry in entries()]
    assert header["families"]["far"]["axes"][0]["is_continuous"]
    assert not header["families"]["hub"]["axes"][0]["is_continuous"]
    json.dumps(header)


def test_production_methods_are_right_where_bresenham_is_not():
    header, arrays = ask(family="edge", positions=[3.0])
    rows = {row["name"]: row for row in header["rows"]}
    assert {rows[name]["text"] for name in ("auto", "edge", "scanline")} == {"right"}
    assert rows["bresenham_scanline"]["text"].endswith(" wrong")
    assert header["values"] == ("2^-6",)
    assert arrays["pictures"].shape == (len(rows), 64, 64, 4)


def test_pictures_hold_what_is_counted():
    header, arrays = ask(family="sliver", positions=[2.0], seed=1)
    for row, picture in zip(header["rows"], arrays["pictures"], strict=True):
        is_marked = {name: (picture == (*color, 255)).all(axis=-1) for name, color in COLORS.items()}
        assert sum(marked.sum() for marked in is_marked.values()) == row["bad"]
        n_gaps, n_twice = is_marked["a gap"].sum(), is_marked["drawn more than once"].sum()
        assert row["title"] == f"{row['bad']} of 4096 pixels: {n_gaps} gaps, {n_twice} drawn more than once"


@pytest.mark.skipif(not RECORD.exists(), reason="the records of the benchmarks are not here")
@pytest.mark.parametrize(("family", "i"), [("edge", 4), ("large", 3), ("fan", 1)])
def test_faults_add_up_to_the_record_of_the_atlas(family, i):
    record = json.loads(RECORD.read_text(encoding="utf-8"))
    rows = {row["entry"]: row for row in record["maps"] if row["family"] == family}
    facts = next(row for row in record["families"] if row["name"] == family)
    sums, n_edge_px = dict.fromkeys(rows, 0), 0
    for seed in range(facts["n_scenes"]):
        exact, _ = race.scene_at(family, (float(i),), seed)
        n_edge_px += exact.picture().is_edge.sum()
        for entry in entries():
            faults = race.faults_of(entry, exact)
            sums[entry.name] += faults.gaps.sum() + faults.overdrawn.sum()
    assert n_edge_px == facts["n_px"][i]
    assert sums == {name: row["gaps"][i] + row["overdrawn"][i] for name, row in rows.items()}


def test_column_is_the_same_as_the_pictures():
    cells = ask("race.column", family="hub", positions=[1.0])[0]["cells"]
    rows = ask(family="hub", positions=[1.0])[0]["rows"]
    for cell, row in zip(cells, rows, strict=True):
        assert cell["title"].startswith(f"{row['bad']} wrong pixels")
        assert (cell["color"] != "") == (row["bad"] > 0)
        assert ("gaps" in cell["kind"]) == (": 0 gaps" not in row["title"])


def test_method_that_refuses_says_why():
    header, arrays = ask(family="far", positions=[12.0])
    rows = {row["name"]: row for row in header["rows"]}
    assert rows["zigzag"]["text"] == "refuses"
    assert rows["zigzag"]["title"].startswith("origin must lie within")
    assert not arrays["pictures"][-1].any()
    assert ask("race.column", family="far", positions=[12.0])[0]["cells"][-1]["kind"] == "refused"


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
        ({"family": "far", "positions": [0], "seed": -1}, "seed at least 0"),
    ],
)
def test_wrong_request_is_refused_with_a_sentence(request_, message):
    with pytest.raises(ValueError, match=message):
        ask(**request_)
