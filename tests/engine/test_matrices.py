"""Small matrices, sines and roots against exact numbers, or NumPy's within a few last bits."""

import math
from fractions import Fraction

import numpy as np
import pytest

from topleft._core import engine

RNG = np.random.default_rng(4)


@pytest.mark.parametrize("shapes", [((4, 4), (4, 4)), ((7, 3), (3, 3)), ((3,), (3, 2)), ((2, 3), (3,)), ((4,), (4,))])
def test_product_of_whole_numbers_is_exact(shapes):
    a, b = (RNG.integers(-999, 999, shape) for shape in shapes)
    assert np.array_equal(engine.product(a, b), a @ b)


def test_product_takes_any_stride_and_sums_in_order():
    a, b = RNG.normal(size=(6, 8))[::2, ::-2], RNG.normal(size=(4, 9)).T[::3].T
    expected = np.zeros((3, 3))
    for k in range(4):
        expected = expected + a[:, k, None] * b[k]
    assert np.array_equal(engine.product(a, b), expected)


def test_row_products_sum_in_order():
    a, b = RNG.normal(size=(2, 50, 3))
    assert np.array_equal(engine.row_products(a, b), a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])
    assert np.array_equal(engine.row_products(a, b[0]), engine.row_products(a, np.tile(b[0], (50, 1))))


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_inverse_is_as_near_as_its_condition_lets_it(n):
    for _ in range(200):
        matrix = RNG.normal(size=(n, n)) * 10.0 ** RNG.integers(-6, 6, (n, 1))
        exact = [[sum(map(Fraction.__mul__, map(Fraction, row), map(Fraction, column))) for column in rows.T.tolist()]
                 for rows in [engine.inverse(matrix)] for row in matrix.tolist()]  # fmt: skip
        error = max(abs(value - (i == j)) for i, row in enumerate(exact) for j, value in enumerate(row))
        assert error <= 1e-14 * np.linalg.cond(matrix)


def test_inverse_changes_rows_where_the_first_pivot_is_0():
    assert engine.inverse(np.array([[0.0, 2.0], [4.0, 0.0]])).tolist() == [[0.0, 0.25], [0.5, 0.0]]


def test_determinant_adds_up_the_first_row_in_order():
    for a, b, c in RNG.normal(size=(50, 3, 3)):
        expected = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        assert engine.determinant([a, b, c]) == expected + a[2] * (b[0] * c[1] - b[1] * c[0])


@pytest.mark.parametrize("has_perspective", [True, False])
def test_camera_rays_are_products_and_inverses(has_perspective):
    view, center, size = np.linalg.qr(RNG.normal(size=(4, 4)))[0], RNG.normal(size=3), (640, 480)
    projection = np.diag(RNG.uniform(1, 2, 4))
    projection[2:, 2:] = [[-1.1, -2.2], [-1.0, 0.0]] if has_perspective else [[-0.1, -1.2], [0.0, 1.0]]
    view[3] = 0, 0, 0, 1
    clip = engine.product(projection, view)
    rows = clip[[0, 1, 3 if has_perspective else 2]]
    back = engine.inverse(rows[:, :3])
    offset = engine.product(back, rows[:, 3])
    ends = [[-1, 1, 1 if has_perspective else -1], [2 / size[0], 0, 0], [0, -2 / size[1], 0], [0, 0, 2]]
    ray = engine.product(np.array(ends), back.T)
    eye = -offset - center if has_perspective else -ray[3] / engine.length(ray[3])
    if not has_perspective:
        ray[0] -= offset + center
    found, rows, scale = engine.camera_rays(projection, view, center, *size)
    assert found == has_perspective
    assert scale == engine.cube_root(engine.determinant(view[:3, :3]))
    origin = engine.product(view[:3, :3], center) + view[:3, 3]
    assert np.array_equal(rows, np.vstack([eye, ray, view[:3, :3] / scale, origin]))


def random_turn(rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn))


STRETCHED = {
    "ellipsoid": np.diag([2.0, 0.5, 3.0]),
    "mirror": np.diag([-1.0, 1, 1]),
    "flat": np.diag([1.0, 1e-6, 1e5]),
    "sheared": np.array([[1.0, 2, 0], [0, 1, 0.5], [0, 0, -3]]),
    "sheared flat": np.array([[1.0, 1, 1], [0, 1e-7, 0], [0, 0, 1e-7]]),
}


@pytest.mark.parametrize("linear", STRETCHED.values(), ids=STRETCHED.keys())
def test_stretch_leaves_a_rotation_of_a_matrix(linear):
    rng = np.random.default_rng(3)
    views = np.tile(np.eye(4), (20, 1, 1))
    views[:, :3, :3] = [random_turn(rng) @ linear for _ in views]
    views[:, :3, 3] = rng.normal(size=(20, 3))
    for view, (is_mirrored, stretch) in zip(views, engine.stretches(views), strict=True):
        assert is_mirrored == (np.linalg.det(linear) < 0)
        rest = engine.product(view, engine.inverse(stretch))
        # 40 bits, and what inverting a matrix of condition 1e7 loses
        assert np.allclose(rest[:3, :3] @ rest[:3, :3].T, np.eye(3), rtol=0, atol=4e-9)
        assert np.linalg.det(rest[:3, :3]) > 0
        assert rest[:, 3].tolist() == view[:, 3].tolist()


