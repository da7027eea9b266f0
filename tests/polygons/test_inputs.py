"""What `polygons` and `overlap` take, and what they say of the rest."""

import re

import numpy as np
import pytest
from polygon_cases import square

import topleft as tl

SQUARE, HOLE, OTHER = square(0, 0, 5, 4), square(1, 1, 3, 3), square(5, 0, 7, 2)
SIZE = (8, 5)
ONE = tl.polygons([SQUARE, HOLE], SIZE)
TWO = tl.polygons([[SQUARE, HOLE], [OTHER]], SIZE, values="index")
COORDINATES = np.concatenate([SQUARE, HOLE, OTHER])


def closed(ring):
    return [*map(tuple, ring.tolist()), tuple(ring[0].tolist())]


class Thing:
    def __init__(self, geometry):
        self.__geo_interface__ = geometry


POLYGON = {"type": "Polygon", "coordinates": [closed(SQUARE), closed(HOLE)]}
FEATURES = {
    "type": "FeatureCollection",
    "features": [
        {"type": "Feature", "properties": {}, "geometry": POLYGON},
        {"type": "Feature", "geometry": {"type": "MultiPolygon", "coordinates": [[closed(OTHER)]]}},
    ],
}


@pytest.mark.parametrize(
    "rings",
    [
        [SQUARE, HOLE],
        [SQUARE.tolist(), HOLE.tolist()],
        [SQUARE.astype(np.float32), HOLE[::-1]],
        [SQUARE.astype(int), HOLE],
        np.stack([SQUARE, HOLE]),
        [SQUARE.reshape(-1).tolist(), HOLE.reshape(-1).tolist()],
        tuple(tuple(map(tuple, ring.tolist())) for ring in (SQUARE, HOLE)),
        tuple(tuple(map(tuple, ring.tolist())) for ring in (SQUARE, HOLE, OTHER[[0, 1, 0]])),
        (COORDINATES[:8], [0, 4, 8]),
        (COORDINATES[:8], [0, 4, 8], [0, 2]),
        POLYGON,
        Thing(POLYGON),
        [Thing(POLYGON)],
        {"type": "Feature", "geometry": POLYGON},
        {"type": "GeometryCollection", "geometries": [POLYGON]},
    ],
)
def test_one_polygon_in_each_form(rings):
    assert (tl.polygons(rings, SIZE) == ONE).all()


@pytest.mark.parametrize(
    "rings",
    [
        [[SQUARE, HOLE], [OTHER]],
        [[SQUARE.tolist(), HOLE.tolist()], [OTHER.tolist()]],
        [[SQUARE.reshape(-1).tolist(), HOLE.reshape(-1).tolist()], [OTHER.reshape(-1).tolist()]],
        (COORDINATES, [0, 4, 8, 12], [0, 2, 3]),
        (COORDINATES.astype(np.float32), np.array([0, 4, 8, 12], np.int32), np.array([0, 2, 3], np.uint8)),
        FEATURES,
        Thing(FEATURES),
        FEATURES["features"],
        [Thing(feature) for feature in FEATURES["features"]],
    ],
)
def test_several_polygons_in_each_form(rings):
    assert (tl.polygons(rings, SIZE, values="index") == TWO).all()
    table = tl.overlap(rings, SIZE)
    assert table.totals().tolist() == [16, 4]


def test_shapely_in_each_form():
    shapely = pytest.importorskip("shapely")
    one, other = shapely.Polygon(SQUARE, [HOLE]), shapely.MultiPolygon([shapely.Polygon(OTHER)])
    assert (tl.polygons(one, SIZE) == ONE).all()
    assert (tl.polygons(shapely.force_3d(one), SIZE) == ONE).all()
    for rings in ([one, other], np.array([one, other]), shapely.to_ragged_array([one, other])):
        assert (tl.polygons(rings, SIZE, values="index") == TWO).all()
    assert (tl.polygons([one, shapely.Polygon(OTHER)], SIZE, values="index") == TWO).all()
    assert (tl.polygons([one, shapely.Polygon()], SIZE, values="index") == np.where(TWO == 0, 0, -1)).all()
    with pytest.raises(TypeError, match="must be polygons or multipolygons, got Point"):
        tl.polygons([shapely.Point(1, 1)], SIZE)


