"""Views of a mesh: pixels are those of `render` and `rasterize`, files draw the same, what is broken is refused."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft._apps.explore.mesh_view import HANDLERS, HEAT, LAYERS, MeshView, load_bytes
from topleft._apps.explore.session import Content, Session
from topleft.errors import MeshError

SIZE = (96, 64)
PLY = b"ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n%send_header\n"
FACES = b"element face 1\nproperty list uchar int vertex_indices\n"
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


@pytest.fixture
def session():
    return Session(Content("mesh", mesh=tl.Mesh(*tl.scenes.shape("torus")), name="torus"))


def ask(session, do, /, **request):
    """The header and the arrays of an answer."""
    return HANDLERS[f"mesh.{do}"](session, {"size": SIZE, **request})


def whole(header, arrays):
    """The frame of a part of it."""
    frame = np.zeros((*SIZE[::-1], 4), np.uint8)
    x, y, width, height = header["box"]
    frame[y : y + height, x : x + width] = arrays["pixels"]
    return frame


@pytest.mark.parametrize(
    "request_",
    [
        {}, {"azimuth": 200, "elevation": -70, "zoom": 3.0, "pan": [0.7, -0.4]}, {"zoom": 9.0, "up": "z"},
        {"fov": 0, "pan": [1.5, 0]}, {"fov": 0, "zoom": 4}, {"elevation": 90, "zoom": 0.2},
        {"layer": "flat", "edges": True, "lights": "three", "sampling": "msaa4"},
        {"layer": "normals", "cull": "back"},
    ],
)  # fmt: skip
def test_pixels_are_those_of_render_and_none_is_left_out(session, request_):
    header, arrays = ask(session, "draw", **request_)
    view = MeshView.parse({"size": SIZE, **request_})
    camera, mesh = view.camera(session.content.mesh), session.content.mesh
    expected = tl.render(mesh, camera, SIZE, background=(0, 0, 0, 0), **view.look())
    assert np.array_equal(whole(header, arrays), expected)


def test_zoom_one_shows_the_whole_mesh_as_framing_does(session):
    view, mesh = MeshView(SIZE), session.content.mesh
    expected = tl.Camera.framing(mesh, aspect=SIZE[0] / SIZE[1]).clip_from_world(SIZE)
    assert np.allclose(view.camera(mesh).clip_from_world(SIZE), expected)


@pytest.mark.parametrize(("axis", "up", "seen"), [("z", "file", "z"), ("y", "file", "y"), ("z", "y", "y")])
def test_up_is_that_of_the_file_unless_the_view_says_another(session, axis, up, seen):
    mesh, view = replace(session.content.mesh, up=axis), MeshView(SIZE, up=up)
    wished = MeshView(SIZE, up=seen).camera(session.content.mesh)
    assert np.array_equal(view.camera(mesh).view, wished.view)


def test_pan_and_zoom_move_the_middle_of_the_mesh(session):
    mesh = session.content.mesh
    for fov in (40, 0):
        camera = MeshView(SIZE, pan=(0.5, -0.25), zoom=2.0, fov=fov).camera(mesh)
        middle = camera.project([mesh.bounds.mean(axis=0)], SIZE)[0, :2]
        assert np.allclose(middle, [SIZE[0] / 2 + 0.5 * SIZE[1] / 2, SIZE[1] / 2 + 0.25 * SIZE[1] / 2])


@pytest.mark.parametrize("layer", ["triangle", "cluster"])
def test_ids_have_a_color_each(session, layer):
    header, arrays = ask(session, "draw", layer=layer)
    frame = whole(header, arrays).view(np.uint32)[..., 0]
    frags = tl.rasterize_mesh(session.content.mesh, MeshView(SIZE).camera(session.content.mesh), SIZE)
    names = frags.triangle
    if layer == "cluster":
        names = np.append(session.content.mesh.clusters.of_triangles(), -1)[names]
    assert np.array_equal(frame != 0, frags.mask)
    assert len(np.unique(names)) == len(np.unique(frame)) == len(set(zip(names.ravel(), frame.ravel(), strict=True)))


def test_overdraw_has_the_colors_of_its_legend(session):
    header, arrays = ask(session, "draw", layer="overdraw")
    mesh, camera = session.content.mesh, MeshView(SIZE).camera(session.content.mesh)
    counts = tl.overdraw(mesh.vertices, mesh.triangles, SIZE, transform=camera.clip_from_world(SIZE))
    frame = whole(header, arrays)
    for count, row in ((0, 0), (1, 1), (2, 2), (3, 3), (4, 3), (5, 4)):
        assert (frame[counts == count] == HEAT[row]).all()


def test_uv_is_for_meshes_that_have_them(session):
    with pytest.raises(ValueError, match="layer 'uv' needs a mesh that has texture coordinates"):
        ask(session, "draw", layer="uv")
    assert "uv" not in ask(session, "open")[0]["layers"]
    header, _ = ask(session, "open", parts=[OBJ], name="one.obj")
    assert header["layers"] == list(LAYERS)
    header, arrays = ask(session, "draw", layer="uv")
    assert len(np.unique(whole(header, arrays)[..., 1])) == 3


def test_with_a_background_comes_a_jpeg_on_it(session):
    header, arrays = ask(session, "draw", background=[250, 240, 230])
    x, y, width, height = header["box"]
    picture = np.asarray(Image.open(io.BytesIO(arrays["pixels"])))
    assert picture.shape == (height, width, 3)
    view, mesh = MeshView(SIZE), session.content.mesh
    expected = tl.render(mesh, view.camera(mesh), SIZE, background=(250, 240, 230))[y : y + height, x : x + width, :3]
    assert np.abs(picture.astype(int) - expected).mean() < 3  # of 255; JPEG at quality 92
    for layer in LAYERS[:-1]:
        ask(session, "draw", background=[250, 240, 230], layer=layer)


def test_edges_are_smooth_at_rest_alone(session):
    at_rest, moving = (
        MeshView.parse({"size": SIZE, "sampling": "at rest"}),
        {"sampling": "at rest", "background": "white"},
    )
    assert (at_rest.sampling, MeshView.parse({"size": SIZE, **moving}).sampling) == ("msaa4", "center")


def test_nothing_in_view_is_an_empty_picture(session):
    header, arrays = ask(session, "draw", pan=[50, 0])
    assert header["box"][2] == 0
    assert arrays["pixels"].size == 0
    assert ask(session, "draw", pan=[50, 0], background=[0, 0, 0])[1]["pixels"] == b""


def test_pick_is_what_rasterize_shows(session):
    mesh, camera = session.content.mesh, MeshView(SIZE).camera(session.content.mesh)
    frags = tl.rasterize_mesh(mesh, camera, SIZE)
    for y, x in [*np.argwhere(frags.mask)[::150], (0, 0)]:
        found, _ = ask(session, "pick", x=int(x), y=int(y))
        assert found["triangle"] == frags.triangle[y, x]
        if found["triangle"] >= 0:
            assert found["vertices"] == mesh.triangles[found["triangle"]].tolist()
            assert np.allclose(found["barycentric"], frags.barycentric()[y, x])
            assert found["depth"] == frags.depth[y, x]


def test_pick_tells_uv_and_material():
    corners, materials = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [tl.Material(metallic=0.5)]
    mesh = tl.Mesh(corners, [[0, 1, 2]], uv=[[0, 0], [1, 0], [0, 1]], materials=materials)
    found, _ = ask(Session(Content("mesh", mesh=mesh)), "pick", x=46, y=33, azimuth=0, elevation=0)
    assert found["triangle"] == 0
    rows = dict(found["rows"])
    assert rows["uv"] == ", ".join(f"{weight:.5g}" for weight in found["barycentric"][1:])
    assert rows["material"].startswith("0: Material(")


def test_level_of_detail_is_told_and_picked(session):
    pytest.importorskip("fast_simplification", reason="levels need fast-simplification")
    header, _ = ask(session, "draw", tolerance=4.0)
    assert header["level"] > 0
    assert header["level_triangles"] < header["n_triangles"]
    found, _ = ask(session, "pick", x=48, y=45, tolerance=4.0)
    assert found["is_level"] == (found["triangle"] >= 0)


def test_plan_is_that_of_the_view(session):
    header, _ = ask(session, "plan", sampling="msaa4", cull="back")
    assert "transform" in header["text"]
    assert "msaa4" in header["text"] or "4 samples" in header["text"]


# ---- files ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "request_", [{"azimuth": 77.5, "zoom": 2.0, "pan": [0.1, 0.2]}, {"lights": "three", "edges": True, "fov": 0}]
)
def test_saved_code_draws_the_saved_picture(session, folder, request_):
    _, picture = ask(session, "save", what="png", **request_)
    header, code = ask(session, "save", what="code", **request_)
    assert header["name"] == "torus.py"
    exec(compile(code["file"], "torus.py", "exec"), {})
    saved, drawn = (np.asarray(Image.open(file)) for file in (io.BytesIO(picture["file"]), "torus.png"))
    assert np.array_equal(saved, drawn)


@pytest.mark.parametrize("layer", LAYERS[:-1])
def test_saved_code_of_each_layer_runs(session, folder, layer):
    _, code = ask(session, "save", what="code", layer=layer)
    exec(compile(code["file"], "torus.py", "exec"), {})


def test_saved_job_is_drawn_by_the_command_line(session, folder, run):
    header, job = ask(session, "save", what="job", azimuth=-30, elevation=10, fov=0, edges=True)
    (folder / header["name"]).write_bytes(job["file"])
    assert run("render", "--jobs-file", header["name"]) == (0, [])
    assert Image.open("torus.png").size == SIZE


@pytest.mark.parametrize("name", ["layer", "lights", "up", "cull", "sampling"])
def test_word_that_would_leave_its_quotes_in_a_job_is_refused(session, name):
    with pytest.raises(ValueError, match=f"{name} must be "):
        ask(session, "save", what="job", **{name: 'y"\nout = "evil.png'})


# ---- what comes from outside ----------------------------------------------------------------------------------------


def test_dropped_file_becomes_the_mesh_of_that_page_alone(session):
    header, _ = ask(session, "open", parts=[memoryview(OBJ)], name="../../one.OBJ")
    assert (header["name"], header["n_triangles"]) == ("one.OBJ", 1)
    other = Session(session.content)
    assert ask(other, "open")[0]["name"] == "torus"


@pytest.mark.parametrize(
    ("data", "name", "message"),
    [
        (b"ply\nnonsense", "bunny.ply", "cannot read 'bunny.ply': broken"),
        (b"", "bunny.obj", "'bunny.obj' is empty"),
        (b"v 1 2 3", "bunny", "the end of the name must tell the format"),
        (b"v 1 2 3", "bunny.o/bj", "the end of the name must tell the format"),
        (PLY % (99_999_999, FACES), "huge.ply", "99999999 vertices, more than the 4194304 of max_vertices"),
        (PLY % (1, b"") + b"0 0 0\n", "cloud.ply", "'cloud.ply' holds points and no triangles"),
    ],
)
def test_broken_file_is_refused_by_its_name(data, name, message):
    with pytest.raises(MeshError, match=message) as caught:
        load_bytes(data, name)
    assert "/topleft-" not in str(caught.value)


def test_what_a_file_lacks_is_told():
    _, lacks = load_bytes(b"mtllib other.mtl\nusemtl red\n" + OBJ, "one.obj")
    assert len(lacks) == 1
    assert "other.mtl" in lacks[0]
    assert "/topleft-" not in lacks[0]


def test_page_without_a_mesh_begins_with_a_shape():
    assert ask(Session(Content()), "open")[0]["name"] == "torus-knot"


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        ({"size": [0, 5]}, "size must be two numbers of 1 to 8192"),
        ({"size": [9000, 5]}, "size must be two numbers of 1 to 8192"),
        ({"size": [4096, 4096]}, "8388608 pixels, got"),
        ({"layer": "x"}, "layer must be one of 'smooth', .* got .x."),
        ({"lights": "x"}, "lights must be one of 'headlight', .* got .x."),
        ({"zoom": 0}, "zoom must lie in 0.001 to 10000, got 0"),
        ({"fov": 175}, "fov must be 0, or lie in 1 to 170 degrees, got 175"),
        ({"azimuth": float("inf")}, "azimuth must be finite"),
        ({"pan": [1]}, "pan must be two numbers"),
        ({"up": "x"}, "up must be one of 'file', 'y', 'z'"),
        ({"elevation": 91}, "elevation_deg must lie in -90 to 90"),
        ({"what": "gif"}, "what must be one of 'png', 'code', 'job', got 'gif'"),
    ],
)
def test_wrong_view_is_refused_with_a_sentence(session, request_, message):
    with pytest.raises(ValueError, match=message):
        ask(session, "save", **{"what": "png", **request_})


def test_every_answer_but_pixels_is_json(session):
    import json

    for what, more in (("open", {}), ("draw", {}), ("pick", {"x": 48, "y": 45}), ("plan", {})):
        json.dumps(ask(session, what, **more)[0])


def test_every_choice_of_the_page_is_drawn(session):
    rows = [row for _, rows in ask(session, "open")[0]["controls"] for row in rows]
    assert {name for _, name, _ in rows} - {"spin"} <= set(MeshView.__dataclass_fields__)
    for _, name, options in rows:
        for value, _ in options or []:
            if not (name == "tolerance" and value):
                ask(session, "draw", **{name: value})
