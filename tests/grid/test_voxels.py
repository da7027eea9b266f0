"""Voxels against layers, against an exact test of triangle and cube, and against volumes that are known."""

import itertools
import warnings
from fractions import Fraction

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl

CLOSED = ("cube", "sphere", "torus", "torus-knot")


def placed(rng, name, dtype=np.float64):
    """A closed mesh, turned and stretched."""
    vertices, triangles = tl.scenes.shape(name)
    return (vertices @ rng.normal(size=(3, 3)) + rng.normal(size=3)).astype(dtype), triangles


def volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]].astype(np.float64) for k in range(3))
    return abs(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def filled_by_layers(vertices, triangles, shape, found):
    """What the parity of the layers of `peel` fills."""
    nx, ny, nz = found.values.shape
    box = np.stack([vertices.min(axis=0), vertices.max(axis=0)]).astype(np.float64)
    low = box[0] if np.ndim(shape) == 0 else (box[0] + box[1] - found.pitch * np.array(shape)) / 2
    points = (vertices.astype(np.float64) - low) * (1 / found.pitch)
    layers = tl.peel(points[:, [1, 0, 2]], triangles, (ny, nx), layers=16)
    assert layers.count.max() < 16
    flips = np.zeros((nx, ny, nz + 1), np.int32)
    rows, columns, k = np.nonzero(layers.triangle >= 0)
    steps = np.ceil(layers.depth[rows, columns, k] - np.float32(0.5)).clip(0, nz).astype(int)
    np.add.at(flips, (rows, columns, steps), 1)
    return np.cumsum(flips, axis=2)[:, :, :nz] % 2 == 1


@ON_EACH_ISA
@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.parametrize("shape", [1, 7, 31, 64, 65, (3, 70, 128)])
def test_solid_is_filled_by_the_parity_of_layers(isa, name, shape):
    rng = np.random.default_rng(len(name))
    vertices, triangles = placed(rng, name, rng.choice([np.float32, np.float64]))
    with on(isa):
        found = tl.voxelize((vertices, triangles), shape)
        assert found.n_odd == 0
        assert_same(found.values, filled_by_layers(vertices, triangles, shape, found))
        assert_same(tl.voxelize((vertices, triangles), shape, threads=3).values, found.values)


@pytest.mark.parametrize("seed", range(20))
def test_closed_mesh_has_no_odd_column(seed):
    """Meshes that cut themselves, with vertices on the middles and the edges of columns."""
    rng = np.random.default_rng(seed)
    vertices, triangles = tl.scenes.icosphere(2)
    vertices = (rng.integers(-8, 9, vertices.shape) / 2).astype(np.float32)
    assert tl.voxelize((vertices, triangles), pitch=float(rng.choice([0.5, 1, 0.3]))).n_odd == 0


@pytest.mark.parametrize("name", CLOSED)
def test_volume_of_voxels_is_that_of_the_mesh(name):
    """Off by less than what the surface meets: a voxel for each, half of them on either side."""
    vertices, triangles = placed(np.random.default_rng(3), name)
    exact = volume(vertices, triangles)
    found = tl.voxelize((vertices, triangles), 64)
    touched = tl.voxelize((vertices, triangles), 64, solid=False, rule="touched")
    assert abs(found.volume - exact) < 0.1 * touched.volume
    finer = tl.voxelize((vertices, triangles), 64, samples=4)
    assert abs(finer.volume - exact) < 0.02 * touched.volume
    whole, none = tl.voxelize((vertices, triangles), 64, rule="touched").values, ~(found.values | touched.values)
    assert_same(whole, found.values | touched.values)
    assert (finer.values[none] == 0).all()
    assert (finer.values[found.values & ~touched.values] == 1).all()


@pytest.mark.parametrize("samples", [2, 4, 8])
def test_shares_are_those_of_smaller_voxels(samples):
    vertices, triangles = placed(np.random.default_rng(5), "torus")
    box = np.stack([vertices.min(0), vertices.min(0) + np.ptp(vertices, axis=0).max()])
    shares = tl.voxelize((vertices, triangles), 20, bounds=box, samples=samples)
    finer = tl.voxelize((vertices, triangles), 20 * samples, bounds=box).values
    blocks = finer.reshape(20, samples, 20, samples, 20, samples).sum(axis=(1, 3, 5))
    assert_same(shares.values, (blocks / samples**3).astype(np.float32))


def meets(corners, cube):
    """Whether a triangle meets a closed cube of side 1, by separating axes in fractions."""
    corners = [[Fraction(x) for x in corner] for corner in corners]
    points = [
        [Fraction(c + d) for c, d in zip(cube, offset, strict=True)] for offset in itertools.product((0, 1), repeat=3)
    ]
    edges = [[b - a for a, b in zip(corners[i], corners[(i + 1) % 3], strict=True)] for i in range(3)]

    def cross(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    units = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    axes = [cross(edges[0], edges[1]), *units, *(cross(edge, unit) for edge in edges for unit in units)]
    for axis in axes:
        own = [sum(x * y for x, y in zip(corner, axis, strict=True)) for corner in corners]
        other = [sum(x * y for x, y in zip(point, axis, strict=True)) for point in points]
        if max(own) < min(other) or max(other) < min(own):
            return False
    return True


@pytest.mark.parametrize("seed", range(30))
def test_touched_voxels_are_those_that_an_exact_test_finds(seed):
    """Flat, needle-like and degenerate triangles, on the sides and corners of voxels, and outside."""
    rng = np.random.default_rng(seed)
    corners = rng.integers(-4, 24, (3, 3)) / 4
    if seed % 5 == 0:
        corners[:, rng.integers(3)] = rng.integers(0, 5)
    if seed % 7 == 0:
        corners[2] = corners[rng.integers(2)]
    found = tl.voxelize((corners, [[0, 1, 2]]), 5, bounds=[[0, 0, 0], [5, 5, 5]], solid=False, rule="touched").values
    low, high = np.floor(corners.min(axis=0)), np.floor(corners.max(axis=0))
    low, high = np.where(low == 5, 4, low), np.where(high == 5, 4, high)
    for cube in itertools.product(range(5), repeat=3):
        in_box = (low <= cube).all() and (cube <= high).all()
        assert found[cube] == (in_box and meets(corners, cube)), cube


def test_surface_has_every_voxel_that_a_line_through_its_middle_meets():
    """A plane across a diagonal: 6-connected, as thin as can be."""
    corners = [[0, 0, 0.5], [8, 0, 0.5], [8, 8, 0.5], [0, 8, 0.5]]
    found = tl.voxelize((corners, [[0, 1, 2], [0, 2, 3]]), 8, bounds=[[0, 0, 0], [8, 8, 8]], solid=False).values
    assert found[:, :, 0].all()
    assert not found[:, :, 1:].any()
    sphere = tl.voxelize(tl.scenes.icosphere(3), 32, solid=False).values
    conservative = tl.voxelize(tl.scenes.icosphere(3), 32, solid=False, rule="touched").values
    assert sphere.any()
    assert not (sphere & ~conservative).any()


def test_open_mesh_is_told_with_the_number_of_its_columns():
    vertices, triangles = tl.scenes.cube()
    with pytest.warns(tl.MeshWarning, match="not closed: 16 columns"):
        found = tl.voxelize((vertices, triangles[np.abs(vertices[triangles][:, :, 2].mean(axis=1) - 1) > 1e-6]), 4)
    assert found.n_odd == 16
    assert not found.values.any()


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize(
    ("scale", "shift", "is_inside_out", "n_told"),
    [
        (1, (1, 0.5, 0.5), False, 24),  # 4 x 6 columns of four voxels have both cubes
        (0.5, (0, 0, 0), False, 16),
        (0.5, (0, 0, 0), True, 0),  # a cavity
        (1, (0, 0, 2), False, 0),  # side by side
        (1, (3, 0, 0), False, 0),
    ],
)
def test_overlaps_of_shells_are_told(scale, shift, is_inside_out, n_told, samples, turned):
    vertices, triangles = tl.scenes.cube()
    second = triangles[:, ::-1] if is_inside_out else triangles
    both = np.concatenate([triangles, second + len(vertices)])
    mesh = tl.Mesh(np.concatenate([vertices, vertices * scale + shift]), both[:, ::-1] if turned else both)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        tl.voxelize(mesh, pitch=0.25, samples=samples)
    assert [str(one.message).split()[0] for one in told] == [str(n_told * samples**2)] * bool(n_told)


def boxes(*corners):
    """One mesh of boxes, from lower and upper corners."""
    vertices, triangles = tl.scenes.cube()
    both = [low + (vertices + 1) / 2 * (np.array(high) - low) for low, high in corners]
    return tl.Mesh(np.concatenate(both), np.concatenate([triangles + len(vertices) * i for i in range(len(both))]))


@pytest.mark.parametrize("shape", [16, 33, 64])
@pytest.mark.parametrize(
    ("mesh", "is_told"),
    [
        (boxes(((0, 0, 0), (2, 2, 2)), ((1, 1, 0), (3, 3, 1))), True),  # on one floor
        (boxes(((0, 0, 0), (2, 2, 2)), ((0, 0, 0), (2, 2, 2))), True),
        (boxes(((0, 0, 0), (2, 2, 2)), ((0, 0, 2), (3, 3, 3))), False),  # one on the other
        (boxes(((0, 0, 0), (2, 2, 0.01)), ((0, 0, 0.015), (2, 2, 0.02))), False),  # both in one voxel
    ],
)
def test_shells_that_meet_in_a_voxel_are_told_if_they_overlap(mesh, is_told, shape):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        tl.voxelize(mesh, shape)
    assert len(told) == is_told


@pytest.mark.parametrize("shape", [64, 100, 128, 256])
def test_one_shell_does_not_overlap(shape):
    vertices, triangles = tl.scenes.icosphere(6)
    x, y, z = vertices.T[:, :, None]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tl.voxelize((vertices * (1 + 0.2 * np.sin(9 * x) * np.sin(8 * y) * np.sin(10 * z)), triangles), shape)


def test_scene_is_filled_where_any_of_its_instances_is():
    cube, aside = tl.Mesh(*tl.scenes.cube()), np.eye(4)
    aside[0, 3] = 1.0
    found = tl.voxelize(tl.Scene([cube, (cube, aside)]), (6, 4, 4))
    assert found.values.all()
    assert found.transform[:3, 3].tolist() == [-0.75, -0.75, -0.75]


def test_bounds_cut_a_mesh():
    ball = tl.scenes.icosphere(3)
    whole = tl.voxelize(ball, pitch=0.125, bounds=[[-1, -1, -1], [1, 1, 1]])
    part = tl.voxelize(ball, pitch=0.125, bounds=[[-0.5, -1, 0], [1, 0.5, 0.5]])
    assert_same(part.values, whole.values[4:, :12, 8:12])
    assert not tl.voxelize(ball, 4, bounds=[[5, 5, 5], [6, 6, 6]]).values.any()


def test_middles_of_voxels_stand_where_the_transform_says():
    found = tl.voxelize(tl.scenes.icosphere(3), 21)
    index = np.argwhere(found.values)
    np.testing.assert_allclose(found.points(), index @ found.transform[:3, :3].T + found.transform[:3, 3])
    assert (np.linalg.norm(found.points(), axis=1) < 1.001).all()


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({}, ValueError, "give either shape or pitch, got shape=None and pitch=None"),
        ({"shape": 3, "pitch": 1.0}, ValueError, "give either shape or pitch"),
        ({"shape": 0}, ValueError, "shape must be at least 1, got 0"),
        ({"shape": (3, 3)}, ValueError, "shape must be a number or three of at least 1"),
        ({"pitch": 0.0}, ValueError, "pitch must be greater than 0"),
        ({"pitch": 1e-9}, ValueError, "voxels must be at most 16384 along an axis"),
        ({"shape": 3, "samples": 3}, ValueError, "samples must be one of 1, 2, 4, 8, got 3"),
        ({"shape": 3, "samples": 2, "solid": False}, ValueError, "samples must be 1 for a surface"),
        ({"shape": 3, "rule": "half"}, ValueError, "rule must be one of 'center', 'touched', got"),
        ({"shape": 3, "bounds": [0, 1]}, ValueError, r"bounds must have shape \(2, 3\)"),
        ({"shape": 3, "bounds": [[1, 1, 1], [0, 0, 0]]}, ValueError, "bounds must be a finite lower and upper corner"),
    ],
)
def test_bad_options_are_refused(options, error, words):
    with pytest.raises(error, match=words):
        tl.voxelize(tl.scenes.cube(), **options)


