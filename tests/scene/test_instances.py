"""Instances are projected together: the picture of a scene is that of its meshes, each drawn alone by arrays."""

from dataclasses import replace

import numpy as np
import picture_cases as cases
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on, one_by_one

import topleft as tl
from topleft._core import engine
from topleft._meshes.picture import draw_scene
from topleft._meshes.picture.placed import Placed

TURNED = {"none": "none", "back": "front", "front": "back"}


def random_transform(rng):
    """One that may mirror; some bring the mesh before the near plane, some beyond 2**30 sub-pixels."""
    matrix = np.eye(4)
    matrix[:3, :3] = rng.normal(size=(3, 3)) * float(rng.choice([0.3, 1.0, 1e7], p=[0.5, 0.4, 0.1]))
    matrix[:3, 3] = rng.uniform(-2, 2, 3)
    return matrix


def random_scene(rng):
    meshes = [tl.Mesh(np.zeros((3, 3)), np.empty((0, 3), np.int32))]
    for dtype in (np.float32, np.float64, np.float32):
        vertices, triangles = tl.scenes.shape(str(rng.choice(cases.SHAPES)))
        meshes.append(tl.Mesh(vertices.astype(dtype), triangles))
    return tl.Scene([tl.Instance(meshes[rng.integers(4)], random_transform(rng)) for _ in range(rng.integers(2, 12))])


def drawn_one_by_one(scene, camera, cull, **options):
    """Ids and depths (H, W, S) of all instances, each drawn by `rasterize`."""
    ids = depth = None
    for instance, first in zip(scene, scene.first_ids.tolist(), strict=False):
        own = TURNED[cull] if np.linalg.det(instance.transform[:3, :3]) < 0 else cull
        transform = engine.product(camera.clip_from_world(cases.SIZE), instance.transform)
        mesh = instance.mesh
        frags = tl.rasterize(mesh.vertices, mesh.triangles, cases.SIZE, transform=transform, cull=own, **options)
        if ids is None:
            ids, depth = np.full(frags.samples_triangle.shape, -1, np.int32), np.full_like(frags.samples_depth, np.inf)
        is_nearer = frags.samples_depth < depth
        depth = np.where(is_nearer, frags.samples_depth, depth)
        ids = np.where(is_nearer, frags.samples_triangle + first, ids)
    return ids, depth


@ON_EACH_ISA
@one_by_one("seed", range(20))
def test_scene_is_drawn_as_its_instances_alone(isa, seed, monkeypatch):
    monkeypatch.setattr(draw_scene, "FIRST_ROUND", 2)
    rng = np.random.default_rng(seed)
    scene, camera = random_scene(rng), cases.random_camera(rng, lens=0)
    options = {
        "subpixel_bits": [8, "exact", 2, 8][seed % 4],
        "sampling": str(rng.choice(["center", "msaa4"])),
        "threads": int(rng.integers(1, 4)),
    }
    cull = str(rng.choice(["none", "back", "front"]))
    with on(isa):
        ids, depth = drawn_one_by_one(scene, camera, cull, **options)
        frags = tl.rasterize_mesh(scene, camera, cases.SIZE, cull=cull, **options)
    assert_same(np.asarray(frags.samples_id), ids)
    assert_same(np.asarray(frags.samples_depth), depth)


def placed(x, y, z, sides=(1, 1, 1)):
    matrix = np.diag([*sides, 1.0])
    matrix[:3, 3] = x, y, z
    return matrix


def wall_before_balls():
    """A wall with balls behind and before it, one beside it, some out of view, and a wall that reaches the eye.

    A plane cuts that one, so that the scene is not drawn as one mesh.
    """
    wall, ball = (tl.Mesh(*tl.scenes.shape("cube")), tl.Mesh(*tl.scenes.icosphere(2)))
    places = [(0, 0, -9 - i) for i in range(6)] + [(0, 0, 2), (5, 0, -9), (0, 50, 0), (0, 0, 90), (-70, 0, 0)]
    walls = [(wall, placed(0, 0, 0, (1.5, 1.5, 0.1))), (wall, placed(2, 0, 8, (0.1, 9, 9)))]
    return tl.Scene([*((ball, placed(*place)) for place in places), *walls])


