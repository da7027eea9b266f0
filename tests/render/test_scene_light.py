"""Light on scenes: instances look like the mesh that has been moved to where they stand."""

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.model.normals import unit_or_zero

SIZE = (96, 80)
CAMERA = tl.Camera.look_at((2, 3, 6), fov_y_deg=35)
TURN = np.array([[0, 0, 1], [0.6, 0.8, 0], [-0.8, 0.6, 0]])
POINT = tl.Light((-1, 1.5, 2), "point", (255, 200, 120), 2.0, falloff=0.5)
LIGHTS = {
    "direction": tl.Light((1, 2, 1)),
    "point": POINT,
    "eye direction": tl.Light((1, 0, 1), space="eye"),
    "spot": tl.Light((-1, 1.5, 2), "spot", falloff=0.2, direction=(0.4, -0.5, -1), inner_deg=3, outer_deg=20),
    "eye spot": tl.Light((0.5, 1, 0), "spot", direction=(0, -0.1, -1), outer_deg=12, space="eye"),
    "eye point": tl.Light((1, 2, -2), "point", falloff=0.1, space="eye"),
}
SCALES = {"as it is": (1, 1, 1), "smaller": (0.7, 0.7, 0.7), "mirrored": (-0.8, 0.8, 0.8), "stretched": (1.2, 0.5, 0.8)}


def stood(scale):
    matrix = np.eye(4)
    matrix[:3, :3] = TURN * scale
    matrix[:3, 3] = 0.3, -0.2, 0.4
    return matrix


def bowl(**material):
    """Half a torus, of which both sides are seen."""
    vertices, triangles = tl.scenes.shape("torus", segments=48, sections=24)
    is_kept = vertices[triangles][..., 2].max(axis=1) < 0.2
    return tl.Mesh(vertices, triangles[is_kept], materials=[tl.Material((200, 170, 150), **material)])


def moved(mesh, matrix):
    """The mesh where the matrix puts it, outside outside."""
    linear = matrix[:3, :3]
    triangles = mesh.triangles[:, ::-1] if np.linalg.det(linear) < 0 else mesh.triangles
    normals = unit_or_zero(mesh.vertex_normals() @ np.linalg.inv(linear))
    return tl.Mesh(mesh.vertices @ linear.T + matrix[:3, 3], triangles, normals, materials=mesh.materials)


def assert_looks_like_the_moved_mesh(mesh, scale, **options):
    matrix = stood(scale)
    got = tl.render(tl.Scene([(mesh, matrix)]), CAMERA, SIZE, **options)
    expected = tl.render(moved(mesh, matrix), CAMERA, SIZE, **options)
    ids = (tl.rasterize_mesh(one, CAMERA, SIZE).triangle for one in (tl.Scene([(mesh, matrix)]), moved(mesh, matrix)))
    is_same = np.equal(*ids)  # a corner may be snapped to a neighbour, for the matrix is multiplied in another order
    assert is_same.mean() > 0.999
    assert np.abs(got.astype(int) - expected)[is_same].max() <= 1  # float32 in another space


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_scene_lights_stand_in_the_world(light, scale):
    assert_looks_like_the_moved_mesh(bowl(specular=0.5), scale, lights=[light])


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
def test_scene_back_has_its_colour(scale):
    assert_looks_like_the_moved_mesh(bowl(back_color=(60, 200, 90)), scale)


def test_scene_light_without_a_transform_keeps_every_bit():
    mesh = bowl(specular=0.5)
    got = tl.render(tl.Scene([mesh]), CAMERA, SIZE, lights=[*LIGHTS.values()])
    assert np.array_equal(got, tl.render(mesh, CAMERA, SIZE, lights=[*LIGHTS.values()]))


def test_mesh_seen_in_a_mirror_keeps_its_back():
    mesh, mirror = bowl(back_color=(60, 200, 90)), np.diag([-1.0, 1, 1, 1])
    camera = tl.Camera(CAMERA.view @ mirror, CAMERA.projection, CAMERA.aspect)
    expected = tl.render(moved(mesh, mirror), CAMERA, SIZE)
    assert np.abs(tl.render(mesh, camera, SIZE).astype(int) - expected).max() <= 1  # float32 in another space
