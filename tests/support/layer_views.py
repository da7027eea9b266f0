"""What the tests of layers look at, and from where."""

from __future__ import annotations

import numpy as np
import pytest

import topleft as tl
from topleft._camera.camera import Camera
from topleft._render.view_layers import render_layers

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
