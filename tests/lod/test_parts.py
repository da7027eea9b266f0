"""Meshes whose parts have levels of their own: where they meet, what a view draws of them, and what is kept."""

import pickle

import numpy as np
import pytest
from outlines import SIZE, check_outlines
from surface_samples import corners_of, sampled_distance

import topleft as tl
from topleft._apps.batch.workers import coarser_levels_of
from topleft._meshes.lod import detail, simplify
from topleft._meshes.lod.collapse import border_points, open_sides
from topleft._meshes.lod.distance import welded
from topleft._meshes.lod.parts import CutMesh

SIDE = 72

#: Along the ground: the nearest part begins at the camera, the farthest ends at the horizon.
ALONG = tl.Camera.look_at((0.5, 0.02, 0.22), (0.5, 0.6, 0.0), up=(0, 0, 1), fov_y_deg=60, near=1e-3)
#: From above, near enough that the ground fills the frame, askew so that distances differ.
ABOVE = tl.Camera.look_at((0.5, 0.1, 0.5), (0.5, 0.5, 0), up=(0, 0, 1), fov_y_deg=40, near=1e-3)


def hills(**attributes):
    """A square of hills, z up, whose vertices are float64 numbers that float32 cannot hold."""
    y, x = np.mgrid[0 : SIDE + 1, 0 : SIDE + 1] / SIDE
    z = 0.03 * np.sin(9 * x) * np.cos(7 * y) + 0.004 * np.sin(40 * x + 31 * y)
    first = (np.arange(SIDE)[:, None] * (SIDE + 1) + np.arange(SIDE)).ravel()
    triangles = np.concatenate([first[:, None] + [0, 1, SIDE + 2], first[:, None] + [0, SIDE + 2, SIDE + 1]])
    return tl.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), triangles, **attributes)


