"""Whether a view of a mesh in clusters, or of instances, is drawn from these: what becomes of some of them decides."""

import numpy as np
import pytest

import topleft as tl
from topleft._core.base.options import Sink
from topleft._core.raster import choices
from topleft._core.raster.cluster_draw import ClusteredMesh, Survey
from topleft._core.raster.clusters import Backoff, Clusters
from topleft._core.raster.view import View
from topleft._meshes.picture import draw_scene
from topleft._meshes.picture.draw_scene import count_layers, survey_instances
from topleft._meshes.picture.holes import draw_visible
from topleft._meshes.picture.placed import Placed
from topleft._meshes.picture.shot import Shot

SIZE = (160, 120)
CAMERA = tl.Camera.look_at((0, 0, 3), near=0.01, far=100.0)

MATRIX = CAMERA.clip_from_world(SIZE)


def as_floats(vertices, triangles):
    return vertices.astype(np.float32), triangles.astype(np.int32)


FINE = as_floats(*tl.scenes.blob(300_000))


@pytest.mark.parametrize(
    ("n", "cull", "outside", "front", "pays"),
    [
        (30_000, "none", 0.0, 0.4, False),
        (30_000, "none", 0.2, 0.4, True),
        (30_000, "back", 0.5, 0.4, False),
        (30_000, "back", 0.7, 0.1, True),
        (100_000, "none", 0.0, 0.5, True),
        (100_000, "front", 0.0, 0.5, False),
        (100_000, "back", 0.4, 0.5, True),
        (9_000_000, "back", 0.0, 0.5, True),
        (9_000_000, "none", 0.0, 0.9, False),
    ],
)
def test_clusters_are_drawn_where_enough_is_left_out(n, cull, outside, front, pays):
    view = View.parse(SIZE, {"cull": cull})
    assert choices.pays_to_draw_clusters(view, n, Survey(outside, 0.0, 1 - outside - front, front)) == pays


@pytest.mark.parametrize(
    ("n", "size", "beyond", "pays"),
    [
        (30_000, (640, 480), 0.0, True),
        (300_000, (1920, 1080), 0.0, False),  # a large picture of a whole mesh is drawn in bands
        (300_000, (1920, 1080), 0.5, True),  # from inside
        (30_000, (1920, 1080), 0.5, False),
        (1_000_000, (1920, 1080), 0.0, True),
    ],
)
def test_clusters_of_a_large_picture_are_drawn_where_triangles_are_many(n, size, beyond, pays):
    few = Survey(0.9, 0.0, 0.1, 0.0)
    assert choices.pays_to_draw_from_clusters(View.parse(size, {}), n, few, lambda: beyond) == pays


@pytest.mark.parametrize(
    ("n", "cull", "outside", "front", "beyond", "pays"),
    [
        (300_000, "none", 0.0, 0.4, 0.0, True),
        (100_000, "none", 0.0, 0.4, 0.0, False),  # too few for the pixels
        (300_000, "none", 0.0, 0.9, 0.0, False),  # most show
        (1_000_000, "back", 0.0, 0.4, 0.0, False),
        (10_000_000, "back", 0.0, 0.4, 0.0, True),
        (300_000, "back", 0.95, 0.0, 0.5, True),  # from inside
        (300_000, "back", 0.95, 0.0, 0.0, False),
        (300_000, "back", 0.5, 0.4, 0.5, False),
    ],
)
def test_samples_are_drawn_from_clusters_where_triangles_are_many(n, cull, outside, front, beyond, pays):
    view, survey = View.parse((1920, 1080), {"cull": cull, "sampling": "msaa4"}), Survey(outside, 0.0, 0.0, front)
    assert choices.pays_to_draw_samples(view, n, survey, lambda: beyond) == pays


@pytest.mark.parametrize("clip_depth", ["minus_one_to_one", "zero_to_one"])
def test_vertices_beyond_near_and_far_are_counted(clip_depth):
    points = np.array([[0, 0, z] for z in (-3, -1.5, -0.5, 0.5, 0.75, 2)], np.float32)
    clusters = Clusters(points, np.array([[0, 1, 2], [3, 4, 5]], np.int32))
    view = View.parse(SIZE, {"transform": np.eye(4), "clip_depth": clip_depth})
    assert ClusteredMesh(clusters, view).share_clipped() == (0.5 if clip_depth == "minus_one_to_one" else 4 / 6)


def test_mesh_of_several_samples_is_drawn_from_clusters_where_they_pay(monkeypatch):
    n_planes, draw_plane = [], ClusteredMesh.draw
    monkeypatch.setattr(ClusteredMesh, "draw", lambda *a: n_planes.append(1) or draw_plane(*a))
    mesh = tl.Mesh(*FINE)
    mesh.note_drawn()
    for cull, n_drawn in (("none", 4), ("back", 0)):
        n_planes.clear()
        frags = draw_visible(Shot.of(mesh, CAMERA, SIZE), sampling="msaa4", cull=cull)
        assert len(n_planes) == n_drawn
        expected = tl.rasterize(*FINE, SIZE, transform=MATRIX, sampling="msaa4", cull=cull)
        assert (frags.samples_triangle == expected.samples_triangle).all()


@pytest.mark.parametrize("cull", ["none", "back", "front"])
def test_survey_counts_what_is_left_out(cull):
    clusters = Clusters(*FINE)
    camera = tl.Camera.look_at((0, 0, 3), near=0.01, far=100.0, fov_y_deg=20)
    view = {"transform": camera.clip_from_world(SIZE), "cull": cull}
    scene = ClusteredMesh(clusters, View.parse(SIZE, view))
    seen = scene.survey(len(clusters))
    assert 0 < scene.count_drawn(Sink.NEAREST) <= round(len(clusters) * (seen.back + seen.front)) < len(clusters) / 2
    assert round(sum(seen), 9) == 1
    assert seen.outside > 0.5
    assert (seen.turned > 0) == (cull != "none")
    some = scene.survey(50)
    assert all(abs(a - b) < 0.2 for a, b in zip(some, seen, strict=True))  # of about 50


