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
    found = tl.rasterize_poses(MESH.vertices, MESH.triangles, SIZE, transform=POSES, threads=threads)
    alone = [tl.rasterize(MESH.vertices, MESH.triangles, SIZE, transform=pose) for pose in POSES]
    assert repr(found) == "FragmentsBatch(5 of 24x18)"
    assert (len(found), found.triangle.shape) == (5, (5, 18, 24))
    assert_same(found, alone)
    assert np.array_equal(found[2].triangle, alone[2].triangle)
    expected = np.stack([one.interpolate(MESH.vertices) for one in alone])
    assert np.array_equal(found.interpolate(MESH.vertices), expected)


def test_batch_of_clip_space_is_each_of_them():
    found = tl.rasterize_poses(CLIP, MESH.triangles, SIZE)
    alone = [tl.rasterize(clip, MESH.triangles, SIZE) for clip in CLIP]
    assert_same(found, alone)
    own = np.random.default_rng(0).normal(size=(5, len(MESH.vertices), 2))
    expected = np.stack([one.interpolate(values) for one, values in zip(alone, own, strict=True)])
    assert np.array_equal(found.interpolate(own), expected)
    assert found.interpolate(own[0, :, 0]).shape == (5, 18, 24)


def test_batch_of_vertices_and_transforms_goes_by_pairs():
    vertices = np.stack([MESH.vertices * k for k in (0.5, 1, 2)])
    found = tl.rasterize_poses(vertices, MESH.triangles, SIZE, transform=POSES[:3])
    pairs = zip(vertices, POSES[:3], strict=True)
    alone = [tl.rasterize(own, MESH.triangles, SIZE, transform=pose) for own, pose in pairs]
    assert_same(found, alone)


def test_batch_of_lists_and_of_nothing():
    square = [[0, 0], [4, 0], [0, 4]]
    assert tl.rasterize_poses([square, square], [[0, 1, 2]], 4).triangle.shape == (2, 4, 4)
    nothing = tl.rasterize_poses(np.empty((0, 3, 2)), [[0, 1, 2]], 4)
    assert (len(nothing), nothing.triangle.shape, nothing.barycentric().shape) == (0, (0, 4, 4), (0, 4, 4, 3))


def test_batch_goes_where_it_is_told():
    out = np.empty((5, 18, 24), np.int32), np.empty((5, 18, 24), np.float32)
    found = tl.rasterize_poses(CLIP, MESH.triangles, SIZE, out=out)
    assert found.triangle is out[0]
    assert found.depth is out[1]


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((CLIP, MESH.triangles, SIZE), {"sampling": "area"}, "sampling"),
        ((CLIP[:2, :, :3], MESH.triangles, SIZE), {"transform": POSES}, "must have one number of poses B, got"),
        ((CLIP[..., :1], MESH.triangles, SIZE), {}, "vertices must have shape"),
        ((CLIP, MESH.triangles, SIZE), {"out": (np.empty((18, 24), np.int32), None)}, "out triangle must have shape"),
    ],
)
def test_batch_that_does_not_fit_is_refused(arguments, options, message):
    with pytest.raises(ValueError, match=message):
        tl.rasterize_poses(*arguments, **options)


@pytest.mark.parametrize(
    ("vertices", "transform", "message"),
    [
        (CLIP, None, "rasterize_poses takes .B, V, C."),
        (MESH.vertices, POSES, "rasterize_poses takes .B, 4, 4."),
        (np.zeros((5, 3, 2)), None, r"corners \(T, 3, C\) of triangles are vertices.reshape\(3 \* T, C\), arange"),
    ],
)
def test_rasterize_of_poses_names_the_verb_that_takes_them(vertices, transform, message):
    with pytest.raises(ValueError, match=message):
        tl.rasterize(vertices, MESH.triangles, SIZE, transform=transform)


def test_poses_without_an_axis_are_refused():
    with pytest.raises(ValueError, match="must have one number of poses B, got"):
        tl.rasterize_poses(CLIP[0], MESH.triangles, SIZE)


@pytest.mark.parametrize("threads", [1, 3])
def test_batch_of_samples_is_each_of_them(threads):
    options = {"sampling": "msaa4", "background_depth": 5}
    found = tl.rasterize_poses(CLIP, MESH.triangles, SIZE, threads=threads, **options)
    alone = [tl.rasterize(clip, MESH.triangles, SIZE, **options) for clip in CLIP]
    assert_same(found, alone)
    assert np.array_equal(found.samples_triangle, np.stack([one.samples_triangle for one in alone]))
    assert np.array_equal(found.samples_depth, np.stack([one.samples_depth for one in alone]))
    assert_same(found.sample(2), [one.sample(2) for one in alone])
    out = np.empty((5, 18, 24, 4), np.int32), None
    tl.rasterize_poses(CLIP, MESH.triangles, SIZE, out=out, **options)
    assert np.array_equal(out[0], found.samples_triangle)
    assert tl.rasterize_poses(CLIP[:0], MESH.triangles, SIZE, **options).samples_triangle.shape == (0, 18, 24, 1)


def test_batch_has_derivatives_and_textures():
    found = tl.rasterize_poses(CLIP, MESH.triangles, SIZE)
    alone = [tl.rasterize(clip, MESH.triangles, SIZE) for clip in CLIP]
    uv = np.random.default_rng(1).normal(size=(len(MESH.vertices), 2))
    values, slopes = found.interpolate(uv, derivatives=True)
    assert np.array_equal(values, np.stack([one.interpolate(uv) for one in alone]))
    assert np.array_equal(slopes, np.stack([one.interpolate(uv, derivatives=True)[1] for one in alone]))
    texture = np.random.default_rng(2).normal(size=(8, 8, 3))
    assert np.array_equal(found.sample(texture, uv), np.stack([one.sample(texture, uv) for one in alone]))
    own = np.stack([uv * k for k in range(5)])
    expected = np.stack([one.sample(texture[..., 0], of_one) for one, of_one in zip(alone, own, strict=True)])
    assert np.array_equal(found.sample(texture[..., 0], own), expected)


@pytest.mark.parametrize("dtype", [np.int32, np.int64, np.uint16])
def test_batch_names_the_row_of_a_bad_index(dtype):
    with pytest.raises(IndexError, match=r"row 1 is \[0, 2, 9\]"):
        tl.rasterize_poses(np.zeros((2, 3, 2)), np.array([[0, 1, 2], [0, 2, 9]], dtype), 4)


def test_batch_interpolates_corners_of_each_pose():
    found = tl.rasterize_poses(MESH.vertices, MESH.triangles, SIZE, transform=POSES)
    own = np.random.default_rng(0).random((5, len(MESH.triangles), 3, 2)).astype(np.float32)
    expected = np.stack([found[i].interpolate(own[i]) for i in range(5)])
    assert np.array_equal(found.interpolate(own), expected)
    with pytest.raises(ValueError, match="values must be those of all, or 5 of them, got 4"):
        found.interpolate(own[:4])
