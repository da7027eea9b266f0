"""The engine for rasterix: its functions, called as rasterix 0.2 calls those of its own engines, against rasterio."""

import numpy as np
import pytest

import topleft.rasterix as engine

affine = pytest.importorskip("affine")
features = pytest.importorskip("rasterio.features")
shapely = pytest.importorskip("shapely")

SHAPE = (63, 70)
GRID = affine.Affine(0.5, 0, 10, 0, -0.5, 40)
RNG = np.random.default_rng(40)
PARCELS = [shapely.Point(*RNG.uniform((10, 8), (45, 40))).buffer(RNG.uniform(0.5, 6)) for _ in range(30)]


@pytest.mark.parametrize("all_touched", [False, True])
def test_numbers_and_mask_are_those_of_rasterio(all_touched):
    common = {"affine": GRID, "shape": SHAPE, "all_touched": all_touched}
    rows = zip(PARCELS, range(5, 35), strict=True)
    expected = features.rasterize(rows, SHAPE, 99, transform=GRID, all_touched=all_touched, dtype=np.uint8)
    found = engine.rasterize_geometries(PARCELS, dtype=np.uint8, offset=5, fill=99, **common)
    assert found.dtype == np.uint8
    assert np.array_equal(found, expected)
    mask = engine.np_geometry_mask(PARCELS, **common)
    assert np.array_equal(mask, expected == 99)
    assert np.array_equal(engine.np_geometry_mask(PARCELS, invert=True, **common), ~mask)


def test_blocks_are_parts_of_the_whole():
    rows = np.array(PARCELS, object)[:, None, None]
    whole = engine.rasterize_geometries(PARCELS, dtype=np.int16, offset=1, fill=0, affine=GRID, shape=SHAPE)
    place = [np.array([[[n]]]) for n in (17, 9, 40, 31)]  # x, y, width, height
    part = engine.dask_rasterize_wrapper(rows, *place, np.array([[[1]]]), affine=GRID, dtype_=np.int16, fill=0)
    assert np.array_equal(part, whole[None, 9:40, 17:57])
    mask = engine.dask_mask_wrapper(rows, *place, affine=GRID)
    assert np.array_equal(mask, whole[None, 9:40, 17:57] == 0)


def test_no_polygons_leave_the_background():
    common = {"affine": GRID, "shape": (2, 3)}
    empty = engine.rasterize_geometries([], dtype=np.uint8, offset=0, fill=7, **common)
    assert empty.tolist() == [[7, 7, 7]] * 2
    assert engine.np_geometry_mask([], **common).all()


def test_sums_of_numbers_are_refused():
    with pytest.raises(NotImplementedError, match="later polygons over earlier ones, got merge_alg 'add'"):
        engine.rasterize_geometries(PARCELS, dtype=int, offset=0, fill=0, affine=GRID, shape=SHAPE, merge_alg="add")
