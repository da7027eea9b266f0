"""Cameras: where points land in the picture, against arithmetic written out here."""

import tracemalloc

import numpy as np
import pytest
from comparing import assert_same

from topleft import scenes
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.matrices import bounding_sphere, orbit_view
from topleft._meshes.camera.viewpoints import turntable
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.scene.scene import Instance, Scene, world_corners

SIZE = (640, 480)
K = np.array([[500.0, 0.0, 320.0], [0.0, 510.0, 240.0], [0.0, 0.0, 1.0]])


def pixels(camera, points, size=SIZE):
    """x px, y px and window depth of world points."""
    clip = scenes.to_clip(np.atleast_2d(np.asarray(points, float)), camera.clip_from_world(size))
    return scenes.to_pixels(clip, *size)


def test_look_at_target_is_in_the_middle():
    camera = Camera.look_at((3, 4, 5), (1, 2, 0))
    assert pixels(camera, (1, 2, 0))[0, :2] == pytest.approx((320, 240))


def test_look_at_up_and_right_are_up_and_right():
    camera = Camera.look_at((0, 0, 5))
    (x_right, y_right, _), (x_up, y_up, _) = pixels(camera, [(1, 0, 0), (0, 1, 0)])
    assert x_right > 320
    assert y_right == pytest.approx(240)
    assert x_up == pytest.approx(320)
    assert y_up < 240


def test_look_at_fov_spans_the_height():
    camera = Camera.look_at((0, 0, 1), fov_y_deg=90)
    assert pixels(camera, (0, 1, 0))[0, 1] == pytest.approx(0)


def test_look_at_ortho_height_spans_the_height():
    camera = Camera.look_at((0, 0, 10), ortho_height=4)
    assert pixels(camera, [(0, 2, 0), (0, -2, -20)])[:, 1] == pytest.approx([0, 480])


def test_look_at_near_and_far_are_depth_0_and_1():
    camera = Camera.look_at((0, 0, 0), (0, 0, -1), near=2, far=8)
    assert pixels(camera, [(0, 0, -2), (0, 0, -8)])[:, 2] == pytest.approx([0, 1])


@pytest.mark.parametrize("ortho_height", [None, 3])
def test_clip_from_world_wide_picture_keeps_pixels_square(ortho_height):
    camera = Camera.look_at((0, 0, 5), ortho_height=ortho_height)
    dx, dy = np.diff(pixels(camera, [(0, 0, 0), (1, 1, 0)], (1000, 100)), axis=0)[0, :2]
    assert dx == pytest.approx(-dy)


def test_clip_from_world_without_aspect_takes_the_projection_as_it_is():
    camera = Camera(np.eye(4), np.diag([1.0, 2.0, 3.0, 1.0]))
    assert camera.clip_from_world((7, 5)).tolist() == np.diag([1.0, 2.0, 3.0, 1.0]).tolist()


def test_clip_from_world_empty_picture_is_finite():
    assert np.isfinite(Camera.look_at((0, 0, 5)).clip_from_world((0, 10))).all()


def test_camera_keeps_its_own_copy_of_a_matrix():
    view = np.eye(4)
    camera = Camera(view, np.eye(4))
    view[0, 0] = 9
    assert camera.view[0, 0] == 1
    with pytest.raises(ValueError, match="read-only"):
        camera.view[0, 0] = 9


