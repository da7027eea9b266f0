"""Stretched copies of a mesh: kept while it turns, few of them, beside the mesh itself."""

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.picture import look

BALL = tl.scenes.icosphere(2)
CAMERA = tl.Camera.look_at((0, 1, 6))


def scene_of(mesh, *scales, degrees=0.0):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    places = []
    for k, scale in enumerate(scales):
        place = np.eye(4)
        place[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.diag(scale)
        place[0, 3] = 2.5 * k - 1.2
        places.append(place)
    return tl.Scene([(mesh, place) for place in places])


def stretched_copies(mesh):
    return list(mesh.cache.stretched.values())


def test_stretched_mesh_is_kept_while_it_turns():
    mesh = tl.Mesh(*BALL)
    tl.render(scene_of(mesh, (1, 0.5, 0.3)), CAMERA, (32, 32))
    (first,) = stretched_copies(mesh)
    tl.render(scene_of(mesh, (1, 0.5, 0.3), degrees=37), CAMERA, (32, 32))
    assert stretched_copies(mesh) == [first]


def test_stretched_mesh_beyond_the_limit_leaves_the_mesh_itself(monkeypatch):
    monkeypatch.setattr(look, "MOST_STRETCHED", 0)
    mesh = tl.Mesh(*BALL)
    tl.render(scene_of(mesh, (1, 1, 1)), CAMERA, (32, 32))
    own = mesh.cache.shading
    tl.render(scene_of(mesh, (1, 0.5, 0.3), (1, 0.5, 0.4)), CAMERA, (32, 32))
    assert len(stretched_copies(mesh)) == 1
    assert mesh.cache.shading is own


@pytest.mark.parametrize("scale", [(1, 0.5, 0.3), (-1, 1, 1), (1, 1e-3, 1)])
def test_stretched_instance_is_lit_as_its_mesh_in_the_world(scale):
    scene = scene_of(tl.Mesh(*BALL), scale, degrees=20)
    place, points = scene[0].transform, BALL[0] @ scene[0].transform[:3, :3].T
    normals = tl.Mesh(*BALL).vertex_normals() @ np.linalg.inv(place[:3, :3])
    triangles = BALL[1] if scale[0] > 0 else BALL[1][:, ::-1]
    moved = tl.Mesh(points + place[:3, 3], triangles, normals)
    look_of = {"lights": [tl.Light((1, 2, 3)), tl.Light((0, 1, 2), kind="point", falloff=0.2)], "ambient": 0.1}
    found, expected = (tl.render(one, CAMERA, (96, 96), **look_of).astype(int) for one in (scene, moved))
    # float32 light, and outlines that another order of products snaps elsewhere
    assert (abs(found - expected).max(axis=2) > 1).sum() <= 4
