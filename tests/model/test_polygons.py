"""Polygons: their triangles cover what they cover."""

from __future__ import annotations

import numpy as np
import pytest

import topleft as tl
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


@pytest.mark.parametrize("seed", range(40))
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
        ("tetra10", [[0, 1, 2, 4, 0, 0, 0, 0, 0, 0]], 1 / 6),
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