def test_orbit_view_is_the_camera_of_the_benchmarks():
    # Written out as the timed scenes have it: distance 3, azimuth 30, elevation 20, fov 40, 0.1 to 100, 1920 x 1080.
    az, el = np.radians([30.0, 20.0])
    eye = 3.0 * np.array([np.cos(el) * np.sin(az), np.sin(el), np.cos(el) * np.cos(az)])
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[0, :3], view[1, :3], view[2, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    t = 1 / np.tan(np.radians(40.0) / 2)
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1], projection[3, 2] = t * 1080 / 1920, t, -1
    projection[2, 2:] = 100.1 / -99.9, 20 / -99.9
    camera = Camera.perspective(orbit_view((0, 0, 0), 3.0, 30, 20), near=0.1, far=100, fov_y_deg=40)
    assert camera.clip_from_world((1920, 1080)) == pytest.approx(projection @ view, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize(
    ("up", "azimuth_deg", "elevation_deg", "eye_direction"),
    [
        ("y", 0, 0, (0, 0, 1)),
        ("y", 90, 0, (1, 0, 0)),
        ("y", 0, 90, (0, 1, 0)),
        ("z", 0, 0, (0, -1, 0)),
        ("z", 90, 0, (1, 0, 0)),
        ("z", 0, -90, (0, 0, -1)),
    ],
)
def test_orbit_view_angles_mean_front_right_and_top(up, azimuth_deg, elevation_deg, eye_direction):
    view = orbit_view((1, 2, 3), 5, azimuth_deg, elevation_deg, up=up)
    eye = -view[:3, :3].T @ view[:3, 3]
    assert eye - (1, 2, 3) == pytest.approx(5 * np.array(eye_direction), abs=1e-12)


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("pole", [-90, 90])
def test_orbit_view_at_a_pole_is_the_limit_of_the_way_there(up, pole):
    two_degrees_off = orbit_view((0, 0, 0), 1, 30, pole * 88 / 90, up=up)
    turned = orbit_view((0, 0, 0), 1, 30, pole, up=up) @ np.linalg.inv(two_degrees_off)
    assert turned[:3, :3] == pytest.approx(np.eye(3), abs=np.radians(2))


@pytest.mark.parametrize("ortho", [False, True])
@pytest.mark.parametrize("size", [(640, 480), (300, 900)])
def test_framing_sphere_fills_the_frame_without_touching_it(ortho, size):
    mesh = Mesh(*scenes.shape("sphere"))
    camera = Camera.framing(mesh, ortho=ortho, aspect=size[0] / size[1])
    x, y, depth = pixels(camera, mesh.vertices, size).T
    narrow, extent = (y, size[1]) if size[0] > size[1] else (x, size[0])
    assert 0 < narrow.min() < 0.04 * extent
    assert 0.96 * extent < narrow.max() < extent
    assert 0 <= depth.min() < depth.max() <= 1


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.float16, np.float32])
@pytest.mark.parametrize(
    "make",
    [
        lambda n: Camera.perspective(np.eye(4), near=n(1), far=n(100), fov_y_deg=n(50)),
        lambda n: Camera.orthographic(np.eye(4), near=n(30), far=n(100), height=n(3)),
        lambda n: Camera.off_center(np.eye(4), left=n(1), right=n(100), bottom=n(1), top=n(9), near=n(30), far=n(70)),
        lambda n: Camera.from_intrinsics(np.diag([9, 9, 1]), np.eye(4), SIZE, near=n(100)),
        lambda n: Camera.framing([(0, 0, 0), (1, 1, 1)], aspect=n(3), fov_y_deg=n(50)),
    ],
)
def test_camera_of_numbers_of_few_bits_is_that_of_floats(make, kind):
    camera, expected = make(kind), make(float)
    assert np.array_equal(camera.projection, expected.projection)
    assert np.array_equal(camera.view, expected.view)


def test_framing_looks_only_at_vertices_in_use():
    vertices, triangles = scenes.shape("cube")
    lonely = Mesh(np.vstack([vertices, [[1e6, 0, np.nan]]]), triangles)
    assert (Camera.framing(lonely).view == Camera.framing(Mesh(vertices, triangles)).view).all()


def test_framing_takes_the_corners_of_a_box():
    assert bounding_sphere(np.array([(-1.0, -1, -1), (1, 1, 1)]))[1] == pytest.approx(3**0.5)


@pytest.mark.parametrize("fit", ["sphere", "box", "points", "silhouette"])
def test_framing_a_scene_frames_its_points_in_the_world(fit):
    mesh, move = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (9, 9, 9)], [(0, 1, 2)]), np.eye(4)
    move[:3, 3] = 4, 0, -2
    scene = Scene([mesh, (mesh, move)])
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (4, 0, -2), (5, 0, -2), (4, 1, -2)]
    assert_same(Camera.framing(scene, fit=fit).view, Camera.framing(points, fit=fit).view)
    assert_same(turntable(scene, 3, fit=fit)[1].view, turntable(points, 3, fit=fit)[1].view)


def test_framing_a_scene_without_triangles_is_refused():
    with pytest.raises(ValueError, match="there is nothing to frame"):
        Camera.framing(Scene([Mesh([(0, 0, 0)], np.empty((0, 3), int))]))


