"""XYZ: columns behind the coordinates are colours, normals, or told."""

import warnings

import pytest

import topleft as tl
from topleft.errors import MeshError


@pytest.mark.parametrize(
    ("rows", "colors", "normals", "told"),
    [
        ("1 2 3", None, None, []),
        ("1,2,3,255,0,9", [255, 0, 9, 255], None, []),
        ("1 2 3 255 0 9 128", [255, 0, 9, 128], None, []),
        ("1 2 3 0.6 0 -0.8", None, [0.6, 0, -0.8], []),
        ("# x y z\n1 2 3 0 0 1", None, [0, 0, 1], []),
        ("1 2 3 0 0 1 255 0 9", [255, 0, 9, 255], [0, 0, 1], []),
        ("1 2 3 255 0 9 0 0 1", [255, 0, 9, 255], [0, 0, 1], []),
        ("1 2 3 0.5", None, None, ["columns of numbers behind the coordinates not read: '4 to 4'"]),
        ("1 2 3 0.5 7 300 1", None, None, ["columns of numbers behind the coordinates not read: '4 to 7'"]),
    ],
)
def test_xyz_columns_are_what_their_numbers_can_be(tmp_path, rows, colors, normals, told):
    (tmp_path / "a.xyz").write_text(rows + "\n")
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        cloud = tl.load(tmp_path / "a.xyz")
    assert cloud.positions.tolist() == [[1, 2, 3]]
    assert (None if cloud.colors is None else cloud.colors[0].tolist()) == colors
    assert cloud.normals is None if normals is None else cloud.normals[0].tolist() == pytest.approx(normals)
    assert [str(one.message).partition(": ")[2] for one in heard] == told


@pytest.mark.parametrize(
    ("text", "message"), [("\n", "have no numbers"), ("1 2 3\n4 5\n", "have 2, 3 numbers"), ("1 2", "2")]
)
def test_xyz_that_is_broken_is_told(tmp_path, text, message):
    (tmp_path / "a.xyz").write_text(text)
    with pytest.raises(MeshError, match=message):
        tl.load(tmp_path / "a.xyz")
