"""What `topleft render` may be told about the look of a mesh: texture, matcap, glass."""

import numpy as np
import pytest
from first_pictures import camera_of, first_picture
from gltf_files import GltfFile
from PIL import Image

import topleft as tl
from topleft import scenes

SMALL = ["--size", "64x48"]
SIZE = (64, 48)
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
CHECKS = np.kron([[0, 1], [1, 0]], np.ones((4, 4)))[..., None] * np.array([200, 80, 30]) + 20
KNOT = tl.Mesh(*scenes.shape("torus-knot"))


def pixels(path):
    with Image.open(path) as image:
        return np.asarray(image)


@pytest.fixture
def checks(folder):
    Image.fromarray(CHECKS.astype(np.uint8)).save(folder / "checks.png")
    return tl.Texture(CHECKS.astype(np.uint8))


def test_render_texture_is_laid_on_the_mesh(run, folder, checks):
    pytest.importorskip("trimesh")
    (folder / "a.obj").write_text(SQUARE)
    options = ["--texture", "checks.png", "--shading", "unlit", "--jobs", 2, *SMALL]
    assert run("render", "a.obj", "-o", "a.png", "--views", 2, *options) == (0, [])
    mesh = tl.load(folder / "a.obj")
    assert mesh.uv is not None
    camera = tl.Camera.framing(mesh, aspect=64 / 48)
    expected = tl.render(mesh, camera, SIZE, shading="unlit", material=tl.Material(texture=checks), sampling="msaa4")
    assert np.array_equal(pixels("a-000.png"), expected)
    assert {(220, 100, 50, 255), (20, 20, 20, 255)} <= {tuple(color) for color in expected.reshape(-1, 4).tolist()}


def test_render_matcap_is_the_picture_of_the_library(run, checks):
    look = ["--shading", "matcap", "--matcap", "checks.png"]
    assert run("render", "torus-knot", "-o", "a.png", *look, *SMALL) == (0, [])
    assert np.array_equal(pixels("a.png"), first_picture("torus-knot", shading="matcap", matcap=checks))


@pytest.mark.parametrize(
    ("text", "up", "environment"),
    [
        ("#8ac", "y", {"sky": (136, 170, 204)}),
        ("white,#321", "z", {"sky": (255, 255, 255), "ground": (51, 34, 17), "up": (0, 0, 1)}),
        ("checks.png", "y", {"image": True}),
    ],
)
def test_render_environment_is_light_from_all_around(run, checks, text, up, environment):
    if "image" in environment:
        environment = {"image": checks.image[..., :3]}
    assert run("render", "torus-knot", "-o", "a.png", "--environment", text, "--up", up, *SMALL) == (0, [])
    environment = tl.Environment(**environment)
    expected = tl.render(KNOT, camera_of(KNOT, up=up), SIZE, environment=environment, sampling="msaa4")
    assert np.array_equal(pixels("a.png"), expected)


@pytest.mark.parametrize("layers", [[], ["--layers", "color"]])
def test_render_opacity_is_glass(run, layers):
    assert run("render", "torus-knot", "-o", "a.png", "--opacity", 0.4, *layers, *SMALL) == (0, [])
    assert np.array_equal(pixels("a.png"), tl.render_transparent(KNOT, camera_of(KNOT), SIZE, opacity=0.4))


@pytest.mark.parametrize(("cull", "is_shown"), [((), 0), (("--cull", "none"), 1), (("--cull", "front"), 1)])
def test_render_cull_that_is_typed_wins_over_the_material(run, folder, cull, is_shown):
    file = GltfFile(materials=[{}]).shown([[0, 0, 0], [0, 1, 0], [1, 0, 0]], material=0)  # seen from behind
    (folder / "a.glb").write_bytes(file.glb())
    view = ["--azimuth", 0, "--elevation", 0, "--background", "transparent"]
    assert run("render", "a.glb", "-o", "a.png", *view, *cull, *SMALL) == (0, [])
    assert pixels("a.png")[..., 3].any() == is_shown