def test_framing_a_single_point_has_a_picture():
    camera = Camera.framing([(5, 5, 5)])
    assert pixels(camera, (5, 5, 5))[0, :2] == pytest.approx((320, 240))


def test_from_intrinsics_point_lands_half_a_pixel_beyond_opencv():
    # OpenCV: u = 500 * 0.1 / 2 + 320 = 345, v = 510 * -0.2 / 2 + 240 = 189, the centre of the top-left pixel at (0, 0).
    camera = Camera.from_intrinsics(K, np.eye(4), SIZE, near=0.1, far=10)
    assert pixels(camera, (0.1, -0.2, 2))[0, :2] == pytest.approx((345.5, 189.5))


def test_from_intrinsics_skew_and_pose_are_applied():
    skewed = K + np.array([[0, 7.0, 0], [0, 0, 0], [0, 0, 0]])
    pose = np.array([[0, -1.0, 0, 0.3], [1, 0, 0, -0.4], [0, 0, 1, 1.5], [0, 0, 0, 1]])
    world = np.array([0.2, 0.1, 2.5])
    u, v, w = skewed @ (pose @ [*world, 1])[:3]
    camera = Camera.from_intrinsics(skewed, pose, SIZE, near=0.1, far=10)
    assert pixels(camera, world)[0, :2] == pytest.approx((u / w + 0.5, v / w + 0.5))


def test_from_intrinsics_near_and_far_are_depth_0_and_1():
    camera = Camera.from_intrinsics(K, np.eye(4), SIZE, near=0.5, far=4)
    assert pixels(camera, [(0, 0, 0.5), (0, 0, 4)])[:, 2] == pytest.approx([0, 1])


def test_from_intrinsics_at_half_the_size_is_the_picture_scaled():
    camera = Camera.from_intrinsics(K, np.eye(4), SIZE, near=0.1, far=10)
    point = (0.1, -0.2, 2)
    assert pixels(camera, point, (320, 240))[0, :2] == pytest.approx(pixels(camera, point)[0, :2] / 2)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Camera.look_at((1, 2, 3), (1, 2, 3)), r"eye and target must differ, got \[1.0, 2.0, 3.0\] for both"),
        (lambda: Camera.look_at((0, 5, 0)), "up must not be zero or parallel to the view"),
        (lambda: Camera.look_at((0, 0, 5), up=(0, 0, 0)), "up must not be zero or parallel"),
        (lambda: Camera.look_at((0, 0, np.nan)), "eye must be three finite numbers"),
        (lambda: Camera.look_at((0, 0, 5), (0, 0)), "target must be three finite numbers"),
        (lambda: Camera.look_at((0, 0, 5), near=2, far=1), "0 < near < far, got 2 and 1"),
        (lambda: Camera.look_at((0, 0, 5), near=0, far=1), "0 < near < far, got 0 and 1"),
        (lambda: Camera.look_at((0, 0, 5), fov_y_deg=180), "fov_y_deg must lie between 0 and 180, got 180"),
        (lambda: Camera.look_at((0, 0, 5), ortho_height=0), "^ortho_height must be positive, got 0"),
        (lambda: Camera.look_at((0, 0, 5), ortho_height=1, near=1, far=1), "near < far, got 1 and 1"),
        (lambda: Camera(np.eye(3), np.eye(4)), r"view must have shape \(4, 4\), got \(3, 3\)"),
        (lambda: Camera(np.eye(4), np.full((4, 4), np.inf)), "projection must hold finite numbers"),
        (lambda: Camera(np.eye(4), np.eye(4), aspect=0), "aspect must be positive, got 0"),
        (lambda: Camera.from_intrinsics(np.diag([1, 0, 1]), np.eye(4), SIZE, near=1, far=2), "intrinsics must not be"),
        (lambda: Camera.from_intrinsics(K.T, np.eye(4), SIZE, near=1, far=2), r"last row of intrinsics .* \[0, 0, 1\]"),
        (lambda: Camera.from_intrinsics(K, np.ones((4, 4)), SIZE, near=1, far=2), "last row of camera_from_w"),
        (lambda: Camera.from_intrinsics(K, np.diag([1, 0, 1, 1]), SIZE, near=1, far=2), "camera_from_world must not"),
        (lambda: Camera.from_intrinsics(K, np.eye(4), (0, 5), near=1, far=2), r"height\) in 1\.\.\d+, got \(0"),
        (lambda: Camera.from_intrinsics(K, np.eye(4), SIZE, near=2, far=2), "0 < near < far, got 2 and 2"),
        (lambda: Camera.framing(np.empty((0, 3))), "nothing to frame"),
        (lambda: Camera.framing([(1, 2)]), r"must have shape \(N, 3\), got \(1, 2\)"),
        (lambda: Camera.framing([(1, 2, np.inf)]), "points to frame must be finite"),
        (lambda: Camera.framing([(0, 0, 0)], up="x"), "up must be one of 'y', 'z', got 'x'"),
        (lambda: Camera.framing([(0, 0, 0)], elevation_deg=91), "elevation_deg must lie in -90 to 90, got 91"),
        (lambda: Camera.framing([(0, 0, 0)], azimuth_deg=np.nan), "azimuth_deg must be finite, got nan"),
        (lambda: Camera.framing([(0, 0, 0)], fov_y_deg=0), "fov_y_deg must lie between 0 and 180, got 0"),
        (lambda: Camera.framing([(0, 0, 0)], aspect=-1), "aspect must be positive, got -1"),
    ],
)
def test_camera_impossible_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_view_matrix_is_a_rotation_and_a_shift():
    view = Camera.look_at((3, -2, 7), (1, 1, 1), up=(0, 0, 1)).view
    assert view[:3, :3] @ view[:3, :3].T == pytest.approx(np.eye(3))
    assert np.linalg.det(view) == pytest.approx(1)
    assert view @ [3, -2, 7, 1] == pytest.approx([0, 0, 0, 1])


