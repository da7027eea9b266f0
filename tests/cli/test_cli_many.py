"""The command line for many pictures: layers, job files, workers, sheets, animations, and going on after a break."""

import contextlib
import json
import os
import pathlib
import signal
import stat
import subprocess
import sys
import time
from multiprocessing import get_all_start_methods

import numpy as np
import pytest
from first_pictures import camera_of, first_picture, shape_of
from gltf_files import GltfFile
from PIL import Image

from topleft import scenes
from topleft._apps.cli import animation
from topleft._apps.cli.render import captions_of
from topleft._apps.cli.sheet import make_sheet, wrapped
from topleft._apps.cli.targets import MeshJobs, Orbit
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.render import rasterize_mesh, render
from topleft._meshes.picture.transparent import render_transparent

SMALL = ["--size", "64x48"]
KNOT = Mesh(*scenes.shape("torus-knot"))


@pytest.fixture
def ffmpeg(folder, monkeypatch):
    """A program of that name that keeps what it is told and fed, and writes a file; or fails if told to."""
    tools = folder / "tools"
    tools.mkdir()
    program = tools / "ffmpeg"
    program.write_text(
        f"#!{sys.executable}\n"
        "import json, os, sys\n"
        "if os.environ.get('FAIL'): sys.exit('one\\nUnknown encoder')\n"
        "pixels = sys.stdin.buffer.read()\n"
        f"json.dump([sys.argv[1:], len(pixels)], open({str(folder / 'told.json')!r}, 'w'))\n"
        "open(sys.argv[-1], 'wb').write(pixels)\n"
    )
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(tools))
    return folder / "told.json"


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def knots(n, size=(64, 48), sampling="msaa4"):
    cameras = [Camera.framing(KNOT, azimuth_deg=35 + 360 * i / n, aspect=size[0] / size[1]) for i in range(n)]
    return [render(KNOT, camera, size, sampling=sampling) for camera in cameras]


def pixels(path):
    with Image.open(path) as image:
        return np.asarray(image)


# Layers


@pytest.mark.parametrize(
    ("out", "layers", "views", "expected"),
    [
        ("p/", "color,depth", 1, ["p/cube-color.png", "p/cube-depth.png"]),
        ("p/", "depth", 1, ["p/cube.png"]),
        ("a.png", "color,triangle", 1, ["a-color.png", "a-triangle.png"]),
        ("a.png", "color,alpha", 2, ["a-000-alpha.png", "a-000-color.png", "a-001-alpha.png", "a-001-color.png"]),
        ("{layer}/{name}.tiff", "alpha,depth", 1, ["alpha/cube.tiff", "depth/cube.tiff"]),
        ("a.npz", "color,triangle", 1, ["a.npz"]),
        ("a.npy", "camera_normal", 1, ["a.npy"]),
    ],
)
def test_render_layers_names_follow_out(run, folder, out, layers, views, expected):
    assert run("render", "cube", "-o", out, "--layers", layers, "--views", views, *SMALL) == (0, [])
    assert names(folder) == expected


def test_render_layer_id_is_short_for_triangle(run, folder):
    assert run("render", "cube", "-o", "p/", "--layers", "color,depth,id", *SMALL) == (0, [])
    assert sorted(path.name for path in (folder / "p").iterdir()) == [
        "cube-color.png", "cube-depth.png", "cube-triangle.png",
    ]  # fmt: skip


def test_render_layers_are_those_of_the_mesh(run):
    assert run("render", "torus-knot", "-o", "p/", "--layers", "color,depth,triangle", *SMALL) == (0, [])
    frags = rasterize_mesh(KNOT, camera_of(KNOT), (64, 48))
    assert np.array_equal(pixels("p/torus-knot-color.png"), first_picture("torus-knot", sampling="center"))
    assert np.array_equal(pixels("p/torus-knot-triangle.png").astype(int) - 1, frags.triangle)
    assert np.array_equal(pixels("p/torus-knot-depth.png") > 0, frags.mask)


def test_render_sampling_reaches_the_picture(run):
    for sampling in ("center", "msaa8"):
        assert run("render", "torus-knot", "-o", "a.png", "--sampling", sampling, *SMALL) == (0, [])
        assert np.array_equal(pixels("a.png"), first_picture("torus-knot", sampling=sampling))


