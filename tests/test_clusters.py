"""Clusters: what they leave out draws nothing, so every picture has the same bits with them and without."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, on

import topleft as tl
from topleft.clusters import Clusters
from topleft.memory import FreshMemory
from topleft.rasterize import draw_fragments
from topleft.view import View

SIZE = (160, 120)


def meshes():
    """Closed shapes, coarse and fine, and a soup of slivers, degenerate triangles and big ones."""
    rng = np.random.default_rng(3)
    center, reach = rng.uniform(-1, 1, (4000, 1, 3)), rng.choice([0.001, 0.05, 0.5], (4000, 1, 1), p=[0.4, 0.55, 0.05])
    soup = center + rng.uniform(-1, 1, (4000, 3, 3)) * reach
    soup[::7, 2] = soup[::7, 1]
    soup[::11, 2] = (soup[::11, 0] + soup[::11, 1]) / 2
    return {
        "blob": tl.scenes.blob(30_000),
        "fine": tl.scenes.blob(300_000),
        "sphere": tl.scenes.shape("sphere"),
        "torus-knot": tl.scenes.shape("torus-knot"),
        "soup": (soup.reshape(-1, 3), np.arange(12_000).reshape(-1, 3)),
    }


MESHES = meshes()


def cameras(rng, n):
    """Cameras outside, near and inside of a unit sphere, some of them orthographic; windows; mirrors."""
    for _ in range(n):
        eye = rng.normal(size=3)
        eye *= rng.choice([0.05, 0.9, 1.1, 2.5, 30.0]) / np.linalg.norm(eye)
        ortho_height = rng.choice([0.2, 3.0]) if rng.uniform() < 0.3 else None
        near = float(rng.choice([0.001, 0.3]))
        camera = tl.Camera.look_at(eye, rng.uniform(-0.5, 0.5, 3), near=near, far=100.0, ortho_height=ortho_height)
        viewport = (SIZE[0] * int(rng.choice([1, 1, 20])), SIZE[1] * int(rng.choice([1, 1, 20])))
        mirror = np.diag([rng.choice([-1.0, 1.0]), 1.0, 1.0, 1.0])
        yield {
            "transform": camera.clip_from_world(viewport) @ mirror,
            "viewport": viewport,
            "origin": tuple(int(rng.integers(-20, side - 100)) for side in viewport),
            "cull": str(rng.choice(["none", "back", "front"])),
            "subpixel_bits": int(rng.choice([0, 4, 8, 8, 8, 12, 16])),
            "near_clip": bool(rng.uniform() < 0.8),
            "far_clip": bool(rng.uniform() < 0.8),
        }


def draw(mesh, clusters, **view):
    frags = draw_fragments(FreshMemory(), *mesh, View.parse(SIZE, view), "less", None, None, clusters)
    return frags.triangle, frags.depth


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", MESHES)
def test_picture_has_the_same_bits(name, dtype):
    rng = np.random.default_rng(17)
    mesh = MESHES[name][0].astype(dtype), MESHES[name][1].astype(np.int32)
    clusters = Clusters(*mesh)
    n_left_out = n_drawn = 0
    for i, view in enumerate(cameras(rng, 120)):
        threads = THREADS[i % len(THREADS)]
        expected, got = draw(mesh, None, threads=1, **view), draw(mesh, clusters, threads=threads, **view)
        assert_same(got[0], expected[0])
        assert_same(got[1], expected[1])
        matrix = np.asarray(view["transform"], dtype)
        n_left_out += len(mesh[1]) - clusters.survivors(matrix, View.parse(SIZE, view)).n_triangles
        n_drawn += (expected[0] >= 0).any()
    assert n_drawn > 30
    assert n_left_out > 0.05 * 120 * len(mesh[1])


@ON_EACH_ISA
def test_every_instruction_set_leaves_out_the_same(isa):
    mesh = MESHES["fine"][0].astype(np.float32), MESHES["fine"][1].astype(np.int32)
    for view in cameras(np.random.default_rng(5), 5):
        parsed = View.parse(SIZE, view)
        matrix = np.asarray(view["transform"], np.float32)
        with on("scalar"):
            expected = Clusters(*mesh).survivors(matrix, parsed)
        with on(isa):
            got = Clusters(*mesh).survivors(matrix, parsed)
        assert_same(got.triangles, expected.triangles)
        assert_same(got.vertices, expected.vertices)


def seen(mesh, **view):
    """The share of the triangles of a mesh that are left."""
    vertices, triangles = mesh[0].astype(np.float32), mesh[1].astype(np.int32)
    parsed = View.parse(SIZE, view)
    return Clusters(vertices, triangles).survivors(np.asarray(view["transform"], np.float32), parsed).n_triangles / len(
        triangles
    )


def test_far_side_is_left_out():
    transform = tl.Camera.look_at((0, 0, 3)).clip_from_world((1600, 1200))
    view = {"transform": transform, "viewport": (1600, 1200), "origin": (0, 0)}
    size_view = {"transform": tl.Camera.look_at((0, 0, 3)).clip_from_world(SIZE)}
    assert 0.3 < seen(MESHES["blob"], cull="back", **size_view) < 0.75
    assert seen(MESHES["blob"], cull="none", **size_view) == 1
    assert seen(MESHES["blob"], cull="back", **view) < 0.3  # a window of it


def test_what_lies_outside_is_left_out():
    transform = tl.Camera.look_at((0, 0, 3), (0, 0, 9)).clip_from_world(SIZE)
    assert seen(MESHES["blob"], transform=transform) == 0
    expected = draw((MESHES["blob"][0].astype(np.float32), MESHES["blob"][1].astype(np.int32)), None, transform=transform)
    assert (expected[0] == -1).all()


def test_vertices_of_what_is_left_are_enough():
    vertices, triangles = MESHES["fine"][0].astype(np.float32), MESHES["fine"][1].astype(np.int32)
    transform = tl.Camera.look_at((0, 0, 3)).clip_from_world((1600, 1200))
    view = View.parse(SIZE, {"transform": transform, "viewport": (1600, 1200), "cull": "back"})
    clusters = Clusters(vertices, triangles)
    survivors = clusters.survivors(transform.astype(np.float32), view)
    used = np.unique(np.concatenate([clusters.corners[a:b] for a, b in survivors.triangles]))
    marked = np.concatenate([np.arange(a, b) for a, b in survivors.vertices])
    assert np.isin(used, marked).all()
    assert len(marked) < 0.5 * len(vertices)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 3e38])
def test_triangles_of_unusable_vertices_are_never_left_out(bad):
    vertices, triangles = MESHES["blob"][0].astype(np.float32), MESHES["blob"][1].astype(np.int32)
    vertices[triangles[1000, 1]] = bad
    view = {"transform": tl.Camera.look_at((0, 0, 3)).clip_from_world(SIZE), "cull": "back"}
    with pytest.raises(ValueError, match="vertices must") as without:
        draw((vertices, triangles), None, **view)
    with pytest.raises(ValueError, match="vertices must") as got:
        draw((vertices, triangles), Clusters(vertices, triangles), **view)
    assert str(got.value) == str(without.value)


def test_wide_coordinates_have_the_same_bits():
    mesh = MESHES["blob"][0].astype(np.float32), MESHES["blob"][1].astype(np.int32)
    view = {
        "transform": tl.Camera.look_at((0, 0, 1.2)).clip_from_world((10**8, 10**8)),
        "viewport": (10**8, 10**8),
        "origin": (10**8 // 2, 10**8 // 2),
        "cull": "back",
    }
    for a, b in zip(draw(mesh, None, **view), draw(mesh, Clusters(*mesh), **view), strict=True):
        assert_same(a, b)


def test_mesh_of_nothing():
    vertices, triangles = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)
    got = draw((vertices, triangles), Clusters(vertices, triangles), transform=np.eye(4))
    assert (got[0] == -1).all()
