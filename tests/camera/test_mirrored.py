"""Cameras that show the world in a mirror: winding, `cull` and normals follow the sign of the whole way."""

import numpy as np
import pytest

import topleft as tl

SIZE = (48, 36)
BALL = tl.Mesh(*tl.scenes.icosphere(2))
POSE = np.diag([1.0, -1.0, -1.0, 1.0])
POSE[2, 3] = 4.0


def camera(fx=45.0, fy=45.0, flips=(1, 1, 1, 1), **options):
    """A camera by intrinsics; `flips`: the axes of the world that its pose mirrors."""
    return tl.Camera.from_intrinsics([[fx, 0, 23.5], [0, fy, 17.5], [0, 0, 1]], POSE @ np.diag(flips), SIZE, **options)


LENS = {"distortion": (-0.1, 0.02, 0, 0)}
CAMERAS = {
    "plain": camera(),
    "negative fx": camera(fx=-45.0),
    "negative fy": camera(fy=-45.0),
    "both negative": camera(-45.0, -45.0),
    "mirrored view": camera(flips=(1, -1, 1, 1)),
    "negative fx, mirrored view": camera(fx=-45.0, flips=(1, -1, 1, 1)),
    "negative fy, lens": camera(fy=-45.0, **LENS),
    "mirrored view, lens": camera(flips=(-1, 1, 1, 1), **LENS),
    "flipped matrix": tl.Camera.from_matrix(np.diag([1, -1, 1, 1]) @ camera(near=1, far=9).clip_from_world(SIZE)),
    "orthographic": tl.Camera(camera().view, np.diag([-0.5, 0.6, -0.1, 1.0])),
}
PLACES = {"in place": np.eye(4), "mirrored instance": np.diag([1.0, 1.0, -1.0, 1.0])}


@pytest.fixture(params=CAMERAS)
def seen_by(request):
    return CAMERAS[request.param]


@pytest.fixture(params=PLACES)
def scene(request):
    return tl.Scene([(BALL, PLACES[request.param])])


def test_normals_of_a_mirrored_picture_point_outwards(seen_by, scene):
    layers = tl.render_layers(scene, seen_by, SIZE, layers=("world_normal", "world_position"))
    hit = np.isfinite(layers["world_position"][..., 0])
    assert hit.sum() > 100
    assert (layers["world_position"][hit] * layers["world_normal"][hit]).sum(axis=1).min() > 0.9


def test_cull_back_of_a_mirrored_picture_leaves_the_front(seen_by, scene):
    whole = tl.rasterize_mesh(scene, seen_by, SIZE, cull="none")
    assert np.array_equal(tl.rasterize_mesh(scene, seen_by, SIZE, cull="back").triangle, whole.triangle)
    assert not np.isin(tl.rasterize_mesh(scene, seen_by, SIZE, cull="front").triangle, whole.triangle[whole.mask]).any()


@pytest.mark.parametrize("shading", ["normals", "flat", "smooth"])
def test_render_of_a_negative_focal_length_is_the_picture_turned_over(shading):
    plain = tl.render(BALL, camera(), SIZE, shading=shading)
    for over, axis in ((camera(fx=-45.0), 1), (camera(fy=-45.0), 0)):
        found = np.flip(tl.render(BALL, over, SIZE, shading=shading), axis)
        assert np.mean(np.abs(found.astype(int) - plain) > 1) < 0.02  # ties of edges lie on the other side


def test_render_keeps_no_side_of_another_camera():
    single = tl.Mesh(BALL.vertices, BALL.triangles, materials=[tl.Material(double_sided=False)])
    for over in (camera(), camera(fx=-45.0), camera()):
        assert tl.render(single, over, SIZE)[18, 24, 0] > 100


def test_edges_of_single_sided_triangles_in_a_mirror_are_those_of_the_front():
    single = tl.Mesh(BALL.vertices, BALL.triangles, materials=[tl.Material(double_sided=False)])
    plain, over = (tl.render(single, one, SIZE, edges=True)[..., 3] for one in (camera(), camera(fx=-45.0)))
    assert np.abs(plain[:, ::-1].astype(int) - over).max() <= 1  # of 255: lines are anti-aliased
