"""Cameras without planes: pictures cut nothing in front of the eye, and float32 orders depths at every distance."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import topleft as tl

SIZE = (48, 36)
K = np.array([[96.0, 0, 23.5], [0, 96.0, 17.5], [0, 0, 1]])
CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
FACES = np.array([
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
])  # fmt: skip
BOXES = [((0, 0, 0), (40, 25, 30)), ((65, 0, 0), (25, 25, 30)), ((10, 50, 0), (20, 25, 10))]  # touch each other


def square(z, half=10.0):
    """A square across the axis of a camera of OpenCV, at a distance."""
    corners = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
    return tl.Mesh(np.array(corners, np.float64), [(0, 1, 2), (0, 2, 3)])


def pose_of(rng, unit):
    """A pose of the boxes before the camera: world from object (4, 4)."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = q * np.sign(np.linalg.det(q))
    pose[:3, 3] = rng.uniform(-20, 20) * unit, rng.uniform(-20, 20) * unit, rng.uniform(300, 2000) * unit
    return pose


def nearest_hits(corners, matrix):
    """The nearest triangle (H, W) that the ray of each pixel meets, -1 for none, and the distances along the axis."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    rays = np.stack([(x - matrix[0, 2]) / matrix[0, 0], (y - matrix[1, 2]) / matrix[1, 1], np.ones(x.shape)], -1)[
        ..., None, :
    ]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across, from_corner = np.cross(rays, b), -corners[:, 0]
    turn = np.cross(from_corner, a)
    det = (across * a).sum(-1)
    u, v, z = (across * from_corner).sum(-1) / det, (rays * turn).sum(-1) / det, (turn * b).sum(-1) / det
    z = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (z > 0), z, np.inf)
    nearest = z.min(axis=-1)
    return np.where(np.isfinite(nearest), z.argmin(axis=-1), -1), nearest


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e-6], ids=["mm", "m", "km"])
def test_ids_and_distances_of_touching_boxes_are_those_of_rays(unit):
    rng = np.random.default_rng(7)
    meshes = [tl.Mesh((CUBE * half + middle) * unit, FACES) for middle, half in BOXES]
    for _ in range(8):
        pose = pose_of(rng, unit)
        matrix = K * [[pose[2, 3] / unit / 500], [pose[2, 3] / unit / 500], [1]]
        matrix[:2, 2] = K[:2, 2]
        camera = tl.Camera.from_intrinsics(matrix, np.eye(4), SIZE)
        scene = tl.Scene([(mesh, pose) for mesh in meshes])
        frags = tl.rasterize_mesh(scene, camera, SIZE, subpixel_bits="exact")
        corners = np.concatenate([mesh.vertices[FACES] for mesh in meshes]) @ pose[:3, :3].T + pose[:3, 3]
        ids, distance = nearest_hits(corners, matrix)
        assert np.array_equal(np.where(frags.mask, frags.instance * len(FACES) + frags.triangle, -1), ids)
        seen = frags.mask
        assert seen.sum() > 150
        assert np.abs(frags.distance(camera)[seen] / distance[seen] - 1).max() < 2e-7  # two roundings of float32
        assert np.abs(camera.distance_of(frags.depth[seen]) / distance[seen] - 1).max() < 2e-7


@pytest.mark.parametrize("distance", [1e-9, 1e-3, 1100.0, 1e12])
@pytest.mark.parametrize(
    "lens", [{}, {"distortion": (0, 0, 0, 0)}, {"fisheye": (0, 0, 0, 0)}], ids=["plain", "lens", "fisheye"]
)
def test_nothing_in_front_of_the_eye_is_cut(distance, lens):
    camera = tl.Camera.from_intrinsics(K, np.eye(4), SIZE, **lens)
    mesh = square(distance, half=distance / 12)
    mask = tl.silhouette(mesh, camera, SIZE)
    assert np.array_equal(mask, tl.silhouette(square(1.0, half=1 / 12), camera, SIZE))
    assert mask.sum() == 16 * 16
    assert tl.render(mesh, camera, SIZE)[mask][:, 3].all()


def test_depth_of_a_camera_without_planes_is_minus_one_over_the_distance():
    camera = tl.Camera.from_intrinsics(K, np.eye(4), SIZE)
    frags = tl.rasterize_mesh(square(8.0), camera, SIZE)
    assert frags.depth[17, 23] == -0.125
    assert camera.project([(0, 0, 8.0)], SIZE)[0, 2] == -0.125
    assert camera.distance_of(frags.depth)[17, 23] == 8


def test_depth_of_an_orthographic_camera_without_planes_is_the_distance():
    camera = tl.Camera.look_at((0, 0, 0), (0, 0, 1), ortho_height=20)
    scene = tl.Scene([square(-1.0), square(4000.0), square(4000.5)])
    frags = tl.rasterize_mesh(scene, camera, SIZE)
    assert frags.instance[18, 24] == 1  # the first is behind the eye, and far = 100 would cut the others
    assert frags.depth[18, 24] == 4000
    assert camera.project([(0, 0, 4000.0)], SIZE)[0, 2] == 4000


@pytest.mark.parametrize("planes", [{"near": 0.5}, {"far": 9.0}, {"near": 0.5, "far": 9.0}])
def test_given_planes_cut_and_measure_depth(planes):
    camera = tl.Camera.look_at((0, 0, 0), (0, 0, 1), **planes)
    assert camera.has_planes
    mesh = tl.Mesh(
        [(-9, -9, 20), (9, -9, 20), (0, 9, 20), (-0.1, -0.1, 0.1), (0.1, -0.1, 0.1), (0, 0.1, 0.1)],
        [(0, 1, 2), (3, 4, 5)],
    )
    with pytest.warns(tl.MeshWarning, match="cuts? what lies in front of the eye"):
        ids = set(np.unique(tl.rasterize_mesh(mesh, camera, SIZE).triangle))
    assert (0 in ids) == ("far" not in planes)
    assert (1 in ids) == ("near" not in planes)


@pytest.mark.parametrize("make", [
    lambda: tl.Camera.look_at((0, 0, 5)),
    lambda: tl.Camera.look_at((0, 0, 5), ortho_height=2),
    lambda: tl.Camera.from_intrinsics(K, np.eye(4), SIZE),
    lambda: tl.Camera.from_opengl(np.eye(4)),
    lambda: tl.Camera.from_opengl(np.eye(4), K, SIZE),
    lambda: tl.Camera.from_colmap("1 PINHOLE 48 36 96 96 24 18", "7 1 0 0 0 0 0 4 1 a.jpg"),
])  # fmt: skip
def test_cameras_that_are_given_no_planes_have_none(make):
    camera = make()
    assert not camera.has_planes
    assert not camera.placed(np.eye(4)).straightened().has_planes


def test_ground_that_passes_the_eye_has_the_depth_of_its_plane():
    camera = tl.Camera.from_intrinsics(K, np.eye(4), SIZE)
    for reach in (1e3, 1e5, 1e7):
        corners = [(-reach, 1.5, -reach), (reach, 1.5, -reach), (reach, 1.5, reach), (-reach, 1.5, reach)]
        frags = tl.rasterize_mesh(tl.Mesh(np.array(corners), FACES[:2]), camera, SIZE, subpixel_bits="exact")
        rows = np.arange(20, SIZE[1])
        assert frags.mask[rows].all()
        expected = np.broadcast_to((1.5 * 96 / (rows - 17.5))[:, None], (len(rows), SIZE[0]))
        assert np.abs(camera.distance_of(frags.depth[rows]) / expected - 1).max() < 1e-6


def test_masks_of_objects_do_not_depend_on_the_unit():
    rng = np.random.default_rng(3)
    pose, found = pose_of(rng, 1.0), []
    for scale in (1.0, 2.0**-10, 2.0**10):
        place = pose.copy()
        place[:3, 3] *= scale
        meshes = [(tl.Mesh((CUBE * half + middle) * scale, FACES), place) for middle, half in BOXES]
        camera = tl.Camera.from_intrinsics(K, np.eye(4), SIZE)
        masks = tl.object_masks(tl.Scene(meshes), camera, SIZE)
        found.append((masks.n_visible.tolist(), masks.n_full.tolist()))
    assert found[0] == found[1] == found[2]
    assert sum(found[0][0]) > 20


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_edges_behind_a_surface_are_hidden_in_every_unit(unit):
    camera = tl.Camera.from_intrinsics(K, np.eye(4), SIZE)
    front, behind = square(1.0 * unit, half=unit), square(1.5 * unit, half=0.2 * unit)
    alone = tl.render(front, camera, SIZE, edges=True)
    assert np.array_equal(tl.render(tl.Scene([front, behind]), camera, SIZE, edges=True), alone)
    assert not np.array_equal(tl.render(behind, camera, SIZE, edges=True), tl.render(behind, camera, SIZE))


def test_levels_of_detail_are_chosen_without_planes():
    mesh = tl.Mesh(*tl.scenes.icosphere(5))
    camera = tl.Camera.look_at((0, 0, 60))
    given = tl.Camera.look_at((0, 0, 60), near=1, far=100)
    chosen = [tl.choose_detail(mesh, one, SIZE, tolerance=0.5).level for one in (camera, given)]
    assert chosen[0] == chosen[1] > 0


def test_pictures_of_a_camera_without_planes_are_baked_on_what_they_show():
    front, behind = square(1000.0, half=200.0), square(1001.0, half=200.0)
    mesh = tl.Mesh(
        np.concatenate([front.vertices, behind.vertices]),
        [(0, 2, 1), (0, 3, 2), (4, 6, 5), (4, 7, 6)],
        uv=[(0, 0), (0.5, 0), (0.5, 1), (0, 1), (0.5, 0), (1, 0), (1, 1), (0.5, 1)],
    )
    camera = tl.Camera.from_intrinsics(K, np.eye(4), SIZE)
    picture = np.full((SIZE[1], SIZE[0], 3), 200, np.uint8)
    baked = tl.bake(mesh, [picture], cameras=[camera], size=(32, 32))
    assert set(np.unique(baked.triangle[baked.mask])) <= {0, 1}


def test_depth_without_planes_is_written_from_the_least_to_the_greatest(tmp_path):
    camera = tl.Camera.from_intrinsics(K, np.eye(4), SIZE)
    layers = tl.render_layers(tl.Scene([square(4.0, 0.5), square(8.0, 4.0)]), camera, SIZE, layers="depth")
    layers.save(tmp_path / "depth.png")
    assert (tmp_path / "depth.png").stat().st_size > 0


def told_by(draw, count=1):
    """The lines of warnings of some draws that are alike."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(count):
            draw()
    assert all(one.category is tl.MeshWarning and one.filename == __file__ for one in caught)
    return [str(one.message) for one in caught]


