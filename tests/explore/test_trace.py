"""Steps of the page: the picture of the steps is that of the kernel, and the values are those of the rules."""

import numpy as np
import pytest

import topleft as tl
from topleft.methods import CLASSICS, METHODS, find_method, reference

TRACED = (*(name for name in METHODS if name != "auto"), *CLASSICS)
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


class Trace:
    """Steps as the page has them: values by name, as texts."""

    def __init__(self, told, size):
        self.told, self.size, self.steps = told, size, told["steps"]
        self.counts = np.array(told["counts"]).reshape(size[::-1])

    def picture(self, n_steps=None):
        """How often each pixel has been drawn after so many steps."""
        counts = np.zeros_like(self.counts)
        for x, y, last, is_drawn, *_ in self.steps[:n_steps]:
            if is_drawn:
                counts[y, x : last + 1] += 1
        return counts

    def values(self, i):
        """The numbers of a step, lists as they are."""
        values = {name: [*map(float, text.split(", "))] for name, text, _ in self.steps[i][7]}
        return {name: numbers[0] if len(numbers) == 1 else numbers for name, numbers in values.items()}


@pytest.fixture(scope="module")
def trace(page):
    def traced(vertices, triangles, size, *, method, subpixel_bits=8, origin=(0, 0)):
        vertices, triangles = np.asarray(vertices).tolist(), np.asarray(triangles).tolist()
        state = {"vertices": vertices, "triangles": triangles, "size": size, "origin": origin}
        return Trace(page.call("steps.js", "recorded", state, method, subpixel_bits), size)

    return traced


@EVERY_METHOD
def test_picture_of_the_steps_is_that_of_the_kernel(trace, method):
    for scene in (soup(1), soup(2, whole=True), soup(3, low=0, high=5, whole=True), (QUAD, HALVES)):
        made = trace(*scene, SIZE, method=method)
        assert np.array_equal(made.picture(), made.counts)
        assert np.array_equal(made.counts, tl.overdraw(*scene, SIZE, method=method))


@EVERY_METHOD
def test_window_of_a_picture_has_its_own_steps(trace, method):
    vertices, triangles = soup(5, low=0, high=40)
    made = trace(vertices, triangles, (15, 12), method=method, origin=(9, 14))
    assert np.array_equal(made.picture(), made.counts)
    assert np.array_equal(made.counts, tl.overdraw(vertices, triangles, (15, 12), method=method, origin=(9, 14)))
    assert all(0 <= step[1] < 12 for step in made.steps if step[5] != "triangle")


@pytest.mark.parametrize("bits", [0, 1, 4, 16])
@pytest.mark.parametrize("method", [name for name in TRACED if options_of(name)])
def test_picture_of_the_steps_is_that_of_the_kernel_at_other_precisions(trace, method, bits):
    made = trace(*soup(4), SIZE, method=method, subpixel_bits=bits)
    assert np.array_equal(made.picture(), tl.overdraw(*soup(4), SIZE, method=method, **options_of(method, bits)))


@pytest.mark.parametrize("variant", ["edge", "scanline"])
@pytest.mark.parametrize("bits", [0, 1, 8, 16])
def test_walk_is_the_exact_reference(trace, variant, bits):
    for seed in range(8):
        vertices, triangles = soup(seed)
        for scene in (vertices, triangles), soup(seed, low=0, high=6, whole=True):
            expected = reference.overdraw(*scene, SIZE, subpixel_bits=bits)
            assert np.array_equal(trace(*scene, SIZE, method=variant, subpixel_bits=bits).counts, expected)


@pytest.mark.parametrize("method", ["edge", "scanline", "float_barycentric/float64"])
def test_window_far_away_is_traced(trace, method):
    vertices = np.array([[2.0, 2.0], [18.5, 3.25], [4.0, 16.75]]) + 2.0**40
    made = trace(vertices, [[0, 1, 2]], SIZE, method=method, origin=(2**40, 2**40))
    assert made.counts.sum() > 50
    assert np.array_equal(made.picture(), made.counts)


def test_numbers_of_far_vertices_have_more_than_64_bits(trace):
    vertices, size = [[-1e14, -3e13], [1e14, 5.0], [7.5, 1e14]], (9, 8)
    made = trace(vertices, [[0, 1, 2]], size, method="edge")
    assert np.array_equal(made.counts, tl.overdraw(vertices, [[0, 1, 2]], size, method="edge"))
    set_up, *tests = [{name: [*map(int, text.split(", "))] for name, text, _ in step[7]} for step in made.steps[:3]]
    assert max(abs(number) for numbers in tests[0].values() for number in numbers) > 2**64
    assert [tests[0][f"E{k}"][0] - tests[1][f"E{k}"][0] for k in range(3)] == set_up["dy"]


