"""Edits of triangles on the page: edits.js by node, its states drawn by Python."""

import json
import shutil
import subprocess
from importlib.resources import files

import pytest

from topleft._apps.explore.handlers import answer
from topleft._apps.explore.session import Content, Session

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed")

SQUARE = {"vertices": [[1.5, 1.5], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]], "triangles": [[0, 1, 2], [1, 3, 2]]}
SQUARE |= {"size": [11, 12], "origin": [0, 0]}
NOTHING = SQUARE | {"vertices": [], "triangles": []}
EDITS = {
    "add": (SQUARE, "add", 0), "split": (SQUARE, "split", 0), "flip": (SQUARE, "flip", 1),
    "remove": (SQUARE, "remove", 1), "add to nothing": (NOTHING, "add", 0), "remove nothing": (NOTHING, "remove", 0),
}  # fmt: skip


@pytest.fixture(scope="module")
def edited():
    page = files("topleft._apps.explore").joinpath("page", "edits.js").as_uri()
    code = f"""import {{edited}} from "{page}";
    const edits = {json.dumps(EDITS)};
    for (const name in edits) edits[name] = edited(...edits[name]);
    console.log(JSON.stringify(edits));
    """
    done = subprocess.run([NODE, "--input-type=module", "-e", code], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def counts_of(state):
    reply = answer(Session(Content()), {"do": "pixels.draw", "id": 1, "state": state})
    assert "error" not in reply.header
    return reply.arrays["a_counts"]


def test_edit_makes_a_state_that_can_be_drawn(edited):
    n = {name: len(found["triangles"]) for name, found in edited.items()}
    assert n == {"add": 3, "split": 4, "flip": 2, "remove": 1, "add to nothing": 1, "remove nothing": 0}
    for found in edited.values():
        counts_of(SQUARE | {name: found[name] for name in ("vertices", "triangles")})


def test_edit_of_a_triangle_leaves_the_others_and_their_vertices(edited):
    assert edited["flip"]["triangles"] == [[0, 1, 2], [1, 2, 3]]
    assert edited["remove"] == {"vertices": SQUARE["vertices"][:3], "triangles": [[0, 1, 2]], "triangle": 0}
    assert edited["add"]["vertices"][:4] == SQUARE["vertices"]
    assert edited["add"]["triangle"] == 2


def test_split_triangle_covers_the_same_pixels(edited):
    split = SQUARE | {name: edited["split"][name] for name in ("vertices", "triangles")}
    assert (counts_of(split) == counts_of(SQUARE)).all()
