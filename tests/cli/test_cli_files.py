"""The command line and batches: what meshes lack of their files is told once, and cameras of files are used."""

import os
import warnings
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
