"""What pictures keep of meshes and scenes: not with copies, and the same for all threads."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.model import cache as cache_module
from topleft._meshes.model.cache import ByMaterial

COPIES = [copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))]


def drawn(subject):
    tl.render(subject, size=(32, 32))
    return subject


@pytest.mark.parametrize("copied", [*COPIES, replace])
def test_copy_of_drawn_mesh_has_no_cache(copied):
    mesh = drawn(tl.Mesh(*tl.scenes.shape("cube")))
    assert mesh.cache.shading is not None
    assert "cache" not in vars(copied(mesh))


@pytest.mark.parametrize("copied", COPIES)
def test_copy_of_drawn_scene_has_no_cache(copied):
    scene = drawn(tl.Scene([tl.Mesh(*tl.scenes.shape("cube"))] * 2))
    assert scene.cache.sides
    assert "cache" not in vars(copied(scene))


def test_pickled_scene_has_no_caches_of_meshes():
    scene = drawn(tl.Scene([tl.Mesh(*tl.scenes.shape("cube"))] * 2))
    assert "cache" not in vars(pickle.loads(pickle.dumps(scene))[0].mesh)


def test_scene_elsewhere_shares_the_cache():
    scene = drawn(tl.Scene([tl.Mesh(*tl.scenes.shape("cube"))] * 2))
    assert scene.with_transforms(scene.transforms).cache is scene.cache


def test_threads_take_the_value_of_one_of_them():
    values = ByMaterial()
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: values.find(None, object), range(200)))
    assert len(set(map(id, found))) == 1


def test_threads_that_draw_one_fresh_mesh_get_equal_pictures():
    expected = tl.render(tl.Mesh(*tl.scenes.shape("cube")), size=(64, 64))
    mesh = tl.Mesh(*tl.scenes.shape("cube"))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: tl.render(mesh, size=(64, 64), threads=1), range(16)))
    assert all(np.array_equal(picture, expected) for picture in found)


def test_values_beyond_the_limit_replace_those_before(monkeypatch):
    monkeypatch.setattr(cache_module, "MOST_LOOKS", 2)
    values = ByMaterial()
    first = values.find(None, object, 1)
    assert values.find(None, object, 1) is first
    for key in (2, 3):
        values.find(None, object, key)
    assert values.find(None, object, 1) is not first


def test_value_keeps_its_material_alive():
    values = ByMaterial()
    ids = set()
    for k in range(20):  # freed materials would be at one address
        material = tl.Material((k, 0, 0))
        assert values.find(material, lambda k=k: k) == k
        ids.add(id(material))
    assert len(ids) == 20
