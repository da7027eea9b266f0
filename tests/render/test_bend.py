"""Pictures through a lens, against meshes cut so finely that every edge is straight anyway."""

from dataclasses import replace

import numpy as np
import pytest
from engine_cases import on

import topleft as tl
from topleft import scenes
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.lens import OpenCVLens
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture import bend as bend_file
from topleft._meshes.picture.bend import LensMap, bend

SIZE = (160, 120)
K = np.array([[110.0, 0.0, 80.0], [0.0, 110.0, 60.0], [0.0, 0.0, 1.0]])
WIDE_K = np.array([[45.0, 0.0, 80.0], [0.0, 45.0, 60.0], [0.0, 0.0, 1.0]])
BARREL = {"distortion": (-0.28, 0.07, 0.002, -0.003)}
PINCUSHION = {"distortion": (0.25, 0.05, 0.0, 0.0, 0.01, 0.02, 0.0, 0.0)}
FISHEYE = {"fisheye": (-0.02, 0.008, -0.001, 0.0)}
TURNED = np.array([[0.8, 0, 0.6, 0.2], [0, 1, 0, -0.1], [-0.6, 0, 0.8, 2.6], [0, 0, 0, 1.0]])
CUBE = Mesh(*scenes.shape("cube"))
GROUND = Mesh([[-90, 1, -90], [90, 1, -90], [90, 1, 90], [-90, 1, 90]], [[0, 1, 2], [0, 2, 3]])


def camera_of(lens, pose=TURNED, intrinsics=K, far=200.0):
    return Camera.from_intrinsics(intrinsics, pose, SIZE, near=0.1, far=far, **lens)


def cut_finely(mesh, n):
    """Every triangle as n * n equal ones, in the order of the mesh."""
    corners = np.asarray(mesh.vertices)[mesh.triangles]
    i, j = np.mgrid[: n + 1, : n + 1]
    inside = i + j <= n
    number = np.full((n + 1, n + 1), -1)
    number[inside] = np.arange(inside.sum())
    weights = np.stack([n - i - j, i, j], axis=-1)[inside] / n
    up = [[number[a, b], number[a + 1, b], number[a, b + 1]] for a in range(n) for b in range(n - a)]
    down = [[number[a + 1, b], number[a + 1, b + 1], number[a, b + 1]] for a in range(n) for b in range(n - 1 - a)]
    vertices = np.einsum("wk,tkc->twc", weights, corners).reshape(-1, 3)
    step = len(weights) * np.arange(len(corners))[:, None, None]
    return vertices, (np.array(up + down) + step).reshape(-1, 3)


