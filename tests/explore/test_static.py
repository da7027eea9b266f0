"""The page that needs no Python: each of its answers is the one that Python gives, to the bit."""

import base64
import json
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from topleft._apps.explore.content import SCENES, content_of_name, scene
from topleft._apps.explore.handlers import answer
from topleft._apps.explore.messages import split
from topleft._apps.explore.session import Content, Session
from topleft._apps.explore.static import N_SEEDS, SETS, write_static
from topleft._apps.explore.trace import TRACED
from topleft.methods import CLASSICS
from topleft.scene_families import FAMILIES
from topleft.typing import SamplingOption

NODE = shutil.which("node")
PAGE = files("topleft._apps.explore").joinpath("page")
HAS_KERNELS = all(PAGE.joinpath(f"topleft-{name}.wasm").is_file() for name in SETS)
pytestmark = [
    pytest.mark.skipif(not HAS_KERNELS, reason="no kernels for WebAssembly: python packaging/wasm.py"),
    pytest.mark.skipif(NODE is None, reason="node is not installed"),
]

#: Two triangles that share an edge through pixel centres, with a depth and without one.
SQUARE = {
    "vertices": [[1.5, 1.5], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]],
    "triangles": [[0, 1, 2], [1, 3, 2]],
    "size": [11, 12],
}
DEEP = SQUARE | {
    "vertices": [[1, 1, 0.5], [9, 1, 0.5], [1, 9, 0.5], [9, 9, 0.0], [0, 9, 0.9]],
    "triangles": [[0, 3, 2], [1, 3, 4]],
}
FAR = SQUARE | {"vertices": [[-3e9, 2.0], [7.1, 1e10], [11.9, -5.5], [9.5, 9.5]]}
SAMPLINGS = get_args(SamplingOption)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("static")
    write_static(made, Content())
    return made


def asker(folder, name):
    """What asks the page with the kernels of one set."""

    def asked(questions):
        command = [NODE, str(Path(__file__).with_name("ask_static.mjs")), str(folder), name]
        done = subprocess.run(command, input=json.dumps(questions), capture_output=True, text=True, check=True)
        return json.loads(done.stdout)

    return asked


@pytest.fixture(params=SETS)
def ask(request, folder):
    return asker(folder, request.param)


@pytest.fixture
def ask_one(folder):
    """For what no instruction set changes: one of them."""
    return asker(folder, SETS[0])


def random_states():
    """States of all samplings, bits, sides and orders; triangles are small, large, cut by the window, and far."""
    rng, found = np.random.default_rng(3), []
    for i, sampling in enumerate(SAMPLINGS * 6):
        n, extent, columns = int(rng.integers(1, 30)), (3, 30, 3e4)[i % 3], 2 + i % 2
        vertices = rng.uniform(-extent, 40 + extent, (3 * n, columns))
        if i % 4 == 0:
            vertices[:, :2] = np.round(vertices[:, :2] * 2) / 2  # edges and vertices on centres
        found.append({
            "vertices": vertices.tolist(), "triangles": rng.integers(0, 3 * n, (n, 3)).tolist(),
            "size": [int(rng.integers(1, 70)), int(rng.integers(1, 50))], "origin": rng.integers(-9, 9, 2).tolist(),
            "sampling": sampling, "subpixel_bits": (0, 2, 4, 8, 12, 16, "exact")[i % 7],
            "cull": ("none", "back", "front")[i % 3], "depth_test": ("less", "greater")[i % 2],
            "method": ("auto", "edge", "scanline")[i % 3],
            "winding": ("as given", "clockwise", "counter-clockwise")[i % 3],
            "other": (*CLASSICS, "")[i % (len(CLASSICS) + 1)],
            "look": ("owners", "overdraw", "owners", "wireframe")[i % 4], "exact": i % 3 == 0,
        })  # fmt: skip
    return found


def without_times(header):
    """A header without what differs from call to call, and from page to page."""
    text = json.loads(json.dumps(header))
    for panel in text.get("panels", ()):
        panel["facts"] = [fact for fact in panel["facts"] if fact[2] != "of the call that draws it"]
    return text


