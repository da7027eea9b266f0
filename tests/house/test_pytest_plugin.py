"""`topleft.pytest_plugin`: pictures that are kept, those that are missing, and those that differ."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft.pytest_plugin import StoredPictures

CUBE = tl.Mesh(*tl.scenes.shape("cube"))
PICTURE = tl.render(CUBE, size=(20, 16))


@pytest.fixture
def check(tmp_path):
    return StoredPictures(tmp_path / "pictures", is_updating=False).check


@pytest.fixture
def kept(tmp_path):
    StoredPictures(tmp_path / "pictures", is_updating=True).check(PICTURE, "cube")
    return tmp_path / "pictures"


def test_picture_that_is_kept_passes(kept, check):
    check(CUBE, "cube", size=(20, 16))
    assert [path.name for path in kept.iterdir()] == ["cube.png"]


def test_picture_that_is_missing_is_told(tmp_path, check):
    with pytest.raises(
        AssertionError, match=r"there is no picture .*cube\.png yet: pytest --update-pictures writes it"
    ):
        check(CUBE, "cube", size=(20, 16))
    assert not list(tmp_path.iterdir())


def test_picture_that_differs_is_drawn_with_the_difference(kept, check):
    other = PICTURE.copy()
    other[3, 7, 0] ^= 255
    with pytest.raises(
        AssertionError, match=r"1 of 320 pixels differ(?s:.*)row 3, column 7(?s:.*)cube\.got\.png; if it"
    ):
        check(other, "cube")
    assert (np.asarray(Image.open(kept / "cube.got.png")) == other).all()
    assert np.argwhere(np.asarray(Image.open(kept / "cube.off.png"))).tolist() == [[3, 7]]
    check(other, "cube", tolerance=255)
    assert [path.name for path in kept.iterdir()] == ["cube.png"]


@pytest.mark.parametrize(
    "picture", [PICTURE[..., :3], PICTURE[..., 0], PICTURE[..., 0] > 200, PICTURE[..., 0] * np.uint16(257)]
)
def test_picture_of_each_kind_is_kept_as_it_is(tmp_path, check, picture):
    StoredPictures(tmp_path / "pictures", is_updating=True).check(picture, "a.b-c_d")
    check(picture, "a.b-c_d")
    with pytest.raises(AssertionError, match="of 320 pixels differ"):
        check(np.roll(picture, 1, 0), "a.b-c_d")


@pytest.mark.parametrize("name", ["", "../a", "a/b", ".a", "a..b", 3])
def test_name_that_leads_elsewhere_is_refused(check, name):
    with pytest.raises(ValueError, match=re.escape(f"name must be letters, digits, '_', '-' and '.', got {name!r}")):
        check(PICTURE, name)


@pytest.mark.parametrize("end", ["got", "off"])
def test_name_of_a_picture_of_a_difference_is_refused(check, end):
    with pytest.raises(ValueError, match=rf"name must not end in \.got or \.off, .* got 'cube\.{end}'"):
        check(PICTURE, f"cube.{end}")


@pytest.mark.parametrize("content", [b"", b"no picture", "cut"])
def test_kept_picture_that_is_damaged_is_named(kept, check, content):
    file = kept / "cube.png"
    file.write_bytes(file.read_bytes()[:200] if content == "cut" else content)
    with pytest.raises(AssertionError, match=r"the picture .*cube\.png cannot be read: "):
        check(PICTURE, "cube")


def test_options_of_a_picture_are_refused(check):
    with pytest.raises(TypeError, match="a picture takes no camera, size or options"):
        check(PICTURE, "cube", size=(20, 16))


def test_plugin_compares_and_updates_in_a_project(tmp_path):
    (tmp_path / "conftest.py").write_text('pytest_plugins = ["topleft.pytest_plugin"]\n')
    (tmp_path / "test_it.py").write_text(
        "import topleft as tl\n\n\ndef test_cube(assert_picture):\n"
        '    assert_picture(tl.Mesh(*tl.scenes.cube()), "cube", size=(20, 16))\n'
    )
    code = """import pytest
command = ["-q", "-p", "no:cacheprovider"]
print("ended:", *(int(pytest.main([*command, *more])) for more in ([], ["--update-pictures"], [])))"""
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    ended = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True, env=environment
    )
    assert ended.stdout.splitlines()[-1] == "ended: 1 0 0"
    assert (np.asarray(Image.open(tmp_path / "pictures" / "cube.png")) == PICTURE).all()
