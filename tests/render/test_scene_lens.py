"""Scenes through a lens: the nearest of the instances, each as it is seen through it alone."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same
from layer_views import CAMERAS, CUBE, FRONT, LENSES, SIZE, SNAP_PX, SPHERE, look, pierced, pixels, scene

import topleft as tl
from topleft._core.base.options import LAYER_NAMES

ON_EACH_LENS = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
STRAIGHT = CAMERAS["off-centre"]


@ON_EACH_LENS
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_scene_shows_the_nearest_of_its_instances(lens, sampling):
    subject, camera = scene(), replace(STRAIGHT, lens=lens)
    alone = [tl.rasterize_mesh(i.mesh, camera.placed(i.transform), SIZE, sampling=sampling) for i in subject]
    depth = np.array([frags.samples_depth for frags in alone])
    nearest = depth.argmin(0)
    seen = np.isfinite(depth.min(0))
    found = tl.rasterize_mesh(subject, camera, SIZE, sampling=sampling)
    assert_same(found.samples_depth, depth.min(0))
    assert_same(found.samples_instance, np.where(seen, nearest, -1).astype(np.int32))
    ids = np.take_along_axis(np.array([frags.samples_triangle for frags in alone]), nearest[None], 0)[0]
    assert_same(found.samples_triangle, ids)
    assert np.unique(found.instance).tolist() == [-1, 0, 1, 2]
    weights = np.choose(np.maximum(found.instance, 0)[..., None], [frags.barycentric() for frags in alone])
    assert_same(found.barycentric(), weights)
    assert repr(found) == f"SceneFragments(80x60, 3 instances, {subject.n_triangles} triangles)"


@ON_EACH_LENS
def test_scene_of_one_is_the_mesh(lens):
    camera, one = replace(STRAIGHT, lens=lens), tl.Scene([SPHERE])
    names = [name for name in LAYER_NAMES if name != "uv"]
    a, b = (look(camera, *names, subject=subject, camera_to=CAMERAS["perspective"]) for subject in (SPHERE, one))
    for name in names:
        assert_same(np.nan_to_num(b[name]), np.nan_to_num(a[name]))
    for options in ({"edges": True}, {"shading": "ids"}, {"shading": "depth"}, {"cull": "back"}):
        assert_same(tl.render(one, camera, SIZE, **options), tl.render(SPHERE, camera, SIZE, **options))
    smooth = [tl.render(subject, camera, SIZE, sampling="msaa4").astype(int) for subject in (one, SPHERE)]
    assert np.abs(smooth[0] - smooth[1]).max() <= 1  # scenes round the light of samples before the mean
    for sampling in ("center", "msaa4", "area"):
        got, expected = (tl.silhouette(s, camera, SIZE, sampling=sampling, cull="back") for s in (one, SPHERE))
        assert_same(got, expected)


@ON_EACH_LENS
def test_points_of_a_scene_project_to_their_pixels(lens):
    camera = replace(STRAIGHT, lens=lens)
    found = look(camera, "world_position", "silhouette", "instance")
    seen = found["silhouette"]
    assert np.unique(found["instance"]).tolist() == [-1, 0, 1, 2]
    off_centre = camera.project(found["world_position"][seen].astype(float), SIZE)[:, :2] - np.stack(pixels(seen), -1)
    assert np.abs(off_centre).max() <= lens.tolerance_px + SNAP_PX + 1e-4  # 1e-4: float32 of a point


@pytest.mark.parametrize("cull", ["none", "back", "front"])
def test_lens_that_bends_nothing_shows_what_no_lens_shows(cull):
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirrored[:3, 3] = 1.2, 0.3, -0.4
    subject = tl.Scene([(CUBE, mirrored), SPHERE])
    a, b = (
        look(camera, "triangle", "instance", "camera_normal", subject=subject, cull=cull)
        for camera in (STRAIGHT, replace(STRAIGHT, lens=tl.OpenCVLens()))
    )
    assert set(np.unique(a["instance"])) == {-1, 0, 1}
    same = (a["triangle"] == b["triangle"]) & (a["instance"] == b["instance"])
    assert same.mean() > 0.99  # vertices between the corners are snapped, too
    assert np.abs(a["camera_normal"] - b["camera_normal"])[same].max() <= 1e-3  # where the snap moved the corners


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_holes_of_a_scene_through_a_lens_are_those_of_the_mesh(sampling):
    mesh, camera = pierced(), replace(FRONT, lens=LENSES["barrel"])
    near, wall = (
        replace(mesh, triangles=mesh.triangles[2 * k : 2 * k + 2], materials=(own,), material_of_triangle=None)
        for k, own in enumerate(mesh.materials)
    )
    both = tl.Scene([near, wall])
    one, two = (look(camera, "depth", "instance", "alpha", subject=s, sampling=sampling) for s in (mesh, both))
    assert_same(two["depth"], one["depth"])
    assert_same(two["alpha"], one["alpha"])
    assert (two["instance"][30, 40], two["instance"][30, 29]) == (1, 0)
    options = {"shading": "unlit", "sampling": sampling}
    assert_same(tl.render(both, camera, SIZE, **options), tl.render(mesh, camera, SIZE, **options))


def test_picture_through_a_lens_in_a_batch_is_that_alone():
    camera = replace(STRAIGHT, lens=LENSES["fisheye"])
    (result,) = tl.render_batch([tl.Job(scene(), camera, SIZE)])
    assert_same(result.picture, tl.render(scene(), camera, SIZE))


def test_window_of_a_scene_through_a_lens_is_a_crop():
    camera = replace(STRAIGHT, lens=LENSES["barrel"])
    whole = tl.rasterize_mesh(scene(), camera, SIZE)
    part = tl.rasterize_mesh(scene(), camera, (30, 20), origin=(25, 15), viewport=SIZE)
    assert_same(part.id, whole.id[15:35, 25:55])
    assert_same(part.depth, whole.depth[15:35, 25:55])


def test_instance_that_the_lens_does_not_see_shows_nothing():
    behind = np.eye(4)
    behind[:3, 3] = 0, 0, 30
    camera = replace(FRONT, lens=LENSES["barrel"])
    alone, both = (tl.rasterize_mesh(tl.Scene(i), camera, SIZE) for i in ([CUBE], [(CUBE, behind), CUBE]))
    assert_same(both.depth, alone.depth)
    assert np.unique(both.instance).tolist() == [-1, 1]
