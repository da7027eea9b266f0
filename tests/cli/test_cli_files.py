"""The command line and batches: what meshes lack of their files is told once, and cameras of files are used."""

import json
import os
import warnings
import zipfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from gltf_files import QUAD, GltfFile
from PIL import Image

import topleft as tl
from topleft.errors import MeshWarning

SMALL = ["--size", "64x48"]
OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"


@pytest.fixture
def lacking(folder):
    """Two files that lack something, and one that does not."""
    (folder / "a.mtl").write_text("newmtl m\nmap_Kd gone.png\n")
    (folder / "a.obj").write_text("mtllib a.mtl\n" + OBJ)
    (folder / "b.obj").write_text("mtllib b.mtl\n" + OBJ)
    (folder / "c.obj").write_text(OBJ.replace("usemtl m\n", ""))
    return folder


def test_render_tells_what_a_mesh_lacks_in_one_line(run, lacking):
    expected = "topleft: 'a.obj': textures not found: 'gone.png'"
    assert run("render", "a.obj", "-o", "a.png", *SMALL) == (0, [expected])
    assert run("render", "a.obj", "-o", "a.png", "--views", "3", *SMALL) == (0, [expected])
    assert (lacking / "a.png").is_file()


@pytest.mark.parametrize("n", ["1", "2"])
def test_render_tells_it_once_for_all_meshes(run, lacking, n):
    status, lines = run("render", "a.obj", "b.obj", "c.obj", "--jobs", n, "-o", "out/", *SMALL)
    assert (status, len(lines)) == (0, 1)
    assert "'a.obj': textures not found: 'gone.png'" in lines[0]
    assert "'b.obj': material libraries not found: 'b.mtl'" in lines[0]


def test_render_strict_exits_with_1_after_the_picture(run, lacking):
    assert run("render", "a.obj", "-o", "a.png", "--strict", *SMALL)[0] == 1
    assert (lacking / "a.png").is_file()
    assert run("render", "c.obj", "-o", "c.png", "--strict", *SMALL) == (0, [])


def test_render_strict_lets_an_animated_file_stand_at_rest(run, folder, lacking):
    file = GltfFile(animations=[{"channels": [], "samplers": []}])
    file.shown(QUAD, [0, 1, 2, 0, 2, 3])
    (folder / "a.glb").write_bytes(file.glb())
    said = "topleft: 'a.glb': animations not played: everything is at rest"
    assert run("render", "a.glb", "-o", "a.png", "--strict", *SMALL) == (0, [said])
    assert run("render", "a.glb", "a.obj", "-o", "p/", "--strict", *SMALL)[0] == 1


@pytest.mark.parametrize("strict", [[], ["--strict"]])
def test_render_broken_member_of_an_archive_is_exit_1(run, folder, strict):
    with zipfile.ZipFile(folder / "a.zip", "w") as archive:
        archive.writestr("whole.obj", OBJ.replace("usemtl m\n", ""))
        archive.writestr("broken.obj", "v 0 0 0\nf 1 2 3\n")
    status, (said,) = run("render", "a.zip", "-o", "a.png", *strict, *SMALL)
    assert status == 1
    assert said.startswith("topleft: 'a.zip': members of its archive left out: \"broken.obj")
    assert (folder / "a.png").is_file()


@pytest.mark.parametrize("by", ["option", "job file"])
def test_render_root_lets_meshes_name_files_beside_their_folder(run, folder, by):
    (folder / "mesh").mkdir()
    (folder / "mesh/a.obj").write_text("mtllib ../a.mtl\n" + OBJ)
    (folder / "a.mtl").write_text("newmtl m\nKd 1 0 0\n")
    (folder / "jobs.toml").write_text('root = "."\n[[job]]\nmesh = "mesh/a.obj"\nout = "b.png"\n')
    assert len(run("render", "mesh/a.obj", "-o", "a.png", *SMALL)[1]) == 1
    how = ["mesh/a.obj", "--root", ".", "-o", "b.png"] if by == "option" else ["--jobs-file", "jobs.toml"]
    assert run("render", *how, *SMALL) == (0, [])
    assert np.asarray(Image.open("b.png"))[24, 40].tolist() != np.asarray(Image.open("a.png"))[24, 40].tolist()


