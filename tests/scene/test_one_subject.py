"""A mesh is a scene of one instance: the same picture to the bit, whatever is asked for."""

import numpy as np
import picture_cases as cases
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl

N_CASES = 14


def scene_of_one(mesh):
    return tl.Scene([tl.Instance(mesh)])


@ON_EACH_ISA
@pytest.mark.parametrize("seed", range(N_CASES))
def test_picture_of_a_scene_of_one_is_that_of_its_mesh(isa, seed):
    rng = np.random.default_rng(seed)
    mesh, camera = cases.random_mesh(rng), cases.random_camera(rng)
    options = cases.random_look(rng) | cases.random_view(rng)
    with on(isa):
        expected = tl.render(mesh, camera, cases.SIZE, **options)
        assert_same(tl.render(scene_of_one(mesh), camera, cases.SIZE, **options), expected)
        assert_same(tl.render(mesh, camera, cases.SIZE, **options | {"threads": 1}), expected)


LAYERS = ("alpha", "silhouette", "depth", "distance", "ray_distance", "triangle", "instance", "barycentric",
          "world_position", "world_normal", "camera_normal", "uv", "flow")  # fmt: skip


@pytest.mark.parametrize("seed", range(12))
def test_layers_of_a_scene_of_one_are_those_of_its_mesh(seed):
    rng = np.random.default_rng(100 + seed)
    mesh, camera = cases.random_mesh(rng), cases.random_camera(rng)
    view = cases.random_view(rng)
    options = {name: view[name] for name in ("cull", "threads", "subpixel_bits")}
    options |= {
        "layers": ("color", *LAYERS),
        "camera_to": tl.Camera.look_at((0.2, 0.1, 3)),
        "sampling": view["sampling"],
    }
    expected = tl.render_layers(mesh, camera, cases.SIZE, **options)
    found = tl.render_layers(scene_of_one(mesh), camera, cases.SIZE, **options)
    for name in ("color", *LAYERS):
        assert_same(found[name].view(np.uint8), expected[name].view(np.uint8))  # NaN and all


def test_samples_are_cut_off_at_white_before_they_are_averaged():
    """Half of a pixel shows a surface of five times the light of white, the other half black."""
    square = tl.Mesh([[0, -1, 0], [1, -1, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    camera = tl.Camera.orthographic(np.eye(4), near=-1, far=1, height=1)
    look = {"lights": [tl.Light((0, 0, 1), intensity=5.0)], "color": "white", "background": "black"}
    picture = tl.render(square, camera, (1, 1), sampling="msaa4", shading="flat", **look)
    assert picture[0, 0].tolist() == [188, 188, 188, 255]  # half of the light of white