def finely_drawn(mesh, camera, n=48):
    """Ids and depth as (H, W) arrays, from pixels that `Camera.project` gives for every vertex."""
    vertices, triangles = cut_finely(mesh, n)
    frags = tl.rasterize(camera.project(vertices, SIZE), triangles, SIZE)
    return np.where(frags.mask, frags.triangle // n**2, -1), frags.depth


def neighbours(ids):
    padded = np.pad(ids, 1, mode="edge")
    height, width = ids.shape
    return np.stack([padded[a : a + height, b : b + width] for a in range(3) for b in range(3)])


@pytest.mark.parametrize("lens", [BARREL, PINCUSHION, FISHEYE], ids=["barrel", "pincushion", "fisheye"])
def test_bent_picture_is_that_of_a_finely_cut_mesh(lens):
    camera = camera_of(lens)
    frags = tl.rasterize_mesh(CUBE, camera, SIZE)
    ids, depth = finely_drawn(CUBE, camera)
    assert len(np.unique(ids)) > 4
    # An edge may lie 1/8 px (the tolerance) and two snaps from its place: what differs is the pixel next to an edge,
    # and one in four of the pixels along it.
    differ = frags.triangle != ids
    assert (frags.triangle == neighbours(ids)).any(axis=0).all()
    edge = (neighbours(ids) != ids).any(axis=0)
    assert differ.sum() < 0.25 * edge.sum()
    # Depth is off by what it changes by in those 1/8 px; its slope is at most 2e-3 a pixel here.
    inside = ~edge & frags.mask
    assert np.abs(frags.depth[inside] - depth[inside]).max() < 3e-4


def test_bent_attributes_are_those_of_the_whole_triangle():
    camera = camera_of(BARREL)
    frags = tl.rasterize_mesh(CUBE, camera, SIZE)
    world = frags.interpolate(CUBE.vertices)
    px = camera.project(world[frags.mask].astype(float), SIZE)[:, :2]
    rows, columns = np.nonzero(frags.mask)
    # The surface that shows in a pixel lies under its centre, but for the tolerance, the snap and float32.
    assert np.abs(px - np.stack([columns, rows], axis=1) - 0.5).max() < 0.125 + 2**-8 + 1e-3
    weights = frags.barycentric()[frags.mask]
    assert weights.sum(axis=1) == pytest.approx(1, abs=1e-6)
    corners = CUBE.vertices[CUBE.triangles[frags.triangle[frags.mask]]]
    assert np.einsum("pk,pkc->pc", weights, corners) == pytest.approx(world[frags.mask], abs=1e-5)


def test_bent_attributes_per_corner_are_those_per_vertex():
    frags = tl.rasterize_mesh(CUBE, camera_of(FISHEYE), SIZE)
    per_corner = frags.interpolate(CUBE.vertices[CUBE.triangles], background=7)
    assert np.array_equal(per_corner, frags.interpolate(CUBE.vertices, background=7))
    one = frags.interpolate(CUBE.vertices[:, 0], background=7)
    assert np.array_equal(one, per_corner[..., 0])
    assert (one[~frags.mask] == 7).all()


@pytest.mark.parametrize("lens", [BARREL, PINCUSHION, FISHEYE], ids=["barrel", "pincushion", "fisheye"])
@pytest.mark.parametrize("is_soup", [False, True], ids=["shared vertices", "vertices of their own"])
def test_bent_wall_is_watertight(lens, is_soup):
    xy, triangles = scenes.planar_mesh(60, 8, 6)
    vertices = np.column_stack([xy - (4, 3), 2 + 0.3 * np.sin(3 * xy[:, 0])])  # a wavy wall all over the picture
    if is_soup:
        vertices, triangles = vertices[triangles.ravel()], np.arange(triangles.size).reshape(-1, 3)
        triangles = np.roll(triangles, 1, axis=1)[::-1]
    camera = camera_of(lens, np.eye(4))
    bent = bend(vertices, triangles, camera, camera.lens, SIZE)
    assert len(bent.triangles) > len(triangles)
    count = tl.overdraw(bent.points_eye, bent.triangles, SIZE, transform=camera.clip_from_eye(SIZE))
    assert (count == 1).all()


def test_bend_sides_of_an_edge_are_split_alike():
    camera = camera_of(BARREL, np.eye(4))
    vertices, triangles = scenes.planar_mesh(30, 8, 6)
    wall = np.column_stack([vertices - (4, 3), np.full(len(vertices), 3.0)])
    bent = bend(wall, triangles, camera, camera.lens, SIZE)
    points, same = np.unique(bent.points_eye, axis=0, return_inverse=True)  # parts have points of their own
    corners = same[bent.triangles]
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    ends, count = np.unique(sides, axis=0, return_counts=True)
    middle = points[ends[count == 1]].mean(axis=1)
    clip = middle @ camera.clip_from_eye(SIZE)[:, :3].T + camera.clip_from_eye(SIZE)[:, 3]
    assert count.max() == 2
    # What belongs to one triangle alone is out of the picture, where neighbours are left out.
    assert (np.abs(clip[:, :2]).max(axis=1) > clip[:, 3]).all()


def test_bend_straight_lens_splits_by_angle_only():
    camera = camera_of({"distortion": (0, 0, 0, 0)}, np.eye(4))
    corners = np.array([[-0.1, -0.1, 1], [0.1, -0.1, 1], [0, 0.1, 1]])
    bent = bend(corners, [[0, 1, 2]], camera, camera.lens, SIZE)
    assert bent.triangles.tolist() == [[0, 1, 2]]
    assert bend(3 * corners * [1, 1, 1 / 3], [[0, 1, 2]], camera, camera.lens, SIZE).triangles.shape[0] > 1


def test_bend_finer_tolerance_makes_more_triangles():
    camera = camera_of(BARREL)
    n = [
        len(bend(CUBE.vertices, CUBE.triangles, camera, replace(camera.lens, tolerance_px=tolerance), SIZE).triangles)
        for tolerance in (1, 0.125, 2**-6)
    ]
    assert n == sorted(n)
    assert n[0] < n[2] / 4


def test_bend_a_dense_mesh_is_left_as_it_is():
    ball = Mesh(*scenes.shape("icosphere", subdivisions=4))
    camera = camera_of(BARREL, np.eye(4))
    moved = ball.vertices * 0.5 + (0, 0, 3)
    bent = bend(moved, ball.triangles, camera, camera.lens, SIZE)
    assert np.array_equal(bent.triangles, ball.triangles)
    assert np.array_equal(bent.source, np.arange(len(ball.triangles)))


LENSES = {
    "barrel": BARREL,
    "pincushion": PINCUSHION,
    "prism and tilt": {"distortion": (0.1, -0.2, 0.01, 0.02, 0.1, 0.1, 0, 0.05, 0.02, -0.03, 0.01, 0.02, 0.1, -0.2)},
    "fisheye": FISHEYE,
}
ON_EACH_LENS = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)