def check(ask, questions):
    """Ask both sides, and compare headers and bytes."""
    replies = ask(questions)
    for question, reply in zip(questions, replies, strict=True):
        header, parts = split(answer(Session(Content()), {"id": 1, "parts": [], **question}))
        bytes_drawn = [base64.b64decode(part) for part in reply.pop("bytes")]
        reply.pop("memory")
        reply = {"arrays": {}, **reply}
        assert without_times(reply) == without_times(header), question
        assert bytes_drawn == [bytes(part) for part in parts], question
    assert len(replies) == len(questions)


def test_pixels_of_random_states_are_those_of_python(ask):
    questions = [{"do": "pixels.draw", "state": state} for state in random_states()]
    check(ask, questions)


def small_states():
    """States of areas and squares whose exact picture is not refused: corners on pixels' corners, and in pixels."""
    rng = np.random.default_rng(8)
    for i in range(18):
        vertices = rng.uniform(-3, 13, (6, 2))
        vertices = np.round(vertices) if i % 2 else vertices
        yield {
            "vertices": vertices.tolist(), "triangles": rng.integers(0, 6, (1 + i % 4, 3)).tolist(), "size": [10, 8],
            "origin": [i % 3 - 1, 0], "exact": True, "sampling": SAMPLINGS[5 + i % 3],
            "subpixel_bits": (8, "exact", 0, 4)[i % 4], "cull": ("none", "none", "back", "front", "none")[i % 5],
        }  # fmt: skip


def test_exact_areas_and_squares_are_those_of_python(ask_one):
    check(
        ask_one,
        [
            {"do": "pixels.draw", "state": state}
            for state in [*small_states(), *(FAR | {"sampling": s, "exact": True} for s in SAMPLINGS[5:])]
        ],
    )


def test_pixels_of_each_scene_are_those_of_python(ask):
    states = [scene(name) for name in SCENES]
    check(ask, [{"do": "pixels.draw", "state": state} for state in states])
    check(ask, [{"do": "pixels.scene", "name": "single-point"}, {"do": "pixels.draw", "state": FAR}])


def test_reasons_of_pixels_are_those_of_python(ask):
    rng, questions = np.random.default_rng(5), []
    for state in [SQUARE, DEEP, FAR, *random_states()]:
        if state.get("look") == "wireframe":
            continue
        n = int(state["sampling"][4:]) if state.get("sampling", "").startswith("msaa") else 1
        for _ in range(4):
            pixel = [int(rng.integers(0, side)) for side in state["size"]]
            question = {"do": "pixels.probe", "state": state, "pixel": pixel, "sample": int(rng.integers(0, n))}
            questions += [question, question | {"method": "exact"}]
    check(ask, questions)


def steps_of(state, method, bits=8):
    """The question of how a method draws a state."""
    taken = {name: state[name] for name in ("vertices", "triangles", "size", "origin") if name in state}
    return {"do": "steps.trace", **taken, "method": method, "subpixel_bits": bits}


def test_steps_of_each_method_are_those_of_python(ask_one):
    states = [one for one in random_states() if len(one["triangles"]) < 12][:1]
    states = [DEEP, *(one | {"size": [min(n, 24) for n in one["size"]]} for one in states)]
    check(ask_one, [steps_of(one, method, (8, 0, 4)[i % 3]) for method in TRACED for i, one in enumerate(states)])


def test_steps_of_far_vertices_and_windows_are_those_of_python(ask_one):
    scenes = [name for name in SCENES if name.startswith(("far", "large"))][:6]
    check(
        ask_one, [steps_of(scene(name), method) for name in scenes for method in ("edge", "scanline", "row_crossing")]
    )


