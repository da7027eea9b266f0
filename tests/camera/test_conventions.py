"""Cameras and poses of other programs, against what the formulas of those programs say."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

import topleft as tl
from topleft import Camera
from topleft._meshes.model.pose import as_pose

SIZE = (640, 400)
RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-1, 1, (50, 3))
ROTATION = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
TRANSLATION = np.array([0.1, -0.2, 5.0])
QUATERNION = np.array([math.sqrt(2.56) / 2, 0.2, -0.4, -0.4]) * 3  # that of the rotation, not scaled to 1


def seen(points, rotation=ROTATION, translation=TRANSLATION):
    """Points in the axes of OpenCV, with x and y over z."""
    at = points @ rotation.T + translation
    return at, at[:, 0] / at[:, 2], at[:, 1] / at[:, 2]


def assert_at(camera, expected, size=SIZE):
    np.testing.assert_allclose(camera.project(POINTS, size)[:, :2], expected, rtol=0, atol=1e-9)


def colmap_pixels(model, params):
    """What `ImgFromCam` of COLMAP's models gives."""
    _, u, v = seen(POINTS)
    n_focal = 1 if model.startswith(("SIMPLE", "RADIAL")) else 2
    (fx, fy), (cx, cy, *k) = (params[0], params[n_focal - 1]), params[n_focal:]
    k1, k2, *rest = [*k, 0.0, 0.0, 0.0, 0.0][: max(4, len(k))]
    r2 = u * u + v * v
    if "FISHEYE" in model:
        r = np.sqrt(r2)
        theta = np.arctan(r)
        t2 = theta**2
        k3, k4 = rest[:2]
        thetad = theta * (1 + k1 * t2 + k2 * t2**2 + k3 * t2**3 + k4 * t2**4)
        u, v = u * thetad / r, v * thetad / r
    elif model == "OPENCV":
        p1, p2 = rest
        radial = k1 * r2 + k2 * r2 * r2
        du = u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
        dv = v * radial + 2 * p2 * u * v + p1 * (r2 + 2 * v * v)
        u, v = u + du, v + dv
    elif model == "FULL_OPENCV":
        p1, p2, k3, k4, k5, k6 = rest
        radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
        u, v = (
            u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u),
            v * radial + 2 * p2 * u * v + p1 * (r2 + 2 * v * v),
        )
    else:
        radial = k1 * r2 + k2 * r2 * r2
        u, v = u + u * radial, v + v * radial
    return np.stack([fx * u + cx, fy * v + cy], axis=1)


COLMAP = {
    "SIMPLE_PINHOLE": [500, 310, 190],
    "PINHOLE": [500, 510, 310, 190],
    "SIMPLE_RADIAL": [500, 310, 190, -0.1],
    "RADIAL": [500, 310, 190, -0.1, 0.02],
    "OPENCV": [500, 510, 310, 190, -0.1, 0.02, 0.001, -0.002],
    "FULL_OPENCV": [500, 510, 310, 190, -0.1, 0.02, 0.001, -0.002, 0.01, 0.02, -0.01, 0.005],
    "SIMPLE_FISHEYE": [500, 310, 190],
    "FISHEYE": [500, 510, 310, 190],
    "SIMPLE_RADIAL_FISHEYE": [500, 310, 190, -0.1],
    "RADIAL_FISHEYE": [500, 310, 190, -0.1, 0.02],
    "OPENCV_FISHEYE": [500, 510, 310, 190, -0.1, 0.02, 0.003, -0.001],
}


@pytest.mark.parametrize("model", COLMAP)
def test_colmap_projects_as_its_models_do(model):
    camera = SimpleNamespace(id=3, model=model, width=640, height=400, params=np.array(COLMAP[model], float))
    image = SimpleNamespace(camera_id=3, qvec=QUATERNION, tvec=TRANSLATION)
    assert_at(Camera.from_colmap(camera, image), colmap_pixels(model, COLMAP[model]))