def confetti(size, n=600):
    """Triangles of some size in space, before and around a camera in the origin."""
    rng = np.random.default_rng(11)
    middles = rng.normal(size=(n, 1, 3)) * (1.5, 1.5, 1) + (0, 0, 3)
    corners = (middles + rng.normal(size=(n, 3, 3)) * size).reshape(-1, 3)
    return corners, np.arange(3 * n, dtype=np.int32).reshape(-1, 3)


@ON_EACH_LENS
@pytest.mark.parametrize("size", [0.01, 0.1, 1.0])
def test_bend_leaves_no_edge_that_is_off_by_more_than_the_tolerance(lens, size):
    camera = camera_of(lens, np.eye(4))
    bent = bend(*confetti(size), camera, camera.lens, SIZE)
    corners, clip = confetti(size)[0].reshape(-1, 3, 3), camera.clip_from_eye(SIZE)
    whole = corners[bent.source]
    if bent.parts is not None:
        whole[bent.parts.rows] = np.einsum("pck,pkx->pcx", bent.parts.weights, whole[bent.parts.rows])

    def px(points_eye):
        at = points_eye @ clip[:, :3].T + clip[:, 3]
        return at[..., :2] / at[..., 3:] * np.array(SIZE) / 2

    drawn = bent.points_eye[bent.triangles]
    near = (np.abs(px(drawn)) < np.array(SIZE) / 2).all(axis=(1, 2))  # elsewhere the lens is tamed
    n_split = len(bent.triangles) - len(np.unique(bent.source))
    assert near.sum() > 100
    assert n_split < 10 if size == 0.01 else n_split > 100
    for k in range(3):
        a, b = whole[near, k], whole[near, k - 2]
        bent_a, bent_b = drawn[near, k], drawn[near, k - 2]
        spread = np.abs(px(bent_a) - px(bent_b)).max(axis=1)
        for share in (0.25, 0.5, 0.75):
            seen = camera.lens.bend(((1 - share) * a + share * b) @ camera.view[:3, :3].T + camera.view[:3, 3])
            off = np.abs(px(seen) - px((1 - share) * bent_a + share * bent_b)).max(axis=1)
            assert off[spread > 1].max(initial=0) <= camera.lens.tolerance_px * (1 + 1e-9)


@pytest.mark.parametrize("lens", [BARREL, PINCUSHION, FISHEYE], ids=["barrel", "pincushion", "fisheye"])
def test_bend_splits_a_triangle_alike_from_each_of_its_corners(lens):
    camera = camera_of(lens, np.eye(4))
    rng = np.random.default_rng(8)
    out = rng.normal(size=(1000, 1, 2))
    out /= np.sqrt((out**2).sum(axis=2, keepdims=True))
    middle, reach = rng.uniform(0, 0.65, (1000, 1, 1)), rng.uniform(0.02, 0.3, (1000, 1, 1))
    flat = out * (middle + reach * [[-1], [0.02], [1]])  # along a radius, one side as long as the other two
    flat += out[..., ::-1] * [-1, 1] * [[0], [1e-3], [0]]
    corners = np.concatenate([flat, np.ones((1000, 3, 1))], axis=2)
    counts = []
    for k in range(3):
        turned = np.roll(corners, k, axis=1).reshape(-1, 3)
        bent = bend(turned, np.arange(3000).reshape(-1, 3), camera, camera.lens, SIZE)
        counts.append(np.bincount(bent.source, minlength=1000))
    assert (counts[0] == 2).sum() > 50
    assert (counts[0] == counts[1]).all()
    assert (counts[0] == counts[2]).all()


def test_second_derivative_of_a_tangential_lens_is_that_of_its_formula():
    tangential = LensMap(OpenCVLens(p1=0.02), np.array([[100.0, 0, 0], [0, 100, 0]]), (80.0, 60.0))
    # x: 2 p1 x y, y: p1 (x^2 + 3 y^2): all second derivatives, squared, sum to (2^2 + 2^2) + (2^2 + 6^2), times p1^2.
    assert tangential._bends(np.array([1.0, 0.9, 0.7]), 2**-8) == pytest.approx(100 * 0.02 * 48**0.5, rel=1e-9)


