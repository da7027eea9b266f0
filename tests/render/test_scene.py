"""Scenes: instances into one buffer, bit for bit the picture of one mesh that holds all of them."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, on, one_by_one
from scene_cases import CAMERA, CUBE, SIZE, SPHERE, joined, many, told_apart

import topleft as tl
from topleft._core import engine
from topleft._core.base.color import srgb_tables
from topleft._core.raster import choices
from topleft._core.raster.snap import Snapped
from topleft._meshes.camera.camera import Camera
from topleft._meshes.picture import draw_scene, placed, shade
from topleft._meshes.picture.draw_scene import split_rows
from topleft._meshes.picture.fragments import SceneFragments
from topleft._meshes.picture.render import rasterize_mesh
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene import scene as scenes
from topleft.methods.reference.sampling import mean


def assert_same_as_joined(got, expected, scene):
    assert_same(got.id, expected.triangle)
    assert_same(got.depth, expected.depth)
    instance, triangle = told_apart(scene, expected.triangle)
    assert_same(got.instance, instance)
    assert_same(got.triangle, triangle)


@ON_EACH_ISA
@pytest.mark.parametrize(
    "options", [{}, {"depth_test": "greater"}, {"depth_test": None}, {"cull": "back"}, {"method": "edge"}]
)
def test_scene_is_the_mesh_of_all_its_instances(isa, options):
    scene = many()
    with on(isa):
        expected = tl.rasterize(*joined(scene), SIZE, **options)
        assert len(np.unique(told_apart(scene, expected.triangle)[0])) > 5
        for threads in THREADS:
            assert_same_as_joined(rasterize_mesh(scene, CAMERA, SIZE, threads=threads, **options), expected, scene)


@ON_EACH_ISA
@pytest.mark.parametrize("sampling", ["msaa2", "msaa4", "msaa16"])
def test_scene_samples_are_those_of_the_mesh_of_all(isa, sampling):
    scene = many(2)
    with on(isa):
        expected = tl.rasterize(*joined(scene), SIZE, sampling=sampling)
        for threads in (1, 3):
            got = rasterize_mesh(scene, CAMERA, SIZE, sampling=sampling, threads=threads)
            assert_same(got.samples_id, expected.samples_triangle)
            assert_same(got.samples_depth, expected.samples_depth)
            instance, triangle = told_apart(scene, expected.samples_triangle)
            assert_same(got.samples_instance, instance)
            assert_same(got.samples_triangle, triangle)
            assert_same(got.sample(1).barycentric(), expected.sample(1).barycentric())


@pytest.mark.parametrize("n_vertices", [1, 100, 1 << 20])
def test_scene_any_number_of_instances_at_once_is_the_same(monkeypatch, n_vertices):
    monkeypatch.setattr(placed, "VERTICES_AT_ONCE", n_vertices)
    scene = many(3)
    assert_same_as_joined(rasterize_mesh(scene, CAMERA, SIZE), tl.rasterize(*joined(scene), SIZE), scene)
    for sampling in ("center", "msaa4", "outer", "inner"):
        expected = tl.coverage(*joined(scene), SIZE, sampling=sampling)
        assert_same(tl.silhouette(scene, CAMERA, SIZE, sampling=sampling), expected)


def test_scene_window_is_the_crop_of_the_whole():
    scene = many(4)
    whole = rasterize_mesh(scene, CAMERA, SIZE)
    part = rasterize_mesh(scene, CAMERA, (30, 25), origin=(21, 33), viewport=SIZE)
    for name in ("instance", "triangle", "depth"):
        assert_same(getattr(part, name), np.ascontiguousarray(getattr(whole, name)[33:58, 21:51]))
    assert_same(part.barycentric(), whole.barycentric()[33:58, 21:51])


def test_scene_equal_depths_go_to_the_lower_instance_then_triangle():
    quad = tl.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 2]])
    frags = rasterize_mesh(tl.Scene([quad, quad]), Camera.look_at((0, 0, 5)), (9, 9))
    assert np.unique(frags.instance).tolist() == [-1, 0]
    assert np.unique(frags.triangle).tolist() == [-1, 0]


def test_scene_attributes_are_those_of_the_mesh_of_all():
    scene = many(5)
    rng = np.random.default_rng(0)
    values = [rng.random((len(instance.mesh.vertices), 2)) for instance in scene]
    got, expected = rasterize_mesh(scene, CAMERA, SIZE), tl.rasterize(*joined(scene), SIZE)
    assert_same(got.barycentric(), expected.barycentric())
    assert_same(got.interpolate(values, background=-3), expected.interpolate(np.concatenate(values), background=-3))
    flat = [v[:, 0] for v in values]
    assert_same(got.interpolate(flat), expected.interpolate(np.concatenate(flat)))
    rows, cols = np.nonzero(got.mask)
    few = got.only(rows[::7], cols[::7])
    assert few.mask.sum() == len(rows[::7])
    assert_same(few.barycentric(), np.where(few.mask[..., None], expected.barycentric(), np.float32(0)))


def test_scene_mirrored_instance_keeps_its_outside():
    mirror = np.diag([-1.0, 1, 1, 1])
    turned = tl.Mesh(CUBE.vertices * [-1, 1, 1], CUBE.triangles[:, ::-1])
    for cull in ("none", "back", "front"):
        got = rasterize_mesh(tl.Scene([(CUBE, mirror)]), CAMERA, SIZE, cull=cull)
        assert_same(got.triangle, rasterize_mesh(turned, CAMERA, SIZE, cull=cull).triangle)
    got = tl.render(tl.Scene([(CUBE, mirror)]), CAMERA, SIZE, cull="back", edges=True)
    assert_same(got, tl.render(turned, CAMERA, SIZE, cull="back", edges=True))


@pytest.mark.parametrize("shading", ["smooth", "ids"])
def test_scene_picture_of_samples_is_their_mean_each_triangle_shaded_once(shading):
    scene, background = many(), (10, 200, 30, 255)
    look = {"shading": shading, "background": background}
    got = tl.render(scene, CAMERA, SIZE, sampling="msaa4", **look)
    frags = rasterize_mesh(scene, CAMERA, SIZE, sampling="msaa4")
    ids = np.stack([frags.sample(k).id for k in range(4)])
    first = (ids[:, None] == ids[None]).argmax(1)  # the first sample that sees the same
    pictures = np.stack([tl.shade(frags.sample(k), scene, CAMERA, **look) for k in range(4)])
    samples = np.take_along_axis(pictures, first[..., None], 0)
    rows = np.moveaxis(samples, 0, 2)
    expected = [[mean(pixel, is_straight=True, tables=srgb_tables()) for pixel in row] for row in rows]
    assert (first > 0).any()
    # The light of samples is not rounded: each by at most half a level, which the mean (concave) makes no larger.
    assert np.abs(got.astype(int) - np.array(expected)).max() <= (shading == "smooth")


@ON_EACH_ISA
def test_instances_of_ids_are_those_of_a_search(isa):
    rng = np.random.default_rng(5)
    for n in (1, 2, 7, 300):
        sizes = rng.integers(0, 5, n)
        first_ids = np.append(0, np.cumsum(sizes))
        ids = rng.integers(-2, first_ids[-1] + 2, (9, 40)).astype(np.int32)
        ids = np.repeat(ids, 3, 1)
        found = np.empty_like(ids)
        boxes = np.tile(np.array([120, 9, 0, 0], np.int32), (n, 1))
        with on(isa):
            engine.find_instances(ids, first_ids, found, boxes)
        expected = np.where(ids < 0, -1, np.searchsorted(first_ids, ids, side="right") - 1)
        assert_same(found, expected.astype(np.int32))
        for i, box in enumerate(boxes.tolist()):
            rows, columns = np.nonzero(expected == i)
            if rows.size:
                assert box == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
            else:
                assert box == [120, 9, 0, 0]


def test_scene_shares_the_arrays_of_its_mesh():
    scene = tl.Scene([SPHERE, (SPHERE, np.diag([2.0, 2, 2, 1]))])
    assert scene[0].mesh is scene[1].mesh is SPHERE
    assert (len(scene), scene.n_triangles) == (2, 2 * len(SPHERE.triangles))


def test_scene_frame_and_bounds_hold_all_instances():
    scene = many(6)
    points = np.concatenate([i.mesh.vertices @ i.transform[:3, :3].T + i.transform[:3, 3] for i in scene])
    assert np.allclose(scene.bounds, [points.min(0), points.max(0)], rtol=0, atol=1e-12)
    mask = tl.silhouette(scene, size=(64, 64))
    assert mask.any()
    assert not any(border.any() for border in (mask[0], mask[-1], mask[:, 0], mask[:, -1]))
    assert_same(tl.render(tl.Scene([CUBE]), size=SIZE), tl.render(CUBE, size=SIZE))


def test_scene_area_is_that_of_the_mesh_of_all():
    aside = np.eye(4)
    aside[0, 3] = 2.5
    scene = tl.Scene([CUBE, (CUBE, aside)])
    options = {"sampling": "area", "cull": "back"}
    got = tl.silhouette(scene, CAMERA, SIZE, **options)
    expected = tl.coverage(*joined(scene), SIZE, **options)
    # below 1 sums are exact; what rounds to less than nothing is cut off at 0 instance by instance
    assert np.abs(got - expected).max() <= 4 * 2.0**-24
    assert got.max() == 1


def test_scene_out_holds_the_mask():
    out = np.ones((70, 180), bool)[:, ::2]
    assert tl.silhouette(many(), CAMERA, SIZE, out=out) is out
    assert_same(out, tl.silhouette(many(), CAMERA, SIZE))


def test_scene_background_depth_is_where_nothing_is():
    frags = rasterize_mesh(many(), CAMERA, SIZE, background_depth=7)
    assert_same(frags.depth == 7, ~frags.mask)


def test_scene_of_empty_meshes_shows_nothing():
    empty = tl.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    frags = rasterize_mesh(tl.Scene([empty, empty]), CAMERA, (4, 3))
    assert not frags.mask.any()
    assert (frags.depth == np.inf).all()
    assert_same(frags.barycentric(), np.zeros((3, 4, 3), np.float32))
    assert repr(frags) == "SceneFragments(4x3, 2 instances, 0 triangles)"
    with pytest.raises(ValueError, match="a scene without triangles has no bounds"):
        tl.render(tl.Scene([empty]))


def test_mesh_has_one_instance():
    frags = rasterize_mesh(CUBE, size=(8, 6))
    assert_same(frags.instance, np.where(frags.mask, 0, -1).astype(np.int32))
    assert_same(frags.id, frags.triangle)
    assert not isinstance(frags, SceneFragments)


@pytest.mark.parametrize(
    ("transform", "message"),
    [
        (np.eye(3), r"transform must be \(4, 4\), \(3, 4\), \(R, t\), .*, got shape \(3, 3\)"),
        (np.full((4, 4), np.nan), "transform must hold finite numbers, got"),
        (np.ones((4, 4)), r"the last row of transform must be \[0, 0, 0, 1\], got \[1\.0, 1\.0, 1\.0, 1\.0\]"),
        (np.diag([1, 1, 0, 1]), "transform must not be singular, got"),
    ],
)
def test_instance_bad_transform_is_refused(transform, message):
    with pytest.raises(ValueError, match=message):
        tl.Instance(CUBE, transform)


def test_scene_without_instances_is_refused():
    with pytest.raises(ValueError, match="a scene needs at least one instance, got none"):
        tl.Scene([])


CUT = tl.Material(alpha_mode="mask", alpha_cutoff=0.75, opacity=0.5)
BENT = replace(tl.Camera.look_at((0, 0, 5)), lens=tl.FisheyeLens())
CORNERS_OF_A_SQUARE = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
LARGE = tl.Mesh(CORNERS_OF_A_SQUARE, np.tile(np.array([[0, 1, 2], [0, 2, 3]], np.int32), (1 << 19, 1)))


def large_scene():
    """2,049 squares of a million triangles, all but the first and the last behind the first: 2**31 + 2**20 in all."""
    matrices = np.tile(np.eye(4), (2049, 1, 1))
    matrices[:, :3, 3] = [-1, 0, -5]
    matrices[1:-1, :3, :3] *= 0.25
    matrices[0, :3, 3], matrices[-1, :3, 3] = [-1, 0, 0], [1.2, 0, 0]
    return tl.Scene([(LARGE, matrix) for matrix in matrices])


def test_scene_of_more_triangles_than_int32_counts_is_drawn():
    scene, camera, size = large_scene(), tl.Camera.look_at((0, 0, 5)), (64, 48)
    frags = tl.rasterize_mesh(scene, camera, size)
    few = tl.rasterize_mesh(tl.Scene([scene[0], scene[2048]]), camera, size)
    assert set(np.unique(few.instance)) == {-1, 0, 1}
    assert frags.id.dtype == np.int64
    assert np.array_equal(frags.instance, np.where(few.instance == 1, 2048, few.instance))
    assert np.array_equal(frags.triangle, few.triangle)
    assert np.array_equal(frags.id, np.where(few.mask, (frags.instance.astype(np.int64) << 20) + few.triangle, -1))
    assert np.array_equal(frags.depth, few.depth)
    assert np.array_equal(frags.barycentric(), few.barycentric())
    look = {"lights": [tl.Light((1, 2, 3))]}
    assert_same(
        tl.shade(frags, scene, camera, **look), tl.shade(few, tl.Scene([scene[0], scene[2048]]), camera, **look)
    )


@pytest.mark.parametrize(
    ("verb", "what"),
    [
        (lambda scene, camera: tl.visible_layers(scene, camera, (8, 8)), "a scene that is peeled"),
        (lambda scene, camera: tl.rasterize_mesh(scene, BENT, (8, 8)), "a scene behind a lens"),
        (
            lambda scene, camera: tl.render(
                scene, camera, (8, 8), material=tl.Material(alpha_mode="blend", opacity=0.5)
            ),
            "a scene that something shows through",
        ),
        (lambda scene, camera: tl.render(scene, camera, (8, 8), material=CUT), "a scene with holes in its materials"),
    ],
)
def test_scene_of_more_triangles_than_int32_counts_is_refused_where_it_has_to_be(verb, what):
    with pytest.raises(ValueError, match=f"{what} must have at most {2**31 - 1} triangles, got {2**31 + 2**20}"):
        verb(large_scene(), tl.Camera.look_at((0, 0, 5)))


def random_scene(rng):
    """Instances of three meshes anywhere, some twice in one place, some mirrored, and a camera."""
    spread = float(rng.choice([1, 3, 10]))
    standing: list[tl.Instance] = []
    for _ in range(int(rng.choice([2, 17, 40]))):
        matrix = np.eye(4)
        matrix[:3, :3] *= rng.choice([0.3, 1, 2, -1])
        matrix[:3, 3] = rng.normal(0, spread, 3)
        again = standing[-1].transform if standing and rng.random() < 0.2 else matrix
        standing.append(tl.Instance(BALLS[int(rng.integers(len(BALLS)))], again))
    return standing, tl.Camera.look_at(rng.normal(0, spread, 3), rng.normal(0, 0.3, 3), fov_y_deg=rng.uniform(20, 100))


BALLS = [tl.Mesh(vertices.astype(dtype), triangles)
         for dtype in (np.float32, np.float64) for vertices, triangles in (tl.scenes.blob(700),)]  # fmt: skip


@ON_EACH_ISA
@pytest.mark.parametrize("most_ids", [2**31 - 1, 5000, 1500])
@one_by_one("seed", range(6))
def test_instances_in_rounds_and_groups_are_drawn_as_one_after_the_other(isa, seed, most_ids, monkeypatch, force):
    rng = np.random.default_rng(seed)
    standing, camera = random_scene(rng)
    options = {
        "cull": str(rng.choice(["none", "back", "front"])), "depth_test": [None, "less", "greater"][seed % 3],
        "threads": int(rng.choice([1, 3])), "sampling": ["center", "msaa2"][seed % 2],
    }  # fmt: skip
    whole = tl.rasterize_mesh(tl.Scene(standing), camera, (60, 40), **options)
    mask_options = {"threads": 3, "sampling": ["center", "outer", "msaa4"][seed % 3]}
    mask = tl.silhouette(tl.Scene(standing), camera, (60, 40), **mask_options)
    force(pays_to_cluster=True, pays_to_draw_instances=True, pays_to_share_instances=True)
    monkeypatch.setattr(draw_scene, "ROUND", int(rng.choice([1, 4])))
    for module in (scenes, placed, draw_scene):
        monkeypatch.setattr(module, "INT32_MAX", most_ids)
    with on(isa):
        found = tl.rasterize_mesh(tl.Scene(standing), camera, (60, 40), **options)
        assert np.array_equal(tl.silhouette(tl.Scene(standing), camera, (60, 40), **mask_options), mask)
    assert found.id.dtype == (np.int64 if 700 * len(standing) > most_ids else np.int32)
    for name in ("id", "depth", "instance", "triangle", "samples_id", "samples_instance", "samples_triangle"):
        assert np.array_equal(getattr(found, name), getattr(whole, name)), name
    assert np.array_equal(found.barycentric(), whole.barycentric())
    n_in_row = max(len(set(row.ravel().tolist()) - {-1}) for row in found.samples_instance)
    monkeypatch.setattr(shade, "INT32_MAX", max(most_ids, 700 * n_in_row))  # the picture is shaded in some parts
    pictures = [tl.shade(frags, tl.Scene(standing), camera, shading="flat") for frags in (found, whole)]
    assert_same(*pictures)
    if found.id.dtype == np.int64 and n_in_row:
        monkeypatch.setattr(shade, "INT32_MAX", 699)
        with pytest.raises(ValueError, match="the instances in a row of pixels must have at most 699 triangles, got "):
            tl.shade(found, tl.Scene(standing), camera)


@pytest.mark.parametrize(("height", "n"), [(40, 1), (40, 2), (40, 3), (4, 4), (5, 4), (1, 1)])
def test_bands_of_instances_share_the_rows(height, n, monkeypatch):
    """Also where all instances lie in one row, above the window, or behind the eye."""
    camera = tl.Camera.look_at((0, 0, 9), near=0.1, far=50.0)
    at = np.tile(np.eye(4), (10, 1, 1))
    at[:, 1, 3], at[:, 2, 3] = np.repeat([-2, -2, 0, 1, 90], 2), np.tile([0, 20], 5)
    standing = [tl.Instance(BALLS[0], matrix) for matrix in at]
    seen = placed.Placed.parse(Shot.of(tl.Scene(standing), camera, (60, height)), {})
    with choices.forced(scene_triangles=0, scene_rows=0):
        for some in (range(10), (0, 2), (8,), (1, 3, 5), (4, 4, 4)):
            tops = split_rows(seen, np.array(some), n)
            assert tops[0] == 0
            assert tops[-1] == height
            assert len(tops) == n + 1
            assert min(np.diff(tops)) >= 1
        if n == 2:
            assert split_rows(seen, np.arange(0, 8, 2), n)[1] in range(20, 30)  # two at -2, one in the middle
        monkeypatch.setattr(draw_scene, "MOST_PIXELS_OF_PART", 60 * height - 1)  # what a mask counts ends there
        assert split_rows(seen, np.arange(0, 8, 2), n) == [height * k // n for k in range(n + 1)]
        monkeypatch.setattr(draw_scene, "MOST_PIXELS_OF_PART", 60 * height)
    for name, least in (("scene_rows", height), ("scene_triangles", 701)):  # a fifth of that high
        with choices.forced(**{"scene_triangles": 0, "scene_rows": 0, name: least}):
            assert split_rows(seen, np.arange(0, 8, 2), n) == [0, height]


@pytest.mark.parametrize("instance", [3, b"cube", (CUBE,), None, [CUBE, CUBE], tl.Scene([CUBE])])
def test_scene_of_something_else_is_refused(instance):
    with pytest.raises(TypeError, match=r"instances must be (Instance, a mesh, \(mesh, transform\) or|meshes).* got"):
        tl.Scene([instance])


def test_instance_of_no_mesh_is_refused():
    with pytest.raises(TypeError, match="mesh must be a Mesh, got ndarray"):
        tl.Instance(np.eye(3))


def test_scene_values_that_do_not_fit_are_refused():
    frags = rasterize_mesh(tl.Scene([CUBE, SPHERE]), CAMERA, (4, 4))
    with pytest.raises(ValueError, match="values must be one array for each of 2 instances, got 1"):
        frags.interpolate([np.zeros(8)])
    with pytest.raises(ValueError, match=r"values must have as many channels for each instance, got \[\(\), \(2,\)\]"):
        frags.interpolate([np.zeros(8), np.zeros((len(SPHERE.vertices), 2))])


def test_scene_unknown_option_is_refused():
    with pytest.raises(TypeError, match="unknown option 'out'"):
        rasterize_mesh(many(), CAMERA, SIZE, out=None)
    with pytest.raises(ValueError, match="sampling 'area' gives no ids"):
        rasterize_mesh(many(), CAMERA, SIZE, sampling="area")
    with pytest.raises(ValueError, match="method 'bresenham_scanline' has no depth"):
        rasterize_mesh(many(), CAMERA, SIZE, method="bresenham_scanline")


def test_small_instances_are_counted_once(monkeypatch):
    """Not again for each instance that follows in a chunk."""
    counted = []
    kept = Snapped.n_vertices.fget
    monkeypatch.setattr(Snapped, "n_vertices", property(lambda self: counted.append(1) or kept(self)))
    scene = tl.Scene([CUBE] * 300)
    tl.rasterize_mesh(scene, CAMERA, SIZE)
    assert len(counted) < 10 * len(scene)
