"""Polygons: their triangles cover what they cover."""

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on, one_by_one
from hypothesis import given
from hypothesis import strategies as st

import topleft as tl
from topleft._meshes.model import polygons
from topleft._meshes.model.polygons import triangulate
from topleft._meshes.scene.adapt import as_mesh, as_polygons

ARROW = np.array([[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]], float)


def areas(points, triangles):
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def area_of_polygon(points):
    x, y = points.T
    return (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@pytest.mark.parametrize("first", range(5))
@pytest.mark.parametrize("turn", [1, -1])
def test_triangulate_concave_polygon_from_any_corner(first, turn):
    points = np.roll(ARROW, first, axis=0)[::turn]
    triangles, faces = triangulate(points, np.arange(5), np.array([5]))
    assert faces.tolist() == [0, 0, 0]
    assert areas(points, triangles).sum() == 10 * turn
    assert (np.sign(areas(points, triangles)) == turn).all()


@pytest.mark.parametrize("first", range(4))
def test_triangulate_concave_quad_takes_the_inner_diagonal(first):
    points = np.roll([[0, 0], [4, 0], [1, 1], [0, 4]], first, axis=0).astype(float)
    triangles, _ = triangulate(points, np.arange(4), np.array([4]))
    assert sorted(areas(points, triangles).tolist()) == [2, 2]


def test_triangulate_convex_polygons_are_fans():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    assert triangulate(points, np.arange(4), np.array([4]))[0].tolist() == [[0, 1, 2], [0, 2, 3]]


def test_triangulate_faces_of_all_sizes_keep_their_order():
    corners = np.array([0, 1, 2, 0, 1, 0, 1, 2, 3, 4, 4, 1, 0])
    triangles, faces = triangulate(ARROW, corners, np.array([3, 2, 5, 3]))
    assert faces.tolist() == [0, 2, 2, 2, 3]
    assert corners[triangles[0]].tolist() == [0, 1, 2]
    assert corners[triangles[-1]].tolist() == [4, 1, 0]


@one_by_one("seed", range(40))
def test_triangulate_stars_in_space_cover_themselves(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 60))
    angle = np.sort(rng.random(n) + np.arange(n)) * 2 * np.pi / n
    flat = (0.1 + rng.random(n))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = np.column_stack([flat, np.zeros(n)]) @ turned.T
    triangles, _ = triangulate(points, np.arange(n), np.array([n]))
    assert len(triangles) == n - 2
    assert areas(flat, triangles).sum() == pytest.approx(area_of_polygon(flat))
    assert (areas(flat, triangles) > -1e-12).all()


def test_triangulate_spiral_of_2_000_corners_covers_itself():
    turn, far = np.linspace(0, 20, 1000), np.linspace(0.2, 1, 1000)
    around = np.column_stack([np.cos(turn), np.sin(turn)])
    points = np.concatenate([far[:, None] * around, (far[:, None] - 0.1) * around[::1]][::1])
    points[1000:] = points[1000:][::-1]
    triangles, _ = triangulate(points, np.arange(2000), np.array([2000]))
    assert (areas(points, triangles) > 0).all()
    assert areas(points, triangles).sum() == pytest.approx(area_of_polygon(points))


def test_triangulate_corner_that_is_no_point_is_refused():
    with pytest.raises(IndexError, match="corner 3 = 9 must be one of 5 points"):
        triangulate(ARROW, np.array([0, 1, 2, 9]), np.array([4]))


@pytest.mark.parametrize("faces", [[[0, 1, 2, 3, 4]], [[0, 1, 2, 3, 4], [0, 1, 2]], np.array([[0, 1, 2, 3, 4]])])
def test_as_mesh_of_a_pair_takes_polygons(faces):
    mesh = as_mesh((ARROW, faces))
    assert areas(mesh.vertices[:, :2], mesh.triangles)[:3].sum() == 10
    assert as_polygons((ARROW, faces)).n_faces == len(faces)


def test_field_of_a_concave_polygon_covers_its_area():
    points = np.array([[0, 0], [1, 0], [1, 1], [0.5, 0.25], [0, 1]])
    values = tl.field((points, [[0, 1, 2, 3, 4]]), [1.0], (64, 64), per="triangle", extent=(0, 1, 0, 1))
    assert np.isfinite(values).mean() == pytest.approx(0.625, abs=0.01)


CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)


class Block:
    def __init__(self, kind, rows):
        self.type, self.data = kind, np.array(rows)


class Cells:
    def __init__(self, points, *blocks):
        self.points, self.cells = points, list(blocks)


class Grid:
    """What `pyvista.UnstructuredGrid` looks like."""

    def __init__(self, points, cells, kinds):
        self.points, self.cells, self.celltypes = points, np.array(cells), np.array(kinds, np.uint8)


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


@pytest.mark.parametrize(
    ("kind", "rows", "expected"),
    [
        ("tetra", [[0, 1, 2, 4]], 1 / 6),
        ("hexahedron", [[0, 1, 3, 2, 4, 5, 7, 6]], 1),
        ("voxel", [[0, 1, 2, 3, 4, 5, 6, 7]], 1),
        ("wedge", [[0, 2, 1, 4, 6, 5]], 0.5),
        ("wedge", [[0, 1, 2, 4, 5, 6]], 0.5),
        ("pyramid", [[0, 1, 3, 2, 4]], 1 / 3),
    ],
)
def test_as_mesh_of_a_solid_cell_is_its_skin_seen_from_outside(kind, rows, expected):
    assert volume(as_mesh(Cells(CUBE, Block(kind, rows)))) == pytest.approx(expected)