def test_stretch_is_the_same_wherever_an_instance_turns():
    rng = np.random.default_rng(4)
    views = np.tile(np.eye(4), (50, 1, 1))
    views[:, :3, :3] = [random_turn(rng) @ np.diag([0.3, 0.7, 1.9]) for _ in views]
    first, *others = (stretch.tolist() for _, stretch in engine.stretches(views))
    assert all(stretch == first for stretch in others)


def test_stretch_of_a_rotation_times_a_scale_is_none():
    view = np.eye(4)
    view[:3, :3] = 3 * random_turn(np.random.default_rng(5))
    assert engine.stretches(view[None]) == [(False, None)]


def test_wrong_matrices_are_refused():
    with pytest.raises(np.linalg.LinAlgError):
        engine.inverse(np.array([[1.0, 2.0], [2.0, 4.0]]))
    with pytest.raises(ValueError, match="square, of 4 rows at most"):
        engine.inverse(np.eye(5))
    with pytest.raises(ValueError, match=r"matrices must fit, got shapes \(2, 3\) and \(2, 3\)"):
        engine.product(np.ones((2, 3)), np.ones((2, 3)))
    with pytest.raises(ValueError, match="must have 2 dimensions"):
        engine.product(np.ones((2, 3, 3)), np.eye(3))
    with pytest.raises(ValueError, match=r"shape \(3, 3\), got \(4, 4\)"):
        engine.determinant(np.eye(4))
    with pytest.raises(ValueError, match="broadcast"):
        engine.row_products(np.ones((2, 3)), np.ones((3, 3)))
    with pytest.raises(ValueError, match="three numbers"):
        engine.row_products(np.ones((2, 4)), np.ones((2, 4)))


def test_quarter_turns_are_exact():
    found = [engine.cosine_and_sine(90.0 * k) for k in range(-5, 6)]
    assert found == [((1, 0), (0, 1), (-1, 0), (0, -1))[k % 4] for k in range(-5, 6)]
    assert not any(math.copysign(1, number) < 0 and number == 0 for pair in found for number in pair)


def test_angles_are_those_of_numpy():
    degrees = RNG.uniform(-800, 800, 5000)
    cosine, sine = np.array([engine.cosine_and_sine(angle) for angle in degrees.tolist()]).T
    radians = np.radians(np.fmod(degrees, 360))
    assert np.abs(cosine - np.cos(radians)).max() < 2e-15
    assert np.abs(sine - np.sin(radians)).max() < 2e-15
    heights = np.append(RNG.uniform(-1, 1, 2000), [-1, 0, 1])
    found = [engine.arc_sine(height) for height in heights.tolist()]
    assert np.abs(found - np.degrees(np.arcsin(heights))).max() < 1e-13
    assert max(map(abs, found)) == 90


def test_off_axis_is_that_of_numpy():
    points = RNG.normal(size=(5000, 3)) * 10.0 ** RNG.uniform(-8, 8, (5000, 3))
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1], [1e200, 1e200, 1], [1e-200, 0, -1e-200]]])
    distance, angle = engine.off_axis(points)
    expected = np.hypot(points[:, 0], points[:, 1])
    assert np.allclose(distance, expected, rtol=1e-15, atol=0)
    assert np.abs(angle - np.arctan2(expected, points[:, 2])).max() < 2e-15
    assert np.isnan(engine.off_axis([[np.nan, 0, 1]])).all()


def test_log2_is_that_of_math():
    for value in (*2.0 ** RNG.uniform(-900, 900, 500), *RNG.uniform(0.7, 1.5, 500)):
        assert abs(engine.log2(value) - math.log2(value)) <= 4e-16 * max(1, abs(math.log2(value)))
    assert [engine.log2(2.0**k) for k in (-1000, -1, 0, 1, 10)] == [-1000, -1, 0, 1, 10]


def test_cube_root_and_length():
    for value in (0.0, 1.0, 27.0, -8.0, 2.0**-900, 1e300, 3e-310):
        root = Fraction(engine.cube_root(value))
        assert abs(root**3 - Fraction(value)) <= abs(Fraction(value)) * Fraction(1, 10**15)
    assert engine.length([3, 4, 12]) == 13


def test_pose_that_is_taken_at_a_glance_is_one():
    rng = np.random.default_rng(5)
    n_taken = 0
    for k in range(400):
        pose = np.eye(4)
        pose[:3] = rng.normal(size=(3, 4)) * 10.0 ** rng.integers(-12, 13)
        pose[2, :3] = pose[0, :3] + pose[2, :3] * 10.0 ** -rng.integers(0, 20)  # the more so, the nearer to singular
        if k % 5 == 0:
            pose[rng.integers(4), rng.integers(4)] = rng.choice([np.nan, np.inf, -np.inf, 2.0, 1e200])
        if engine.is_pose(pose):
            n_taken += 1
            assert np.isfinite(pose).all()
            assert pose[3].tolist() == [0, 0, 0, 1]
            assert np.linalg.matrix_rank(pose[:3, :3]) == 3
            assert engine.are_mirrored(pose[None]).tolist() == [engine.determinant(pose[:3, :3]) < 0]
        else:
            assert engine.are_mirrored(np.stack([np.eye(4), pose])) is None
    assert 50 < n_taken < 350
    assert engine.is_pose(np.eye(4))
    assert not engine.is_pose(np.diag([1.0, 1.0, 0.0, 1.0]))
