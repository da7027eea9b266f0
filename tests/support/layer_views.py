"""What the tests of layers and of lenses look at, and from where."""

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.camera.camera import Camera
from topleft._meshes.picture.view_layers import render_layers

SIZE = (80, 60)
SNAP_PX = 2.0**-9  # half a sub-pixel
FLOAT32 = 2.0**-23  # the rounding of a result, and some of the weights
SPHERE = tl.Mesh(*tl.scenes.shape("sphere"))
CUBE = tl.Mesh(*tl.scenes.shape("cube"))
CAMERAS = {
    "perspective": Camera.look_at((3, 2, 4), near=0.5, far=50),
    "orthographic": Camera.look_at((3, 2, 4), ortho_height=5, near=0.5, far=50),
    "off-centre": Camera.from_intrinsics(
        [[70, 3, 30], [0, 80, 20], [0, 0, 1]],
        np.diag([1.0, -1, -1, 1]) @ Camera.look_at((3, 2, 4)).view,
        SIZE, near=0.5, far=50,
    ),
}  # fmt: skip
ON_EACH_CAMERA = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)


def scene():
    """A stretched and a turned instance, and a float32 one."""
    stretched, aside = np.diag([1.5, 0.6, 1, 1]), np.eye(4)
    aside[:3, :3] = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    aside[:3, 3] = -1.2, 0.4, 0.9
    back = np.eye(4)
    back[:3, 3] = 0.5, -0.5, -2
    single = tl.Mesh(SPHERE.vertices.astype(np.float32), SPHERE.triangles)
    return tl.Scene([(SPHERE, stretched), (CUBE, aside), (single, back)])


def look(camera, *layers, subject=None, **options):
    return render_layers(scene() if subject is None else subject, camera, SIZE, layers=layers, **options)


def pixels(mask):
    rows, cols = np.nonzero(mask)
    return cols + 0.5, rows + 0.5


LENSES = {"barrel": tl.OpenCVLens(-0.2, 0.05, 0.001, -0.002), "fisheye": tl.FisheyeLens(-0.02, 0.01)}


def pierced():
    """A square before another one; the near one has a hole in its middle."""
    image = np.full((64, 64, 4), 255, np.uint8)
    image[16:48, 16:48, 3] = 0
    corners = [[x, y, z] for z in (0, -1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]] * 2
    holed = tl.Material(texture=tl.Texture(image), alpha_cutoff=0.5)
    triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    return tl.Mesh(corners, triangles, uv=uv, materials=[holed, tl.Material()], material_of_triangle=[0, 0, 1, 1])


FRONT = tl.Camera.look_at((0, 0, 5), fov_y_deg=40)
