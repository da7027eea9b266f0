"""What the part Pixels of the explorer draws, tells and writes: the library's own arrays."""

import numpy as np
import pytest

import topleft as tl
from topleft._apps.explore.content import SCENES, content_of_name, scene
from topleft._apps.explore.handlers import answer
from topleft._apps.explore.pixels import MethodPicture, difference
from topleft._apps.explore.probe import MAX_DRAWN, drawn_by
from topleft._apps.explore.session import Content, Session
from topleft._apps.explore.state import parse_state
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
LOOKS = ["owners", "overdraw", "wireframe"]


def ask(name, /, **given):
    return answer(Session(Content()), {"id": 1, "do": name, "parts": [], **given})


def draw(state):
    reply = ask("pixels.draw", state=state)
    assert "error" not in reply.header, reply.header["error"]
    return reply


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_owners_and_counts_of_a_method_are_those_of_the_library(method, sampling):
    state = SQUARE | {"method": method, "sampling": sampling, "subpixel_bits": 4}
    arrays, view = draw(state).arrays, {"method": method, "sampling": sampling, "subpixel_bits": 4}
    assert (arrays["a_owners"] == tl.rasterize(state["vertices"], state["triangles"], 11, **view).triangle).all()
    counts = tl.overdraw(state["vertices"], state["triangles"], 11, **view)
    assert (arrays["a_counts"] == counts.reshape(11, 11, -1).max(axis=2)).all()


@pytest.mark.parametrize("method", CLASSICS)
def test_counts_of_a_classic_are_those_of_the_library(method):
    arrays = draw(SQUARE | {"method": method, "sampling": "msaa4", "cull": "back", "subpixel_bits": 8}).arrays
    assert (arrays["a_counts"] == tl.overdraw(SQUARE["vertices"], SQUARE["triangles"], 11, method=method)).all()
    assert ((arrays["a_owners"] >= 0) == (arrays["a_counts"] > 0)).all()


@pytest.mark.parametrize(
    ("sampling", "bits"), [("area", 8), ("outer", 8), ("inner", 8), ("outer", "exact"), ("inner", "exact")]
)
def test_picture_of_coverage_is_as_opaque_as_the_library_says(sampling, bits):
    vertices = np.array(SQUARE["vertices"]) + 2**-30  # which only a snap puts on the borders of pixels
    arrays = draw(
        SQUARE | {"vertices": vertices.tolist(), "sampling": sampling, "subpixel_bits": bits, "exact": True}
    ).arrays
    wanted = tl.coverage(vertices, SQUARE["triangles"], 11, sampling=sampling, subpixel_bits=bits).astype(np.float32)
    assert (arrays["a"][..., 3] == np.rint(255 * wanted)).all()
    assert (arrays["exact"][..., 3] == np.rint(255 * wanted)).all()


def test_depth_decides_who_shows():
    for depth_test in ("less", "greater"):
        arrays = draw(DEEP | {"depth_test": depth_test, "exact": True}).arrays
        wanted = tl.rasterize(DEEP["vertices"], DEEP["triangles"], 11, depth_test=depth_test).triangle
        assert (arrays["a_owners"] == wanted).all()
        assert (arrays["exact_owners"] == wanted).all()


@pytest.mark.parametrize("look", LOOKS)
def test_each_look_has_pictures_of_colours(look):
    reply = draw(SQUARE | {"look": look, "other": "bresenham_scanline", "exact": True})
    shown = [panel["key"] for panel in reply.header["panels"]]
    assert shown == (["a"] if look == "wireframe" else ["a", "b", "exact", "difference"])
    assert all(reply.arrays[key].shape == (11, 11, 4) and reply.arrays[key].dtype == np.uint8 for key in shown)


def test_wireframe_is_that_of_the_library():
    arrays = draw(SQUARE | {"look": "wireframe"}).arrays
    assert ((arrays["a"][..., 3] > 0) == tl.wireframe(SQUARE["vertices"], SQUARE["triangles"], 11)).all()


def test_difference_counts_what_two_methods_draw_apart():
    reply = draw(SQUARE | {"other": "bresenham_scanline"})
    a, b = reply.arrays["a_owners"], reply.arrays["b_owners"]
    _, same, first_alone, second_alone, other_owner, more_often = reply.header["panels"][-1]["kinds"]
    assert first_alone == ((a >= 0) & (b < 0)).sum()
    assert second_alone == ((a < 0) & (b >= 0)).sum()
    assert other_owner == ((a >= 0) & (b >= 0) & (a != b)).sum()
    is_shared = (a == b) & (a >= 0)
    assert same == (is_shared & (reply.arrays["b_counts"] == 1)).sum()
    assert more_often == (is_shared & (reply.arrays["b_counts"] > 1)).sum() > 0


def test_production_is_never_wrong_on_the_grid_that_holds_the_vertices():
    panels = draw(SQUARE | {"exact": True, "other": "bresenham_scanline"}).header["panels"]
    assert panels[0]["n_wrong"] == 0 < panels[1]["n_wrong"]


