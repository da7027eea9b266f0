"""Materials whose back does not show: what is drawn is what is left when these triangles are taken out."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import one_by_one

import topleft as tl

SIZE = (120, 90)
ONE, TWO = tl.Material((200, 90, 60), double_sided=False), tl.Material((60, 90, 200))
KNOT = tl.Mesh(*tl.scenes.shape("torus-knot"))
SPHERE = tl.Mesh(*tl.scenes.shape("sphere"))
ROWS = np.arange(len(KNOT.triangles)) % 3 % 2
MIXED = replace(KNOT, materials=[ONE, TWO], material_of_triangle=ROWS)
ALL = replace(KNOT, materials=[ONE])
NEAR = tl.Camera.look_at((0.2, 0.1, 3.0), near=2.7, far=9)
FRAMED = tl.Camera.framing(KNOT, aspect=4 / 3)
CAMERAS = {"framed": FRAMED, "near": NEAR, "ortho": tl.Camera.framing(KNOT, aspect=4 / 3, ortho=True)}


def drawn_apart(mesh, camera, size=SIZE, **options):
    """Ids and depth: triangles with two sides as they are, the others with their backs culled; the nearer of both."""
    is_single = np.array([not one.double_sided for one in mesh.materials])[mesh.material_of_triangle]
    plain = replace(mesh, materials=(), material_of_triangle=None)
    best = None
    for chosen, cull in ((~is_single, "none"), (is_single, "back")):
        some = replace(plain, triangles=np.where(chosen[:, None], mesh.triangles, mesh.triangles[:, :1]))
        frags = tl.rasterize_mesh(some, camera, size, cull=cull, **options)
        ids, depth = frags.samples_triangle, frags.samples_depth
        if best is None:
            best = ids, depth
        else:
            ids = np.where(ids < 0, 2**31 - 1, ids)
            other = np.where(best[0] < 0, 2**31 - 1, best[0])
            wins = (depth < best[1]) | ((depth == best[1]) & (ids < other))
            best = np.where(wins, ids, best[0]).astype(np.int32), np.where(wins, depth, best[1])
    return best


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_backs_of_some_triangles_are_left_out(camera, sampling):
    ids, depth = drawn_apart(MIXED, camera, sampling=sampling)
    frags = tl.rasterize_mesh(MIXED, camera, SIZE, sampling=sampling)
    assert_same(frags.samples_triangle, ids)
    assert_same(frags.samples_depth, depth)
    everything = tl.rasterize_mesh(replace(MIXED, materials=[TWO, TWO]), camera, SIZE, sampling=sampling)
    assert camera is not NEAR or (everything.samples_triangle != ids).any()


@pytest.mark.parametrize("draw", [tl.rasterize_mesh, tl.silhouette], ids=["ids", "silhouette"])
@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_a_mesh_of_single_sided_triangles_is_culled(draw, camera):
    got = draw(ALL, camera, SIZE)
    expected = draw(KNOT, camera, SIZE, cull="back")
    assert_same(getattr(got, "triangle", got), getattr(expected, "triangle", expected))


@pytest.mark.parametrize("sampling", ["center", "msaa4", "area", "outer", "inner"])
def test_silhouette_leaves_backs_out(sampling):
    plain = replace(MIXED, materials=(), material_of_triangle=None)
    left = tl.rasterize_mesh(MIXED, NEAR, SIZE).triangle
    got = tl.silhouette(MIXED, NEAR, SIZE, sampling=sampling)
    if sampling == "center":
        assert_same(got, left >= 0)
    parts = [
        tl.silhouette(replace(plain, triangles=plain.triangles[chosen]), NEAR, SIZE, sampling=sampling, cull=cull)
        for chosen, cull in ((ROWS == 1, "none"), (ROWS == 0, "back"))
    ]
    if got.dtype == np.bool_:
        assert_same(got, parts[0] | parts[1])
    elif sampling == "area":  # sums, cut off at 1, of float32 that are added in another order
        assert np.abs(got - np.minimum(parts[0] + parts[1], 1)).max() < 1e-5
    else:
        assert (got >= np.maximum(*parts)).all()


BOTH_SIDES = replace(KNOT, materials=[replace(ONE, double_sided=True), TWO], material_of_triangle=ROWS)
"""`MIXED`, whose materials leave no side out."""

PICTURES = {
    "ids": lambda mesh, cull: tl.rasterize_mesh(mesh, NEAR, SIZE, cull=cull).triangle,
    "samples": lambda mesh, cull: tl.rasterize_mesh(mesh, NEAR, SIZE, cull=cull, sampling="msaa4").samples_triangle,
    "scene": lambda mesh, cull: tl.rasterize_mesh(tl.Scene([mesh, mesh]), NEAR, SIZE, cull=cull).triangle,
    "edges": lambda mesh, cull: tl.render(mesh, NEAR, SIZE, cull=cull, edges=True),
    "silhouette": lambda mesh, cull: tl.silhouette(mesh, NEAR, SIZE, cull=cull),
    "layers": lambda mesh, cull: tl.render_layers(mesh, NEAR, SIZE, layers=("color",), cull=cull)["color"],
    "glass": lambda mesh, cull: tl.render_transparent(mesh, NEAR, SIZE, opacity=0.5, cull=cull),
    "peeled": lambda mesh, cull: tl.visible_layers(mesh, NEAR, SIZE, cull=cull, layers=4).triangle,
}


@one_by_one("cull", ["none", "back", "front"])
@pytest.mark.parametrize("draw", PICTURES.values(), ids=PICTURES)
def test_a_side_that_is_named_wins_over_the_materials(draw, cull):
    assert_same(draw(MIXED, cull), draw(BOTH_SIDES, cull))


@pytest.mark.parametrize("draw", PICTURES.values(), ids=PICTURES)
def test_unless_a_side_is_named_materials_say_what_shows(draw):
    assert_same(draw(BOTH_SIDES, None), draw(BOTH_SIDES, "none"))
    assert (draw(MIXED, None) != draw(BOTH_SIDES, None)).any()


def test_points_and_arrays_take_no_side_for_both():
    assert_same(tl.coverage(KNOT.vertices[:, :2], KNOT.triangles, 8, cull=None), tl.coverage(
        KNOT.vertices[:, :2], KNOT.triangles, 8))  # fmt: skip
    assert tl.rasterize_mesh(tl.Points(KNOT.vertices), FRAMED, SIZE, cull=None).mask.any()


def test_cull_back_is_the_same_with_both():
    got, expected = (tl.rasterize_mesh(mesh, FRAMED, SIZE, cull="back") for mesh in (MIXED, KNOT))
    assert_same(got.triangle, expected.triangle)


def open_scene(material, mirror=1):
    """Half a sphere, open to the viewer's side or away from it, placed and mirrored."""
    half = replace(SPHERE, triangles=SPHERE.triangles[SPHERE.vertices[SPHERE.triangles].mean(axis=1)[:, 2] > 0])
    half = replace(half, materials=[material, TWO], material_of_triangle=np.zeros(len(half.triangles), int))
    turned = np.diag([-1.0, 1, -1, 1])
    places = [np.diag([mirror, 1.0, 1, 1]), turned @ np.diag([mirror, 1.0, 1, 1])]
    places[1][0, 3] = 2.5
    return tl.Scene([tl.Instance(half, place) for place in places])