@pytest.mark.parametrize("depth_test", ["less", "greater", None])
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_instances_that_cannot_show_are_not_snapped(depth_test, sampling, monkeypatch):
    monkeypatch.setattr(draw_scene, "FIRST_ROUND", 2)
    snapped = []
    snap_all = Placed.snap_all
    monkeypatch.setattr(Placed, "snap_all",
                        lambda self, some: snapped.extend(some.tolist()) or snap_all(self, some))  # fmt: skip
    camera, size = tl.Camera.look_at((0, 0, 8)), (64, 64)
    options = {"sampling": sampling, "depth_test": depth_test}
    frags = tl.rasterize_mesh(wall_before_balls(), camera, size, **options)
    n_drawn = {"less": 4, "greater": 10, None: 13}[depth_test]
    assert len(snapped) == n_drawn
    monkeypatch.setattr(draw_scene, "find_shown", lambda scene, some, *_, **__: some)
    whole = tl.rasterize_mesh(wall_before_balls(), camera, size, **options)
    assert len(snapped) == n_drawn + 13
    assert_same(np.asarray(frags.samples_id), np.asarray(whole.samples_id))
    assert_same(np.asarray(frags.samples_depth), np.asarray(whole.samples_depth))


@pytest.mark.parametrize("seed", range(16))
def test_material_of_an_instance_is_as_good_as_one_of_its_mesh(seed):
    """Whatever it does: colours, textures, holes, glass, backs that are culled, in each sampling."""
    rng = np.random.default_rng(seed)
    meshes, camera = [cases.random_mesh(rng) for _ in range(2)], cases.random_camera(rng)
    materials = [cases.random_material(rng), tl.Material("orange"), None]
    given, baked = [], []
    for _ in range(5):
        mesh, material, place = meshes[rng.integers(2)], materials[rng.integers(3)], np.eye(4)
        place[:3, :3] *= rng.uniform(0.2, 0.6, 3) * rng.choice([-1, 1], 3)
        place[:3, 3] = rng.uniform(-0.8, 0.8, 3)
        own = mesh if material is None else replace(mesh, materials=(material,), material_of_triangle=None)
        given.append(tl.Instance(mesh, place, material=material))
        baked.append(tl.Instance(own, place))
    options = cases.random_look(rng) | cases.random_view(rng)
    expected = tl.render(tl.Scene(baked), camera, cases.SIZE, **options)
    assert_same(tl.render(tl.Scene(given), camera, cases.SIZE, **options), expected)
    layers = tl.render_transparent(tl.Scene(baked), camera, cases.SIZE) if camera.lens is None else None
    if layers is not None:
        assert_same(tl.render_transparent(tl.Scene(given), camera, cases.SIZE), layers)


def test_color_of_an_instance_is_short_for_a_material():
    cube, aside = tl.Mesh(*tl.scenes.cube()), np.eye(4)
    aside[0, 3] = 3
    scene = tl.Scene([tl.Instance(cube, color="red"), tl.Instance(cube, aside, color=(0, 128, 0)), tl.Instance(cube)])
    assert [one.material and one.material.color for one in scene] == [(255, 0, 0), (0, 128, 0), None]
    picture = tl.render(scene, tl.Camera.framing(scene), (64, 32), shading="unlit")
    assert {tuple(color) for color in picture.reshape(-1, 4)[:, :3].tolist()} >= {(255, 0, 0), (0, 128, 0)}


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"color": "red", "material": tl.Material()}, ValueError, "a colour or a material, got both"),
        ({"material": "red"}, TypeError, "material must be a Material or None, got 'red'"),
        ({"color": "rde"}, ValueError, "color"),
    ],
)
def test_look_of_an_instance_that_is_none_is_refused(options, error, words):
    with pytest.raises(error, match=words):
        tl.Instance(tl.Mesh(*tl.scenes.cube()), **options)
