"""A mesh is a scene of one instance: the same picture to the bit, whatever is asked for."""

import numpy as np
import picture_cases as cases
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl

N_CASES = 24


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
