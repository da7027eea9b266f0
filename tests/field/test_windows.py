"""Windows of a field, labels, and grids of rasterio; labels of `fill`."""

import numpy as np
import pytest

import topleft as tl

RNG = np.random.default_rng(7)
POINTS = RNG.uniform(0, 10, (60, 2)) + [500000.0, 4.5e6]
TRIANGLES = RNG.integers(0, 60, (80, 3))
VALUES = RNG.normal(size=60)
GRID = tl.Grid.around((POINTS, TRIANGLES), size=(53, 41))


@pytest.mark.parametrize("origin", [(0, 0), (7, 11), (-5, 3), (53, 41)])
@pytest.mark.parametrize("window", [(20, 9), (60, 60), (0, 4)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("n", [80, 3])  # listed planes, or one at a time
def test_window_of_a_field_is_the_crop(origin, window, dtype, n):
    mesh, values = (POINTS, TRIANGLES[:n]), VALUES.astype(dtype)
    frame = np.full((300, 300), np.nan, dtype)
    frame[100 : 100 + 41, 100 : 100 + 53] = tl.field(mesh, values, GRID)
    around = tl.field(mesh, values, GRID, origin=(-100, -100), window=300)
    assert np.array_equal(around[100:141, 100:153], frame[100:141, 100:153], equal_nan=True)
    (x, y), (width, height) = origin, window
    crop = around[100 + y : 100 + y + height, 100 + x : 100 + x + width]
    assert np.array_equal(tl.field(mesh, values, GRID, origin=origin, window=window), crop, equal_nan=True)


def test_window_of_a_field_goes_to_the_end():
    whole = tl.field((POINTS, TRIANGLES), VALUES, GRID)
    found = tl.field((POINTS, TRIANGLES), VALUES, GRID, origin=(3, 5))
    assert np.array_equal(found, whole[5:, 3:], equal_nan=True)
    with pytest.raises(ValueError, match="origin must lie in the grid, of 53 x 41 pixels, or window be given"):
        tl.field((POINTS, TRIANGLES), VALUES, GRID, origin=(54, 0))


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, bool])
def test_labels_of_faces_stay_what_they_are(dtype):
    info = None if dtype is bool else np.iinfo(dtype)
    labels = RNG.integers(0, 2, 80).astype(bool) if info is None else RNG.integers(info.min, info.max, 80, dtype)
    nodata = 0 if info is None else 3
    found = tl.field((POINTS, TRIANGLES), labels, GRID, per="triangle", nodata=nodata)
    ids = tl.rasterize(GRID.to_pixels(POINTS), TRIANGLES, GRID.size, depth_test=None).triangle
    assert found.dtype == dtype
    assert np.array_equal(found, np.where(ids < 0, np.array(nodata, dtype), labels[ids]))
    same = tl.fill(GRID.to_pixels(POINTS), TRIANGLES, labels, GRID.size, dtype=dtype, background=nodata)
    assert same.dtype == dtype
    assert np.array_equal(same, found)


def test_nodata_takes_the_place_of_nan():
    whole = tl.field((POINTS, TRIANGLES), VALUES, GRID)
    found = tl.field((POINTS, TRIANGLES), VALUES, GRID, nodata=-9999)
    assert np.array_equal(found, np.where(np.isnan(whole), -9999, whole))


@pytest.mark.parametrize(
    ("labels", "nodata", "message"),
    [
        (np.zeros(80, np.uint8), -1, "nodata must be one of uint8, as the values are, got -1"),
        (np.zeros(80, np.uint8), 256, "nodata must be one of uint8"),
        (np.zeros(80, np.int32), 0.5, "nodata must be one of int32"),
    ],
)
def test_nodata_that_no_label_can_be_is_refused(labels, nodata, message):
    with pytest.raises(ValueError, match=message):
        tl.field((POINTS, TRIANGLES), labels, GRID, nodata=nodata)


def test_labels_are_drawn_over_what_is_there():
    out = np.full((2, 4), -7, np.int64)
    assert tl.fill([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], [2**40], (4, 2), dtype=np.int64, out=out) is out
    assert out.tolist() == [[2**40] * 3 + [-7], [2**40] * 2 + [-7] * 2]
    several = tl.fill([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], [[300, -2]], (4, 1), dtype=np.int16, background=(1, 2))
    assert several.tolist() == [[[300, -2]] * 3 + [[1, 2]]]
    kept = tl.Rasterizer((4, 1)).fill([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], [300], dtype=np.uint16)
    assert kept.tolist() == [[300, 300, 300, 0]]
    assert (
        tl.fill(np.empty((0, 2)), np.empty((0, 3), int), np.empty(0, int), 2, dtype=np.int32).tolist() == [[0, 0]] * 2
    )


@pytest.mark.parametrize(
    ("labels", "options", "message"),
    [
        ([300], {"dtype": np.uint8}, "colors must fit uint8, got 300..300"),
        ([3.5], {"dtype": np.int32}, "colors must be integers of shape"),
        ([3], {"dtype": np.float32}, "dtype must be one of integers, for labels, got float32"),
        ([3, 4, 5], {"dtype": np.int32}, "colors must have 1 rows, one per triangle, for labels, got 3"),
        ([3], {"dtype": np.int32, "per": "vertex"}, "per must be 'triangle' for labels, which do not mix"),
        ([3], {"dtype": np.int32, "blend": "add"}, "blend must be 'replace' for labels"),
        ([3], {"dtype": np.int32, "sampling": "area"}, "sampling must be 'center' for labels"),
        ([3], {"dtype": np.int32, "background": 0.5}, "background must be one int32"),
        ([300], {}, "dtype= fills labels"),
    ],
)
def test_labels_that_do_not_fit_are_refused(labels, options, message):
    with pytest.raises((TypeError, ValueError), match=message):
        tl.fill([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], labels, (4, 2), **{"per": "triangle", **options})


@pytest.mark.parametrize("y", ["up", "down"])
def test_transform_of_a_grid_makes_the_grid(y):
    grid = tl.Grid((4, 3), (500000.0, 500002.0, 10.0, 11.5), y)
    a, b, c, d, e, f = grid.transform
    assert tl.Grid.from_transform(grid.transform, (4, 3)) == grid
    assert tl.Grid.from_transform([[a, b, c], [d, e, f], [0, 0, 1]], (4, 3)) == grid  # affine.Affine has nine
    assert (c + 0.5 * a, f + 0.5 * e) == (grid.x_centers[0], grid.y_centers[0])


@pytest.mark.parametrize(
    ("transform", "message"),
    [
        ((0.5, 0.1, 0, 0, -0.5, 0), "transform must neither turn nor mirror"),
        ((-0.5, 0, 0, 0, -0.5, 0), "transform must neither turn nor mirror"),
        ((0.5, 0, 0), "transform must be six finite numbers"),
        (3, "transform must be six finite numbers"),
        ((0.5, 0, np.nan, 0, -0.5, 0), "transform must be six finite numbers"),
    ],
)
def test_transform_that_is_no_grid_is_refused(transform, message):
    with pytest.raises(ValueError, match=message):
        tl.Grid.from_transform(transform, (4, 3))
