"""Meshlets: they hold each triangle once, what a view leaves out draws nothing, and pictures have the same bits."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import THREADS, Drawn, flat_grid, on, small_views
from pages import before_a_page, behind_a_page

import topleft as tl
from topleft._core import engine
from topleft._core.base.memory import FreshMemory
from topleft._core.base.options import Sink
from topleft._core.raster import choices, cluster_draw
from topleft._core.raster.cluster_draw import ClusteredMesh, Survey
from topleft._core.raster.clusters import Clusters
from topleft._core.raster.costs import cost_table
from topleft._core.raster.rasterize import draw_fragments
from topleft._core.raster.view import View

SIZE = (160, 120)

needs_meshlets = pytest.mark.skipif(not engine.has_meshlets(), reason="no AVX-512 with VBMI, or other kernels in use")

#: `tl_meshlet` of csrc/meshlets.h.
MESHLET = np.dtype([("xyz", np.float32, (3, 64)), ("corners", np.uint8, (3, 128)), ("names", np.int32, 128)])


def shuffled_soup(rng):
    """Slivers, degenerate triangles and large ones, with vertices of their own."""
    center, reach = rng.uniform(-1, 1, (4000, 1, 3)), rng.choice([0.001, 0.05, 0.5], (4000, 1, 1), p=[0.4, 0.55, 0.05])
    corners = center + rng.uniform(-1, 1, (4000, 3, 3)) * reach
    corners[::7, 2] = corners[::7, 1]
    corners[::11, 2] = (corners[::11, 0] + corners[::11, 1]) / 2
    return corners.reshape(-1, 3), np.arange(12_000).reshape(-1, 3)


def near_triples(rng):
    """Triples of near vertices of a sphere: hundreds at an edge, a tenth of them twice with their corners turned."""
    points = rng.normal(size=(2000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points[np.lexsort((points[:, 1] // 0.1, points[:, 0] // 0.1))]
    first = rng.integers(0, 2000, 8000)
    triangles = np.stack([first, *(first + rng.integers(-6, 7, (2, 8000))) % 2000], axis=1)
    triangles[:800] = triangles[rng.integers(800, 8000, 800)][:, [1, 2, 0]]
    return points, triangles


def layered_sheet(rng):
    """Coplanar layers of small triangles on a grid, in any order."""
    side, n = 100, 15_000
    x, y = np.meshgrid(*[np.linspace(-1, 1, side)] * 2)
    first = rng.integers(0, side * side, n)
    steps = rng.integers(-1, 2, (2, n)) + side * rng.integers(-1, 2, (2, n))
    return np.stack([x, y, 0 * x], -1).reshape(-1, 3), np.stack([first, *(first + steps) % (side * side)], axis=1)


def crumpled_sheet(rng):
    """A sheet with folds at many edges: partners of a pair that show both sides, one over the other."""
    points, triangles = flat_grid(60)
    return points + rng.normal(size=points.shape) * 0.03, triangles


def meshes():
    """Closed shapes, coarse and fine, and what no modeller would make."""
    rng = np.random.default_rng(3)
    return {
        "blob": tl.scenes.blob(30_000),
        "fine": tl.scenes.blob(150_000),
        "coarse": tl.scenes.blob(300),
        "torus-knot": tl.scenes.shape("torus-knot"),
        "soup": shuffled_soup(rng),
        "triples": near_triples(rng),
        "sheet": layered_sheet(rng),
        "crumpled": crumpled_sheet(rng),
    }


MESHES = {name: (v.astype(np.float32), t.astype(np.int32)) for name, (v, t) in meshes().items()}


def cameras(rng, n):
    """Cameras outside, near and inside of a unit sphere, some orthographic; windows; mirrors; sheared spaces."""
    for _ in range(n):
        eye = rng.normal(size=3)
        eye *= rng.choice([0.05, 0.9, 1.1, 2.5, 2.5, 30.0]) / np.linalg.norm(eye)
        ortho_height = rng.choice([0.2, 3.0]) if rng.uniform() < 0.3 else None
        near, far = float(rng.choice([0.001, 0.3, 1.5])), float(rng.choice([100.0, 2.5]))
        camera = tl.Camera.look_at(eye, rng.uniform(-0.5, 0.5, 3), near=near, far=far, ortho_height=ortho_height)
        viewport = (SIZE[0] * int(rng.choice([1, 1, 20])), SIZE[1] * int(rng.choice([1, 1, 20])))
        object_space = np.diag([rng.choice([-1.0, 1.0]), 1.0, 1.0, 1.0])
        if rng.uniform() < 0.2:
            object_space[:3, :3] += 0.5 * rng.normal(size=(3, 3))
        yield {
            "transform": camera.clip_from_world(viewport) @ object_space,
            "viewport": viewport,
            "origin": tuple(int(rng.integers(-20, side - 100)) for side in viewport),
            "cull": str(rng.choice(["back", "front", "none", "none"])),
            "subpixel_bits": int(rng.choice([0, 1, 4, 7, 8, 8, 8])),
            "clip_depth": str(rng.choice(["minus_one_to_one", "zero_to_one"])),
        }


@pytest.fixture
def drawn(monkeypatch, force):
    """Views are drawn in meshlets however little it pays; a list that each of these pictures adds to."""
    pictures = []
    draw = ClusteredMesh.draw_meshlets
    force(pays_to_grow=True, pays_to_draw_meshlets=True, pays_to_draw_samples=True)
    monkeypatch.setattr(ClusteredMesh, "draw_meshlets", lambda *a: pictures.append(1) or draw(*a))
    return pictures


def draw(mesh, clusters, depth_test="less", size=SIZE, out=None, **view):
    plan = None if clusters is None else Drawn(clusters)
    view = View.parse(size, {**view, "plan": plan})
    return draw_fragments(FreshMemory(), *mesh, view, depth_test, None, out)


def assert_same_fragments(got, expected):
    assert_same(got.triangle, expected.triangle)
    assert_same(got.depth.view(np.int32), expected.depth.view(np.int32))


def count_same(mesh, views):
    """See that each view has the same bits in meshlets as whole; returns how many show something."""
    clusters, n_seen = Clusters(*mesh), 0
    for i, view in enumerate(views):
        test = ("less", "greater")[i % 4 == 0]
        expected = draw(mesh, None, test, threads=1, **view)
        got = draw(mesh, clusters, test, threads=THREADS[i % len(THREADS)], **view)
        assert_same_fragments(got, expected)
        n_seen += expected.mask.any()
        if i % 20 == 0:
            assert_same(got.barycentric(), expected.barycentric())
    return n_seen


@needs_meshlets
@pytest.mark.parametrize("name", ["fine", "grid"])
def test_many_triangles_a_pixel_have_the_same_bits(name, drawn):
    """Of which most lie between samples, and meshlets of them are left out."""
    vertices, triangles = flat_grid() if name == "grid" else MESHES[name]
    mesh = vertices.astype(np.float32), triangles.astype(np.int32)
    assert count_same(mesh, small_views(np.random.default_rng(6), 100)) > 25
    assert len(drawn) == 100


@needs_meshlets
@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_picture_has_the_same_bits(name, dtype, drawn):
    mesh = MESHES[name][0].astype(dtype), MESHES[name][1]
    assert count_same(mesh, cameras(np.random.default_rng(17), 150)) > 40
    assert len(drawn) == 150


def sampled(rng, views):
    """The same views with several samples a pixel, on a grid that these lie on."""
    for view in views:
        sampling = str(rng.choice(["msaa2", "msaa4", "msaa4", "msaa8", "msaa16"]))
        yield view | {"sampling": sampling, "subpixel_bits": int(rng.choice([4, 5, 7, 8, 8, 8]))}


@needs_meshlets
@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_each_sample_has_the_same_bits(name, dtype, drawn):
    rng = np.random.default_rng(23)
    mesh = MESHES[name][0].astype(dtype), MESHES[name][1]
    clusters = Clusters(*mesh)
    n_planes = 0
    for i, view in enumerate(sampled(rng, cameras(rng, 40))):
        test, size = ("less", "greater")[i % 4 == 0], (SIZE, (37 + 5 * i, 11 + 3 * i))[i % 3 == 0]
        expected = draw(mesh, None, test, size, threads=1, **view)
        got = draw(mesh, clusters, test, size, threads=THREADS[i % len(THREADS)], **view)
        assert_same(got.samples_triangle, expected.samples_triangle)
        assert_same(got.samples_depth.view(np.int32), expected.samples_depth.view(np.int32))
        n_planes += got.samples_triangle.shape[-1]
        if i % 8 == 0:
            assert_same(got.sample(-1).barycentric(), expected.sample(-1).barycentric())
    assert len(drawn) == n_planes


@needs_meshlets
@pytest.mark.parametrize("place", [before_a_page, behind_a_page])
def test_buffers_at_page_ends_are_not_left(place, drawn):
    mesh = MESHES["triples"]
    clusters = Clusters(*mesh)
    for i, view in enumerate(cameras(np.random.default_rng(5), 40)):
        size = (17 + i, 1 + 3 * i)
        expected = draw(mesh, None, size=size, threads=1, **view)
        out = place(np.zeros(size[::-1], np.int32)), place(np.zeros(size[::-1], np.float32))
        assert_same_fragments(draw(mesh, clusters, size=size, threads=2, out=out, **view), expected)
    assert len(drawn) == 40


@needs_meshlets
@pytest.mark.parametrize("name", MESHES)
def test_each_triangle_is_held_once(name):
    points, triangles = MESHES[name]
    grown = Clusters(points, triangles).meshlets
    held = []
    for block, count in zip(grown.blocks.view(MESHLET), grown.counts.tolist(), strict=False):
        corners = block["corners"][:, :count].T.astype(int)
        is_whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
        names = block["names"][:count][is_whole]
        assert_same(block["xyz"].T[corners[is_whole]], points[triangles[names]])
        held += names.tolist()
    is_whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    assert sorted(held) == np.flatnonzero(is_whole).tolist()


@needs_meshlets
def test_partners_share_an_edge():
    _, triangles = MESHES["blob"]
    n_pairs = 0
    for block in Clusters(*MESHES["blob"]).meshlets.blocks.view(MESHLET):
        corners = block["corners"].T.astype(int)
        for first, second in zip(corners[::2].tolist(), corners[1::2].tolist(), strict=True):
            edges = {(a, b) for a, b in zip(first, first[1:] + first[:1], strict=True)}
            turned = {(b, a) for a, b in zip(second, second[1:] + second[:1], strict=True)}
            is_empty = len(set(second)) < 3
            assert is_empty or edges & turned
            n_pairs += not is_empty
    assert n_pairs > 0.4 * len(triangles)


@needs_meshlets
@pytest.mark.parametrize("name", MESHES)
def test_balls_hold_their_vertices(name):
    grown = Clusters(*MESHES[name]).meshlets
    middle, radius = grown.bounds[:3, : len(grown)].T.astype(np.float64), grown.bounds[3, : len(grown)]
    points = grown.blocks.view(MESHLET)["xyz"].astype(np.float64)
    assert (np.linalg.norm(points - middle[:, :, None], axis=1).max(axis=1) <= radius).all()


@needs_meshlets
@pytest.mark.parametrize("cull", ["back", "none"])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize("test", ["less", "greater"])
def test_shells_that_hide_each_other_have_the_same_bits(cull, mirror, test, drawn):
    points, triangles = MESHES["fine"]
    shells = [points, 0.9 * points, 1.02 * points]
    mesh = np.concatenate(shells), np.concatenate([triangles + i * len(points) for i in range(3)]).astype(np.int32)
    clusters = Clusters(mesh[0].astype(np.float32), mesh[1])
    for distance in (1.3, 2.0, 3.0, 40.0):
        camera = tl.Camera.look_at((0.3, 0.2, distance), near=0.05, far=100.0)
        view = {"transform": camera.clip_from_world(SIZE) @ np.diag([mirror, 1.0, 1.0, 1.0]), "cull": cull}
        expected = draw((clusters.points, mesh[1]), None, test, threads=1, **view)
        assert_same_fragments(draw((clusters.points, mesh[1]), clusters, test, threads=2, **view), expected)
    assert len(drawn) == 4


@needs_meshlets
def test_mesh_without_area_is_drawn(drawn):
    mesh = np.zeros((3, 3), np.float32), np.zeros((40, 3), np.int32)
    got = draw(mesh, Clusters(*mesh), transform=np.eye(4), cull="back")
    assert len(drawn) == 1
    assert not got.mask.any()


@needs_meshlets
def test_mesh_is_grown_when_it_has_been_drawn_often(monkeypatch):
    pictures, mesh = [], tl.Mesh(*MESHES["blob"])
    draw = cluster_draw.draw_pass
    monkeypatch.setattr(ClusteredMesh, "survey", lambda *_: Survey(0.8, 0.0, 0.1, 0.1))
    monkeypatch.setattr(cluster_draw, "draw_pass", lambda *a, **k: pictures.append(1) or draw(*a, **k))
    expected = tl.rasterize_mesh(mesh, size=SIZE, cull="back")
    for i in range(1, 20):
        assert_same_fragments(tl.rasterize_mesh(mesh, size=SIZE, cull="back"), expected)
        assert bool(pictures) == (i >= cost_table().grown_pictures)


@needs_meshlets
@pytest.mark.parametrize(
    ("options", "is_float32"),
    [
        ({"cull": "back"}, False),
        ({"cull": "back", "near_clip": False}, True),
        ({"cull": "back", "subpixel_bits": 9}, True),
        ({"cull": "back", "subpixel_bits": 3, "sampling": "msaa4"}, True),
        ({"cull": "back", "viewport": (20_000, 120)}, True),
        ({"cull": "back", "origin": (-20_000, 0)}, True),
    ],
)
def test_what_meshlets_cannot_draw_is_left_to_clusters(options, is_float32):
    assert choices.can_draw_meshlets(View.parse(SIZE, {"cull": "back"}), Sink.NEAREST, is_float32=True)
    assert not choices.can_draw_meshlets(View.parse(SIZE, options), Sink.NEAREST, is_float32=is_float32)


@pytest.mark.parametrize("number", [0.1, 1e300, 1 + 2.0**-24, np.nan])
def test_coordinates_are_float32_numbers_or_not(number):
    points, triangles = np.zeros((3, 3)), np.zeros((1, 3), np.int32)
    points[1] = 0.5, -(2.0**-140), np.inf
    assert Clusters(points, triangles).is_float32
    points[2, 1] = number
    assert not Clusters(points, triangles).is_float32


def test_scalar_kernels_have_no_meshlets():
    with on("scalar"):
        assert not engine.has_meshlets()
        view = View.parse(SIZE, {"cull": "back"})
        assert not choices.can_draw_meshlets(view, Sink.NEAREST, is_float32=True)


@pytest.mark.parametrize(
    ("cull", "n", "outside", "front", "hidden", "pays"),
    [
        ("back", 90_000, 0.0, 0.5, 0.0, True),
        ("back", 90_000, 0.0, 0.9, 0.0, False),
        ("back", 90_000, 0.0, 0.5, 0.7, False),
        ("back", 90_000, 0.0, 0.8, 0.6, True),
        ("back", 30_000, 0.0, 0.5, 0.0, False),
        ("back", 30_000, 0.2, 0.5, 0.0, True),
        ("none", 90_000, 0.0, 0.5, 0.5, True),
        ("none", 90_000, 0.0, 0.5, 0.8, False),
        ("none", 90_000, 0.0, 0.9, 0.1, False),
        ("none", 30_000, 0.2, 0.5, 0.0, False),
        ("none", 30_000, 0.8, 0.1, 0.0, True),
        ("back", 60_000, 0.5, 0.5, 0.0, True),
        ("none", 90_000, 0.0, 0.5, 0.6, True),
    ],
)
def test_meshlets_are_drawn_where_little_is_hidden(cull, n, outside, front, hidden, pays):
    view = View.parse(SIZE, {"cull": cull})
    assert choices.pays_to_draw_meshlets(view, n, Survey(outside, 0.0, 1 - outside - front, front), hidden) == pays


@pytest.mark.parametrize(
    ("cull", "n", "outside", "hidden", "pays"),
    [
        ("back", 60_000, 0.5, 0.15, True),
        ("back", 60_000, 0.5, 0.2, False),
        ("back", 900_000, 0.0, 0.3, True),
        ("back", 900_000, 0.0, 0.4, False),
        ("none", 90_000, 0.0, 0.35, True),
        ("none", 90_000, 0.0, 0.45, False),
        ("none", 900_000, 0.0, 0.7, True),
    ],
)
def test_large_triangles_are_left_to_clusters_where_some_is_hidden(cull, n, outside, hidden, pays):
    view = View.parse((1920, 1080), {"cull": cull})
    assert choices.pays_to_draw_meshlets(view, n, Survey(outside, 0.0, 0.8 - outside, 0.2), hidden) == pays


@pytest.mark.parametrize(("n_pictures", "n_clusters", "pays"), [(15, 100, False), (16, 100, True), (99, 350, False)])
def test_meshes_of_joined_triangles_are_grown(n_pictures, n_clusters, pays):
    assert choices.pays_to_grow(n_pictures, 25_600, n_clusters) == pays


@needs_meshlets
def test_share_that_is_hidden_is_of_what_the_view_may_show():
    blob = MESHES["fine"]
    both = np.concatenate([blob[0], 0.5 * blob[0]]), np.concatenate([blob[1], blob[1] + len(blob[0])])
    shares = []
    for mesh in (blob, both):
        clusters = Clusters(*mesh)
        camera = tl.Camera.look_at((0, 0, 3), near=0.01, far=100.0)
        view = View.parse(SIZE, {"transform": camera.clip_from_world(SIZE), "cull": "back"})
        seen = ClusteredMesh(clusters, view)
        frags = draw(mesh, None, transform=camera.clip_from_world(SIZE), cull="back")
        target = engine.Target(Sink.NEAREST, frags.triangle.copy(), frags.depth.copy(), None)
        shares.append(seen.hidden_share(target, len(clusters)))
    assert shares[0] < 0.3 < 0.4 < shares[1]
