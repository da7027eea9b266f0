"""Lenses: where points are seen, against the formulas of OpenCV written out here in plain Python."""

import math
from dataclasses import replace

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.lens import FisheyeLens, OpenCVLens

SIZE = (640, 480)
K = np.array([[500.0, 3.0, 310.0], [0.0, 510.0, 250.0], [0.0, 0.0, 1.0]])
TERMS = (-0.31, 0.12, 0.0013, -0.0021, 0.017, 0.01, -0.02, 0.003)
ALL_TERMS = (*TERMS, 0.02, -0.01, 0.015, 0.004, 0.06, -0.09)  # thin prism, then tilt
FISHEYE_TERMS = (-0.021, 0.011, -0.004, 0.0006)
POINTS = np.random.default_rng(5).uniform([-0.8, -0.6, 0.9], [0.8, 0.6, 2.0], (200, 3))
POSE = np.array([[0.8, 0, 0.6, 0.1], [0, 1, 0, -0.2], [-0.6, 0, 0.8, 0.7], [0, 0, 0, 1.0]])


def opencv_px(point, terms):
    """u and v of the OpenCV manual, section "Camera Calibration and 3D Reconstruction"."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y = (*terms, *([0.0] * 14))[:14]
    x, y = point[0] / point[2], point[1] / point[2]
    r2 = x**2 + y**2
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    x, y = (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2), y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y)
    x, y = x + s1 * r2 + s2 * r2**2, y + s3 * r2 + s4 * r2**2
    about_x = [[1, 0, 0], [0, math.cos(tau_x), math.sin(tau_x)], [0, -math.sin(tau_x), math.cos(tau_x)]]
    about_y = [[math.cos(tau_y), 0, -math.sin(tau_y)], [0, 1, 0], [math.sin(tau_y), 0, math.cos(tau_y)]]
    turn = np.array(about_y) @ about_x
    to_plane = [[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]]
    x, y, w = to_plane @ turn @ [x, y, 1]
    x, y = x / w, y / w
    return K[0, 0] * x + K[0, 1] * y + K[0, 2], K[1, 1] * y + K[1, 2]


def fisheye_px(point, terms):
    """u and v of the OpenCV manual, section "Fisheye camera model"."""
    r = math.hypot(point[0], point[1])
    theta = math.atan2(r, point[2])
    bent = theta * (1 + sum(k * theta ** (2 * i) for i, k in enumerate(terms, 1)))
    x, y = (bent / r * point[0], bent / r * point[1]) if r else (0.0, 0.0)
    return K[0, 0] * x + K[0, 1] * y + K[0, 2], K[1, 1] * y + K[1, 2]


def camera_of(pose=None, **lens):
    return Camera.from_intrinsics(K, np.eye(4) if pose is None else pose, SIZE, near=0.1, far=10, **lens)


@pytest.mark.parametrize("n_terms", [4, 5, 8, 12, 14])
def test_project_distortion_is_that_of_the_formula(n_terms):
    found = camera_of(distortion=ALL_TERMS[:n_terms]).project(POINTS, SIZE)[:, :2] - 0.5
    expected = [opencv_px(point, ALL_TERMS[:n_terms]) for point in POINTS]
    assert np.abs(found - expected).max() < 1e-9  # pixels; a dozen roundings of numbers below 2**10


def test_project_fisheye_is_that_of_the_formula():
    found = camera_of(fisheye=FISHEYE_TERMS).project(POINTS, SIZE)[:, :2] - 0.5
    assert np.abs(found - [fisheye_px(point, FISHEYE_TERMS) for point in POINTS]).max() < 1e-9


@pytest.mark.parametrize("n_terms", [12, 14])
def test_terms_that_are_zero_change_nothing(n_terms):
    expected = camera_of(distortion=TERMS).lens
    assert camera_of(distortion=[*TERMS, *[0.0] * (n_terms - 8)]).lens == expected


def test_a_mesh_through_a_prism_and_a_tilt_lies_where_its_vertices_are_projected_to():
    camera = camera_of(distortion=ALL_TERMS)
    mesh = tl.Mesh(POINTS, np.arange(198).reshape(-1, 3))
    frags = tl.rasterize_mesh(mesh, camera, SIZE)
    rows, columns = np.nonzero(frags.mask)
    places = camera.project(frags.interpolate(POINTS)[rows, columns].astype(float), SIZE)[:, :2]
    assert (
        np.abs(places - np.stack([columns, rows], axis=1) - 0.5).max() < 0.15
    )  # tolerance_px at the quarters of an edge, the snap


@pytest.mark.parametrize("n_terms", [4, 5, 8, 12, 14])
def test_project_distortion_is_that_of_opencv(n_terms):
    cv2 = pytest.importorskip("cv2")
    rotation, _ = cv2.Rodrigues(POSE[:3, :3])
    terms = np.array(ALL_TERMS[:n_terms])
    straight = K * [[1, 0, 1], [1, 1, 1], [1, 1, 1]]  # cv2 does not look at the skew
    expected, _ = cv2.projectPoints(POINTS, rotation, POSE[:3, 3], straight, terms)
    camera = Camera.from_intrinsics(straight, POSE, SIZE, near=0.1, far=10, distortion=terms)
    assert np.abs(camera.project(POINTS, SIZE)[:, :2] - 0.5 - expected[:, 0]).max() < 1e-9


def test_project_fisheye_is_that_of_opencv():
    cv2 = pytest.importorskip("cv2")
    rotation, _ = cv2.Rodrigues(POSE[:3, :3])
    straight = K * [[1, 0, 1], [1, 1, 1], [1, 1, 1]]
    expected, _ = cv2.fisheye.projectPoints(POINTS[:, None], rotation, POSE[:3, 3], straight, np.array(FISHEYE_TERMS))
    camera = Camera.from_intrinsics(straight, POSE, SIZE, near=0.1, far=10, fisheye=FISHEYE_TERMS)
    assert np.abs(camera.project(POINTS, SIZE)[:, :2] - 0.5 - expected[:, 0]).max() < 1e-9


def test_project_without_lens_is_the_matrix():
    camera = camera_of(POSE)
    clip = np.hstack([POINTS, np.ones((200, 1))]) @ camera.clip_from_world(SIZE).T
    ndc = clip[:, :3] / clip[:, 3:]
    px = np.stack([(ndc[:, 0] + 1) * 320, (1 - ndc[:, 1]) * 240, (ndc[:, 2] + 1) / 2], axis=1)
    assert camera.project(POINTS, SIZE) == pytest.approx(px, abs=1e-11)


def test_project_a_lens_without_terms_changes_nothing():
    bent, straight = camera_of(POSE, distortion=[0, 0, 0, 0]), camera_of(POSE)
    assert bent.project(POINTS, SIZE) == pytest.approx(straight.project(POINTS, SIZE), abs=1e-11)


def test_project_depth_through_a_lens_is_that_without():
    bent, straight = camera_of(POSE, distortion=TERMS), camera_of(POSE)
    assert np.abs(bent.project(POINTS, SIZE)[:, 2] - straight.project(POINTS, SIZE)[:, 2]).max() < 1e-14


def test_project_depth_of_a_fisheye_is_that_of_the_distance():
    camera = Camera.from_intrinsics(K, np.eye(4), SIZE, near=1, far=5, fisheye=FISHEYE_TERMS)
    points = 5 * np.array([[0.6, 0.0, 0.8], [1, 0, 0], [0, 0, 1], [0.6, 0, -0.8]])
    assert camera.project(points, SIZE)[:, 2] == pytest.approx(1)
    assert camera.project(points / 5, SIZE)[:, 2] == pytest.approx(0, abs=1e-12)


def test_project_at_half_the_size_is_the_picture_scaled():
    camera = camera_of(distortion=TERMS)
    assert camera.project(POINTS, (320, 240))[:, :2] == pytest.approx(camera.project(POINTS, SIZE)[:, :2] / 2)


def test_straightened_leaves_the_lens_out():
    camera = camera_of(POSE, distortion=TERMS)
    assert np.array_equal(camera.straightened().clip_from_world(SIZE), camera_of(POSE).clip_from_world(SIZE))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: camera_of(distortion=[0, 0, 0, 0], fisheye=[0, 0, 0, 0]), "two models of a lens: give one of them"),
        (
            lambda: camera_of(distortion=[0] * 13),
            "distortion must be k1, k2, p1, .*: 4, 5, 8, 12 or 14 numbers, got 13",
        ),
        (lambda: OpenCVLens(tau_x=1.6), "tau_x and tau_y must be below 90 degrees, got 1.6 and 0.0 radians"),
        (lambda: OpenCVLens(tau_y=-2.0), "tau_x and tau_y must be below 90 degrees, got 0.0 and -2.0 radians"),
        (lambda: camera_of(fisheye=[0] * 5), "fisheye must be k1, k2, k3, k4: 4 numbers, got 5"),
        (lambda: OpenCVLens(k2=np.nan), "terms of a lens must be finite"),
        (lambda: FisheyeLens(k4=np.inf), "terms of a lens must be finite"),
        (lambda: OpenCVLens(tolerance_px=0), "tolerance_px must be at least 0.00390625, got 0"),
        (lambda: FisheyeLens(tolerance_px=np.nan), "tolerance_px must be at least 0.00390625, got nan"),
        (lambda: camera_of(distortion=TERMS).clip_from_world(SIZE), "no matrix describes a camera with a lens"),
        (lambda: replace(Camera.look_at((0, 0, 5), ortho_height=1), lens=OpenCVLens()), r"last row \[0, 0, -1, 0\]"),
        (lambda: camera_of().project([1, 2, 3], SIZE), r"points must have shape \(N, 3\), got \(3,\)"),
    ],
)
def test_lens_impossible_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
