"""Rasters in files: Zarr, GeoTIFF, Deep Zoom; what was killed goes on and ends up the same."""

import contextlib
import io
import itertools
import json
import os
import shutil
import subprocess
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from comparing import files_of
from PIL import Image

import topleft as tl
from topleft._apps.tiles.deepzoom import halved_colors
from topleft._apps.tiles.geotiff import differences, sums
from topleft._apps.tiles.levels import halved

SRC = str(Path(tl.__file__).parents[1])
CHILD = {**os.environ, "PYTHONPATH": SRC}
RNG = np.random.default_rng(6)
POINTS = RNG.uniform([500000, 5000000, 0], [500300, 5000200, 9], (200, 3))
POINTS[:, 0] -= np.where(POINTS[:, 0] > 500150, 0, 20)
TRIANGLES = RNG.integers(0, 200, (60, 3)).astype(np.int32)
GRID = tl.Grid((300, 200), (500000.0, 500300.0, 5000000.0, 5000200.0))
CORNER = (POINTS, TRIANGLES[:6])

KINDS = {
    "labels": {},
    "depth": {"kind": "depth"},
    "coverage": {"kind": "coverage"},
    "shares": {"kind": "coverage", "sampling": "area"},
    "overdraw": {"kind": "overdraw"},
    "colors": {"kind": "fill", "values": RNG.integers(0, 256, (60, 3)).astype(np.uint8)},
    "alpha": {"kind": "fill", "values": RNG.integers(0, 256, (60, 4)).astype(np.uint8)},
    "field": {"kind": "field", "values": RNG.normal(size=200).astype(np.float32), "nodata": -9999.0},
    "vectors": {"kind": "field", "values": RNG.normal(size=(200, 2))},
    "height_map": {"kind": "height_map"},
    "int16": {"kind": "field", "values": np.arange(60, dtype=np.int16), "nodata": -1},
}


def raster_of(kind, window=64, mesh=(POINTS, TRIANGLES)):
    return tl.tiles(mesh, GRID, window=window, **KINDS[kind])


def equal(found, wished):
    return np.array_equal(found, wished, equal_nan=np.asarray(wished).dtype.kind == "f")


# Zarr


@pytest.mark.parametrize(
    ("kind", "window", "options"),
    [
        *((kind, 64, {"chunk": chunk}) for kind in KINDS for chunk in (None, (32, 16))),
        *(("labels", 2048, {"chunk": chunk}) for chunk in (64, 512)),
        *(("labels", 64, {"compression": compression}) for compression in ("gzip", "zstd", "none")),
    ],
)
def test_zarr_is_the_raster(tmp_path, kind, window, options):
    zarr = pytest.importorskip("zarr", reason="the tiles extra is not installed")
    raster = raster_of(kind, window)
    raster.to_zarr(tmp_path / "a.zarr", **options)
    found = zarr.open_array(tmp_path / "a.zarr" / raster.kind, mode="r")
    assert (found.shape, found.dtype) == (raster.shape, raster.dtype)
    assert window == 64 or found.chunks == (options["chunk"],) * 2
    assert equal(found[:], raster[:])


def test_zarr_chunks_can_be_read_without_a_package(tmp_path):
    raster = raster_of("labels")
    written = raster.to_zarr(tmp_path / "a.zarr", compression="none")
    assert (written.n_drawn, written.n_kept, written.n_blank) == (19, 0, 1)
    said = json.loads((tmp_path / "a.zarr/labels/zarr.json").read_text())
    assert (said["shape"], said["fill_value"], said["dimension_names"]) == ([200, 300], -1, ["y", "x"])
    chunk = np.frombuffer((tmp_path / "a.zarr/labels/c/1/2").read_bytes(), "<i4").reshape(64, 64)
    assert equal(chunk, raster[64:128, 128:192])


def test_zarr_levels_are_halves(tmp_path):
    zarr = pytest.importorskip("zarr", reason="the tiles extra is not installed")
    for kind, window in (("labels", (64, 16)), ("field", 64), ("colors", 64)):
        raster = raster_of(kind, window)
        raster.to_zarr(tmp_path / kind, levels=3)
        group = zarr.open_group(tmp_path / kind, mode="r")
        assert group.attrs["ome"]["multiscales"][0]["datasets"][2]["path"] == f"2/{raster.kind}"
        level = raster[:]
        for i in range(3):
            assert equal(group[f"{i}/{raster.kind}" if i else raster.kind][:], level), (kind, i)
            level = halved(level, raster.painter.nodata, is_mean=raster.has_means)


@pytest.mark.parametrize("levels", [1, 3])
@pytest.mark.parametrize("grid", [GRID, tl.Grid((300, 200), GRID.extent, "down")])
def test_zarr_opens_in_xarray_with_coordinates_and_crs(tmp_path, levels, grid):
    pytest.importorskip("zarr", reason="the tiles extra is not installed")
    xarray = pytest.importorskip("xarray", reason="the tiles extra is not installed")
    raster = tl.tiles((POINTS, TRIANGLES), replace(grid, crs="EPSG:25832"), window=64, **KINDS["field"])
    raster.to_zarr(tmp_path / "a.zarr", levels=levels)
    found = xarray.open_zarr(tmp_path / "a.zarr")
    assert equal(found["field"].values, raster[:])
    assert tl.Grid.like(found["field"]) == replace(raster.grid, nodata=-9999.0)
    for level in range(1, levels):
        half = xarray.open_zarr(tmp_path / "a.zarr", group=str(level))
        assert half["field"].shape == (200 >> level, 300 >> level)
        x, y = (found[name].values.reshape(-1, 2**level).mean(axis=1) for name in "xy")
        assert np.array_equal(half["x"], x)
        assert np.array_equal(half["y"], y)


