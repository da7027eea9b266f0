"""`topleft.compat.bop`: depth and colours that the renderers of bop_toolkit return, without it."""

import numpy as np
import pytest

import topleft as tl
from topleft.compat import bop

SIZE = (16, 12)
K = (30.0, 31.0, 7.3, 6.1)
R = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0], [0.48, 0.64, 0.6]])
T = np.array([[6.0], [-4], [200]])
OCTAHEDRON = [[30, 0, 0], [0, 40, 0], [0, 0, 50], [-30, 0, 0], [0, -40, 0], [0, 0, -50]]
WALL_FACES = [[0, 2, 1], [0, 3, 2]]  # seen from -z
FACES = [[0, 1, 2], [3, 2, 1], [0, 2, 4], [3, 4, 2], [0, 5, 1], [3, 1, 5], [0, 4, 5], [3, 5, 4]]

# what the vispy renderer of bop_toolkit returns of the octahedron, rows 0 to 9 and columns 3 to 14; none else is seen
DEPTH = """
0      0      0      0      0      0      0      0      0      0      0      0
0      0      174.46 182.15 0      0      0      0      0      0      0      0
0      186.51 175.93 174.89 173.86 174.40 189.94 0      0      0      0      0
0      190.59 177.41 176.36 175.31 174.28 173.26 172.25 181.53 0      0      0
211.56 194.84 180.57 177.85 176.79 175.74 174.70 173.68 172.67 171.67 173.83 0
216.81 199.28 184.38 179.37 178.29 177.23 176.17 175.13 174.10 173.08 172.07 171.08
0      203.94 188.35 180.92 179.82 178.74 177.66 176.60 175.56 174.52 180.32 0
0      0      192.51 182.50 181.38 180.27 179.18 178.10 186.67 0      0      0
0      0      0      184.10 182.96 181.83 193.49 208.09 0      0      0      0
0      0      0      0      0      0      0      0      0      0      0      0
"""
LIGHT = """
0   0   0   0   0   0   0   0   0   0   0   0
0   0   200 127 0   0   0   0   0   0   0   0
0   176 200 200 200 128 126 0   0   0   0   0
0   175 200 200 200 200 200 200 127 0   0   0
168 174 179 200 200 200 200 200 200 200 128 0
166 172 177 200 200 200 200 200 200 200 200 200
0   170 176 200 200 200 200 200 200 200 135 0
0   0   174 200 200 200 200 200 134 0   0   0
0   0   0   200 200 200 133 131 0   0   0   0
0   0   0   0   0   0   0   0   0   0   0   0
"""


def ply(folder, vertices, faces, columns=(), rows=None, comment=None):
    """A PLY file of text; columns are (type, name) of what `rows` say of each vertex."""
    lines = ["ply", "format ascii 1.0", *([f"comment {comment}"] if comment else [])]
    lines += [f"element vertex {len(vertices)}", *(f"property float {name}" for name in "xyz")]
    lines += [f"property {kind} {name}" for kind, name in columns]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [[] for _ in vertices] if rows is None else rows
    lines += [" ".join(map(str, [*own, *more])) for own, more in zip(vertices, rows, strict=True)]
    lines += [" ".join(map(str, [len(own), *own])) for own in faces]
    path = folder / "obj_000001.ply"
    path.write_text("\n".join(lines) + "\n")
    return path


def renderer_of(path, size=SIZE, color=None, **options):
    renderer = bop.create_renderer(*size, "vispy", **options)
    renderer.add_object(1, path, surf_color=color)
    return renderer


def wall(folder, z=0.0):
    """A rectangle of 40 by 20 round the origin."""
    return ply(folder, [[-20, -10, z], [20, -10, z], [20, 10, z], [-20, 10, z]], WALL_FACES)


def test_octahedron_is_what_the_vispy_renderer_draws(tmp_path):
    """Its depth buffer has 16 bits."""
    path = ply(tmp_path, OCTAHEDRON, FACES)
    found = renderer_of(path, color=(200 / 255,) * 3, shading="flat").render_object(1, R, T, *K)
    depth, light = (np.array([row.split() for row in text.split("\n") if row], float) for text in (DEPTH, LIGHT))
    inside, outside = found["depth"][:10, 3:15], found["depth"].copy()
    assert np.array_equal(inside > 0, depth > 0)
    assert np.abs(inside - depth).max() < 0.1  # 0.08 at a side seen aslant, where a vertex snaps
    assert np.abs(found["rgb"][:10, 3:15] - light[..., None]).max() <= 1
    outside[:10, 3:15] = 0
    assert not outside.any()
    assert found["depth"].dtype == np.float32


