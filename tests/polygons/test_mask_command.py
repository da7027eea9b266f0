"""`topleft mask`: masks of GeoJSON and of COCO annotations, as files."""

import json
import os
import sys
import zipfile

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft._meshes.io.polygon_files import load_polygons

SQUARE = [[1, 1], [4, 1], [4, 3], [1, 3], [1, 1]]
GEOJSON = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"zone": 3, "area": 2},
            "geometry": {"type": "Polygon", "coordinates": [SQUARE]},
        },
        {
            "type": "Feature",
            "properties": {"zone": 700, "area": 2},
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


def assert_refused(run, words, *arguments):
    """Check that `topleft mask` ends with status 2 and a line that holds these words."""
    status, lines = run("mask", *arguments)
    assert (status, len(lines), words in lines[0]) == (2, 1, True)


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
    assert "no object of map.geojson has a whole number of 64 bits of this name, feature 0 has None" in lines[0]
    assert lines[0].endswith("names are area, zone")


def test_masks_of_each_image_of_coco(files, run):
    assert run("mask", "coco.json", "-o", "out/{name}.png", "--labels", "category_id") == (0, [])
    labels = picture("out/cat.png")
    assert labels.shape == (4, 8)
    assert (labels == 2).sum() == 11  # parts that overlap are one object
    assert picture("out/6.png").tolist() == [[0, 9, 9], [0, 9, 9]]


def test_one_image_of_coco(files, run):
    assert run("mask", "coco.json", "-o", "cat.npy", "--image", "cat", "--labels", "index") == (0, [])
    assert np.load("cat.npy").max() == 1
    assert_refused(run, "coco.json has 2 images", "coco.json", "-o", "cat.png")
    assert_refused(run, "no image of that name", "coco.json", "-o", "cat.png", "--image", "dog")


def test_what_is_no_polygon_is_told(files, run):
    said = {**COCO, "annotations": [{"id": 1, "image_id": 5, "segmentation": None}]}
    files.joinpath("none.json").write_text(json.dumps(said))
    status, lines = run("mask", "none.json", "-o", "m.png", "--image", "cat")
    assert (status, lines) == (1, ["topleft: 'none.json': objects left out: 'annotation 1 has no polygons'"])
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
    assert found.owners.tolist() == [0, 0, 1]
    assert found.polygons.points[8:].tolist() == [[0, 0], [5, 0], [5, 3], [0, 3]]


def test_crowds_are_drawn_unless_left_out(files, run):
    annotated(files, {"size": [3, 5], "counts": RUNS}, iscrowd=1)
    assert run("mask", "runs.json", "-o", "m.png", "--labels", "iscrowd") == (0, [])
    assert (picture("m.png") == MASK).all()
    assert run("mask", "runs.json", "-o", "m.png", "--no-crowds") == (0, [])
    assert not picture("m.png").any()


def test_crowds_that_are_left_out_keep_their_number(files, run):
    runs = {"size": [3, 5], "counts": RUNS}
    annotated(files, runs, runs)
    content = json.loads(files.joinpath("runs.json").read_text())
    content["annotations"][0]["iscrowd"] = 1
    files.joinpath("runs.json").write_text(json.dumps(content))
    assert run("mask", "runs.json", "-o", "m.png", "--labels", "index", "--no-crowds") == (0, [])
    assert (picture("m.png") == 2 * MASK).all()
    assert run("mask", "runs.json", "-o", "rle.json", "--no-crowds") == (0, [])
    assert [one["id"] for one in json.loads(files.joinpath("rle.json").read_text())["annotations"]] == [1]


@pytest.mark.parametrize(
    ("segmentation", "said"),
    [
        ({"size": [3, 5], "counts": [14]}, "annotation 0 has run lengths of 14 pixels, not 15"),
        ({"size": [3, 5], "counts": [-1, 16]}, "annotation 0 has a run length of -1 pixels"),
        ({"size": [5, 3], "counts": [15]}, "annotation 0 is of 3x5 pixels, its image of 5x3"),
        ({"size": [3, 5], "counts": "é"}, "annotation 0 has run lengths that are no text of COCO, at 'é'"),
        ({"size": [3, 5], "counts": "P"}, "annotation 0 has run lengths that end within a number"),
        ({"size": [3, 5], "counts": ["a"]}, "annotation 0 is broken (ValueError("),
        ({"size": [3, 5]}, "annotation 0 has no polygons"),
        ("22240K", "annotation 0 has no polygons"),
        ([], "annotation 0 has no polygons"),
        ([1, 2, 3, 4, 5, 6], "annotation 0 is broken (TypeError("),
        ([[[1, 2], [3, 4], [5, 6], [7, 8]]], "annotation 0 is broken (TypeError("),
        ([[1, 2, 3]], "annotation 0 has a ring of 3 numbers"),
        ([[1, 2, "a", 3, 4, 5]], "annotation 0 is broken (ValueError("),
        ([[1, 2, float("nan"), 3, 4, 5]], "annotation 0 has a coordinate of nan"),
    ],
)
def test_annotation_that_is_broken_is_left_out_and_told(files, run, segmentation, said):
    annotated(files, segmentation, {"size": [3, 5], "counts": RUNS})
    status, lines = run("mask", "runs.json", "-o", "m.png", "--labels", "index")
    assert (status, len(lines)) == (1, 1)
    assert "'runs.json': objects left out: " in lines[0]
    assert said in lines[0]
    assert (picture("m.png") == 2 * MASK).all()  # an annotation that is left out keeps its number
    assert run("mask", "runs.json", "-o", "rle.json") == (status, lines)
    first, second = json.loads(files.joinpath("rle.json").read_text())["annotations"]
    assert json.dumps(first["segmentation"]) == json.dumps(segmentation)
    assert second["segmentation"] == {"size": [3, 5], "counts": TEXT}


@pytest.mark.parametrize("ring", [[], [1, 1], [1, 1, 5, 5]])
def test_ring_without_area_of_coco_is_left_out_and_the_rest_is_drawn(files, run, ring):
    annotated(files, [ring, [1, 0, 3, 0, 3, 2, 1, 2], ring])
    said = f"topleft: 'runs.json': rings left out: 'annotation 0 has a ring of {len(ring) // 2} points'"
    assert run("mask", "runs.json", "-o", "m.png") == (1, [said])
    assert picture("m.png").tolist() == [[0, 255, 255, 0, 0]] * 2 + [[0] * 5]


def test_ring_without_area_of_geojson_is_left_out_and_the_rest_is_drawn(files, run):
    holes = [[[2, 2], [3, 2]], [[2, 1], [3, 1], [3, 2], [2, 2]]]
    lone = {"type": "MultiPolygon", "coordinates": [[[[0, 0]], SQUARE], [SQUARE, *holes]]}
    bad = {"type": "Feature", "properties": {"zone": "a"}, "geometry": {"type": "Polygon", "coordinates": [[[0, 0]]]}}
    good = {"type": "Feature", "properties": {"zone": 9}, "geometry": lone}
    files.joinpath("a.json").write_text(json.dumps({"type": "FeatureCollection", "features": [bad, {}, None, good]}))
    how = "--size", "5x4", "--extent", 0, 5, 0, 4
    status, (line,) = run("mask", "a.json", "-o", "m.png", "--labels", "zone", *how)
    assert status == 1
    assert "rings left out: 'feature 0 has a ring of 1 points', 'feature 3 has a ring of 1 points', 'feature 3 " in line
    assert "objects left out: 'feature 0 has no polygons', \"feature 1 is broken (KeyError('type'))\", " in line
    assert picture("m.png").tolist() == [[0] * 5, [0, 9, 9, 9, 0], [0, 9, 0, 9, 0], [0] * 5]
    status, lines = run("raster", "a.json", "-o", "m.tif", "--values", "zone", "--nodata", 0, "--quiet", *how)
    assert (status, lines) == (1, [line])
    assert (picture("m.tif") == picture("m.png")).all()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"type": "FeatureCollection"}', '{"annotations": [1]}', "{"])
