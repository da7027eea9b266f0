"""Prints a hash of what cameras, scenes, lenses and environments compute, for `test_same_everywhere.py`."""

import hashlib
from dataclasses import replace

import numpy as np

import topleft as tl

RNG = np.random.default_rng(8)
VERTICES, TRIANGLES = RNG.integers(-50, 50, (30, 3)) / 16, RNG.integers(0, 30, (40, 3))
MESH, SIZE = tl.Mesh(VERTICES, TRIANGLES), (40, 30)
SKY = tl.Environment(image=np.kron(RNG.integers(0, 256, (8, 16, 3)), np.ones((4, 4, 1))).astype(np.uint8), turn=20)
METAL = tl.Material(metallic=1.0, roughness=0.3)
LENSES = (tl.FisheyeLens(0.1, -0.02), tl.OpenCVLens(-0.2, 0.05, tau_x=0.1, tau_y=-0.05))
FITS = ("sphere", "box", "points", "silhouette")


def cameras():
    """Cameras of every kind."""
    yield from tl.turntable(MESH, 5)
    yield from tl.viewpoints(MESH, 5)
    for k, numbers in enumerate(RNG.uniform(-1, 1, (12, 9))):
        eye, target, (x, y, z) = 4 * numbers[:3] + 2, numbers[3:6], numbers[6:]
        camera = tl.Camera.look_at(eye, target, fov_y_deg=50 + 30 * x)
        yield camera
        yield tl.Camera.framing(MESH, azimuth_deg=360 * y, elevation_deg=80 * z, fit=FITS[k % 4], ortho=k % 3 == 0)
        yield tl.Camera.from_matrix(camera.clip_from_world(SIZE))
        yield tl.Camera.from_intrinsics([[30 + x, 0, 20], [0, 31 + y, 15], [0, 0, 1]], camera.view, SIZE)


def numbers_of(camera, other, k):
    """What pictures are made of."""
    yield from (camera.view, camera.projection, camera.clip_from_world(SIZE), camera.placed(other.view).view)
    yield camera.project(VERTICES, SIZE)
    frags = tl.rasterize_mesh(MESH, camera, SIZE)
    yield from (frags.triangle, frags.depth, frags.distance(camera), tl.render(MESH, camera, SIZE))
    placed = np.diag([-1.0, 1.3, 0.7, 1.0]) @ np.round(other.view * 64) / 64
    scene = tl.Scene([tl.Instance(MESH, placed), tl.Instance(MESH)])
    yield tl.render(scene, camera, SIZE, lights=tl.Light((1, 2, 3), kind="point"))
    yield from tl.render_layers(scene, camera, SIZE, layers=("world_position", "world_normal", "ray_distance")).values()
    if camera.projection[3, 2] and k % 8 == 0:
        lens = LENSES[k % 2]
        yield lens.distort(VERTICES + [0, 0, 5])
        bent = replace(camera, lens=lens)
        yield from (
            bent.project(VERTICES, SIZE),
            tl.render(MESH, bent, SIZE),
            tl.rasterize_mesh(MESH, bent, SIZE).depth,
        )


def main():
    """Print the hash."""
    digest, made = hashlib.sha256(), list(cameras())
    for k, camera in enumerate(made):
        with np.errstate(all="ignore"):
            for numbers in numbers_of(camera, made[k - 1], k):
                digest.update(np.ascontiguousarray(numbers).tobytes())
    digest.update(SKY.levels[0].tobytes())
    digest.update(tl.render(MESH, made[0], SIZE, environment=SKY, material=METAL).tobytes())
    print(digest.hexdigest())


if __name__ == "__main__":
    main()
