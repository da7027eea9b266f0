"""Traces: the picture of the steps is that of the kernel, and the values are those of the rules."""

from __future__ import annotations

import json

import numpy as np
import pytest

import topleft as tl
from topleft._apps.explore import trace as traces
from topleft._apps.explore.session import Content, Session
from topleft._apps.explore.trace import TRACED, trace
from topleft.methods import CLASSICS, METHODS, find_method, reference

SIZE = (21, 19)
QUAD = [[2.0, 2.0], [18.5, 3.25], [4.0, 16.75], [17.0, 15.0]]
HALVES = [[0, 1, 2], [1, 3, 2]]
EVERY_METHOD = pytest.mark.parametrize("method", TRACED)


def soup(seed, n=6, low=-8, high=28, *, whole=False):
    xy = np.random.default_rng(seed).uniform(low, high, (3 * n, 2))
    return np.round(xy) if whole else xy, np.arange(3 * n).reshape(-1, 3)


def options_of(method, bits=8):
    found = find_method(method)
    return {"subpixel_bits": bits} if found.code is not None or found.has_subpixel_bits else {}


def test_every_method_but_auto_is_traced():
    assert {*TRACED, "auto"} == {*METHODS, *CLASSICS}


@EVERY_METHOD
def test_picture_of_the_steps_is_that_of_the_kernel(method):
    for scene in (soup(1), soup(2, whole=True), soup(3, low=0, high=5, whole=True), (QUAD, HALVES)):
        made = trace(*scene, SIZE, method=method)
        assert np.array_equal(made.picture(), made.counts)
        assert np.array_equal(made.counts, tl.overdraw(*scene, SIZE, method=method))


@EVERY_METHOD
def test_window_of_a_picture_has_its_own_steps(method):
    vertices, triangles = soup(5, low=0, high=40)
    made = trace(vertices, triangles, (15, 12), method=method, origin=(9, 14))
    assert np.array_equal(made.picture(), made.counts)
    assert np.array_equal(made.counts, tl.overdraw(vertices, triangles, (15, 12), method=method, origin=(9, 14)))
    assert all(0 <= step.y < 12 for step in made.steps if step.kind != "triangle")


@pytest.mark.parametrize("bits", [0, 1, 4, 16])
@pytest.mark.parametrize("method", [name for name in TRACED if options_of(name)])
def test_picture_of_the_steps_is_that_of_the_kernel_at_other_precisions(method, bits):
    made = trace(*soup(4), SIZE, method=method, subpixel_bits=bits)
    assert np.array_equal(made.picture(), tl.overdraw(*soup(4), SIZE, method=method, **options_of(method, bits)))


@pytest.mark.parametrize("variant", ["edge", "scanline"])
@pytest.mark.parametrize("bits", [0, 1, 8, 16])
def test_walk_is_the_exact_reference(variant, bits):
    for seed in range(8):
        vertices, triangles = soup(seed)
        for scene in (vertices, triangles), soup(seed, low=0, high=6, whole=True):
            expected = reference.overdraw(*scene, SIZE, subpixel_bits=bits)
            assert np.array_equal(trace(*scene, SIZE, method=variant, subpixel_bits=bits).counts, expected)


@pytest.mark.parametrize("method", ["edge", "scanline", "float_barycentric/float64"])
def test_window_far_away_is_traced(method):
    vertices = np.array([[2.0, 2.0], [18.5, 3.25], [4.0, 16.75]]) + 2.0**40
    made = trace(vertices, [[0, 1, 2]], SIZE, method=method, origin=(2**40, 2**40))
    assert made.counts.sum() > 50
    assert np.array_equal(made.picture(), made.counts)


def test_numbers_of_far_vertices_have_more_than_64_bits():
    vertices, size = [[-1e14, -3e13], [1e14, 5.0], [7.5, 1e14]], (9, 8)
    made = trace(vertices, [[0, 1, 2]], size, method="edge")
    assert np.array_equal(made.counts, tl.overdraw(vertices, [[0, 1, 2]], size, method="edge"))
    numbers = [
        abs(number) for step in made.steps for value in step.values.values() for number in np.ravel(value).tolist()
    ]
    assert max(numbers) > 2**64
    first, second = made.steps[1].values, made.steps[2].values
    assert [first[f"E{k}"] - second[f"E{k}"] for k in range(3)] == made.steps[0].values["dy"]


def test_picture_after_some_steps_has_what_they_drew():
    made = trace([[0, 0], [3, 0], [0, 3]], [[0, 1, 2]], (3, 3), method="scanline")
    assert [step.kind for step in made.steps] == ["triangle", "row", "span", "row", "span", "row"]
    assert made.picture(3).tolist() == [[1, 1, 0], [0, 0, 0], [0, 0, 0]]
    assert made.picture().tolist() == [[1, 1, 0], [1, 0, 0], [0, 0, 0]]


