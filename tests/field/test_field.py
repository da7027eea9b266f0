"""Fields and heights on grids, against planes written out here and evaluated pixel by pixel."""

from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

import topleft as tl
from topleft import scenes
from topleft._core import engine
from topleft._core.base.grid import Grid

SQUARE = [[0.0, 0], [4, 0], [4, 3], [0, 3]]
HALVES = [[0, 1, 2], [0, 2, 3]]
UTM = np.array([684321.25, 5412345.75])


def by_fractions(points, triangle, values, x, y):
    """The exact value of a plane."""
    (x0, y0), (x1, y1), (x2, y2) = [tuple(map(Fraction, points[k].tolist())) for k in triangle]
    v0, v1, v2 = (Fraction(float(values[k])) for k in triangle)
    area = (x1 - x0) * (y2 - y0) - (y1 - y0) * (x2 - x0)
    b1 = ((x - x0) * (y2 - y0) - (y - y0) * (x2 - x0)) / area
    b2 = ((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)) / area
    return v0 + b1 * (v1 - v0) + b2 * (v2 - v0)


def test_field_y_up_is_the_picture_turned_over():
    values = [0.0, 1, 5, 3]
    up, down = (tl.field((SQUARE, HALVES), values, (8, 6), y=y) for y in ("up", "down"))
    assert np.array_equal(up, down[::-1])


def test_field_outside_is_nan():
    found = tl.field((SQUARE, [[0, 1, 2]]), [1.0, 1, 1, 1], (6, 5), extent=(-1, 5, -1, 4), y="down")
    assert np.array_equal(np.isnan(found), ~tl.coverage(np.array(SQUARE) + 1, [[0, 1, 2]], (6, 5)))
    assert np.nanmin(found) == np.nanmax(found) == 1


def test_field_per_triangle_is_constant():
    found = tl.field((SQUARE, HALVES), np.array([7, 9], np.float32), (4, 3), y="down")
    ids = tl.rasterize(SQUARE, HALVES, (4, 3)).triangle
    assert found.dtype == np.float32
    assert found.tolist() == np.where(ids == 0, 7, 9).tolist()


@pytest.mark.parametrize("n_points", [12, 3000])  # runs of one triangle, and planes listed first
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_field_is_the_exact_plane_of_the_owner(n_points, dtype):
    points, triangles = scenes.planar_mesh(n_points, 90, 70)
    values = np.random.default_rng(3).normal(size=len(points)).astype(dtype)
    found = tl.field((points, triangles), values, (90, 70), extent=(0, 90, 0, 70), y="down")
    ids = tl.rasterize(points, triangles, (90, 70)).triangle
    assert found.dtype == dtype
    assert (ids >= 0).all()
    for row, column in np.random.default_rng(4).integers(0, [70, 90], (300, 2)).tolist():
        corners = triangles[ids[row, column]]
        exact = by_fractions(points, corners, values, Fraction(2 * column + 1, 2), Fraction(2 * row + 1, 2))
        # Centres that only the snap gives to a triangle are kept within its values.
        exact = min(max(exact, Fraction(float(values[corners].min()))), Fraction(float(values[corners].max())))
        # Slopes of needles lose what the area cancels: at most 1e-10 of values of about 1 here.
        assert abs(float(exact) - found[row, column]) < (1e-6 if dtype is np.float32 else 1e-10)


@pytest.mark.parametrize("y", ["up", "down"])
def test_field_at_large_coordinates_is_the_field_at_small_ones(y):
    points, triangles = scenes.planar_mesh(500, 64, 64)
    points = np.round(points * 64) / 64 * 0.25  # sixteenths of a quarter: exact with and without the offset
    values = points[:, 0] - points[:, 1]
    extent = np.array([1.0, 15, 2, 14])
    near = tl.field((points, triangles), values, (140, 120), extent=tuple(extent), y=y)
    moved = extent + UTM[[0, 0, 1, 1]]
    far = tl.field((points + UTM, triangles), values, (140, 120), extent=tuple(moved), y=y)
    assert np.array_equal(near, far)


def test_to_pixels_of_centimetres_at_utm_is_exact_to_a_billionth_of_a_pixel():
    grid = Grid((1000, 1000), (UTM[0], UTM[0] + 100, UTM[1], UTM[1] + 100))
    points = UTM + np.random.default_rng(1).uniform(0, 100, (200, 2))
    for found, point in zip(grid.to_pixels(points), points, strict=True):
        x, y = (10 * (Fraction(float(a)) - Fraction(float(b))) for a, b in zip(point, UTM, strict=True))
        assert abs(float(Fraction(float(found[0])) - x)) < 1e-9
        assert abs(float(Fraction(float(found[1])) - (1000 - y))) < 1e-9


