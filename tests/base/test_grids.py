"""Grids with a CRS and a number of no data: of rasters of others, on verbs, in files and arrays of others."""

import numpy as np
import pytest

import topleft as tl

SQUARE = [(1, 1), (3, 1), (3, 3), (1, 3)]
MESH = [[0, 0, 5], [4, 0, 5], [0, 4, 5]], [[0, 1, 2]]
GRID = tl.Grid((6, 4), (0, 6, 0, 4), crs="EPSG:25832", nodata=-9999)


class Named:
    """Polygons that say their CRS, as a GeoSeries does."""

    def __init__(self, crs):
        self.crs = crs
        self.__geo_interface__ = {"type": "Polygon", "coordinates": [SQUARE]}


@pytest.mark.parametrize("crs", ["EPSG:25832", 25832])
def test_grid_keeps_its_crs_as_text(crs):
    assert tl.Grid(4, (0, 1, 0, 1), crs=crs).crs == "EPSG:25832"


def test_grid_takes_the_crs_of_other_libraries():
    pyproj = pytest.importorskip("pyproj")
    assert tl.Grid(4, (0, 1, 0, 1), crs=pyproj.CRS(25832)).crs == "EPSG:25832"


def test_grid_without_crs_prints_as_before():
    assert repr(tl.Grid(4, (0, 1, 0, 1))) == "Grid(size=(4, 4), extent=(0.0, 1.0, 0.0, 1.0), y='up')"
    assert repr(GRID).endswith("y='up', crs='EPSG:25832', nodata=-9999)")


def test_bounds_for_an_extent_are_told_where_they_can_be():
    coords = pytest.importorskip("rasterio.coords")
    for bounds in ((0, 0, 5, 12), coords.BoundingBox(0, 3, 5, 12)):
        with pytest.raises(ValueError, match=rf"top\) have extent=\(0.0, 5.0, {float(bounds[1])}, 12.0\)"):
            tl.Grid(4, bounds)
    with pytest.raises(ValueError, match=r"got 0.0, 4.0, 2.0, 1.0$"):
        tl.Grid(4, (0, 4, 2, 1))


@pytest.mark.parametrize(
    ("more", "said"), [({"crs": 1.5}, "crs must be an EPSG code"), ({"nodata": "x"}, "nodata must")]
)
def test_grid_refuses_what_is_no_crs_and_no_number(more, said):
    with pytest.raises(TypeError, match=said):
        tl.Grid(4, (0, 1, 0, 1), **more)