def test_edge_values_are_stepped_by_additions_and_hold_the_bias():
    made = trace([[0, 0], [3, 0], [0, 3]], [[0, 1, 2]], (3, 3), method="edge_increment", subpixel_bits=1)
    set_up, *tests = made.steps
    assert set_up.values["bias"] == [-1, 0, 0]  # of the edges opposite (0, 0), (3, 0) and (0, 3)
    first, second = (step.values for step in tests[:2])
    for k in range(3):
        assert second[f"E{k}"] - first[f"E{k}"] == set_up.values["step_x"][k]
    assert [(step.x, step.y) for step in tests if step.is_drawn] == [(0, 0), (1, 0), (0, 1)]
    on_the_edge = next(step for step in tests if (step.x, step.y) == (2, 0))
    assert on_the_edge.values["E0"] == -1  # 0, and one unit less: the edge is neither top nor left


def test_scanline_steps_quotient_and_remainder():
    made = trace([[0, 0], [7, 2], [0, 5]], [[0, 1, 2]], (8, 5), method="scanline", subpixel_bits=0)
    rows = [step for step in made.steps if step.kind == "row"]
    assert [(row.values["first"], row.values["end"]) for row in rows] == [(0, 2), (0, 5), (0, 6), (0, 3), (0, 1)]
    slanted = {name for row in rows for name in row.values} - {"first", "end"}
    assert slanted == {"q0 r0", "q1 r1", "q2 r2"}
    assert all(0 <= row.values[name][1] for row in rows for name in slanted)


def test_bresenham_tells_the_error_of_its_lines():
    made = trace([[0, 0], [0, 4], [2, 4]], [[0, 1, 2]], (5, 5), method="bresenham_scanline")
    right = [step for step in made.steps if step.kind == "line" and step.values["side"] == "right"]
    assert [(step.x, step.y, step.values["error"]) for step in right] == [
        (0, 0, 0), (1, 1, -4), (1, 2, 0), (2, 3, -4), (2, 4, 0)
    ]  # fmt: skip


def test_page_is_told_each_step_in_words():
    large = [[4096.0, 0.0], [0.0, 4096.0], [0.0, 0.0]]
    request = {"vertices": large, "triangles": [[0, 1, 2]], "size": [4, 4], "method": "edge_increment"}
    reply = traces.HANDLERS["steps.trace"](Session(Content()), request | {"subpixel_bits": 16})
    header = json.loads(json.dumps(reply.header))
    x, y, last, is_drawn, triangle, kind, sentence, values = header["steps"][2]
    assert (x, y, last, is_drawn, triangle, kind) == (1, 0, 1, True, 0, "test")
    assert sentence == "Pixel 1, 0 of triangle 0: drawn."
    e2 = next(row for row in header["steps"][1][7] if row[0] == "E2")
    assert e2 == ["E2", str(2**56 - 2**44 - 1), ""]  # as it is: JavaScript has no such number
    assert [row[2] for row in values] == ["+1.75922e+13", "+0", "-1.75922e+13"]
    assert header["outlines"] == ["4096.0,0.0 0.0,4096.0 0.0,0.0"]
    assert reply.arrays["counts"].tolist() == [[1] * 4] * 4


def test_every_kind_of_step_has_its_sentence():
    kinds = {}
    for method in ("edge", "scanline", "bresenham_scanline"):
        steps = trace(QUAD, HALVES, SIZE, method=method).steps
        kinds |= {step.kind: words for step, (words, _) in zip(steps, traces.told(steps), strict=True)}
    assert {*kinds} == {"triangle", "row", "line", "test", "span"}
    assert "None" not in " ".join(kinds.values())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "auto"}, "method must be one of 'edge', 'scanline', .* to be traced, got 'auto'"),
        ({"method": "best"}, "method must be one of 'auto', 'edge'"),
        ({"method": "edge", "size": (2000, 20)}, "1024 pixels a side and 1000 triangles at most, got .2000, 20. and 1"),
        ({"method": "edge", "size": (1000, 1000)}, "a trace must have 40000 steps at most"),
        ({"method": "point_in_triangle", "size": (1000, 1000)}, "a trace must have 40000 steps at most"),
    ],
)
def test_what_cannot_be_traced_is_refused(options, message):
    given = {"size": SIZE, **options}
    with pytest.raises(ValueError, match=message):
        trace([[0, 0], [2000, 0], [0, 2000]], [[0, 1, 2]], **given)


def test_vertex_that_is_not_finite_is_refused_by_name():
    with pytest.raises(ValueError, match="finite"):
        trace([[0, 0], [np.nan, 0], [0, 3]], [[0, 1, 2]], (4, 4), method="edge")
