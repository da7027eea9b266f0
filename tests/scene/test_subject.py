"""Whatever is given to be drawn: one `Mesh`, `Scene` or `Points`, for every call that draws."""

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.scene.scene import as_subject, scene_of

MESH = tl.Mesh(*tl.scenes.shape("cube"))
POINTS = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


@pytest.fixture
def cloud_file(tmp_path):
    path = tmp_path / "cloud.ply"
    path.write_text(POINTS + "0 0 0\n1 1 1\n")
    return path


@pytest.mark.parametrize("subject", [MESH, tl.Scene([MESH]), tl.Points([[0, 0, 0]])])
def test_subject_that_is_drawn_stays_as_it_is(subject):
    assert as_subject(subject) is subject


def test_subject_of_arrays_is_a_mesh():
    assert isinstance(as_subject((MESH.vertices, MESH.triangles)), tl.Mesh)


def test_subject_of_a_file_of_points_is_drawn_as_points(cloud_file):
    size, cloud = (32, 24), tl.load(cloud_file)
    assert np.array_equal(tl.render(str(cloud_file), size=size), tl.render(cloud, size=size))
    assert np.array_equal(tl.silhouette(cloud_file, size=size), tl.silhouette(cloud, size=size))
    assert np.array_equal(tl.rasterize_mesh(cloud_file, size=size).id, tl.rasterize_mesh(cloud, size=size).id)
    assert np.array_equal(tl.Camera.framing(cloud_file).view, tl.Camera.framing(cloud).view)


@pytest.mark.parametrize("draw", [tl.as_mesh, tl.render_transparent, tl.visible_layers, lambda path: tl.Scene([path])])
def test_file_of_points_where_triangles_are_needed_is_refused(cloud_file, draw):
    with pytest.raises(TypeError, match=r"mesh must have triangles, got Points\(2, disc of 2 px\) from .*cloud.ply"):
        draw(cloud_file)


def test_scene_of_a_mesh_is_itself_alone():
    assert [instance.mesh for instance in scene_of(MESH)] == [MESH]
    scene = tl.Scene([MESH, MESH])
    assert scene_of(scene) is scene
