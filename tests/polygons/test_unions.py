"""Parts of a geometry that overlap are united, whatever its form, by each verb and by the command line."""

import json

import numpy as np
import pytest
from engine_cases import one_by_one
from PIL import Image

import topleft as tl

SIZE = 12, 10


def ring(x0, y0, x1, y1, turn=1):
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]][::turn]


SHELL, HOLE = ring(1.5, 1, 8, 7.25), ring(3, 2, 6, 6)
PARTS = {
    "two": [[ring(1, 1, 5, 5)], [ring(3.25, 3.5, 8, 8)]],
    "two that run apart": [[ring(1, 1, 5, 5)], [ring(3.25, 3.5, 8, 8, -1)]],
    "an island in a lake": [[SHELL, HOLE], [ring(4, 3, 5, 4, -1)]],
    "over a lake": [[SHELL, HOLE], [ring(5, 3, 10.5, 5)]],
    "both with lakes": [[SHELL, HOLE], [ring(4, 0, 11, 9, -1), ring(5, 1, 10, 8)]],
    "three": [[ring(1, 1, 5, 5)], [ring(3, 3, 8, 8)], [ring(2, 2, 7, 4, -1)]],
    "apart": [[ring(1, 1, 3, 3)], [ring(4, 1, 7.5, 3)], [ring(1, 4, 3, 6)]],
}
STAR = [[5 + 4 * np.cos(2.4 * np.pi * k / 3), 5 + 4 * np.sin(2.4 * np.pi * k / 3)] for k in range(5)]


def multi(parts):
    return {"type": "MultiPolygon", "coordinates": parts}


def collection(parts):
    areas = [{"type": "Polygon", "coordinates": part} for part in parts]
    return {
        "type": "GeometryCollection",
        "geometries": [{"type": "GeometryCollection", "geometries": areas[:1]}, *areas[1:]],
    }


def of_shapely(form):
    def make(parts):
        shapely = pytest.importorskip("shapely")
        return shapely.geometry.shape(form(parts))

    return make


FORMS = [multi, collection, of_shapely(multi), of_shapely(collection)]


@one_by_one("form", FORMS)
@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize("rule", ["evenodd", "nonzero"])
def test_parts_of_a_geometry_are_united_by_each_verb(name, form, rule):
    shapely = pytest.importorskip("shapely")
    parts, geometry = PARTS[name], form(PARTS[name])
    mask = np.any([tl.polygons([part], SIZE) for part in parts], axis=0)
    assert np.array_equal(tl.polygons(geometry, SIZE, rule=rule), mask)
    labels = tl.polygons([geometry, {"type": "Polygon", "coordinates": [ring(9, 8, 11, 10)]}][:1], SIZE, values=[7])
    assert np.array_equal(labels, 7 * mask)
    union = shapely.union_all([shapely.Polygon(part[0], part[1:]) for part in parts])
    pixels = shapely.box(*np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), *np.meshgrid(
        np.arange(SIZE[0]) + 1, np.arange(SIZE[1]) + 1))  # fmt: skip
    areas = shapely.area(shapely.intersection(union, pixels))
    assert tl.polygons(geometry, SIZE, rule=rule, sampling="area") == pytest.approx(areas, abs=1e-6)
    assert tl.overlap(geometry, SIZE, rule=rule).spread([1]) == pytest.approx(areas, abs=1e-6)
    assert np.array_equal(tl.polygons(geometry, SIZE, rule=rule, sampling="outer"), areas > 1e-9)
    assert tl.to_rle(geometry, SIZE) == tl.to_rle(mask[None])
    grid = tl.Grid(SIZE, (0, SIZE[0], 0, SIZE[1]), y="down")
    assert np.array_equal(tl.tiles(geometry, grid, kind="coverage", window=5)[:], mask)


def test_rings_of_other_features_keep_the_rule():
    star = {"type": "Polygon", "coordinates": [STAR]}
    both = tl.polygons([star, multi(PARTS["two"])], SIZE, values="index")
    for i, one in enumerate([star, multi(PARTS["two"])]):
        alone = tl.polygons([one], SIZE, values=[1])
        assert np.array_equal(both == i, (alone == 1) & ((i == 1) | (tl.polygons(multi(PARTS["two"]), SIZE) == 0)))
    assert tl.polygons(star, SIZE).sum() < tl.polygons(star, SIZE, rule="nonzero").sum()


@pytest.mark.parametrize("sampling", ["center", "area"])
@pytest.mark.parametrize("name", PARTS)
def test_command_line_draws_the_picture_of_python(folder, run, name, sampling):
    geometry = collection(PARTS[name])
    folder.joinpath("a.geojson").write_text(json.dumps(geometry))
    where = "--size", "12x10", "--extent", 0, 12, 0, 10
    assert run("mask", "a.geojson", "-o", "a.png", "--sampling", sampling, *where) == (0, [])
    drawn = tl.polygons(geometry, tl.Grid(SIZE, (0, 12, 0, 10)), sampling=sampling)
    with Image.open("a.png") as image:
        assert np.array_equal(np.asarray(image), np.rint(drawn * np.float32(255)))