def test_as_mesh_of_two_cells_leaves_out_the_side_between():
    mesh = as_mesh(Cells(CUBE, Block("tetra", [[0, 1, 2, 4], [1, 3, 2, 7], [1, 2, 4, 7]])))
    assert len(mesh.triangles) == 3 * 4 - 2 * 2


def test_as_mesh_of_an_unstructured_grid_is_its_skin_or_its_surface():
    solid = Grid(CUBE, [4, 0, 1, 2, 4, 8, 0, 1, 3, 2, 4, 5, 7, 6], [10, 12])
    assert volume(as_mesh(solid)) == pytest.approx(7 / 6)
    surface = Grid(CUBE, [3, 0, 1, 2, 4, 0, 1, 3, 2, 2, 0, 1], [5, 9, 3])
    assert as_mesh(surface).triangles.tolist() == [[0, 1, 2], [0, 1, 3], [0, 3, 2]]


def test_as_mesh_of_faces_that_end_early_is_refused():
    class Poly:
        points, faces, n_strips = CUBE, np.array([3, 0, 1, 2, 4, 0, 1]), 0

    with pytest.raises(ValueError, match=r"faces\[4\] = 4 must be a number of corners that follow"):
        as_mesh(Poly())


def first_ears(points):
    """The same triangles of one flat polygon, by looking at all corners again for each."""
    (x, y), left = points.T.tolist(), list(range(len(points)))
    if area_of_polygon(points) < 0:
        x, y = y, x

    def turn(a, b, c):
        return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])

    def holds(corners, i):
        sides = zip(corners, corners[1:] + corners[:1], strict=True)
        others = all((x[i], y[i]) != (x[k], y[k]) for k in corners)
        return others and all((x[q] - x[p]) * (y[i] - y[p]) >= (y[q] - y[p]) * (x[i] - x[p]) for p, q in sides)

    around = {i: (left[i - 1], i, left[(i + 1) % len(left)]) for i in left}
    reflex, triangles, at = {i for i in left if turn(*around[i]) < 0}, [], 0
    while len(left) > 3:
        for step in range(len(left)):
            k = (at + step) % len(left)
            own = [left[k - 1], left[k], left[(k + 1) % len(left)]]
            if own[1] not in reflex and turn(*own) >= 0 and not any(holds(own, i) for i in reflex):
                break
        else:
            k = (at + 1) % len(left)
        triangles.append([left[k - 1], left[k], left[(k + 1) % len(left)]])
        reflex.discard(left.pop(k))
        at = k % len(left)
        for j in (at - 1, at):
            if left[j] in reflex and turn(left[j - 1], left[j], left[(j + 1) % len(left)]) >= 0:
                reflex.discard(left[j])
    return [*triangles, [left[at - 1], left[at], left[(at + 1) % 3]]]


@ON_EACH_ISA
@given(st.integers(0, 2**32 - 1))
def test_triangulate_takes_the_first_ear_of_any_polygon(isa, seed):
    """Of those that cross and touch themselves, and whose corners repeat and lie on lines."""
    rng = np.random.default_rng(seed)
    points = rng.integers(0, rng.choice([3, 6, 40]), (int(rng.integers(5, 90)), 2)).astype(float)
    points[0], points[2, 0] = 0, 64  # the size, which all are divided by: no rounding
    expected = first_ears(points)
    with on(isa):
        triangles, _ = triangulate(points, np.arange(len(points)), np.array([len(points)]))
    if len({*map(tuple, points)}) > 2 and area_of_polygon(points):
        assert triangles.tolist() == expected or not has_reflex(points)


def has_reflex(points):
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turns = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return (turns * area_of_polygon(points) < 0).any()


def around(n, radius):
    angle = np.arange(n) * 2 * np.pi / n
    return radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def square_spiral(n):
    """A corridor that winds inwards round a point: the triangle of each outer corner holds all inner ones."""
    steps = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    k = np.arange(n // 2)
    path = np.concatenate([[[0, 0]], np.cumsum(steps[k % 4] * (2 + k)[:, None], axis=0)[:-1]]).astype(float)
    inner = path + 0.3 * (np.roll(steps, -1, axis=0)[(k - 1) % 4] + np.roll(steps, -1, axis=0)[k % 4])
    return np.concatenate([path, inner[::-1]])


@pytest.mark.parametrize(
    "points", [around(100_000, 1 - 0.9 * np.random.default_rng(1).random(100_000)), square_spiral(100_000)]
)
def test_triangulate_polygon_of_100_000_corners_covers_itself(points):
    triangles, _ = triangulate(points, np.arange(len(points)), np.array([len(points)]))
    turned = areas(points, triangles) * np.sign(area_of_polygon(points))
    assert (turned > -1e-12 * abs(points).max() ** 2).all()
    assert turned.sum() == pytest.approx(abs(area_of_polygon(points)))
    assert len(triangles) == len(points) - 2


def test_triangulate_polygon_of_100_000_corners_at_random_ends():
    points = np.random.default_rng(1).random((100_000, 2))
    triangles, _ = triangulate(points, np.arange(100_000), np.array([100_000]))
    assert (np.bincount(triangles.reshape(-1), minlength=100_000) > 0).all()


def test_triangulate_faces_that_take_too_long_are_refused(monkeypatch):
    monkeypatch.setattr(polygons, "MAX_STEPS", 1000)
    points = around(9000, 1 - 0.9 * np.random.default_rng(1).random(9000))
    with pytest.raises(ValueError, match=r"within 1,000 comparisons, polygon 1 of 9,000 corners takes more"):
        triangulate(points, np.concatenate([np.arange(5), np.arange(9000)]), np.array([5, 9000]))


def test_triangulate_more_corners_than_there_are_is_refused():
    with pytest.raises(ValueError, match="must have 5 corners together, got 7"):
        triangulate(ARROW, np.arange(5), np.array([4, 3]))