def test_broken_files_are_refused_in_one_line(files, run, text):
    files.joinpath("bad.json").write_text(text)
    assert_refused(run, "bad.json", "bad.json", "-o", "m.png")


def test_run_lengths_of_many_pixels_are_masks(files, run):
    """A rectangle for each of a million pixels."""
    content = {"images": [{"id": 1, "width": 1000, "height": 2000}], "annotations": []}
    board = np.indices((2000, 1000)).sum(axis=0) % 2 == 1
    counts = np.diff(np.flatnonzero(np.diff(board.T.reshape(-1), prepend=False, append=False)), prepend=0)
    counts = [*counts.tolist(), 2_000_000 - int(counts.sum())]
    content["annotations"] = [{"id": 1, "image_id": 1, "segmentation": {"size": [2000, 1000], "counts": counts}}]
    files.joinpath("board.json").write_text(json.dumps(content))
    assert run("mask", "board.json", "-o", "m.png") == (0, [])
    assert (picture("m.png") == 255 * board).all()


def images(files, *names):
    """Write a file of images of these file names, with a pixel each."""
    content = {
        "images": [{"id": i, "file_name": name, "width": 2, "height": 1} for i, name in enumerate(names)],
        "annotations": [
            {"id": i, "image_id": i, "segmentation": {"size": [1, 2], "counts": [i % 2, 1, 1 - i % 2]}}
            for i, _ in enumerate(names)
        ],
    }
    files.joinpath("images.json").write_text(json.dumps(content))