def test_survey_of_nothing_is_nothing():
    clusters = Clusters(np.zeros((3, 3), np.float32), np.empty((0, 3), np.int32))
    view = View.parse(SIZE, {"transform": np.eye(4)})
    assert ClusteredMesh(clusters, view).survey() == (0, 0, 0, 0)


def standing(places, mesh=None):
    """Instances of a mesh at some places."""
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, 3] = places
    mesh = tl.Mesh(*tl.scenes.shape("cube")) if mesh is None else mesh
    return tl.Scene([(mesh, matrix) for matrix in matrices])


ORTHO = tl.Camera.look_at((0, 0, 30), ortho_height=8.0).clip_from_world((100, 100))


@pytest.mark.parametrize(
    ("places", "expected"),
    [
        ([(0, 0, 0)], 1),
        ([(-3, 0, 0), (3, 0, 0)], 1),
        ([(0, 0, 0), (0, 0, -5)], 2),
        ([(0, 0, 0), (0, 0, -5), (0, 0, 5), (3, 0, 0)], 2),
        ([(50, 0, 0)], 0),
    ],
)
def test_layers_are_boxes_behind_each_other(places, expected):
    assert count_layers(standing(places), ORTHO) == expected


def test_box_about_the_eye_is_no_layer():
    camera = tl.Camera.look_at((0, 0, 0), (0, 0, 1), near=0.01, far=100.0)
    assert count_layers(standing([(0, 0, 0), (0, 0, 20)]), camera.clip_from_world((100, 100))) == 1


def test_survey_of_instances_weighs_them_by_their_triangles():
    scene = standing([(0, 0, 0), (500, 0, 0)], tl.Mesh(*FINE))
    placed = Placed.parse(Shot.of(scene, CAMERA, SIZE), {})
    assert survey_instances(placed).outside == 0.5
    small = tl.Mesh(*as_floats(*tl.scenes.blob(100_000)))
    both = tl.Scene([*scene[:1], (small, scene[1].transform)])
    placed = Placed.parse(Shot.of(both, CAMERA, SIZE), {})
    share = len(small.triangles) / both.n_triangles
    assert survey_instances(placed).outside == pytest.approx(share, abs=1e-12)  # a quotient of sums of doubles


@pytest.mark.parametrize(
    ("view", "outside", "layers", "pays"),
    [
        ({}, 0.0, 1.0, False),
        ({}, 0.2, 1.0, True),
        ({"cull": "back"}, 0.0, 1.0, False),
        ({"cull": "back"}, 0.0, 5.0, True),
        ({"sampling": "msaa4"}, 0.0, 1.5, False),
        ({"sampling": "msaa4"}, 0.0, 3.0, True),
        ({"sampling": "msaa4"}, 0.5, 0.0, True),
    ],
)
def test_instances_are_drawn_from_clusters_where_enough_is_left_out(view, outside, layers, pays):
    seen = Survey(outside, 0.0, 0.6 - outside, 0.4)
    assert choices.pays_to_draw_instances(View.parse(SIZE, view), 9, 70_000, seen, lambda: layers) == pays


@pytest.mark.parametrize(
    ("size", "n_triangles", "pays"),
    [((64, 64), 320, False), ((64, 64), 1280, False), ((64, 64), 5120, True), ((640, 480), 320, False),
     ((640, 480), 1280, True), ((1920, 1080), 320, True)],
)  # fmt: skip
def test_instances_of_few_triangles_are_drawn_whole_in_small_pictures(size, n_triangles, pays):
    """200 balls, seven deep: from clusters 0.1 times as fast where that is not chosen, and up to 2.7 times."""
    seen = Survey(0.0, 0.0, 0.6, 0.4)
    assert choices.pays_to_draw_instances(View.parse(size, {}), 200, n_triangles, seen, lambda: 7.1) == pays


def test_scene_asks_before_it_draws_clusters(monkeypatch, force):
    scene = standing([(0, 0, -3.0 * k) for k in range(16)], tl.Mesh(*as_floats(*tl.scenes.blob(10_000))))
    drawn = []
    draw = draw_scene.draw_round
    monkeypatch.setattr(draw_scene, "draw_round", lambda *a, **k: drawn.append(1) or draw(*a, **k))
    camera = tl.Camera.look_at((0, 0, 30), ortho_height=4.0, near=1.0, far=100.0)
    for layers, n_drawn in ((3.0, 1), (100.0, 0)):
        drawn.clear()
        force(cluster_layers=(layers, 2.0), cluster_drawn=0.0)
        tl.rasterize_mesh(scene, camera, SIZE, cull="back", threads=1)
        assert len(drawn) == n_drawn


def test_backoff_doubles_and_ends_when_clusters_pay():
    backoff, asked = Backoff(), []
    for i in range(40):
        if backoff.is_over():
            asked.append(i)
            backoff.note(pays=i > 20)
    assert asked == [0, 3, 8, 17, 26, *range(27, 40)]


def test_mesh_drawn_whole_is_not_surveyed_for_each_picture(force):
    mesh = tl.Mesh(*tl.scenes.blob(21_000))
    surveyed = []
    force(pays_to_draw_clusters=lambda *_: surveyed.append(1) is not None)
    expected = tl.rasterize_mesh(mesh, size=SIZE).triangle
    for _ in range(9):
        assert (tl.rasterize_mesh(mesh, size=SIZE).triangle == expected).all()
    assert len(surveyed) == 3
