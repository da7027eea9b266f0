"""Viewsheds against lines of sight that are followed in fractions."""

import shutil
import subprocess
from fractions import Fraction

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl


def needed(heights, eye, cell):
    """How high above the ground a cell is seen from (column, row, height), as a fraction."""
    x, y, z = map(Fraction, eye)
    most = None
    for axis in (0, 1):
        start, end = ((x, y)[axis], Fraction(cell[axis]))
        if start == end:
            continue
        low, high = min(start, end), max(start, end)
        for k in range(int(low // 1) + 1, int(-(-high // 1))):
            t = (k - start) / (end - start)
            across = (y, x)[axis] + t * (cell[1 - axis] - (y, x)[axis])
            line = across // 1
            w = across - line
            row, column = (line, k) if axis == 0 else (k, line)
            at = Fraction(float(heights[int(row), int(column)]))
            if w:
                step = (1, 0) if axis == 0 else (0, 1)
                at += w * (Fraction(float(heights[int(row) + step[0], int(column) + step[1]])) - at)
            up = (at - z) / t
            most = up if most is None or up > most else most
    ground = Fraction(float(heights[cell[1], cell[0]]))
    return Fraction(0) if most is None else max(Fraction(0), z + most - ground)


@ON_EACH_ISA
@pytest.mark.parametrize("seed", range(8))
def test_heights_above_the_line_of_sight_are_those_of_every_crossing(isa, seed):
    rng = np.random.default_rng(seed)
    heights = rng.integers(0, 16, (7, 9)) / 4
    eye = rng.integers(0, 33) / 4, rng.integers(0, 25) / 4, 3.0
    with on(isa):
        found = tl.viewshed(heights, (eye[0] + 0.5, eye[1] + 0.5, eye[2]), target_height=0.5)
        assert_same(tl.viewshed(heights, (eye[0] + 0.5, eye[1] + 0.5, eye[2]), threads=3).above, found.above)
    for row in range(7):
        for column in range(9):
            exact = needed(heights, eye, (column, row))
            assert found.above[row, column] == pytest.approx(float(exact), abs=1e-12)
            if abs(exact - Fraction(1, 2)) > 1e-9:
                assert found.visible[row, column] == (exact < 0.5)


@ON_EACH_ISA
@pytest.mark.parametrize("seed", range(6))
def test_blocks_that_are_left_out_change_nothing(isa, seed):
    """Hills of several blocks, with holes, seen from within and from the rim, by all of the curvature or none."""
    rng = np.random.default_rng(seed)
    height, width = rng.integers(20, 70, 2).tolist()
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    heights = np.rint(8 * (6 * np.sin(x / 9 + seed) * np.cos(y / 7) + rng.uniform(-1, 1, x.shape))) / 8
    heights[rng.uniform(size=heights.shape) < 0.01 * (seed % 2)] = -50
    eye = (
        float(rng.integers(0, 4 * width - 4) / 4),
        float(rng.integers(0, 4 * height - 4) / 4),
        float(rng.integers(2, 9)),
    )
    with on(isa):
        found = tl.viewshed(heights, (eye[0] + 0.5, eye[1] + 0.5, eye[2]))
        near = tl.viewshed(heights, (eye[0] + 0.5, eye[1] + 0.5, eye[2]), max_distance=12.0)
    for row, column in zip(rng.integers(0, height, 60).tolist(), rng.integers(0, width, 60).tolist(), strict=True):
        exact = float(needed(heights, eye, (column, row)))
        assert found.above[row, column] == pytest.approx(exact, abs=1e-9)
    assert_same(near.above[~np.isnan(near.above)], found.above[~np.isnan(near.above)])


def test_nearly_all_cells_are_those_that_gdal_sees(tmp_path):
    """Hills with noise: GDAL goes from neighbour to neighbour, and is off where a line passes between two."""
    rasterio = pytest.importorskip("rasterio")
    if shutil.which("gdal_viewshed") is None:
        pytest.skip("gdal_viewshed is not installed")
    rng, n = np.random.default_rng(0), 300
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    heights = 30 * np.sin(x / 47) * np.cos(y / 41) + 9 * np.sin(x / 13 + y / 19) + rng.normal(0, 0.3, x.shape)
    profile = {"driver": "GTiff", "width": n, "height": n, "count": 1, "dtype": "float64", "crs": "EPSG:32632"}
    path, seen = tmp_path / "heights.tif", tmp_path / "seen.tif"
    with rasterio.open(path, "w", **profile, transform=rasterio.Affine(1, 0, 0, 0, -1, n)) as file:
        file.write(heights, 1)
    eye = ["-ox", "150.5", "-oy", f"{n - 120.5}", "-oz", "8"]
    subprocess.run(["gdal_viewshed", "-q", *eye, "-tz", "0", "-md", "0", "-cc", "0", path, seen], check=True)
    with rasterio.open(seen) as file:
        theirs = file.read(1) > 0
    ours = tl.viewshed(heights, (150.5, 120.5), eye_height=8.0).visible
    assert 0.05 < ours.mean() < 0.95
    assert (ours == theirs).mean() > 0.985


def test_flat_ground_is_seen_and_a_wall_hides_what_lies_behind():
    flat = np.zeros((9, 9))
    assert tl.viewshed(flat, (4.5, 4.5), eye_height=1.0).visible.all()
    flat[:, 6] = 5.0
    seen = tl.viewshed(flat, (2.5, 4.5), eye_height=1.0)
    assert seen.visible[:, :7].all()
    assert not seen.visible[:, 7:].any()
    np.testing.assert_allclose(seen.above[4, 7:], [6, 7])


def test_no_ground_hides_nothing_and_is_not_seen():
    heights = np.zeros((1, 5))
    heights[0, 2] = np.nan
    seen = tl.viewshed(heights, (0.5, 0.5, 1.0))
    assert seen.visible.tolist() == [[True, True, False, True, True]]
    assert np.isnan(seen.above[0, 2])


def test_curvature_hides_the_foot_of_what_is_far():
    """A flat sea from 2 m: the horizon lies 5.05 km away, and at 10 km 1.93 m are hidden."""
    grid = tl.Grid((121, 1), (0, 12_100, 0, 100))
    seen = tl.viewshed(np.zeros((1, 121)), (50, 50), grid=grid, eye_height=2.0, curvature=1.0)
    x = grid.x_centers - 50
    horizon = np.sqrt(2 * 2 * 6_370_997.0)
    assert seen.visible[0].tolist() == (x <= horizon).tolist()
    hidden = (x - horizon) ** 2 / (2 * 6_370_997.0)
    np.testing.assert_allclose(seen.above[0, 100], hidden[100], atol=0.01)


def test_tin_is_seen_as_its_heights():
    vertices = [[0, 0, 0], [10, 0, 2], [10, 8, 5], [0, 8, 1], [5, 4, 4]]
    mesh = (np.array(vertices, float), [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    grid = tl.Grid.around(mesh, pixel_size=0.5)
    found = tl.viewshed(mesh, (1, 1), pixel_size=0.5, eye_height=1.5)
    assert found.grid == grid
    assert_same(found.above, tl.viewshed(tl.height_map(mesh, grid), (1, 1), grid=grid, eye_height=1.5).above)
    near = tl.viewshed(mesh, (1, 1), grid=grid, eye_height=1.5, max_distance=2.0)
    x, y = np.meshgrid(grid.x_centers, grid.y_centers)
    assert_same(np.isnan(near.above), np.isnan(found.above) | (np.hypot(x - 1, y - 1) > 2))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"eye": (0.2, 2)}, "eye must lie within the middles of the cells"),
        ({"eye": (1, 2, 3, 4)}, r"eye must be finite \(x, y\) or \(x, y, z\)"),
        ({"eye": (2, 2, 1), "eye_height": 1.0}, "an eye has z or eye_height, got both"),
        ({"eye": (2, 2), "target_height": np.nan}, "target_height must be finite"),
        ({"eye": (2, 2), "max_distance": -1}, "max_distance must be at least 0"),
        ({"eye": (2, 2), "grid": tl.Grid((2, 2), (0, 1, 0, 1))}, "grid must have the 5 x 4 cells of the terrain"),
        ({"eye": (2, 2), "pixel_size": 1.0}, "pixel_size is for a mesh"),
    ],
)
def test_bad_options_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        tl.viewshed(np.zeros((4, 5)), **options)


def test_eye_without_ground_needs_its_height():
    heights = np.full((3, 3), np.nan)
    with pytest.raises(ValueError, match="there is no ground under the eye"):
        tl.viewshed(heights, (1.5, 1.5))
    with pytest.raises(ValueError, match="a mesh needs either a grid or a pixel_size"):
        tl.viewshed(tl.scenes.cube(), (0, 0, 5))