@pytest.mark.parametrize("mirror", [1, -1])
def test_instances_show_their_fronts_alone(mirror):
    camera = tl.Camera.look_at((1.2, 0, 6), (1.2, 0, 0), ortho_height=4)
    scene, both = open_scene(ONE, mirror), open_scene(TWO, mirror)
    frags = tl.rasterize_mesh(scene, camera, SIZE)
    assert set(np.unique(frags.instance)) == {-1, 0}  # the second one is open to the viewer
    assert set(np.unique(tl.rasterize_mesh(both, camera, SIZE).instance)) == {-1, 0, 1}
    assert_same(tl.silhouette(scene, camera, SIZE), frags.mask)
    assert_same(tl.render_layers(scene, camera, SIZE, layers=("silhouette",))["silhouette"], frags.mask)
    assert_same(tl.render(scene, camera, SIZE, background=(0, 0, 0, 0))[..., 3] == 255, frags.mask)


def test_a_scene_of_mixed_instances_is_that_of_its_meshes():
    scene = tl.Scene([MIXED, tl.Instance(ALL, np.diag([1.0, 1, 1, 1]) + np.eye(4, k=3) * 0.7)])
    for camera in CAMERAS.values():
        frags = tl.rasterize_mesh(scene, camera, SIZE)
        own = [tl.rasterize_mesh(tl.Scene([one]), camera, SIZE) for one in scene]
        nearest = own[1].depth < own[0].depth
        assert_same(frags.depth, np.where(nearest, own[1].depth, own[0].depth))
        assert_same(own[0].triangle, tl.rasterize_mesh(MIXED, camera, SIZE).triangle)


