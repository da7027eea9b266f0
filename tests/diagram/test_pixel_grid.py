"""Pictures of magnified pixels: what stands in them, and where."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft.errors import ImageError

VERTICES, TRIANGLES = [[0.5, 0.5], [7, 2], [2, 5], [7, 5]], [[0, 1, 2], [1, 3, 2]]
COUNTS = tl.overdraw(VERTICES, TRIANGLES, (8, 6))


def parts(svg):
    root = ElementTree.fromstring(svg)
    return [(part.tag.rpartition("}")[2], part) for part in root]


def test_picture_has_each_pixel_edge_and_sample_once():
    found = parts(tl.pixel_grid(COUNTS, VERTICES, TRIANGLES, sampling="msaa4"))
    kinds = [kind for kind, _ in found]
    assert kinds.count("rect") == 1 + 48
    assert kinds.count("line") == 9 + 7 + 5
    assert kinds.count("circle") == 4 * 48
    assert [part.text for kind, part in found if kind == "text"] == ["1"] * int(COUNTS.sum())


def test_vertices_lie_where_they_are():
    svg = tl.pixel_grid(None, VERTICES, TRIANGLES, size=(8, 6), cell=10, edge_color="red")
    edges = re.findall(r'x1="([\d.]+)" y1="([\d.]+)" x2="([\d.]+)" y2="([\d.]+)" stroke="#ff0000"', svg)
    assert (*map(float, edges[0]),) == (10, 10, 75, 25)  # half a pixel of margin


def test_sample_of_a_pixel_is_its_center():
    svg = tl.pixel_grid(size=(1, 1), sampling="center", cell=10)
    assert 'cx="10" cy="10"' in svg


@pytest.mark.parametrize(
    "values",
    [
        COUNTS > 0,
        tl.rasterize(VERTICES, TRIANGLES, (8, 6)).triangle,
        tl.coverage(VERTICES, TRIANGLES, (8, 6), sampling="area"),
        tl.fill(VERTICES, TRIANGLES, [[9, 99, 200], [1, 2, 3]], (8, 6), per="triangle"),
        np.full((6, 8), np.nan),
    ],
    ids=["mask", "ids", "area", "colors", "nan"],
)
def test_picture_goes_to_files(tmp_path, values):
    svg = tl.pixel_grid(values, VERTICES, TRIANGLES, path=tmp_path / "a.svg")
    assert (tmp_path / "a.svg").read_text() == svg
    tl.pixel_grid(values, VERTICES, TRIANGLES, sampling="center", path=str(tmp_path / "a.png"))
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (9 * 32, 7 * 32)
        assert len(image.getcolors(1 << 20)) > 4


def test_colors_of_pixels_are_theirs():
    colors = np.array([[[9, 99, 200], [1, 2, 3]]], np.uint8)
    svg = tl.pixel_grid(colors)
    assert 'fill="#0963c8"' in svg
    assert 'fill="#010203"' in svg
    assert tl.pixel_grid(np.array([[0, 5]])) == tl.pixel_grid(np.array([[0.0, 5]]))  # counts are no ids


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "pixel_grid needs values or a size"),
        ({"values": np.zeros((2, 2, 2))}, r"values must have shape \(H, W\)"),
        ({"values": [["a"]]}, "values must be numbers"),
        ({"values": COUNTS, "size": (6, 8)}, r"size must be that of the values, \(8, 6\), got \(6, 8\)"),
        ({"values": COUNTS, "vertices": VERTICES}, "vertices and triangles belong together"),
        ({"values": COUNTS, "sampling": "area"}, "sampling 'area' has no samples to mark"),
        ({"values": COUNTS, "cell": 0}, "cell must be at least 1, got 0"),
    ],
)
def test_picture_that_cannot_be_is_refused(arguments, message):
    with pytest.raises((TypeError, ValueError), match=message):
        tl.pixel_grid(**arguments)


def test_picture_of_another_format_is_refused(tmp_path):
    with pytest.raises(ImageError, match=r"format '.gif' is none of .svg .png"):
        tl.pixel_grid(COUNTS, path=tmp_path / "a.gif")