def test_ring_of_three_tuples_is_a_triangle():
    corners = ((0, 0), (8, 0), (0, 6))
    assert (tl.polygons(corners, SIZE) == tl.polygons(np.array(corners), SIZE)).all()


def test_table_of_pandas_is_a_ring():
    pandas = pytest.importorskip("pandas")
    assert (tl.polygons(pandas.DataFrame(SQUARE, columns=["x", "y"]), SIZE) == tl.polygons(SQUARE, SIZE)).all()


@pytest.mark.parametrize("at", [0, 1, 2])
def test_missing_geometry_of_shapely_is_an_empty_polygon(at):
    shapely = pytest.importorskip("shapely")
    geometries = [shapely.Polygon(SQUARE, [HOLE]), shapely.Polygon(OTHER)]
    geometries.insert(at, None)
    wished = np.where(at <= TWO, TWO + 1, TWO)
    for rings in (geometries, np.array(geometries)):
        assert (tl.polygons(rings, SIZE, values="index") == wished).all()
        assert (tl.tiles(rings, SIZE)[:] == wished).all()
        assert len(tl.overlap(rings, SIZE)) == 3


@pytest.mark.parametrize("dtype", ["i2", "i4", "f4", "f8"])
@pytest.mark.parametrize("background", [0, 5])
def test_values_of_the_other_byte_order_are_those_of_the_own(dtype, background):
    values = np.array([1, 300], dtype)
    own, other = (
        tl.polygons([[SQUARE, HOLE], [OTHER]], SIZE, values=given, background=background)
        for given in (values, values.astype(values.dtype.newbyteorder()))
    )
    assert other.dtype == own.dtype
    assert np.array_equal(other, own)


@pytest.mark.parametrize(
    "dtype", [bool, np.uint8, np.int8, np.uint16, np.int32, np.uint32, np.float32, np.int64, float]
)
def test_values_of_each_dtype(dtype):
    values = np.array([1, 0 if dtype is bool else 7], dtype)
    picture = tl.polygons([[SQUARE, HOLE], [OTHER]], SIZE, values=values)
    assert picture.dtype == dtype
    assert (picture == np.append(values, 0).astype(dtype)[TWO]).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("n_channels", [1, 2, 3, 4])
def test_colors_of_each_kind(dtype, n_channels):
    colors = np.arange(1, 2 * n_channels + 1).reshape(2, -1).astype(dtype)
    ground = np.arange(n_channels) + 9
    picture = tl.polygons([[SQUARE, HOLE], [OTHER]], SIZE, values=colors, background=ground)
    assert picture.shape == (5, 8, n_channels)
    assert (picture == np.vstack([colors, ground.astype(dtype)])[TWO]).all()


def test_one_number_is_the_value_of_all():
    assert (tl.polygons([[SQUARE, HOLE], [OTHER]], SIZE, values=3) == 3 * (TWO >= 0)).all()


def test_out_is_written_wherever_it_lies():
    for sampling, dtype in [("center", bool), ("area", np.float32), ("msaa2", np.float32), ("outer", bool)]:
        expected = tl.polygons([SQUARE, HOLE], SIZE, sampling=sampling)
        for out in (np.empty(SIZE[::-1], dtype), np.empty((5, 20), dtype)[:, 1:17:2], np.empty(SIZE, dtype).T):
            assert tl.polygons([SQUARE, HOLE], SIZE, sampling=sampling, out=out) is out
            assert (out == expected).all()


def test_grid_is_in_units_of_the_data():
    grid = tl.Grid((4, 2), (500_000.0, 500_002.0, 10.0, 11.0))
    ring = [(500_000.5, 10.5), (500_002, 10.5), (500_002, 11), (500_000.5, 11)]
    assert tl.polygons(ring, grid).tolist() == [[False, True, True, True], [False] * 4]
    assert tl.overlap([ring], grid).pixels.tolist() == [1, 2, 3]


