"""The bound on the distance between two surfaces: never below what brute force finds, and near it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surface_samples import largest_squared, points_on, sampled_distance

from topleft import scenes
from topleft._core import engine
from topleft._meshes.lod import distance
from topleft._meshes.lod.distance import LEAST, SHARE, TriangleTree, measure

ORIGIN = np.zeros(3)
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32)

#: float64 may lose this much of coordinates of about 1; the margin of the bound is of that size.
ROUNDING = 2.0**-40


def surface(points, triangles):
    return TriangleTree.of_mesh(np.asarray(points, np.float64), np.asarray(triangles, np.int32), ORIGIN)


def corners(one):
    return one.points[one.triangles]


def soup(seed, n_triangles, scale=1.0):
    """Triangles anywhere, some of them needles, lines and points."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (n_triangles, 1, 3)) + scale * rng.uniform(-1, 1, (n_triangles, 3, 3))
    kind = rng.integers(0, 6, n_triangles)
    points[kind == 0, 2] = points[kind == 0, 1] + 1e-9
    points[kind == 1, 2] = points[kind == 1, 0] / 2 + points[kind == 1, 1] / 2
    points[kind == 2, 2] = points[kind == 2, 1]
    points[kind == 3] = points[kind == 3, :1]
    points[0] = rng.uniform(-1, 1, (3, 3))
    return surface(points.reshape(-1, 3), np.arange(3 * n_triangles).reshape(-1, 3))


def test_measure_same_surface_is_zero_but_for_the_margin():
    blob = surface(*scenes.blob(2000))
    apart = measure(blob, surface(*scenes.blob(2000)))
    assert apart.known <= 2.0**-48  # feet are rounded
    assert apart.bound <= LEAST * 2.2  # what is not worth looking at is not looked at


def test_measure_two_planes_is_their_offset():
    points, triangles = SQUARE
    apart = measure(surface(points, triangles), surface(points + [0, 0, 0.25], triangles))
    assert apart.known == 0.25
    assert 0.25 <= apart.bound <= 0.25 + ROUNDING


def test_measure_flat_grid_and_square_is_zero_but_for_the_margin():
    n = 20
    y, x = np.mgrid[0 : n + 1, 0 : n + 1] / n
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    grid = np.concatenate([first[:, None] + [0, 1, n + 2], first[:, None] + [0, n + 2, n + 1]])
    apart = measure(surface(*SQUARE), surface(points, grid))
    assert apart.known <= 2.0**-50
    assert apart.bound <= LEAST + ROUNDING


def test_measure_hole_is_found_from_the_side_that_has_none():
    points, triangles = SQUARE
    apart = measure(surface(points, triangles), surface(points, triangles[:1]))
    # (0, 1) is farthest from the diagonal
    assert np.sqrt(0.5) <= apart.bound <= np.sqrt(0.5) * (1 + SHARE) + ROUNDING


def test_measure_bump_between_corners_is_found():
    points, triangles = SQUARE
    roof = np.vstack([points, [[0.5, 0.5, 0.5]]])
    apart = measure(surface(points, triangles), surface(roof, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))
    assert 0.5 <= apart.bound <= 0.5 * (1 + SHARE)


def test_measure_fold_between_two_far_feet_is_found():
    """Corners lie on the other surface, and their feet on neighbours: the inside is what is far."""
    tent = surface([[0, 0, 0], [1, 0, 1], [2, 0, 0], [0, 1, 0], [1, 1, 1], [2, 1, 0]],
                   [[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4]])  # fmt: skip
    flat = surface([[0, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0]], [[0, 1, 2], [1, 3, 2]])
    apart = measure(tent, flat)
    assert 1 <= apart.bound <= 1 + SHARE


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**31), n=st.integers(1, 12), m=st.integers(1, 12), scale=st.sampled_from([0.01, 0.3, 1.0]))
def test_measure_bound_holds_for_soups(seed, n, m, scale):
    one, other = soup(seed, n, scale), soup(seed + 1, m, scale)
    apart = measure(one, other)
    found = sampled_distance(corners(one), corners(other), 8)
    assert found <= apart.bound
    assert apart.known <= apart.bound
    size = max(np.ptp(part.points, axis=0).max() for part in (one, other))
    assert apart.bound <= apart.known + max(SHARE * apart.known, LEAST * size) + ROUNDING


@settings(deadline=None, max_examples=8)
@given(seed=st.integers(0, 2**31), amount=st.sampled_from([1e-6, 1e-3, 0.1]))
def test_measure_bound_holds_for_shaken_meshes(seed, amount):
    points, triangles = scenes.blob(200)
    shaken = points + np.random.default_rng(seed).uniform(-amount, amount, points.shape)
    one, other = surface(points, triangles), surface(shaken, triangles)
    assert sampled_distance(corners(one), corners(other), 4) <= measure(one, other).bound


def test_measure_does_not_depend_on_threads_or_instruction_set(monkeypatch):
    points, triangles = scenes.blob(30_000)
    shaken = points + np.random.default_rng(1).uniform(-1e-3, 1e-3, points.shape)
    found = set()
    in_use = engine.isa_in_use()
    try:
        for isa in engine.isa_available():
            engine.use_isa(isa)
            for threads in (1, 2, 3):
                monkeypatch.setattr(distance, "available_threads", lambda n=threads: n)
                found.add(measure(surface(points, triangles), surface(shaken, triangles)))
    finally:
        engine.use_isa(in_use)
    assert len(found) == 1


def test_farthest_of_points_is_that_of_brute_force():
    one, other = soup(1, 40), soup(2, 60)
    points = points_on(corners(one), 3)
    # Both are float64: feet of needles are found in another order of operations.
    assert other.farthest(points) == pytest.approx(np.sqrt(largest_squared(points, corners(other))), rel=1e-9)


def test_far_from_the_origin_the_margin_grows():
    points, triangles = SQUARE
    there = points + 1e9
    apart = measure(surface(there, triangles), surface(there, triangles[::-1]))
    assert apart.bound >= 1e9 * 2.0**-47
