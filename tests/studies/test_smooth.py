"""Anti-aliased pictures in the benchmark suite: their error, their tables, and the page that shows them."""

import numpy as np
import pytest
from benchmarks.harness.errors import area_error, draw_exact
from benchmarks.harness.rounds import RunOptions, run_cases
from benchmarks.peers import load_peer
from benchmarks.run import smooth_tables
from benchmarks.scenes.cases import CASES

import topleft as tl

ISA = tl.build_info()["isa"]


@pytest.fixture(scope="module")
def record():
    """Our three ways to draw the smallest scene."""
    return run_cases(RunOptions(["tiny-smooth"], [], [ISA], repeats=1, seconds=0))


def test_area_error_by_hand():
    area = np.array([[0, 0.5, 0.25], [1, 1, 1]])
    drawn = np.array([[0.7, 0.5, 0.75], [1, 0.5, 0.75]])
    error = area_error({"area": drawn}, area)
    assert error.as_dict() == {"wrong_px": 2, "darkest": 0.5, "rms": pytest.approx(0.125**0.5), "worst": 0.5}
    color = np.rint(255 * drawn[..., None] * [1, 0, 0]).astype(np.uint8)
    assert area_error({"color": color}, area).wrong_px == 2


def test_exact_picture_of_many_colours_is_none():
    assert draw_exact(CASES["smooth-1000x300"].make()) == {}


def test_every_way_takes_part(record):
    names = [f"topleft {ISA} {way}" for way in load_peer("topleft").WAYS["smooth-fill"]]
    assert [entry["name"] for entry in record["scenes"][0]["runs"]] == names


def test_tables_name_each_way_once(record):
    text = smooth_tables.times_text(record)
    for way in load_peer("topleft").WAYS["smooth-fill"]:
        assert text.count(f"| topleft {ISA} {way} ") == 1
    assert text.count("\n") == 4
