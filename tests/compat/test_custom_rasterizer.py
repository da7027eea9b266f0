"""`topleft.compat.custom_rasterizer`: what the package of Hunyuan3D returns, without it."""

import numpy as np
import pytest

from topleft.compat import custom_rasterizer as cr

SIZE = (6, 9)
"""Height and width."""

POS = [
    [-1.8, -0.7, 0.2, 2], [1.3, -0.9, 0.4, 1.1], [0.3, 1.2, -0.4, 1.5],
    [0.8, 0.9, 0.5, 1], [-0.9, 0.7, -0.6, 1.2], [-0.1, -0.8, 0.1, 0.9],
]  # fmt: skip
TRI = [[0, 1, 2], [3, 4, 5]]

# what the kernel of Hunyuan3D for the CPU returns of these two faces
RECORDED = """
0 0 0 0 0 0 0 0 0
0 0 0 0 2 1 1 1 1
0 1 1 2 1 1 1 1 0
0 0 2 2 1 1 1 0 0
0 0 2 2 2 1 2 0 0
0 0 0 0 0 0 0 0 0
"""


def table(text):
    return [[int(word) for word in row.split()] for row in text.split("\n") if row]


def by_hand(pos, tri, size):
    """Each pixel and each face: the plane through the eye and an edge, z / w, and the rule for what is nearest."""
    height, width = size
    ids, weights = np.zeros(size, int), np.zeros((*size, 3))
    for row, column in np.ndindex(size):
        p = np.array([2 * column / (width - 1) - 1, 2 * row / (height - 1) - 1, 1])
        best = np.inf
        for f, corners in enumerate(np.asarray(pos, np.float32)[tri].astype(float)):
            x, y, z, w = corners.T
            flat = np.column_stack([x, y, w])
            sides = np.array([np.cross(flat[(i + 1) % 3], flat[(i + 2) % 3]) @ p for i in range(3)])
            own = sides / sides.sum()
            depth = (own @ z) / (own @ w)
            if own.min() > 0 and own @ w > 0 and -1 < depth < best:
                ids[row, column], weights[row, column], best = f + 1, own, depth
    return ids, weights


def random_faces(seed, n=12):
    """Faces of which some reach before the near plane, z = -w, and beyond the far one; w is positive."""
    rng = np.random.default_rng(seed)
    pos = rng.uniform([-1.5, -1.5, -1.4, 0.5], [1.5, 1.5, 2.5, 2], (3 * n, 4)).astype(np.float32)
    return pos[None], np.arange(3 * n).reshape(-1, 3)


def test_faces_are_those_of_the_kernel_for_the_cpu():
    findices, barycentric = cr.rasterize([POS], TRI, SIZE)
    assert findices.tolist() == table(RECORDED)
    assert findices.dtype == np.int32
    assert barycentric.dtype == np.float32
    assert np.abs(barycentric[3, 4] - [0.24126883, 0.20666449, 0.55206662]).max() < 2e-7
    assert not barycentric[0].any()


@pytest.mark.parametrize("size", [(8, 11), (11, 8), (2, 2)])
@pytest.mark.parametrize("seed", range(3))
def test_faces_and_weights_are_those_of_each_pixel_by_hand(size, seed):
    pos, tri = random_faces(seed)
    findices, barycentric = cr.rasterize(pos, tri, size)
    ids, weights = by_hand(pos[0], tri, size)
    assert np.array_equal(findices, ids)
    assert np.abs(barycentric - weights).max() < 1e-6


def test_interpolated_colours_are_sums_of_those_of_the_corners():
    pos, tri = random_faces(7)
    findices, barycentric = cr.rasterize(pos, tri, SIZE)
    col = np.random.default_rng(2).random((1, len(pos[0]), 5)).astype(np.float32)
    found = cr.interpolate(col, findices, barycentric, tri)
    expected = (barycentric[..., None] * col[0][tri[findices - 1]]).sum(axis=2)
    assert found.shape == (1, *SIZE, 5)
    assert np.allclose(found[0], expected, rtol=1e-6)
    assert not found[0][findices == 0].any()


def test_tensors_give_tensors_with_gradients():
    torch = pytest.importorskip("torch")
    pos, tri = random_faces(7)
    tensors = torch.tensor(pos), torch.tensor(tri, dtype=torch.int32)
    findices, barycentric = cr.rasterize(*tensors, SIZE)
    expected, weights = cr.rasterize(pos, tri, SIZE)
    assert findices.dtype == torch.int32
    assert np.array_equal(findices.numpy(), expected)
    assert np.array_equal(barycentric.numpy(), weights)
    col = torch.rand((1, len(pos[0]), 3), requires_grad=True)
    cr.interpolate(col, findices, barycentric, tensors[1]).sum().backward()
    by_corner = np.zeros(len(pos[0]))
    np.add.at(by_corner, tri[expected[expected > 0] - 1], weights[expected > 0])
    assert np.allclose(col.grad.numpy(), by_corner[None, :, None], rtol=1e-5, atol=1e-6)