def test_picture_after_some_steps_has_what_they_drew(trace):
    made = trace([[0, 0], [3, 0], [0, 3]], [[0, 1, 2]], (3, 3), method="scanline")
    assert [step[5] for step in made.steps] == ["triangle", "row", "span", "row", "span", "row"]
    assert made.picture(3).tolist() == [[1, 1, 0], [0, 0, 0], [0, 0, 0]]
    assert made.picture().tolist() == [[1, 1, 0], [1, 0, 0], [0, 0, 0]]


def test_edge_values_are_stepped_by_additions_and_hold_the_bias(trace):
    made = trace([[0, 0], [3, 0], [0, 3]], [[0, 1, 2]], (3, 3), method="edge_increment", subpixel_bits=1)
    assert made.values(0)["bias"] == [-1, 0, 0]  # of the edges opposite (0, 0), (3, 0) and (0, 3)
    first, second = made.values(1), made.values(2)
    for k in range(3):
        assert second[f"E{k}"] - first[f"E{k}"] == made.values(0)["step_x"][k]
    assert [(x, y) for x, y, _, is_drawn, *_ in made.steps if is_drawn] == [(0, 0), (1, 0), (0, 1)]
    on_the_edge = next(i for i, step in enumerate(made.steps) if i and step[:2] == [2, 0])
    assert made.values(on_the_edge)["E0"] == -1  # 0, and one unit less: the edge is neither top nor left


def test_scanline_steps_quotient_and_remainder(trace):
    made = trace([[0, 0], [7, 2], [0, 5]], [[0, 1, 2]], (8, 5), method="scanline", subpixel_bits=0)
    rows = [made.values(i) for i, step in enumerate(made.steps) if step[5] == "row"]
    assert [(row["first"], row["end"]) for row in rows] == [(0, 2), (0, 5), (0, 6), (0, 3), (0, 1)]
    slanted = {name for row in rows for name in row} - {"first", "end"}
    assert slanted == {"q0 r0", "q1 r1", "q2 r2"}
    assert all(0 <= row[name][1] for row in rows for name in slanted)


def test_bresenham_tells_the_error_of_its_lines(trace):
    made = trace([[0, 0], [0, 4], [2, 4]], [[0, 1, 2]], (5, 5), method="bresenham_scanline")
    right = [i for i, step in enumerate(made.steps) if step[6].startswith("The right line")]
    assert [(*made.steps[i][:2], made.values(i)["error"]) for i in right] == [
        (0, 0, 0), (1, 1, -4), (1, 2, 0), (2, 3, -4), (2, 4, 0)
    ]  # fmt: skip


def test_steps_have_words_and_changes(trace):
    large = [[4096.0, 0.0], [0.0, 4096.0], [0.0, 0.0]]
    told = trace(large, [[0, 1, 2]], (4, 4), method="edge_increment", subpixel_bits=16).told
    *place, sentence, values = told["steps"][2]
    assert place == [1, 0, 1, True, 0, "test"]
    assert sentence == "Pixel 1, 0 of triangle 0: drawn."
    e2 = next(row for row in told["steps"][1][7] if row[0] == "E2")
    assert e2 == ["E2", str(2**56 - 2**44 - 1), ""]  # as it is: JavaScript has no such number
    assert [row[2] for row in values] == ["+1.75922e+13", "+0", "-1.75922e+13"]
    assert told["outlines"] == ["4096,0 0,4096 0,0"]
    assert told["counts"] == [1] * 16


def test_every_kind_of_step_has_its_sentence(trace):
    kinds = {}
    for method in ("edge", "scanline", "bresenham_scanline"):
        kinds |= {step[5]: step[6] for step in trace(QUAD, HALVES, SIZE, method=method).steps}
    assert {*kinds} == {"triangle", "row", "line", "test", "span"}
    assert "undefined" not in " ".join(kinds.values())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "auto"}, "method must be a walker or a classic to be traced, got 'auto'"),
        ({"method": "best"}, "method must be one of auto, edge"),
        ({"method": "edge", "size": (2000, 20)}, "size must be at most 256 pixels a side, got .2000, 20."),
        ({"method": "edge", "size": (256, 256)}, "a trace must have 40000 steps at most"),
        ({"method": "point_in_triangle", "size": (256, 256)}, "a trace must have 40000 steps at most"),
    ],
)
def test_what_cannot_be_traced_is_refused(trace, options, message):
    with pytest.raises(ValueError, match=message):
        trace([[0, 0], [2000, 0], [0, 2000]], [[0, 1, 2]], **{"size": SIZE, **options})