VERBS = [tl.render, tl.rasterize_mesh, tl.silhouette, tl.render_layers, tl.object_masks, tl.visible_layers]


@pytest.mark.parametrize("draw", VERBS, ids=lambda draw: draw.__name__)
@pytest.mark.parametrize("ortho_height", [None, 30], ids=["perspective", "ortho"])
def test_planes_that_cut_are_told_once(draw, ortho_height):
    scene = tl.Scene([square(-10), square(-20), square(-30)])  # the camera looks along -z
    planes = {"near=12": (12, 40), "far=25": (5, 25), "near=15 and far=25": (15, 25), "": (10, 30)}
    for fact, (near, far) in planes.items():
        camera = tl.Camera.look_at((0, 0, 0), (0, 0, -1), ortho_height=ortho_height, near=near, far=far)
        lines = told_by(lambda camera=camera: draw(scene, camera, SIZE), count=2)
        assert len(lines) == bool(fact)
        assert all(f"; {fact} cut" in line for line in lines)


def test_planes_tell_nothing_of_what_the_picture_lacks_anyway():
    ground = tl.Mesh([(-1, -1, 0), (1, -1, 0), (0, -1, -0.01)], [(0, 1, 2)])  # beneath the eye
    aside = tl.Mesh(np.array([(90, 0, -30), (91, 0, -30), (90, 1, -30)]), [(0, 1, 2)])
    unused = tl.Mesh([*square(-10).vertices, (0, 0, -99)], square(-10).triangles)
    camera = tl.Camera.look_at((0, 0, 0), (0, 0, -1), near=5, far=20)
    for mesh in (ground, aside, unused, square(5)):  # the last lies behind the eye
        assert told_by(lambda mesh=mesh: tl.render(mesh, camera, SIZE)) == []
    open_ended = {"near_clip": False, "far_clip": False}
    assert told_by(lambda: tl.rasterize_mesh(square(-30), camera, SIZE, **open_ended)) == []
    assert told_by(lambda: tl.render(square(-30), size=SIZE)) == []
    assert told_by(lambda: tl.render(square(-30), tl.Camera.look_at((0, 0, 0), (0, 0, -1)), SIZE)) == []
    assert told_by(lambda: tl.render(square(-30), tl.Camera.framing(square(-30)), SIZE)) == []