def test_images_of_one_name_in_two_folders_go_to_two_files(files, run):
    images(files, "a/1.jpg", "b/1.jpg")
    said = "images a/1 and b/1 would both go to e/1.png; {folder} or {index} parts them"
    assert_refused(run, said, "images.json", "-o", "e/{name}.png")
    assert not files.joinpath("e").exists()
    assert run("mask", "images.json", "-o", "e/{folder}/{name}.png") == (0, [])
    assert [picture(f"e/{name}/1.png").tolist() for name in "ab"] == [[[255, 0]], [[0, 255]]]
    assert run("mask", "images.json", "-o", "{index}.png") == (0, [])
    assert picture("001.png").tolist() == [[0, 255]]
    assert run("mask", "images.json", "-o", "one.png", "--image", "b/1") == (0, [])
    assert picture("one.png").tolist() == [[0, 255]]


def test_images_of_one_id_are_refused(files, run):
    content = {**COCO, "images": [COCO["images"][0]] * 2}
    files.joinpath("twice.json").write_text(json.dumps(content))
    assert_refused(run, "1 ids of images stand more than once", "twice.json", "-o", "{name}.png")


def test_annotations_and_images_that_are_broken_are_left_out_and_told(files, run):
    lost = [{**COCO["annotations"][0], "id": 7, "image_id": 99}, {"id": 8}, "a", {"id": 9, "image_id": [5]}]
    images = [*COCO["images"], {"id": 7, "file_name": "x.png"}]
    content = {**COCO, "images": images, "annotations": [*lost, *COCO["annotations"], {"id": 10, "image_id": 7}]}
    files.joinpath("lost.json").write_text(json.dumps(content))
    status, (line,) = run("mask", "lost.json", "-o", "{name}.png")
    assert status == 1
    assert "objects left out: \"image 7 is broken (KeyError('width'))\", " in line
    assert (
        "'annotation 7 is of image 99, which is not there', \"annotation 8 is broken (KeyError('image_id'))\"" in line
    )
    assert picture("6.png").tolist() == [[0, 255, 255]] * 2
    assert not files.joinpath("x.png").exists()


@pytest.mark.parametrize("name", ["..", "a/..", "../../x.jpg", "/", "a\0b"])
def test_images_outside_of_a_folder_are_refused(files, run, name):
    images(files, name)
    said = f"image 0 has the file name {name!r}, which is none within a folder"
    assert_refused(run, said, "images.json", "-o", "masks/{name}/{folder}/mask.png")


def test_folder_of_an_image_with_a_whole_path_is_refused(files, run):
    images(files, "/data/1.jpg")
    assert_refused(run, "image 1 lies in /data, no folder within another", "images.json", "-o", "{folder}/{name}.png")
    assert run("mask", "images.json", "-o", "{name}.png") == (0, [])