@pytest.mark.parametrize("rings", [[], (np.empty((0, 2)), [0], [0]), (np.empty((0, 2)), [0])])
def test_no_rings_give_empty_pictures(rings):
    assert not tl.polygons(rings, SIZE).any()
    assert not tl.polygons(rings, SIZE, sampling="area").any()
    assert not tl.polygons(rings, SIZE, sampling="outer").any()
    assert (tl.polygons(rings, SIZE, values="index") == -1).all()
    assert len(tl.overlap(rings, SIZE).areas) == 0


@pytest.mark.parametrize("size", [(0, 0), (0, 4), (4, 0)])
def test_size_without_pixels_gives_arrays_of_that_shape(size):
    assert tl.polygons(SQUARE, size).shape == size[::-1]
    assert tl.polygons([[SQUARE]], size, values="index").shape == size[::-1]
    assert tl.polygons(SQUARE, size, sampling="area").shape == size[::-1]
    assert tl.overlap([[SQUARE]], size).shape == (1, 0)


def test_rings_without_area_are_empty():
    for ring in ([(1, 1)] * 3, [(0, 0), (5, 4), (0, 0)], [(0, 1), (4, 1), (2, 1)]):
        for sampling in ("center", "area", "outer", "inner", "msaa16"):
            assert not tl.polygons(ring, SIZE, sampling=sampling).any()


def test_square_with_90_000_holes_keeps_three_quarters_of_each_pixel():
    side = 300
    at = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 1, 2)
    holes = at + np.array([(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)])
    points = np.concatenate([square(0, 0, side, side), holes.reshape(-1, 2)])
    offsets = np.arange(0, len(points) + 1, 4)
    assert not tl.polygons((points, offsets), (side, side)).any()
    areas = tl.polygons((points, offsets), (side, side), sampling="area")
    assert (areas == 0.75).all()


@pytest.mark.parametrize(
    ("rings", "error", "message"),
    [
        ([[(0, 0), (1, 1)]], ValueError, "rings must have at least 3 points, ring 0 has 2"),
        ((COORDINATES, [0, 4, 6, 12]), ValueError, "rings must have at least 3 points, ring 1 has 2"),
        ([(0, 0), (np.nan, 1), (2, 2)], ValueError, "rings must be finite, got [nan, 1.0] in point 1"),
        ([(0, 0), (np.inf, 1), (2, 2)], ValueError, "rings must be finite, got [inf, 1.0] in point 1"),
        ([(0, 0), (1, 1e17), (2, 2)], ValueError, "rings must lie within 2**52 pixels of the window with 8 sub-pixel"),
        ([(0, 0), (1, 2**62), (2, 2)], ValueError, "rings must lie within 2**52 pixels of the window with 8 sub-pixel"),
        ([(0, 0, 1), (1, 2, 2), (2, 2, 3)], ValueError, "got shape (3,); a point has x and y alone"),
        (np.zeros((3, 3)), ValueError, "rings must have shape (N, 2), got (3, 3)"),
        ([[0, 0, 1, 1, 2]], ValueError, "flat rings must hold x, y, x, y, an even number of numbers, got shape (5,)"),
        ((COORDINATES, [0, 4, 8]), ValueError, "ring_offsets must rise from 0 to the number of coordinates, 12; got"),
        ((COORDINATES, [0, 8, 4, 12]), ValueError, "ring_offsets must rise from 0 to the number of coordinates, 12"),
        ((COORDINATES, [0, 4, 12], [0, 1]), ValueError, "polygon_offsets must rise from 0 to the number of rings, 2"),
        ((COORDINATES, [0.0, 12]), TypeError, "ring_offsets must be integers, got dtype float64"),
        ([("a", "b"), ("c", "d"), ("e", "f")], TypeError, "rings must be real numbers, got dtype <U1"),
        (np.zeros((3, 2), complex), TypeError, "rings must be real numbers, got dtype complex128"),
        (7, TypeError, "rings must be an array (N, 2), a list of rings or of polygons"),
        ("a.geojson", TypeError, "got str; geopandas.read_file(path) reads files, json.load GeoJSON"),
        ({"type": "Polygon", "id": 1}, ValueError, "a Polygon of GeoJSON must have coordinates, got only type, id"),
        ({"type": "FeatureCollection"}, ValueError, "a FeatureCollection of GeoJSON must have features, got only type"),
        ({"type": "Point", "coordinates": (1, 1)}, TypeError, "geometries must be Polygon or MultiPolygon, got Point"),
    ],
)
def test_bad_rings_are_named(rings, error, message):
    with pytest.raises(error, match=re.escape(message)):
        tl.polygons(rings, SIZE)
    with pytest.raises(error, match=re.escape(message)):
        tl.overlap(rings, SIZE, subpixel_bits=8)