def test_zarr_in_pixels_opens_in_xarray(tmp_path):
    xarray = pytest.importorskip("xarray", reason="the tiles extra is not installed")
    pytest.importorskip("zarr", reason="the tiles extra is not installed")
    raster = tl.tiles((POINTS - [500000, 5000000, 0], TRIANGLES), (300, 200), window=64)
    raster.to_zarr(tmp_path / "a.zarr")
    found = xarray.open_zarr(tmp_path / "a.zarr")
    assert (list(found.data_vars), list(found.coords)) == (["labels"], [])
    assert equal(found["labels"].values, raster[:])


@pytest.mark.parametrize("window", [(100, 50), 64, 300])
def test_levels_do_not_depend_on_the_windows(tmp_path, window):
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    raster_of("field", 32).to_geotiff(tmp_path / "a.tif", tile=16, compression="none")
    raster = raster_of("field", (96, 64) if window == (100, 50) else window)
    raster.to_geotiff(tmp_path / "b.tif", tile=16, compression="none")
    with tifffile.TiffFile(tmp_path / "a.tif") as one, tifffile.TiffFile(tmp_path / "b.tif") as other:
        assert len(one.pages) == len(other.pages) == 6
        for a, b in zip(one.pages, other.pages, strict=True):
            assert equal(a.asarray(), b.asarray())


def test_means_leave_out_what_has_no_data():
    pixels = np.array([[1.0, 3, -9], [5, -9, -9], [2, -9, 4]], np.float32)
    assert halved(pixels, -9.0, is_mean=True).tolist() == [[3.0, -9.0], [2.0, 4.0]]
    assert halved(np.array([[1, 2], [np.nan, np.nan]]), np.nan, is_mean=True).tolist() == [[1.5]]
    assert halved(np.array([[255, 254], [255, 255]], np.uint8), None, is_mean=True).tolist() == [[255]]
    assert halved(np.array([[7, 2, 3]]), None, is_mean=False).tolist() == [[7, 3]]


def test_zarr_goes_to_what_fsspec_reaches():
    fsspec = pytest.importorskip("fsspec", reason="the tiles extra is not installed")
    raster = raster_of("labels")
    assert raster.to_zarr("memory://bucket/a.zarr", compression="none").n_drawn == 19
    stored = fsspec.filesystem("memory").cat_file("/bucket/a.zarr/labels/c/0/1")
    assert equal(np.frombuffer(stored, "<i4").reshape(64, 64), raster[:64, 64:128])
    assert raster.to_zarr("memory://bucket/a.zarr", compression="none", resume=True).n_kept == 19


def test_url_that_cannot_be_written_to_is_told():
    pytest.importorskip("fsspec", reason="the tiles extra is not installed")
    with pytest.raises(ValueError, match=r"cannot write to data://x\.zarr/zarr\.json: Read only filesystem"):
        raster_of("labels").to_zarr("data://x.zarr")


def test_store_that_refuses_once_is_named_and_resumed(monkeypatch):
    fsspec = pytest.importorskip("fsspec", reason="the tiles extra is not installed")
    store = type(fsspec.filesystem("memory"))
    raster, put = raster_of("labels"), store.pipe_file
    whole = "memory://bucket/whole.zarr"
    raster.to_zarr(whole, levels=2)
    names = store().find("/bucket/whole.zarr")
    for n_before in range(0, len(names), 5):
        refused = itertools.count(-n_before)

        def refuse(self, path, value, refused=refused, **options):
            if next(refused) == 0:
                raise PermissionError(13, "denied")
            return put(self, path, value, **options)

        url = f"memory://bucket/refused{n_before}.zarr"
        monkeypatch.setattr(store, "pipe_file", refuse)
        with pytest.raises(PermissionError, match=rf"cannot write to {url}/.*: denied"):
            raster.to_zarr(url, levels=2)
        monkeypatch.undo()
        raster.to_zarr(url, levels=2, resume=True)
        for name in names:
            assert store().cat_file(name) == store().cat_file(name.replace("whole", f"refused{n_before}"))


