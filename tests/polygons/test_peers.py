"""Polygons beside what other libraries say of the same points: where they differ, and why."""

import numpy as np
import pytest
from polygon_cases import star, wild_polygon

import topleft as tl

SIDE = 40


def test_masks_and_areas_are_those_of_shapely():
    shapely = pytest.importorskip("shapely")
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    for seed in range(12):
        ring = np.round(256 * star(7 + 9 * seed, SIDE, 1.0, 0.0, seed)) / 256
        shape = shapely.Polygon(ring)
        assert shape.is_valid
        assert (tl.polygons(shape, (SIDE, SIDE)) == shapely.contains_xy(shape, x + 0.5, y + 0.5)).all()
        areas = shapely.area(shapely.intersection(shapely.box(x, y, x + 1, y + 1), shape))
        drawn = tl.polygons(shape, (SIDE, SIDE), sampling="area")
        assert abs(drawn - areas).max() < 1e-6
        assert (tl.polygons(shape, (SIDE, SIDE), sampling="outer") == (areas > 0)).all()
        assert (tl.polygons(shape, (SIDE, SIDE), sampling="inner") == (areas > 1 - 1e-12)).all()


def test_area_of_crossing_rings_is_that_of_shapely_repaired():
    shapely = pytest.importorskip("shapely")
    for seed in range(40):
        polygon = wild_polygon(np.random.default_rng(seed), (SIDE, SIDE))
        parts = [shapely.make_valid(shapely.Polygon(ring)) for ring in polygon]  # even-odd of each
        odd = parts[0]
        for part in parts[1:]:
            odd = odd.symmetric_difference(part)
        expected = odd.intersection(shapely.box(0, 0, SIDE, SIDE)).area
        drawn = tl.polygons(polygon, (SIDE, SIDE), sampling="area").sum(dtype=float)
        assert drawn == pytest.approx(expected, abs=1e-3)


def random_polygons(shapely, n=60):
    rng = np.random.default_rng(0)
    found = (shapely.Polygon(rng.uniform(0, 64, (7, 2))).buffer(0) for _ in range(n))
    return [one for one in found if one.geom_type == "Polygon" and not one.is_empty]


@pytest.mark.parametrize(("sampling", "is_touched"), [("center", False), ("outer", True)])
def test_pixels_are_those_of_gdal_where_the_snap_moves_no_edge_over_a_centre(sampling, is_touched):
    features, shapely = pytest.importorskip("rasterio.features"), pytest.importorskip("shapely")
    for polygon in random_polygons(shapely):
        burnt = features.rasterize([(polygon, 1)], (64, 64), all_touched=is_touched) > 0
        assert np.array_equal(tl.polygons([polygon], (64, 64), sampling=sampling, subpixel_bits=16), burnt)