def test_first_pixel_has_its_centre_at_one_half(tmp_path):
    """The wall goes from x = 2.6 to 10.6 and from y = 3.5 to 7.5: a centre on its upper side is inside."""
    depth = renderer_of(wall(tmp_path), mode="depth").render_object(1, np.eye(3), [0, 0, 100], 20, 20, 6.6, 5.5)[
        "depth"
    ]
    expected = np.zeros(SIZE[::-1], np.float32)
    expected[3:7, 3:11] = 100
    assert np.array_equal(depth > 0, expected > 0)
    assert np.allclose(depth, expected, rtol=1e-7)


def test_depth_of_a_slope_is_that_of_its_plane(tmp_path):
    angle = np.deg2rad(40)
    turned = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    depth = renderer_of(wall(tmp_path)).render_object(1, turned, [1, 2, 90], *K)["depth"]
    fx, _, cx, _ = K
    x = (np.arange(SIZE[0]) + 0.5 - cx) / fx  # the plane is z = 90 - tan(40 deg) (x z - 1)
    expected = np.broadcast_to((90 + np.tan(angle)) / (1 + np.tan(angle) * x), depth.shape)
    assert (depth > 0).sum() > 30
    assert np.allclose(depth[depth > 0], expected[depth > 0], rtol=2e-4)  # vertices snap by 1/512 px


def test_camera_is_that_of_from_intrinsics():
    rng = np.random.default_rng(0)
    pose = np.eye(4)
    for _ in range(20):
        pose[:3, :3], pose[:3, 3] = np.linalg.qr(rng.normal(size=(3, 3)))[0], 100 * rng.normal(size=3)
        (fx, fy, cx, cy), size = rng.uniform(50, 900, 4).tolist(), (640, 480)
        expected = tl.Camera.from_intrinsics(
            [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], pose, size, near=10.0, far=99.0, pixel_center=0.5
        )
        found = bop.Renderer(*size)._camera(pose, (fx, fy, cx, cy), 10.0, 99.0)
        assert (found.view == expected.view).all()
        assert np.allclose(
            found.projection, expected.projection, rtol=0, atol=2.0**-51 * abs(expected.projection).max()
        )


@pytest.mark.parametrize("shift", [(0, 0), (-60, 10), (45, -30), (0, 70)])
def test_object_beyond_the_frame_is_cut_as_the_whole_picture_is(tmp_path, shift):
    path = ply(tmp_path, OCTAHEDRON, FACES)
    t = [*shift, 200]
    depth = renderer_of(path, mode="depth").render_object(1, R, t, *K)["depth"]
    pose = np.vstack([np.column_stack([R, t]), [0, 0, 0, 1]])
    fx, fy, cx, cy = K
    camera = tl.Camera.from_intrinsics(
        [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], pose, SIZE, near=100, far=300, pixel_center=0.5
    )
    distance = tl.rasterize_mesh(tl.load(path), camera, SIZE).distance(camera)
    assert np.array_equal(depth > 0, np.isfinite(distance))
    assert np.allclose(depth[depth > 0], distance[depth > 0], rtol=1e-6)


def test_object_round_the_camera_shows_what_lies_before_it(tmp_path):
    """A wall along the view, from behind the camera to 20 before it, 5 to the right."""
    along = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    depth = renderer_of(wall(tmp_path), mode="depth").render_object(1, along, [5, 0, 0], 20, 20, 8, 6)["depth"]
    assert depth[6, 13:].min() > 0
    assert not depth[:, :13].any()  # its end lies at x = 8 + 20 * 5 / 20 = 13
    assert np.allclose(depth[6, 14], 20 * 5 / 6.5, rtol=1e-3)


def test_object_behind_the_camera_shows_nothing(tmp_path):
    found = renderer_of(wall(tmp_path), bg_color=(0.2, 0.4, 1, 0)).render_object(1, np.eye(3), [0, 0, -50], *K)
    assert not found["depth"].any()
    assert (found["rgb"] == (51, 102, 255)).all()


@pytest.mark.parametrize(("mode", "names"), [("rgb", ["rgb"]), ("depth", ["depth"]), ("rgb+depth", ["rgb", "depth"])])
def test_mode_says_what_is_returned(tmp_path, mode, names):
    assert list(renderer_of(wall(tmp_path), mode=mode).render_object(1, np.eye(3), T, *K)) == names