def test_image_without_a_name_is_its_number(files, run):
    images(files, "", "b.jpg")
    assert run("mask", "images.json", "-o", "{name}.png") == (0, [])
    assert picture("0.png").tolist() == [[255, 0]]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_pipes_folders_and_devices_are_refused(files, run):
    os.mkfifo("pipe.json")
    files.joinpath("folder.json").mkdir()
    for name in ("pipe.json", "/dev/zero"):
        assert_refused(run, "a pipe or a device, not a file", name, "-o", "m.png")
    assert_refused(run, "a folder, not a file", "folder.json", "-o", "m.png")


def plane(files, points, **properties):
    feature = {"type": "Feature", "properties": properties, "geometry": {"type": "Polygon", "coordinates": [points]}}
    files.joinpath("plane.json").write_text(json.dumps(feature))


@pytest.mark.parametrize("value", [float("inf"), float("nan"), 1e300, 10**400, 2**63, 1.5, None, ["3"]])
def test_labels_that_are_no_whole_numbers_are_refused(files, run, value):
    plane(files, SQUARE, a=value)
    assert_refused(run, "has a whole number of 64 bits", "plane.json", "-o", "m.png", "--labels", "a")


WHOLE = [0, 1, True, 3.0, -1, 65536, 2**31, 2**53 + 1, 2**63 - 1, -(2**63)]


@pytest.mark.parametrize("value", WHOLE)
@pytest.mark.parametrize("command", [("mask", "--labels"), ("raster", "--values")])
@pytest.mark.parametrize("nodata", [7, 2**62 + 1])
def test_whole_numbers_keep_their_digits_beside_no_data(files, run, command, value, nodata):
    rasterio = pytest.importorskip("rasterio")
    plane(files, SQUARE, a=value)
    where = "--size", "5x4", "--extent", 0, 5, 0, 4
    if isinstance(value, float) and command[0] == "raster":
        nodata = 7  # the raster is of floats
    more = ["--quiet"] * (command[0] == "raster")
    assert run(command[0], "plane.json", "-o", "m.tif", command[1], "a", *where, "--nodata", nodata, *more) == (0, [])
    with rasterio.open(files / "m.tif") as found:
        pixels = found.read(1)
    assert str(nodata).encode() + b"\0" in files.joinpath("m.tif").read_bytes()  # rasterio gives it as a float
    assert pixels.tolist() == [[nodata] * 5] + [[nodata] + [int(value)] * 3 + [nodata]] * 2 + [[nodata] * 5]


def test_png_refuses_labels_that_it_does_not_hold(files, run):
    for value in (-1, 65536):
        plane(files, SQUARE, a=value)
        assert_refused(run, "PNG holds numbers from 0 to 65535", "plane.json", "-o", "m.png", "--labels", "a")


def zones(files, *properties):
    """Write squares of a pixel, one beside the other, each with these properties."""
    squares = [[[i, 0], [i + 1, 0], [i + 1, 1], [i, 1]] for i in range(len(properties))]
    features = [
        {"type": "Feature", "properties": said, "geometry": {"type": "Polygon", "coordinates": [ring]}}
        for said, ring in zip(properties, squares, strict=True)
    ]
    features = [{**one, "id": 90 + i} for i, one in enumerate(features)]
    files.joinpath("zones.json").write_text(json.dumps({"type": "FeatureCollection", "features": features}))


@pytest.mark.parametrize(
    ("values", "drawn", "said"),
    [
        ([0, 7], [0, 7], "objects lost in the background, which is 0 as well: see --nodata: 'feature 0'"),
        ([5, None, 6], [5, 0, 6], "objects left out: 'feature 1 has None as a'"),
        ([5, float("nan"), 6], [5, 0, 6], "objects left out: 'feature 1 has nan as a'"),
        ([5, "x", 6], [5, 0, 6], "objects left out: \"feature 1 has 'x' as a\""),
        ([5, [2], 6], [5, 0, 6], "objects left out: 'feature 1 has [2] as a'"),
    ],
)
@pytest.mark.parametrize("command", [("mask", "--labels"), ("raster", "--values")])
def test_objects_without_a_number_and_in_the_background_are_told(files, run, command, values, drawn, said):
    zones(files, *({"a": value} for value in values))
    where = "--size", f"{len(values)}x1", "--extent", 0, len(values), 0, 1
    assert run(command[0], "zones.json", "-o", "m.tif", command[1], "a", *where)[0] == 1
    assert run(command[0], "zones.json", "-o", "m.npy" if command[0] == "mask" else "m.zarr", command[1], "a", *where)[
        1
    ] == [f"topleft: 'zones.json': {said}"]
    assert picture("m.tif").tolist() == [drawn]


