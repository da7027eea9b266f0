"""What the tests of batches share: a small mesh, views of it, and what they must look like."""

import topleft as tl
from topleft import scenes

SIZE = (40, 30)
CORNERS, FACES = scenes.shape("cube")
BOX = tl.Mesh(CORNERS @ [[1, 0.3, 0], [0, 2, 0.5], [0.2, 0.7, 3]] + CORNERS.prod(1, keepdims=True), FACES)
EXECUTORS = [None, 1, 3]


def orbit(mesh, n):
    return [tl.Camera.framing(mesh, azimuth_deg=360 * i / n, aspect=4 / 3) for i in range(n)]


def views(n, mesh=BOX, **options):
    return [tl.Job(mesh, camera, SIZE, options) for camera in orbit(mesh, n)]


def pictures(n, mesh=BOX, **options):
    return [tl.render(mesh, camera, SIZE, **options) for camera in orbit(mesh, n)]
