"""`topleft bake`."""

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft.cli import main

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"


@pytest.fixture
def square(tmp_path):
    path = tmp_path / "square.obj"
    path.write_text(SQUARE)
    return path


def test_normals_are_written_as_a_normal_map(square, tmp_path):
    out = tmp_path / "out" / "normals.png"
    assert main(["bake", str(square), "-o", str(out), "--size", "8x4"]) == 0
    picture = np.asarray(Image.open(out))
    assert picture.shape[:2] == (4, 8)
    assert (picture[..., :3] == [128, 128, 255]).all()


def test_values_are_written_as_they_are(square, tmp_path):
    out = tmp_path / "position.npy"
    assert main(["bake", str(square), "-o", str(out), "--what", "position", "--size", "8x4", "--rule", "area"]) == 0
    assert np.array_equal(np.load(out), tl.bake(tl.load(square), "position", (8, 4), rule="area").values)


def test_triangles_fit_a_png(square, tmp_path):
    out = tmp_path / "triangles.png"
    assert main(["bake", str(square), "-o", str(out), "--what", "triangle", "--size", "4x4"]) == 0
    assert set(np.unique(np.asarray(Image.open(out))).tolist()) == {0, 1}


def test_source_is_another_file(square, tmp_path):
    out, source = tmp_path / "t.npy", tmp_path / "high.obj"
    source.write_text("v 0 0 1\nv 1 0 2\nv 1 1 2\nv 0 1 1\nf 1 2 3\nf 1 3 4\n")
    words = ["--what", "tangent_normal", "--source", str(source), "--size", "8x8", "--gutter", "0"]
    assert main(["bake", str(square), "-o", str(out), *words]) == 0
    values = np.load(out)
    np.testing.assert_allclose(values[4, 4], np.array([-1, 0, 1]) / np.sqrt(2), atol=1e-5)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["-o", "out.xyz"], "the name must end in one of"),
        (["-o", "out.png", "--what", "position"], "positions go to .npy or .tif"),
        (["-o", "out.png", "--what", "color"], "needs a mesh whose vertices have colours"),
        (["-o", "out.png", "--size", "8x"], "must be WIDTHxHEIGHT"),
        (["-o", "out.png", "--gutter", "-3"], "gutter must be a number of texels"),
    ],
)
def test_bad_words_are_told_and_nothing_is_written(words, told, square, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    try:
        status = main(["bake", str(square), *words])
    except SystemExit as error:
        status = error.code
    assert status == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.glob("out.*"))
