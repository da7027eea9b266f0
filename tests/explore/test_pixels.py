"""What the part Pixels of the explorer draws, tells and writes, its page in node: the library's own arrays."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from node_page import NODE

import topleft as tl
from topleft._apps.explore.content import SCENES, content_of_name, scene
from topleft._apps.explore.handlers import answer
from topleft._apps.explore.notebook import one_module
from topleft._apps.explore.session import Content, Session
from topleft.errors import MeshError
from topleft.failure_scenes import FAILURE_SCENES, picture
from topleft.methods import CLASSICS, METHODS
from topleft.scenes import TUTORIAL_SCENES

#: Two triangles whose shared edge passes through pixel centres; the second is the nearer one where they have depth.
SQUARE = {
    "vertices": [[1.5, 1.5], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]],
    "triangles": [[0, 1, 2], [1, 3, 2]],
    "size": [11, 11],
}
DEEP = SQUARE | {
    "vertices": [[1, 1, 0.5], [9, 1, 0.5], [1, 9, 0.5], [9, 9, 0.0], [0, 9, 0.9]],
    "triangles": [[0, 3, 2], [1, 3, 4]],
}
WEDGE = {"vertices": [[1.4, 1.4], [9.4, 1.4], [1.4, 5.4]], "triangles": [[0, 1, 2]], "size": [11, 7]}
LOOKS = ["owners", "overdraw", "wireframe"]


@pytest.fixture
def draw(page):
    return lambda state: page.draw(state)[0]


@pytest.fixture
def probe(page):
    def probed(state, pixel, **more):
        return page.call("probe.js", "probe", {"state": state, "pixel": pixel, **more})

    return probed


@pytest.fixture
def save(page):
    """The file of a state, as bytes."""
    return lambda state, kind: bytes(page.call("tools", "save", state, kind))


def ask(name, /, **given):
    return answer(Session(Content()), {"id": 1, "do": name, "parts": [], **given})


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_owners_and_counts_of_a_method_are_those_of_the_library(draw, method, sampling):
    state = SQUARE | {"method": method, "sampling": sampling, "subpixel_bits": 4}
    panel, view = draw(state)["a"], {"method": method, "sampling": sampling, "subpixel_bits": 4}
    assert (panel["owners"] == tl.rasterize(state["vertices"], state["triangles"], 11, **view).triangle).all()
    counts = tl.overdraw(state["vertices"], state["triangles"], 11, **view)
    assert (panel["counts"] == counts.reshape(11, 11, -1).max(axis=2)).all()


@pytest.mark.parametrize("method", CLASSICS)
def test_counts_of_a_classic_are_those_of_the_library(draw, method):
    panel = draw(SQUARE | {"method": method, "sampling": "msaa4", "cull": "back", "subpixel_bits": 8})["a"]
    assert (panel["counts"] == tl.overdraw(SQUARE["vertices"], SQUARE["triangles"], 11, method=method)).all()
    assert ((panel["owners"] >= 0) == (panel["counts"] > 0)).all()


@pytest.mark.parametrize(
    ("sampling", "bits"), [("area", 8), ("outer", 8), ("inner", 8), ("outer", "exact"), ("inner", "exact")]
)
def test_picture_of_coverage_is_as_opaque_as_the_library_says(draw, sampling, bits):
    vertices = np.array(SQUARE["vertices"]) + 2**-30  # which only a snap puts on the borders of pixels
    panels = draw(SQUARE | {"vertices": vertices.tolist(), "sampling": sampling, "subpixel_bits": bits, "exact": True})
    wanted = tl.coverage(vertices, SQUARE["triangles"], 11, sampling=sampling, subpixel_bits=bits).astype(np.float32)
    assert (panels["a"]["picture"][..., 3] == np.rint(255 * wanted)).all()
    assert (panels["exact"]["picture"][..., 3] == np.rint(255 * wanted)).all()


def test_depth_decides_who_shows(draw):
    for depth_test in ("less", "greater"):
        panels = draw(DEEP | {"depth_test": depth_test, "exact": True})
        wanted = tl.rasterize(DEEP["vertices"], DEEP["triangles"], 11, depth_test=depth_test).triangle
        assert (panels["a"]["owners"] == wanted).all()
        assert (panels["exact"]["owners"] == wanted).all()


@pytest.mark.parametrize("look", LOOKS)
def test_each_look_has_pictures_of_colours(draw, look):
    panels = draw(SQUARE | {"look": look, "other": "bresenham_scanline", "exact": True})
    assert [*panels] == (["a"] if look == "wireframe" else ["a", "b", "exact", "difference"])
    assert all(panel["picture"].any() for panel in panels.values())


def test_wireframe_is_that_of_the_library(draw):
    lines = draw(SQUARE | {"look": "wireframe"})["a"]["picture"][..., 3] > 0
    assert (lines == tl.wireframe(SQUARE["vertices"], SQUARE["triangles"], 11)).all()


def test_difference_counts_what_two_methods_draw_apart(draw):
    panels = draw(SQUARE | {"other": "bresenham_scanline"})
    a, b = panels["a"]["owners"], panels["b"]["owners"]
    _, same, first_alone, second_alone, other_owner, more_often = panels["difference"]["kinds"]
    assert first_alone == ((a >= 0) & (b < 0)).sum()
    assert second_alone == ((a < 0) & (b >= 0)).sum()
    assert other_owner == ((a >= 0) & (b >= 0) & (a != b)).sum()
    is_shared = (a == b) & (a >= 0)
    assert same == (is_shared & (panels["b"]["counts"] == 1)).sum()
    assert more_often == (is_shared & (panels["b"]["counts"] > 1)).sum() > 0


@pytest.mark.parametrize("name", SCENES)
def test_scene_by_its_name_is_drawn_by_every_panel(draw, name):
    reply = ask("pixels.scene", name=name)
    panels = draw(reply.header["state"] | {"exact": True}).values()
    assert not any(panel["refused"] for panel in panels)


def test_page_lists_each_scene_once_in_the_order_of_its_keys():
    listed = [name for _, rows in ask("hello").header["groups"] for name, _ in rows]
    assert listed == list(SCENES)
    assert sorted(listed) == sorted(["shared-edge", *TUTORIAL_SCENES, *FAILURE_SCENES])


@pytest.mark.parametrize("name", FAILURE_SCENES)
def test_failure_scene_shows_the_failure_and_the_exact_picture(draw, name):
    found = FAILURE_SCENES[name]
    whole = draw(scene(name) | {"scene": name})
    panels = draw(scene(name) | {"scene": name, "size": list(found.size), "origin": list(found.origin)})
    wanted = picture(found.expected)
    exact = panels["exact"]["owners" if found.kind == "wrong" else "counts"]
    assert (exact == np.where(wanted < 0, -1 if found.kind == "wrong" else 0, wanted)).all()
    for seen in (panels, whole):
        x, y = seen["difference"]["pixel"]
        (owner, count), (exact_owner, exact_count) = (
            (seen[key]["owners"][y, x], seen[key]["counts"][y, x]) for key in ("a", "exact")
        )
        fails = {"gap": count < exact_count, "overdraw": count > exact_count, "wrong": owner != exact_owner}
        assert fails[found.kind]


def test_pixel_that_differs_is_the_nearest_to_the_middle(page, draw):
    panels = draw(SQUARE | {"other": "bresenham_scanline"})
    is_other = (panels["a"]["owners"] != panels["b"]["owners"]) | (panels["a"]["counts"] != panels["b"]["counts"])
    y, x = np.nonzero(is_other)
    far = np.hypot(x - 5, y - 5)
    nearest = panels["difference"]["pixel"]
    assert is_other[nearest[1], nearest[0]]
    assert np.hypot(nearest[0] - 5, nearest[1] - 5) == far.min()
    assert draw(SQUARE | {"other": "scanline"})["difference"]["pixel"] is None


@pytest.mark.parametrize(
    ("state", "told"),
    [
        (SQUARE, "64 pixels drawn"),
        (SQUARE | {"exact": True}, "64 pixels drawn, all exact"),
        ({"vertices": [[1, 1], [2, 1], [1, 2.1]], "triangles": [[0, 1, 2]], "size": [4, 4]}, "1 pixel drawn"),
        (SQUARE | {"triangles": [[0, 1, 2], [1, 3, 2], [0, 1, 2]]}, "64 pixels drawn: 28 once, 36 more often"),
        (scene("shared-edge") | {"method": "bresenham_scanline"},
         "110 pixels drawn: 64 exact, 20 too many, 26 drawn too often"),
        (scene("any-overdraw-2"), "63 pixels drawn: 51 exact, 6 too many, 6 of another triangle; 3 missing"),
        (scene("far-1e10-gap"), "0 pixels drawn; 28 missing"),
        (WEDGE | {"subpixel_bits": 0, "sampling": "msaa4", "exact": True},
         "20 pixels drawn: 4 exact, 10 too many, 5 covered too little, 1 of another triangle; 3 missing"),
    ],
)  # fmt: skip
def test_pixels_of_a_picture_are_told_in_one_sentence(draw, state, told):
    assert draw(state)["a"]["facts"][0][0] == told


def test_winding_turns_all_triangles_one_way(draw):
    for winding, cull in (("clockwise", "front"), ("counter-clockwise", "back")):
        assert draw(SQUARE | {"winding": winding, "cull": cull})["a"]["facts"][0][0] == "64 pixels drawn"
    assert draw(SQUARE | {"winding": "clockwise", "cull": "back"})["a"]["facts"][0][0] == "0 pixels drawn"


def test_limit_of_a_classic_is_told_beside_the_other_pictures(draw):
    far = SQUARE | {"vertices": [[1, 1], [2.0**40, 1], [1, 9], [9, 9]], "other": "bresenham_scanline"}
    panels = draw(far)
    assert "owners" in panels["a"]
    assert "within 2097152 pixels" in panels["b"]["refused"]


def test_exact_picture_that_would_take_long_is_refused(draw):
    large = draw(SQUARE | {"size": [256, 256], "exact": True, "sampling": "area"})
    assert "takes too long" in large["exact"]["refused"]


# Why a pixel is whose


def test_probe_of_a_shared_edge_names_both_sides_and_the_owner(probe):
    told = probe(SQUARE | {"method": "bresenham_scanline"}, [5, 5])
    assert told["owner"] == 1
    assert told["sentences"][0] == (
        "The centre of pixel (5, 5) lies on an edge. Edge 1\N{EN DASH}2 is a left edge of triangle 1, so the pixel "
        "belongs to it. Edge 1\N{EN DASH}2 is a right edge of triangle 0, so the pixel does not belong to it."
    )
    assert told["sentences"][1] == (
        "bresenham_scanline draws it 2 times, for triangle 0 and triangle 1; by the exact rule it is triangle 1's."
    )
    assert [row["verdict"] for row in told["rows"]] == ["owner", "on its edge"]


@pytest.mark.parametrize("sampling", ["center", "msaa2"])
@pytest.mark.parametrize("state", [SQUARE, DEEP], ids=["flat", "deep"])
def test_probe_of_every_sample_names_the_owner_that_the_library_draws(probe, state, sampling):
    frags = tl.rasterize(state["vertices"], state["triangles"], 11, sampling=sampling)
    owners = frags.triangle[..., None] if sampling == "center" else frags.samples_triangle
    for y, x, k in np.ndindex(*owners.shape):
        told = probe(state | {"sampling": sampling}, [x, y], sample=k)
        assert told["owner"] == owners[y, x, k]


def test_probe_has_depth_and_weights_of_the_library(probe):
    frags = tl.rasterize(DEEP["vertices"], DEEP["triangles"], 11)
    (row, *_) = probe(DEEP, [4, 6])["rows"]
    assert float(row["depth"]) == pytest.approx(frags.depth[6, 4], rel=1e-5)
    assert [float(w) for w in row["weights"].split(", ")] == pytest.approx(frags.barycentric()[6, 4].tolist(), rel=1e-5)


def test_probe_tells_of_gaps(draw, probe):
    state = {"vertices": [[0, 0], [8, 3], [3, 8]], "triangles": [[0, 1, 2]], "size": [8, 8]}
    missed = draw(state | {"other": "bresenham_scanline/top-left"})
    y, x = np.argwhere((missed["a"]["owners"] >= 0) & (missed["b"]["owners"] < 0))[0].tolist()
    told = probe(state | {"method": "bresenham_scanline/top-left"}, [x, y])
    assert (
        told["sentences"][-1]
        == "bresenham_scanline/top-left leaves it out; by the exact rule it is triangle 0's: a gap."
    )


# Files


@pytest.mark.parametrize("more", [{}, {"method": "lerp_scanline"}, {"sampling": "msaa4", "subpixel_bits": "exact"},
                                  {"sampling": "area"}, {"origin": [3, 2], "cull": "back"}])  # fmt: skip
@pytest.mark.parametrize("state", [SQUARE, DEEP], ids=["flat", "deep"])
def test_exported_code_runs_and_draws_the_same(draw, save, state, more, folder):
    panel = draw(state | more)["a"]
    made = {}
    exec(save(state | more, "code").decode(), made)
    if more.get("sampling") == "area":
        assert (np.rint(255 * made["coverage"]) == panel["picture"][..., 3]).all()
    else:
        owners = made["owners"]
        assert (owners.reshape(11, 11, -1)[..., 0] == panel["owners"]).all()
    assert (folder / "explored.svg").read_text().startswith("<svg")


def test_exported_test_passes_for_production_and_fails_for_what_is_wrong(save):
    right, wrong = (save(SQUARE | {"method": method}, "test").decode() for method in ("scanline", "bresenham_scanline"))
    for text, is_right in ((right, True), (wrong, False)):
        made = {}
        exec(text, made)
        try:
            made["test_picture_is_the_exact_one"]()
        except AssertionError:
            assert not is_right
        else:
            assert is_right


def test_exported_pictures_are_files(save):
    assert save(SQUARE, "png")[:8] == b"\x89PNG\r\n\x1a\n"
    assert save(SQUARE, "svg").startswith(b"<svg")


def test_plan_is_that_of_the_library(page):
    def plan_of(state):
        return page.call("pixels.js", "askAbout", state, "pixels.plan")["text"]

    assert plan_of(SQUARE).startswith("rasterize -> triangle")
    assert "no plan" in plan_of(SQUARE | {"method": "zigzag"})


# What is refused


WRONG = {
    "a state must be an object": [],
    "a state has no path": SQUARE | {"path": "/etc/passwd"},
    "a state must have vertices and size": {"triangles": []},
    "size must be from 1 to 256, got 11, 257": SQUARE | {"size": [11, 257]},
    "size must be two whole numbers": SQUARE | {"size": [1.5, 2]},
    "origin must be from": SQUARE | {"origin": [2**60, 0]},
    "vertices must be rows of two or three numbers each": SQUARE | {"vertices": [[1, "2"], [3, 4], [5, 6], [7, 8]]},
    "vertices must be rows of two or three numbers": SQUARE | {"vertices": [[1, 2], [3]]},
    "vertices must be a list of rows": SQUARE | {"vertices": "many"},
    "vertices must lie within": SQUARE | {"vertices": [[1e300, 0], [1, 1], [2, 2], [3, 3]]},
    "at most 3000 vertices": SQUARE | {"vertices": [[0, 0]] * 3001},
    "at most 1000 triangles": SQUARE | {"triangles": [[0, 1, 2]] * 1001},
    "triangles must be a list of rows": SQUARE | {"triangles": 3},
    "triangles must be rows of three indices in [0, 4), the number of vertices; row 0 is": SQUARE
    | {"triangles": [["a", 1, 2]]},
    "row 0 is [0,1,9]": SQUARE | {"triangles": [[0, 1, 9]]},
    "subpixel_bits must be from 0 to 16, or 'exact'": SQUARE | {"subpixel_bits": 17},
    "exact must be true or false": SQUARE | {"exact": 1},
    "method must be one of": SQUARE | {"method": "guess"},
    "other must be one of": SQUARE | {"other": ["auto"]},
    "sampling must be": SQUARE | {"sampling": "some"},
    "winding must be": SQUARE | {"winding": 3},
}


@pytest.mark.parametrize("told", WRONG)
def test_wrong_state_is_refused_with_a_sentence(page, told):
    for module, name, given in (
        ("pixels.js", "drawPixels", WRONG[told]), ("probe.js", "probe", {"state": WRONG[told], "pixel": [0, 0]}),
        ("pixels.js", "askAbout", WRONG[told]),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=re.escape(told)):
            page.call(module, name, given)


@pytest.mark.parametrize("pixel", [[11, 0], [-1, 0]])
def test_pixel_outside_is_refused(probe, pixel):
    with pytest.raises(ValueError, match="pixel must lie in the window of 11 x 11, got"):
        probe(SQUARE, pixel)


def test_unknown_questions_and_files_are_refused(save):
    assert ask("nothing").header["error"] == "nothing is called 'nothing' here"
    assert answer(Session(Content()), {"do": "hello"}).header["error"] == "a question must have a number as its id"
    with pytest.raises(ValueError, match="kind must be one of"):
        save(SQUARE, "../x")
    assert "scene must be one of" in ask("pixels.scene", name="../x").header["error"]
    assert ask("pixels.export", kind="code").header["error"] == "the question must hold 'size'"
    assert "vertices must have a row of two or three numbers" in ask("pixels.moved", vertices=[1, 2]).header["error"]


# What the explorer is opened with


def test_arrays_of_a_file_are_magnified(folder):
    np.savez("arrays.npz", vertices=np.array([[1.0, 2], [30, 4], [5, 40]]), triangles=np.array([[0, 1, 2]]))
    state = content_of_name("arrays.npz").pixels
    assert state["size"] == [33, 43]
    np.savez("sized.npz", vertices=np.zeros((3, 3)), triangles=np.array([[0, 1, 2]]), size=np.array([8, 6]))
    assert content_of_name("sized.npz").pixels["size"] == [8, 6]
    assert content_of_name("sized.npz", (7, 5)).pixels["size"] == [7, 5]
    np.savez("empty.npz", vertices=np.zeros((0, 2)), triangles=np.zeros((0, 3), int))
    empty = content_of_name("empty.npz").pixels
    assert (empty["origin"], empty["size"]) == ([0, 0], [16, 16])


def test_mesh_or_arrays_without_a_size_in_space_are_a_mesh(folder):
    np.savez("mesh.npz", vertices=np.eye(3), triangles=np.array([[0, 1, 2]]))
    assert [content_of_name(name).tab for name in ("mesh.npz", "torus-knot", "shared-edge")] == [
        "mesh",
        "mesh",
        "pixels",
    ]


def test_address_of_a_page_gives_its_fragment():
    assert content_of_name("http://127.0.0.1:4000/token/#pixels={}").fragment == "pixels={}"


@pytest.mark.parametrize(("name", "content"), [("a.npz", b"no archive"), ("b.npz", None), ("nowhere.ply", None)])
def test_file_that_is_none_is_refused(folder, name, content):
    if content is not None:
        (folder / name).write_bytes(content)
    with pytest.raises((MeshError, OSError), match=name):
        content_of_name(name)


def test_npz_without_triangles_is_refused(folder):
    np.savez("half.npz", vertices=np.eye(3))
    with pytest.raises(MeshError, match=r"half.npz: must hold arrays vertices and triangles, triangles not among them"):
        content_of_name("half.npz")


def test_difference_tells_each_kind(page):
    """Nothing, the same, more, less, another owner, drawn more often: a pixel each."""

    def drawing(owners, counts):
        shares = [float(owner >= 0) for owner in owners]
        return {"owners": owners, "counts": counts, "shares": shares, "n_samples": 1}

    one = drawing([-1, 0, 0, -1, 0, 0], [0, 1, 1, 0, 1, 2])
    two = drawing([-1, 0, -1, 0, 1, 0], [0, 1, 0, 1, 1, 1])
    assert page.call("tools", "difference", one, two) == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize(("n", "is_told"), [(64, True), (65, False)])
def test_triangles_that_a_classic_draws_are_told_up_to_a_number(probe, n, is_told):
    state = SQUARE | {"triangles": [[0, 1, 2]] * n, "method": "point_in_triangle"}
    assert any("draws it" in told for told in probe(state, [3, 3])["sentences"]) == is_told


def test_modules_of_the_page_are_one_module_in_a_notebook(folder):
    """Names of a module are not those of another one: a notebook takes all of them as one text."""
    Path("one.mjs").write_text(one_module(), encoding="utf-8")
    subprocess.run([NODE or pytest.skip("node is not installed"), "--check", "one.mjs"], check=True)