# GeoTIFF


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("compression", ["deflate", "none"])
def test_geotiff_is_the_raster(tmp_path, kind, compression):
    rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
    pytest.importorskip("pyproj", reason="the tiles extra is not installed")
    raster = raster_of(kind)
    raster.to_geotiff(tmp_path / "a.tif", crs="EPSG:25832", tile=32, compression=compression)
    with rasterio.open(tmp_path / "a.tif") as found:
        pixels = np.moveaxis(found.read(), 0, -1)
        wished = raster[:].view(np.uint8) if raster.dtype == bool else raster[:]
        assert equal(pixels, wished.reshape(pixels.shape))
        assert found.crs.to_epsg() == 25832
        assert tl.Grid.from_transform(found.transform, (found.width, found.height)) == GRID
        assert found.overviews(1) == [2, 4, 8, 16]
        assert ("alpha" in [band.name for band in found.colorinterp]) == (kind == "alpha")
        nodata = raster.painter.nodata
        assert (found.nodata is None) == (nodata is None)
        assert nodata is None or equal(np.float64(found.nodata), np.float64(nodata))
        quarter = found.read(1, out_shape=(100, 150))
    half = halved(wished, nodata, is_mean=raster.has_means)
    assert equal(quarter, half if half.ndim == 2 else half[..., 0])
    assert not (tmp_path / "a.tif.parts").exists()


@pytest.mark.parametrize("kind", ["labels", "height_map", "colors"])
def test_geotiff_is_cloud_optimised(tmp_path, kind):
    """What GDAL's validator asks for: directories first, in order; tiles of smaller levels before larger ones."""
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    raster_of(kind).to_geotiff(tmp_path / "a.tif", tile=16)
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        pages = list(file.pages)
        assert pages[0].offset == 8
        assert all(page.is_tiled for page in pages)
        assert [page.is_reduced for page in pages] == [False] + [True] * (len(pages) - 1)
        offsets = [page.offset for page in pages]
        assert offsets == sorted(offsets)
        firsts = [min(page.dataoffsets) for page in pages]
        assert firsts == sorted(firsts, reverse=True)
        assert max(offsets) < min(firsts)
        assert all(a.shape[0] > b.shape[0] for a, b in itertools.pairwise(pages))


def test_geotiff_beyond_4_gb_is_bigtiff(tmp_path, monkeypatch):
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    monkeypatch.setattr("topleft._apps.tiles.geotiff.LIMIT_CLASSIC", 1000)
    raster = raster_of("height_map")
    raster.to_geotiff(tmp_path / "a.tif", tile=32, compression="none")
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        assert file.is_bigtiff
        assert equal(file.pages[0].asarray(), raster[:])
        assert equal(file.pages[1].asarray(), halved(raster[:], np.nan, is_mean=True))


def test_geotiff_in_pixels_and_with_y_down(tmp_path):
    tifffile = pytest.importorskip("tifffile", reason="tifffile is not installed")
    pixels = tl.tiles(([[0.0, 0], [40, 0], [0, 40]], [[0, 1, 2]]), 40, window=16)
    pixels.to_geotiff(tmp_path / "a.tif", tile=16, overviews=False, nodata=7)
    down = tl.tiles((POINTS, TRIANGLES), tl.Grid((300, 200), GRID.extent, "down"), window=64)
    down.to_geotiff(tmp_path / "b.tif", tile=64, overviews=False)
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        assert (33550 in file.pages[0].tags, file.pages[0].tags[42113].value) == (False, "7")
        assert equal(file.asarray(), np.where(pixels[:] == -1, 7, pixels[:]))
    with tifffile.TiffFile(tmp_path / "b.tif") as file:
        assert file.pages[0].tags[34264].value[5] == 1.0
        assert equal(file.asarray(), down[:])


@pytest.mark.parametrize("limit", [1 << 32, 1000])
@pytest.mark.parametrize("compression", ["deflate", "none"])
@pytest.mark.parametrize("kind", ["labels", "coverage", "shares", "colors", "alpha"])
def test_geotiff_is_read_by_pillow(tmp_path, kind, compression, limit, monkeypatch):
    """All levels, with blank tiles, plain and big."""
    monkeypatch.setattr("topleft._apps.tiles.geotiff.LIMIT_CLASSIC", limit)
    raster = raster_of(kind)
    raster.to_geotiff(tmp_path / "a.tif", tile=32, compression=compression)
    level = raster[:].view(np.uint8) if raster.dtype == bool else raster[:]
    with Image.open(tmp_path / "a.tif") as found:
        assert found.n_frames == 5
        for i in range(5):
            found.seek(i)
            assert equal(np.asarray(found), level)
            level = halved(level, raster.painter.nodata, is_mean=raster.has_means)


@pytest.mark.parametrize("dtype", [np.uint8, np.int32, np.float32, np.float64, np.uint16, np.int64])
@pytest.mark.parametrize("channels", [(), (3,)])
def test_predictors_are_undone(dtype, channels):
    pixels = (RNG.normal(size=(16, 32, *channels)) * 1e4).astype(dtype)
    assert equal(sums(np.frombuffer(differences(pixels), np.uint8), pixels.shape, np.dtype(dtype)), pixels)


# Deep Zoom