@ON_EACH_LENS
def test_bend_places_vertices_where_the_lens_does(lens):
    camera = camera_of(lens, TURNED)
    ball = Mesh(*scenes.shape("icosphere", subdivisions=3))
    for dtype in (np.float32, np.float64):
        vertices = (0.3 * ball.vertices + (0.3, 0.2, 0.1)).astype(dtype)
        bent = bend(vertices, ball.triangles, camera, camera.lens, SIZE)
        used = np.unique(bent.triangles)
        assert bent.parts is None
        assert len(used) == len(vertices)
        eye = vertices.astype(np.float64) @ camera.view[:3, :3].T + camera.view[:3, 3]
        assert np.abs(bent.points_eye[used] - camera.lens.bend(eye)[used]).max() < 1e-12


@ON_EACH_LENS
def test_bend_gives_the_same_bits_on_each_isa(lens):
    camera, found = camera_of(lens, np.eye(4)), []
    for isa in tl.build_info()["isa_available"]:
        with on(isa):
            bent = bend(*confetti(0.3), camera, camera.lens, SIZE)
            drawn = bent.points_eye[bent.triangles], bent.source, bent.parts.weights, bent.parts.is_outline
            found.append([array.tobytes() for array in drawn])
    assert all(one == found[0] for one in found)


def test_bend_parts_tile_their_triangles_in_their_winding():
    camera = camera_of(BARREL, np.eye(4))
    rng = np.random.default_rng(2)
    corners = (rng.uniform(-0.5, 0.5, (300, 3, 3)) * (1, 0.7, 0.3) + (0, 0, 1.2)).reshape(-1, 3)  # all in the picture
    bent = bend(corners, np.arange(900).reshape(-1, 3), camera, camera.lens, SIZE)
    weights = np.tile(np.eye(3), (len(bent.triangles), 1, 1))
    weights[bent.parts.rows] = bent.parts.weights
    areas = np.linalg.det(weights)  # shares of the whole
    assert areas.min() > 0
    assert np.bincount(bent.source, areas) == pytest.approx(np.ones(300), abs=1e-9)
    rims = weights[..., None, :] == 0  # a side lies on the rim where a corner of the whole has no weight at both ends
    on_rim = (rims & np.roll(rims, -1, axis=1)).any(axis=(2, 3))
    assert np.array_equal(on_rim[bent.parts.rows], bent.parts.is_outline)


@pytest.mark.parametrize("lens", [BARREL, FISHEYE], ids=["barrel", "fisheye"])
def test_ground_to_the_horizon_passes_under_the_camera(lens):
    camera = camera_of(lens, np.eye(4), K if lens is BARREL else WIDE_K)
    frags = tl.rasterize_mesh(GROUND, camera, SIZE)
    world = frags.interpolate(GROUND.vertices)
    assert not frags.mask[:59].any()
    assert frags.mask[62:].all()
    near = frags.mask & (np.abs(world).max(axis=-1) < 20)
    rows, columns = np.nonzero(near)
    px = camera.project(world[near].astype(float), SIZE)[:, :2]
    assert near.sum() > 5000
    assert np.abs(px - np.stack([columns, rows], axis=1) - 0.5).max() < 0.15


def test_fisheye_sees_behind_itself():
    camera = Camera.from_intrinsics(
        np.array([[25.0, 0, 80], [0, 25.0, 60], [0, 0, 1]]), np.eye(4), SIZE, near=0.01, far=9, fisheye=(0, 0, 0, 0)
    )
    frags = tl.rasterize_mesh(CUBE, camera, SIZE)  # the camera stands in its middle
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]]
    angle = np.hypot(columns - 80, rows - 60) / 25
    assert frags.mask[angle < 2.75].all()
    assert not frags.mask[angle > 3.1].any()
    world = frags.interpolate(CUBE.vertices)
    seen = np.arctan2(np.hypot(world[..., 0], world[..., 1]), world[..., 2])
    # Exactly equidistant: so many pixels, so many radians; 1/8 px is 0.005.
    assert np.abs(seen - angle)[angle < 2.75].max() < 0.008