def test_render_distances_are_steps_of_the_depth_scale_and_resume(run, folder):
    (folder / "mm.obj").write_text("v -50 -50 0\nv 50 -50 0\nv 0 50 0\nf 1 2 3\n")
    how = ["render", "mm.obj", "-o", "{layer}.png", "--layers", "distance", "--report", "r.json", *SMALL]
    status, (said,) = run(*how)
    assert (status, "distance must lie in 0 to 65535 steps of 0.001 for a PNG" in said) == (2, True)
    assert run(*how, "--depth-scale", "1") == (0, [])
    assert run("render", "mm.obj", "-o", "{layer}.npy", "--layers", "distance", *SMALL) == (0, [])
    found, wished = np.asarray(Image.open("distance.png")), np.load("distance.npy")
    assert np.array_equal(found, np.where(np.isfinite(wished), np.rint(wished), 0))
    for scale, n_skipped in (("1", 1), ("0.5", 0)):
        assert run(*how, "--depth-scale", scale, "--resume") == (0, [])
        assert json.loads((folder / "r.json").read_text())["skipped"] == n_skipped
    assert np.abs(np.asarray(Image.open("distance.png")) / 2 - found).max() <= 0.5


def test_render_size_of_one_number_is_a_square(run, folder):
    assert run("render", "cube", "-o", "a.png", "--size", "64") == (0, [])
    assert Image.open("a.png").size == (64, 64)


def test_explain_tells_what_a_mesh_lacks(run, lacking):
    status, lines = run("explain", "a.obj")
    assert (status, lines) == (0, ["topleft: 'a.obj': textures not found: 'gone.png'"])


def test_render_camera_of_the_file(run, folder):
    file = GltfFile(cameras=[{"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}])
    file.shown(QUAD, [0, 1, 2, 0, 2, 3])
    file.node(camera=0, translation=[0, 0, 1])
    (folder / "a.glb").write_bytes(file.glb())
    assert run("render", "a.glb", "-o", "a.npy", "--camera", "0", "--shading", "ids", "--size", "40x40") == (0, [])
    seen = np.load("a.npy") >= 0
    assert seen[:20, 20:].all()
    assert seen.sum() == 400
    expected = "topleft: --camera 1: 'a.glb' has 1 cameras"
    assert run("render", "a.glb", "-o", "a.png", "--camera", "1") == (2, [expected])
    assert run("render", "cube", "-o", "a.png", "--camera", "0")[1] == ["topleft: --camera 0: 'cube' has 0 cameras"]
    assert (
        "--camera does not go with --views" in run("render", "a.glb", "-o", "b/", "--camera", "0", "--views", "2")[1][0]
    )


@pytest.mark.parametrize("texture", ["bomb", "text", "pipe"])
def test_render_texture_that_cannot_be_read_is_told_in_one_line(run, folder, texture):
    (folder / "c.obj").write_text(OBJ)
    match texture:
        case "bomb":
            Image.new("L", (20_000, 10_000)).save("bomb", format="PNG")
        case "text":
            (folder / "text").write_text("no picture")
        case _:
            os.mkfifo("pipe")
    os.rename(texture, "t.png")
    status, lines = run("render", "c.obj", "-o", "c.png", "--texture", "t.png", *SMALL)
    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith("topleft: cannot read 't.png': it is ")


@pytest.mark.parametrize("executor", [None, 2, "processes"])
def test_batch_results_carry_warnings_and_warn_once(lacking, executor):
    jobs = [tl.Job(name, None, (16, 16)) for name in ("a.obj", "a.obj", "c.obj")]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        if executor == "processes":
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                results = list(tl.render_batch(jobs, executor=pool))
        else:
            results = list(tl.render_batch(jobs, executor=executor))
    line = "'a.obj': textures not found: 'gone.png'"
    assert [result.warnings for result in results] == [(line,), (line,), ()]
    assert [(each.category, str(each.message)) for each in told] == [(MeshWarning, line)]


def test_explain_of_points_is_refused(run, folder):
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\n")
    assert run("explain", "a.obj") == (2, ["topleft: 'a.obj' holds points: plans are of triangles"])
    assert run("render", "a.obj", "-o", "a.png", *SMALL) == (0, [])