@pytest.mark.parametrize("kind", ["labels", "coverage", "shares", "colors"])
def test_deepzoom_is_the_raster(tmp_path, kind):
    raster = raster_of(kind)
    raster.to_deepzoom(tmp_path / "a.dzi", tile=32)
    text = (tmp_path / "a.dzi").read_text()
    assert 'TileSize="32"' in text
    assert 'Width="300" Height="200"' in text
    levels = sorted(int(path.name) for path in (tmp_path / "a_files").iterdir() if path.is_dir())
    assert levels == list(range(10))
    tile = np.asarray(Image.open(tmp_path / "a_files/9/3_2.png"))
    part = raster[64:96, 96:128]
    if kind == "labels":
        assert ((tile[..., 3] == 255) == (part >= 0)).all()
        assert len(np.unique(tile[part >= 0], axis=0)) == len(np.unique(part[part >= 0]))
    else:
        scale = {"coverage": 255, "shares": np.float32(255), "colors": 1}[kind]
        assert equal(tile, np.rint(part * scale).astype(np.uint8))
    for level in levels:  # viewers ask for every tile
        side = (-(-300 // 2 ** (9 - level)), -(-200 // 2 ** (9 - level)))
        names = {f"{c}_{r}.png" for c in range(-(-side[0] // 32)) for r in range(-(-side[1] // 32))}
        assert {path.name for path in (tmp_path / f"a_files/{level}").iterdir()} == names


def test_deepzoom_takes_colors_of_a_function(tmp_path):
    floats = tl.tiles((POINTS, TRIANGLES), GRID, window=64, kind="fill", values=np.ones((60, 3), np.float32))
    with pytest.raises(ValueError, match="colors must say how float32 of kind 'fill' becomes uint8"):
        floats.to_deepzoom(tmp_path / "a.dzi", tile=32)
    raster = raster_of("height_map")
    with pytest.raises(ValueError, match="colors must give uint8"):
        raster.to_deepzoom(tmp_path / "a.dzi", tile=32, colors=np.isnan)
    raster.to_deepzoom(tmp_path / "a.dzi", tile=32, colors=lambda z: np.where(np.isnan(z), 0, 20 * z).astype(np.uint8))
    tile = np.asarray(Image.open(tmp_path / "a_files/9/0_0.png"))
    assert equal(tile, np.nan_to_num(20 * raster[:32, :32]).astype(np.uint8))


@pytest.mark.parametrize("kind", ["height_map", "depth", "field", "int16"])
def test_deepzoom_shows_numbers_as_greys(tmp_path, kind):
    raster = raster_of(kind)
    raster.to_deepzoom(tmp_path / "a.dzi", tile=32)
    tile = np.asarray(Image.open(tmp_path / "a_files/9/1_2.png"))
    numbers = raster[64:96, 32:64].astype(np.float64)
    is_there = ~np.isnan(numbers) & (numbers != raster.painter.empty)
    assert np.array_equal(tile[..., 1], is_there * 255)
    low, high = raster.range_of_values
    inside = numbers[is_there]
    assert low <= inside.min() <= inside.max() <= high
    assert np.array_equal(tile[is_there, 0], np.rint((inside - low) * (255 / (high - low))).astype(np.uint8))


def test_halved_colors_leave_out_what_is_transparent():
    pixels = np.zeros((3, 3, 4), np.uint8)
    pixels[0, 0], pixels[1, 1], pixels[2, 2] = (200, 100, 50, 255), (100, 0, 50, 255), (9, 8, 7, 4)
    assert halved_colors(pixels).tolist() == [[[150, 50, 50, 128], [0, 0, 0, 0]], [[0, 0, 0, 0], [9, 8, 7, 4]]]


# What goes wrong


WRITERS = {
    "a.zarr": lambda raster, path, **options: raster.to_zarr(path, levels=2, **options),
    "a.tif": lambda raster, path, **options: raster.to_geotiff(path, tile=16, **options),
    "a.dzi": lambda raster, path, **options: raster.to_deepzoom(path, tile=16, **options),
}


def interrupted(raster, path, is_time=lambda step: True):
    """Write until the progress is that of a time; returns the steps that were told."""
    steps = []

    def stop(step):
        steps.append(step)
        if is_time(step):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        WRITERS[path.name](raster, path, progress=stop)
    return steps


@pytest.mark.parametrize("name", WRITERS)
def test_what_does_not_fit_the_disk_is_told_before_a_byte_is_written(tmp_path, name, monkeypatch):
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr("shutil.disk_usage", lambda path: usage._replace(free=1000))
    with pytest.raises(OSError, match=r"takes up to [\d,]+ bytes, and .* has 1,000 free: nothing was written"):
        WRITERS[name](raster_of("labels"), tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", WRITERS)
def test_what_is_of_another_run_is_refused(tmp_path, name):
    interrupted(raster_of("labels"), tmp_path / name)
    others = [raster_of("coverage"), raster_of("labels", 32), raster_of("labels", mesh=(POINTS + 1, TRIANGLES))]
    message = "is not of this raster: the mesh, an option or the size of windows differs"
    for other in others:
        with pytest.raises(ValueError, match=message):
            WRITERS[name](other, tmp_path / name, resume=True)
    WRITERS[name](raster_of("labels"), tmp_path / name, resume=True)


@pytest.mark.parametrize("name", WRITERS)
def test_interrupted_run_goes_on(tmp_path, name):
    """After any number of windows; the files are those of a run that was not interrupted."""
    (tmp_path / "whole").mkdir()
    WRITERS[name](raster_of("labels", mesh=CORNER), tmp_path / "whole" / name)
    for n in (1, 4):
        folder = tmp_path / str(n)
        folder.mkdir()
        steps = interrupted(raster_of("labels", mesh=CORNER), folder / name, lambda step, n=n: step.n_done >= n)
        seen = []
        written = WRITERS[name](raster_of("labels", mesh=CORNER), folder / name, progress=seen.append, resume=True)
        assert written.n_kept >= n
        assert not {(s.level, s.row, s.column) for s in steps} & {(s.level, s.row, s.column) for s in seen}
        assert files_of(folder) == files_of(tmp_path / "whole")


@pytest.mark.parametrize("name", WRITERS)
def test_second_writer_is_refused(tmp_path, name):
    """Whether it goes on or begins; what the first one writes is whole, and the lock goes with it."""
    told = []

    def write_again(step):
        for options in ({}, {"resume": True}):
            with pytest.raises(BlockingIOError, match=f"{name} is being written by another call") as info:
                WRITERS[name](raster_of("labels"), tmp_path / "a" / name, **options)
            told.append(info.value)

    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    WRITERS[name](raster_of("labels"), tmp_path / "a" / name, progress=write_again)
    WRITERS[name](raster_of("labels"), tmp_path / "b" / name)
    assert len(told) > 2
    assert files_of(tmp_path / "a") == files_of(tmp_path / "b")


HELD = """
import sys
sys.path[:0] = sys.argv[2:]
from test_writers import raster_of
def wait(step):
    print("writes", flush=True)
    sys.stdin.read()
raster_of("labels").to_geotiff(sys.argv[1], tile=16, progress=wait)
"""


def test_lock_holds_between_processes_and_ends_with_a_killed_one(tmp_path):
    folders = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "support")]
    command = [sys.executable, "-c", HELD, str(tmp_path / "a.tif"), *folders]
    with subprocess.Popen(command, env=CHILD, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "writes\n"
        with pytest.raises(BlockingIOError, match=r"a\.tif is being written by another call"):
            raster_of("labels").to_geotiff(tmp_path / "a.tif", tile=16)
        other.kill()
    raster_of("labels").to_geotiff(tmp_path / "a.tif", tile=16, resume=True)
    assert [path.name for path in tmp_path.iterdir()] == ["a.tif"]


PLACES = {"a.zarr": "a.zarr/labels/c/1/2", "a.tif": "a.tif.parts/0/4_8", "a.dzi": "a_files/9/8_4.png"}


@pytest.mark.parametrize("name", WRITERS)
def test_part_that_goes_or_is_damaged_meanwhile_is_told(tmp_path, name):
    """A blank part would be a lie."""
    harms = [(FileNotFoundError, "has gone while the raster was written: resume", Path.unlink),
             (OSError, r"is damaged \(.*\): resume=True writes it", lambda path: path.write_bytes(b"x"))]  # fmt: skip
    for k, (error, message, harm) in enumerate(harms):
        folder = tmp_path / str(k)
        folder.mkdir()

        def spoil(step, folder=folder, harm=harm, k=k):
            if step.n_done == (19 if k else step.n_blocks):
                harm(folder / PLACES[name])

        with pytest.raises(error, match=rf"(1.2|4_8|8_4\.png) {message}"):
            WRITERS[name](raster_of("labels"), folder / name, progress=spoil)
        assert not (folder / name).is_file()
        assert WRITERS[name](raster_of("labels"), folder / name, resume=True).n_drawn == 1


@pytest.mark.parametrize("options", [{}, {"resume": True}, {"overwrite": True}])
@pytest.mark.parametrize(
    ("name", "strange"),
    [
        ("a.tif", "a.tif.parts/thesis.txt"),
        ("a.tif", "a.tif.parts/0/0_0"),
        ("a.tif", "a.tif"),
        ("a.tif", "a.tif/thesis.txt"),
        ("a.zarr", "a.zarr/thesis.txt"),
        ("a.zarr", "a.zarr/zarr.json"),
        ("a.zarr", "a.zarr"),
        ("a.dzi", "a_files/0/0_0.png"),
        ("a.dzi", "a_files"),
        ("a.dzi", "a.dzi"),
    ],
)
def test_what_is_of_somebody_else_is_left_alone(tmp_path, name, strange, options):
    path = tmp_path / strange
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("[" * 100_000 if strange.endswith("json") else "my only copy")
    there = path.read_bytes()
    with pytest.raises(FileExistsError, match=r"was not written by topleft: move it, or write elsewhere"):
        WRITERS[name](raster_of("labels"), tmp_path / name, **options)
    assert [entry for entry in tmp_path.rglob("*") if entry.is_file()] == [path]
    assert path.read_bytes() == there


@pytest.mark.parametrize("name", WRITERS)
def test_file_of_somebody_else_within_a_raster_stays(tmp_path, name):
    """To go on is no harm; to replace it all would remove it."""
    folder = {"a.zarr": "a.zarr", "a.tif": "a.tif.parts", "a.dzi": "a_files"}[name]
    thesis = tmp_path / folder / "0" / ".thesis.00000000.part"

    def put(step):
        thesis.parent.mkdir(exist_ok=True)
        thesis.write_text("my only copy")
        if step.n_done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        WRITERS[name](raster_of("labels"), tmp_path / name, progress=put)
    there = files_of(tmp_path)
    with pytest.raises(FileExistsError, match=r"0.\.thesis\.00000000\.part was not written by topleft"):
        WRITERS[name](raster_of("labels"), tmp_path / name, overwrite=True)
    assert files_of(tmp_path) == there
    assert WRITERS[name](raster_of("labels"), tmp_path / name, resume=True).n_kept >= 2
    assert thesis.read_text() == "my only copy"


@pytest.mark.parametrize("name", WRITERS)
def test_file_of_somebody_else_that_comes_meanwhile_stays(tmp_path, name):
    """The raster is not finished then, and nothing is lost: it goes on when the file has been moved."""
    if name == "a.zarr":
        return

    def put(step):
        (tmp_path / name).write_text("my only copy")

    with pytest.raises(FileExistsError, match="was not written by topleft"):
        WRITERS[name](raster_of("labels"), tmp_path / name, progress=put)
    assert (tmp_path / name).read_text() == "my only copy"
    (tmp_path / name).unlink()
    assert WRITERS[name](raster_of("labels"), tmp_path / name, resume=True).n_drawn == 0


@pytest.mark.parametrize("is_whole", [True, False])
@pytest.mark.parametrize("name", WRITERS)
def test_raster_is_replaced_when_that_is_asked_for(tmp_path, name, is_whole):
    """One that is finished or not, of another mesh, another kind and other levels; nothing of it stays."""
    old, new = raster_of("field", 128), raster_of("labels", mesh=CORNER)

    def stop(step):
        if not is_whole:
            raise KeyboardInterrupt

    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    with contextlib.suppress(KeyboardInterrupt):
        WRITERS[name](old, tmp_path / "a" / name, progress=stop)
    (tmp_path / "a" / name).parent.joinpath("beside.txt").write_text("stays")
    with pytest.raises(FileExistsError, match="exists: resume=True goes on with it"):
        WRITERS[name](new, tmp_path / "a" / name)
    with pytest.raises(ValueError, match="give one of them"):
        WRITERS[name](new, tmp_path / "a" / name, overwrite=True, resume=True)
    WRITERS[name](new, tmp_path / "a" / name, overwrite=True)
    WRITERS[name](new, tmp_path / "b" / name)
    assert files_of(tmp_path / "a") == {**files_of(tmp_path / "b"), "beside.txt": b"stays"}


@pytest.mark.parametrize("name", WRITERS)
def test_finished_raster_is_kept_when_it_goes_on(tmp_path, name):
    first = WRITERS[name](raster_of("labels"), tmp_path / name)
    there = files_of(tmp_path)
    again = WRITERS[name](raster_of("labels"), tmp_path / name, resume=True)
    assert (again.n_drawn, again.n_kept, again.n_blank) == (0, first.n_drawn, first.n_blank)
    assert files_of(tmp_path) == there


def test_geotiff_of_another_nodata_or_crs_is_another_one(tmp_path):
    raster_of("labels").to_geotiff(tmp_path / "a.tif", tile=16)
    with pytest.raises(ValueError, match=r"a\.tif is not of this raster"):
        raster_of("labels").to_geotiff(tmp_path / "a.tif", tile=16, nodata=-7, resume=True)


NODATA = {
    "labels": -9999, "depth": -9999, "shares": -1, "field": 5e20, "height_map": -9999, "int16": 321, "rows": 9,
    "vectors": -7,
}  # fmt: skip
KINDS_OF_NUMBERS = {**KINDS, "rows": {"kind": "fill", "values": np.arange(60) % 3, "dtype": np.int32}}


@pytest.mark.parametrize("kind", NODATA)
def test_outside_is_the_no_data_of_the_file_in_each_writer(tmp_path, kind):
    zarr = pytest.importorskip("zarr", reason="the tiles extra is not installed")
    rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
    options = KINDS_OF_NUMBERS[kind]
    if kind in ("int16", "rows"):
        options = {**options, "values": options["values"][:6]}
    raster = tl.tiles(CORNER, GRID, window=64, **options)
    nodata = NODATA[kind]
    is_outside = ~tl.tiles(CORNER, GRID, window=64, kind="coverage")[:]
    if kind == "shares":
        is_outside = raster[:] == 0
    is_outside = is_outside.reshape(is_outside.shape + (1,) * (len(raster.shape) - 2))
    wished = np.where(is_outside, np.asarray(nodata, raster.dtype), raster[:])
    assert is_outside.any()
    raster.to_geotiff(tmp_path / "a.tif", tile=16, nodata=nodata)
    with rasterio.open(tmp_path / "a.tif") as found:
        assert found.nodata == np.asarray(nodata, raster.dtype)
        assert equal(np.moveaxis(found.read(), 0, -1), wished.reshape(200, 300, -1))
    changed = raster.with_nodata(nodata)
    changed.to_zarr(tmp_path / "a.zarr")
    found = zarr.open_array(tmp_path / "a.zarr" / raster.kind, mode="r")
    assert found.fill_value == np.asarray(nodata, raster.dtype)
    assert equal(found[:], wished)
    assert equal(changed[:], wished)
    assert changed.fingerprint != raster.fingerprint


@pytest.mark.parametrize(
    ("kind", "nodata", "said"),
    [
        ("labels", 5, "nodata must be no label, got 5 for 60 labels from 0 on"),
        ("labels", 0.5, "nodata must be -1 or one int32, as pixels are, got 0.5"),
        ("labels", 2**31, "nodata must be -1 or one int32"),
        ("labels", float("nan"), "nodata must be -1 or one int32"),
        ("coverage", -9999, "nodata must be False or one bool"),
        ("colors", 7, r"nodata must be \[0, 0, 0\] or one uint8"),
    ],
)
def test_no_data_that_pixels_do_not_hold_or_labels_have_is_refused(tmp_path, kind, nodata, said):
    with pytest.raises(ValueError, match=said):
        raster_of(kind).to_geotiff(tmp_path / "a.tif", tile=16, nodata=nodata)
    assert not list(tmp_path.iterdir())


def test_empty_file_and_folder_are_written_over(tmp_path):
    """As those that tempfile makes."""
    (tmp_path / "a.tif").touch()
    (tmp_path / "a.zarr").mkdir()
    for name in ("a.tif", "a.zarr"):
        assert WRITERS[name](raster_of("labels"), tmp_path / name).n_drawn == 19


def test_urls_are_replaced_and_what_is_not_ours_stays():
    fsspec = pytest.importorskip("fsspec", reason="the tiles extra is not installed")
    store = fsspec.filesystem("memory")
    store.pipe_file("/bucket/b.zarr/zarr.json", b"{}")
    with pytest.raises(FileExistsError, match=r"memory://bucket/b\.zarr was not written by topleft"):
        raster_of("labels").to_zarr("memory://bucket/b.zarr", overwrite=True)
    raster_of("field").to_zarr("memory://bucket/c.zarr", levels=3)
    store.pipe_file("/bucket/c.zarr/thesis.txt", b"my only copy")
    with pytest.raises(FileExistsError, match=r"memory://bucket/c\.zarr/thesis\.txt was not written by topleft"):
        raster_of("labels").to_zarr("memory://bucket/c.zarr", overwrite=True)
    store.rm_file("/bucket/c.zarr/thesis.txt")
    raster_of("labels").to_zarr("memory://bucket/c.zarr", overwrite=True)
    raster_of("labels").to_zarr("memory://bucket/d.zarr")
    names = [store.find(f"/bucket/{folder}.zarr") for folder in "cd"]
    assert [name.replace("/c.zarr", "/d.zarr") for name in names[0]] == names[1]


DAMAGES = {
    "cut": lambda content: content[: len(content) // 2],
    "empty": lambda content: b"",
    "noise": lambda content: RNG.integers(0, 256, len(content), np.uint8).tobytes(),
    "flip": lambda content: content[: (n := len(content) // 2)] + bytes([content[n] ^ 1]) + content[n + 1 :],
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", WRITERS)
def test_damaged_tile_is_written_again(tmp_path, name, damage):
    """At any level, whether another one is made of it or not."""
    for folder in ("whole", "cut"):
        (tmp_path / folder).mkdir()
    WRITERS[name](raster_of("labels"), tmp_path / "whole" / name)
    where = {"a.zarr": "a.zarr/{}/labels/c", "a.tif": "a.tif.parts/{}", "a.dzi": "a_files/{}"}[name]
    interrupted(raster_of("labels"), tmp_path / "cut" / name, lambda step: step.n_done > 20)  # windows, and two more
    for level in (9, 8) if name == "a.dzi" else (0, 1):
        tiles = [
            path
            for path in (tmp_path / "cut" / where.format(level).replace("zarr/0/", "zarr/")).rglob("*")
            if path.is_file()
        ]
        tile = max(tiles, key=lambda path: path.stat().st_size)
        tile.write_bytes(DAMAGES[damage](tile.read_bytes()))
    written = WRITERS[name](raster_of("labels"), tmp_path / "cut" / name, resume=True)
    assert (written.n_drawn, written.n_kept) == (1, 18)
    assert files_of(tmp_path / "cut") == files_of(tmp_path / "whole")


KILLED = """
import os, sys, time
import numpy as np, topleft as tl
rng = np.random.default_rng(1)
points = rng.uniform(0, 512, (300, 2))
raster = tl.tiles((points, rng.integers(0, 300, (100, 3))), 512, window=32, threads=2)
drawn = os.open(sys.argv[2] + ".log", os.O_WRONLY | os.O_APPEND | os.O_CREAT)
own = raster.draw_window
def draw_window(row, column, **options):
    os.write(drawn, f"{row} {column}\\n".encode())
    return own(row, column, **options)
raster.draw_window = draw_window
print("begins", flush=True)
if sys.argv[1] == "zarr":
    raster.to_zarr(sys.argv[2], levels=2, resume=True)
else:
    raster.to_geotiff(sys.argv[2], tile=16, resume=True)
"""


@pytest.mark.parametrize("kind", ["zarr", "tif"])
def test_killed_run_goes_on_and_draws_no_whole_window_twice(tmp_path, kind):
    def run(path):
        command = [sys.executable, "-c", KILLED, kind, str(path)]
        return subprocess.Popen(command, env=CHILD, stdout=subprocess.PIPE, text=True)

    def whole_windows(path):
        folder = path / "labels/c" if kind == "zarr" else path.with_name(path.name + ".parts") / "0"
        names = [p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file() and p.name[0] != "."]
        n = 1 if kind == "zarr" else 2  # tiles along the side of a window
        tiles = Counter(tuple(int(i) // n for i in name.replace("_", "/").split("/")) for name in names)
        return {window for window, n_there in tiles.items() if n_there == n * n}

    (tmp_path / "whole").mkdir()
    (tmp_path / "cut").mkdir()
    whole, cut = tmp_path / "whole" / f"a.{kind}", tmp_path / "cut" / f"a.{kind}"
    assert run(whole).wait() == 0
    log, rng, n_kills, n_kept = Path(f"{cut}.log"), np.random.default_rng(3), 0, 0
    for _ in range(40):
        there = whole_windows(cut)
        log.write_text("")
        process = run(cut)
        process.stdout.readline()
        if n_kills < 3:
            n_drawn = rng.integers(5, 80)  # of 256
            while process.poll() is None and len(log.read_text().splitlines()) < n_drawn:
                time.sleep(0.001)
            process.kill()
        status = process.wait()
        again = {tuple(map(int, line.split())) for line in log.read_text().splitlines()}
        assert not again & there
        n_kept += len(there)
        n_kills += status != 0
        if status == 0:
            break
    assert n_kills >= 1
    assert n_kept >= 1
    log.unlink()
    Path(f"{whole}.log").unlink()
    assert files_of(tmp_path / "cut") == files_of(tmp_path / "whole")


@pytest.mark.parametrize(
    ("name", "options", "error", "message"),
    [
        ("to_zarr", {"chunk": 48}, ValueError, "chunk must divide the windows of 64 x 64 pixels"),
        ("to_zarr", {"compression": "rar"}, ValueError, "compression must be"),
        ("to_zarr", {"levels": 0}, ValueError, "levels must be at least 1"),
        ("to_geotiff", {"tile": 40}, ValueError, "tile must be a multiple of 16, got 40"),
        ("to_geotiff", {"tile": 48}, ValueError, "window must have sides of whole tiles, of 48 pixels"),
        ("to_geotiff", {"tile": 64}, ValueError, "window must have sides of whole pairs of tiles, of 128 pixels"),
        ("to_geotiff", {"tile": 32, "crs": "EPSG:1"}, ValueError, "crs must be one that pyproj knows"),
        ("to_geotiff", {"tile": 32, "crs": "Narnia"}, ValueError, "crs must be one that pyproj knows"),
        ("to_geotiff", {"tile": 32, "crs": "EPSG:5773"}, ValueError, "crs must be projected or geographic"),
        ("to_deepzoom", {"tile": 24}, ValueError, "tile must be a power of 2, got 24"),
        ("to_deepzoom", {"tile": 64}, ValueError, "window must have sides of whole pairs of tiles"),
    ],
)
def test_wrong_options_are_told(tmp_path, name, options, error, message):
    if "crs" in options:
        pytest.importorskip("pyproj", reason="the tiles extra is not installed")
    with pytest.raises(error, match=message):
        getattr(raster_of("labels"), name)(tmp_path / "a.dzi", **options)
    assert list(tmp_path.iterdir()) == []


def test_crs_needs_a_grid(tmp_path):
    with pytest.raises(ValueError, match="crs is for a raster on a Grid"):
        tl.tiles((POINTS, TRIANGLES), 64).to_geotiff(tmp_path / "a.tif", crs="EPSG:25832")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_folder_without_permission_is_told(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(PermissionError, match="cannot write"):
        raster_of("labels").to_zarr(tmp_path / "a.zarr")


def test_missing_folder_is_told(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"cannot write .*: its folder is not there"):
        raster_of("labels").to_geotiff(tmp_path / "none" / "a.tif", tile=32)


@pytest.mark.parametrize(
    ("package", "call"),
    [
        ("pyproj", "to_geotiff('a.tif', tile=32, crs='EPSG:25832')"),
        ("numcodecs", "to_zarr('a.zarr', compression='zstd')"),
        ("fsspec", "to_zarr('memory://a.zarr')"),
        ("dask", "to_dask()"),
        ("dask", "to_xarray()"),
    ],
)
def test_absent_package_is_told_with_what_to_install(tmp_path, package, call):
    code = (
        f"import sys; sys.modules[{package!r}] = None; sys.modules['{package}.zstd'] = None\n"
        "import topleft as tl\n"
        "raster = tl.tiles(([[0, 0], [9, 0], [0, 9]], [[0, 1, 2]]), tl.Grid((64, 64), (0, 9, 0, 9)))\n"
        f"try:\n    raster.{call}\nexcept tl.MissingPackageError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, env=CHILD, check=True
    )
    assert "pip install" in done.stdout


def test_progress_shows_a_bar(tmp_path, monkeypatch):
    pytest.importorskip("tqdm", reason="tqdm is not installed")
    shown = io.StringIO()
    monkeypatch.setattr(sys, "stderr", shown)
    raster_of("labels").to_zarr(tmp_path / "a.zarr", progress=True)
    assert "19/19" in shown.getvalue()