@pytest.mark.parametrize("bits", [0, 12, "exact"])
def test_render_subpixel_bits_reach_pictures_layers_and_glass(run, bits):
    words = ["--subpixel-bits", bits, *SMALL]
    assert run("render", "torus-knot", "-o", "a.png", *words) == (0, [])
    camera = camera_of(KNOT)
    assert np.array_equal(pixels("a.png"), render(KNOT, camera, (64, 48), sampling="msaa4", subpixel_bits=bits))
    assert run("render", "torus-knot", "-o", "a.npz", *words) == (0, [])
    with np.load("a.npz") as found:
        frags = rasterize_mesh(KNOT, camera, (64, 48), subpixel_bits=bits)
        assert (frags.triangle != rasterize_mesh(KNOT, camera, (64, 48)).triangle).any()
        assert np.array_equal(found["triangle"], frags.triangle)
        assert np.array_equal(found["depth"], frags.depth)
        assert np.array_equal(found["color"], render(KNOT, camera, (64, 48), subpixel_bits=bits))
    assert run("render", "torus-knot", "-o", "a.png", "--opacity", "0.4", *words) == (0, [])
    glass = render_transparent(KNOT, camera, (64, 48), opacity=0.4, subpixel_bits=bits)
    assert np.array_equal(pixels("a.png"), glass)


@pytest.mark.parametrize("bits", ["17", "-1", "1.5", "Exact", ""])
def test_render_subpixel_bits_impossible_is_one_line(run, bits):
    line = f"topleft: argument --subpixel-bits: must be a whole number from 0 to 16, or exact, got {bits!r}"
    status, lines = run("render", "cube", "-o", "a.png", f"--subpixel-bits={bits}")
    assert (status, lines) == (2, [f"{line} (try: topleft render --help)"])


# Workers


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("meshes", [["torus-knot"], ["torus-knot", "cube", "torus"]])
def test_render_jobs_give_the_same_files(run, folder, jobs, meshes):
    assert run("render", *meshes, "-o", "p/", "--views", 3, "--jobs", jobs, *SMALL) == (0, [])
    assert len(names(folder)) == 3 * len(meshes)
    for i, expected in enumerate(knots(3)):
        assert np.array_equal(pixels(f"p/torus-knot-00{i}.png"), expected)


@pytest.mark.parametrize("jobs", [1, 2])
def test_render_jobs_go_on_after_a_failure_and_list_it_once(run, folder, jobs):
    (folder / "broken.obj").write_text("v 0 0 0\nf 1 2 3\n")
    status, lines = run("render", "cube", "broken.obj", "nope.ply", "-o", "p", "--views", 3, "--jobs", jobs, *SMALL)
    assert status == 1
    assert lines[0].startswith("topleft: cannot read 'broken.obj'")
    assert lines[1:] == ["topleft: there is no file 'nope.ply'", "topleft: 2 of 3 meshes failed: broken.obj nope.ply"]
    assert names(folder) == ["broken.obj", "p/cube-000.png", "p/cube-001.png", "p/cube-002.png"]


def test_render_resume_draws_what_is_missing(run, folder):
    assert run("render", "torus-knot", "-o", "p/", "--views", 3, *SMALL) == (0, [])
    (folder / "p/torus-knot-001.png").unlink()
    made = (folder / "p/torus-knot-002.png").stat().st_mtime_ns
    assert run("render", "torus-knot", "-o", "p/", "--views", 3, "--resume", *SMALL) == (0, [])
    assert np.array_equal(pixels("p/torus-knot-001.png"), knots(3)[1])
    assert (folder / "p/torus-knot-002.png").stat().st_mtime_ns == made


# Cameras


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("seed", range(5))
def test_orbit_frames_to_the_bit_as_framing_does(seed, dtype):
    rng = np.random.default_rng(seed)
    mesh = Mesh(rng.normal(size=(60, 3)).astype(dtype), rng.integers(0, 50, (40, 3)))
    for fit in ("silhouette", "sphere"):
        orbit = Orbit(30.0, -20.0, 35.0, "z", ortho=bool(seed % 2), fits=fit == "silhouette")
        expected = Camera.framing(
            mesh, azimuth_deg=30, elevation_deg=-20, fov_y_deg=35, up="z", ortho=bool(seed % 2), aspect=0.5, fit=fit
        )
        camera = orbit(mesh, (50, 100))
        assert np.array_equal(camera.clip_from_world((50, 100)), expected.clip_from_world((50, 100)))
    assert mesh.extreme_points().shape == (7, 3)


# Job files


TOML = """
size = [64, 48]
views = 3
[[job]]
mesh = "torus-knot"
out = "a/{view}.png"
[[job]]
mesh = ["cube", "torus"]
out = "b/"
views = 1
azimuth = -30.5
wireframe = true
layers = ["color", "triangle"]
"""