def test_overlap_snaps_to_as_fine_a_grid_as_there_is():
    ring = [(0.3, 0.3), (0.301, 0.3), (0.301, 0.301), (0.3, 0.301)]
    assert tl.overlap([[ring]], (1, 1)).areas[0] == pytest.approx(1e-6, rel=0.05)
    assert not len(tl.overlap([[ring]], (1, 1), subpixel_bits=8).areas)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"rule": "winding"}, ValueError, "rule must be one of 'evenodd', 'nonzero', got 'winding'"),
        ({"sampling": "all_touched"}, ValueError, "sampling must be one of 'center'"),
        ({"values": [1, 2]}, ValueError, "values must have shape (1,) or (1, C), a row for each polygon, got (2,)"),
        ({"values": "labels"}, ValueError, "values must be 'index', a number or an array, got 'labels'"),
        ({"values": ["a"]}, TypeError, "values must be real numbers, got dtype <U1"),
        ({"values": [1], "background": [1, 2]}, ValueError, "background must be one number or have shape (), got (2,)"),
        ({"values": np.array([1], np.uint8), "background": -1}, ValueError,
         "background must fit uint8, the dtype of values"),
        ({"values": "index", "sampling": "area"}, ValueError,
         "mixes colours, which must be uint8 or floats, got numbers"),
        ({"values": [1], "sampling": "msaa4"}, ValueError, "mixes colours, which must be uint8 or floats, got int64"),
        ({"background": 3}, ValueError, "background needs values"),
        ({"threads": 0}, ValueError, "threads must be at least 1, got 0"),
        ({"subpixel_bits": 17}, ValueError, "subpixel_bits must be in 0..16, got 17"),
        ({"origin": (0.5, 0)}, TypeError, "origin must be two integers"),
        ({"out": np.empty((5, 8))}, ValueError, "out must have shape (5, 8) and dtype bool"),
        ({"out": [1]}, TypeError, "out must be a NumPy array, got list"),
    ],
)  # fmt: skip
def test_bad_options_are_named(options, error, message):
    with pytest.raises(error, match=re.escape(message)):
        tl.polygons(SQUARE, SIZE, **options)


def test_bad_triangles_of_a_table_are_named():
    with pytest.raises(IndexError, match=re.escape("row 1 is [0, 1, 4]")):
        tl.overlap(SQUARE, SIZE, triangles=[[0, 1, 2], [0, 1, 4]])
    with pytest.raises(ValueError, match=re.escape("raster must have shape (5, 8), got (2, 2)")):
        tl.overlap([[SQUARE]], SIZE).means(np.zeros((2, 2)))
    for given in (np.full((5, 8), "1.5"), np.full((5, 8), 1j)):
        with pytest.raises(TypeError, match="raster must be real numbers, got dtype"):
            tl.overlap([[SQUARE]], SIZE).means(given)
    with pytest.raises(ValueError, match=re.escape("values must have shape (1,), a number for each polygon, got (2,)")):
        tl.overlap([[SQUARE]], SIZE).spread([1, 2])


def test_an_error_leaves_out_as_it_was():
    out = np.ones(SIZE[::-1], bool)
    with pytest.raises(ValueError, match="finite"):
        tl.polygons([(0, 0), (np.nan, 1), (2, 2)], SIZE, out=out)
    assert out.all()
