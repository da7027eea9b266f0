"""`topleft mask`: masks of GeoJSON and of COCO annotations, as files."""

import json

import numpy as np
import pytest
from PIL import Image

import topleft as tl

SQUARE = [[1, 1], [4, 1], [4, 3], [1, 3], [1, 1]]
GEOJSON = {
    "type": "FeatureCollection",
    "features": [
        {"type": "Feature", "properties": {"zone": 3}, "geometry": {"type": "Polygon", "coordinates": [SQUARE]}},
        {
            "type": "Feature",
            "properties": {"zone": 700},
            "geometry": {"type": "Polygon", "coordinates": [[[4, 1], [6, 1], [6, 3]]]},
        },
    ],
}
PARTS = [[0, 0, 3, 0, 3, 2, 0, 2], [2, 1, 5, 1, 5, 3, 2, 3]]
COCO = {
    "images": [{"id": 5, "file_name": "cat.jpg", "width": 8, "height": 4}, {"id": 6, "width": 3, "height": 2}],
    "categories": [{"id": 2, "name": "cat"}],
    "annotations": [
        {"id": 1, "image_id": 5, "category_id": 2, "segmentation": PARTS},
        {"id": 2, "image_id": 6, "category_id": 9, "segmentation": [[1, 0, 3, 0, 3, 2, 1, 2]]},
    ],
}  # fmt: skip


@pytest.fixture
def files(folder):
    folder.joinpath("map.geojson").write_text(json.dumps(GEOJSON))
    folder.joinpath("coco.json").write_text(json.dumps(COCO))
    return folder


def picture(path):
    with Image.open(path) as image:
        return np.asarray(image)


def test_mask_of_geojson_has_y_up(files, run):
    assert run("mask", "map.geojson", "-o", "mask.png", "--size", "7x4", "--extent", 0, 7, 0, 4) == (0, [])
    grid = tl.Grid((7, 4), (0, 7, 0, 4))
    drawn = tl.polygons(GEOJSON, grid)
    assert drawn.sum() == 9
    assert (picture("mask.png") == 255 * drawn).all()


def test_mask_of_geojson_fits_its_box(files, run):
    assert run("mask", "map.geojson", "-o", "mask.png", "--sampling", "area") == (0, [])
    assert picture("mask.png").shape == (410, 1024)


def test_labels_of_a_property(files, run):
    assert (
        run("mask", "map.geojson", "-o", "zones.png", "--labels", "zone", "--size", "7x4", "--extent", 0, 7, 0, 4)[0]
        == 0
    )
    assert np.unique(picture("zones.png")).tolist() == [0, 3, 700]
    status, lines = run("mask", "map.geojson", "-o", "zones.png", "--labels", "name")
    assert status == 2
    assert "object 0 of map has None, not a whole number" in lines[0]


def test_masks_of_each_image_of_coco(files, run):
    assert run("mask", "coco.json", "-o", "out/{name}.png", "--labels", "category_id") == (0, [])
    labels = picture("out/cat.png")
    assert labels.shape == (4, 8)
    assert (labels == 2).sum() == 11  # parts that overlap are one object
    assert picture("out/6.png").tolist() == [[0, 9, 9], [0, 9, 9]]


def test_one_image_of_coco(files, run):
    assert run("mask", "coco.json", "-o", "cat.npy", "--image", "cat", "--labels", "index") == (0, [])
    assert np.load("cat.npy").max() == 1
    status, lines = run("mask", "coco.json", "-o", "cat.png")
    assert (status, "coco.json has 2 images" in lines[0]) == (2, True)
    status, lines = run("mask", "coco.json", "-o", "cat.png", "--image", "dog")
    assert (status, "no image of that name" in lines[0]) == (2, True)


def test_what_is_no_polygon_is_told(files, run):
    said = {**COCO, "annotations": [{"id": 1, "image_id": 5, "segmentation": {"counts": [9], "size": [4, 8]}}]}
    files.joinpath("rle.json").write_text(json.dumps(said))
    status, lines = run("mask", "rle.json", "-o", "m.png", "--image", "cat")
    assert (status, lines) == (1, ["topleft: cat: 1 objects are no polygons and were left out"])
    assert not picture("m.png").any()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"type": "FeatureCollection"}', '{"annotations": [1]}', "{"])
def test_broken_files_are_refused_in_one_line(files, run, text):
    files.joinpath("bad.json").write_text(text)
    status, lines = run("mask", "bad.json", "-o", "m.png")
    assert status == 2
    assert len(lines) == 1
    assert "bad.json" in lines[0]
