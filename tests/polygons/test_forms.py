"""Forms of polygons that other programs give: collections, contours of OpenCV, GeoJSON by lines."""

import json
import warnings

import numpy as np
import pytest

import topleft as tl

SIZE = 12, 10


def ring(x0, y0, x1, y1, turn=1):
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]][::turn]


PARTS = [[ring(1, 1, 5, 5)], [ring(6, 3.5, 8, 8)], [ring(9, 8, 11, 10)]]


def multi(parts):
    return {"type": "MultiPolygon", "coordinates": parts}


def collection(parts):
    areas = [{"type": "Polygon", "coordinates": part} for part in parts]
    return {
        "type": "GeometryCollection",
        "geometries": [{"type": "GeometryCollection", "geometries": areas[:1]}, *areas[1:]],
    }


@pytest.mark.parametrize("kind", ["Point", "MultiPoint", "LineString"])
def test_members_of_a_collection_that_cover_nothing_are_left_out_with_a_warning(folder, run, kind):
    shapely = pytest.importorskip("shapely")
    spots = {"Point": [1, 1], "MultiPoint": [[1, 1], [2, 2]], "LineString": [[1, 1], [2, 2]]}
    geometry = collection(PARTS)
    geometry["geometries"].append({"type": kind, "coordinates": spots[kind]})
    for one in (geometry, shapely.geometry.shape(geometry)):
        with pytest.warns(UserWarning, match="in a GeometryCollection: they cover no area"):
            drawn = tl.polygons(one, SIZE)
        assert np.array_equal(drawn, tl.polygons(multi(PARTS), SIZE))
    folder.joinpath("a.geojson").write_text(json.dumps(geometry))
    said = [f"topleft: 'a.geojson': parts left out: 'feature 0 has a {kind} beside polygons'"]
    assert run("mask", "a.geojson", "-o", "a.png") == (1, said)
    with pytest.raises(TypeError, match="must be Polygon or MultiPolygon"):
        tl.polygons(geometry["geometries"][-1], SIZE)


CONTOUR = np.array([[[2, 1]], [[7, 1]], [[7, 6]], [[2, 6]]], np.int32)
INNER = np.array([[[3, 2]], [[5, 2]], [[5, 4]], [[3, 4]]], np.int32)


@pytest.mark.parametrize("form", [
    lambda one, two: (one, two), lambda one, two: [one, two], lambda one, two: [[one, two]],
    lambda one, two: (one + 0.0, two + 0.0),
])  # fmt: skip
def test_contours_of_opencv_are_rings(form):
    expected = tl.polygons([CONTOUR[:, 0], INNER[:, 0]], SIZE)
    assert expected.sum() == 21
    assert np.array_equal(tl.polygons(form(CONTOUR, INNER), SIZE), expected)
    assert tl.polygons(CONTOUR, SIZE).sum() == 25
    assert tl.to_rle([[CONTOUR], [INNER]], SIZE) == tl.to_rle([[CONTOUR[:, 0]], [INNER[:, 0]]], SIZE)


ROWS = [{"type": "Feature", "geometry": collection([part]), "properties": {}} for part in [*PARTS, *PARTS[:2]]]


@pytest.mark.parametrize("separator", ["\n", "\r\n", "\n\n", "\n\x1e"])
@pytest.mark.parametrize("is_grouped", [False, True])
def test_geojson_by_lines_is_that_of_one_collection(folder, run, separator, is_grouped):
    rows = [{"type": "FeatureCollection", "features": ROWS[:3]}, *ROWS[3:]] if is_grouped else ROWS
    lead = "\x1e" if "\x1e" in separator else ""
    indent = 1 if lead else None
    folder.joinpath("a.geojsonl").write_bytes(
        (lead + separator.join(json.dumps(r, indent=indent) for r in rows)).encode()
    )
    folder.joinpath("b.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": ROWS}))
    where = "--size", "12x10", "--extent", 0, 12, 0, 10
    for name in ("a.geojsonl", "b.geojson"):
        assert run("mask", name, "-o", f"{name}.npy", "--labels", "index", *where) == (0, [])
        assert run("raster", name, "-o", f"{name}.tif", "--quiet", *where) == (0, [])
    assert np.array_equal(np.load("a.geojsonl.npy"), np.load("b.geojson.npy"))
    assert folder.joinpath("a.geojsonl.tif").stat().st_size > 0


def test_line_that_is_no_json_is_left_out_and_keeps_its_number(folder, run):
    lines = [
        json.dumps(ROWS[0]),
        '{"type": "Fea',
        json.dumps({**ROWS[0], "geometry": {"type": "Polygon", "coordinates": [ring(9, 8, 11, 10)]}}),
    ]
    folder.joinpath("a.ndjson").write_text("\n".join(lines))
    status, (line,) = run("mask", "a.ndjson", "-o", "a.npy", "--labels", "index")
    assert (status, "'a.ndjson': objects left out: 'feature 1 is no JSON: " in line) == (1, True)
    assert set(np.unique(np.load("a.npy")).tolist()) == {0, 1, 3}


def test_no_warning_of_another_package_reaches_the_user(folder, run, monkeypatch):
    import topleft._apps.cli.mask

    def load(*arguments, **options):
        warnings.warn_explicit("of a package", UserWarning, "/lib/site-packages/pyogrio/raw.py", 1)
        warnings.warn("of old code", DeprecationWarning, stacklevel=1)
        return kept(*arguments, **options)

    kept = topleft._apps.cli.mask.load_polygons
    monkeypatch.setattr(topleft._apps.cli.mask, "load_polygons", load)
    folder.joinpath("a.geojson").write_text(json.dumps(multi(PARTS)))
    assert run("mask", "a.geojson", "-o", "a.png") == (0, [])
