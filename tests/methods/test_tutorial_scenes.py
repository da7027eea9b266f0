"""What each method makes of the triangles that tutorials draw: degenerate ones, shared edges, tight fans."""

import methods_tables
import numpy as np
import pytest

import topleft as tl
from topleft import scenes
from topleft.methods import CLASSICS, METHODS

SIZE = scenes.TUTORIAL_SIZE
ALL = METHODS | CLASSICS
DEGENERATE = ["coincident-vertices", "single-point", "horizontal-line", "vertical-line"]

#: Which triangles without area a method draws all the same.
DRAWS_DEGENERATE = {
    "point_in_triangle": DEGENERATE,
    "bresenham_scanline": DEGENERATE,
    "bresenham_scanline/top-left": ["horizontal-line", "vertical-line"],
    "bresenham_scanline/wireframe": DEGENERATE,
    "lerp_scanline": ["coincident-vertices", "vertical-line"],
    "lerp_scanline/plus-one": ["coincident-vertices", "vertical-line"],
    "row_crossing": ["coincident-vertices", "vertical-line"],
}

#: Methods that draw every sample of the square exactly once.
ONCE = [name for name, method in ALL.items() if method.claims.exact and not method.claims.overdraws_shared_edges]


def counts(scene, name):
    return tl.overdraw(*scenes.TUTORIAL_SCENES[scene](), SIZE, method=name)


def exact_labels(scene):
    """Which triangle owns a pixel under the top-left rule, with vertices in the middle of theirs; 0: none."""
    vertices, triangles = scenes.TUTORIAL_SCENES[scene]()
    return labels(scene, "auto", vertices + 0.5, triangles)


def labels(scene, name, vertices=None, triangles=None):
    if vertices is None:
        vertices, triangles = scenes.TUTORIAL_SCENES[scene]()
    return tl.fill(vertices, triangles, np.arange(1, len(triangles) + 1, dtype=np.uint8), SIZE, method=name)


def interior(drawn):
    """The drawn pixels whose eight neighbours are drawn, too."""
    padded = np.pad(drawn, 1)
    views = [padded[i : i + drawn.shape[0], j : j + drawn.shape[1]] for i in range(3) for j in range(3)]
    return np.logical_and.reduce(views)


def test_there_are_eleven_single_triangles_inside_the_frame():
    single = [make() for make in scenes.TUTORIAL_SCENES.values() if len(make()[1]) == 1]
    assert len(single) == 11
    assert all((v >= 0).all() and (v < SIZE).all() and (v == np.trunc(v)).all() for v, _ in single)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("scene", DEGENERATE)
def test_degenerate_triangle_is_drawn_by_those_who_draw_it(name, scene):
    assert counts(scene, name).any() == (scene in DRAWS_DEGENERATE.get(name, []))


@pytest.mark.parametrize("scene", ["horizontal-sliver", "vertical-sliver"])
def test_sliver_of_one_pixel_is_nothing_for_the_rule_on_whole_pixels_and_a_line_for_closed_edges(scene):
    long_side = 601 if scene == "horizontal-sliver" else 361
    assert not counts(scene, "point_in_triangle/top-left").any()
    assert long_side <= (counts(scene, "bresenham_scanline") > 0).sum() <= 2 * long_side
    assert 0 < counts(scene, "auto").sum() < long_side  # half of a row or column of pixels


def test_lerp_scanline_draws_a_horizontal_sliver_as_one_pixel():
    assert counts("horizontal-sliver", "lerp_scanline").sum() == 1  # its only row is the one of the upper corner


@pytest.mark.parametrize("name", ONCE)
@pytest.mark.parametrize("scene", ["two-triangles", "square-of-four"])
def test_square_is_drawn_once_by_the_exact_ones(name, scene):
    first = 51 if name.endswith("bottom-right") and ALL[name].claims.integer_vertices else 50
    expected = np.zeros(SIZE[::-1], np.int32)
    expected[first : first + 50, first : first + 50] = 1
    assert np.array_equal(counts(scene, name), expected)


@pytest.mark.parametrize(("scene", "n_twice_or_more"), [("two-triangles", 51), ("square-of-four", 101)])
def test_point_in_triangle_draws_shared_edges_again(scene, n_twice_or_more):
    drawn = counts(scene, "point_in_triangle")
    assert drawn.max() == (2 if scene == "two-triangles" else 4)
    assert ((drawn > 0).sum(), (drawn > 1).sum()) == (51 * 51, n_twice_or_more)