def test_colmap_quaternion_is_that_of_its_own_formula():
    w, x, y, z = QUATERNION / np.linalg.norm(QUATERNION)
    theirs = [
        [1 - 2 * y**2 - 2 * z**2, 2 * x * y - 2 * w * z, 2 * z * x + 2 * w * y],
        [2 * x * y + 2 * w * z, 1 - 2 * x**2 - 2 * z**2, 2 * y * z - 2 * w * x],
        [2 * z * x - 2 * w * y, 2 * y * z + 2 * w * x, 1 - 2 * x**2 - 2 * y**2],
    ]
    np.testing.assert_allclose(theirs, ROTATION, atol=1e-12)


def test_colmap_lines_mappings_and_objects_of_pycolmap_are_the_same():
    params = COLMAP["OPENCV"]
    line = f"3 OPENCV 640 400 {' '.join(map(str, params))}"
    place = f"12 {' '.join(map(repr, [*QUATERNION.tolist(), *TRANSLATION.tolist()]))} 3 a/b c.jpg"
    mapping = {"model": "OPENCV", "width": 640, "height": 400, "params": params}
    model = SimpleNamespace(name="OPENCV")
    pycolmap = SimpleNamespace(camera_id=3, model=model, width=640, height=400, params=params)
    rigid = SimpleNamespace(matrix=lambda: np.column_stack([ROTATION, TRANSLATION]))
    images = [place, SimpleNamespace(cam_from_world=rigid), SimpleNamespace(cam_from_world=lambda: rigid, camera_id=3)]
    for camera in (line, mapping, pycolmap):
        for image in images:
            assert_at(Camera.from_colmap(camera, image), colmap_pixels("OPENCV", params))


def test_pixel_center_of_zero_moves_the_picture_by_half_a_pixel():
    line, place = "1 SIMPLE_PINHOLE 640 400 500 310 190", "1 1 0 0 0 0 0 4 1 a.jpg"
    at = Camera.from_colmap(line, place).project([(0, 0, 0)], SIZE)[0, :2]
    moved = Camera.from_colmap(line, place, pixel_center=0).project([(0, 0, 0)], SIZE)[0, :2]
    np.testing.assert_allclose([at, moved], [[310, 190], [310.5, 190.5]], atol=1e-10)


def nerfstudio_pixels(c2w, fx, fy, cx, cy, k1=0.0, k2=0.0, k3=0.0, k4=0.0, p1=0.0, p2=0.0, *, is_fisheye=False):
    """The pixel whose ray, as `Cameras.generate_rays` makes it, goes through each point.

    There coords = ((x - cx) / fx, -(y - cy) / fy), undistorted with y turned over, become directions (coords, -1).
    """
    local = (POINTS - c2w[:3, 3]) @ c2w[:3, :3]
    x, y = local[:, 0] / -local[:, 2], -local[:, 1] / -local[:, 2]
    r = x * x + y * y
    if is_fisheye:
        theta = np.arctan(np.sqrt(r))
        t = theta**2
        scale = theta * (1 + t * (k1 + t * (k2 + t * (k3 + t * k4)))) / np.sqrt(r)
        x, y = x * scale, y * scale
    else:
        d = 1 + r * (k1 + r * (k2 + r * (k3 + r * k4)))
        x, y = d * x + 2 * p1 * x * y + p2 * (r + 2 * x * x), d * y + 2 * p2 * x * y + p1 * (r + 2 * y * y)
    return np.stack([fx * x + cx, fy * y + cy], axis=1)


C2W = np.eye(4)
C2W[:3, :3], C2W[:3, 3] = ROTATION, ROTATION @ [0.1, 0.3, 6]
LENSES = {
    "PINHOLE": {},
    "OPENCV": {"k1": -0.1, "k2": 0.02, "k3": 0.01, "p1": 0.001, "p2": -0.002},
    "OPENCV_FISHEYE": {"k1": -0.1, "k2": 0.02, "k3": 0.01, "k4": -0.003},
}


