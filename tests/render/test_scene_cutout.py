"""Holes in scenes, layers and glass: what is behind them shows, whatever instance it belongs to."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same
from layer_views import look
from leaf_cases import CAMERA, LEAF, N_LAYERS, SIZE, cut, layers

import topleft as tl
from topleft._render.holes import cuts_of
from topleft._render.transparent import solid_layers

ORDER = (2, 0, 3, 1)
CLEAR = (0, 0, 0, 0)


def pieces(mesh):
    """The leaves and the wall of `layers`, an instance each."""
    rows = mesh.material_of_triangle[::2]
    return [
        replace(
            mesh,
            triangles=mesh.triangles[2 * k : 2 * k + 2],
            materials=(mesh.materials[row],),
            material_of_triangle=None,
        )
        for k, row in enumerate(rows.tolist())
    ]


MESH = layers(ORDER)
SCENE = tl.Scene(pieces(MESH))


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
@pytest.mark.parametrize("threads", [1, 3])
def test_layers_of_a_scene_are_those_of_one_mesh(sampling, threads):
    names = ("depth", "distance", "silhouette", "alpha", "world_position")
    options = {"sampling": sampling, "threads": threads}
    one, many = (
        tl.render_layers(subject, CAMERA, SIZE, layers=("triangle", "instance", *names), **options)
        for subject in (MESH, SCENE)
    )
    for name in names:
        assert_same(np.nan_to_num(many[name]), np.nan_to_num(one[name]))
    seen = many["triangle"] >= 0
    assert np.unique(many["instance"]).tolist() == [-1, *range(N_LAYERS + 1)]
    assert_same(np.where(seen, 2 * many["instance"] + many["triangle"], -1), one["triangle"])


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_picture_of_a_scene_is_that_of_one_mesh(sampling):
    options = {"shading": "unlit", "sampling": sampling}
    expected = tl.render(MESH, CAMERA, SIZE, **options)
    assert (expected != tl.render(replace(MESH, uv=None), CAMERA, SIZE, **options)).any()
    assert_same(tl.render(SCENE, CAMERA, SIZE, **options), expected)


def test_picture_in_a_batch_is_that_alone():
    (result,) = tl.render_batch([tl.Job(SCENE, CAMERA, SIZE)])
    assert_same(result.picture, tl.render(SCENE, CAMERA, SIZE))


def test_hole_of_a_turned_instance_shows_the_other():
    wall = tl.Mesh([[-9, -9, -1], [9, -9, -1], [9, 9, -1], [-9, 9, -1]], [[0, 1, 2], [0, 2, 3]])
    turn = np.diag([-1.0, 1.0, -1.0, 1.0])  # half a turn: its back is seen
    leaf = pieces(MESH)[1]
    found = look(CAMERA, "instance", subject=tl.Scene([(leaf, turn), wall]))["instance"]
    assert set(np.unique(found[30:40, 35:45])) == {0, 1}
    covered = look(CAMERA, "instance", subject=tl.Scene([(replace(leaf, materials=()), turn), wall]))["instance"]
    assert (covered[30:40, 35:45] == 0).all()


def test_material_of_a_look_cuts_all_instances():
    bare = tl.Scene([replace(instance.mesh, materials=()) for instance in SCENE])
    wall = len(SCENE) - 1
    got = tl.render_layers(bare, CAMERA, SIZE, layers=("color", "instance"), material=LEAF)["instance"]
    expected = tl.render_layers(SCENE, CAMERA, SIZE, layers="instance")["instance"]
    assert (got[expected != wall] == expected[expected != wall]).all()
    assert (got[expected == wall] == -1).any()


def test_cutout_of_a_scene_with_an_edge_at_the_near_plane():
    near = tl.Camera.look_at((0.4, 0.3, 0.55), (0.4, 0.3, -3), near=0.5, far=9, fov_y_deg=120)
    tilt = np.eye(4)
    tilt[2, 0] = 0.9
    moved = [replace(mesh, vertices=mesh.vertices @ tilt[:3, :3].T) for mesh in pieces(MESH)]
    whole = replace(MESH, vertices=MESH.vertices @ tilt[:3, :3].T)
    one, many = (look(near, "depth", subject=subject)["depth"] for subject in (whole, tl.Scene(moved)))
    assert np.isfinite(one).any()
    assert_same(many, one)


# ---- glass ----------------------------------------------------------------------------------------------------------


def expected_layers(n):
    """Every leaf cut by itself, sorted by depth, then id."""
    ids, depth = [], []
    for k, mesh in enumerate(pieces(MESH)):
        frags = cut(mesh)
        ids.append(np.where(frags.mask, frags.triangle + 2 * k, -1))
        depth.append(np.where(frags.mask, frags.depth, np.inf))
    order = np.argsort(depth, axis=0, kind="stable")[:n]
    return np.take_along_axis(np.array(ids), order, 0), np.take_along_axis(np.array(depth), order, 0)


@pytest.mark.parametrize("n", [1, 3, 5])
@pytest.mark.parametrize("threads", [1, 3])
def test_layers_of_glass_are_those_that_are_left(n, threads):
    found = solid_layers(SCENE, CAMERA, SIZE, cuts_of(SCENE, None), layers=n, threads=threads)
    ids, depth = expected_layers(n)
    assert_same(found.planes[0], ids.astype(np.int32))
    assert_same(found.planes[1], depth.astype(np.float32))


@pytest.mark.parametrize("subject", [MESH, SCENE], ids=["mesh", "scene"])
def test_glass_is_as_opaque_as_its_layers(subject):
    picture = tl.render_transparent(subject, CAMERA, SIZE, opacity=0.2, background=CLEAR)  # 51 / 255
    count = (expected_layers(5)[0] >= 0).sum(0)
    assert len(np.unique(count)) > 3
    assert_same(picture[..., 3], np.rint(255 * (1 - 0.8**count)).astype(np.uint8))


def test_glass_of_a_mesh_is_that_of_its_scene():
    options = {"opacity": 0.3, "shading": "unlit"}
    a, b = (tl.render_transparent(subject, CAMERA, SIZE, **options) for subject in (MESH, SCENE))
    assert_same(a, b)