@pytest.mark.parametrize("y", ["up", "down"])
@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.longdouble])
def test_to_pixels_of_points_of_any_width_is_that_of_float64(dtype, y):
    grid = Grid((1000, 1000), (0.1, 2000.3, 0.1, 2000.3), y=y)
    points = np.random.default_rng(1).uniform(0, 2000, (50, 2)).astype(dtype)
    assert np.array_equal(grid.to_pixels(points), grid.to_pixels(points.astype(np.float64)))


def test_field_values_that_are_nan_stay_in_their_triangles():
    found = tl.field((SQUARE, HALVES), [0.0, np.nan, 1, 2], (40, 30), y="down")
    ids = tl.rasterize(np.array(SQUARE) * 10, HALVES, (40, 30)).triangle
    assert np.array_equal(np.isnan(found), ids == 0)


def test_field_never_leaves_the_values_of_its_mesh():
    rng = np.random.default_rng(8)
    points = rng.uniform(0, 100, (3000, 2))
    triangles = rng.integers(0, 3000, (1500, 3))
    triangles[:, 2] = (triangles[:, 1] + 1) % 3000
    points[triangles[:, 2]] = points[triangles[:, 1]] + rng.uniform(-0.01, 0.01, (1500, 2))  # needles
    found = tl.field((points, triangles), rng.uniform(-1, 1, 3000), (100, 100), extent=(0, 100, 0, 100))
    assert np.isfinite(found).sum() > 1000
    assert np.nanmax(np.abs(found)) <= 1


def test_field_of_a_masked_triangulation_leaves_triangles_out():
    tri = pytest.importorskip("matplotlib.tri")
    x, y = np.array(SQUARE).T
    theirs = tri.Triangulation(x, y, HALVES, mask=[True, False])
    found = tl.field(theirs, [7.0, 9.0], (8, 6), extent=(0, 4, 0, 3))
    assert set(found[np.isfinite(found)].tolist()) == {9.0}
    assert np.isnan(found).any()


def test_field_of_faces_with_four_corners_is_per_face():
    quads = SimpleNamespace(
        points=np.array([*SQUARE, [8.0, 0], [8, 3]]),
        cells=[SimpleNamespace(type="quad", data=np.array([[0, 1, 2, 3], [1, 4, 5, 2]]))],
    )
    assert tl.field(quads, [3.0, 4.0], (2, 1)).tolist() == [[3, 4]]


def test_field_pixel_size_makes_the_grid():
    found = tl.field((SQUARE, HALVES), [0.0, 4, 4, 0], pixel_size=(1.0, 1.5))
    assert found.tolist() == [[0.5, 1.5, 2.5, 3.5]] * 2


def test_field_threads_change_nothing():
    points, triangles = scenes.planar_mesh(3000, 90, 70)
    one, three = (tl.field((points, triangles), points[:, 0], (200, 150), threads=n) for n in (1, 3))
    assert np.array_equal(one, three)


@pytest.mark.parametrize("isa", engine.isa_available())
@pytest.mark.parametrize("n_points", [12, 3000])
def test_field_has_the_same_bits_on_each_instruction_set(isa, n_points):
    points, triangles = scenes.planar_mesh(n_points, 90, 70)
    values = np.sin(points[:, 0])
    before = engine.isa_in_use()
    expected = tl.field((points, triangles), values, (90, 70))
    engine.use_isa(isa)
    try:
        assert np.array_equal(tl.field((points, triangles), values, (90, 70)), expected, equal_nan=True)
    finally:
        engine.use_isa(before)


def test_field_out_is_written_and_returned():
    for values in ([0.0, 1, 2, 3], [5.0, 6.0]):
        out = np.zeros((6, 16))[:, ::2]
        assert tl.field((SQUARE, HALVES), values, (8, 6), out=out) is out
        assert np.array_equal(out, tl.field((SQUARE, HALVES), values, (8, 6)))
    heights = np.zeros((3, 4))
    assert tl.height_map((np.column_stack([SQUARE, [1, 2, 3, 4]]), HALVES), 1.0, out=heights) is heights
    assert heights.all()