@pytest.mark.parametrize("model", LENSES)
def test_nerfstudio_sees_what_its_rays_do(model, tmp_path):
    own = {"fl_x": 500.0, "fl_y": 510.0, "cx": 310.0, "cy": 190.0, "w": 640, "h": 400, "camera_model": model}
    frames = [{"transform_matrix": np.eye(4).tolist()}, {"transform_matrix": C2W.tolist()}]
    content = own | LENSES[model] | {"frames": frames}
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps(content))
    expected = nerfstudio_pixels(C2W, 500, 510, 310, 190, **LENSES[model], is_fisheye="FISH" in model)
    for given in (content, path, str(path)):
        assert_at(Camera.from_nerfstudio(given, 1), expected)


def test_nerfstudio_frames_have_intrinsics_of_their_own():
    frames = [{"transform_matrix": C2W[:3].tolist(), "fl_x": 400, "w": 640, "h": 400}]
    assert_at(Camera.from_nerfstudio({"fl_x": 500, "frames": frames}), nerfstudio_pixels(C2W, 400, 400, 320, 200))


FISHEYE = LENSES["OPENCV_FISHEYE"]


@pytest.mark.parametrize("lens", [FISHEYE, {"k1": -0.1}, {"p1": 0.0, "p2": 0.0, **FISHEYE}, {}], ids=repr)
def test_nerfstudio_reads_is_fisheye_of_instant_ngp(lens):
    frame = {"transform_matrix": C2W.tolist()}
    content = {"fl_x": 500.0, "w": 640.0, "h": 400.0, "is_fisheye": True, **lens, "frames": [frame]}
    assert_at(Camera.from_nerfstudio(content), nerfstudio_pixels(C2W, 500, 500, 320, 200, **lens, is_fisheye=True))
    of_frame = content | {"is_fisheye": False, "frames": [frame | {"is_fisheye": True}]}
    assert Camera.from_nerfstudio(of_frame).lens == Camera.from_nerfstudio(content).lens
    named = content | {"camera_model": "OPENCV_FISHEYE"}
    assert Camera.from_nerfstudio(named).lens == Camera.from_nerfstudio(content).lens


def test_nerfstudio_takes_false_for_other_lenses_as_none():
    names = "is_fisheye", "latlong", "equirectangular", "orthographic"
    content = {"fl_x": 500, "w": 640, "h": 400, **dict.fromkeys(names, False), "frames": [FRAME]}
    assert Camera.from_nerfstudio(content).lens is None


@pytest.mark.parametrize("kind", [float, np.float32, np.float64])
def test_sizes_of_files_may_be_whole_floats(kind):
    content = {"fl_x": 500, "w": kind(1080.0), "h": kind(1920.0), "frames": [FRAME]}
    assert repr(Camera.from_nerfstudio(content)) == repr(Camera.from_nerfstudio(content | {"w": 1080, "h": 1920}))
    colmap = {"model": "PINHOLE", "width": 640, "height": 400, "params": COLMAP["PINHOLE"]}
    floats = colmap | {"width": kind(640), "height": kind(400)}
    assert repr(Camera.from_colmap(floats, PLACE)) == repr(Camera.from_colmap(colmap, PLACE))


def test_load_cameras_points_to_readers_of_nerfstudio_and_colmap(tmp_path):
    (tmp_path / "transforms.json").write_text("{}")
    (tmp_path / "images.bin").write_bytes(b"")
    for path in (tmp_path, tmp_path / "transforms.json", tmp_path / "images.bin"):
        with pytest.raises(tl.MeshError, match=r"from_nerfstudio reads .* Camera\.from_colmap an image"):
            tl.load_cameras(path)
    with pytest.raises(FileNotFoundError):
        tl.load_cameras(tmp_path / "none.json")


def test_blender_scenes_of_nerf_have_an_angle_and_no_size():
    content = {"camera_angle_x": 0.7, "frames": [{"transform_matrix": C2W.tolist()}]}
    focal = 0.5 * 640 / np.tan(0.5 * 0.7)
    assert_at(Camera.from_nerfstudio(content, size=SIZE), nerfstudio_pixels(C2W, focal, focal, 320, 200))


def test_opengl_camera_is_that_of_its_matrices():
    camera = Camera.from_opengl(C2W, fov_y_deg=50)
    clip = np.column_stack([POINTS, np.ones(50)]) @ (np.linalg.inv(C2W).T)
    f = 1 / np.tan(np.radians(25))
    ndc = np.stack([f / (640 / 400) * clip[:, 0], f * clip[:, 1]], axis=1) / -clip[:, 2:3]
    assert_at(camera, (ndc * [1, -1] + 1) * [320, 200])