def test_mesh_without_triangles_needs_bounds():
    empty = (np.zeros((3, 3)), np.empty((0, 3), np.int32))
    with pytest.raises(ValueError, match="a mesh without triangles has no bounds"):
        tl.voxelize(empty, 3)
    assert not tl.voxelize(empty, 3, bounds=[[0, 0, 0], [1, 1, 1]]).values.any()


@pytest.mark.parametrize("name", ["sphere", "torus-knot"])
def test_occupancy_away_from_the_surface_is_that_of_trimesh(name):
    trimesh = pytest.importorskip("trimesh")
    vertices, triangles = tl.scenes.shape(name)
    found = tl.voxelize((vertices, triangles), 48)
    met = tl.voxelize((vertices, triangles), 48, solid=False, rule="touched").values
    away = ~met  # two voxels and more: those of trimesh stand elsewhere, and what the surface meets counts as filled
    for axis in (0, 1, 2, 0, 1, 2):
        away &= np.roll(away, 1, axis) & np.roll(away, -1, axis)
    theirs = trimesh.Trimesh(vertices, triangles, process=False).voxelized(found.pitch).fill()
    points = np.argwhere(away) * found.pitch + found.transform[:3, 3]
    assert 1000 < away.sum()
    assert_same(found.values[away], theirs.is_filled(points))
