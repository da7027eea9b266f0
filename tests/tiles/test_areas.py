"""Polygons as huge rasters: every window is the crop of what `polygons` draws, and files hold what it draws."""

import pickle

import numpy as np
import pytest
from polygon_cases import wild_polygon

import topleft as tl
from topleft._apps.tiles.dask_array import WindowJob

GRID = tl.Grid((120, 90), (1000.0, 1240.0, 2000.0, 2180.0))
RNG = np.random.default_rng(3)


def parcels(n=40):
    """Stars of a hole each, some of them far out, in the units of the grid."""
    angles = np.linspace(0, 2 * np.pi, 9)[:-1]
    found = []
    for x, y, radius in np.column_stack([RNG.uniform(960, 1280, n), RNG.uniform(1960, 2220, n), RNG.uniform(2, 60, n)]):
        own = radius * RNG.uniform(0.5, 1, 8)
        ring = np.column_stack([x + own * np.cos(angles), y + own * np.sin(angles)])
        found.append([ring, (ring - (x, y)) / 3 + (x, y)])
    return found


PARCELS = parcels()
KINDS = {
    "labels": ({"kind": "labels"}, {"values": "index"}),
    "inner": ({"kind": "labels", "sampling": "inner"}, {"values": "index", "sampling": "inner"}),
    "mask": ({"kind": "coverage", "sampling": "outer"}, {"sampling": "outer"}),
    "area": ({"kind": "coverage", "sampling": "area"}, {"sampling": "area"}),
    "msaa": ({"kind": "coverage", "sampling": "msaa4", "rule": "nonzero"}, {"sampling": "msaa4", "rule": "nonzero"}),
    "values": (
        {"kind": "fill", "values": np.arange(40) / 4, "background": 9},
        {"values": np.arange(40) / 4, "background": 9},
    ),
    "colors": ({"kind": "fill", "values": np.arange(120, dtype=np.uint8).reshape(40, 3)},
               {"values": np.arange(120, dtype=np.uint8).reshape(40, 3)}),
}  # fmt: skip


@pytest.mark.parametrize("window", [17, (32, 16), 500])
@pytest.mark.parametrize("kind", KINDS)
def test_windows_of_polygons_are_the_crop_of_the_whole(kind, window):
    of_tiles, of_verb = KINDS[kind]
    raster, whole = tl.tiles(PARCELS, GRID, window=window, **of_tiles), tl.polygons(PARCELS, GRID, **of_verb)
    assert (raster.shape, raster.dtype) == (whole.shape, whole.dtype)
    assert np.array_equal(raster[:], whole)
    for one in raster:
        assert np.array_equal(one.pixels, whole[one.slices])


@pytest.mark.parametrize("seed", range(5))
def test_windows_of_wild_rings_are_the_crop_of_the_whole(seed):
    rings = [wild_polygon(np.random.default_rng(100 * seed + i)) for i in range(3)]
    raster = tl.tiles(rings, (24, 20), window=5, threads=2)
    assert np.array_equal(raster[:], tl.polygons(rings, (24, 20), values="index"))


def test_polygons_of_each_form_are_told_from_meshes():
    square = [(0, 0), (6, 0), (6, 6), (0, 6)]
    geojson = {"type": "Polygon", "coordinates": [square]}
    offsets = np.array(square, float), np.array([0, 4]), np.array([0, 1])
    for form in ([[square]], [[np.array(square)]], geojson, [geojson], offsets):
        assert repr(tl.tiles(form, (6, 6))).endswith("1 polygons)")
    for mesh in (([[0, 0], [6, 0], [0, 6]], [[0, 1, 2]]), [[[0, 0], [6, 0], [0, 6]], [[0, 1, 2]]]):
        assert repr(tl.tiles(mesh, (6, 6))).endswith("1 triangles)")


def test_geometries_of_shapely_are_taken():
    shapely = pytest.importorskip("shapely")
    boxes = [shapely.box(0, 0, 3, 3), shapely.box(2, 2, 9, 9)]
    assert np.array_equal(tl.tiles(boxes, (9, 9), window=4)[:], tl.polygons(boxes, (9, 9), values="index"))


def test_windows_that_no_polygon_meets_are_blank_and_cost_nothing():
    raster = tl.tiles([[[(5, 5), (9, 5), (9, 9)]]], (100_000, 100_000), window=1000)
    assert raster.index.n_spans == 1
    assert int((raster.index.counts > 0).sum()) == 1
    assert (raster[50_000:50_010, 70_000:70_010] == -1).all()


