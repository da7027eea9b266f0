"""Scenes of instances for tests, and the one mesh in clip space that is the same picture."""

import numpy as np

import topleft as tl

SIZE = (90, 70)
CAMERA = tl.Camera.look_at((4, 3, 6), near=2.5, far=30)  # the near plane cuts
SPHERE = tl.Mesh(*tl.scenes.shape("sphere"))
CUBE = tl.Mesh(*tl.scenes.shape("cube"))
SINGLE = tl.Mesh(CUBE.vertices.astype(np.float32), CUBE.triangles)


def placed(rng, scale=1.0):
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.standard_normal((3, 3)))[0] * scale
    matrix[:3, :3] *= np.sign(np.linalg.det(matrix[:3, :3]))
    matrix[:3, 3] = rng.uniform(-2, 2, 3)
    return matrix


def many(seed=1, n=9):
    rng = np.random.default_rng(seed)
    meshes = [SPHERE, CUBE, SINGLE]
    return tl.Scene([(meshes[i % 3], placed(rng, rng.uniform(0.3, 1.1)), f"part {i}") for i in range(n)])


def clip_of(instance, clip_from_world):
    """Clip space, docs/design/rules.md: float32 vertices in float32, others in float64, each operation rounded once."""
    points = instance.mesh.vertices
    m = (clip_from_world @ instance.transform).astype(points.dtype)
    x, y, z = points.T
    return np.stack([((row[0] * x + row[1] * y) + row[2] * z) + row[3] for row in m], -1)


def joined(scene, size=SIZE, camera=CAMERA):
    """One mesh in clip space that holds all instances."""
    matrix = camera.clip_from_world(size)
    starts = np.cumsum([0] + [len(instance.mesh.vertices) for instance in scene])
    vertices = np.concatenate([clip_of(instance, matrix).astype(np.float64) for instance in scene])
    return vertices, np.concatenate([i.mesh.triangles + s for i, s in zip(scene, starts[:-1], strict=True)])


def told_apart(scene, ids):
    """Instance and triangle of ids that count all triangles."""
    instance = np.full(ids.shape, -1, np.int32)
    triangle = np.full(ids.shape, -1, np.int32)
    first = 0
    for k, part in enumerate(scene):
        n = len(part.mesh.triangles)
        own = (ids >= first) & (ids < first + n)
        instance[own], triangle[own] = k, ids[own] - first
        first += n
    return instance, triangle
