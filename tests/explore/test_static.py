"""Both engines of the page, Python and the kernels in WebAssembly: the same questions, the same answers to the bit."""

import re
from typing import get_args

import numpy as np
import pytest
from node_page import NODE, PAGE, NodePage

from topleft._apps.explore.content import SCENES, content_of_name, scene
from topleft._apps.explore.session import Content
from topleft._apps.explore.static import MODULE, N_SEEDS, write_static
from topleft.methods import CLASSICS, METHODS
from topleft.scene_families import FAMILIES
from topleft.typing import SamplingOption

pytestmark = [
    pytest.mark.skipif(not PAGE.joinpath(MODULE).is_file(), reason="no topleft.wasm: python packaging/wasm.py"),
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


@pytest.fixture(scope="module")
def served():
    """The page whose engine is Python."""
    found = NodePage()
    yield found
    found.close()


@pytest.fixture(scope="module")
def static(folder):
    """The page whose engine is a worker with the kernels."""
    found = NodePage(folder)
    yield found
    found.close()


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


def without_times(value):
    """A result without what differs from call to call."""
    if isinstance(value, dict):
        return {name: without_times(one) for name, one in value.items() if name != "seconds"}
    if isinstance(value, list):
        return [without_times(one) for one in value if not (isinstance(one, list) and one[2:] == [OF_THE_CALL])]
    return value


OF_THE_CALL = "of the call that draws it"


def told(page, *call):
    try:
        return without_times(page.call(*call, is_hashed=True))
    except ValueError as error:
        return str(error)


def check(one, two, *call):
    """Ask both sides."""
    mine, theirs = told(one, *call), told(two, *call)
    assert mine == theirs, call
    return mine


def check_drawn(one, two, state):
    """Compare the pictures of a state with what is written over them, and the arrays of the engine."""
    methods = [state.get("method", "auto"), state.get("other") or "edge"]
    methods += ["exact"] if state.get("sampling") != "area" else []
    check(one, two, "tools", "draw", state, methods)
    check(one, two, "pixels.js", "drawPixels", state)


def test_pixels_of_random_states_are_the_same(served, static):
    for state in random_states():
        check_drawn(served, static, state)


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


def test_areas_and_squares_are_the_same(served, static):
    for state in [*small_states(), *(FAR | {"sampling": s, "exact": True} for s in SAMPLINGS[5:])]:
        check_drawn(served, static, state)


def test_pixels_of_each_scene_are_the_same(served, static):
    for name in SCENES:
        check_drawn(served, static, scene(name))
    check_drawn(served, static, FAR)
    assert static.call("tools", "ask", "pixels.scene", {"name": "single-point"})["state"] == scene("single-point")


def test_reasons_of_pixels_are_the_same(served, static):
    rng = np.random.default_rng(5)
    for state in [SQUARE, DEEP, FAR, *random_states()]:
        n = int(state["sampling"][4:]) if state.get("sampling", "").startswith("msaa") else 1
        for _ in range(2):
            pixel = [int(rng.integers(0, side)) for side in state["size"]]
            question = {"state": state, "pixel": pixel, "sample": int(rng.integers(0, n))}
            for more in ({}, {"method": "exact"}):
                assert "rows" in check(served, static, "probe.js", "probe", question | more)


TRACED = (*(name for name in METHODS if name != "auto"), *CLASSICS)


def check_steps(one, two, state, method, bits=8):
    return check(one, two, "steps.js", "recorded", state, method, bits)


def test_steps_of_each_method_are_the_same(served, static):
    states = [one for one in random_states() if len(one["triangles"]) < 12][:1]
    states = [DEEP, *(one | {"size": [min(n, 24) for n in one["size"]]} for one in states)]
    for method in TRACED:
        for i, state in enumerate(states):
            assert "steps" in check_steps(served, static, state, method, (8, 0, 4)[i % 3])


def test_steps_of_far_vertices_and_windows_are_the_same(served, static):
    for name in [name for name in SCENES if name.startswith(("far", "large"))][:6]:
        for method in ("edge", "scanline", "row_crossing"):
            check_steps(served, static, scene(name), method)


WHOLE = SQUARE | {"vertices": [[0, 0], [900, 0], [0, 900], [900, 900]], "size": [256, 256]}
VERY_FAR = SQUARE | {"vertices": [[1.5, 2**52], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]]}


@pytest.mark.parametrize(
    ("state", "method", "bits", "message"),
    [
        (SQUARE, "auto", 8, "method must be a walker or a classic to be traced, got 'auto'"),
        (SQUARE, "best", 8, "method must be one of auto, edge"),
        (WHOLE, "edge", 8, "a trace must have 40000 steps at most"),
        (WHOLE, "point_in_triangle", 8, "a trace must have 40000 steps at most"),
        (VERY_FAR, "edge", 16, "vertices must lie within 2..46 pixels of 0 with 16 sub-pixel bits"),
        (VERY_FAR, "edge", 8, "vertices must lie within 2..60 sub-pixels of 0 to be traced"),
        (VERY_FAR, "lerp_scanline", 8, "vertices must lie within"),
    ],
)
def test_steps_are_refused_with_the_same_sentence(served, static, state, method, bits, message):
    assert re.match(message, check_steps(served, static, state, method, bits))


def test_races_are_the_same(served, static):
    harsh = ["far", "far", "far-sliver", "sliver", "edge", "edge"]
    cases = [(name, share, i + k) for i, name in enumerate(FAMILIES) for k, share in enumerate((0, 0.5))]
    for family, share, i in [*cases, *((name, 1, i) for i, name in enumerate(harsh))]:
        positions = [round(share * (len(axis.values) - 1)) for axis in FAMILIES[family].axes]
        view = {"family": family, "positions": positions, "seed": i % N_SEEDS}
        check(served, static, "race.js", ("race", "raceColumn")[i % 2], view)


@pytest.mark.parametrize("view", [{"family": "none", "positions": [1]}, {"family": "fan", "positions": [1, 2]}])
def test_races_are_refused_with_the_same_sentence(served, static, view):
    assert "got" in check(served, static, "race.js", "race", view | {"seed": 0})


def test_window_far_away_is_the_same(served, static):
    far = 2**50
    state = SQUARE | {"vertices": [[x + far, y - far] for x, y in SQUARE["vertices"]], "origin": [far, -far]}
    for more in ({"exact": True}, {"subpixel_bits": "exact"}, {"subpixel_bits": 16}, {"method": "zigzag"}):
        check_drawn(served, static, state | more)


def test_vertices_beyond_the_range_are_refused_with_the_same_sentence(served, static):
    check_drawn(served, static, FAR | {"subpixel_bits": 16, "vertices": [[2**51 + 0.5, 0], [3, 1], [0, 0], [1, 1]]})


def test_memory_stays_as_it_is_however_often_a_scene_is_drawn(static):
    n_bytes = []
    for _ in range(40):
        static.call("pixels.js", "drawPixels", random_states()[4])
        n_bytes.append(static.call("tools", "memory"))
    assert n_bytes[-1] == n_bytes[1]


def test_question_without_memory_is_refused_and_the_next_one_is_answered(static):
    with pytest.raises(ValueError, match="not enough memory"):
        static.call("tools", "drawFull", SQUARE)
    assert (static.draw(SQUARE)[0]["a"]["owners"] >= 0).any()


def test_mesh_is_refused_with_a_sentence(tmp_path):
    content = content_of_name("torus-knot")
    with pytest.raises(ValueError, match="--export must have no mesh, got 'torus-knot': a page without Python draws"):
        write_static(tmp_path / "site", content)
    assert not (tmp_path / "site").exists()