def test_field_result_is_not_overwritten_by_the_next():
    first = tl.field((SQUARE, HALVES), [0.0, 1, 2, 3], (8, 6))
    kept = first.copy()
    tl.field((SQUARE, HALVES), [9.0, 9, 9, 9], (8, 6))
    assert np.array_equal(first, kept)


# Heights


def ball(offset=0.0):
    vertices, triangles = scenes.shape("icosphere", subdivisions=3)
    return vertices + (0, 0, offset), triangles


@pytest.mark.parametrize("offset", [0.0, 4000.0])
def test_height_map_of_a_ball_has_an_upper_and_a_lower_side(offset):
    grid = Grid((200, 200), (-1, 1, -1, 1))
    upper, lower = (tl.height_map(ball(offset), grid, surface=side) for side in ("upper", "lower"))
    x, y = np.meshgrid(grid.x_centers, grid.y_centers)
    exact = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    inside = x**2 + y**2 < 0.9
    assert np.abs(upper - offset - exact)[inside].max() < 0.02  # flat faces of a ball of 1,280 triangles
    assert np.abs(lower - offset + exact)[inside].max() < 0.02
    assert np.array_equal(np.isnan(upper), np.isnan(lower))
    assert np.isnan(upper[0, 0])


def test_height_map_is_exact_in_float64():
    slope = np.array([[0, 0, 1234.5678], [100, 0, 1234.5679], [100, 100, 1234.568], [0, 100, 1234.5677]])
    found = tl.height_map((slope, HALVES), 10.0, y="down")
    ids = tl.rasterize(slope[:, :2] / 10, HALVES, (10, 10)).triangle
    for row in range(10):
        for column in range(10):
            at = Fraction(10 * column + 5), Fraction(10 * row + 5)
            exact = by_fractions(slope[:, :2], HALVES[ids[row, column]], slope[:, 2], *at)
            assert abs(float(exact - Fraction(float(found[row, column])))) < 1e-12  # float32: 1e-4


def test_height_map_tells_close_surfaces_apart():
    low = np.array([[0, 0, 0.0], [9, 0, 0], [0, 9, 0]])
    sheets = np.vstack([low + (0, 0, 8000), low + (0, 0, 8000.01), low])  # 1 cm in 8 km
    triangles = np.arange(9).reshape(3, 3)
    assert np.nanmin(tl.height_map((sheets, triangles), 1.0)) == 8000.01
    assert np.nanmax(tl.height_map((sheets, triangles), 1.0, surface="lower")) == 0


def test_height_map_of_a_table_is_level():
    table = np.column_stack([SQUARE, np.full(4, 2.25)])
    assert (tl.height_map((table, HALVES), 0.5) == 2.25).all()
    assert tl.height_map((table, HALVES), 0.5).shape == (6, 8)


# Grids


def test_grid_around_a_box_has_whole_pixels():
    grid = Grid.around((SQUARE, HALVES), pixel_size=0.9)
    assert grid.size == (5, 4)
    assert grid.extent == (0, 4.5, 0, 3.6)
    assert Grid.around(([[0.1, 0], [0.4, 0], [0.1, 0.1]], [[0, 1, 2]]), pixel_size=0.1).size == (3, 1)


def test_grid_around_a_mesh_is_that_around_its_arrays():
    mesh = tl.Mesh([[0, 0, 1], [4, 0, 2], [0, 3, 1]], [[0, 1, 2]])
    assert Grid.around(mesh, size=(8, 6)) == Grid.around((mesh.vertices, mesh.triangles), size=(8, 6))


@pytest.mark.parametrize("subject", ["mesh.obj", 3, (SQUARE,)])
def test_grid_around_what_has_no_triangles_is_refused(subject):
    with pytest.raises(TypeError, match=r"subject must be a Mesh or \(points, triangles\), got"):
        Grid.around(subject, size=(4, 3))


def test_grid_around_looks_only_at_points_in_use():
    grid = Grid.around(([*SQUARE, [1e9, 1e9]], HALVES), size=(8, 6))
    assert grid.extent == (0, 4, 0, 3)
    assert grid.pixel_size == (0.5, 0.5)


