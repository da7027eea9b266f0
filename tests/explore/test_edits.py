"""Edits of triangles on the page: edits.js by node, its states drawn by the page."""

import pytest

SQUARE = {"vertices": [[1.5, 1.5], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]], "triangles": [[0, 1, 2], [1, 3, 2]]}
SQUARE |= {"size": [11, 12], "origin": [0, 0]}
NOTHING = SQUARE | {"vertices": [], "triangles": []}
EDITS = {
    "add": (SQUARE, "add", 0), "split": (SQUARE, "split", 0), "flip": (SQUARE, "flip", 1),
    "remove": (SQUARE, "remove", 1), "add to nothing": (NOTHING, "add", 0), "remove nothing": (NOTHING, "remove", 0),
}  # fmt: skip


@pytest.fixture(scope="module")
def edited(page):
    return {name: page.call("tools", "edited", *edit) for name, edit in EDITS.items()}


def counts_of(page, state):
    return page.draw(state)[0]["a"]["counts"]


def test_edit_makes_a_state_that_can_be_drawn(page, edited):
    n = {name: len(found["triangles"]) for name, found in edited.items()}
    assert n == {"add": 3, "split": 4, "flip": 2, "remove": 1, "add to nothing": 1, "remove nothing": 0}
    for found in edited.values():
        counts_of(page, SQUARE | {name: found[name] for name in ("vertices", "triangles")})


def test_edit_of_a_triangle_leaves_the_others_and_their_vertices(edited):
    assert edited["flip"]["triangles"] == [[0, 1, 2], [1, 2, 3]]
    assert edited["remove"] == {"vertices": SQUARE["vertices"][:3], "triangles": [[0, 1, 2]], "triangle": 0}
    assert edited["add"]["vertices"][:4] == SQUARE["vertices"]
    assert edited["add"]["triangle"] == 2


def test_split_triangle_covers_the_same_pixels(page, edited):
    split = SQUARE | {name: edited["split"][name] for name in ("vertices", "triangles")}
    assert (counts_of(page, split) == counts_of(page, SQUARE)).all()