def test_job_file_is_what_it_says(run, folder):
    (folder / "jobs.toml").write_text(TOML)
    assert run("render", "--jobs-file", "jobs.toml") == (0, [])
    b = [f"b/{name}-{layer}.png" for name in ("cube", "torus") for layer in ("color", "triangle")]
    assert names(folder) == ["a/000.png", "a/001.png", "a/002.png", *b, "jobs.toml"]
    cube = shape_of("cube")
    camera = camera_of(cube, azimuth_deg=-30.5)
    assert np.array_equal(pixels("b/cube-color.png"), render(cube, camera, (64, 48), edges=True))


def test_job_file_json_is_the_same_as_toml(run, folder):
    document = {"job": [{"mesh": "cube", "size": [64, 48], "out": "a.png", "wireframe": False}]}
    (folder / "jobs.json").write_text(json.dumps(document))
    assert run("render", "--jobs-file", "jobs.json") == (0, [])
    assert np.array_equal(pixels("a.png"), first_picture("cube"))


@pytest.mark.parametrize("key", ["subpixel-bits", "subpixel_bits"])
@pytest.mark.parametrize("bits", [0, "exact"])
def test_job_file_subpixel_bits_reach_the_picture(run, folder, key, bits):
    document = {"size": "64x48", "job": [{"mesh": "torus-knot", key: bits}]}
    (folder / "jobs.json").write_text(json.dumps(document))
    assert run("render", "--jobs-file", "jobs.json", "-o", "a.npy", "--shading", "ids") == (0, [])
    expected = rasterize_mesh(KNOT, camera_of(KNOT), (64, 48), subpixel_bits=bits).triangle
    assert np.array_equal(np.load("a.npy"), expected)


def test_job_file_takes_from_the_command_line_what_it_does_not_say(run, folder):
    (folder / "jobs.json").write_text('{"size": "64x48", "job": [{"mesh": "cube"}]}')
    assert run("render", "--jobs-file", "jobs.json", "-o", "a.npy", "--size", "10x10", "--shading", "ids") == (0, [])
    assert (np.load("a.npy").shape, np.load("a.npy").dtype) == ((48, 64), np.int32)


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("jobs.txt", "", "topleft: a job file must end in .toml or .json, got 'jobs.txt'"),
        ("gone.toml", None, "topleft: No such file or directory: 'gone.toml'"),
        ("jobs.toml", "size = [", "topleft: cannot read 'jobs.toml': "),
        ("jobs.json", "{", "topleft: cannot read 'jobs.json': "),
        ("jobs.json", b"\xff", "topleft: cannot read 'jobs.json': "),
        ("jobs.json", "[" * 100_000, "topleft: cannot read 'jobs.json': it is nested too deeply"),
        ("jobs.toml", "a = " + "[" * 100_000, "topleft: cannot read 'jobs.toml': it is nested too deeply"),
        ("jobs.json", "[]", "topleft: 'jobs.json' must hold an object, got list"),
        ("jobs.json", "{}", "topleft: 'jobs.json' must have jobs: [[job]] in TOML, a list \"job\" of objects in JSON"),
    ],
)
def test_job_file_broken_is_one_line_and_status_2(run, folder, name, text, line):
    if text is not None:
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    status, lines = run("render", "--jobs-file", name, "-o", "p/")
    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith(line)


@pytest.mark.parametrize(
    ("job", "line"),
    [
        ('{"out": "a"}', "mesh must be a name or a list of"),
        ('{"mesh": [1]}', "mesh must be a name or a list of"),
        ('{"mesh": "cube", "colour": 1}', "there is no key 'colour'"),
        ('{"mesh": "cube", "size": [0]}', "argument --size: must be"),
        ('{"mesh": "cube", "ortho": 1}', "ortho must be true or fal"),
        ('{"mesh": "cube", "fov": {}}', "fov must be text, a number"),
        ('{"mesh": "cube", "jobs": 2}', "there is no key 'jobs'"),
    ],
)
def test_job_file_impossible_names_the_job(run, folder, job, line):
    (folder / "jobs.json").write_text('{"job": [{"mesh": "cube"}, ' + job + "]}")
    status, lines = run("render", "--jobs-file", "jobs.json", "-o", "p/")
    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith(f"topleft: 'jobs.json', job 2: {line}")


def test_job_file_and_meshes_are_refused(run):
    status, lines = run("render", "cube", "--jobs-file", "jobs.toml", "-o", "p/")
    assert (status, lines) == (2, ["topleft: a job file names its meshes itself: give MESH or --jobs-file, not both"])