def test_words_leave_out_objects_without_a_word(files, run):
    zones(files, {"a": "x"}, {}, {"a": "b"})
    status, lines = run("mask", "zones.json", "-o", "m.png", "--labels", "a", "--size", "3x1", "--extent", 0, 3, 0, 1)
    assert (status, lines) == (1, ["topleft: 'zones.json': objects left out: 'feature 1 has None as a'"])
    assert picture("m.png").tolist() == [[2, 0, 1]]


def test_property_wins_over_the_id_of_a_feature(files, run):
    where = "--labels", "id", "--size", "2x1", "--extent", 0, 2, 0, 1
    zones(files, {"id": 5}, {"id": 6})
    assert run("mask", "zones.json", "-o", "m.png", *where) == (0, [])
    assert picture("m.png").tolist() == [[5, 6]]
    zones(files, {}, {})
    assert run("mask", "zones.json", "-o", "m.png", *where) == (0, [])
    assert picture("m.png").tolist() == [[90, 91]]


@pytest.mark.parametrize(
    ("far", "said"),
    [
        (float("inf"), "feature 0 has a coordinate of inf"),
        (float("nan"), "feature 0 has a coordinate of nan"),
        (10**400, "feature 0 is broken (OverflowError("),
        (5e-324, "reaches over 5e-324 x 5e-324: --extent must give the area"),
    ],
)
def test_planes_of_no_size_are_refused(files, run, far, said):
    plane(files, [[0, 0], [far, 0], [far, far]])
    status, lines = run("mask", "plane.json", "-o", "m.png")
    assert (status, "--extent must give the area" in lines[-1]) == (2, True)
    assert said in lines[0]


def test_plane_that_is_too_large_for_numbers_is_refused_in_one_line(files, run):
    plane(files, [[-1.7e308, 0], [1.7e308, 0], [0, 1]])
    assert_refused(run, "reaches over inf x 1.0", "plane.json", "-o", "m.png")


def test_rings_that_cross_too_often_are_refused_with_the_option(files, run):
    turns = 2.4 * np.arange(101)
    plane(files, np.stack([np.cos(turns), np.sin(turns)], axis=1).tolist())
    assert run("mask", "plane.json", "-o", "m.png", "--sampling", "area") == (0, [])
    how = "--sampling", "area", "--max-crossings", "3000"
    assert_refused(run, "at most 3,000 times", "plane.json", "-o", "m.png", *how)


def test_extent_without_polygons_is_told(files, run):
    status, lines = run("mask", "map.geojson", "-o", "m.png", "--size", "7x4", "--extent", 1000, 1001, 0, 1)
    assert (status, len(lines)) == (0, 1)
    assert "map: no polygon meets a pixel of the grid" in lines[0]


PARCELS = [[9.0, 50.0], [9.1, 50.0], [9.1, 50.1], [9.0, 50.1]]


