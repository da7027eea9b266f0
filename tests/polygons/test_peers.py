"""Polygons beside what other libraries say of the same points: where they differ, and why."""

from itertools import pairwise

import numpy as np
import pytest
from polygon_cases import cells, star, wild_polygon

import topleft as tl

SIDE = 40


def centers(side=SIDE):
    x, y = np.meshgrid(np.arange(side) + 0.5, np.arange(side) + 0.5)
    return np.stack([x.ravel(), y.ravel()], 1)


def rings(n=60):
    """Rings with no point at the height of a centre, and no centre on an edge (almost surely)."""
    for seed in range(n):
        ring = np.round(256 * star(5 + 3 * seed, SIDE, 3.0, 0.2 if seed % 2 else 0.0, seed)) / 256
        yield ring + (np.mod(ring, 1) == 0.5) / 256


def test_masks_are_those_of_matplotlib():
    path = pytest.importorskip("matplotlib.path")
    for ring in rings():
        inside = path.Path(np.vstack([ring, ring[:1]]), closed=True).contains_points(centers())  # even-odd
        assert (tl.polygons(ring, (SIDE, SIDE)).ravel() == inside).all()


def test_masks_are_those_of_skimage():
    measure = pytest.importorskip("skimage.measure")
    for ring in rings():
        inside = measure.points_in_poly(centers(), ring)
        assert (tl.polygons(ring, (SIDE, SIDE)).ravel() == inside).all()


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


def test_labels_of_rasterio_differ_on_edges_alone():
    """GDAL gives the centre on an edge to another side here and there; where none lies on one, nothing differs."""
    features = pytest.importorskip("rasterio.features")
    shapely = pytest.importorskip("shapely")
    affine = pytest.importorskip("affine")
    points, starts, _ = cells(60, (SIDE, SIDE))
    shapes = [shapely.Polygon(points[a:b]) for a, b in pairwise(starts)]
    labels = tl.polygons(shapes, (SIDE, SIDE), values="index")
    pairs = [(shape, i) for i, shape in enumerate(shapes)]
    burnt = features.rasterize(pairs, (SIDE, SIDE), fill=-1, transform=affine.Affine.identity(), dtype="int32")
    borders = shapely.union_all([shape.boundary for shape in shapes])
    at = centers()[(labels != burnt).ravel()]
    assert (shapely.distance(borders, shapely.points(at)) < 1e-9).all()


def test_all_touched_of_rasterio_burns_more_than_outer():
    """It also burns squares that are only touched, and all that the bounds of an edge reach: GDAL issue 8918."""
    features = pytest.importorskip("rasterio.features")
    shapely = pytest.importorskip("shapely")
    affine = pytest.importorskip("affine")
    shape = shapely.box(2, 2, 5, 4)
    burnt = features.rasterize([shape], (8, 8), transform=affine.Affine.identity(), all_touched=True)
    assert tl.polygons(shape, (8, 8), sampling="outer").sum() == 6
    assert burnt.sum() >= 6


def test_masks_of_pycocotools_are_coarser():
    """It draws lines on a grid of 1/5 pixel: within a pixel of the border it is off, no farther."""
    mask = pytest.importorskip("pycocotools.mask")
    shapely = pytest.importorskip("shapely")
    ring = np.round(256 * star(40, SIDE, 0.5)) / 256
    theirs = mask.decode(mask.merge(mask.frPyObjects([ring.ravel().tolist()], SIDE, SIDE))).astype(bool)
    ours = tl.polygons([ring.ravel().tolist()], (SIDE, SIDE))
    at = centers()[(ours != theirs).ravel()]
    assert (shapely.distance(shapely.Polygon(ring).boundary, shapely.points(at)) < 1).all()


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
