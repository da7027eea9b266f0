"""Leaves: squares behind each other whose texture has holes."""

import numpy as np

import topleft as tl
from topleft._meshes.picture.holes import draw_visible
from topleft._meshes.picture.shot import Shot

SIZE = (90, 70)
CAMERA = tl.Camera.look_at((0.4, 0.3, 3), near=0.5, far=9)
HOLES = np.full((16, 16, 4), 200, np.uint8)
HOLES[..., 3] = np.where(np.indices((16, 16)).sum(0) // 3 % 2, 255, 0)
LEAF = tl.Material(texture=tl.Texture(HOLES), alpha_cutoff=0.5)
N_LAYERS = 4


def layers(order):
    """Leaves behind each other, their depths in an order, and a wall behind all of them that has no holes."""
    square, uv = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]), []
    vertices, triangles = [], []
    for k, place in enumerate([*order, N_LAYERS]):
        size = 1 if place < N_LAYERS else 0.8
        vertices.append(np.c_[size * square, np.full(4, -0.2 * place)])
        triangles += [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]]
        uv.append((square + 1) / 2 * (1 + 0.3 * k) + 0.1 * k)
    rows = [0] * (2 * len(order)) + [1, 1]
    materials = LEAF, tl.Material(color=(250, 10, 10))
    return tl.Mesh(np.concatenate(vertices), triangles, None, None, np.concatenate(uv), materials, rows)


def cut(mesh, size=SIZE, **options):
    return draw_visible(Shot.of(mesh, CAMERA, size), **options)