@pytest.mark.parametrize("ortho", [False, True])
@pytest.mark.parametrize("size", [(640, 480), (300, 900)])
def test_framing_box_fills_the_frame_without_touching_it(ortho, size):
    corners = np.array([(x, y, z) for x in (0, 5) for y in (0, 2) for z in (0, 1)], float)
    camera = Camera.framing(corners[[0, 7]], ortho=ortho, aspect=size[0] / size[1], fit="box", azimuth_deg=20)
    x, y, depth = pixels(camera, corners, size).T
    slack = np.array([x.min() / size[0], 1 - x.max() / size[0], y.min() / size[1], 1 - y.max() / size[1]])
    assert slack.min() == pytest.approx(0.5 - 0.5 / 1.05, abs=0.011)  # the margin is taken across, not along the view
    assert slack.min() > 0
    assert 0 <= depth.min() < depth.max() <= 1


@pytest.mark.parametrize("ortho", [False, True])
def test_framing_points_fills_the_frame_more_than_sphere_and_box(ortho):
    knot = Mesh(*scenes.shape("torus-knot"))
    sizes = []
    for fit in ("sphere", "box", "points"):
        x, y, _ = pixels(Camera.framing(knot, fit=fit, ortho=ortho, aspect=4 / 3), knot.vertices).T
        assert min(x.min(), 640 - x.max(), y.min(), 480 - y.max()) > 0
        sizes.append(max(np.ptp(x) / 640, np.ptp(y) / 480))
    assert sizes[2] > max(sizes[:2])
    assert sizes[2] > 0.85


@pytest.mark.parametrize("ortho", [False, True])
@pytest.mark.parametrize("aspect", [0.4, 1.0, 2.5])
@pytest.mark.parametrize("name", ["cube", "tetrahedron", "torus-knot"])
def test_framing_silhouette_fills_the_frame_but_for_five_percent(name, aspect, ortho):
    mesh = Mesh(*scenes.shape(name))
    camera = Camera.framing(mesh, azimuth_deg=50, elevation_deg=33, aspect=aspect, ortho=ortho, fit="silhouette")
    size = round(1000 * aspect), 1000
    places = camera.project(mesh.vertices, size) / [*size, 1]
    low, high = places.min(axis=0), places.max(axis=0)
    free = np.stack([low, 1 - high], axis=1)[:2]

    assert np.abs(free[:, 0] - free[:, 1]).max() < 1e-5
    assert abs(free.min() - 0.05) < 1e-9
    assert (low[2], high[2]) > (0, 0)
    assert high[2] < 1


