"""Tables of what cameras see, against the pictures, and against rays."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from comparing import assert_same

import topleft as tl


def test_table_has_the_pixels_of_each_picture():
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot"))
    cameras = tl.viewpoints(mesh, 5)
    table = tl.visible_faces(mesh, cameras, (97, 71), min_pixels=2)
    dense = table.to_scipy().toarray()
    for i, camera in enumerate(cameras):
        ids = tl.rasterize_mesh(mesh, camera, (97, 71)).triangle
        counts = np.bincount(ids[ids >= 0], minlength=len(mesh.triangles))
        assert_same(dense[i], np.where(counts >= 2, counts, 0).astype(np.int32))
    assert_same(table.seen_by, (dense > 0).sum(axis=0))
    for executor in (2, ThreadPoolExecutor(2)):
        other = tl.visible_faces(mesh, iter(cameras), (97, 71), min_pixels=2, executor=executor)
        assert_same(other.face, table.face)
        assert_same(other.pixels, table.pixels)


def test_vertices_have_the_pixels_of_the_triangles_round_them():
    mesh = tl.Mesh(*tl.scenes.icosphere(1))
    table = tl.visible_faces(mesh, tl.viewpoints(mesh, 3), (64, 64))
    faces, vertices = table.to_scipy().toarray(), table.vertices().to_scipy().toarray()
    expected = np.zeros((3, len(mesh.vertices)), np.int64)
    for camera in range(3):
        np.add.at(expected[camera], mesh.triangles.ravel(), np.repeat(faces[camera], 3))
    assert_same(vertices.astype(np.int64), expected)


def test_triangles_of_a_scene_are_counted_in_the_order_of_its_instances():
    cube, aside = tl.Mesh(*tl.scenes.cube()), np.eye(4)
    aside[0, 3] = 4
    scene = tl.Scene([cube, (cube, aside)])
    table = tl.visible_faces(scene, [tl.Camera.framing(scene)], (200, 100))
    frags = tl.rasterize_mesh(scene, tl.Camera.framing(scene), (200, 100))
    counts = np.bincount(frags.id[frags.id >= 0], minlength=24)
    assert table.shape == (1, 24)
    assert_same(table.to_scipy().toarray()[0], counts.astype(np.int32))
    assert len(table.vertices().face) > 8


def test_what_is_seen_is_what_rays_hit():
    """A triangle that shows in a picture is the first that a ray through the middle of the pixel meets."""
    rng = np.random.default_rng(0)
    vertices = rng.uniform(-1, 1, (30, 3))
    triangles = np.arange(30).reshape(10, 3)
    camera = tl.Camera.look_at((0, 0, 6))
    ids = tl.rasterize_mesh((vertices, triangles), camera, (41, 31)).triangle
    table = tl.visible_faces((vertices, triangles), [camera], (41, 31))
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    rows, columns = np.nonzero(ids >= 0)
    inverse = np.linalg.inv(camera.clip_from_world((41, 31)))
    for row, column in list(zip(rows, columns, strict=True))[::7]:
        ndc = (column + 0.5) / 41 * 2 - 1, 1 - (row + 0.5) / 31 * 2
        near, far = (inverse @ (*ndc, z, 1) for z in (-1, 1))
        start, way = near[:3] / near[3], far[:3] / far[3] - near[:3] / near[3]
        hits = []
        for k in range(10):
            system = np.stack([b[k] - a[k], c[k] - a[k], -way], axis=1)
            u, v, t = np.linalg.solve(system, start - a[k])
            if min(u, v, 1 - u - v) > -0.02 and t > 0:
                hits.append((t, k))
        assert int(ids[row, column]) in [k for _, k in sorted(hits)[:2]]
    assert set(table.face.tolist()) == set(ids[ids >= 0].tolist())


@pytest.mark.parametrize("least", [0, -1])
def test_bad_number_of_pixels_is_refused(least):
    with pytest.raises(ValueError, match="min_pixels must be at least 1"):
        tl.visible_faces(tl.scenes.cube(), [], min_pixels=least)


def test_no_camera_sees_nothing():
    table = tl.visible_faces(tl.scenes.cube(), [])
    assert table.shape == (0, 12)
    assert len(table.vertices().face) == 0