def test_grid_centers_go_with_the_rows():
    assert Grid((2, 2), (0, 2, 10, 12)).y_centers.tolist() == [11.5, 10.5]
    assert Grid((2, 2), (0, 2, 10, 12), "down").y_centers.tolist() == [10.5, 11.5]
    assert Grid((2, 2), (0, 2, 10, 12)).x_centers.tolist() == [0.5, 1.5]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: tl.field((SQUARE, HALVES), [1, 2, 3], (4, 3)),
         r"shape \(4,\) or \(4, C\) per vertex or \(2,\) or \(2, C\) per face, got \(3,\)"),
        (lambda: tl.field((SQUARE, HALVES), [1, 2], (4, 3), per="vertex"),
         r"values must have shape \(4,\) or \(4, C\), got \(2,\)"),
        (lambda: tl.field((SQUARE, HALVES), [1] * 4, (4, 3), per="triangle"),
         r"values must have shape \(2,\) or \(2, C\), got \(4,\)"),
        (lambda: tl.field((SQUARE, HALVES * 2), [1] * 4, (4, 3)), "values has 4 rows, and there are as many faces"),
        (lambda: tl.field((SQUARE, HALVES), [1] * 4), "a grid needs either size or pixel_size"),
        (lambda: tl.field((SQUARE, HALVES), [1] * 4, (4, 3), pixel_size=1), "a grid needs either size or pixel_size"),
        (lambda: tl.field((SQUARE, HALVES), [1] * 4, pixel_size=0), "pixel_size must be positive, got 0"),
        (lambda: tl.field((SQUARE, HALVES), [1] * 4, (4, 3), y="left"), "y must be one of 'up', 'down', got 'left'"),
        (lambda: tl.field((SQUARE, HALVES), [1] * 4, (4, 3), extent=(0, 1, 2)),
         r"extent must be \(x_min, x_max, y_min"),
        (lambda: tl.field((SQUARE, HALVES), [1] * 4, (4, 3), extent=(0, 0, 1, 2)),
         "extent must be finite with x_min < x"),
        (lambda: tl.field((SQUARE, HALVES), [1] * 4, Grid((4, 3), (0, 1, 0, 1)), extent=(0, 1, 0, 1)),
         "a Grid says extent, pixel_size and y itself"),
        (lambda: tl.field((SQUARE, np.empty((0, 3), int)), [1] * 4, (4, 3)), "a mesh without triangles has no extent"),
        (lambda: tl.field(([1, 2], HALVES), [1] * 4, (4, 3)),
         r"points must have shape \(V, 2\) or \(V, 3\), got \(2,\)"),
        (lambda: tl.field(([*SQUARE[:3], [0, np.nan]], HALVES), [1] * 4, (4, 3), extent=(0, 1, 0, 1)),
         "must be finite"),
        (lambda: tl.height_map((SQUARE, HALVES), 1), r"a height map needs points of shape \(V, 3\), got \(4, 2\)"),
        (lambda: tl.height_map((SQUARE, HALVES), 1, surface="top"),
         "surface must be one of 'upper', 'lower', got 'top'"),
        (lambda: tl.height_map(([[0, 0, 0], [1, 0, np.nan], [0, 1, 0]], [[0, 1, 2]]), 1),
         "vertices must be finite where a triangle uses them"),
    ],
)  # fmt: skip
def test_field_impossible_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_field_of_words_is_refused():
    with pytest.raises(TypeError, match="values must be real numbers, got dtype"):
        tl.field((SQUARE, HALVES), ["a", "b", "c", "d"], (4, 3))
    with pytest.raises(TypeError, match="points must be real numbers, got dtype"):
        tl.field(([["a", "b"]] * 4, HALVES), [1] * 4, (4, 3))


def test_field_with_an_index_outside_is_refused():
    with pytest.raises(IndexError, match=r"triangles must hold indices in \[0, 4\)"):
        tl.field((SQUARE, [[0, 1, 4]]), [1] * 4, (4, 3), extent=(0, 1, 0, 1))


@pytest.mark.parametrize("triangles", [[[0.0, 1.0, 2.0]], [[True, False, True]]])
def test_grid_around_triangles_that_are_no_integers_is_refused(triangles):
    with pytest.raises(TypeError, match="triangles must be integers, got dtype"):
        tl.field((SQUARE, triangles), [1] * 4, (4, 3))
    with pytest.raises(TypeError, match="triangles must be integers, got dtype"):
        Grid.around((SQUARE, triangles), size=(4, 3))


def test_field_of_float32_values_of_the_other_byte_order_is_float32():
    scene, values = ([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]]), np.array([0, 4, 8], np.float32)
    got = tl.field(scene, values.astype(values.dtype.newbyteorder()), (4, 4))
    assert got.dtype == np.float32
    assert np.array_equal(got, tl.field(scene, values, (4, 4)), equal_nan=True)