def test_light_is_ambient_and_cosine_up_to_white(tmp_path):
    """The light is 100 to the right of what is seen at the axis, and 100 nearer: a cosine of 0.7071."""
    renderer = renderer_of(wall(tmp_path), color=(1, 0.5, 0.2))
    renderer.set_light_cam_pos((100, 0, 0))
    renderer.set_light_ambient_weight(0.1)
    row, column = 6, 7
    t, k = np.array([0, 0, 100.0]), (30, 30, 7.5, 6.5)
    shown = renderer.render_object(1, np.eye(3), t, *k)["rgb"][row, column]
    assert shown.tolist() == np.rint(255 * (0.1 + np.sqrt(0.5)) * np.array([1, 0.5, 0.2])).tolist()
    renderer.set_light_ambient_weight(0.5)
    assert renderer.render_object(1, np.eye(3), t, *k)["rgb"][row, column].tolist() == [255, 128, 51]
    renderer.set_light_cam_pos((0, 0, -200))  # behind the wall
    assert renderer.render_object(1, np.eye(3), t, *k)["rgb"][row, column].tolist() == [128, 64, 26]


def test_light_of_phong_follows_normals_and_of_flat_the_triangles(tmp_path):
    """Normals turned by 60 degrees: 0.5 of the light; the triangle has all of it, though it is seen from behind."""
    normal = [np.sin(np.pi / 3), 0, -0.5]
    names = [("float", name) for name in ("nx", "ny", "nz")]
    corners = [[-20, -10, 0], [20, -10, 0], [20, 10, 0], [-20, 10, 0]]
    path = ply(tmp_path, corners, np.fliplr(WALL_FACES).tolist(), names, [normal] * 4)
    seen = {}
    for shading in ("phong", "flat"):
        renderer = renderer_of(path, color=(1, 1, 1), shading=shading)
        renderer.set_light_ambient_weight(0.0)
        seen[shading] = renderer.render_object(1, np.eye(3), [0, 0, 100], 30, 30, 7.5, 6.5)["rgb"][6, 7, 0]
    assert seen == {"phong": 128, "flat": 255}


def test_colours_are_those_of_the_vertices(tmp_path):
    names = [("uchar", name) for name in ("red", "green", "blue")]
    corners = [[-20, -10, 0], [20, -10, 0], [20, 10, 0], [-20, 10, 0]]
    path = ply(tmp_path, corners, WALL_FACES, names, [[10, 20, 30]] * 4)
    shown = renderer_of(path).render_object(1, np.eye(3), [0, 0, 100], *K)["rgb"]
    assert shown[6, 7].tolist() == [10, 20, 30]


def test_colours_are_those_of_the_texture_that_the_file_names(tmp_path):
    texels = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [90, 80, 70]]], np.uint8)
    tl.save_image(tmp_path / "skin.png", texels)
    names = [("float", "texture_u"), ("float", "texture_v")]
    corners = [[-20, -10, 0], [20, -10, 0], [20, 10, 0], [-20, 10, 0]]
    uv = [[0, 1], [1, 1], [1, 0], [0, 0]]  # y down: the first corner is above on the left
    path = ply(tmp_path, corners, WALL_FACES, names, uv, comment="TextureFile skin.png")
    shown = renderer_of(path).render_object(1, np.eye(3), [0, 0, 100], 30, 30, 8, 6)["rgb"]
    assert shown[[5, 5, 6, 6], [7, 8, 7, 8]].tolist() == texels.reshape(4, 3).tolist()


def test_object_without_colours_is_gray(tmp_path):
    assert (renderer_of(wall(tmp_path)).render_object(1, np.eye(3), [0, 0, 100], *K)["rgb"][6, 7] == 128).all()


def test_removed_object_is_not_known(tmp_path):
    renderer = renderer_of(wall(tmp_path))
    renderer.remove_object(1)
    with pytest.raises(KeyError, match="1"):
        renderer.render_object(1, np.eye(3), T, *K)


def test_points_are_no_object(tmp_path):
    path = ply(tmp_path, OCTAHEDRON, [])
    with pytest.raises(ValueError, match="model_path must be a file of triangles, got"):
        renderer_of(path)


@pytest.mark.parametrize("name", ["renderer_type", "mode", "shading"])
def test_unknown_word_is_refused(name):
    with pytest.raises(ValueError, match=f"{name} must be one of .*, got 'other'"):
        bop.create_renderer(16, 12, **{name: "other"})