def test_polygons_far_outside_and_without_points_touch_no_window():
    offsets = np.array([[-90, -90], [-80, -90], [-80, -80]], float), np.array([0, 3]), np.array([0, 0, 1])
    raster = tl.tiles(offsets, (20, 20), window=8)
    assert raster.index.n_spans == 0
    assert (raster[:] == -1).all()


def test_dask_workers_get_the_polygons_of_their_window():
    pytest.importorskip("dask.array")
    raster = tl.tiles(PARCELS, GRID, window=32, kind="fill", values=np.arange(40, dtype=np.float32))
    whole = tl.polygons(PARCELS, GRID, values=np.arange(40, dtype=np.float32))
    assert np.array_equal(raster.to_dask().compute(scheduler="threads"), whole)
    job = pickle.loads(pickle.dumps(WindowJob(raster, 1, 2)))
    assert len(job.payload.triangles) < 40
    assert np.array_equal(job(), whole[32:64, 64:96])


def test_geotiff_of_polygons_says_where_it_lies_and_resumes(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    pytest.importorskip("pyproj")
    grid = tl.Grid(GRID.size, GRID.extent, crs="EPSG:25832", nodata=255)
    values = np.arange(40, dtype=np.uint8)
    raster = tl.tiles(PARCELS, grid, window=32, kind="fill", values=values)
    raster.to_geotiff(tmp_path / "a.tif", tile=16)
    with rasterio.open(tmp_path / "a.tif") as found:
        assert tl.Grid.like(found) == grid
        assert np.array_equal(found.read(1), tl.polygons(PARCELS, grid, values=values))
        assert set(np.unique(found.read(1, out_shape=(45, 60)))) <= {*range(40), 255}  # halvings mix no values
    assert raster.to_geotiff(tmp_path / "a.tif", tile=16, resume=True).n_drawn == 0


def test_zarr_of_polygons_is_the_raster(tmp_path):
    zarr = pytest.importorskip("zarr")
    tl.tiles(PARCELS, GRID, window=32).to_zarr(tmp_path / "a.zarr")
    assert np.array_equal(zarr.open(tmp_path / "a.zarr")["labels"][:], tl.polygons(PARCELS, GRID, values="index"))


@pytest.mark.parametrize(
    ("more", "error", "said"),
    [
        ({"kind": "depth"}, ValueError, "kind must be 'labels', 'coverage' or 'fill' for polygons, got 'depth'"),
        ({"kind": "fill"}, ValueError, "kind 'fill' needs values"),
        ({"values": [1.0]}, ValueError, "values are for the kinds 'fill' and 'field', got .* for 'labels'"),
        ({"kind": "coverage", "background": 1}, ValueError, "background needs values"),
        ({"cull": "back"}, TypeError, "kind 'labels' has no option 'cull'; its options are assume_valid"),
        ({"kind": "fill", "values": [1.0, 2.0]}, ValueError, "values must have shape"),
    ],
)
def test_what_polygons_do_not_have_is_refused(more, error, said):
    with pytest.raises(error, match=said):
        tl.tiles([[[(0, 0), (6, 0), (0, 6)]]], (6, 6), **more)


def test_polygons_of_another_crs_are_refused_by_name():
    geopandas = pytest.importorskip("geopandas")
    shapely = pytest.importorskip("shapely")
    rings = geopandas.GeoSeries([shapely.Polygon([(9, 50), (9, 51), (10, 51)])], crs="EPSG:4326")
    grid = tl.Grid((10, 10), (400000, 600000, 5500000, 5700000), crs="EPSG:25832")
    with pytest.raises(ValueError, match="rings must be of the CRS of the grid, EPSG:25832, got EPSG:4326"):
        tl.tiles(rings, grid)
    whole = tl.polygons(rings.to_crs(25832), grid, values="index")
    assert np.array_equal(tl.tiles(rings, grid, crs=rings.crs)[:], whole)
    assert (whole == 0).any()


def test_extent_is_that_of_the_polygons_unless_given():
    raster = tl.tiles([[[(2, 3), (6, 3), (6, 9)]]], pixel_size=0.5)
    assert raster.grid == tl.Grid((8, 12), (2, 6, 3, 9))
