"""Clusters: what they leave out draws nothing, so every picture has the same bits with them and without."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, Clustered, flat_grid, on, small_views

import topleft as tl
from topleft._core import engine
from topleft._core.base.memory import FreshMemory
from topleft._core.base.options import Sink
from topleft._core.raster.cluster_draw import ClusteredMesh
from topleft._core.raster.clusters import Clusters
from topleft._core.raster.rasterize import draw_coverage, draw_fragments, draw_overdraw, fragment_options
from topleft._core.raster.static_mesh import draw_static
from topleft._core.raster.view import View

SIZE = (160, 120)


@pytest.fixture(autouse=True)
def however_little_it_pays(force):
    """Views are drawn in clusters even where that does not pay."""
    force(pays_to_draw_clusters=True, pays_to_draw_instances=True, pays_to_draw_samples=True)


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


def draw(mesh, clusters, depth_test="less", size=SIZE, **view):
    view = View.parse(size, view)
    options = fragment_options(view, depth_test, None, None)
    if clusters is None:
        return draw_fragments(FreshMemory(), *mesh, view, options)
    return draw_static(FreshMemory(), Clustered(*mesh, clusters), view, options)


def assert_same_fragments(got, expected):
    assert_same(got.triangle, expected.triangle)
    assert_same(got.depth, expected.depth)


def share_left(mesh, **view):
    """The share of the clusters of a mesh that a view leaves, hidden or not."""
    clusters = Clusters(*mesh)
    seen = ClusteredMesh(clusters, View.parse(SIZE, view)).survey(len(clusters))
    return 1 - seen.outside - seen.turned


def as_arrays(name, dtype=np.float32):
    return MESHES[name][0].astype(dtype), MESHES[name][1].astype(np.int32)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", MESHES)
def test_picture_has_the_same_bits(name, dtype):
    rng = np.random.default_rng(17)
    mesh = as_arrays(name, dtype)
    clusters = Clusters(*mesh)
    n_drawn = 0
    for i, view in enumerate(cameras(rng, 20)):
        test = ("less", "greater")[i % 5 == 0]
        expected = draw(mesh, None, test, threads=1, **view)
        got = draw(mesh, clusters, test, threads=THREADS[i % len(THREADS)], **view)
        assert_same_fragments(got, expected)
        n_drawn += expected.mask.any()
        if i % 10 == 0:
            assert_same(got.barycentric(), expected.barycentric())
            assert_same(got.interpolate(mesh[0]), expected.interpolate(mesh[0]))
    assert n_drawn > 5


def draw_forms(clusters, mesh, view, depth_test):
    """What several samples see: ids, depth, and attributes of the first and the last."""
    frags = draw(mesh, clusters, depth_test, **view)
    found = [frags.samples_triangle, frags.samples_depth.view(np.int32), frags.triangle, frags.depth]
    for sample in (frags, frags.sample(-1)):
        found += [sample.barycentric(), sample.interpolate(mesh[0])]
    return found


@ON_EACH_ISA
@pytest.mark.parametrize("name", ["blob", "torus-knot", "soup"])
def test_each_sample_has_the_same_bits(isa, name):
    rng = np.random.default_rng(31)
    meshes_of = {dtype: as_arrays(name, dtype) for dtype in (np.float32, np.float64)}
    clusters_of = {dtype: Clusters(*mesh) for dtype, mesh in meshes_of.items()}
    with on(isa):
        for i, view in enumerate(cameras(rng, 16)):
            dtype, test = (np.float32, np.float64)[i % 2], ("less", "greater")[i % 5 == 0]
            view |= {"sampling": str(rng.choice(["msaa2", "msaa4", "msaa8", "msaa16"]))}
            expected = draw_forms(None, meshes_of[dtype], view | {"threads": 1}, test)
            got = draw_forms(clusters_of[dtype], meshes_of[dtype], view | {"threads": THREADS[i % len(THREADS)]}, test)
            for one, other in zip(got, expected, strict=True):
                assert_same(one, other)


@ON_EACH_ISA
@pytest.mark.parametrize("name", ["blob", "soup", "shell"])
def test_bounds_of_depth_leave_the_bits_of_wide_pictures(isa, name):
    """Clusters that are wider than 96 columns are found hidden by bounds of segments of 64."""
    rng = np.random.default_rng(5)
    mesh = as_shells(*as_arrays("sphere")) if name == "shell" else as_arrays(name)
    clusters = Clusters(*mesh)
    with on(isa):
        for i, view in enumerate(cameras(rng, 12)):
            size, test = ((700, 90), (450, 200), (129, 300))[i % 3], ("less", "greater")[i % 2]
            expected = draw(mesh, None, test, size, threads=1, **view)
            got = draw(mesh, clusters, test, size, threads=THREADS[i // 3 % len(THREADS)], **view)
            assert_same_fragments(got, expected)


def as_shells(vertices, triangles):
    """A sphere in a sphere, in another: most is hidden."""
    scaled = [vertices * np.float32(scale) for scale in (1.0, 0.9, 0.8)]
    corners = [triangles + np.int32(i * len(vertices)) for i in range(3)]
    return np.concatenate(scaled), np.concatenate(corners)


@ON_EACH_ISA
@pytest.mark.parametrize("sink", [Sink.NEAREST, Sink.FARTHEST])
def test_bounds_hide_the_same_clusters(isa, sink):
    mesh, size, rng = as_shells(*as_arrays("blob")), (450, 200), np.random.default_rng(8)
    clusters = Clusters(*mesh)
    n_hidden = n_bounds = 0
    for _ in range(8):
        eye = rng.normal(size=3)
        camera = tl.Camera.look_at(1.6 * eye / np.linalg.norm(eye), near=0.01, far=100.0)
        seen = ClusteredMesh(clusters, View.parse(size, {"transform": camera.clip_from_world(size)}))
        drawn = []
        for is_bounded in (False, True):
            target = engine.Target(sink, np.empty(size[::-1], np.int32), np.empty(size[::-1], np.float32), None)
            bounds = np.full(engine.Target.bounds_shape(*size[::-1]), np.nan, np.float32)
            if is_bounded:
                target.keep_bounds(bounds)
            with on(isa):
                drawn.append(seen.draw_rows(FreshMemory(), target, 0, size[1])[1])
        assert drawn[0] == drawn[1]
        n_hidden += len(clusters) - drawn[0]
        n_bounds += np.isfinite(bounds).sum()
    assert n_hidden > 500
    assert n_bounds > 1000


@ON_EACH_ISA
@pytest.mark.parametrize("sink", [Sink.MASK, Sink.COUNT])
def test_masks_and_counts_have_the_same_bits(isa, sink):
    mesh = as_arrays("blob")
    clusters = Clusters(*mesh)
    whole = {Sink.MASK: draw_coverage, Sink.COUNT: draw_overdraw}[sink]
    n_compared = 0
    for options in cameras(np.random.default_rng(8), 16):
        view = View.parse(SIZE, options | {"threads": 2})
        with on("scalar"):
            expected = whole(FreshMemory(), *mesh, view, None)
        with on(isa):
            pixels = np.empty_like(expected)
            covered = np.empty(engine.Target.covered_shape(SIZE[1], SIZE[0]), np.uint64)
            target = engine.Target(sink, pixels, None, covered)
            if not ClusteredMesh(clusters, view).draw(FreshMemory(), target):
                continue  # a vertex does not fit 32 bits
        assert_same(pixels, expected)
        n_compared += expected.any()
    assert n_compared > 4


@ON_EACH_ISA
def test_every_instruction_set_draws_the_same(isa):
    mesh = as_arrays("fine")
    clusters = Clusters(*mesh)
    for view in cameras(np.random.default_rng(5), 8):
        with on("scalar"):
            expected, counts = draw(mesh, clusters, **view), count_drawn(mesh, **view)
        with on(isa):
            assert_same_fragments(draw(mesh, clusters, **view), expected)
            assert count_drawn(mesh, **view) == counts


def test_every_triangle_stands_in_one_cluster():
    for name in MESHES:
        mesh = as_arrays(name)
        clusters = Clusters(*mesh)
        view = {"transform": tl.Camera.look_at((0, 0, 9)).clip_from_world(SIZE), "sampling": "outer"}
        assert share_left(mesh, **view) == 1
        assert count_drawn(mesh, **view)[1] == len(clusters)
        assert len(clusters) <= 1.5 * len(mesh[1]) / 64
        assert len(clusters.own_points) < 3 * len(mesh[1]) + 64


def test_far_side_is_left_out():
    vertices, triangles = MESHES["fine"]
    sphere = (vertices / np.linalg.norm(vertices, axis=1)[:, None]).astype(np.float32), triangles.astype(np.int32)
    whole = {"transform": tl.Camera.look_at((0, 0, 3)).clip_from_world((4 * SIZE[0], 4 * SIZE[1]))}
    whole["sampling"] = "outer"  # of which nothing lies between samples
    assert share_left(sphere, **whole) == 1
    assert 1 / 3 < share_left(sphere, cull="back", **whole) < 0.7  # a third shows
    assert 2 / 3 < share_left(sphere, cull="front", **whole) < 0.9


def count_drawn(mesh, **view):
    """Clusters that a view draws, and those that it would draw if none was hidden."""
    clusters = Clusters(*mesh)
    scene = ClusteredMesh(clusters, View.parse(SIZE, view))
    target = engine.Target(Sink.NEAREST, np.empty(SIZE[::-1], np.int32), np.empty(SIZE[::-1], np.float32), None)
    seen = scene._seen(Sink.NEAREST)
    room, others = np.empty(3 * len(clusters) + 1, np.int32), np.empty(len(mesh[1]) + 1, np.int32)
    how = target, 0, SIZE[1], room, others, True, True
    return [clusters.engine.draw(scene._empty, scene._own, seen, hides, *how)[2] for hides in (True, False)]


def test_what_is_hidden_is_left_out():
    transform = tl.Camera.look_at((0, 0, 3)).clip_from_world(SIZE)
    n_drawn, n_seen = count_drawn(as_arrays("fine"), transform=transform)
    assert n_drawn < 0.7 * n_seen


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", ["fine", "blob", "grid"])
@ON_EACH_ISA
def test_many_triangles_a_pixel_have_the_same_bits(isa, name, dtype):
    vertices, triangles = flat_grid() if name == "grid" else MESHES[name]
    mesh = vertices.astype(dtype), triangles.astype(np.int32)
    clusters = Clusters(*mesh)
    n_seen = 0
    with on(isa):
        for i, view in enumerate(small_views(np.random.default_rng(5), 16)):
            test = ("less", "greater")[i % 4 == 0]
            expected = draw(mesh, None, test, **view)
            assert_same_fragments(draw(mesh, clusters, test, threads=THREADS[i % len(THREADS)], **view), expected)
            n_seen += expected.mask.any()
    assert n_seen > 4


def test_what_lies_between_samples_is_left_out():
    view = {"transform": tl.Camera.look_at((0, 0, 3)).clip_from_world((8, 6)), "viewport": (8, 6)}
    assert 0.1 < share_left(as_arrays("fine"), **view) < 0.5
    assert share_left(as_arrays("fine"), sampling="outer", **view) == 1


def test_what_lies_outside_is_left_out():
    transform = tl.Camera.look_at((0, 0, 3), (0, 0, 9)).clip_from_world(SIZE)
    assert share_left(as_arrays("blob"), transform=transform) == 0
    assert not draw(as_arrays("blob"), Clusters(*as_arrays("blob")), transform=transform).mask.any()


@pytest.mark.parametrize("bad", [np.nan, np.inf, 3e38])
def test_triangles_of_unusable_vertices_are_never_left_out(bad):
    vertices, triangles = as_arrays("blob")
    vertices[triangles[1000, 1]] = bad
    view = {"transform": tl.Camera.look_at((0, 0, 3)).clip_from_world(SIZE), "cull": "back"}
    with pytest.raises(ValueError, match="vertices must") as without:
        draw((vertices, triangles), None, **view)
    with pytest.raises(ValueError, match="vertices must") as got:
        draw((vertices, triangles), Clusters(vertices, triangles), **view)
    assert str(got.value) == str(without.value)


def test_unused_vertices_may_be_anything():
    vertices, triangles = as_arrays("blob")
    strange = np.array([[np.nan, 0, 0], [np.inf, 0, 0], [1e30, 1e30, 1e30]], np.float32)
    mesh = np.concatenate([vertices, strange]), triangles
    view = {"transform": tl.Camera.look_at((0, 0, 3)).clip_from_world(SIZE)}
    expected, got = draw(mesh, None, **view), draw(mesh, Clusters(*mesh), **view)
    assert_same_fragments(got, expected)
    assert_same(got.barycentric(), expected.barycentric())


def test_wide_coordinates_have_the_same_bits():
    mesh = as_arrays("blob")
    view = {
        "transform": tl.Camera.look_at((0, 0, 1.2)).clip_from_world((10**8, 10**8)),
        "viewport": (10**8, 10**8),
        "origin": (10**8 // 2, 10**8 // 2),
        "cull": "back",
    }
    assert_same_fragments(draw(mesh, Clusters(*mesh), **view), draw(mesh, None, **view))


def test_equal_depths_go_to_the_lower_index():
    """Sheets that lie in each other, in an order that is not theirs: the first triangle of each place shows."""
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41)), -1).reshape(-1, 2)
    corner = np.arange(40)[:, None] * 41 + np.arange(40)
    cells = np.stack([corner, corner + 1, corner + 42, corner, corner + 42, corner + 41], -1).reshape(-1, 3)
    rng = np.random.default_rng(2)
    vertices = np.concatenate([np.c_[grid, np.zeros(len(grid))]] * 3).astype(np.float32)
    triangles = np.concatenate([cells + k * len(grid) for k in range(3)]).astype(np.int32)
    mesh = vertices, triangles[rng.permutation(len(triangles))]
    for view in cameras(rng, 20):
        assert_same_fragments(draw(mesh, Clusters(*mesh), **view), draw(mesh, None, **view))


def test_out_and_background_are_as_without():
    mesh = as_arrays("blob")
    view = View.parse(SIZE, {"transform": tl.Camera.look_at((0, 0, 3)).clip_from_world(SIZE)})
    out = np.zeros(SIZE[::-1], np.int32)[:, ::-1], np.zeros((SIZE[0], SIZE[1]), np.float32).T
    options = fragment_options(view, "less", 7.0, out)
    expected = draw_fragments(FreshMemory(), *mesh, view, options._replace(ids_out=None, depth_out=None))
    got = draw_static(FreshMemory(), Clustered(*mesh, Clusters(*mesh)), view, options)
    assert got.triangle is out[0]
    assert_same(out[0], expected.triangle)
    assert_same(out[1], expected.depth)


def test_clusters_of_no_triangles_draw_nothing():
    mesh = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)
    assert not draw(mesh, Clusters(*mesh), transform=np.eye(4)).mask.any()


@pytest.fixture
def always(force):
    """Meshes are sorted before their first picture."""
    force(pays_to_cluster=True)


def test_mesh_is_sorted_for_its_second_picture():
    mesh = tl.Mesh(*tl.scenes.blob(21_000))
    small = tl.Mesh(*tl.scenes.shape("cube"))
    first = tl.rasterize_mesh(mesh, size=SIZE)
    assert "clusters" not in mesh.__dict__
    assert_same_fragments(tl.rasterize_mesh(mesh, size=SIZE), first)
    assert "clusters" in mesh.__dict__
    for _ in range(3):
        tl.rasterize_mesh(small, size=SIZE)
    assert "clusters" not in small.__dict__


@pytest.mark.parametrize("shading", ["smooth", "flat", "normals", "depth", "ids"])
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_pictures_are_the_same(shading, sampling, force):
    arrays = MESHES["blob"]
    expected = tl.render(tl.Mesh(*arrays), size=SIZE, shading=shading, sampling=sampling)
    force(pays_to_cluster=True)
    assert_same(tl.render(tl.Mesh(*arrays), size=SIZE, shading=shading, sampling=sampling), expected)


def scenes(rng, n):
    """Instances of several meshes, some mirrored, some in each other, some behind the eye."""
    meshes = [tl.Mesh(*MESHES[name]) for name in ("blob", "torus-knot", "soup")] + [tl.Mesh(*tl.scenes.shape("cube"))]
    for _ in range(n):
        instances = []
        for _ in range(int(rng.integers(2, 9))):
            matrix = np.eye(4)
            matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.choice([-1, 1]) * rng.choice([0.3, 1, 2])
            matrix[:3, 3] = rng.choice([0, 1]) * rng.uniform(-3, 3, 3)
            instances.append((meshes[int(rng.integers(len(meshes)))], matrix))
        yield tl.Scene(instances)


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_scenes_have_the_same_bits(sampling, force):
    rng = np.random.default_rng(31)
    n_shown = 0
    for i, scene in enumerate(scenes(rng, 12)):
        camera = tl.Camera.look_at(rng.normal(size=3) * 4, rng.uniform(-1, 1, 3), near=0.1, far=100.0)
        options = {"cull": ("none", "back", "front")[i % 3], "depth_test": ("less", "greater")[i % 4 == 0]}
        options |= {"sampling": sampling, "threads": THREADS[i % len(THREADS)]}
        pictures = []
        for pays in (False, True):
            force(pays_to_cluster=pays)
            frags = tl.rasterize_mesh(scene, camera, SIZE, **options)
            pictures.append((frags.samples_id, frags.samples_depth, tl.render(scene, camera, SIZE, sampling=sampling)))
        for got, expected in zip(*pictures, strict=True):
            assert_same(got, expected)
        n_shown += len(np.unique(pictures[0][0])) > 10
    assert n_shown > 4


@pytest.mark.parametrize("sampling", ["center", "msaa4", "outer", "area"])
@ON_EACH_ISA
def test_instances_between_samples_are_left_out(isa, sampling, monkeypatch, force):
    """And nobody misses them: most of these are a third of a pixel wide."""
    rng = np.random.default_rng(41)
    meshes = [tl.Mesh(*tl.scenes.shape("cube")), tl.Mesh(np.float32(flat_grid(9)[0]), flat_grid(9)[1])]
    camera = tl.Camera.look_at((0, 0, 900), near=1.0, far=2000.0)
    drawn = []
    draw_rows = ClusteredMesh.draw_rows
    monkeypatch.setattr(ClusteredMesh, "draw_rows", lambda *a, **k: drawn.append(a[0]) or draw_rows(*a, **k))
    for trial in range(3):
        at = np.tile(np.eye(4), (200, 1, 1))
        at[:, :3, 3] = rng.uniform(-200, 200, (200, 3))
        scene = tl.Scene([(meshes[i % 2], matrix) for i, matrix in enumerate(at)])
        view = {"cull": ("none", "back")[trial % 2], "sampling": sampling}
        found = []
        for pays in (False, True):
            force(pays_to_cluster=pays)
            with on(isa):
                found.append([tl.silhouette(scene, camera, SIZE, sampling=sampling)])
                if sampling in ("center", "msaa4"):
                    frags = tl.rasterize_mesh(scene, camera, SIZE, **view)
                    found[-1] += [frags.samples_id, frags.samples_depth]
        for got, expected in zip(*found, strict=True):
            assert_same(got, expected)
        assert found[0][0].any()
    if sampling == "center":
        assert 20 < len(drawn) / 6 < 60  # of 200 instances


def test_scene_that_does_not_fit_is_refused_as_without(always):
    vertices = MESHES["blob"][0].astype(np.float32)
    scene = tl.Scene([tl.Mesh(vertices, MESHES["blob"][1]), tl.Mesh(vertices * np.float32(2.4e38), MESHES["blob"][1])])
    with pytest.raises(ValueError, match="vertices must stay finite under transform"):
        tl.rasterize_mesh(scene, tl.Camera.look_at((0, 0, 3), near=0.1, far=100.0), SIZE)


def test_holes_are_cut_out_of_clusters(always, force):
    vertices, triangles = MESHES["blob"]
    texels = np.zeros((8, 8, 4), np.uint8)
    texels[...] = 255
    texels[::2, ::2, 3] = 0
    material = tl.Material(texture=tl.Texture(texels), alpha_cutoff=0.5)
    uv = (vertices[:, :2] * 3).astype(np.float32)
    mesh = tl.Mesh(vertices, triangles, uv=uv, materials=[material])
    got = tl.render(mesh, size=SIZE)
    force(pays_to_cluster=False)
    assert_same(got, tl.render(mesh, size=SIZE))


@pytest.mark.parametrize("cut", [False, True])
def test_attributes_have_the_same_bits_with_all_vertices_snapped(cut, monkeypatch, force):
    mesh = as_arrays("blob")
    camera = tl.Camera.look_at((0, 0, 1.0 if cut else 3.0), near=0.3, far=100.0)
    view = {"transform": camera.clip_from_world(SIZE), "threads": 1}
    expected = draw(mesh, None, "less", **view)
    listed = []
    marked = engine.mark_vertices
    monkeypatch.setattr(engine, "mark_vertices", lambda *arrays: listed.append(1) or marked(*arrays))
    for pays in (False, True):
        force(pays_to_snap_all=pays)
        got = draw(mesh, Clusters(*mesh), "less", **view)
        listed.clear()
        assert_same(got.interpolate(mesh[0]), expected.interpolate(mesh[0]))
        assert len(listed) == (1 if not pays else cut)


def test_only_used_blocks_of_vertices_are_marked():
    corners = np.array([[0, 1, 2], [16, 3, 40], [33, 34, 35]], np.int32)
    is_used = np.zeros(4, np.uint8)
    engine.mark_vertices(np.array([-1, 0, 0, -1, 2], np.int32), corners, 64, is_used)
    assert is_used.tolist() == [1, 0, 1, 0]
    engine.mark_vertices(np.array([1], np.int32), corners, 64, is_used)
    assert is_used.tolist() == [1, 1, 1, 0]
    assert engine.mark_vertices(np.array([0, 1], np.int32), corners, 40, is_used) == 1