@pytest.mark.parametrize("sampling", ["area", "outer", "inner"])
def test_production_is_never_wrong_where_coverage_alone_is_known(sampling):
    panels = draw(SQUARE | {"exact": True, "sampling": sampling}).header["panels"]
    assert panels[0]["n_wrong"] == 0


@pytest.mark.parametrize("name", SCENES)
def test_scene_by_its_name_is_drawn_by_every_panel(name):
    reply = ask("pixels.scene", name=name)
    panels = draw(reply.header["state"] | {"exact": True}).header["panels"]
    assert not any(panel["refused"] for panel in panels)


def test_page_lists_each_scene_once_in_the_order_of_its_keys():
    listed = [name for _, rows in ask("hello").header["groups"] for name, _ in rows]
    assert listed == list(SCENES)
    assert sorted(listed) == sorted(["shared-edge", *TUTORIAL_SCENES, *FAILURE_SCENES])


@pytest.mark.parametrize("name", FAILURE_SCENES)
def test_failure_scene_shows_the_failure_and_the_exact_picture(name):
    found = FAILURE_SCENES[name]
    reply = draw(scene(name) | {"size": list(found.size), "origin": list(found.origin)})
    wanted = picture(found.expected)
    exact = reply.arrays["exact_owners" if found.kind == "wrong" else "exact_counts"]
    assert (exact == np.where(wanted < 0, -1 if found.kind == "wrong" else 0, wanted)).all()
    assert reply.header["panels"][0]["n_wrong"] > 0


def test_winding_turns_all_triangles_one_way():
    for winding, cull in (("clockwise", "front"), ("counter-clockwise", "back")):
        assert draw(SQUARE | {"winding": winding, "cull": cull}).header["panels"][0]["n"] == 64
    assert draw(SQUARE | {"winding": "clockwise", "cull": "back"}).header["panels"][0]["n"] == 0


def test_limit_of_a_classic_is_told_beside_the_other_pictures():
    far = SQUARE | {"vertices": [[1, 1], [2.0**40, 1], [1, 9], [9, 9]], "other": "bresenham_scanline"}
    one, two = draw(far).header["panels"]
    assert "n" in one
    assert "within 2097152 pixels" in two["refused"]


def test_exact_picture_that_would_take_minutes_is_refused():
    large = [[-1.0, -1.0], [999.0, -1.0], [999.0, 999.0], [-1.0, 999.0]]
    many = {"vertices": large, "triangles": [[0, 1, 2]] * 100, "size": [256, 256], "exact": True, "sampling": "msaa16"}
    assert "takes too long" in draw(SQUARE | many).header["panels"][1]["refused"]
    deep = {"vertices": [[0, 0, 0.1], [256, 0, 0.2], [0, 256, 0.3]], "triangles": [[0, 1, 2]] * 9, "size": [256, 256]}
    assert "takes too long" in draw(deep | {"exact": True}).header["panels"][1]["refused"]


# Why a pixel is whose


def test_probe_of_a_shared_edge_names_both_sides_and_the_owner():
    told = ask("pixels.probe", state=SQUARE | {"method": "bresenham_scanline"}, pixel=[5, 5]).header
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
def test_probe_of_every_sample_names_the_owner_that_the_library_draws(state, sampling):
    frags = tl.rasterize(state["vertices"], state["triangles"], 11, sampling=sampling)
    owners = frags.triangle[..., None] if sampling == "center" else frags.samples_triangle
    for y, x, k in np.ndindex(*owners.shape):
        told = ask("pixels.probe", state=state | {"sampling": sampling}, pixel=[x, y], sample=k).header
        assert told["owner"] == owners[y, x, k]


def test_probe_has_depth_and_weights_of_the_library():
    frags = tl.rasterize(DEEP["vertices"], DEEP["triangles"], 11)
    (row, *_) = ask("pixels.probe", state=DEEP, pixel=[4, 6]).header["rows"]
    assert float(row["depth"]) == pytest.approx(frags.depth[6, 4], rel=1e-5)
    assert [float(w) for w in row["weights"].split(", ")] == pytest.approx(frags.barycentric()[6, 4].tolist(), rel=1e-5)


def test_probe_tells_of_gaps():
    state = {"vertices": [[0, 0], [8, 3], [3, 8]], "triangles": [[0, 1, 2]], "size": [8, 8]}
    missed = draw(state | {"other": "bresenham_scanline/top-left"}).arrays
    y, x = np.argwhere((missed["a_owners"] >= 0) & (missed["b_owners"] < 0))[0].tolist()
    told = ask("pixels.probe", state=state | {"method": "bresenham_scanline/top-left"}, pixel=[x, y]).header
    assert (
        told["sentences"][-1]
        == "bresenham_scanline/top-left leaves it out; by the exact rule it is triangle 0's: a gap."
    )


# Files


@pytest.mark.parametrize("more", [{}, {"method": "lerp_scanline"}, {"sampling": "msaa4", "subpixel_bits": "exact"},
                                  {"sampling": "area"}, {"origin": [3, 2], "cull": "back"}])  # fmt: skip
