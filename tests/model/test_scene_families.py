"""Families of scenes: each is what its name says."""

import numpy as np
import pytest
from engine_cases import one_by_one

from topleft.scene_families import FAMILIES, HUBS


@pytest.mark.parametrize("name", [name for name in HUBS if name.startswith("2^-")])
def test_hub_beside_the_centre_is_off_by_the_power_of_two_in_its_name(name):
    exponent = int(name.removeprefix("2^").removesuffix(" off"))
    assert HUBS[name] == (0.5 + 2.0**exponent, 0.5)


@pytest.mark.parametrize("name", [name for name in HUBS if name.endswith(" px")])
def test_hub_outside_lies_left_of_the_frame_by_the_distance_in_its_name(name):
    assert HUBS[name] == (-float(name.removesuffix(" px")), 0)


@one_by_one("hub", HUBS)
def test_fan_has_as_many_triangles_as_it_says(hub):
    assert len(FAMILIES["hub"].make(HUBS[hub], 0).triangles) == 32
    for n in (4, 64):
        assert len(FAMILIES["fan-hub"].make(n, HUBS[hub], 0).triangles) == n


@pytest.mark.parametrize("name", FAMILIES["fan"].axes[0].values)
def test_fan_in_the_frame_has_as_many_triangles_as_its_name(name):
    assert len(FAMILIES["fan"].make(FAMILIES["fan"].axes[0].values[name], 1).triangles) == int(name)


@pytest.mark.parametrize("seed", range(3))
@one_by_one("name", FAMILIES)
def test_triangles_of_a_family_turn_one_way(name, seed):
    family = FAMILIES[name]
    scene = family.make(*(next(iter(axis.values.values())) for axis in family.axes), seed)
    a, b, c = np.moveaxis(scene.vertices[scene.triangles] - scene.vertices.mean(axis=0), 1, 0)
    areas = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (areas < 0 if name == "edge" else areas > 0).all()
