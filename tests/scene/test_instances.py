"""Instances are projected together: the picture of a scene is that of its meshes, each drawn alone by arrays."""

import numpy as np
import picture_cases as cases
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl
from topleft._core import engine

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
@pytest.mark.parametrize("seed", range(40))
def test_scene_is_drawn_as_its_instances_alone(isa, seed):
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
