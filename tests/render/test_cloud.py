"""Clouds of points through the verbs of meshes: pictures, buffers, layers, batches."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import assert_same_everywhere

import topleft as tl
from topleft._core.base.color import srgb_tables

SIZE = (64, 48)
RNG = np.random.default_rng(11)
POSITIONS = RNG.normal(size=(400, 3))
COLORS = RNG.integers(0, 256, (400, 3), dtype=np.uint8)
CLOUD = tl.Points(POSITIONS, COLORS, POSITIONS, size=5)
CAMERA = tl.Camera.framing(CLOUD, aspect=64 / 48)
POSE = CAMERA.view * [[1], [-1], [-1], [1]]
LENS = tl.Camera.from_intrinsics([[60, 0, 32], [0, 60, 24], [0, 0, 1]], POSE, SIZE, distortion=[0.1, 0, 0, 0])


def test_the_buffer_of_a_cloud_is_that_of_its_projected_points():
    found = tl.rasterize_mesh(CLOUD, CAMERA, SIZE)
    expected = tl.points(CAMERA.project(POSITIONS, SIZE), SIZE, point_size=5, shape="disc")

    assert_same(found.point, expected.point)
    assert np.abs(found.depth[found.mask] - expected.depth[found.mask]).max() < 1e-6


def test_a_cloud_through_a_lens_stands_where_its_points_are_projected_to():
    found = tl.rasterize_mesh(CLOUD, LENS, SIZE)
    places = LENS.project(POSITIONS, SIZE)
    in_front = (POSITIONS @ LENS.view[2, :3] + LENS.view[2, 3]) < 0
    expected = tl.points(places[in_front], SIZE, point_size=5, shape="disc")

    assert found.mask.any()
    assert_same(found.point[found.mask], np.flatnonzero(in_front)[expected.point[expected.mask]].astype(np.int32))


def test_sizes_of_the_world_are_as_large_as_what_stands_there():
    for camera in (CAMERA, tl.Camera.framing(CLOUD, ortho=True)):
        cloud = tl.Points([[0.2, 0.1, 0]], size=0.5, unit="world", shape="square")
        size = (1200, 1200)
        rows = np.flatnonzero(tl.silhouette(cloud, camera, size).any(axis=1))
        up = camera.view[1, :3]
        ends = np.array([0.2, 0.1, 0]) + np.outer([-0.25, 0.25], up)
        (_, low, _), (_, high, _) = camera.project(ends, size)
        assert abs(len(rows) - abs(high - low)) <= 1


def test_points_without_normals_show_their_colours():
    picture = tl.render(replace(CLOUD, normals=None), CAMERA, SIZE)
    frags = tl.rasterize_mesh(CLOUD, CAMERA, SIZE)

    assert_same(picture[frags.mask][:, :3], COLORS[frags.point[frags.mask]])
    assert (picture[~frags.mask] == 255).all()
    assert_same(tl.render(CLOUD, CAMERA, SIZE, shading="unlit"), picture)


@pytest.mark.parametrize("space", ["eye", "world"])
@pytest.mark.parametrize("kind", ["directional", "point", "spot"])
def test_points_with_normals_are_lit_as_a_mesh_is(kind, space):
    """A sphere of points against one of triangles, whose pixels show the same normals."""
    vertices, triangles = tl.scenes.icosphere(5)
    mesh = tl.Mesh(vertices, triangles, vertices)
    cloud = tl.Points(vertices, normals=vertices, size=4)
    camera = tl.Camera.framing(mesh)
    cone = {"direction": (-1, -2.2, -3), "inner_deg": 5, "outer_deg": 20} if kind == "spot" else {}
    looks = [
        {},
        {"lights": [tl.Light((1, 2, 3), kind, (255, 200, 90), 0.9, 0.01, space, **cone)], "ambient": 0.1},
        {"fog": tl.Fog(2, 5, (10, 20, 90))},
    ]
    for look in looks:
        found, expected = (tl.render(own, camera, (96, 96), **look).astype(int) for own in (cloud, mesh))
        inside = np.hypot(*(np.indices((96, 96)) - 47.5)) < 38
        assert np.abs(found - expected)[inside].mean() < 2.5


def test_samples_of_a_cloud_are_averaged_as_light():
    cloud = replace(CLOUD, normals=None)
    picture = tl.render(cloud, CAMERA, SIZE, sampling="msaa4")
    frags = tl.rasterize_mesh(cloud, CAMERA, SIZE, sampling="msaa4")
    decode, encode = srgb_tables()
    colors = np.vstack([COLORS, [255, 255, 255]])[frags.samples_triangle]
    assert_same(picture[..., :3], encode[np.rint(decode[colors].mean(axis=2)).astype(int)])


def test_pictures_of_a_cloud_have_the_same_bits_everywhere():
    assert_same_everywhere(lambda size, **view: [tl.render(CLOUD, CAMERA, size, sampling="msaa4", **view)], SIZE)


def test_layers_of_a_cloud_are_those_of_its_points():
    names = ("color", "alpha", "silhouette", "depth", "distance", "ray_distance", "triangle", "instance")
    more = ("world_position", "world_normal", "camera_normal", "flow")
    attributes = {"number": np.arange(400)}
    moved = np.eye(4)
    moved[0, 3] = 0.1
    found = tl.render_layers(
        CLOUD, CAMERA, SIZE, layers=names + more, attributes=attributes, transforms_to=moved, sampling="center"
    )
    frags = tl.rasterize_mesh(CLOUD, CAMERA, SIZE)
    seen, ids = frags.mask, frags.point[frags.mask]
    eye = POSITIONS @ CAMERA.view[:3, :3].T + CAMERA.view[:3, 3]

    assert_same(found["triangle"], frags.point)
    assert_same(found["silhouette"], seen)
    assert_same(found["alpha"], np.where(seen, 255, 0).astype(np.uint8))
    assert_same(found["color"], tl.render(CLOUD, CAMERA, SIZE))
    assert_same(found["number"][seen], ids.astype(np.float32))
    assert_same(found["world_position"][seen], POSITIONS[ids].astype(np.float32))
    assert np.allclose(found["distance"][seen], -eye[ids, 2])
    assert np.allclose(found["ray_distance"][seen], np.linalg.norm(eye[ids], axis=1))
    normals = POSITIONS / np.linalg.norm(POSITIONS, axis=1, keepdims=True)
    to_eye = CAMERA.view[:3, :3].T @ -CAMERA.view[:3, 3] - POSITIONS
    turned = normals * np.where((normals * to_eye).sum(axis=1) < 0, -1, 1)[:, None]
    assert np.allclose(found["world_normal"][seen], turned[ids], atol=1e-6)
    assert np.allclose(found["camera_normal"][seen], (turned @ CAMERA.view[:3, :3].T)[ids], atol=1e-6)
    way = CAMERA.project(POSITIONS + [0.1, 0, 0], SIZE) - CAMERA.project(POSITIONS, SIZE)
    assert np.allclose(found["flow"][seen], way[ids, :2], atol=1e-4)


@pytest.mark.parametrize("layer", ["barycentric", "uv"])
def test_layers_that_points_do_not_have_are_refused(layer):
    with pytest.raises(ValueError, match=f"points have no layer '{layer}'; they have color, alpha"):
        tl.render_layers(CLOUD, CAMERA, SIZE, layers=layer)


def test_a_silhouette_with_samples_is_their_share():
    share = tl.silhouette(CLOUD, CAMERA, SIZE, sampling="msaa4")
    frags = tl.rasterize_mesh(CLOUD, CAMERA, SIZE, sampling="msaa4")
    out = np.empty(SIZE[::-1], np.float32)

    assert_same(share, (frags.samples_triangle >= 0).mean(axis=-1, dtype=np.float32))
    assert tl.silhouette(CLOUD, CAMERA, SIZE, sampling="msaa4", out=out) is out
    assert_same(out, share)


def test_a_batch_draws_clouds():
    expected = tl.render(CLOUD, CAMERA, SIZE)
    for result in tl.render_batch([tl.Job(CLOUD, CAMERA, SIZE), tl.Job(lambda: CLOUD, CAMERA, SIZE)]):
        assert_same(result.picture, expected)


def test_a_cloud_is_framed_by_its_points_and_can_be_pickled():
    assert_same(tl.Camera.framing(CLOUD).view, tl.Camera.framing(POSITIONS).view)
    assert_same(pickle.loads(pickle.dumps(CLOUD)).positions, CLOUD.positions)
    assert CLOUD.bounds.tolist() == [POSITIONS.min(axis=0).tolist(), POSITIONS.max(axis=0).tolist()]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"edges": True}, "points have no edges"),
        ({"cull": "back"}, "points have no side to cull"),
        ({"material": tl.Material((1, 2, 3))}, "points have colours of their own: they take neither a material"),
        ({"sampling": "area"}, "sampling 'area' gives no ids"),
    ],
)
def test_options_that_points_do_not_have_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        tl.render(CLOUD, CAMERA, SIZE, **options)


def test_normals_of_points_that_have_none_are_refused():
    with pytest.raises(ValueError, match="shading 'normals' needs points that have normals"):
        tl.render(replace(CLOUD, normals=None), CAMERA, SIZE, shading="normals")
    with pytest.raises(ValueError, match="normals need points that have them"):
        tl.render_layers(replace(CLOUD, normals=None), CAMERA, SIZE, layers="world_normal")


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (([[0, 0]],), ValueError, r"positions must have shape \(V, 3\), got \(1, 2\)"),
        (([[0, 0, np.inf]],), ValueError, r"positions\[0\] = \[0.0, 0.0, inf\] must be finite"),
        (([[0, 0, 0]], [[1.0, 2, 3]]), TypeError, "colors must be uint8, got float64"),
        (([[0, 0, 0]], None, [[1, 2, 3]] * 2), ValueError, r"normals must have shape \(1, 3\), got \(2, 3\)"),
        (([[0, 0, 0]], None, None, 0), ValueError, "size must be finite and positive, got 0"),
        (([[0, 0, 0]], None, None, [1, 2]), ValueError, r"size must be one number or have shape \(1,\), got \(2,\)"),
        (([[0, 0, 0]], None, None, "big"), TypeError, "size must hold real numbers"),
        (([[0, 0, 0]], None, None, 1, "mm"), ValueError, "unit must be one of 'px', 'world', got 'mm'"),
        (([[0, 0, 0]], None, None, 1, "px", "star"), ValueError, "shape must be one of 'disc', 'square', got 'star'"),
    ],
)
def test_points_that_are_none_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        tl.Points(*arguments)


def test_no_points_have_no_bounds():
    with pytest.raises(ValueError, match="a cloud without points has no bounds"):
        tl.Points(np.empty((0, 3))).bounds  # noqa: B018
