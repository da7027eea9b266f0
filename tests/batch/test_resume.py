"""Batches that go on: what is left out was made of equal input, all else is drawn again."""

import functools
import os
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from batch_jobs import BOX, SIZE
from PIL import Image

import topleft as tl
from topleft._apps.batch.jobs import JobRunner
from topleft._apps.cli import main

BASE = {"scene": BOX, "camera": None, "size": SIZE, "options": {"color": "gold"}, "layers": ()}
CAMERA = tl.Camera.framing(BOX, azimuth_deg=10)
SUFFIXES = ("png", "jpg", "webp", "tif", "npy", "npz")


def triangle(path, x):
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"mtllib m.mtl\nv 0 0 0\nv {x} 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n")
    return path


def skipped(jobs, **options):
    return [result.is_skipped for result in tl.render_batch(jobs, resume=True, **options)]


def test_command_resumes_by_content_and_not_by_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for i, name in enumerate("abc"):
        triangle(tmp_path / name / "model.obj", 0.4 + 0.3 * i)
    how = ["-o", "out/", "--size", "40x30"]
    assert main(["render", "b/model.obj", "c/model.obj", *how]) == 0
    assert main(["render", "a/model.obj", "b/model.obj", "c/model.obj", *how, "--resume"]) == 0
    found = [np.asarray(Image.open(f"out/model{end}.png")) for end in ("", "-2", "-3")]
    for name, picture in zip("abc", found, strict=True):
        assert main(["render", f"{name}/model.obj", "-o", "one.png", "--size", "40x30"]) == 0
        assert np.array_equal(np.asarray(Image.open("one.png")), picture)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_resume_knows_each_format(tmp_path, suffix):
    destination = tmp_path / f"a.{suffix}"
    tl.render_batch([tl.Job(**BASE, destination=destination)]).finish()
    before = destination.read_bytes()
    assert skipped([tl.Job(**BASE, destination=destination)]) == [True]
    assert skipped([tl.Job(**{**BASE, "size": (41, 30)}, destination=destination)]) == [False]
    destination.write_bytes(before[:60])
    assert skipped([tl.Job(**BASE, destination=destination)]) == [False]
    destination.unlink()
    assert skipped([tl.Job(**BASE, destination=destination)]) == [False]
    assert destination.read_bytes() == before


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_record_leaves_the_picture_readable(tmp_path, suffix):
    tl.render_batch([tl.Job(**BASE, destination=tmp_path / f"a.{suffix}")]).finish()
    tl.save_image(tmp_path / f"b.{suffix}", tl.render(BOX, None, SIZE, color="gold"))
    a, b = tmp_path / f"a.{suffix}", tmp_path / f"b.{suffix}"
    if suffix == "npz":
        assert np.array_equal(np.load(a)["image"], np.load(b)["image"])
    else:
        pictures = [np.load(path) if suffix == "npy" else np.asarray(Image.open(path)) for path in (a, b)]
        assert np.array_equal(*pictures)


@pytest.mark.parametrize(
    "change",
    [
        {"scene": tl.Mesh(BOX.vertices * np.float32(1.25), BOX.triangles)},
        {"scene": tl.Scene([BOX, BOX])},
        {"camera": CAMERA},
        {"size": (30, 40)},
        {"options": {"color": "red"}},
        {"options": {"color": "gold", "lights": [tl.Light((0, 0, 1))]}},
        {"options": {"color": "gold", "matcap": tl.Texture(np.zeros((2, 2, 3), np.uint8))}},
        {"layers": ("triangle",)},
    ],
)
def test_resume_sees_a_change(tmp_path, change):
    tl.render_batch([tl.Job(**BASE, destination=tmp_path / "a.tif")]).finish()
    changed = tl.Job(**{**BASE, **change}, destination=tmp_path / "a.tif")
    assert skipped([changed]) == [False]
    assert skipped([changed]) == [True]


