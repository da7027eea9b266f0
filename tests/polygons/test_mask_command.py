"""`topleft mask`: masks of GeoJSON and of COCO annotations, as files."""

import json

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft._meshes.io.polygon_files import load_polygons

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
    said = {**COCO, "annotations": [{"id": 1, "image_id": 5, "segmentation": None}]}
    files.joinpath("none.json").write_text(json.dumps(said))
    status, lines = run("mask", "none.json", "-o", "m.png", "--image", "cat")
    assert (status, lines) == (1, ["topleft: cat: 1 objects are no polygons and were left out"])
    assert not picture("m.png").any()


MASK = np.array([[0, 1, 1, 1, 0], [0, 0, 1, 1, 0], [1, 0, 1, 1, 1]])
RUNS = [2, 2, 2, 6, 2, 1]  # down the columns, the first run outside
TEXT = "22240K"  # the same as pycocotools writes it


def annotated(files, *segmentations, **said):
    """Write annotations of an image of 5x3 pixels."""
    annotations = [{"id": i, "image_id": 1, "segmentation": s, **said} for i, s in enumerate(segmentations)]
    content = {"images": [{"id": 1, "width": 5, "height": 3}], "annotations": annotations}
    files.joinpath("runs.json").write_text(json.dumps(content))


@pytest.mark.parametrize("counts", [RUNS, TEXT])
@pytest.mark.parametrize("sampling", ["center", "area", "msaa4", "outer", "inner"])
def test_run_lengths_are_masks(files, run, counts, sampling):
    annotated(files, {"size": [3, 5], "counts": counts})
    assert run("mask", "runs.json", "-o", "m.png", "--sampling", sampling) == (0, [])
    assert (picture("m.png") == 255 * MASK).all()


def test_run_lengths_over_whole_columns_are_few_rectangles(files):
    annotated(files, {"size": [3, 5], "counts": [3, 10, 2]}, {"size": [3, 5], "counts": [0, 15]})
    (found,) = load_polygons(files / "runs.json")
    assert found.owners == [0, 0, 1]
    assert found.polygons[2] == [[(0, 0), (5, 0), (5, 3), (0, 3)]]


def test_crowds_are_drawn_unless_left_out(files, run):
    annotated(files, {"size": [3, 5], "counts": RUNS}, iscrowd=1)
    assert run("mask", "runs.json", "-o", "m.png", "--labels", "iscrowd") == (0, [])
    assert (picture("m.png") == MASK).all()
    assert run("mask", "runs.json", "-o", "m.png", "--no-crowds") == (0, [])
    assert not picture("m.png").any()


@pytest.mark.parametrize(
    ("segmentation", "said"),
    [
        ({"size": [3, 5], "counts": [14]}, "annotation 0 has run lengths of 14 pixels, not 15"),
        ({"size": [3, 5], "counts": [-1, 16]}, "annotation 0 has a run length of -1 pixels"),
        ({"size": [5, 3], "counts": [15]}, "annotation 0 is of 3x5 pixels, its image of 5x3"),
        ({"size": [3, 5], "counts": "é"}, "annotation 0 has run lengths that are no text of COCO, at 'é'"),
        ({"size": [3, 5], "counts": "P"}, "annotation 0 has run lengths that end within a number"),
        ({"size": [3, 5], "counts": ["a"]}, "something is missing or of a wrong kind"),
        ([[1, 2, 3]], "something is missing or of a wrong kind"),
        ([[1, 2, "a", 3, 4, 5]], "something is missing or of a wrong kind"),
    ],
)
def test_broken_segmentations_are_refused_in_one_line(files, run, segmentation, said):
    annotated(files, segmentation)
    status, lines = run("mask", "runs.json", "-o", "m.png")
    assert (status, len(lines)) == (2, 1)
    assert said in lines[0]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"type": "FeatureCollection"}', '{"annotations": [1]}', "{"])
def test_broken_files_are_refused_in_one_line(files, run, text):
    files.joinpath("bad.json").write_text(text)
    status, lines = run("mask", "bad.json", "-o", "m.png")
    assert status == 2
    assert len(lines) == 1
    assert "bad.json" in lines[0]
