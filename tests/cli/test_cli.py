"""The command line: real files in, pictures out, one clear line and the right exit status when it cannot be."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from first_pictures import camera_of, first_picture, shape_of
from PIL import Image

import topleft as tl
from topleft import cli, scenes
from topleft._meshes.camera.camera import Camera
from topleft._meshes.io import png
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.render import render

PYRAMID = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0.5 1 0.5\nf 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\nf 1 2 3\nf 1 3 4\n"
SMALL = ["--size", "64x48"]
QUADS = "g a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\ng b\nv 0 0 1\nf 1 2 5\n"


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


# Pictures


def test_render_shape_is_the_picture_of_the_library(run):
    assert run("render", "torus-knot", "-o", "knot.png", "--size", "96x64") == (0, [])
    assert np.array_equal(np.asarray(Image.open("knot.png")), first_picture("torus-knot", (96, 64)))


def test_render_wireframe_is_the_picture_with_edges(run):
    assert run("render", "cube", "-o", "cube.png", "--wireframe", *SMALL) == (0, [])
    expected = first_picture("cube", edges=True)
    assert np.array_equal(np.asarray(Image.open("cube.png")), expected)


@pytest.mark.parametrize("kind", ["obj", "ply", "stl", "glb", "off"])
def test_render_file_of_each_format_shows_the_mesh(run, folder, kind):
    trimesh = pytest.importorskip("trimesh")
    vertices, triangles = scenes.shape("icosphere")
    trimesh.Trimesh(vertices, triangles, process=False).export(folder / f"ball.{kind}")
    assert run("render", f"ball.{kind}", "-o", "ball.png", *SMALL) == (0, [])
    look = ["--shading", "flat"] if kind == "glb" else []  # whose triangles are flat where the file has no normals
    assert run("render", "icosphere", "-o", "expected.png", *look, *SMALL) == (0, [])
    expected = np.asarray(Image.open("expected.png")).astype(int)
    # Formats round positions to float32 or decimals, and may write normals of their own.
    assert np.abs(np.asarray(Image.open("ball.png")) - expected).mean() < 1


def test_render_obj_with_quads_and_groups_shows_all_triangles(run, folder):
    pytest.importorskip("trimesh")
    (folder / "a.obj").write_text(QUADS)
    assert run("render", "a.obj", "-o", "a.npy", "--shading", "ids", *SMALL)[0] == 0
    assert np.unique(np.load("a.npy")).tolist() == [-1, 0, 1, 2]


@pytest.mark.parametrize("suffix", ["png", "jpg", "jpeg", "webp", "PNG"])
def test_render_format_is_that_of_the_name(run, suffix):
    assert run("render", "cube", "-o", f"cube.{suffix}", *SMALL) == (0, [])
    with Image.open(f"cube.{suffix}") as image:
        assert image.size == (64, 48)
        assert image.format == {"png": "PNG", "webp": "WEBP"}.get(suffix.lower(), "JPEG")


@pytest.mark.parametrize(
    ("shading", "shape", "dtype"),
    [
        ("ids", (48, 64), "i4"),
        ("depth", (48, 64), "f4"),
        ("normals", (48, 64, 3), "f4"),
        ("smooth", (48, 64, 4), "u1"),
        ("flat", (48, 64, 4), "u1"),
    ],
)
def test_render_npy_holds_the_numbers_behind_the_picture(run, shading, shape, dtype):
    assert run("render", "cube", "-o", "cube.npy", "--shading", shading, *SMALL)[0] == 0
    array = np.load("cube.npy")
    assert (array.shape, array.dtype) == (shape, np.dtype(dtype))


def test_render_npz_holds_all_buffers_and_the_matrix(run):
    assert run("render", "cube", "-o", "cube.npz", *SMALL)[0] == 0
    with np.load("cube.npz") as arrays:
        assert sorted(arrays) == ["clip_from_world", "color", "depth", "triangle"]
        assert np.array_equal(arrays["triangle"] >= 0, np.isfinite(arrays["depth"]))
        camera = camera_of(shape_of("cube"))
        assert np.array_equal(arrays["clip_from_world"], camera.clip_from_world((64, 48)))


def test_render_camera_options_reach_the_camera(run):
    angles = ["--azimuth", "-30", "--elevation", "10", "--fov", "25"]
    others = ["--ortho", "--up", "z", "--cull", "back", "--threads", "1"]
    assert run("render", "cube", "-o", "cube.png", *SMALL, *angles, *others)[0] == 0
    mesh = shape_of("cube")
    camera = camera_of(mesh, azimuth_deg=-30, elevation_deg=10, fov_y_deg=25, ortho=True, up="z")
    assert np.array_equal(np.asarray(Image.open("cube.png")), render(mesh, camera, (64, 48), sampling="msaa4"))


def test_render_fills_the_frame_but_for_the_margin(run):
    assert run("render", "torus", "-o", "a.npy", "--shading", "ids", "--size", "400x100") == (0, [])
    rows = np.flatnonzero((np.load("a.npy") >= 0).any(axis=1))
    assert (rows[0], rows[-1]) == (5, 94)


def test_render_limits_of_a_file_are_options(run, folder):
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "f 1 2 3\n" * 10)
    status, err = run("render", "a.obj", "-o", "a.png", "--max-triangles", 9, *SMALL)
    assert (status, "has 10 triangles, more than the 9 of max_triangles" in err[-1]) == (2, True)
    assert run("render", "a.obj", "-o", "a.png", "--max-triangles", 10, *SMALL) == (0, [])


def test_render_crease_makes_edges_sharp_or_not(run, folder):
    pytest.importorskip("trimesh")
    (folder / "a.obj").write_text(PYRAMID)
    colors = {}
    for degrees in (0, 30, 180):
        options = ["--crease", degrees, "--sampling", "center", *SMALL]
        assert run("render", "a.obj", "-o", f"{degrees}.png", *options)[0] == 0
        pixels = np.asarray(Image.open(f"{degrees}.png")).reshape(-1, 4)
        colors[degrees] = len(np.unique(pixels, axis=0))
    assert colors[0] == colors[30] == 3  # two sides and the ground
    assert colors[180] > 20


def test_render_cloud_of_points_is_the_picture_of_points(run, folder):
    pytest.importorskip("trimesh")
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    colors = "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
    (folder / "a.ply").write_text(head + colors + "0 0 0 255 0 0\n1 0 0.5 0 255 0\n0 1 0 0 0 255\n")
    assert run("render", "a.ply", "-o", "a.png", "--point-size", "9", *SMALL) == (0, [])
    rgb = np.eye(3, dtype=np.uint8) * 255
    cloud = tl.Points([[0, 0, 0], [1, 0, 0.5], [0, 1, 0]], rgb, size=9)
    expected = tl.render(cloud, camera_of(cloud), (64, 48), sampling="msaa4")
    assert np.array_equal(np.asarray(Image.open("a.png")), expected)
    assert run("render", "a.ply", "-o", "a.npz", "--point-size", "9", *SMALL) == (0, [])
    assert np.unique(np.load("a.npz")["triangle"]).tolist() == [-1, 0, 1, 2]
    status, lines = run("render", "a.ply", "-o", "a.png", "--point-size", "none")
    assert (status, len(lines)) == (2, 1)
    assert "must be a positive number of pixels, got 'none'" in lines[0]


def test_render_word_in_braces_that_stands_for_nothing_is_refused(run, folder):
    status, lines = run("render", "cube", "-o", "{nam}.png")
    message = (
        "topleft: OUT may have {name}, {folder}, {view}, {index}, {layer}, got {nam} in '{nam}.png'; did you mean name?"
    )
    assert (status, lines) == (2, [message])
    (folder / "{nam}").mkdir()
    assert run("render", "cube", "-o", "{nam}/{name}.png", *SMALL) == (0, [])
    assert names(folder) == ["{nam}/cube.png"]


def test_render_unknown_option_is_told_what_it_may_mean(run):
    status, lines = run("render", "cube", "-o", "a.png", "--colour", "red")
    assert (status, len(lines)) == (2, 1)
    assert "unrecognized arguments: --colour red; did you mean --color?" in lines[0]


def test_render_files_that_differ_in_their_formats_have_these_in_their_names(run, folder):
    pytest.importorskip("trimesh")
    (folder / "a.obj").write_text(QUADS)
    (folder / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    (folder / "b.obj").write_text(QUADS)
    assert run("render", "a.obj", "a.off", "b.obj", "-o", "p/", *SMALL) == (0, [])
    assert names(folder / "p") == ["a-obj.png", "a-off.png", "b.png"]


@pytest.mark.parametrize(
    ("text", "rgba"),
    [
        ("transparent", [0, 0, 0, 0]),
        ("navy", [0, 0, 128, 255]),
        ("#102030", [16, 32, 48, 255]),
        ("#10203040", [16, 32, 48, 64]),
    ],
)
def test_render_background_is_a_name_or_a_number(run, text, rgba):
    assert run("render", "cube", "-o", "cube.png", "--background", text, *SMALL)[0] == 0
    assert np.asarray(Image.open("cube.png"))[0, 0].tolist() == rgba


def test_render_transparent_jpeg_is_white(run):
    assert run("render", "cube", "-o", "cube.jpg", "--background", "transparent", *SMALL)[0] == 0
    assert np.asarray(Image.open("cube.jpg"))[0, 0].min() > 250


# Names


@pytest.mark.parametrize(
    ("meshes", "out", "views", "expected"),
    [
        (["cube"], "a.png", 1, ["a.png"]),
        (["cube"], "new/sub/a.png", 1, ["new/sub/a.png"]),
        (["cube"], "pictures", 1, ["pictures/cube.png"]),
        (["cube"], "v1.2/", 1, ["v1.2/cube.png"]),
        (["cube", "torus"], "pictures", 1, ["pictures/cube.png", "pictures/torus.png"]),
        (["cube"], "a.png", 2, ["a-000.png", "a-001.png"]),
        (["cube"], "{view}_a.png", 2, ["000_a.png", "001_a.png"]),
        (["cube", "torus"], "p", 2, ["p/cube-000.png", "p/cube-001.png", "p/torus-000.png", "p/torus-001.png"]),
        (["cube", "torus"], "{name}/{index}.jpg", 1, ["cube/000.jpg", "torus/001.jpg"]),
        (["cube", "cube"], "{index}.png", 2, ["000-000.png", "000-001.png", "001-000.png", "001-001.png"]),
    ],
)
def test_render_names_follow_out(run, folder, meshes, out, views, expected):
    assert run("render", *meshes, "-o", out, "--views", views, *SMALL) == (0, [])
    assert names(folder) == expected


def test_render_views_go_round_the_mesh(run):
    assert run("render", "torus-knot", "-o", "a.npy", "--views", "4", "--shading", "ids", *SMALL)[0] == 0
    mesh = Mesh(*scenes.shape("torus-knot"))
    for i_view in range(4):
        camera = Camera.framing(mesh, azimuth_deg=35 + 90 * i_view, aspect=64 / 48)
        expected = render(mesh, camera, (64, 48), background=(0, 0, 0, 0))[..., 3] > 0
        assert np.array_equal(np.load(f"a-00{i_view}.npy") >= 0, expected)


@pytest.mark.parametrize(
    ("out", "pictures"),
    [
        ("out/", ["out/Cube-3.png", "out/cube-2.png", "out/cube.png"]),
        ("out/{folder}/{name}.png", ["out/a/cube-2.png", "out/a/cube.png", "out/b/Cube.png"]),
        ("out/{index}-{name}.png", ["out/000-cube.png", "out/001-cube-2.png", "out/002-Cube.png"]),
    ],
)
def test_render_files_of_one_name_have_numbers_or_folders(run, folder, out, pictures):
    """Names that differ by case alone are one name on some disks; a mesh that has the number in its name keeps it."""
    meshes = ["a/cube.obj", "a/cube-2.obj", "b/Cube.obj"]
    for mesh in meshes:
        (folder / mesh).parent.mkdir(exist_ok=True)
        (folder / mesh).write_text(QUADS)
    assert run("render", *meshes, "-o", out, *SMALL)[0] == 0
    assert names(folder) == sorted([*meshes, *pictures])


@pytest.mark.parametrize(
    ("suffix", "told"),
    [
        (".step", "reading 'x.step' needs another package: pip install cascadio"),
        (".fbx", "cannot read 'x.fbx': there is no reader of .fbx; Blender and assimp convert it: assimp export x.fbx"),
        (".usdz", "cannot read 'x.usdz': there is no reader of .usdz; Blender converts it"),
        (".pvd", "cannot read 'x.pvd': there is no reader of .pvd; it names a file for each time step"),
        (".3ds", "cannot read 'x.3ds': there is no reader of .3ds; Blender and assimp convert it"),
    ],
)
def test_render_goes_on_after_a_format_that_nothing_reads_and_names_what_does(run, folder, suffix, told):
    pytest.importorskip("trimesh")
    if suffix == ".step" and importlib.util.find_spec("cascadio"):
        pytest.skip("cascadio is installed")
    (folder / f"x{suffix}").write_text("what nobody reads")
    assert run("render", f"x{suffix}", "-o", "x.png")[0] == 2
    assert names(folder) == [f"x{suffix}"]
    status, lines = run("render", f"x{suffix}", "cube", "-o", "out/", *SMALL)
    assert status == 1
    assert lines[0].startswith(f"topleft: {told}")
    assert names(folder) == ["out/cube.png", f"x{suffix}"]


def test_render_never_replaces_a_mesh(run, folder):
    (folder / "a.npz").write_text(QUADS)
    status, lines = run("render", "a.npz", "-o", "./a.npz")
    assert (status, lines) == (2, ["topleft: OUT would overwrite the mesh 'a.npz'"])
    assert (folder / "a.npz").read_text() == QUADS


def test_render_mesh_and_out_reversed_is_refused(run, folder):
    (folder / "a.obj").write_text(QUADS)
    status, lines = run("render", "a.png", "-o", "a.obj")
    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith("topleft: OUT must end in one of .png .jpg .jpeg .webp .tif .tiff .npy .npz, or in /")
    assert (folder / "a.obj").read_text() == QUADS


# What goes wrong


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["nope.obj", "-o", "a.png"], "topleft: there is no file 'nope.obj'"),
        (["https://a.b/c.obj", "-o", "a.png"], "topleft: path must be a file of this machine, got the URL"),
        (["dodo", "-o", "a.png"], "topleft: there is no file and no built-in shape 'dodo'; shapes: blob, cube, "),
        (["broken.obj", "-o", "a.png"], "topleft: cannot read 'broken.obj': broken, or not a '.obj' file"),
        (["empty.obj", "-o", "a.png"], "topleft: 'empty.obj' has no triangles"),
        (["notes.txt", "-o", "a.png"], "topleft: cannot read 'notes.txt': format '.txt' is none of "),
        (["cube", "-o", "notes.txt/a.png"], "topleft: cannot write to the folder 'notes.txt': '"),
        (["cube", "-o", "a.gif"], "topleft: OUT must end in one of .png"),
        (["cube", "-o", ""], "topleft: OUT must end in one of .png"),
        (["cube", "-o", "-"], "topleft: OUT must be a file or a folder, got '-': no picture is written to "),
        (["cube", "-o", "a/.png"], "topleft: OUT must have a name before .png, got 'a/.png'"),
        (["cube", "torus", "-o", "a.png"], "topleft: several meshes need a folder or {name} in OUT, got 'a.png'"),
        (["cube"], "topleft: say where pictures go: -o/--out, --sheet or --animation (try: topleft render --help)"),
        (["-o", "a.png"], "topleft: there is nothing to render: give MESH or --jobs-file (try: topleft render --help)"),
        (["cube", "-o", "a.png", "--size", "64x"], "topleft: argument --size: must be WIDTHxHEIGHT, 1280x720 say, or"),
        (["cube", "-o", "a.png", "--size", "0x9"], "topleft: argument --size: must be WIDTHxHEIGHT"),
        (["cube", "-o", "a.png", "--views", "0"], "topleft: argument --views: must be a positive whole number, got"),
        (["cube", "-o", "a.png", "--background", "x"], "topleft: argument --background: must be a colour name or #"),
        (["cube", "-o", "a.png", "--shading", "toon"], "topleft: argument --shading: invalid choice: 'toon'"),
        (["cube", "-o", "a.png", "--fov", "180"], "topleft: fov_y_deg must lie between 0 and 180, got 180.0"),
        (["cube", "-o", "a.png", "--elevation", "91"], "topleft: elevation_deg must lie in -90 to 90, got 91.0"),
        (["cube", "-o", "a.png", "--colour", "red"], "topleft: unrecognized arguments: --colour red"),
    ],
)
def test_render_impossible_is_one_line_and_status_2(run, folder, arguments, line):
    pytest.importorskip("trimesh")
    (folder / "broken.obj").write_text("v 0 0 0\nv 1 0\nf 1 2 3\n")
    (folder / "empty.obj").write_text("# nothing\n")
    (folder / "notes.txt").write_text("buy milk\n")
    status, lines = run("render", *arguments)
    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith(line)
    assert names(folder) == ["broken.obj", "empty.obj", "notes.txt"]


@pytest.mark.parametrize(
    "command",
    [["render", "-o", "a.png"], ["mask", "-o", "a.png"], ["raster", "-o", "a.tif", "--size", "8x8"],
     ["bake", "-o", "a.png"], ["explain"]],
)  # fmt: skip
@pytest.mark.parametrize("url", ["https://a.b/c.obj", "https://a.b/c.geojson"])
def test_urls_are_refused_by_every_command_that_reads(run, command, url):
    status, lines = run(command[0], url, *command[1:])
    assert (status, len(lines)) == (2, 1)
    assert lines[0].endswith(f"must be a file of this machine, got the URL '{url}': download it first")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_render_into_a_protected_folder_is_one_line_and_status_2(run, folder):
    (folder / "locked").mkdir(mode=0o555)
    expected = "topleft: cannot write to the folder 'locked': permission denied"
    assert run("render", "cube", "torus", "-o", "locked/") == (2, [expected])


def test_render_protected_folder_is_found_before_any_work(run, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    expected = "topleft: cannot write to the folder 'locked': permission denied"
    assert run("render", "cube", "torus", "-o", "locked/") == (2, [expected])


def test_render_disk_full_leaves_no_half_picture(run, folder, monkeypatch):
    def half_a_picture(image, **_):
        yield b"half a pic"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(png, "pieces", half_a_picture)
    status, lines = run("render", "cube", "-o", "a.png", *SMALL)
    assert (status, lines) == (2, ["topleft: cannot write: No space left on device: 'a.png'"])
    assert names(folder) == []


def test_render_many_goes_on_after_a_failure(run, folder):
    pytest.importorskip("trimesh")
    (folder / "broken.obj").write_text("v 0 0 0\nf 1 2 3\n")
    status, lines = run("render", "cube", "broken.obj", "nope.ply", "torus", "-o", "out", *SMALL)
    assert status == 1
    assert lines[0].startswith("topleft: cannot read 'broken.obj'")
    assert lines[1:] == ["topleft: there is no file 'nope.ply'", "topleft: 2 of 4 meshes failed: broken.obj nope.ply"]
    assert names(folder) == ["broken.obj", "out/cube.png", "out/torus.png"]


def test_render_without_trimesh_gives_the_hint(run, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    (folder / "a.3mf").write_text("PK")
    expected = "topleft: reading 'a.3mf' needs another package: pip install trimesh"
    assert run("render", "a.3mf", "-o", "out/", *SMALL) == (2, [expected])
    status, lines = run("render", "a.3mf", "cube", "-o", "out/", *SMALL)
    assert (status, lines) == (1, [expected, "topleft: 1 of 2 meshes failed: a.3mf"])


def test_render_shape_needs_no_optional_package(run, monkeypatch):
    for package in ("trimesh", "tqdm", "scipy"):
        monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    assert run("render", "cube", "torus", "-o", "out/", *SMALL) == (0, [])


# Progress, information, entry points


def test_render_progress_is_shown_to_a_person(run, monkeypatch):
    pytest.importorskip("tqdm")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    status, lines = run("render", "cube", "-o", "a.png", "--views", "3", *SMALL)
    assert status == 0
    assert "3/3" in lines[-1]


@pytest.mark.parametrize(("views", "is_tty"), [(1, True), (3, False)])
def test_render_progress_is_silent_for_one_picture_or_a_pipe(run, monkeypatch, views, is_tty):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_tty, raising=False)
    assert run("render", "cube", "-o", "a.png", "--views", views, *SMALL) == (0, [])


def test_info_tells_the_version_and_what_runs(capsys):
    assert cli.main(["info"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("version: ") for line in lines)
    assert any(line.startswith("isa: ") for line in lines)


def test_no_command_is_the_help(capsys):
    assert cli.main([]) == 0
    assert capsys.readouterr().out.startswith("usage: topleft ")


def test_help_names_shapes_and_formats(capsys):
    with pytest.raises(SystemExit) as leaving:
        cli.main(["render", "--help"])
    text = capsys.readouterr().out
    assert leaving.value.code == 0
    assert all(word in text for word in [*scenes.SHAPES, ".png", ".npz", "{name}", "--views"])


def test_python_m_topleft_is_the_command_line(folder):
    command = [sys.executable, "-m", "topleft", "render", "nope.obj", "-o", "a.png"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "topleft: there is no file 'nope.obj'\n")


def test_render_warnings_of_a_reader_stay_off_stderr(folder):
    pytest.importorskip("trimesh")
    header = "ply\nformat ascii 1.0\ncomment TextureFile gone.png\nelement vertex 3\n"
    properties = "property float x\nproperty float y\nproperty float z\nelement face 1\n"
    rows = "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    Path("a.ply").write_text(header + properties + rows)
    command = [sys.executable, "-m", "topleft", "render", "a.ply", "-o", "a.png", *SMALL]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
