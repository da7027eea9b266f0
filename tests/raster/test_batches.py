"""A batch of poses is what each of them is alone."""

import numpy as np
import pytest

import topleft as tl

MESH = tl.Mesh(*tl.scenes.shape("torus-knot"))
SIZE = (24, 18)
POSES = np.stack([camera.clip_from_world(SIZE) for camera in tl.turntable(MESH, 5)])
CLIP = np.einsum("bij,vj->bvi", POSES, np.column_stack([MESH.vertices, np.ones(len(MESH.vertices))]))


def assert_same(found, alone):
    assert np.array_equal(found.triangle, np.stack([one.triangle for one in alone]))
    assert np.array_equal(found.depth, np.stack([one.depth for one in alone]))
    assert np.array_equal(found.mask, found.triangle >= 0)
    assert np.array_equal(found.barycentric(), np.stack([one.barycentric() for one in alone]))


@pytest.mark.parametrize("threads", [None, 1, 2, 7])
def test_batch_of_transforms_is_each_of_them(threads):
    found = tl.rasterize(MESH.vertices, MESH.triangles, SIZE, transform=POSES, threads=threads)
    alone = [tl.rasterize(MESH.vertices, MESH.triangles, SIZE, transform=pose) for pose in POSES]
    assert repr(found) == "FragmentsBatch(5 of 24x18)"
    assert (len(found), found.triangle.shape) == (5, (5, 18, 24))
    assert_same(found, alone)
    assert np.array_equal(found[2].triangle, alone[2].triangle)
    expected = np.stack([one.interpolate(MESH.vertices) for one in alone])
    assert np.array_equal(found.interpolate(MESH.vertices), expected)


def test_batch_of_clip_space_is_each_of_them():
    found = tl.rasterize(CLIP, MESH.triangles, SIZE)
    alone = [tl.rasterize(clip, MESH.triangles, SIZE) for clip in CLIP]
    assert_same(found, alone)
    own = np.random.default_rng(0).normal(size=(5, len(MESH.vertices), 2))
    expected = np.stack([one.interpolate(values) for one, values in zip(alone, own, strict=True)])
    assert np.array_equal(found.interpolate(own), expected)
    assert found.interpolate(own[0, :, 0]).shape == (5, 18, 24)


def test_batch_of_vertices_and_transforms_goes_by_pairs():
    vertices = np.stack([MESH.vertices * k for k in (0.5, 1, 2)])
    found = tl.rasterize(vertices, MESH.triangles, SIZE, transform=POSES[:3])
    pairs = zip(vertices, POSES[:3], strict=True)
    alone = [tl.rasterize(own, MESH.triangles, SIZE, transform=pose) for own, pose in pairs]
    assert_same(found, alone)


def test_batch_of_lists_and_of_nothing():
    square = [[0, 0], [4, 0], [0, 4]]
    assert tl.rasterize([square, square], [[0, 1, 2]], 4).triangle.shape == (2, 4, 4)
    nothing = tl.rasterize(np.empty((0, 3, 2)), [[0, 1, 2]], 4)
    assert (len(nothing), nothing.triangle.shape, nothing.barycentric().shape) == (0, (0, 4, 4), (0, 4, 4, 3))


def test_batch_goes_where_it_is_told():
    out = np.empty((5, 18, 24), np.int32), np.empty((5, 18, 24), np.float32)
    found = tl.rasterize(CLIP, MESH.triangles, SIZE, out=out)
    assert found.triangle is out[0]
    assert found.depth is out[1]


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((CLIP, MESH.triangles, SIZE), {"sampling": "msaa4"}, "sampling must be 'center' for a batch, got 'msaa4'"),
        ((CLIP[:2, :, :3], MESH.triangles, SIZE), {"transform": POSES}, "vertices and transform must have one number"),
        ((CLIP[..., :1], MESH.triangles, SIZE), {}, "vertices must have shape"),
        ((CLIP, MESH.triangles, SIZE), {"out": (np.empty((18, 24), np.int32), None)}, "out triangle must have shape"),
    ],
)
def test_batch_that_does_not_fit_is_refused(arguments, options, message):
    with pytest.raises(ValueError, match=message):
        tl.rasterize(*arguments, **options)
