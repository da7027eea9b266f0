"""Values show themselves in one line; scenes as a table in a notebook."""

import numpy as np
import pytest

import topleft as tl

CUBE = tl.Mesh(*tl.scenes.shape("cube"), materials=[tl.Material("red")])
SCENE = tl.Scene([CUBE, (CUBE, np.diag([2, 2, 2, 1]), "<large>")])


@pytest.mark.parametrize(
    ("value", "line"),
    [
        (CUBE, "Mesh(24 vertices, 12 triangles, 1 material)"),
        (SCENE, "Scene(2 instances of 1 mesh, 24 triangles)"),
        (SCENE[1], "Instance(Mesh(24 vertices, 12 triangles, 1 material), at=(0, 0, 0), name='<large>')"),
        (tl.Camera.look_at((0, 0, 5)), "Camera(eye=(0, 0, 5), forward=(0, 0, -1), fov_y_deg=40)"),
        (tl.Camera.look_at((0, 0, 5), ortho_height=3), "Camera(eye=(0, 0, 5), forward=(0, 0, -1), ortho_height=3)"),
        (tl.Job(CUBE, None, (4, 3), {"cull": "back"}), "Job(Mesh, size=(4, 3), options=cull)"),
        (tl.Job("a.obj", None, (4, 3), {}, "a.png", ("depth",)),
         "Job(a.obj, size=(4, 3), layers=('depth',), destination='a.png')"),
        (tl.Material("red", specular=0.5), "Material(color=(255, 0, 0), specular=0.5)"),
        (tl.Texture(np.zeros((2, 3), np.uint8)), "Texture(3x2, filter='trilinear', wrap='repeat')"),
        (tl.Texture(np.zeros((2, 3), np.uint8), "nearest", ("clamp", "mirror")),
         "Texture(3x2, filter='nearest', wrap='clamp/mirror')"),
        (tl.rasterize_mesh(CUBE, None, (4, 3)), "Fragments(4x3, 12 triangles)"),
    ],
)  # fmt: skip
def test_repr_is_one_line(value, line):
    assert repr(value) == line


def test_results_show_what_came_of_their_jobs():
    jobs = [(CUBE, None, (4, 3)), (CUBE, None, (4, 3), {}, None, ("triangle", "color")), ("gone.obj",)]
    whole, layers, failed = tl.render_batch(jobs, on_error="collect")
    assert repr(whole) == "Result(0, Mesh: picture (3, 4, 4) uint8)"
    assert repr(layers) == "Result(1, Mesh: triangle (3, 4) int32, color (3, 4, 4) uint8)"
    assert repr(failed) == "Result(2, gone.obj: FileNotFoundError: there is no file 'gone.obj')"
    assert (whole.layers, failed.picture, failed.layers) == ({}, None, {})
    assert layers.picture is layers.layers["color"]


def test_scene_is_a_table_in_a_notebook():
    table = SCENE._repr_html_()
    assert table.count("<tr>") == 3
    assert "&lt;large&gt;" in table
    assert "<large>" not in table
