"""`topleft.testing.assert_same_picture`: what it lets pass, and what it says of what it does not."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from topleft.testing import assert_same_picture


def test_assert_same_picture_of_equal_arrays_passes():
    for picture in (np.eye(4, dtype=bool), np.zeros((2, 3, 4), np.uint8), np.full((2, 2), np.nan), np.zeros((0, 5))):
        assert_same_picture(picture, picture.copy())


def test_differing_pixels_are_counted_and_shown():
    got, expected = np.zeros((4, 5, 3), np.uint8), np.zeros((4, 5, 3), np.uint8)
    got[1, 2] = 9, 0, 250
    got[3, 4, 1] = 1
    with pytest.raises(AssertionError) as raised:
        assert_same_picture(got, expected)
    lines = str(raised.value).splitlines()
    assert lines == [
        "2 of 20 pixels differ, by 250 at most",
        "  row 1, column 2: got [  9   0 250], expected [0 0 0]",
        "  row 3, column 4: got [0 1 0], expected [0 0 0]",
    ]


def test_many_differing_pixels_are_told_by_their_box():
    got = np.zeros((9, 9), np.int32)
    got[2:6, 3:8] = 7
    with pytest.raises(AssertionError, match="and 12 more, in rows 2 to 5, columns 3 to 7"):
        assert_same_picture(got, np.zeros_like(got))


def test_tolerance_is_of_each_channel():
    got, expected = np.full((2, 2, 3), 12, np.uint8), np.full((2, 2, 3), 10, np.uint8)
    assert_same_picture(got, expected, tolerance=2)
    with pytest.raises(AssertionError, match="4 of 4 pixels differ, by 2 at most"):
        assert_same_picture(got, expected, tolerance=1)


@pytest.mark.parametrize(
    ("got", "expected", "message"),
    [
        (np.zeros((2, 3)), np.zeros((3, 2)), r"shape \(2, 3\), expected \(3, 2\)"),
        (np.zeros((2, 3)), np.zeros((2, 3), np.float32), "dtype float64, expected float32"),
        (np.zeros(3), np.zeros(3), r"shape \(H, W\) or \(H, W, C\), got \(3,\)"),
        (np.array([[np.nan]]), np.array([[1.0]]), "1 of 1 pixels differ, by inf at most"),
        (np.array([[2**60]]), np.array([[2**60 + 1]]), "1 of 1 pixels differ"),
        (np.array([[np.inf]]), np.array([[-np.inf]]), "1 of 1 pixels differ, by inf at most"),
    ],
)
def test_other_kinds_of_pictures_fail(got, expected, message):
    with pytest.raises(AssertionError, match=message):
        assert_same_picture(got, expected)


def test_assert_same_picture_draws_the_difference_to_its_path(tmp_path):
    got, expected = np.zeros((3, 4), np.float32), np.zeros((3, 4), np.float32)
    got[0, 1], got[2, 3], got[1, 1] = 1, 0.5, np.nan
    with pytest.raises(AssertionError, match=r"the difference is drawn in .*off\.png"):
        assert_same_picture(got, expected, path=tmp_path / "off.png")
    drawn = np.asarray(Image.open(tmp_path / "off.png"))
    assert drawn[0, 1] == 255
    assert drawn[1, 1] == 255
    assert drawn[2, 3] == 155
    assert np.count_nonzero(drawn) == 3


def test_files_of_slow_tests_are_there():
    root = Path(__file__).parents[2]
    listed = root.joinpath("tests/slow.txt").read_text(encoding="utf-8").split("\n")[1:-1]
    assert [name for name in listed if not root.joinpath(name).is_file()] == []
    assert listed == sorted(listed)