def lens_of(coefficients):
    view = np.eye(4)
    view[2, 3] = 4
    return tl.Camera.from_intrinsics(
        [[90, 0, 60], [0, 90, 45], [0, 0, 1]], view, SIZE, near=0.1, far=50, distortion=coefficients
    )


@pytest.mark.parametrize("kind", ["mesh", "scene"])
def test_through_a_lens_backs_are_left_out(kind):
    camera = lens_of([-0.2, 0.05, 0, 0])
    mesh = MIXED if kind == "mesh" else tl.Scene([MIXED])
    got = tl.rasterize_mesh(mesh, camera, SIZE)
    seen = ROWS[got.triangle[got.mask]] == 0
    assert seen.any()
    culled = tl.rasterize_mesh(KNOT, camera, SIZE, cull="back").triangle
    shown = np.isin(got.triangle[got.mask][seen], np.unique(culled[culled >= 0]))
    assert shown.mean() > 0.99  # slivers, whose parts a lens may turn
    assert_same(tl.silhouette(mesh, camera, SIZE), got.mask)
    inside = tl.rasterize_mesh(replace(KNOT, materials=[ONE], triangles=KNOT.triangles[:, ::-1]), camera, SIZE)
    front = tl.rasterize_mesh(replace(KNOT, triangles=KNOT.triangles[:, ::-1]), camera, SIZE, cull="back")
    assert_same(inside.triangle, front.triangle)


def test_holes_and_backs_go_together():
    holes = np.full((8, 8, 4), 255, np.uint8)
    holes[2:5, 2:5, 3] = 0
    leaf = replace(ONE, texture=tl.Texture(holes, filter="nearest"), alpha_cutoff=0.5)
    mesh = replace(MIXED, materials=[leaf, TWO], uv=3 * KNOT.vertices[:, :2])
    for sampling in ("center", "msaa4"):
        whole = tl.render(mesh, NEAR, SIZE, sampling=sampling, background=(0, 0, 0, 0))
        scene = tl.render(tl.Scene([mesh]), NEAR, SIZE, sampling=sampling, background=(0, 0, 0, 0))
        assert np.abs(whole.astype(int) - scene).max() <= 1
        both = tl.render(
            replace(mesh, materials=[replace(leaf, double_sided=True), TWO]), NEAR, SIZE, sampling=sampling
        )
        assert (both[..., :3] != whole[..., :3]).any()


def test_the_material_of_a_picture_has_the_say():
    expected = tl.render(KNOT, NEAR, SIZE, cull="back", color=(200, 90, 60))
    assert_same(tl.render(KNOT, NEAR, SIZE, material=ONE), expected)
    assert_same(tl.render(ALL, NEAR, SIZE, material=TWO), tl.render(KNOT, NEAR, SIZE, color=(60, 90, 200)))


def test_edges_of_backs_are_not_drawn():
    expected = tl.render(KNOT, FRAMED, SIZE, cull="back", color=(200, 90, 60), edges=True)
    assert_same(tl.render(ALL, FRAMED, SIZE, edges=True), expected)


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_single_sided_threads_windows_and_clusters_change_nothing(camera):
    for mesh in (ALL, MIXED):
        one = tl.rasterize_mesh(replace(mesh), camera, SIZE, threads=1)
        again = replace(mesh)
        for _ in range(4):  # clusters come with the second picture, where they pay
            frags = tl.rasterize_mesh(again, camera, SIZE, threads=3)
        assert_same(frags.triangle, one.triangle)
        part = tl.rasterize_mesh(again, camera, (50, 40), origin=(33, 21), viewport=SIZE)
        assert_same(part.triangle, one.triangle[21:61, 33:83])