@pytest.mark.parametrize("scene", ["two-triangles", "square-of-four"])
def test_bresenham_top_left_draws_the_square_once(scene):
    expected = counts(scene, "point_in_triangle/top-left")
    assert np.array_equal(counts(scene, "bresenham_scanline/top-left"), expected)


def test_bresenham_draws_the_row_of_a_split_twice():
    drawn = counts("tall", "bresenham_scanline")
    assert np.unique(np.argwhere(drawn > 1)[:, 0]).tolist() == [210]


@pytest.mark.parametrize("name", ONCE)
@pytest.mark.parametrize("scene", ["composite-major-right", "composite-major-left"])
def test_composite_is_drawn_as_its_whole_by_the_exact_ones(name, scene):
    vertices, _ = scenes.TUTORIAL_SCENES[scene]()
    whole = tl.overdraw(vertices[[0, 1, 3]], [[0, 1, 2]], SIZE, method=name)
    assert np.array_equal(counts(scene, name), whole)
    assert whole.max() == 1


@pytest.mark.parametrize("scene", ["composite-major-right", "composite-major-left"])
@pytest.mark.parametrize("name", ["point_in_triangle", "bresenham_scanline"])
def test_composite_is_drawn_twice_where_it_is_cut_by_closed_edges(name, scene):
    drawn = counts(scene, name)
    vertices, _ = scenes.TUTORIAL_SCENES[scene]()
    first, last = sorted(vertices[[1, 2], 0].astype(int))
    assert np.argwhere(drawn > 1).tolist() == [[70, x] for x in range(first, last + 1)]


def test_bresenham_wireframe_is_the_outline_of_the_flat_parts():
    vertices, _ = scenes.TUTORIAL_SCENES["horizontal-edge"]()
    (a, b, c), drawn = vertices.astype(int), counts("horizontal-edge", "bresenham_scanline/wireframe")
    expected = np.zeros_like(drawn)
    expected[80, 100:541] += 1
    for end in (a, b):
        columns, rows = tl.bresenham_line(*end, *c).T
        expected[rows, columns] += 1
    assert np.array_equal(drawn, expected)


def test_tight_fan_bresenham_top_left_is_filled_but_pixels_belong_to_the_wrong_triangles():
    drawn, exact = counts("tight-fan", "bresenham_scanline/top-left"), exact_labels("tight-fan")
    assert drawn.max() == 1
    assert (drawn[interior(exact > 0)] == 1).all()  # no gap in the union
    assert ((exact > 0) & (drawn == 0)).sum() == 48  # all of them on the outline
    assert (labels("tight-fan", "bresenham_scanline/top-left") != exact).sum() == 697


def test_tight_fan_sideways_bresenham_top_left_has_gaps_and_overdraw():
    # Each triangle is split at mid height, and parts of a line are not on the pixels of the whole.
    drawn, exact = counts("tight-fan-sideways", "bresenham_scanline/top-left"), exact_labels("tight-fan-sideways")
    assert ((drawn == 0)[interior(exact > 0)].sum(), (drawn > 1).sum()) == (24, 77)


def test_tight_fan_sideways_lerp_plus_one_falls_short_of_the_shared_edges():
    exact = exact_labels("tight-fan-sideways") > 0
    assert not (counts("tight-fan-sideways", "lerp_scanline") == 0)[interior(exact)].any()
    assert (counts("tight-fan-sideways", "lerp_scanline/plus-one") == 0)[interior(exact)].sum() == 339


@pytest.mark.parametrize("scene", ["tight-fan", "tight-fan-sideways"])
def test_tight_fan_is_drawn_once_by_the_exact_ones(scene):
    for name in ONCE:
        drawn = counts(scene, name)
        assert drawn.max() == 1
        assert (drawn == 1)[interior(exact_labels(scene) > 0)].all()


def test_tables_of_the_document_are_up_to_date():
    text = methods_tables.DOCUMENT.read_text(encoding="utf-8")
    assert methods_tables.with_tables(text) == text, "run: python tests/methods_tables.py"


def test_document_has_a_section_for_each_method():
    text = methods_tables.DOCUMENT.read_text(encoding="utf-8")
    modules = dict.fromkeys(name.partition("/")[0] for name in CLASSICS)
    titles = [line.removeprefix("## `").removesuffix("`") for line in text.splitlines() if line.startswith("## `")]
    assert titles == [*modules, "edge", "scanline"]
    for method in CLASSICS.values():
        assert method.source.partition(",")[0] in text