def animated(folder):
    """A triangle that turns about y: at 0 seconds it shows its front, at 1 its edge; the camera turns in clip 1."""
    file = GltfFile(cameras=[{"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 2, "znear": 1, "zfar": 9}}])
    file.shown()
    file.node(camera=0, translation=[0, 0, 5])
    turn = {"input": file.accessor([0.0, 1.0]), "output": file.accessor([[0, 0, 0, 1.0], [0, 0.5**0.5, 0, 0.5**0.5]])}
    for node in (0, 1):
        channel = {"sampler": 0, "target": {"node": node, "path": "rotation"}}
        file.add("animations", {"name": f"of {node}", "samplers": [turn], "channels": [channel]})
    (folder / "a.glb").write_bytes(file.glb())


@pytest.mark.parametrize(
    ("time", "is_shown"),
    [
        (("--time", 0, "--clip", 0), 1),
        (("--time", 1, "--clip", "of 0"), 0),
        (("--time", 1, "--clip", "of 1"), 1),
        (("--time", 1, "--clip", 1, "--camera", 0), 0),
    ],
)
def test_render_time_is_that_of_the_animation(run, folder, time, is_shown):
    animated(folder)
    view = ["--azimuth", 0, "--elevation", 0, "--background", "transparent"]
    assert run("render", "a.glb", "-o", "a.png", *view, *time, *SMALL) == (0, [])
    assert pixels("a.png")[..., 3].any() == is_shown
    (folder / "jobs.json").write_text('{"job": [{"mesh": "a.glb", "out": "b.png", "time": 1, "clip": "of 1"}]}')
    assert run("render", "--jobs-file", "jobs.json", *view, *SMALL) == (0, [])
    assert pixels("b.png")[..., 3].any()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["a.glb", "--time", "-1"], "topleft: argument --time: must be a number of seconds, 0 or more, got '-1'"),
        (["a.glb", "--time", "nan"], "topleft: argument --time: must be a number of seconds, 0 or more, got 'nan'"),
        (["a.glb", "--time", "1", "--clip", "x"], "clip must be 0 to 1, or one of 'of 0', 'of 1', got 'x'"),
        (["a.glb", "--clip", "1"], "topleft: --clip needs --time: which second of it"),
        (["cube", "--time", "1"], "topleft: --time needs a file with animations, got the built-in shape 'cube'"),
    ],
)
def test_render_impossible_time_is_one_line_and_status_2(run, folder, arguments, line):
    animated(folder)
    status, lines = run("render", *arguments, "-o", "a.png", *SMALL)
    assert status == 2
    assert len(lines) == 1
    assert line in lines[0]
    assert not (folder / "a.png").exists()


def test_render_unlit_shows_the_color(run):
    options = ["--shading", "unlit", "--color", "#123456", "--sampling", "center", *SMALL]
    assert run("render", "cube", "-o", "a.png", *options) == (0, [])
    assert np.unique(pixels("a.png").reshape(-1, 4), axis=0).tolist() == [[18, 52, 86, 255], [255, 255, 255, 255]]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--texture", "checks.png"], "topleft: --texture needs texture coordinates, and 'cube' has none"),
        (["--shading", "matcap"], "topleft: --shading matcap and --matcap FILE go together"),
        (["--matcap", "checks.png"], "topleft: --shading matcap and --matcap FILE go together"),
        (["--shading", "matcap", "--matcap", "gone.png"], "topleft: No such file or directory: '"),
        (["--shading", "matcap", "--matcap", "notes.png"], "topleft: cannot read 'notes.png': it is no picture that P"),
        (["--environment", "blau"], "topleft: --environment must be one or two colours or a picture, got 'blau'"),
        (["--environment", "red,red,red"], "topleft: --environment must be one or two colours, got 3"),
        (["--environment", "gone.png"], "topleft: No such file or directory: '"),
        (["--environment", "notes.png"], "topleft: cannot read 'notes.png': it is no picture that P"),
        (["--opacity", "2"], "topleft: argument --opacity: must be a number from 0 to 1, got '2'"),
        (["--opacity", "half"], "topleft: argument --opacity: must be a number from 0 to 1, got 'half'"),
        (["--opacity", "0.5", "--wireframe"], "topleft: --opacity goes with neither --wireframe nor --sampling"),
        (["--opacity", "0.5", "--sampling", "msaa4"], "topleft: --opacity goes with neither --wireframe nor --samp"),
    ],
)
def test_render_impossible_look_is_one_line_and_status_2(run, folder, checks, arguments, line):
    (folder / "notes.png").write_text("buy milk")
    status, lines = run("render", "cube", "-o", "a.png", *arguments, *SMALL)
    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith(line)
    assert not (folder / "a.png").exists()


@pytest.mark.parametrize("color", ["1 1 1", "0.97 0.96 0.98"])
def test_white_mesh_keeps_its_outline_on_the_default_background(run, folder, color):
    """A flat white face that looks at the light was 255 on 255; the backdrop has a hue, which no such face has."""
    (folder / "a.mtl").write_text(f"newmtl m\nKd {color}\nillum 0\n")
    (folder / "a.obj").write_text("mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nusemtl m\nf 1 2 3\n")
    assert run("render", "a.obj", "-o", "a.png", *SMALL) == (0, [])
    assert run("render", "a.obj", "-o", "white.png", "--background", "white", *SMALL) == (0, [])
    with Image.open("a.png") as image:
        picture = np.asarray(image).astype(int)
    assert picture[0, 0].tolist() == [196, 212, 232, 255]
    inside = picture[20:28, 30:40, :3]
    assert (np.abs(inside - picture[0, 0, :3]).max(axis=-1) > 10).all()
    with Image.open("white.png") as image:
        assert np.asarray(image)[0, 0].tolist() == [255] * 4


def test_dark_mesh_stands_on_white(run, folder):
    (folder / "a.mtl").write_text("newmtl m\nKd 0.5 1 1\nnewmtl n\nKd 0.5 1 0.9\n")
    faces = "usemtl m\nf 1 2 3\nusemtl n\nf 3 2 1\n"
    (folder / "a.obj").write_text("mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\n" + faces)
    assert run("render", "a.obj", "-o", "a.jpg", *SMALL) == (0, [])
    with Image.open("a.jpg") as image:
        assert np.asarray(image)[0, 0].tolist() == [255] * 3