def test_like_of_a_raster_of_rasterio_is_its_grid(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    profile = {"width": 6, "height": 4, "count": 1, "dtype": "float32", "crs": "EPSG:25832", "nodata": -9999}
    with rasterio.open(tmp_path / "a.tif", "w", driver="GTiff", transform=GRID.transform, **profile) as out:
        out.write(np.zeros((4, 6), np.float32), 1)
    assert tl.Grid.like(tmp_path / "a.tif") == GRID
    with rasterio.open(tmp_path / "a.tif") as dataset:
        assert tl.Grid.like(dataset) == GRID


@pytest.mark.parametrize("y", ["up", "down"])
def test_like_of_an_array_of_xarray_is_its_grid(y):
    pytest.importorskip("xarray")
    grid = tl.Grid((6, 4), (0, 6, 0, 4), y, "EPSG:25832", -1)
    assert tl.Grid.like(grid.to_xarray(np.zeros((4, 6)))) == grid


@pytest.mark.parametrize("code", ['AUTHORITY["EPSG","25832"]', 'ID["EPSG",25832]'])
def test_like_takes_the_code_that_well_known_text_ends_with(code):
    """As rioxarray's `write_crs` and `to_raster` leave it, in both versions of the text."""
    pytest.importorskip("xarray")
    grid = tl.Grid((6, 4), (0.0, 6.0, 0.0, 4.0), crs="EPSG:25832")
    array = grid.to_xarray(np.zeros((4, 6)))
    array.coords["spatial_ref"].attrs["spatial_ref"] = (
        f'PROJCS["UTM 32N",GEOGCS["ETRS89",AUTHORITY["EPSG","4258"]],{code}]'
    )
    assert tl.Grid.like(array) == grid
    array.coords["spatial_ref"].attrs["spatial_ref"] = 'PROJCS["own",GEOGCS["ETRS89",AUTHORITY["EPSG","4258"]]]'
    assert tl.Grid.like(array).crs.startswith('PROJCS["own"')


def test_a_number_as_text_is_a_code():
    assert tl.Grid((6, 4), (0, 6, 0, 4), crs="25832") == tl.Grid((6, 4), (0, 6, 0, 4), crs=25832)


def test_like_of_uneven_coordinates_is_refused():
    xr = pytest.importorskip("xarray")
    array = xr.DataArray(np.zeros((3, 3)), coords={"lat": [0, 1, 3], "lon": [0, 1, 2]}, dims=["lat", "lon"])
    with pytest.raises(ValueError, match="coordinate lat must be evenly spaced"):
        tl.Grid.like(array)
    with pytest.raises(ValueError, match="like needs coordinates x and y"):
        tl.Grid.like(array.rename(lat="a"))
    with pytest.raises(TypeError, match="like takes a dataset of rasterio"):
        tl.Grid.like(5)


def test_array_of_xarray_says_its_crs_to_rioxarray():
    pytest.importorskip("rioxarray")
    array = GRID.to_xarray(tl.polygons(SQUARE, GRID, values=np.float32([5])))
    assert (array.rio.crs.to_epsg(), array.rio.nodata) == (25832, -9999)
    assert tuple(array.rio.transform())[:6] == GRID.transform


def test_array_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r"array must have shape \(4, 6\)"):
        GRID.to_xarray(np.zeros((6, 4)))


def test_no_data_of_a_grid_is_what_verbs_leave():
    inside = tl.polygons(SQUARE, GRID)
    values = tl.polygons(SQUARE, GRID, values=np.float32([5]))
    assert np.array_equal(values, np.where(inside, 5, -9999))
    assert tl.polygons(SQUARE, GRID, values="index").min() == -1
    field = tl.field(MESH, [1.0, 1.0, 1.0], GRID)
    assert sorted(np.unique(field)) == [-9999, 1]
    heights = tl.height_map(MESH, GRID)
    assert np.array_equal(heights, np.where(field == 1, 5, -9999))
    for kind, more, whole in (("field", {"values": [1.0, 1.0, 1.0]}, field), ("height_map", {}, heights)):
        raster = tl.tiles(MESH, GRID, kind=kind, window=3, **more)
        assert np.array_equal(raster[:], whole)
        assert np.array_equal(np.concatenate([w.pixels.ravel() for w in raster]).sum(), whole.sum())


def test_no_data_of_a_grid_does_not_count_in_means():
    raster = np.full((4, 6), 2.0)
    raster[1, 1] = -9999
    table = tl.overlap([[SQUARE]], GRID)
    assert table.means(raster).tolist() == [2]
    assert table.means(raster, nodata=7).tolist() != [2]


def test_means_refuse_a_raster_that_lies_elsewhere():
    xarray = pytest.importorskip("xarray")
    table = tl.overlap([[SQUARE]], GRID)
    raster = GRID.to_xarray(np.arange(24.0).reshape(4, 6))
    expected = table.means(raster.values)
    for same in (raster, raster.assign_coords(x=raster.x.astype("f4") + 0.04), xarray.DataArray(raster.values)):
        assert table.means(same) == expected
    for other, what in ((raster[::-1], "rows"), (raster.assign_coords(x=raster.x + 0.06), "columns")):
        with pytest.raises(ValueError, match=f"raster must lie on the grid of the table: its {what} have centres from"):
            table.means(other)
    assert tl.overlap([[SQUARE]], GRID.size).means(raster) == expected