@pytest.mark.parametrize("state", [SQUARE, DEEP], ids=["flat", "deep"])
def test_exported_code_runs_and_draws_the_same(state, more, folder):
    arrays = draw(state | more).arrays
    made = {}
    exec(ask("pixels.export", state=state | more, kind="code").arrays["content"].decode(), made)
    if more.get("sampling") == "area":
        assert (np.rint(255 * made["coverage"]) == arrays["a"][..., 3]).all()
    else:
        owners = made["owners"]
        assert (owners.reshape(11, 11, -1)[..., 0] == arrays["a_owners"]).all()
    assert (folder / "explored.svg").read_text().startswith("<svg")


def test_exported_test_passes_for_production_and_fails_for_what_is_wrong():
    right, wrong = (ask("pixels.export", state=SQUARE | {"method": method}, kind="test").arrays["content"].decode()
                    for method in ("scanline", "bresenham_scanline"))  # fmt: skip
    for text, is_right in ((right, True), (wrong, False)):
        made = {}
        exec(text, made)
        try:
            made["test_picture_is_the_exact_one"]()
        except AssertionError:
            assert not is_right
        else:
            assert is_right


def test_exported_pictures_are_files():
    assert ask("pixels.export", state=SQUARE, kind="png").arrays["content"][:8] == b"\x89PNG\r\n\x1a\n"
    assert ask("pixels.export", state=SQUARE, kind="svg").arrays["content"].startswith(b"<svg")


def test_plan_is_that_of_the_library():
    assert ask("pixels.plan", state=SQUARE).header["text"].startswith("rasterize -> triangle")
    assert "no plan" in ask("pixels.plan", state=SQUARE | {"method": "zigzag"}).header["text"]


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
    "triangles must": SQUARE | {"triangles": [["a", 1, 2]]},
    "row 0": SQUARE | {"triangles": [[0, 1, 9]]},
    "subpixel_bits must be from 0 to 16, or 'exact'": SQUARE | {"subpixel_bits": 17},
    "exact must be true or false": SQUARE | {"exact": 1},
    "method must be one of": SQUARE | {"method": "guess"},
    "method must be one of ": SQUARE | {"other": ["auto"]},
    "sampling must be": SQUARE | {"sampling": "some"},
    "winding must be": SQUARE | {"winding": 3},
}


@pytest.mark.parametrize("told", WRONG)
def test_wrong_state_is_refused_with_a_sentence(told):
    for name, more in (("pixels.draw", {}), ("pixels.probe", {"pixel": [0, 0]}), ("pixels.export", {"kind": "code"})):
        assert told.strip() in ask(name, state=WRONG[told], **more).header["error"]


@pytest.mark.parametrize("pixel", [[11, 0], [-1, 0], [0.5, 1], None, [1], "ab"])
def test_pixel_outside_is_refused(pixel):
    assert "pixel must" in ask("pixels.probe", state=SQUARE, pixel=pixel).header["error"]


def test_unknown_questions_and_files_are_refused():
    assert ask("nothing").header["error"] == "nothing is called 'nothing' here"
    assert answer(Session(Content()), {"do": "hello"}).header["error"] == "a question must have a number as its id"
    assert "kind must be one of" in ask("pixels.export", state=SQUARE, kind="../x").header["error"]
    assert "scene must be one of" in ask("pixels.scene", name="../x").header["error"]
    assert ask("pixels.export", kind="code").header["error"].startswith("a state must be an object")


# What the explorer is opened with


def test_arrays_of_a_file_are_magnified(folder):
    np.savez("arrays.npz", vertices=np.array([[1.0, 2], [30, 4], [5, 40]]), triangles=np.array([[0, 1, 2]]))
    state = content_of_name("arrays.npz").pixels
    assert state["size"] == [33, 43]
    assert parse_state(state).size == (33, 43)
    np.savez("sized.npz", vertices=np.zeros((3, 3)), triangles=np.array([[0, 1, 2]]), size=np.array([8, 6]))
    assert content_of_name("sized.npz").pixels["size"] == [8, 6]
    assert content_of_name("sized.npz", (7, 5)).pixels["size"] == [7, 5]


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


def test_difference_tells_each_kind():
    """Nothing, the same, more, less, another owner, drawn more often: a pixel each."""

    def drawing(owners, counts):
        owners = np.array(owners, np.int32).reshape(1, -1, 1)
        return MethodPicture(
            owners, np.array(counts).reshape(1, -1, 1), (owners[..., 0] >= 0).astype(np.float32), 0.0, []
        )

    one = drawing([-1, 0, 0, -1, 0, 0], [0, 1, 1, 0, 1, 2])
    two = drawing([-1, 0, -1, 0, 1, 0], [0, 1, 0, 1, 1, 1])
    assert difference(one, two).tolist() == [[0, 1, 2, 3, 4, 5]]


@pytest.mark.parametrize(("n", "is_told"), [(MAX_DRAWN, True), (MAX_DRAWN + 1, False)])
def test_triangles_that_a_classic_draws_are_told_up_to_a_number(n, is_told):
    state = parse_state(SQUARE | {"triangles": [[0, 1, 2]] * n})
    found = drawn_by(state, (3, 3), next(iter(CLASSICS)))
    assert found == (dict.fromkeys(range(n), 1) if is_told else None)