def test_framing_silhouette_of_a_single_point_has_it_in_the_middle():
    for ortho in (False, True):
        camera = Camera.framing([(3, 4, 5)], fit="silhouette", ortho=ortho)
        assert np.allclose(camera.project([(3, 4, 5)], (100, 100))[0, :2], 50)


@pytest.mark.parametrize(("away", "near", "far"), [(0, 1e-3, 1e3), (5, 5e-3, 5e3), (0.01, 1e-5, 1e3)])
def test_from_intrinsics_without_planes_has_those_of_the_distance_to_the_origin(away, near, far):
    pose = np.eye(4)
    pose[2, 3] = away
    found, expected = (Camera.from_intrinsics(K, pose, SIZE, **planes) for planes in ({}, {"near": near, "far": far}))

    assert np.allclose(found.projection, expected.projection, rtol=1e-12, atol=0)


def test_framing_box_of_a_point_has_a_picture():
    for ortho in (False, True):
        camera = Camera.framing([(5, 5, 5)], fit="box", ortho=ortho)
        assert pixels(camera, (5, 5, 5))[0, :2] == pytest.approx((320, 240))


@pytest.mark.parametrize("ortho", [False, True])
def test_off_center_symmetric_is_the_camera_of_the_same_view(ortho):
    view = Camera.look_at((1, 2, 3)).view
    side = 0.5 * np.tan(np.radians(25))
    camera = Camera.off_center(
        view, left=-side * 4 / 3, right=side * 4 / 3, bottom=-side, top=side, near=0.5, far=9, ortho=ortho
    )
    if ortho:
        expected = Camera.orthographic(view, near=0.5, far=9, height=2 * side)
    else:
        expected = Camera.perspective(view, near=0.5, far=9, fov_y_deg=50)
    assert camera.clip_from_world(SIZE) == pytest.approx(expected.clip_from_world(SIZE), abs=1e-14)


@pytest.mark.parametrize("ortho", [False, True])
def test_off_center_halves_make_the_whole(ortho):
    sides = {"bottom": -0.3, "top": 0.3, "near": 1, "far": 9, "ortho": ortho}
    whole = Camera.off_center(np.eye(4), left=-0.4, right=0.4, **sides)
    right = Camera.off_center(np.eye(4), left=0.0, right=0.4, **sides)
    point = (0.2, 0.1, -2)
    at_whole, at_right = pixels(whole, point)[0], pixels(right, point, (320, 480))[0]
    assert at_right == pytest.approx(at_whole - (320, 0, 0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Camera.off_center(np.eye(4), left=1, right=1, bottom=0, top=1, near=1, far=2),
         "left < right and bottom < top must be finite, got 1 and 1, 0 and 1"),
        (lambda: Camera.off_center(np.eye(4), left=0, right=1, bottom=0, top=1, near=-1, far=2),
         "0 < near < far, got -1 and 2"),
        (lambda: Camera.off_center(np.eye(4), left=0, right=np.inf, bottom=0, top=1, near=1, far=2, ortho=True),
         "left < right and bottom < top must be finite, got 0 and inf"),
        (lambda: Camera.framing([(0, 0, 0)], fit="tight"),
         "fit must be one of 'sphere', 'box', 'points', 'silhouette', got 'tight'"),
    ],
)  # fmt: skip
def test_camera_more_impossible_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def instances_of_a_sphere(n):
    sphere = Mesh(*scenes.icosphere(5))
    places = [[[1, 0, 0, i], [0, 0, 1, i % 3], [0, -1, 0, 0.5 * i % 2], [0, 0, 0, 1]] for i in range(n)]
    return Scene([Instance(sphere, place) for place in places])


def test_framing_a_scene_takes_the_memory_of_one_instance():
    def peak(n):
        scene = instances_of_a_sphere(n)
        tracemalloc.start()
        Camera.framing(scene)
        peaked = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peaked

    assert peak(80) < 1.5 * peak(4)


@pytest.mark.parametrize("fit", ["sphere", "box", "points", "silhouette"])
def test_framing_a_scene_is_framing_all_of_its_corners(fit):
    scene = instances_of_a_sphere(7)
    got = Camera.framing(scene, fit=fit)
    expected = Camera.framing(np.concatenate([world_corners(instance) for instance in scene]), fit=fit)
    assert_same(got.view, expected.view)
    assert_same(got.projection, expected.projection)