def test_a_part_of_a_large_mesh_and_the_picture_of_a_lens_are_looked_at():
    ball = tl.Mesh(*tl.scenes.icosphere(5))
    camera = tl.Camera.look_at((0, 0, 5), near=4.1, far=20)
    assert len(ball.triangles) > 2048
    assert len(told_by(lambda: tl.render(ball, camera, SIZE))) == 1
    lens = replace(camera, lens=tl.OpenCVLens(k1=-0.1))
    assert len(told_by(lambda: tl.render(ball, lens, SIZE))) == 1


def test_planes_that_leave_float32_no_room_are_told():
    def told(near, size):
        camera = tl.Camera.look_at((0, 0, 500), near=near, far=1000)
        return told_by(lambda: tl.render(square(0, size), camera, SIZE))

    (line,) = told(0.001, 100)
    assert line == (
        "camera should have far / near of at most 100000 here, or no planes: between near=0.001 and far=1000 float32 "
        "has fewer than 1000 steps of depth in the size of a mesh"
    )
    assert told(1.0, 100) == []
    assert told(0.005, 150000) == []


def test_a_batch_tells_of_planes_once():
    jobs = [
        tl.Job(square(-30), camera=tl.Camera.look_at((0, 0, i), (0, 0, -9), near=1, far=20), size=SIZE)
        for i in range(3)
    ]
    assert len(told_by(lambda: list(tl.render_batch(jobs)))) == 1


@pytest.mark.parametrize("planes", [(0.1, 20.0), (1e-3, np.inf), (-3.0, 4.0)], ids=["both", "infinite", "ortho"])
def test_planes_of_a_projection(planes):
    near, far = planes
    made = {"near": near, "far": 1e9 if np.isinf(far) else far, "ortho_height": 2.0 if near < 0 else None}
    camera = tl.Camera.look_at((0, 0, 5), **made)
    if np.isinf(far):
        matrix = camera.projection.copy()
        matrix[2, 2:] = -1, -2 * near
        camera = tl.Camera(camera.view, matrix)
    assert np.allclose(camera.planes, planes)