def test_sentences_of_steps_that_are_refused_are_those_of_python(ask_one):
    whole = SQUARE | {"vertices": [[0, 0], [900, 0], [0, 900], [900, 900]], "size": [900, 900]}
    far = SQUARE | {"vertices": [[1.5, 2**52], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]]}
    questions = [steps_of(SQUARE, "auto"), steps_of(SQUARE, "best"), steps_of(SQUARE | {"size": [2000, 3]}, "edge")]
    questions += [steps_of(whole, "edge"), steps_of(whole, "point_in_triangle"), steps_of(far, "edge", 16)]
    check(ask_one, [*questions, steps_of(far, "edge"), steps_of(far, "lerp_scanline")])


def race_of(family, share, i):
    """The question of a race of a family, from its mildest value, 0, to its harshest, 1."""
    positions = [round(share * (len(axis.values) - 1)) for axis in FAMILIES[family].axes]
    return {"do": ("race.draw", "race.column")[i % 2], "family": family, "positions": positions, "seed": i % N_SEEDS}


def test_races_are_those_of_python(ask_one):
    harsh = ["far", "far", "far-sliver", "sliver", "edge", "edge"]
    races = [race_of(name, share, i + k) for i, name in enumerate(FAMILIES) for k, share in enumerate((0, 0.5))]
    check(ask_one, [*races, *(race_of(name, 1, i) for i, name in enumerate(harsh))])


def test_sentences_of_races_that_are_refused_are_those_of_python(ask_one):
    bad = [{"family": "none", "positions": [1]}, {"family": "fan", "positions": [1, 2]}]
    check(ask_one, [{"do": "race.draw", **one} for one in bad])


def test_window_far_away_is_that_of_python(ask):
    far = 2**50
    state = SQUARE | {"vertices": [[x + far, y - far] for x, y in SQUARE["vertices"]], "origin": [far, -far]}
    check(ask, [{"do": "pixels.draw", "state": state | more} for more in ({"exact": True}, {"subpixel_bits": "exact"})])


BAD_STATES = [
    {"size": [300, 2]}, {"size": [1.5, 2]}, {"size": 3}, {"origin": [2**60, 0]},
    {"vertices": [[1, 2], [3, 4, 5], [0, 0]]},
    {"vertices": [[1, 2], [3, 1e300], [0, 0], [1, 1]]}, {"vertices": 7}, {"vertices": [["a", 1]] * 4},
    {"subpixel_bits": 17}, {"subpixel_bits": "all"}, {"sampling": "msaa3"}, {"cull": "both"}, {"depth_test": "equal"},
    {"winding": "left"}, {"look": "nice"}, {"triangles": [[0, 1, 4]]}, {"triangles": [[0, 1, 2]] * 1001},
    {"vertices": [[0, 0]] * 3001}, {"method": "best"}, {"color": 3}, {"exact": 1},
    {"subpixel_bits": 16, "vertices": [[2**51 + 0.5, 0], [3, 1], [0, 0], [1, 1]]},
]  # fmt: skip


@pytest.mark.parametrize("i", range(0, len(BAD_STATES), 6))
def test_sentences_of_bad_states_are_those_of_python(ask, i):
    questions = [{"do": "pixels.draw", "state": SQUARE | bad} for bad in BAD_STATES[i : i + 6]]
    check(ask, [*questions, {"do": "pixels.draw", "state": {"size": [1, 1]}}, {"do": "pixels.draw", "state": []}])


def test_memory_stays_as_it_is_however_often_a_scene_is_drawn(ask):
    replies = ask([{"do": "pixels.draw", "state": random_states()[4]}] * 40)
    assert replies[-1]["memory"] == replies[1]["memory"]


def test_question_without_memory_is_refused_and_the_next_one_is_answered(ask):
    question = {"do": "pixels.draw", "state": SQUARE}
    full, last = ask([question | {"is_full": True}, question])
    assert full["error"] == "not enough memory"
    assert "error" not in last


def test_mesh_is_refused_with_a_sentence(tmp_path):
    content = content_of_name("torus-knot")
    with pytest.raises(ValueError, match="--export must have no mesh, got 'torus-knot': a page without Python draws"):
        write_static(tmp_path / "site", content)
    assert not (tmp_path / "site").exists()