@pytest.fixture(scope="module", autouse=True)
def small_parts():
    """Parts of some 160 triangles, of meshes of 5,000: the same code as of a million."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simplify, "LEAST_PARTED", 5000)
        patch.setattr(simplify, "OF_PART", 160)
        patch.setattr(simplify, "MOST_TO_COMPARE", 3000)
        patch.setattr(detail, "LEAST_PARTED", 3000)
        patch.setattr(detail, "MOST_CUT", 0.9)
        yield


def with_levels(mesh):
    tl.simplify(mesh, smallest=20)
    return mesh


@pytest.fixture(scope="module")
def ground():
    return with_levels(hills())


@pytest.fixture(scope="module")
def painted():
    """The same in float32, with attributes, and of two materials."""
    plain = hills()
    x, y = plain.vertices[:, 0], plain.vertices[:, 1]
    colors = np.stack([255 * x, 255 * y, 0 * x], axis=1).astype(np.uint8)
    middles = x[plain.triangles].mean(axis=1)
    return with_levels(
        tl.Mesh(
            plain.vertices.astype(np.float32), plain.triangles, colors=colors, uv=plain.vertices[:, :2],
            materials=(tl.Material((250, 250, 250)), tl.Material((99, 150, 250), specular=0.4)),
            material_of_triangle=(middles > 0.5).astype(int),
        )
    )  # fmt: skip


def border_of(vertices, triangles):
    """The sides that one triangle has, by the places of their ends."""
    points, corners = welded(vertices, triangles)
    return {frozenset(map(tuple, points[side])) for side in open_sides(corners).tolist()}


def test_parts_stand_for_four_of_the_level_before(ground):
    parts = simplify.levels_of(ground).parts
    assert [len(bounds) for bounds in parts.bounds][:4] == [64, 16, 4, 1]
    assert sorted(parts.order.tolist()) == list(range(len(ground.triangles)))
    sizes = np.diff(parts.starts[0])
    assert sizes.max() - sizes.min() <= 1


def test_parts_bound_is_never_below_their_distance(ground):
    levels = simplify.levels_of(ground)
    parts, is_coarser = levels.parts, []
    for level in (1, 2):
        step = len(parts.bounds[0]) // len(parts.bounds[level])
        for i, bound in list(enumerate(parts.bounds[level].tolist()))[:: 5 - level]:
            rows = parts.order[parts.starts[0][step * i] : parts.starts[0][step * (i + 1)]]
            own = levels[level].mesh.triangles[slice(*parts.starts[level][i : i + 2])]
            is_coarser.append(len(own) < len(rows))
            one, other = tl.Mesh(ground.vertices, ground.triangles[rows]), tl.Mesh(levels[level].mesh.vertices, own)
            assert sampled_distance(corners_of(one), corners_of(other), 1) <= bound
        assert levels[level].bound == parts.bounds[level].max()
    assert all(is_coarser)


@pytest.mark.parametrize("name", ["ground", "painted"])
def test_parts_of_several_levels_fit(request, name):
    mesh = request.getfixturevalue(name)
    for tolerance in (0.3, 0.5, 1.0, 2.0):
        found = tl.choose_detail(mesh, ALONG, SIZE, tolerance=tolerance)
        own = found.mesh.triangles[(np.diff(found.mesh.triangles, axis=1) != 0).any(axis=1)]
        assert found.n_parts > 1
        assert border_of(found.mesh.vertices, own) == border_of(mesh.vertices, mesh.triangles)


def test_parts_from_above_leave_no_pixel_open(ground):
    size = (480, 320)
    found = tl.choose_detail(ground, ABOVE, size, tolerance=0.5)
    assert found.n_parts > 1
    for sampling in ("center", "msaa4"):
        frags = tl.rasterize_mesh(ground, ABOVE, size, tolerance=0.5, sampling=sampling)
        is_ground = tl.rasterize_mesh(ground, ABOVE, size, sampling=sampling).triangle >= 0
        assert is_ground.all()
        assert (frags.triangle >= 0).all()


def test_parts_near_and_far_have_different_levels(ground):
    found = tl.choose_detail(ground, ALONG, SIZE, tolerance=0.5)
    assert found.n_parts > 1
    assert found.level > 1
    assert found.n_drawn < len(ground.triangles) / 2
    assert tl.choose_detail(ground, ALONG, SIZE, tolerance=0).mesh is ground
    assert "each part is the coarsest of levels 0 to" in found.why


@pytest.mark.parametrize("tolerance", [0.25, 4.0])
@pytest.mark.parametrize("camera", [ALONG, ABOVE], ids=["along", "above"])
def test_parts_never_move_outlines_by_more_than_the_tolerance(ground, camera, tolerance):
    check_outlines(ground, camera, tolerance)


OPTIONS = [
    {}, {"threads": 3}, {"sampling": "msaa4"}, {"depth_test": "greater"}, {"depth_test": None}, {"method": "edge"},
    {"subpixel_bits": 4}, {"subpixel_bits": "exact"},
    {"origin": (20, 30), "viewport": (192, 128)},
]  # fmt: skip


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_rasterize_mesh_in_parts_is_the_picture_of_their_mesh(ground, options):
    window = {name: options[name] for name in ("viewport", "origin") if name in options}
    found = tl.choose_detail(ground, ALONG, SIZE, tolerance=0.5, **window)
    assert found.n_parts > 1
    own = tl.rasterize_mesh(ground, ALONG, SIZE, tolerance=0.5, **options)
    matrix = ALONG.clip_from_world(options.get("viewport", SIZE))
    whole = tl.rasterize(found.mesh.vertices, found.mesh.triangles, SIZE, transform=matrix, **options)
    assert np.array_equal(own.triangle, whole.triangle)
    assert np.array_equal(own.depth, whole.depth)
    assert np.array_equal(own.barycentric(), whole.barycentric(), equal_nan=True)


def test_rasterize_mesh_in_parts_culled_is_the_mesh_itself(ground):
    one, other = (tl.rasterize_mesh(ground, ALONG, SIZE, cull="back", tolerance=t).triangle for t in (0.0, 0.5))
    assert np.array_equal(one, other)


@pytest.mark.parametrize("name", ["ground", "painted"])
@pytest.mark.parametrize("options", [{}, {"shading": "flat"}, {"sampling": "msaa4"}, {"edges": True}], ids=str)
def test_render_in_parts_is_the_picture_of_their_mesh(request, name, options):
    mesh = request.getfixturevalue(name)
    found = tl.choose_detail(mesh, ALONG, SIZE, tolerance=0.5)
    assert found.n_parts > 1
    own = tl.render(mesh, ALONG, SIZE, tolerance=0.5, **options)
    if "edges" in options:  # lines are those of whole levels
        assert np.array_equal(own, tl.render(mesh, ALONG, SIZE, **options))
    else:
        assert np.array_equal(own, tl.render(found.mesh, ALONG, SIZE, **options))


def test_parts_of_a_mesh_without_normals_are_lit_as_one(ground):
    """Vertices at the sides of parts have the normals of the whole surface, not those of their part."""
    parts = simplify.levels_of(ground).parted.mesh(np.arange(64, dtype=np.int32))
    of_place = dict(zip(map(tuple, ground.vertices), ground.vertex_normals().astype(np.float32), strict=True))
    used = np.unique(parts.triangles[np.flatnonzero(parts.drawn_triangles.any(axis=1))])
    assert len(used) > len(ground.vertices)
    assert np.array_equal(parts.normals[used], [of_place[tuple(place)] for place in parts.vertices[used]])


def test_parts_outside_of_the_picture_are_coarse(ground):
    aside = tl.Camera.look_at((0.5, 0.5, 0.05), (0.5, 0.9, 0.0), up=(0, 0, 1), fov_y_deg=40, near=1e-3)
    found = tl.choose_detail(ground, aside, (960, 640), tolerance=0.02)
    assert found.n_parts > 1
    points = found.mesh.vertices[found.mesh.triangles[(np.diff(found.mesh.triangles, axis=1) != 0).any(axis=1)]]
    behind = points[:, :, 1].max(axis=1) < 0.4
    assert 0 < behind.sum() < 0.2 * (hills().vertices[ground.triangles][:, :, 1].max(axis=1) < 0.4).sum()


@pytest.mark.parametrize("options", [{}, {"sampling": "msaa4"}, {"subpixel_bits": "exact"}, {"edges": True}], ids=str)
def test_scene_of_one_in_parts_is_the_mesh(painted, options):
    subjects = painted, tl.Scene([painted])
    one, other = (tl.render(subject, ALONG, SIZE, tolerance=0.5, **options) for subject in subjects)
    assert np.array_equal(one, other)


def test_instance_in_parts_is_placed(painted):
    aside = np.eye(4)
    aside[0, 3] = 0.25
    moved = tl.rasterize_mesh(tl.Scene([(painted, aside)]), ALONG, SIZE, tolerance=0.5)
    assert moved.triangle.max() >= len(painted.triangles)  # rows of parts of coarser levels


def among_balls(mesh, *, n_before=3):
    """A scene of balls, some of which the ground hides, and the mesh among them, moved."""
    ball, aside = tl.Mesh(*tl.scenes.icosphere(2)), np.eye(4)
    aside[0, 3] = 0.01
    places = np.tile(np.diag([0.02, 0.02, 0.02, 1.0]), (8, 1, 1))
    places[:, :3, 3] = [(0.1 + 0.1 * i, 0.3 + 0.05 * i, 0.05 * (i % 3) - 0.04) for i in range(8)]
    balls = [(ball, place) for place in places]
    return tl.Scene([*balls[:n_before], (mesh, aside), *balls[n_before:]]), aside


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("n_before", [0, 3, 8])
def test_scene_in_parts_is_the_picture_of_their_mesh(ground, options, n_before):
    scene, aside = among_balls(ground, n_before=n_before)
    window = {name: options[name] for name in ("viewport", "origin") if name in options}
    found = tl.choose_detail(ground, ALONG, SIZE, tolerance=0.5, transform=aside, **window)
    assert found.n_parts > 1
    balls = [levels_of_ball(one, window) for one in scene]
    own = tl.rasterize_mesh(scene, ALONG, SIZE, tolerance=0.5, **options)
    meshes = [found.mesh if one.mesh is ground else ball for one, ball in zip(scene, balls, strict=True)]
    whole = tl.rasterize_mesh(with_meshes(scene, meshes), ALONG, SIZE, **options)
    is_painted_last = options == {"depth_test": None} and n_before == 8
    assert len(np.unique(own.instance)) > 4 or is_painted_last
    assert np.array_equal(own.id, whole.id)
    assert np.array_equal(own.samples_depth, whole.samples_depth)
    assert np.array_equal(own.barycentric(), whole.barycentric(), equal_nan=True)


def with_meshes(scene, meshes):
    """The scene with other meshes in the same places."""
    return tl.Scene([one.but(mesh=mesh) for one, mesh in zip(scene, meshes, strict=True)])


def levels_of_ball(one, window):
    if len(one.mesh.triangles) > 1000:
        return one.mesh
    return tl.choose_detail(one.mesh, ALONG, SIZE, tolerance=0.5, transform=one.transform, **window).mesh


@pytest.mark.parametrize("options", [{}, {"shading": "flat"}, {"sampling": "msaa4"}, {"cull": "none"}], ids=str)
def test_render_of_a_scene_in_parts_is_the_picture_of_their_mesh(painted, options):
    scene, aside = among_balls(painted)
    found = tl.choose_detail(painted, ALONG, SIZE, tolerance=0.5, transform=aside)
    assert found.n_parts > 1
    meshes = [found.mesh if one.mesh is painted else levels_of_ball(one, {}) for one in scene]
    own = tl.render(scene, ALONG, SIZE, tolerance=0.5, **options)
    assert np.array_equal(own, tl.render(with_meshes(scene, meshes), ALONG, SIZE, **options))


@pytest.mark.parametrize("options", [{}, {"subpixel_bits": "exact"}], ids=str)
def test_render_of_a_scene_with_holes_in_parts_is_the_picture_of_their_mesh(painted, options):
    """Leaves with holes before a ground in parts."""
    scene, aside = among_balls(painted)
    leaf = tl.Material(texture=tl.Texture(np.indices((8, 8)).sum(axis=0)[:, :, None] % 2 * np.uint8([0, 0, 0, 255])
                                          + np.uint8([9, 99, 9, 0])), alpha_mode="mask")  # fmt: skip
    square = tl.Mesh([(0.2, 0.3, 0), (0.6, 0.3, 0), (0.6, 0.3, 0.2), (0.2, 0.3, 0.2)], [(0, 1, 2), (0, 2, 3)],
                     uv=[(0, 0), (1, 0), (1, 1), (0, 1)], materials=(leaf,))  # fmt: skip
    scene = tl.Scene([square, *scene])
    found = tl.choose_detail(painted, ALONG, SIZE, tolerance=0.5, transform=aside)
    meshes = [found.mesh if one.mesh is painted else levels_of_ball(one, {}) for one in scene]
    meshes[0] = square
    own = tl.render(scene, ALONG, SIZE, tolerance=0.5, **options)
    assert np.array_equal(own, tl.render(with_meshes(scene, meshes), ALONG, SIZE, **options))


def test_scene_of_the_same_mesh_twice_has_parts_of_each(ground, monkeypatch):
    farther = np.eye(4)
    farther[:3, 3] = 0, 1, -0.01
    scene = tl.Scene([ground, (ground, farther)])
    with monkeypatch.context() as patch:
        patch.delattr(CutMesh, "drawn_triangles")  # clusters are drawn
        patch.setattr(tl.Mesh, "drawn_triangles", None)
        own = tl.rasterize_mesh(scene, ALONG, SIZE, tolerance=0.5)
    meshes = [tl.choose_detail(ground, ALONG, SIZE, tolerance=0.5, transform=one.transform) for one in scene]
    assert meshes[0].n_parts > 1
    whole = tl.rasterize_mesh(with_meshes(scene, [one.mesh for one in meshes]), ALONG, SIZE)
    assert np.array_equal(own.triangle, whole.triangle)
    assert np.array_equal(own.instance, whole.instance)


def test_mesh_of_parts_can_be_pickled(ground):
    found = tl.choose_detail(ground, ALONG, SIZE, tolerance=0.5).mesh
    same = pickle.loads(pickle.dumps(found))
    assert type(same) is tl.Mesh
    for name in ("vertices", "triangles", "normals"):
        assert np.array_equal(getattr(same, name), getattr(found, name))


def test_mesh_of_parts_keeps_the_axis_that_is_up(ground):
    upright = tl.Mesh(ground.vertices, ground.triangles, up="z")
    assert tl.choose_detail(upright, ALONG, SIZE, tolerance=0.5).mesh.up == "z"


def test_parts_saved_and_loaded_are_the_same(tmp_path, painted):
    simplify.levels_of(painted).save(tmp_path / "ground.npz")
    again = pickle.loads(pickle.dumps(painted))
    tl.Levels.load(tmp_path / "ground.npz", again)
    one, other = (tl.rasterize_mesh(mesh, ALONG, SIZE, tolerance=0.5).triangle for mesh in (painted, again))
    assert np.array_equal(one, other)
    assert tl.choose_detail(again, ALONG, SIZE, tolerance=0.5).n_parts > 1


CRAFTED = {
    "order": [np.zeros(3), np.array([-1]), np.array([10**6]), np.array(["x"])],
    "starts_1": [np.array([0]), np.array([0, 7]), np.array("x"), np.zeros((2, 2), np.int64)],
    "bounds_0": [np.zeros(3), np.full(64, np.nan), np.full(64, -1.0)],
}


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in CRAFTED.items() for value in values])
def test_parts_of_a_crafted_file_are_refused(tmp_path, ground, name, value):
    simplify.levels_of(ground).save(tmp_path / "ground.npz")
    with np.load(tmp_path / "ground.npz") as file:
        arrays = dict(file) | {name: value}
    np.savez(tmp_path / "ground.npz", **arrays)
    with pytest.raises(tl.MeshError, match=r"ground.npz'"):
        tl.Levels.load(tmp_path / "ground.npz", hills())


def test_parts_go_to_other_processes_with_their_levels(ground):
    ((mesh, *levels),) = pickle.loads(pickle.dumps(coarser_levels_of(ground)))
    assert np.array_equal(tl.Levels(mesh, *levels).parts.order, simplify.levels_of(ground).parts.order)


def test_parts_that_cannot_be_collapsed_stay_and_fit(monkeypatch):
    """A part with a border that would not stay keeps its triangles, and the others fit to it."""
    mesh, calls = hills(), []

    def stubborn(triangles, collapsed):
        calls.append(len(triangles))
        return len(calls) % 3 > 0 and keeps(triangles, collapsed)

    keeps = simplify.keeps_border
    monkeypatch.setattr(simplify, "keeps_border", stubborn)
    levels = tl.simplify(mesh, smallest=20)
    sizes = np.diff(levels.parts.starts[1])
    assert sizes.max() > 2 * sizes.min()
    for level, bounds in zip(levels[1:], levels.parts.bounds[1:], strict=True):
        assert len(bounds) == 1 or border_of(level.mesh.vertices, level.mesh.triangles) == border_of(
            mesh.vertices, mesh.triangles
        )


def test_levels_go_on_as_one_part_where_parts_cannot_be_collapsed(monkeypatch):
    mesh = hills()
    monkeypatch.setattr(
        simplify, "coarser_part", lambda part, own, *_: simplify.CoarserPart(part, *border_and_rows(part, own))
    )
    levels = tl.simplify(mesh, smallest=20)
    assert [len(bounds) for bounds in levels.parts.bounds][:3] == [64, 1, 1]
    assert len(levels[2].mesh.triangles) < len(mesh.triangles) / 8
    found = tl.choose_detail(mesh, ALONG, SIZE, tolerance=0.5)
    assert found.n_parts in (0, 64)
    far = tl.Camera.look_at((0.5, 0.5, 60), (0.5, 0.5, 0), fov_y_deg=40)
    assert tl.choose_detail(mesh, far, SIZE, tolerance=0.5).level >= 2


def border_and_rows(part, own):
    border = border_points(part.triangles)
    return border, own[border]
