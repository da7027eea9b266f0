"""`Scene.with_transforms`: the same instances elsewhere."""

import dataclasses
import pickle

import numpy as np
import pytest
from comparing import assert_same

import topleft as tl

SIZE = (64, 48)


def test_scene_with_other_transforms_is_drawn_as_a_new_one_is():
    ball = tl.Mesh(*tl.scenes.icosphere(2))
    scene = tl.Scene([tl.Instance(ball, color="red"), ball])
    places = np.stack([np.eye(4)] * 2)
    places[:, 0, 3] = -1, 2
    camera = tl.Camera.look_at((0, 0, 9))
    moved = scene.with_transforms(places)
    fresh = tl.Scene([tl.Instance(ball, places[0], color="red"), tl.Instance(ball, places[1])])
    assert_same(tl.render(moved, camera, SIZE), tl.render(fresh, camera, SIZE))
    assert moved[0].mesh is ball


def test_moved_scene_has_the_instances_of_its_own_place_when_they_are_asked_for():
    cube, ball = tl.Mesh(*tl.scenes.cube()), tl.Mesh(*tl.scenes.icosphere(0))
    places = np.stack([np.eye(4)] * 2)
    places[1, :3, 3] = 1, 2, 3
    first = tl.Scene([tl.Instance(cube, name="left"), tl.Instance(ball, color="red")])
    moved = first.with_transforms(places * [[[2], [2], [2], [1]]]).with_transforms(places)
    assert repr(moved) == repr(first) == "Scene(2 instances of 2 meshes, 32 triangles)"
    for found in (moved, pickle.loads(pickle.dumps(moved)), dataclasses.replace(moved)):
        assert (len(found), found[0].name, found[1].material.color) == (2, "left", (255, 0, 0))
        assert [one.transform.tolist() for one in found] == places.tolist()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (np.zeros((2, 4, 4)), r"the last row of each of transforms must be \[0, 0, 0, 1\]"),
        (np.diag([1, 1, 0, 1])[None], r"transforms\[0\] must not be singular"),
        (np.eye(4), r"transforms must have shape \(1, 4, 4\), got \(4, 4\)"),
        (np.full((1, 4, 4), np.nan), "transforms must hold finite numbers"),
    ],
)
def test_transforms_of_a_scene_are_checked(change, message):
    n = len(change) if change.ndim == 3 else 1
    scene = tl.Scene([tl.Mesh(*tl.scenes.icosphere(0))] * n)
    with pytest.raises(ValueError, match=message):
        scene.with_transforms(change)


def test_moved_instances_know_whether_they_are_mirrored():
    cube = tl.Mesh(*tl.scenes.cube())
    turns = np.random.default_rng(0).normal(size=(20, 3, 3))
    places = np.tile(np.eye(4), (20, 1, 1))
    places[:, :3, :3] = turns
    places[19, :3, :3] = np.diag([1e-9, -1, 1])  # regular, but not at a glance
    moved = tl.Scene([cube] * 20).with_transforms(places)
    assert [one.is_mirrored for one in moved] == [tl.Instance(cube, place).is_mirrored for place in places]
    assert 0 < sum(one.is_mirrored for one in moved) < 20


def test_sides_that_are_known_of_a_scene_hold_where_it_stands_mirrored():
    """A triangle with one side: seen from the front, from behind, and mirrored both ways."""
    one = tl.Material(double_sided=False)
    triangle = tl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], materials=[one])
    scene = tl.Scene([triangle, (triangle, np.diag([-1, 1, 1, 1]))])
    camera = tl.Camera.look_at((0, 0, 4), (0, 0, 0))
    first = tl.rasterize_mesh(scene, camera, (32, 32)).mask.sum()
    turned = np.stack([np.diag([-1.0, 1, -1, 1]), np.diag([1.0, 1, -1, 1])])
    moved = scene.with_transforms(turned)
    assert tl.rasterize_mesh(moved, camera, (32, 32)).mask.sum() == 0
    swapped = scene.with_transforms([np.diag([-1.0, 1, 1, 1]), np.eye(4)])
    assert tl.rasterize_mesh(swapped, camera, (32, 32)).mask.sum() == first > 0
    assert tl.rasterize_mesh(moved, camera, (32, 32), cull="none").mask.sum() == first