@pytest.mark.filterwarnings("ignore::topleft.errors.MeshWarning")
def test_resume_sees_files_that_a_mesh_names_change_come_and_go(tmp_path):
    job = tl.Job(triangle(tmp_path / "m/a.obj", 1), None, SIZE, destination=tmp_path / "a.png")
    assert skipped([job]) == [False]
    library, texture = tmp_path / "m/m.mtl", tmp_path / "m/t.png"
    changes = [
        lambda: library.write_text("newmtl m\nmap_Kd t.png\n"),
        lambda: texture.write_bytes(b"broken"),
        lambda: tl.save_image(texture, np.zeros((2, 2, 3), np.uint8)),
        lambda: library.write_text("newmtl m\nKd 1 0 0\n"),
        library.unlink,
    ]
    for change in changes:
        assert skipped([job]) == [True]
        change()
        assert skipped([job]) == [False]


def test_resume_is_the_same_by_processes_and_levels(tmp_path):
    options = {"tolerance": 1.0}
    jobs = [tl.Job(BOX, CAMERA, SIZE, options, tmp_path / f"{i}.png") for i in range(2)]
    with ProcessPoolExecutor(1) as pool:
        tl.render_batch(jobs, executor=pool).finish()
        assert skipped(jobs, executor=pool) == [True, True]
    assert skipped(jobs) == [True, True]


def test_resume_takes_meshes_of_other_libraries_by_content(tmp_path):
    pair = (BOX.vertices, BOX.triangles)
    job = tl.Job(pair, None, SIZE, {"threads": 1}, tmp_path / "a.png")
    assert skipped([job, tl.Job(pair, None, SIZE, {"threads": 2}, tmp_path / "a.png")]) == [False, True]
    assert skipped([tl.Job((pair[0] * 2, pair[1]), None, SIZE, {}, tmp_path / "a.png")]) == [False]


def camera_of(azimuth_deg, mesh, size):
    return tl.Camera.framing(mesh, azimuth_deg=azimuth_deg, aspect=size[0] / size[1])


def test_resume_takes_functions_by_code_and_what_they_hold(tmp_path):
    def job(camera):
        return tl.Job(BOX, camera, SIZE, {}, tmp_path / "a.png")

    def turned(angle):
        return lambda mesh, size: camera_of(angle, mesh, size)

    tried = [
        functools.partial(camera_of, 10), functools.partial(camera_of, 10), functools.partial(camera_of, 20),
        turned(20), turned(20), turned(21), lambda mesh, size: camera_of(21, mesh, size),
    ]  # fmt: skip
    assert [skipped([job(camera)])[0] for camera in tried] == [False, True, False, False, True, False, False]


def test_resume_draws_again_what_it_cannot_compare(tmp_path):
    class Odd:
        def __call__(self, mesh, size):
            return camera_of(0, mesh, size)

    job = tl.Job(BOX, Odd(), SIZE, {}, tmp_path / "a.png")
    assert skipped([job]) == [False]
    assert skipped([job]) == [False]


def test_record_has_no_path_of_the_machine(tmp_path):
    job = tl.Job(triangle(tmp_path / "a/m.obj", 1), None, SIZE, {}, tmp_path / "a.png")
    with pytest.warns(tl.errors.MeshWarning):
        tl.render_batch([job]).finish()
    assert os.fsencode(tmp_path) not in (tmp_path / "a.png").read_bytes()
    assert JobRunner().is_done(job)


@pytest.mark.parametrize(
    "record", ["[1, 2]", "[[", "[" * 5000, '["00", "\\ud800"]', "[]", '["a", 2]', "{}", '["00", "../../../etc/passwd"]']
)
def test_resume_draws_over_a_record_that_it_has_not_written(tmp_path, record):
    path = tmp_path / "a.npy"
    path.write_bytes(b"\x93NUMPY topleft:made " + record.encode())
    assert skipped([tl.Job(**BASE, destination=str(path))]) == [False]
    assert skipped([tl.Job(**BASE, destination=str(path))]) == [True]