def test_lens_that_turns_back_folds_nothing_into_the_picture():
    camera = camera_of({"distortion": (-0.6, 0.0, 0.0, 0.0)}, np.eye(4))  # turns back at 37 degrees
    far_out = Mesh([[5.0, -1, 1], [9, 0, 1], [5, 1, 1]], [[0, 1, 2]])
    assert np.abs(camera.project(far_out.vertices, SIZE)[:, 0]).min() > 160
    assert not tl.rasterize_mesh(far_out, camera, SIZE).mask.any()
    wall = Mesh([[-99, -99, 1], [99, -99, 1], [0, 99, 1.0]], [[0, 1, 2]])
    assert tl.rasterize_mesh(wall, camera, SIZE).mask.all()


def test_behind_the_camera_nothing_shows():
    behind = Mesh(np.array([[-1, -1, -2], [1, -1, -2], [0, 1, -2.0]]), [[0, 1, 2]])
    frags = tl.rasterize_mesh(behind, camera_of(BARREL, np.eye(4)), SIZE)
    assert not frags.mask.any()
    assert (frags.barycentric() == 0).all()
    assert frags.interpolate(behind.vertices, background=3).shape == (*SIZE[::-1], 3)
    assert (frags.interpolate([1, 2, 3], background=3) == 3).all()


def test_near_plane_cuts_through_a_lens():
    slope = Mesh([[-9, 0.5, 0], [9, 0.5, 0], [0, 0.5, 9.0]], [[0, 1, 2]])
    camera = Camera.from_intrinsics(K, np.eye(4), SIZE, near=1.0, far=20, **BARREL)
    frags = tl.rasterize_mesh(slope, camera, SIZE)
    z = frags.interpolate(slope.vertices)[..., 2][frags.mask]
    assert z.min() == pytest.approx(1, abs=0.02)  # rows of pixels are 0.01 apart there
    assert frags.depth[frags.mask].min() < 0.02


def test_edge_through_the_lens_ends():
    camera = camera_of(FISHEYE, np.eye(4))
    bent = bend(np.array([[-1.0, 0, 0], [1, 0, 0], [0, 1, 1]]), [[0, 1, 2]], camera, camera.lens, SIZE)
    assert np.isfinite(bent.points_eye).all()
    assert len(bent.triangles) < 48_000  # 24 halvings at most


def test_window_through_a_lens_is_the_crop():
    camera = camera_of(BARREL)
    whole = tl.rasterize_mesh(CUBE, camera, SIZE)
    window = tl.rasterize_mesh(CUBE, camera, (50, 40), origin=(60, 30), viewport=SIZE)
    crop = np.s_[30:70, 60:110]
    assert np.array_equal(window.triangle, whole.triangle[crop])
    assert np.array_equal(window.depth, whole.depth[crop])
    assert np.array_equal(window.interpolate(CUBE.vertices), whole.interpolate(CUBE.vertices)[crop])


def test_samples_through_a_lens_have_ids_of_the_mesh():
    frags = tl.rasterize_mesh(CUBE, camera_of(BARREL), SIZE, sampling="msaa4")
    assert frags.samples_triangle.shape == (*SIZE[::-1], 4)
    assert -1 < frags.samples_triangle.max() < len(CUBE.triangles)
    for i in range(4):
        assert np.array_equal(frags.sample(i).triangle, frags.samples_triangle[..., i])
    assert frags.sample(3).interpolate(CUBE.vertices).shape == (*SIZE[::-1], 3)


def test_render_samples_through_a_lens_is_near_the_picture_of_one():
    plain, smooth = (tl.render(CUBE, camera_of(BARREL), SIZE, sampling=how) for how in ("center", "msaa4"))
    differ = (plain != smooth).any(axis=-1)
    assert 0 < differ.sum() < 0.1 * differ.size


def test_silhouette_through_a_lens_is_the_mask():
    camera = camera_of(FISHEYE)
    mask = tl.silhouette(CUBE, camera, SIZE, sampling="center")
    assert np.array_equal(mask, tl.rasterize_mesh(CUBE, camera, SIZE).mask)


def test_render_edges_through_a_lens_are_those_of_the_mesh():
    camera = camera_of(BARREL)
    triangle = Mesh([[-1, -1, 0.5], [1, -1, 0.5], [0, 1, 0.5]], [[0, 1, 2]])
    picture = tl.render(triangle, camera, SIZE, shading="flat", edges=True)
    assert (picture[..., 0] < 100).sum() > 100
    mask = tl.rasterize_mesh(triangle, camera, SIZE).mask
    inside = neighbours(neighbours(mask).all(axis=0)).all(axis=0)
    assert len(np.unique(picture[inside], axis=0)) == 1  # no edge runs through the triangle