def test_opengl_camera_with_intrinsics_is_that_of_nerfstudio():
    intrinsics = [[500, 0, 310], [0, 510, 190], [0, 0, 1]]
    assert_at(Camera.from_opengl(C2W, intrinsics, SIZE), nerfstudio_pixels(C2W, 500, 510, 310, 190))
    assert_at(Camera.from_opengl(C2W, intrinsics, SIZE, pixel_center=0), nerfstudio_pixels(C2W, 500, 510, 310.5, 190.5))


def pytorch3d_pixels(cameras, i):
    """What `transform_points_screen` of PyTorch3D gives: rows times matrices, NDC, then the screen."""
    width, height = SIZE
    at = POINTS @ cameras.R[i] + cameras.T[i]
    scale = min(SIZE) / 2
    if hasattr(cameras, "fov"):
        slope = np.tan(np.radians(cameras.fov[i]) / 2)
        ndc = np.stack([at[:, 0] / (slope * cameras.aspect_ratio[i]), at[:, 1] / slope], axis=1) / at[:, 2:]
    else:
        focal, center = cameras.focal_length[i], cameras.principal_point[i]
        if not cameras.in_ndc():
            focal, center = focal / scale, -(center - np.array(SIZE) / 2) / scale
        ndc = focal * at[:, :2] / at[:, 2:] + center
    return np.stack([width / 2 - scale * ndc[:, 0], height / 2 - scale * ndc[:, 1]], axis=1)


def pytorch3d_cameras(**own):
    return SimpleNamespace(R=np.stack([np.eye(3), ROTATION]), T=np.stack([[0, 0, 3], TRANSLATION]), **own)


@pytest.mark.parametrize("in_ndc", [True, False])
def test_pytorch3d_perspective_is_that_of_its_screen(in_ndc):
    focal, center = np.array([[2.0, 2.1], [2.5, 2.4]]), np.array([[0.0, 0.0], [0.1, -0.2]])
    if not in_ndc:
        focal, center = focal * 200, 320 + center * 200
    cameras = pytorch3d_cameras(
        focal_length=focal, principal_point=center, in_ndc=lambda: in_ndc, image_size=np.array([[400, 640]])
    )
    assert_at(Camera.from_pytorch3d(cameras, 1), pytorch3d_pixels(cameras, 1))
    assert_at(Camera.from_pytorch3d(cameras), pytorch3d_pixels(cameras, 0))


def test_pytorch3d_field_of_view_is_that_of_the_shorter_side():
    own = {"fov": np.array([50.0, 60.0]), "aspect_ratio": np.array([1.0, 1.1]), "degrees": True}
    cameras = pytorch3d_cameras(**own, znear=np.array([0.5]), zfar=np.array([100.0]))
    camera = Camera.from_pytorch3d(cameras, 1, size=SIZE)
    assert_at(camera, pytorch3d_pixels(cameras, 1))
    at = np.linalg.solve(ROTATION.T, np.array([[0, 0, 0.5], [0, 0, 100.0]]).T - TRANSLATION[:, None]).T
    np.testing.assert_allclose(camera.project(at, SIZE)[:, 2], [0, 1], atol=1e-9)


def test_pytorch3d_matrix_k_goes_before_other_numbers():
    k = np.zeros((1, 4, 4))
    k[0, [0, 1, 0, 1], [0, 1, 2, 2]] = 2.5, 2.4, 0.1, -0.2
    focal, center = np.array([[2.5, 2.4]] * 2), np.array([[0.1, -0.2]] * 2)
    plain = pytorch3d_cameras(focal_length=focal, principal_point=center, in_ndc=lambda: True)
    assert_at(Camera.from_pytorch3d(pytorch3d_cameras(K=k), 1, size=SIZE), pytorch3d_pixels(plain, 1))


