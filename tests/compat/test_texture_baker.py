"""`topleft.compat.texture_baker`: what the package of Stable Fast 3D returns, without it."""

import numpy as np
import pytest

from topleft.compat.texture_baker import TextureBaker

N = 8
UV = np.array([[0.06, 0.1], [0.93, 0.28], [0.41, 0.95], [0.97, 0.99], [0.55, 0.88]], np.float32)
FACES = np.array([[0, 1, 2], [1, 3, 4], [1, 4, 2]])

# what the kernel for the CPU of Stable Fast 3D returns of these faces, and the weights of its texel (3, 4)
RECORDED = """
-1 -1 -1 -1 -1 -1 -1 -1
-1 -1 -1 -1  2  1  1  1
-1 -1 -1  0  0  2  1  1
-1 -1 -1  0  0  0  1  1
-1 -1  0  0  0  0  0  1
-1 -1  0  0  0  0  0  1
-1  0  0  0  0  0  0 -1
-1  0 -1 -1 -1 -1 -1 -1
"""
WEIGHTS = [0.160680, 0.281227, 0.558093]


def test_faces_and_weights_are_those_of_the_kernel_for_the_cpu():
    rast = TextureBaker().rasterize(UV, FACES, N)
    assert rast.dtype == np.float32
    assert rast[..., 3].tolist() == [[int(word) for word in row.split()] for row in RECORDED.split("\n") if row]
    assert np.abs(rast[3, 4, :3] - WEIGHTS).max() < 1e-5  # its weights are sums of rounded products
    assert rast[0, 0].tolist() == [0, 0, 0, -1]


def test_weights_put_each_texel_at_its_upper_left_corner():
    rast = TextureBaker().rasterize(UV, FACES, N)
    seen = rast[..., 3] >= 0
    y, x = np.nonzero(seen)
    found = (rast[seen, :3, None] * UV[FACES[rast[seen, 3].astype(int)]]).sum(axis=1)
    assert np.allclose(found, np.column_stack([x / N, 1 - y / N]), atol=1e-6)


def test_face_of_lower_index_shows_where_faces_overlap():
    twice = np.vstack([FACES, FACES])
    assert np.array_equal(TextureBaker().rasterize(UV, twice, N), TextureBaker().rasterize(UV, FACES, N))


def test_mask_is_where_a_face_lies():
    baker = TextureBaker()
    rast = baker.rasterize(UV, FACES, N)
    mask = baker.get_mask(rast)
    assert mask.dtype == np.bool_
    assert np.array_equal(mask, rast[..., 3] > -1)


@pytest.mark.parametrize("channels", [1, 3, 5])
def test_baked_attributes_are_sums_of_those_of_the_corners(channels):
    baker = TextureBaker()
    attr = np.random.default_rng(0).random((len(UV), channels)).astype(np.float32)
    rast = baker.rasterize(UV, FACES, N)
    found = baker.interpolate(attr, rast, FACES)
    ids = rast[..., 3].astype(int)
    expected = (rast[..., :3, None] * attr[FACES[ids]]).sum(axis=2)
    assert found.shape == (N, N, channels)
    assert np.allclose(found, expected, rtol=1e-6)
    assert not found[ids < 0].any()
    assert np.array_equal(baker(attr, UV, FACES, N), found)


def test_tensors_give_tensors_with_gradients():
    torch = pytest.importorskip("torch")
    baker, faces = TextureBaker(), torch.tensor(FACES, dtype=torch.int32)
    rast = baker.rasterize(torch.tensor(UV), faces, N)
    weights = TextureBaker().rasterize(UV, FACES, N)
    assert np.array_equal(rast.numpy(), weights)
    assert baker.get_mask(rast).dtype == torch.bool
    attr = torch.rand((len(UV), 3), requires_grad=True)
    baker.interpolate(attr, rast, faces).sum().backward()
    by_corner = np.zeros(len(UV))
    seen = weights[..., 3] >= 0
    np.add.at(by_corner, FACES[weights[seen, 3].astype(int)], weights[seen, :3])
    assert np.allclose(attr.grad.numpy(), by_corner[:, None], rtol=1e-5)