def test_job_file_jobs_of_one_name_would_collide(run, folder):
    (folder / "jobs.json").write_text('{"out": "p/", "job": [{"mesh": "cube"}, {"mesh": "cube"}]}')
    status, lines = run("render", "--jobs-file", "jobs.json")
    assert status == 2
    assert "would both be written to 'p/cube.png'" in lines[0]


# Sheets


def test_sheet_shows_each_picture_in_its_place(run, folder):
    assert run("render", "torus-knot", "--sheet", "sheet.png", "--views", 5, "--size", "32x24") == (0, [])
    assert names(folder) == ["sheet.png"]
    sheet = pixels("sheet.png")
    assert sheet.shape == (8 + 2 * (24 + 8 + 16), 8 + 3 * (32 + 8), 3)
    for i, expected in enumerate(knots(5, (32, 24))):
        top, left = 8 + 48 * (i // 3), 8 + 40 * (i % 3)
        assert np.array_equal(sheet[top : top + 24, left : left + 32], expected[..., :3])


def test_sheet_of_several_meshes_has_a_row_for_each(run, folder):
    arguments = ["cube", "torus", "--sheet", "s.png", "--views", 3, "-o", "p/", "--layers", "color,triangle", *SMALL]
    assert run("render", *arguments) == (0, [])
    assert len(names(folder)) == 13
    assert pixels("s.png").shape == (8 + 2 * (48 + 24), 8 + 3 * (64 + 8), 3)
    assert np.array_equal(pixels("s.png")[8 + 72 : 8 + 72 + 48, 8 : 8 + 64], pixels("p/torus-000-color.png")[..., :3])


def test_sheet_reduces_large_pictures(tmp_path):
    Image.new("RGBA", (1000, 500), (200, 0, 0, 255)).save(tmp_path / "a.png")
    sheet = make_sheet([[tmp_path / "a.png"]], ["a"])
    assert sheet.shape == (8 + 128 + 24, 8 + 256 + 8, 3)
    assert sheet[8 + 64, 8 + 128].tolist() == [200, 0, 0]


def test_sheet_of_pictures_of_many_sizes_keeps_them_apart(tmp_path):
    sizes = {"a": (60, 12), "b": (20, 40)}
    for name, size in sizes.items():
        Image.new("RGBA", size, (200, 0, 0, 255)).save(tmp_path / f"{name}.png")
    sheet = make_sheet([[tmp_path / f"{name}.png"] for name in sizes], ["", ""])
    assert sheet.shape == (8 + 40 + 24, 8 + 2 * (60 + 8), 3)
    expected = np.full(sheet.shape, 255, np.uint8)
    expected[8 + 14 : 8 + 26, 8:68] = expected[8:48, 76 + 20 : 76 + 40] = [200, 0, 0]
    assert np.array_equal(sheet, expected)


def test_sheet_of_several_meshes_has_one_background(run, folder):
    for name, color in (("a", "1 1 1"), ("b", "1 0 0")):
        rows = "".join(f"v {corner} {color}\n" for corner in ("0 0 0", "1 0 0", "0 1 0"))
        (folder / f"{name}.obj").write_text(rows + "f 1 2 3\n")
    assert run("render", "a.obj", "b.obj", "--sheet", "s.png", *SMALL) == (0, [])
    sheet = pixels("s.png")
    assert sheet[8, 8].tolist() == sheet[8, 8 + 72].tolist() == [196, 212, 232]


def test_sheet_names_meshes_of_one_stem_by_their_folders():
    groups = [MeshJobs(f"{name}/model.obj", f"model-{name}", ()) for name in "ab"] + [MeshJobs("c.obj", "c", ())]
    assert captions_of(groups) == ["a/model.obj", "b/model.obj", "c"]


def test_sheet_cuts_long_captions_in_front(tmp_path):
    Image.new("RGBA", (60, 12), (200, 0, 0, 255)).save(tmp_path / "a.png")
    sheet = make_sheet([[tmp_path / "a.png"]] * 2, ["a very long name of a mesh.obj", ""])
    assert (sheet[20:, :68] != 255).any()
    assert (sheet[20:, 72:] == 255).all()


def test_sheet_leaves_room_for_what_failed(run, folder):
    status, _ = run("render", "cube", "nope.obj", "--sheet", "sheet.png", *SMALL)
    assert status == 1
    sheet = pixels("sheet.png")
    assert sheet.shape == (8 + 48 + 24, 8 + 2 * (64 + 8), 3)
    assert (sheet[8:56, 8:72] != 255).any()
    reason = sheet[8:56, 80:144]
    assert (reason[..., 0] > reason[..., 1]).any()  # red words
    assert (reason[:, 62:] == sheet[8, 8]).all()  # the background of the pictures


def test_sheet_tells_what_failed_in_its_own_row(run, folder):
    status, _ = run("render", "nope.obj", "cube", "gone.obj", "--sheet", "sheet.png", *SMALL, "--views", "2")
    assert status == 1
    sheet = pixels("sheet.png").astype(int)
    step = 48 + 24  # a picture, the gap and the caption
    for k in (0, 2):
        row = sheet[8 + k * step : 56 + k * step]
        assert (row[..., 0] - row[..., 1] > 60).any()  # red words


def test_sheet_wraps_reasons_and_cuts_long_words():
    assert wrapped("no such file 'abcdefghijklm'", 10, len) == ["no such", "file", "'abcdefghi", "jklm'"]
    assert wrapped("", 10, len) == []


@pytest.mark.parametrize("jobs", [1, 2])
def test_report_tells_each_picture(run, folder, jobs):
    (folder / "a.obj").write_text("mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    arguments = ["-o", "p/", "--report", "r/report.json", "--jobs", jobs, *SMALL]
    assert run("render", "cube", "nope.obj", "a.obj", *arguments)[0] == 1
    report = json.loads((folder / "r/report.json").read_text())
    assert [report[name] for name in ("written", "skipped", "failed")] == [2, 0, 1]
    cube, nope, a = report["pictures"]
    assert (cube["mesh"], cube["status"], cube["files"]) == ("cube", "written", ["p/cube.png"])
    assert (cube["size"], cube["bytes"]) == ([64, 48], (folder / "p/cube.png").stat().st_size)
    assert cube["seconds"] > 0
    assert (nope["status"], nope["error"], nope["files"]) == ("failed", "there is no file 'nope.obj'", [])
    assert a["warnings"] == ["'a.obj': material libraries not found: 'gone.mtl'"]
    run("render", "cube", *arguments, "--resume")
    assert json.loads((folder / "r/report.json").read_text())["skipped"] == 1


def test_report_that_is_no_json_file_is_refused(run):
    status, lines = run("render", "cube", "-o", "a.png", "--report", "r.txt")
    assert (status, lines) == (2, ["topleft: --report must be a file of this machine that ends in .json, got 'r.txt'"])


def test_warnings_all_are_told_line_by_line(run, folder):
    meshes = [f"{i}.obj" for i in range(10)]
    for mesh in meshes:
        (folder / mesh).write_text("mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    lines = run("render", *meshes, "-o", "p/", *SMALL)[1]
    assert len(lines) == 1
    assert lines[0].endswith("; and 2 more (--warnings all)")
    lines = run("render", *meshes, "-o", "p/", "--warnings", "all", *SMALL)[1]
    assert lines == [f"topleft: '{i}.obj': material libraries not found: 'gone.mtl'" for i in range(10)]


def test_error_of_the_library_ends_no_batch(run, folder, monkeypatch):
    """What no file should cause is told with its kind; alone it is raised, for its trace."""
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

    def broken(*_, **__):
        raise KeyError("lost")

    monkeypatch.setattr("topleft._apps.cli.targets.load", broken)
    status, lines = run("render", "a.obj", "cube", "-o", "p/", *SMALL)
    assert (status, lines) == (1, ["topleft: a.obj: KeyError: 'lost'", "topleft: 1 of 2 meshes failed: a.obj"])
    with pytest.raises(KeyError, match="lost"):
        run("render", "a.obj", "-o", "p/", *SMALL)


# Animations


@pytest.mark.parametrize(("suffix", "kind"), [("apng", "PNG"), ("webp", "WEBP"), ("gif", "GIF")])
def test_animation_shows_all_views(run, folder, suffix, kind):
    arguments = ["--animation", f"a.{suffix}", "--views", 5, "--fps", 10, *SMALL]
    assert run("render", "torus-knot", *arguments) == (0, [])
    assert names(folder) == [f"a.{suffix}"]
    with Image.open(f"a.{suffix}") as image:
        assert (image.format, image.n_frames, image.info.get("loop", 0)) == (kind, 5, 0)
        for i, expected in enumerate(knots(5)):
            image.seek(i)
            found = np.asarray(image.convert("RGBA"))
            assert image.info["duration"] == 100
            if suffix == "gif":  # 255 colours for all
                assert abs(found.astype(int) - expected).mean() < 2
            else:
                assert np.array_equal(found, expected)


def test_animation_gif_keeps_what_is_transparent(run):
    options = ["--background", "transparent", "--sampling", "center"]
    arguments = ["--animation", "a.gif", "--views", 3, *options, *SMALL]
    assert run("render", "torus-knot", *arguments) == (0, [])
    with Image.open("a.gif") as image:
        for i, expected in enumerate(knots(3, sampling="center")):
            image.seek(i)
            is_clear = np.asarray(image.convert("RGBA"))[..., 3] == 0
            assert np.array_equal(is_clear, (expected == 255).all(-1))


def test_animation_of_several_meshes_is_one_for_each(run, folder):
    arguments = ["--animation", "{name}.webp", "-o", "p/", "--views", 2, *SMALL]
    assert run("render", "cube", "torus", *arguments) == (0, [])
    assert [name for name in names(folder) if name.endswith("webp")] == ["cube.webp", "torus.webp"]


def moving(folder, is_camera_there=False):
    """A triangle that goes 3 to the right in half a second; a second clip turns it over for one second."""
    camera = {"type": "orthographic", "orthographic": {"xmag": 4, "ymag": 4, "znear": 1, "zfar": 9}}
    file = GltfFile(cameras=[camera]) if is_camera_there else GltfFile()
    file.shown()
    if is_camera_there:
        file.node(camera=0, translation=[0, 0, 5])
    keys = {"translation": ([0.0, 0.5], [[0.0, 0, 0], [3, 0, 0]]), "scale": ([0.0, 1.0], [[1.0, 1, 1], [1, -1, 1]])}
    for path, (times, values) in keys.items():
        sampler = {"input": file.accessor(times), "output": file.accessor(values)}
        channel = {"sampler": 0, "target": {"node": 0, "path": path}}
        file.add("animations", {"name": path, "samplers": [sampler], "channels": [channel]})
    (folder / "a.glb").write_bytes(file.glb())


@pytest.mark.parametrize(("clip", "n"), [((), 6), (("--clip", "translation"), 6), (("--clip", 1), 11)])
def test_animation_of_an_animated_file_shows_its_clip(run, folder, clip, n):
    moving(folder)
    look = ["--fps", 10, "--background", "transparent", "--cull", "none"]
    assert run("render", "a.glb", "--animation", "a.apng", "-o", "p/", *look, *clip, *SMALL)[0] == 0
    assert names(folder) == ["a.apng", "a.glb", *(f"p/a-{i:03d}.png" for i in range(n))]
    frames = [pixels(f"p/a-{i:03d}.png") for i in range(n)]
    assert len({frame.tobytes() for frame in frames}) == n
    assert not any(frame[..., 3][edge].any() for frame in frames for edge in (0, -1, (..., 0), (..., -1)))
    with Image.open("a.apng") as image:
        assert image.n_frames == n


def test_animation_of_a_clip_is_the_file_at_its_times(run, folder):
    moving(folder, is_camera_there=True)
    look = ["--camera", 0, "--clip", 0, *SMALL]
    assert run("render", "a.glb", "--animation", "a.apng", "-o", "p/", "--fps", 10, *look) == (0, [])
    for i in range(6):
        assert run("render", "a.glb", "--time", i / 10, "-o", "b.png", *look) == (0, [])
        assert np.array_equal(pixels(f"p/a-{i:03d}.png"), pixels("b.png"))


@pytest.mark.parametrize("still", [("--views", 2), ("--views", 2, "--time", 0.5)])
def test_animation_of_several_views_of_an_animated_file_is_an_orbit(run, folder, still):
    moving(folder)
    assert run("render", "a.glb", "--animation", "a.apng", *still, *SMALL)[0] == 0
    with Image.open("a.apng") as image:
        assert image.n_frames == 2


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--clip", "x"], "clip must be 0 to 1, or one of 'translation', 'scale', got 'x'"),
        (["--clip", 0, "--views", 2], "topleft: --clip needs --time: which second of it, or --animation without"),
    ],
)
def test_animation_of_no_such_clip_is_one_line_and_status_2(run, folder, arguments, line):
    moving(folder)
    status, lines = run("render", "a.glb", "--animation", "a.gif", *arguments, *SMALL)
    assert (status, len(lines)) == (2, 1)
    assert line in lines[0]


def test_animation_of_endless_keys_is_refused(run, folder):
    file = GltfFile().shown()
    sampler = {"input": file.accessor([0.0, 1e30]), "output": file.accessor([[0.0, 0, 0], [3, 0, 0]])}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    file.add("animations", {"samplers": [sampler], "channels": [channel]})
    (folder / "a.glb").write_bytes(file.glb())
    status, lines = run("render", "a.glb", "--animation", "a.gif", *SMALL)
    assert status == 2
    assert "frames, more than 100,000: lower --fps" in lines[0]


def test_animation_of_a_mesh_that_failed_is_left_out(run, folder):
    assert run("render", "cube", "nope.obj", "--animation", "{name}.gif", "--views", 2, *SMALL)[0] == 1
    assert names(folder) == ["cube.gif"]


def test_video_is_handed_to_ffmpeg(run, folder, ffmpeg):
    arguments = ["--animation", "v/a.mp4", "--views", 3, "--fps", 12.5, "--size", "33x25"]
    assert run("render", "torus-knot", *arguments) == (0, [])
    command, n_bytes = json.loads(ffmpeg.read_text())
    assert n_bytes == 3 * 33 * 25 * 3
    assert command[command.index("-s") + 1] == "33x25"
    assert command[command.index("-r") + 1] == "12.5"
    expected = b"".join(picture[..., :3].tobytes() for picture in knots(3, (33, 25)))
    assert (folder / "v/a.mp4").read_bytes() == expected
    assert names(folder) == ["told.json", "tools/ffmpeg", "v/a.mp4"]


def test_video_that_fails_leaves_no_file(run, folder, ffmpeg, monkeypatch):
    monkeypatch.setenv("FAIL", "1")
    status, lines = run("render", "cube", "--animation", "a.mp4", "--views", 2, *SMALL)
    assert (status, lines) == (2, ["topleft: ffmpeg could not write 'a.mp4': Unknown encoder"])
    assert names(folder) == ["tools/ffmpeg"]


def test_video_without_ffmpeg_gives_the_hint_before_any_work(run, folder, monkeypatch):
    monkeypatch.setenv("PATH", str(folder))
    status, lines = run("render", "cube", "--animation", "a.mp4", "-o", "p/", *SMALL)
    hint = "topleft: .mp4 needs ffmpeg, which is not installed (https://ffmpeg.org); .gif, .webp and .apng do without"
    assert (status, lines) == (2, [hint])
    assert names(folder) == []


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--animation", "a.avi"], "topleft: an animation must end in one of .gif .webp .apng .mp4 .mkv .mov .w"),
        (["torus", "--animation", "a.gif"], "topleft: several meshes need {name} in --animation, got 'a.gif'"),
        (["--sheet", "a.gif"], "topleft: --sheet must end in one of .png .jpg .jpeg .webp .tif .tiff, got 'a.gif'"),
        (["--sheet", "a.png", "-o", "a.npz"], "topleft: --sheet and --animation need pictures: OUT must end in one of"),
        (["--sheet", "a.png", "-o", "p/", "--layers", "uv"], "topleft: --sheet and --animation show the layer color"),
        (["--sheet", "p/cube.png", "-o", "p/"], "topleft: 'cube' and 'p/cube.png' would both be written to"),
        (["-o", "p/", "--layers", "ids"], "topleft: argument --layers: layers must be some of color, alpha,"),
        (["-o", "p/", "--layers", "flow"], "topleft: argument --layers: layer 'flow' needs two cameras"),
        (["-o", "p/", "--fps", "0"], "topleft: argument --fps: must be a number from 0.1 to 100, got '0'"),
        (["-o", "p/" * 2000 + "a.png"], "topleft: OUT must lie in at most 200 folders, got 2000"),
        (["-o", "p/", "--views", "1000000000"], "topleft: argument --views: must be at most 100000, got 1,000,000,000"),
        (["-o", "p/", "--views", "9" * 4000], "topleft: argument --views: is too large"),
        (["-o", "p/", "--jobs", "0"], "topleft: argument --jobs: must be a positive whole number, got '0'"),
    ],
)
def test_many_impossible_is_one_line_and_status_2(run, folder, arguments, line):
    status, lines = run("render", "cube", *arguments, *SMALL)
    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith(line)
    assert names(folder) == []