POSE = np.eye(4)
POSE[:3, :3], POSE[:3, 3] = ROTATION, TRANSLATION
BOP = {"cam_R_m2c": ROTATION.ravel().tolist(), "cam_t_m2c": TRANSLATION.tolist(), "obj_id": 3}


@pytest.mark.parametrize(
    "pose",
    [
        POSE,
        POSE[:3],
        POSE[:3].tolist(),
        (ROTATION, TRANSLATION),
        (ROTATION.tolist(), TRANSLATION[:, None]),
        BOP,
        {"cam_R_w2c": ROTATION, "cam_t_w2c": TRANSLATION},
    ],
)
def test_every_form_of_a_pose_is_the_same_matrix(pose):
    assert (as_pose("pose", pose) == POSE).all()
    camera = Camera.from_intrinsics([[500, 0, 320], [0, 500, 200], [0, 0, 1]], pose, SIZE)
    assert (camera.view == np.diag([1, -1, -1, 1]) @ POSE).all()
    cube = tl.Mesh(*tl.scenes.cube())
    assert (tl.Scene([(cube, pose)])[0].transform == POSE).all()


@pytest.mark.parametrize("vector", [(0, 0, 0), (0.1, -0.2, 0.3), (0, math.pi, 0), (3.0, 2.0, -4.0), (1e-9, 0, 0)])
def test_a_rotation_vector_is_the_exponential_of_its_matrix(vector):
    x, y, z = vector
    cross, term, total = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.eye(3), np.eye(3)
    for k in range(1, 60):
        term = term @ cross / k
        total = total + term
    found = as_pose("pose", (vector, (1, 2, 3)))
    np.testing.assert_allclose(found[:3, :3], total, atol=1e-13)
    assert found[:3, 3].tolist() == [1, 2, 3]