def test_height_map_of_more_pixels_than_numbers_count_is_refused():
    with pytest.raises(ValueError, match="pixel_size must give a grid of countable pixels"):
        tl.height_map(([[0, 0, 0], [4e10, 0, 0], [0, 4, 0]], [[0, 1, 2]]), 1e-300)


QUADRATIC = {  # on the unit square or the triangle below its diagonal
    "triangle6": [(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)],
    "triangle7": [(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5), (1 / 3, 1 / 3)],
    "quad8": [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5)],
    "quad9": [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5), (0.5, 0.5)],
}


class Cells:
    """A mesh with the attributes of meshio's."""

    def __init__(self, points, blocks, point_data=None, cell_data=None):
        self.points = np.array(points, float)
        self.cells = [SimpleNamespace(type=kind, data=np.array(rows)) for kind, rows in blocks]
        self.point_data, self.cell_data = point_data or {}, cell_data or {}


@pytest.mark.parametrize("kind", QUADRATIC)
def test_field_of_quadratic_cells_has_the_values_of_all_their_points(kind):
    points = np.array(QUADRATIC[kind])
    mesh = Cells(points, [(kind, [range(len(points))])], {"u": points[:, 0] ** 2}, {"zone": [[7]]})
    grid = tl.Grid((8, 8), (0, 1, 0, 1))
    found, inside = tl.field(mesh, "u", grid), tl.polygons([points[: 3 if kind[0] == "t" else 4]], grid)
    assert np.array_equal(np.isfinite(found), inside)
    x, _ = np.meshgrid(grid.x_centers, grid.y_centers)
    assert np.abs(found - x**2)[inside].max() < 0.07  # a quarter of the 0.25 from corner to corner, or about so
    assert np.array_equal(tl.field(mesh, "zone", grid, nodata=0) == 7, inside)


def test_field_takes_data_of_a_mesh_by_name():
    points = [(0, 0), (4, 0), (4, 4), (0, 4), (8, 0)]
    blocks = [("line", [[0, 1]]), ("quad", [[0, 1, 2, 3]]), ("triangle", [[1, 4, 2]])]
    data = {"u": np.arange(5.0)}
    mesh = Cells(points, blocks, data, {"zone": [np.array([9]), np.array([1]), np.array([2])]})
    grid = tl.Grid((8, 4), (0, 8, 0, 4))
    assert np.array_equal(tl.field(mesh, "u", grid), tl.field(mesh, data["u"], grid), equal_nan=True)
    assert set(tl.field(mesh, "zone", grid, nodata=0)[1].tolist()) == {1, 2, 0}
    with pytest.raises(ValueError, match=r"values must be numbers or a name of data of the mesh \(u, zone\), got 'v'"):
        tl.field(mesh, "v", grid)
    with pytest.raises(ValueError, match=r"name of data of the mesh \(none\), got 'v'"):
        tl.field((points, [[0, 1, 2]]), "v", grid)
    solid = Cells([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [("tetra", [[0, 1, 2, 3]])], {}, {"zone": [[1]]})
    with pytest.raises(ValueError, match="values 'zone' are of solid cells, and their skin is drawn"):
        tl.field(solid, "zone", grid)


@pytest.mark.parametrize("n_values", [4, 2])  # of vertices, of faces
@pytest.mark.parametrize("dtype", [np.float32, np.int32])
def test_field_of_vectors_has_a_channel_for_each_column(n_values, dtype):
    values = np.random.default_rng(5).integers(0, 99, (n_values, 3)).astype(dtype)
    grid = tl.Grid((9, 7), (-1, 5, -1, 4), nodata=-7)
    found = tl.field((SQUARE, HALVES), values, grid)
    columns = [tl.field((SQUARE, HALVES), column, grid) for column in values.T]
    assert found.dtype == columns[0].dtype
    assert np.array_equal(found, np.stack(columns, axis=-1))
    out = np.empty((7, 9, 6), found.dtype)[..., ::2]
    assert tl.field((SQUARE, HALVES), values, grid, out=out) is out
    assert np.array_equal(out, found)


def test_field_of_vectors_outside_is_nan_in_each_channel():
    found = tl.field((SQUARE, [[0, 1, 2]]), np.ones((4, 2)), (6, 5), extent=(-1, 5, -1, 4))
    assert found.shape == (5, 6, 2)
    assert np.array_equal(np.isnan(found[..., 0]), np.isnan(found[..., 1]))
    assert np.isnan(found).any()
    assert np.nanmax(found) == 1


def test_field_of_vectors_with_as_many_faces_as_vertices_asks_which():
    with pytest.raises(ValueError, match="values has 4 rows, and there are as many faces as vertices"):
        tl.field((SQUARE, HALVES * 2), np.ones((4, 3)), (4, 3))
    with pytest.raises(ValueError, match=r"values must have shape \(4,\) or \(4, C\) per vertex or \(2,\) or \(2, C\)"):
        tl.field((SQUARE, HALVES), np.ones((4, 3, 3)), (4, 3))


EDGES = {  # of VTK's quadratic cells, in the order of their points
    "tetra": ["01", "12", "20", "03", "13", "23"],
    "hexahedron": ["01", "12", "23", "30", "45", "56", "67", "74", "04", "15", "26", "37"],
    "wedge": ["01", "12", "20", "34", "45", "53", "03", "14", "25"],
    "pyramid": ["01", "12", "23", "30", "04", "14", "24", "34"],
}
MIDDLES = {
    "hexahedron": ["0473", "1265", "0154", "3762", "0321", "4567", "01234567"],
    "wedge": ["0143", "1254", "2035"],
    "pyramid": ["0123"],
}
SOLIDS = {  # corners, and the volume
    "tetra": ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], 1 / 6),
    "hexahedron": ([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], 1.0),
    "wedge": ([(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1)], 1 / 2),
    "pyramid": ([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)], 1 / 3),
}
CELLS = ["tetra10", "hexahedron20", "hexahedron24", "hexahedron27", "wedge15", "wedge18", "pyramid13", "pyramid14"]