def test_words_of_a_property_are_labels_with_a_legend(files, run):
    feature = {"type": "Feature", "geometry": {"type": "Polygon"}}
    uses = {"wood": SQUARE, "field": [[5, 0], [6, 0], [6, 1]], "höfe": [[0, 0], [1, 0], [1, 1], [0, 1]]}
    features = [
        {**feature, "properties": {"use": use}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
        for use, ring in uses.items()
    ]
    files.joinpath("uses.json").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    arguments = ["-o", "m.png", "--labels", "use", "--size", "7x4", "--extent", 0, 7, 0, 4]
    assert run("mask", "uses.json", *arguments) == (0, [])
    legend = json.loads(files.joinpath("m.png.legend.json").read_text())
    assert legend == {"1": "field", "2": "höfe", "3": "wood"}
    drawn = picture("m.png")
    assert (drawn[1, 1], drawn[3, 0], drawn[0, 6]) == (3, 2, 0)


@pytest.mark.parametrize(
    ("more", "epsg", "nodata"), [([], 4326, None), (["--nodata", -7, "--labels", "index"], 4326, -7)]
)
def test_tif_of_polygons_says_where_it_lies(files, run, more, epsg, nodata):
    rasterio = pytest.importorskip("rasterio")
    plane(files, PARCELS)
    assert run("mask", "plane.json", "-o", "m.tif", "--size", "20x10", "--extent", 9, 9.2, 50, 50.1, *more) == (0, [])
    with rasterio.open(files / "m.tif") as found:
        assert (found.crs.to_epsg(), found.nodata) == (epsg, nodata)
        assert found.transform.to_gdal() == pytest.approx((9, 0.01, 0, 50.1, 0, -0.01))
        pixels = found.read(1)
    assert (pixels[:, :10] == (1 if more else 255)).all()
    assert (pixels[:, 10:] == (nodata or 0)).all()


def test_polygons_go_to_another_crs_on_request_and_are_refused_otherwise(files, run):
    rasterio = pytest.importorskip("rasterio")
    pyproj = pytest.importorskip("pyproj")
    plane(files, PARCELS)
    assert run("mask", "plane.json", "-o", "utm.tif", "--crs", "EPSG:25832") == (0, [])
    x, y = pyproj.Transformer.from_crs(4326, 25832, always_xy=True).transform(*np.transpose(PARCELS))
    with rasterio.open(files / "utm.tif") as found:
        assert found.crs.to_epsg() == 25832
        assert (found.bounds.left, found.bounds.top) == pytest.approx((x.min(), y.max()))
    assert run("mask", "plane.json", "-o", "like.tif", "--like", "utm.tif", "--crs", "EPSG:25832") == (0, [])
    assert np.array_equal(picture(files / "like.tif"), picture(files / "utm.tif"))
    said = "topleft: plane.json is of EPSG:4326, utm.tif of EPSG:25832: --crs EPSG:25832 transforms it"
    assert run("mask", "plane.json", "-o", "m.tif", "--like", "utm.tif") == (2, [said])


@pytest.mark.parametrize("suffix", ["gpkg", "shp", "fgb"])
def test_vector_files_are_read_where_their_packages_are(files, run, suffix):
    pyogrio = pytest.importorskip("pyogrio")
    shapely = pytest.importorskip("shapely")
    square = shapely.Polygon(SQUARE)
    other = shapely.MultiPolygon([shapely.box(5, 0, 6, 1), shapely.box(0, 0, 1, 1)])
    pyogrio.raw.write(
        files / f"a.{suffix}", np.array([square.wkb, other.wkb], object), [np.array(["b", "a"], object)], ["use"],
        geometry_type="Unknown" if suffix == "gpkg" else "Polygon" if suffix == "shp" else "Unknown",
        crs="EPSG:25832", driver={"gpkg": "GPKG", "shp": "ESRI Shapefile", "fgb": "FlatGeobuf"}[suffix],
    )  # fmt: skip
    arguments = ["-o", "m.tif", "--labels", "use", "--size", "7x4", "--extent", 0, 7, 0, 4]
    assert run("mask", f"a.{suffix}", *arguments) == (0, [])
    expected = tl.polygons([square, other], tl.Grid((7, 4), (0, 7, 0, 4)), values=np.array([2, 1], np.uint8))
    assert np.array_equal(picture("m.tif"), expected)


@pytest.mark.parametrize("command", ["mask", "raster"])
def test_zipped_shapefiles_are_read_whatever_macos_adds(files, run, command):
    pyogrio = pytest.importorskip("pyogrio")
    shapely = pytest.importorskip("shapely")
    geometries = np.array([shapely.box(*box).wkb for box in ((1, 1, 4, 3), (4, 0, 5, 4))], object)
    pyogrio.raw.write(
        files / "a.shp", geometries, [np.array([2, 3])], ["zone"], geometry_type="Polygon", crs="EPSG:25832"
    )
    with zipfile.ZipFile(files / "a.zip", "w") as archive:
        archive.writestr("__MACOSX/p/._a.shp", b"Mac OS X")
        for path in sorted(files.glob("a.*")):
            if path.suffix != ".zip":
                archive.write(path, f"p/{path.name}")
    what, where = ("--labels", "--values")[command == "raster"], ("--size", "5x4", "--extent", 0, 5, 0, 4)
    assert run(command, "a.zip", "-o", "m.tif", what, "zone", *where, *["--quiet"] * (command == "raster")) == (0, [])
    assert picture("m.tif").tolist() == [[0] * 4 + [3]] + [[0, 2, 2, 2, 3]] * 2 + [[0] * 4 + [3]]
    with zipfile.ZipFile(files / "a.zip", "a") as archive:
        archive.writestr("b.geojson", b"{}")
    status, (line,) = run("mask", "a.zip", "-o", "m.tif")
    assert (status, line.endswith("its archive must hold one vector file, got p/a.shp, b.geojson")) == (2, True)
    (files / "a.zip").write_bytes(b"PK")
    status, (line,) = run("mask", "a.zip", "-o", "m.tif")
    assert (status, "cannot read 'a.zip': its archive is broken" in line) == (2, True)


@pytest.mark.parametrize("suffix", ["gpkg", "shp"])
def test_vector_files_are_read_by_fiona_where_pyogrio_is_missing(files, run, monkeypatch, suffix):
    fiona = pytest.importorskip("fiona")
    monkeypatch.setitem(sys.modules, "pyogrio", None)
    driver, other = {"gpkg": "GPKG", "shp": "ESRI Shapefile"}[suffix], [[5, 0], [6, 0], [6, 1], [5, 1], [5, 0]]
    schema = {"geometry": "Polygon", "properties": {"use": "str"}}
    with fiona.open(files / f"a.{suffix}", "w", driver=driver, crs="EPSG:25832", schema=schema) as rows:
        for name, ring in (("b", SQUARE), ("a", other)):
            geometry = {"type": "Polygon", "coordinates": [ring]}
            rows.write({"type": "Feature", "geometry": geometry, "properties": {"use": name}})
    arguments = ["-o", "m.tif", "--labels", "use", "--size", "7x4", "--extent", 0, 7, 0, 4]
    assert run("mask", f"a.{suffix}", *arguments) == (0, [])
    grid = tl.Grid((7, 4), (0, 7, 0, 4))
    assert np.array_equal(picture("m.tif"), tl.polygons([[SQUARE], [other]], grid, values=np.array([2, 1], np.uint8)))
    assert load_polygons(files / f"a.{suffix}")[0].crs == "EPSG:25832"


def test_vector_file_without_its_packages_gives_the_hint(files, run, monkeypatch):
    for name in ("pyogrio", "fiona"):
        monkeypatch.setitem(sys.modules, name, None)
    (files / "a.gpkg").write_bytes(b"SQLite")
    said = "topleft: reading 'a.gpkg' needs another package: pip install pyogrio shapely"
    assert run("mask", "a.gpkg", "-o", "m.png") == (2, [said])
    assert run("mask", "gone.gpkg", "-o", "m.png") == (2, ["topleft: No such file or directory: 'gone.gpkg'"])


def test_vector_file_that_is_broken_is_told_in_one_line(files, run):
    pytest.importorskip("pyogrio")
    pytest.importorskip("shapely")
    (files / "a.gpkg").write_bytes(b"SQLite")
    assert_refused(run, "topleft: cannot read 'a.gpkg'", "a.gpkg", "-o", "m.png")


def test_no_data_of_a_mask_is_refused(files, run):
    said = "topleft: --nodata is for --labels: a mask is 0 where nothing is"
    assert run("mask", "map.geojson", "-o", "m.tif", "--nodata", 9) == (2, [said])


def test_json_has_run_lengths_of_each_object_of_coco(files, run):
    assert run("mask", "coco.json", "-o", "rle.json") == (0, [])
    content = json.loads(files.joinpath("rle.json").read_text())
    union = tl.polygons([[part] for part in PARTS], (8, 4))
    first, second = content["annotations"]
    assert first["segmentation"] == tl.to_rle(union)
    assert (first["area"], first["bbox"]) == (int(union.sum()), [0, 0, 5, 3])
    assert (first["image_id"], first["category_id"], second["image_id"], second["category_id"]) == (5, 2, 6, 9)
    assert (content["images"], content["categories"]) == (COCO["images"], COCO["categories"])
    (picture, _) = load_polygons("rle.json")
    assert (tl.polygons(picture.polygons, (8, 4)) == union).all()


def test_json_of_coco_has_all_else_as_the_file_has_it(files, run):
    box = {"id": 40, "image_id": 5, "category_id": 2, "bbox": [1, 1, 2, 2], "segmentation": []}
    more = {"score": 0.5, "keypoints": [1, 2, 2], "attributes": {"truncated": True}, "category": "own", "iscrowd": 1}
    named = {"id": 5, "file_name": "train/a b.tar/cat.0001.jpg", "width": 8, "height": 4, "license": 3}
    content = {
        "info": {"year": 2020}, "licenses": [{"id": 3}], "images": [named, {**named, "id": "x", "file_name": 7}],
        "categories": [{"id": 2, "name": "cat", "supercategory": "animal", "keypoints": ["nose"]}, {"id": 77}],
        "annotations": [box, {**COCO["annotations"][0], **more}, {**box, "id": 41, "image_id": "x"}],
    }  # fmt: skip
    files.joinpath("all.json").write_text(json.dumps(content))
    said = "topleft: 'all.json': objects left out: 'annotation 40 has no polygons', 'annotation 41 has no polygons'"
    assert run("mask", "all.json", "-o", "rle.json") == (1, [said])
    found = json.loads(files.joinpath("rle.json").read_text())
    drawn = found["annotations"][1]
    assert drawn["segmentation"] == tl.to_rle(tl.polygons([[part] for part in PARTS], (8, 4)))
    content["annotations"][1] |= {name: drawn[name] for name in ("segmentation", "area", "bbox")}
    assert found == content


def test_json_of_geojson_has_properties_and_the_grid_of_the_mask(files, run):
    words = "map.geojson", "--size", "7x4", "--extent", 0, 7, 0, 4
    assert run("mask", *words, "-o", "rle.json") == (0, [])
    content = json.loads(files.joinpath("rle.json").read_text())
    drawn = tl.polygons(GEOJSON, tl.Grid((7, 4), (0, 7, 0, 4)), values="index")
    assert [one["segmentation"] for one in content["annotations"]] == tl.to_rle(drawn, labels=[0, 1])
    assert [one["attributes"] for one in content["annotations"]] == [{"zone": 3, "area": 2}, {"zone": 700, "area": 2}]


def test_json_goes_with_neither_labels_nor_sampling(files, run):
    for option in (("--labels", "zone"), ("--sampling", "area")):
        said = "run lengths are of masks, without --labels and --sampling"
        assert_refused(run, said, "map.geojson", "-o", "rle.json", *option)


@pytest.mark.parametrize("rule", ["evenodd", "nonzero"])
def test_json_of_objects_of_many_parts_is_the_union_of_each(files, run, rule):
    rng = np.random.default_rng(0)
    parts = [[rng.uniform(-5, 45, 2 * n).round(2).tolist() for n in rng.integers(3, 9, k)] for k in (1, 30, 1, 2)]
    annotations = [{"id": i, "image_id": 5, "category_id": 1, "segmentation": own} for i, own in enumerate(parts)]
    content = {"images": [{"id": 5, "file_name": "a.jpg", "width": 40, "height": 33}], "annotations": annotations}
    files.joinpath("many.json").write_text(json.dumps(content))
    assert run("mask", "many.json", "-o", "rle.json", "--rule", rule) == (0, [])
    found = json.loads(files.joinpath("rle.json").read_text())["annotations"]
    masks = [tl.polygons([[ring] for ring in own], (40, 33), rule=rule) for own in parts]
    assert [one["segmentation"] for one in found] == tl.to_rle(np.stack(masks))
    assert [one["area"] for one in found] == [int(mask.sum()) for mask in masks]