def test_palette_of_an_animation_is_one_for_all_frames():
    frames = [Image.fromarray(picture) for picture in knots(4)]
    palettes = {bytes(frame.getpalette()) for frame in animation._in_palette(frames)}
    assert len(palettes) == 1


# Interrupts


def topleft_with(method):
    """What of Python's command line is topleft, its processes started by a method: the default changed with 3.14."""
    if method is None:
        return ["-m", "topleft"]
    start = f"import multiprocessing, sys; multiprocessing.set_start_method({method!r})"
    return ["-c", f"{start}; from topleft._apps.cli import main; sys.exit(main())"]


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")
@pytest.mark.parametrize(("jobs", "method"), [(1, None), (2, "fork"), (2, "spawn")])
def test_render_interrupted_leaves_whole_files_and_goes_on_with_resume(run, folder, jobs, method):
    meshes = ["octahedron", "tetrahedron"]
    options = ["--jobs", str(jobs), "-o", "p/", "--shading", "ids", *SMALL]
    command = [sys.executable, *topleft_with(method), "render", *meshes, *options, "--views", "5000"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        for _ in range(20_000):  # not by the clock: a machine may stand still
            if len(list(folder.glob("p/[!.]*.png"))) >= 3 or process.poll() is not None:
                break
            time.sleep(0.002)
        os.killpg(process.pid, signal.SIGINT)
        assert process.stderr.read() == "topleft: interrupted\n"
    assert process.returncode == 130
    left = names(folder)
    assert 3 <= len(left) < 5000 * len(meshes)
    for name in left:  # whole, and nothing else
        assert pixels(name).shape == (48, 64, 4)
    (folder / left[0]).write_text("another")
    assert run("render", *meshes, *options, "--views", "40", "--resume") == (0, [])
    wanted = {f"p/{mesh}-{i:03}.png" for mesh in meshes for i in range(40)}
    assert set(names(folder)) == wanted | set(left)
    assert pixels(left[0]).shape == (48, 64, 4)


def children_of(pid):
    command, plain = ["ps", "-o", "pid=", "--ppid", str(pid)], {"PATH": os.environ["PATH"]}  # no sanitizer preloaded
    found = subprocess.run(command, capture_output=True, text=True, check=False, env=plain)
    return [int(line) for line in found.stdout.split()]


def workers_of(pid):
    """The processes that draw: not what multiprocessing has beside them, nor a server that they are forked from."""
    children = [child for child in children_of(pid) if "resource_tracker" not in words_of(child)]
    return [worker for child in children for worker in workers_of(child) or [child]]


def words_of(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""


def is_running(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@contextlib.contextmanager
def many_pictures(folder, method=None):
    """A run with two processes, once it has begun to write."""
    options = ["octahedron", "tetrahedron", "--jobs", "2", "-o", "p/", *SMALL, "--views", "4000"]
    command = [sys.executable, *topleft_with(method), "render", *options]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        for _ in range(20_000):
            if len(list(folder.glob("p/[!.]*.png"))) >= 3 or process.poll() is not None:
                break
            time.sleep(0.002)
        yield process
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


ENDS = [("SIGTERM", None), *(("SIGKILL", method) for method in get_all_start_methods())]


@pytest.mark.skipif(not pathlib.Path("/proc/self/stat").exists(), reason="needs /proc")
@pytest.mark.parametrize(("name", "method"), ENDS)
def test_render_killed_takes_its_workers_along(folder, name, method):
    with many_pictures(folder, method) as run:
        workers = workers_of(run.pid)
        assert len(workers) >= 2
        run.send_signal(signal.Signals[name])
        words = run.stderr.read()  # ends when nobody has it open
        for _ in range(500):
            if not any(map(is_running, workers)):
                break
            time.sleep(0.01)
        assert not any(map(is_running, workers))
        if name == "SIGTERM":
            assert (run.wait(), words) == (143, "topleft: terminated\n")


@pytest.mark.skipif(not pathlib.Path("/proc/self/stat").exists(), reason="needs /proc")
def test_render_whose_worker_is_killed_says_so_in_one_line(folder):
    with many_pictures(folder) as run:
        os.kill(workers_of(run.pid)[0], signal.SIGKILL)
        assert run.stderr.read() == (
            "topleft: a process that draws was killed, maybe for want of memory: try fewer --jobs, then --resume\n"
        )
        assert run.wait() == 1


def test_render_removes_what_killed_runs_have_left_of_its_files(run, folder):
    (folder / "p").mkdir()
    old, young, other = (folder / "p" / f".{name}.part" for name in ("cube.png.0123abcd", "cube.png.ffff0000", "x.y"))
    for file in (old, young, other):
        file.write_bytes(b"half")
    for file in (old, other):
        os.utime(file, (0, 0))
    assert run("render", "cube", "-o", "p/", *SMALL) == (0, [])
    assert sorted(path.name for path in (folder / "p").iterdir()) == [
        ".cube.png.ffff0000.part",
        ".x.y.part",
        "cube.png",
    ]