def quadratic(kind):
    """The points of a quadratic solid cell with straight sides, and its volume."""
    solid = kind.rstrip("0123456789")
    corners, volume = SOLIDS[solid]
    names = [*EDGES[solid], *MIDDLES.get(solid, [])][: int(kind[len(solid) :]) - len(corners)]
    points = [*corners, *(np.mean([corners[int(i)] for i in name], axis=0) for name in names)]
    return np.array(points, float), volume


@pytest.mark.parametrize("is_mirrored", [False, True])
@pytest.mark.parametrize("kind", CELLS)
def test_skin_of_quadratic_solids_is_cut_between_all_points(kind, is_mirrored):
    points, volume = quadratic(kind)
    points[:, 0] *= -1 if is_mirrored else 1
    mesh = tl.as_mesh(Cells(points, [(kind, [range(len(points))])]))
    is_inside = np.isclose(np.abs(points), 0.5).all(axis=1) & (kind == "hexahedron27")
    assert sorted(set(mesh.triangles.ravel())) == np.flatnonzero(~is_inside).tolist()
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    assert np.isclose((a * np.cross(b, c)).sum() / 6, volume)
    center = points.mean(axis=0)
    assert (((a + b + c) / 3 - center) * np.cross(b - a, c - a)).sum(axis=1).min() > 0
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert areas.max() < 4.1 * areas.min()  # no point on a wrong edge makes a sliver


def test_skin_of_quadratic_solids_leaves_out_sides_between_two():
    points, _ = quadratic("hexahedron20")
    both = np.concatenate([points, points + [1, 0, 0]])
    cells = [("hexahedron20", [range(20), range(20, 40)])]
    _, first, names = np.unique(both, axis=0, return_index=True, return_inverse=True)
    mesh = tl.as_mesh(Cells(both[first], [(kind, names.ravel()[np.array(rows)]) for kind, rows in cells]))
    assert len(mesh.triangles) == 10 * 6
    rows = names.ravel()[np.array([range(20), range(20, 40)])]
    mixed = tl.as_mesh(Cells(both[first], [("hexahedron20", rows[:1]), ("hexahedron", rows[1:, :8])]))
    assert len(mixed.triangles) == 5 * 6 + 5 * 2


def test_field_of_a_quadratic_solid_has_values_in_the_middle_of_edges():
    points, _ = quadratic("hexahedron20")
    grid = tl.Grid((8, 8), (0, 1, 0, 1))
    found = tl.field(Cells(points, [("hexahedron20", [range(20)])], {"u": points[:, 0] ** 2}), "u", grid)
    x, _ = np.meshgrid(grid.x_centers, grid.y_centers)
    assert np.abs(found - x**2).max() < 0.07
