"""Rasters as lazy arrays of Dask and xarray: slicing draws the windows that it needs, which carry their triangles."""

import pickle

import numpy as np
import pytest

import topleft as tl
from topleft._apps.tiles.dask_array import WindowJob
from topleft._meshes.windows.raster import MappedJob, SentJob

RNG = np.random.default_rng(8)
POINTS = RNG.uniform([1000, 2000, 0], [1090, 2061, 9], (80, 3))
TRIANGLES = RNG.integers(0, 80, (60, 3)).astype(np.int32)
GRID = tl.Grid((90, 61), (1000.0, 1090.0, 2000.0, 2061.0))
KINDS = {
    "labels": {},
    "coverage": {"sampling": "area"},
    "fill": {"values": RNG.integers(0, 256, (60, 3)).astype(np.uint8)},
    "field": {"values": RNG.normal(size=80)},
    "height_map": {},
}


def raster_of(kind, mesh=(POINTS, TRIANGLES)):
    return tl.tiles(mesh, GRID, kind=kind, window=32, **KINDS[kind])


@pytest.mark.parametrize("kind", KINDS)
def test_dask_array_is_the_raster(kind):
    pytest.importorskip("dask.array", reason="the dask extra is not installed")
    raster = raster_of(kind)
    array = raster.to_dask()
    assert (array.shape, array.dtype) == (raster.shape, raster.dtype)
    assert array.chunks[:2] == ((32, 29), (32, 32, 26))
    assert np.array_equal(array.compute(scheduler="threads"), raster[:], equal_nan=raster.dtype.kind == "f")


@pytest.mark.parametrize("size", [(0, 5), (5, 0)])
@pytest.mark.parametrize("kind", ["labels", "coverage", "fill"])
def test_dask_array_without_pixels_has_its_dtype(kind, size):
    pytest.importorskip("dask.array", reason="the dask extra is not installed")
    raster = tl.tiles((POINTS, TRIANGLES), size, kind=kind, **KINDS[kind])
    array = raster.to_dask()
    assert (array.shape, array.dtype) == (raster.shape, raster.dtype)
    assert array.compute().shape == raster.shape


def test_slices_of_a_dask_array_draw_what_they_need(monkeypatch):
    pytest.importorskip("dask.array", reason="the dask extra is not installed")
    raster = raster_of("labels")
    drawn, draw = [], type(raster).draw_window

    def draw_and_note(self, row, column, **options):
        drawn.append((row, column))
        return draw(self, row, column, **options)

    monkeypatch.setattr(type(raster), "draw_window", draw_and_note)
    array = raster.to_dask()
    assert drawn == []
    part = array[40:50, 60:70].compute(scheduler="sync")
    assert sorted(drawn) == [(1, 1), (1, 2)]
    monkeypatch.undo()
    assert np.array_equal(part, raster[40:50, 60:70])


@pytest.mark.parametrize("kind", KINDS)
def test_sent_window_carries_its_triangles_alone(kind):
    raster = raster_of(kind)
    sent = pickle.loads(pickle.dumps(WindowJob(raster, 1, 2)))
    assert isinstance(sent, SentJob)
    assert len(sent.payload.triangles) == raster.index.counts[1, 2] < 60
    assert sent.painter is not raster.painter
    assert np.array_equal(sent(), raster[32:, 64:], equal_nan=raster.dtype.kind == "f")


def test_sent_window_of_mapped_files_carries_their_names(tmp_path):
    np.save(tmp_path / "v.npy", POINTS)
    np.save(tmp_path / "t.npy", TRIANGLES)
    raster = raster_of("height_map", (tmp_path / "v.npy", tmp_path / "t.npy"))
    content = pickle.dumps(WindowJob(raster, 0, 0))
    assert str(tmp_path / "v.npy").encode() in content
    assert len(content) < POINTS.nbytes
    sent = pickle.loads(content)
    assert isinstance(sent, MappedJob)
    assert np.array_equal(sent(), raster[:32, :32], equal_nan=True)


def test_xarray_has_the_centres_of_the_pixels():
    pytest.importorskip("dask.array", reason="the dask extra is not installed")
    pytest.importorskip("xarray", reason="xarray is not installed")
    data = raster_of("height_map").to_xarray()
    assert (data.dims, data.name) == (("y", "x"), "height_map")
    assert np.array_equal(data.x, GRID.x_centers)
    assert np.array_equal(data.y, GRID.y_centers)
    assert np.isnan(data.attrs["nodata"])
    at = data.sel(x=1040.5, y=2030.5, method="nearest").compute()
    assert np.array_equal(at, raster_of("height_map")[30, 40], equal_nan=True)
    assert raster_of("fill").to_xarray().dims == ("y", "x", "channel")