def test_means_refuse_a_dataset_that_lies_elsewhere():
    class Dataset:
        count, width, height, transform = 1, 6, 4, (1, 0, 0, 0, -1, 4)

        def read(self, band, masked):
            return np.ones((4, 6))

    table, dataset = tl.overlap([[SQUARE]], GRID), Dataset()
    assert table.means(dataset) == 1
    dataset.transform = (1, 0, 0, 0, 1, 0)  # rasterio's for a file that says nothing
    assert table.means(dataset) == 1
    for transform, said in (((1, 0, 1, 0, -1, 4), "its columns have"), ((1, 0.1, 0, 0, -1, 4), "one that is turned")):
        dataset.transform = transform
        with pytest.raises(ValueError, match=f"raster must lie on the grid of the table.*{said}"):
            table.means(dataset)


@pytest.mark.parametrize("verb", [tl.polygons, tl.overlap])
def test_polygons_of_another_crs_are_refused_by_name_and_transformed_on_request(verb):
    pyproj = pytest.importorskip("pyproj")
    with pytest.raises(
        ValueError, match="rings must be of the CRS of the grid, EPSG:25832, got EPSG:4326: crs='EPSG:4326'"
    ):
        verb(Named("EPSG:4326"), GRID)
    change = pyproj.Transformer.from_crs(25832, 4326, always_xy=True)
    far = tl.Grid((600, 400), (500000, 500600, 5600000, 5600400), crs=25832)
    ring = np.array(SQUARE) * 100 + (500000, 5600000)
    degrees = np.column_stack(change.transform(*ring.T))
    found, expected = verb([degrees], far, crs=4326), verb([ring], far)
    if verb is tl.polygons:
        assert np.array_equal(found, expected)
    else:
        assert found.totals() == pytest.approx(expected.totals())
    verb(Named("EPSG:25832"), GRID)
    with pytest.raises(ValueError, match="crs needs a Grid with a CRS"):
        verb([SQUARE], (6, 4), crs=4326)


def test_points_that_a_crs_has_no_place_for_are_named():
    pytest.importorskip("pyproj")
    with pytest.raises(ValueError, match=r"EPSG:25832 has no place for point 2, \[9, 95\]"):
        tl.polygons([[(9, 50), (10, 50), (9, 95)]], GRID, crs=4326)


def test_tif_of_a_grid_says_where_it_lies(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    for name, picture in (("a.tif", np.arange(24, dtype=np.int32)), ("b.tif", np.arange(24, dtype=np.float32))):
        tl.save_image(tmp_path / name, picture.reshape(4, 6), grid=GRID)
        with rasterio.open(tmp_path / name) as found:
            assert tl.Grid.like(found) == GRID
            assert np.array_equal(found.read(1), picture.reshape(4, 6))
    with pytest.raises(ValueError, match="image must have the shape of the grid"):
        tl.save_image(tmp_path / "a.tif", np.zeros((6, 4), np.uint8), grid=GRID)
    with pytest.raises(tl.ImageError, match=r"a grid goes into \.tif only"):
        tl.save_image(tmp_path / "a.png", np.zeros((4, 6), np.uint8), grid=GRID)


def test_tif_of_a_height_map_keeps_its_floats_of_64_bits(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    heights = tl.height_map(tl.Mesh([(0, 0, 0.1), (6, 0, 1 / 3), (0, 4, 7)], [(0, 1, 2)]), GRID)
    tl.save_image(tmp_path / "a.tif", heights, grid=GRID)
    assert heights.max() > 0
    with rasterio.open(tmp_path / "a.tif") as found:
        assert (found.dtypes, tl.Grid.like(found)) == (("float64",), GRID)
        assert found.read(1).tobytes() == heights.tobytes()


def test_geotiff_of_tiles_takes_the_crs_of_the_grid(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    pytest.importorskip("pyproj")
    tl.tiles(MESH, GRID, kind="height_map").to_geotiff(tmp_path / "a.tif", tile=16)
    with rasterio.open(tmp_path / "a.tif") as found:
        assert tl.Grid.like(found) == GRID