LINE, PLACE = "1 PINHOLE 640 400 500 500 320 200", "1 1 0 0 0 0 0 4 1 a.jpg"
FRAME = {"transform_matrix": np.eye(4).tolist()}
FILE = {"fl_x": 5, "w": 4, "h": 4, "frames": [FRAME]}


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Camera.from_colmap("1 PINHOLE 640", PLACE), ValueError, "camera must be a line 'CAMERA_ID MODEL"),
        (lambda: Camera.from_colmap(LINE.replace("PINHOLE", "FOV"), PLACE), ValueError, "camera must be of a model of"),
        (lambda: Camera.from_colmap(LINE + " 1", PLACE), ValueError, "params of PINHOLE must be 4 numbers, got 5"),
        (lambda: Camera.from_colmap("2" + LINE[1:], PLACE), ValueError, "image must be of camera 2, got one of camera"),
        (lambda: Camera.from_colmap(LINE, "1 1 0 0"), ValueError, "image must be a line 'IMAGE_ID QW QX"),
        (lambda: Camera.from_colmap(LINE, "1 0 0 0 0 0 0 4 1 a"), ValueError, "pose of image must hold finite numbers"),
        (lambda: Camera.from_colmap(object(), PLACE), TypeError, "camera must have model"),
        (lambda: Camera.from_colmap(LINE, object()), TypeError, "image must have qvec"),
        (lambda: Camera.from_nerfstudio({}), ValueError, "transforms must be the content or the path"),
        (lambda: Camera.from_nerfstudio({"frames": [FRAME]}, 1), IndexError, "i must be an index from 0 to 0, got 1"),
        (lambda: Camera.from_nerfstudio({"frames": [{}]}), ValueError, "frame 0 must have a transform_matrix"),
        (lambda: Camera.from_nerfstudio({"w": 4, "h": 4, "frames": [FRAME]}), ValueError,
         "transforms must have fl_x or camera_angle_x"),
        (lambda: Camera.from_nerfstudio({"fl_x": 5, "frames": [FRAME]}), TypeError, r"size \(w and h of the file\)"),
        (lambda: Camera.from_nerfstudio({"camera_model": "ORTHOPHOTO", "frames": [FRAME]}), ValueError,
         "camera_model must be one of SIMPLE_PINHOLE, .*, got 'ORTHOPHOTO'"),
        *(
            (
                lambda key=key, value=value: Camera.from_nerfstudio(FILE | {key: value}),
                ValueError,
                f"transforms must be of perspective or is_fisheye cameras, got {key}",
            )
            for key, value in [("latlong", True), ("equirectangular", True), ("orthographic", 1), ("ftheta_p0", 0.0)]
        ),
        (lambda: Camera.from_nerfstudio(FILE | {"camera_model": "OPENCV", "is_fisheye": True}), ValueError,
         "is_fisheye must be false where camera_model is OPENCV, got True"),
        (lambda: Camera.from_nerfstudio(FILE | {"w": 4.5}), TypeError, r"size \(w and h of the file\) .*4.5"),
        (lambda: Camera.from_nerfstudio({"fl_x": 5, "w": 4, "h": 4, "k4": 0.1, "frames": [FRAME]}), ValueError,
         "k4 of a camera_model OPENCV must be 0, got 0.1"),
        (lambda: Camera.from_nerfstudio(FILE | {"k5": 0.1}), ValueError, "k5 of a camera_model OPENCV.* must be 0"),
        (lambda: Camera.from_nerfstudio(FILE | {"is_fisheye": True, "k6": 0.1}), ValueError, "k6 of a camera_model"),
        (lambda: Camera.from_nerfstudio(FILE | {"rolling_shutter": [0, 0, 0.1, 0]}), ValueError,
         r"rolling_shutter must be 0, got \[0, 0, 0.1, 0\]"),
        (
            lambda: Camera.from_nerfstudio(
                {"fl_x": 5, "w": 4, "h": 4, "p1": 0.1, "camera_model": "OPENCV_FISHEYE", "frames": [FRAME]}
            ),
            ValueError,
            "p1 and p2 of an OPENCV_FISHEYE camera must be 0, got 0.1 and 0.0",
        ),
        (lambda: Camera.from_opengl(np.eye(3)), ValueError, r"c2w must be .*mapping.*, got shape \(3, 3\)"),
        (lambda: Camera.from_opengl(np.eye(4), np.eye(3)), ValueError, "intrinsics need the size of their picture"),
        (lambda: Camera.from_opengl(np.eye(4), size=(4, 4)), ValueError,
         "size, distortion and fisheye need intrinsics"),
        (lambda: Camera.from_pytorch3d(object(), size=4), TypeError, "cameras must have R, got object"),
        (lambda: Camera.from_pytorch3d(type("FoVOrthographicCameras", (), {})(), size=4), ValueError,
         "cameras must have perspective without a lens, got FoVOrthographicCameras"),
        (lambda: Camera.from_pytorch3d(pytorch3d_cameras()), ValueError, "size must be given"),
        (lambda: Camera.from_pytorch3d(pytorch3d_cameras(), 2, size=4), IndexError, "i must be an index from 0 to 1"),
        (lambda: Camera.from_intrinsics(np.eye(3), np.eye(4), (4, 4), pixel_center=math.inf), ValueError,
         "pixel_center must be finite, got inf"),
        (lambda: as_pose("pose", {"R": 1}), ValueError, r"pose must be \(4, 4\), .*, got a mapping with R"),
        (lambda: as_pose("pose", BOP | {"cam_t_m2c": [1]}), ValueError, "of pose must have 9 and 3 numbers, got 9 and"),
        (lambda: as_pose("pose", (np.eye(2), np.ones(3))), ValueError, r"got a pair of shapes \(2, 2\) and \(3,\)"),
        (lambda: as_pose("pose", (np.eye(3), [0, 0, np.nan])), ValueError, "pose must hold finite numbers"),
        (lambda: as_pose("pose", ([math.inf, 0, 0], [0, 0, 0])), ValueError, "pose must hold finite numbers"),
        (lambda: as_pose("pose", (np.zeros((3, 3)), [0, 0, 0])), ValueError, "pose must not be singular"),
    ],
)  # fmt: skip
def test_what_is_no_camera_and_no_pose_is_refused(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_a_pose_far_away_is_not_singular():
    place = np.eye(4)
    place[:3, 3] = 1e12, -3e9, 5
    assert (tl.Instance(tl.Mesh(*tl.scenes.cube()), place).transform == place).all()