@pytest.mark.parametrize("cull", ["back", "front"])
def test_render_edges_through_a_lens_leave_out_culled_triangles(cull):
    camera = camera_of(BARREL)
    triangle = Mesh([[-1, -1, 0.5], [1, -1, 0.5], [0, 1, 0.5]], [[0, 1, 2]])
    shown = tl.rasterize_mesh(triangle, camera, SIZE, cull=cull).mask.any()
    drawn = (tl.render(triangle, camera, SIZE, cull=cull, edges=True) != 255).any()
    assert shown == drawn == (cull == "front")


def textured_ground():
    noise = np.random.default_rng(2).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    uv = np.array([[0, 0], [3, 0], [3, 3], [0, 3]])
    material = tl.Material(texture=tl.Texture(np.kron(noise[:8, :8], np.ones((8, 8, 1), np.uint8))))
    vertices = [[-2, 1, 1], [2, 1, 1], [2, -1, 5], [-2, -1, 5]]
    return Mesh(vertices, [[0, 2, 1], [0, 3, 2]], uv=uv, materials=(material,))


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
@pytest.mark.parametrize("shading", ["smooth", "flat", "unlit", "normals", "ids", "depth"])
def test_lens_without_distortion_shades_as_no_lens_does(shading, sampling):
    camera = replace(camera_of({}, np.eye(4)), lens=tl.OpenCVLens())
    options = {"shading": shading, "sampling": sampling}
    for mesh in (textured_ground(), Mesh(CUBE.vertices + [0, 0, 4], CUBE.triangles)):
        expected = tl.render(mesh, camera.straightened(), SIZE, **options).astype(int)
        got = tl.render(mesh, camera, SIZE, **options).astype(int)
        assert (expected[..., 0] != 255).sum() > 500
        off = np.abs(got - expected).max(-1)
        # Texels at the border of two may be the other one; with several samples a part is shaded once in a pixel, so
        # the texture is looked up twice along the cuts.
        assert (off > 1).mean() < (0.002 if sampling == "center" else 0.08)
        assert off.mean() < 2


@pytest.mark.parametrize("lens", [BARREL, FISHEYE])
def test_texture_through_a_lens_is_that_of_a_fine_mesh(lens):
    mesh = textured_ground()
    camera = camera_of(lens, np.eye(4))
    vertices, triangles = cut_finely(mesh, 48)
    uv = cut_finely(Mesh(np.pad(mesh.uv, ((0, 0), (0, 1))), mesh.triangles), 48)[0][:, :2]
    expected = tl.render(Mesh(vertices, triangles, uv=uv, materials=mesh.materials), camera, SIZE, shading="unlit")
    got = tl.render(mesh, camera, SIZE, shading="unlit")
    both = (got[..., :3] != 255).any(-1) & (expected[..., :3] != 255).any(-1)
    assert both.sum() > 2000
    assert np.abs(got[both].astype(int) - expected[both]).mean() < 4  # an eighth of a pixel of a texture with edges


def large_triangles(n, size=20.0):
    return np.random.default_rng(3).normal(size=(3 * n, 3)) * size, np.arange(3 * n).reshape(-1, 3)


def test_bend_in_a_small_picture_makes_no_more_parts_than_it_has_pixels_for():
    camera = Camera.from_intrinsics(K / [[10.0], [10.0], [1.0]], TURNED, (16, 12), near=0.1, far=200.0, **FISHEYE)
    n_triangles = 40
    bent = bend(*large_triangles(n_triangles), camera, camera.lens, (16, 12))
    assert len(bent.triangles) < 3 * n_triangles * 16 * 12  # 79,090 where the depth of parts of a pixel counted


def test_bend_into_too_many_parts_is_refused_with_the_number(monkeypatch):
    camera = camera_of(FISHEYE)
    monkeypatch.setattr(bend_file, "MAX_PARTS", 1000)
    with pytest.raises(ValueError, match=r"the lens splits 20 triangles into more than 1160 parts: give it a larger"):
        bend(*large_triangles(20), camera, camera.lens, SIZE)


def test_bend_into_too_many_parts_is_refused_before_they_are_made(monkeypatch):
    monkeypatch.setattr(bend_file, "_Split", None)  # what holds them
    camera = camera_of(FISHEYE)
    with pytest.raises(ValueError, match="the lens splits 3000 triangles into more than 4218304 parts: give it a lar"):
        bend(*large_triangles(3000, 100), camera, camera.lens, SIZE)
