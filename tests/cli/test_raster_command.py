"""`topleft raster`: meshes to GeoTIFF, Zarr and Deep Zoom."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft._apps.cli import main

SRC = str(Path(tl.__file__).parents[1])
RNG = np.random.default_rng(3)
POINTS = RNG.uniform([1000, 2000, 0], [1064, 2048, 9], (60, 3))
TRIANGLES = RNG.integers(0, 60, (40, 3)).astype(np.int32)


@pytest.fixture
def pair(tmp_path):
    """Names of two .npy files."""
    np.save(tmp_path / "v.npy", POINTS)
    np.save(tmp_path / "t.npy", TRIANGLES)
    return f"{tmp_path / 'v.npy'},{tmp_path / 't.npy'}"


def ply_with_values(path):
    values = np.arange(60, dtype="<f4")
    vertices = np.zeros(60, [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("speed", "<f4")])
    vertices["x"], vertices["y"], vertices["z"] = POINTS.T
    vertices["speed"] = values
    faces = np.zeros(40, [("n", "u1"), ("v", "<i4", 3), ("zone", "<i4")])
    faces["n"], faces["v"], faces["zone"] = 3, TRIANGLES, np.arange(40)
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 60\nproperty double x\nproperty double y\n"
        "property double z\nproperty float speed\nelement face 40\nproperty list uchar int vertex_indices\n"
        "property int zone\nend_header\n"
    )
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())
    return values


def chunk_of(path, dtype, shape):
    return np.frombuffer(path.read_bytes(), dtype).reshape(shape)


def test_heights_go_to_a_geotiff(tmp_path, pair, capsys):
    rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
    pytest.importorskip("pyproj", reason="the tiles extra is not installed")
    out = tmp_path / "heights.tif"
    assert main(["raster", pair, "-o", str(out), "--pixel-size", "1", "--crs", "EPSG:25832"]) == 0
    assert "float64, 1 windows drawn, 0 kept, 0 blank" in capsys.readouterr().out
    with rasterio.open(out) as found:
        grid = tl.Grid.around((POINTS, TRIANGLES), pixel_size=1.0)
        assert np.array_equal(found.read(1), tl.height_map((POINTS, TRIANGLES), grid), equal_nan=True)
        assert (found.crs.to_epsg(), np.isnan(found.nodata)) == (25832, True)


def test_labels_go_to_a_zarr_with_levels(tmp_path, pair):
    out = tmp_path / "labels.zarr"
    arguments = ["--labels", "--size", "64x48", "--levels", "2", "--window", "32", "--uncompressed", "--quiet"]
    assert main(["raster", pair, "-o", str(out), *arguments]) == 0
    said = json.loads((out / "labels/zarr.json").read_text())
    assert (said["shape"], said["data_type"]) == ([48, 64], "int32")
    grid = tl.Grid.around((POINTS, TRIANGLES), size=(64, 48))
    points = np.column_stack([grid.to_pixels(POINTS), POINTS[:, 2]])
    whole = tl.rasterize(points, TRIANGLES, (64, 48)).triangle
    assert np.array_equal(chunk_of(out / "labels/c/0/1", "<i4", (32, 32)), whole[:32, 32:])
    assert np.array_equal(chunk_of(out / "1/labels/c/0/0", "<i4", (32, 32))[:24], whole[::2, ::2])


@pytest.mark.parametrize("bits", [0, 9, "exact"])
def test_subpixel_bits_reach_the_raster(tmp_path, pair, bits):
    out = tmp_path / "labels.zarr"
    arguments = ["--labels", "--size", "64x48", "--uncompressed", "--quiet", "--subpixel-bits", str(bits)]
    assert main(["raster", pair, "-o", str(out), *arguments]) == 0
    grid = tl.Grid.around((POINTS, TRIANGLES), size=(64, 48))
    points = np.column_stack([grid.to_pixels(POINTS), POINTS[:, 2]])
    whole = tl.rasterize(points, TRIANGLES, (64, 48), subpixel_bits=bits).triangle
    assert np.array_equal(chunk_of(out / "labels/c/0/0", "<i4", (48, 64)), whole)


def test_values_come_from_a_file_or_by_name(tmp_path):
    values = ply_with_values(tmp_path / "mesh.ply")
    np.save(tmp_path / "values.npy", values)
    grid = tl.Grid.around((POINTS, TRIANGLES), pixel_size=2.0)
    (w, h), mesh = grid.size, str(tmp_path / "mesh.ply")
    wished = tl.field((POINTS, TRIANGLES), values, grid, nodata=-1)
    zones = tl.field((POINTS, TRIANGLES), np.arange(40, dtype=np.int32), grid, nodata=-1)
    for i, (name, whole) in enumerate((("speed", wished), (str(tmp_path / "values.npy"), wished), ("zone", zones))):
        out = tmp_path / f"{i}.zarr"
        arguments = ["--pixel-size", "2", "--values", name, "--nodata", "-1", "--uncompressed", "--quiet"]
        assert main(["raster", mesh, "-o", str(out), *arguments]) == 0
        assert np.array_equal(chunk_of(out / "field/c/0/0", whole.dtype, (h, w)), whole)


def test_values_of_time_steps_that_meshio_loses_are_told(tmp_path, capsys):
    pytest.importorskip("meshio", reason="meshio is not installed")
    nodes = "$Nodes\n3\n1 0 0 0\n2 4 0 0\n3 0 4 0\n$EndNodes\n$Elements\n1\n1 2 2 0 0 1 2 3\n$EndElements\n"
    steps = [f'$NodeData\n1\n"u"\n1\n{t}.0\n3\n{t}\n1\n3\n1 {t}\n2 {t}\n3 {t}\n$EndNodeData\n' for t in (0, 1)]
    for n in (1, 2):
        path = tmp_path / f"{n}.msh"
        path.write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + nodes + "".join(steps[:n]))
        assert main(["raster", str(path), "-o", str(path) + ".zarr", "--size", "4x4", "--values", "u", "--quiet"]) == 0
        told = "views of which the last step alone is read: 'u'" in capsys.readouterr().err
        assert told == (n == 2)


@pytest.mark.filterwarnings("ignore::topleft.MeshWarning")
def test_values_come_by_name_from_a_file_of_cells(tmp_path, capsys):
    meshio = pytest.importorskip("meshio", reason="meshio is not installed")
    points = np.array([(0, 0, 0), (4, 0, 0), (8, 0, 0), (0, 4, 1), (4, 4, 1), (8, 4, 1)], float)
    cells = [("quad", [[0, 1, 4, 3]]), ("line", [[0, 5]]), ("triangle", [[1, 2, 4]])]
    zones = [np.array([7]), np.array([5]), np.array([8])]
    of_points = {"speed": np.array([0.0, 1, 4, 2, 3, 9]), "flow": points[::-1].copy()}
    mesh = meshio.Mesh(points, cells, of_points, {"zone": zones})
    mesh.write(tmp_path / "a.vtk")
    mesh.write(tmp_path / "a.vtu")
    grid = tl.Grid((8, 4), (0, 8, 0, 4))
    for suffix in ("vtk", "vtu"):
        for name in ("speed", "zone", "flow"):
            whole, out = tl.field(mesh, name, grid, nodata=-1), tmp_path / f"{suffix}-{name}.zarr"
            arguments = ["--pixel-size", "1", "--values", name, "--nodata", "-1", "--uncompressed", "--quiet"]
            assert main(["raster", str(tmp_path / f"a.{suffix}"), "-o", str(out), *arguments]) == 0
            chunk = "field/c/0/0" + "/0" * (whole.ndim - 2)
            assert np.array_equal(chunk_of(out / chunk, whole.dtype, whole.shape), whole)
            assert len(np.unique(whole)) > 2
    capsys.readouterr()
    wrong = ["--pixel-size", "1", "--values", "x"]
    assert main(["raster", str(tmp_path / "a.vtu"), "-o", str(tmp_path / "x.zarr"), *wrong]) == 2
    assert "a name of data of the mesh (speed, flow, zone), got 'x'" in capsys.readouterr().err


def test_values_by_name_of_as_many_vertices_as_faces_are_told_apart(tmp_path):
    data = "property float a\n", "property float b\n"
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    header += (
        f"property float z\n{data[0]}element face 4\nproperty list uchar int vertex_indices\n{data[1]}end_header\n"
    )
    vertices = np.array([[0, 0, 0, 1], [4, 0, 0, 2], [4, 4, 0, 3], [0, 4, 0, 4]], "<f4")
    faces = np.zeros(4, [("n", "u1"), ("v", "<i4", 3), ("b", "<f4")])
    faces["n"], faces["b"] = 3, [5, 6, 7, 8]
    faces["v"] = triangles = [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]]
    (tmp_path / "a.ply").write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())
    for name, per, values in (("a", "vertex", vertices[:, 3]), ("b", "triangle", faces["b"])):
        raster = tl.tiles(tmp_path / "a.ply", tl.Grid((4, 4), (0, 4, 0, 4)), kind="field", values=name)
        wished = tl.field((vertices[:, :2], triangles), values, tl.Grid((4, 4), (0, 4, 0, 4)), per=per)
        assert np.array_equal(raster[:, :], wished)


def test_crs_goes_to_zarr(tmp_path, pair):
    out = tmp_path / "a.zarr"
    assert main(["raster", pair, "-o", str(out), "--pixel-size", "1", "--crs", "EPSG:25832", "--quiet"]) == 0
    said = json.loads((out / "spatial_ref/zarr.json").read_text())["attributes"]
    assert said["spatial_ref"] == "EPSG:25832"
    x = np.frombuffer((out / "x/c/0").read_bytes())
    assert np.array_equal(x, tl.Grid.around((POINTS, TRIANGLES), pixel_size=1.0).x_centers)


def test_masks_go_to_deep_zoom(tmp_path, pair):
    out = tmp_path / "mask.dzi"
    assert main(["raster", pair, "-o", str(out), "--size", "64x48", "--kind", "coverage", "--quiet"]) == 0
    grid = tl.Grid.around((POINTS, TRIANGLES), size=(64, 48))
    mask = tl.coverage(grid.to_pixels(POINTS), TRIANGLES, (64, 48))
    assert np.array_equal(np.asarray(Image.open(tmp_path / "mask_files/6/0_0.png")), mask * np.uint8(255))


def test_heights_go_to_deep_zoom(tmp_path, pair):
    out = tmp_path / "heights.dzi"
    assert main(["raster", pair, "-o", str(out), "--size", "64x48", "--quiet"]) == 0
    grid = tl.Grid.around((POINTS, TRIANGLES), size=(64, 48))
    found = np.asarray(Image.open(tmp_path / "heights_files/6/0_0.png"))
    assert np.array_equal(found[..., 1] > 0, np.isfinite(tl.height_map((POINTS, TRIANGLES), grid)))


def test_raster_that_shows_nothing_is_told(tmp_path, pair, capsys):
    out = tmp_path / "a.tif"
    assert main(["raster", pair, "-o", str(out), "--pixel-size", "1", "--extent", "0", "9", "0", "9"]) == 0
    said = capsys.readouterr()
    assert "0 windows drawn, 0 kept, 1 blank" in said.out
    assert said.err == f"topleft: no triangle of {pair} lies within {out}: all of it is blank\n"


def test_interrupted_command_resumes(tmp_path, pair, capsys):
    out, arguments = tmp_path / "a.zarr", ["--size", "64x48", "--window", "16", "--labels"]
    assert main(["raster", pair, "-o", str(out), *arguments]) == 0
    capsys.readouterr()
    (out / "labels/c/1/2").unlink()
    assert main(["raster", pair, "-o", str(out), *arguments, "--resume", "--threads", "1"]) == 0
    assert " 1 windows drawn, " in capsys.readouterr().out
    assert main(["raster", pair, "-o", str(out), *arguments]) == 2
    assert "exists: --resume goes on with it, if it is of this raster; --overwrite " in capsys.readouterr().err


@pytest.mark.parametrize("name", ["a.zarr", "a.tif", "a.dzi"])
def test_command_replaces_what_is_there_when_told_to(tmp_path, pair, capsys, name):
    arguments = [pair, "-o", str(tmp_path / name), "--size", "64x48"]
    assert main(["raster", *arguments]) == 0
    assert main(["raster", *arguments, "--labels"]) == 2
    assert main(["raster", *arguments, "--labels", "--overwrite"]) == 0
    assert "int32, 1 windows drawn" in capsys.readouterr().out
    assert main(["raster", *arguments, "--overwrite", "--resume"]) == 2
    assert "give one of them" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "a.png", "--size", "9x9"], "the name must end in one of .tif .tiff .zarr .dzi"),
        (["-o", "a.zarr"], "either --pixel-size or --size must say how large the raster is"),
        (["-o", "a.zarr", "--size", "9x9", "--pixel-size", "1"], "either --pixel-size or --size"),
        (["-o", "a.dzi", "--size", "9x9", "--crs", "EPSG:25832"], "--crs is for .tif and .zarr, got a.dzi"),
        (["-o", "a.tif", "--size", "9x9", "--levels", "2"], "--levels is for .zarr"),
        (["-o", "a.zarr", "--size", "9x9", "--labels", "--kind", "depth"], "give one of them"),
        (["-o", "a.zarr", "--size", "9x9", "--labels", "--nodata", "5"], "nodata must be no label, got 5"),
        (["-o", "a.zarr", "--size", "9x9", "--labels", "--surface", "upper"], "--surface is for heights"),
        (["-o", "a.dzi", "--size", "9x9", "--uncompressed"], "--uncompressed is for .tif and .zarr"),
        (["-o", "a.zarr", "--size", "9x9", "--values", "speed"], "values must be a .npy file or a property of"),
        (["-o", "a.zarr", "--pixel-size", "0"], "pixel_size must be positive"),
        (["-o", "a.zarr", "--size", "9x9", "--window", "0"], "--window"),
        (["-o", "none/a.tif", "--size", "9x9"], "its folder is not there"),
    ],
)
def test_wrong_arguments_are_told_in_one_line(tmp_path, pair, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    try:
        status = main(["raster", pair, *arguments])
    except SystemExit as error:
        status = error.code
    said = capsys.readouterr().err.strip()
    assert status == 2
    assert message in said
    assert "\n" not in said


def test_broken_meshes_are_told_in_one_line(tmp_path, pair, capsys):
    triangles = TRIANGLES.copy()
    triangles[17, 1] = 60
    np.save(tmp_path / "t.npy", triangles)
    assert main(["raster", pair, "-o", str(tmp_path / "a.zarr"), "--size", "9x9", "--labels"]) == 2
    assert "row 17 is" in capsys.readouterr().err
    assert main(["raster", str(tmp_path / "none.stl"), "-o", str(tmp_path / "a.zarr"), "--size", "9x9"]) == 2
    assert "none.stl" in capsys.readouterr().err


def test_command_leaves_optional_packages_alone(tmp_path, pair):
    code = (
        "import sys; from topleft._apps.cli import main\n"
        f"main(['raster', {pair!r}, '-o', 'a.tif', '--size', '64x48'])\n"
        "print([name for name in ('zarr', 'dask', 'pyproj', 'fsspec', 'rasterio', 'tifffile') if name in sys.modules])"
    )
    env = {**os.environ, "PYTHONPATH": SRC}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, env=env, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


POLYGONS = {
    "type": "FeatureCollection",
    "features": [
        {"type": "Feature", "properties": {"use": 3, "share": 0.5}, "geometry": {
            "type": "MultiPolygon", "coordinates": [[[[1, 1], [4, 1], [4, 3], [1, 3]]], [[[5, 5], [7, 5], [7, 7]]]]}},
        {"type": "Feature", "properties": {"use": 7, "share": 2}, "geometry": {"type": "Polygon", "coordinates": [
            [[4, 1], [6, 1], [6, 3]]]}},
    ],
}  # fmt: skip
GRID = ["--pixel-size", "0.5", "--extent", "0", "8", "0", "8", "--quiet"]


@pytest.mark.parametrize(
    ("more", "values", "nodata"),
    [
        ([], np.array([0, 0, 1], np.int32), -1),
        (["--values", "use", "--nodata", "0"], np.array([3, 3, 7], np.int32), 0),
        (["--values", "share", "--nodata", "-9999"], np.array([0.5, 0.5, 2]), -9999),
    ],
)
def test_polygons_of_a_file_become_a_raster(tmp_path, more, values, nodata):
    rasterio = pytest.importorskip("rasterio")
    (tmp_path / "a.geojson").write_text(json.dumps(POLYGONS))
    assert main(["raster", str(tmp_path / "a.geojson"), "-o", str(tmp_path / "a.tif"), *GRID, *more]) == 0
    grid = tl.Grid((16, 16), (0, 8, 0, 8), crs="EPSG:4326", nodata=nodata)
    rings = [
        [POLYGONS["features"][0]["geometry"]["coordinates"][0][0]],
        [POLYGONS["features"][0]["geometry"]["coordinates"][1][0]],
        [POLYGONS["features"][1]["geometry"]["coordinates"][0]],
    ]
    with rasterio.open(tmp_path / "a.tif") as found:
        assert tl.Grid.like(found) == grid
        assert np.array_equal(found.read(1), tl.polygons(rings, grid, values=values))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--values", "name"], "names are share, use"),
        (["--kind", "depth"], "polygons have numbers, values and a mask, got depth"),
        (["--surface", "lower"], "polygons have numbers, values and a mask, got lower"),
    ],
)
def test_what_polygons_have_not_is_told_in_one_line(tmp_path, capsys, more, said):
    (tmp_path / "a.geojson").write_text(json.dumps(POLYGONS))
    assert main(["raster", str(tmp_path / "a.geojson"), "-o", str(tmp_path / "a.tif"), *GRID, *more]) == 2
    assert said in capsys.readouterr().err
