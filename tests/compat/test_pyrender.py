"""`topleft.compat.pyrender`: what pyrender promises, without it; and beside it, where it is installed."""

import math
import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from comparing import assert_same

import topleft as tl
from topleft.compat import pyrender as pr
from topleft.compat.__main__ import main

SIZE = (64, 48)
WALL = [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]
QUAD = [[0, 1, 2], [0, 2, 3]]


def away(distance):
    pose = np.eye(4)
    pose[2, 3] = distance
    return pose


def scene_of(*primitives, camera=None, **options):
    """A scene with a camera three units before the origin."""
    scene = pr.Scene(**options)
    for own in primitives:
        scene.add(pr.Mesh([own]))
    scene.add(camera or pr.PerspectiveCamera(yfov=1.0), pose=away(3))
    return scene


def draw(scene, flags=0, **options):
    return pr.OffscreenRenderer(*SIZE).render(scene, flags, **options)


def ball_like(radius=0.5, level=2):
    """What `Mesh.from_trimesh` reads of a `trimesh.Trimesh`."""
    vertices, faces = tl.scenes.icosphere(level)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    visual = SimpleNamespace(defined=False, kind=None)
    return SimpleNamespace(
        vertices=radius * vertices, faces=faces, vertex_normals=vertices, face_normals=normals, visual=visual
    )


CAMERAS = {
    "perspective": pr.PerspectiveCamera(yfov=1.0),
    "far plane": pr.PerspectiveCamera(yfov=1.0, zfar=10),
    "intrinsics": pr.IntrinsicsCamera(60, 50, 30, 20),
    "orthographic": pr.OrthographicCamera(2, 2),
}


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_depth_is_the_distance_along_the_view_and_zero_behind_everything(camera):
    half = pr.Primitive([[-9, -9, 0.5], [0, -9, 0.5], [0, 9, 0.5], [-9, 9, 0.5]], indices=QUAD)
    depth = draw(scene_of(half, camera=camera), pr.RenderFlags.DEPTH_ONLY)
    assert (depth.shape, depth.dtype) == ((48, 64), np.float32)
    assert np.abs(depth[depth > 0] - 2.5).max() < 2e-5  # window depth is float32
    is_left = depth[24] > 0
    assert is_left[: is_left.sum()].all()
    assert 20 < is_left.sum() < 44


def test_intrinsics_camera_has_its_principal_point_in_pixels_from_the_top_left():
    dot = pr.Primitive(0.001 * np.array(WALL[:3]))
    depth = draw(scene_of(dot, camera=pr.IntrinsicsCamera(2000, 2000, 20.5, 10.5)), pr.RenderFlags.DEPTH_ONLY)
    rows, columns = np.nonzero(depth)
    assert (10, 20) in set(zip(rows.tolist(), columns.tolist(), strict=True))


def test_backs_are_culled_unless_the_material_or_the_flag_says_so():
    back = pr.Primitive(WALL, indices=np.array(QUAD)[:, ::-1])
    scene = scene_of(back)
    assert not draw(scene, pr.RenderFlags.DEPTH_ONLY).any()
    assert draw(scene, pr.RenderFlags.DEPTH_ONLY | pr.RenderFlags.SKIP_CULL_FACES).all()
    back.material = pr.MetallicRoughnessMaterial(doubleSided=True)
    assert draw(scene, pr.RenderFlags.DEPTH_ONLY).all()


def test_segmentation_has_the_color_of_each_node_and_leaves_out_the_others():
    scene = pr.Scene()
    scene.add(pr.PerspectiveCamera(yfov=1.0), pose=away(3))
    left, right, hidden = (pr.Mesh.from_trimesh(ball_like()) for _ in range(3))
    nodes = [scene.add(own, pose=away(0)) for own in (left, right, hidden)]
    for node, x in zip(nodes, (-0.7, 0.7, 0), strict=True):
        node.translation = [x, 0, 0]
    color, depth = draw(scene, pr.RenderFlags.SEG, seg_node_map={nodes[0]: 20, nodes[1]: (1, 2, 3)})
    assert {tuple(own) for own in color.reshape(-1, 3).tolist()} == {(0, 0, 0), (20, 20, 20), (1, 2, 3)}
    assert color[24, 15].tolist() == [20, 20, 20]
    assert_same(depth > 0, color.any(axis=2))


def test_background_shows_as_it_is_and_its_alpha_with_rgba():
    scene = scene_of(bg_color=[0.2, 0.3, 0.4, 0.0])
    assert (draw(scene)[0] == [51, 76, 102]).all()
    assert (draw(scene, pr.RenderFlags.RGBA)[0] == [51, 76, 102, 0]).all()
    scene.add(pr.Mesh.from_trimesh(ball_like()))
    color, depth = draw(scene, pr.RenderFlags.RGBA)
    assert (color[0, 0] == [51, 76, 102, 0]).all()
    assert (color[depth > 0.1][:, 3] > 0).all()


def test_flat_pictures_show_the_base_color_as_it_is():
    wall = pr.Primitive(WALL, indices=QUAD, material=pr.MetallicRoughnessMaterial(baseColorFactor=[0.2, 0.4, 1, 1]))
    color, _ = draw(scene_of(wall), pr.RenderFlags.FLAT)
    assert (color == [51, 102, 255]).all()


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ([0, 1, 1], [0, 1 / 255, 1 / 255]),
        ((255, 128, 0), [1, 128 / 255, 0]),
        (np.array([[3, 2, 1]], np.uint8), [3 / 255, 2 / 255, 1 / 255]),
        ([0.0, 1.0, 2.0], [0, 1, 2]),
        (255, [1, 1, 1]),
        (0.25, [0.25, 0.25, 0.25]),
        ([0.5, 0.25], [0.5, 0.25, 1]),
        ([10, 20, 30, 40], [10 / 255, 20 / 255, 30 / 255]),
    ],
)
def test_colors_are_read_as_pyrender_reads_them(given, expected):
    """`format_color_vector` of pyrender: integers over 255, one number for all, 1 for those that are missing."""
    expected = np.array(expected, float)
    assert_same(pr.DirectionalLight(color=given).color, expected)
    material = pr.MetallicRoughnessMaterial(baseColorFactor=given, emissiveFactor=given)
    assert_same(material.emissiveFactor, expected)
    assert_same(pr.Scene(bg_color=given, ambient_light=given).ambient_light, expected)
    assert_same(material.baseColorFactor[:3], expected)


@pytest.mark.parametrize("given", [[], [0.5], np.array([[7]]), np.zeros((2, 3)), np.zeros((2, 2, 3))])
def test_what_is_no_color_is_refused(given):
    with pytest.raises(ValueError, match=r"color must have shape \(3,\)"):
        pr.DirectionalLight(color=given)


@pytest.mark.parametrize("intensity", [0.5, 2.0])
def test_matt_wall_in_a_directional_light_is_its_color_over_pi(intensity):
    """Albedo times intensity / pi, 4 % of which is mirrored at right angles; shown by the power 1 / 2.2."""
    matt = pr.MetallicRoughnessMaterial(baseColorFactor=[0.8, 0.8, 0.8, 1], metallicFactor=0, roughnessFactor=1)
    scene = scene_of(pr.Primitive(WALL, [[0, 0, 1]] * 4, indices=QUAD, material=matt))
    scene.add(pr.DirectionalLight(intensity=intensity), pose=np.eye(4))
    matt_part = 0.96 * 0.8 * intensity / math.pi
    mirrored = 0.04 * intensity / math.pi / 4
    expected = 255 * (matt_part + mirrored) ** (1 / 2.2)
    assert np.abs(draw(scene)[0][24, 32].astype(float) - expected).max() < 3


def test_spot_lights_its_cone_alone():
    wall = pr.Primitive(WALL, [[0, 0, 1]] * 4, indices=QUAD, material=pr.MetallicRoughnessMaterial(metallicFactor=0))
    scene = scene_of(wall)
    scene.add(pr.SpotLight(intensity=20.0, innerConeAngle=0.05, outerConeAngle=0.2), pose=away(3))
    color, _ = draw(scene)
    assert color[24, 32, 0] > 150
    assert not color[0, 0].any()


def test_of_many_lights_the_four_nearest_count():
    wall = pr.Primitive(WALL, [[0, 0, 1]] * 4, indices=QUAD, material=pr.MetallicRoughnessMaterial(metallicFactor=0))
    few, many = scene_of(wall), scene_of(wall)
    for scene, n in ((few, 4), (many, 9)):
        for k in range(n):
            scene.add(pr.DirectionalLight(intensity=0.2), pose=away(k))
    assert_same(draw(few)[0], draw(many)[0])


def test_points_hide_what_is_behind_them_and_are_hidden():
    scene = scene_of(pr.Primitive(WALL, indices=QUAD))
    scene.add(pr.Mesh.from_points([[0, 0, 1.0], [0.5, 0, -1.0]], colors=[[1.0, 0, 0], [0, 1, 0]]))
    color, depth = pr.OffscreenRenderer(*SIZE, point_size=4).render(scene)
    assert (color == [255, 0, 0]).all(axis=2).sum() == 16
    assert not (color == [0, 255, 0]).all(axis=2).any()
    assert np.unique(depth.round(4)).tolist() == [2, 3]


LINES = {"LINES": (0, 1), "LINE_STRIP": (1, 2), "LINE_LOOP": (2, 3)}


@pytest.mark.parametrize(("mode", "n_lines"), LINES.values(), ids=LINES)
def test_lines_are_a_pixel_wide_and_hidden_by_what_is_before_them(mode, n_lines):
    """Of three corners: one line, two, or three, the first of which is level; red turns to green along it."""
    corners = [[-0.5, 0.01, 0], [0.5, 0.01, 0], [0, 1, 0]]
    kind = [pr.GLTF.LINES, pr.GLTF.LINE_STRIP, pr.GLTF.LINE_LOOP][mode]
    lines = pr.Primitive(corners, mode=kind, color_0=np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]))
    color, depth = draw(scene_of(lines, bg_color=[0, 0, 0, 1]))
    row = color[23]
    seen = np.flatnonzero(depth[23])
    assert 14 <= len(seen) <= 16
    assert np.abs(depth[23, seen] - 3).max() < 2e-5
    assert row[seen[0], 0] > row[seen[0], 1]
    assert row[seen[-1], 0] < row[seen[-1], 1]
    assert (depth[18, 20:44] > 0).sum() == n_lines - 1
    wall = pr.Primitive(np.array(WALL) + [0, 0, 1], indices=QUAD)
    assert_same(draw(scene_of(lines, wall))[0], draw(scene_of(wall))[0])


@pytest.mark.parametrize("smooth", [True, False])
def test_mesh_of_trimesh_has_its_faces_with_normals_of_vertices_or_of_faces(smooth):
    own = ball_like(level=1)
    (primitive,) = pr.Mesh.from_trimesh(own, smooth=smooth).primitives
    corners = primitive.positions[primitive.triangles()]
    assert_same(corners, own.vertices[own.faces])
    drawn = primitive.drawn()
    expected = own.vertex_normals[own.faces] if smooth else np.repeat(own.face_normals[:, None], 3, axis=1)
    assert_same(drawn.normals[drawn.triangles], expected)


def test_material_of_trimesh_is_rougher_the_less_it_shines():
    own, material = ball_like(), SimpleNamespace(diffuse=[255, 0, 0, 255], image=None, kwargs={"Ns": [30.0]})
    own.visual = SimpleNamespace(defined=True, kind="texture", uv=None, material=material)
    assert pr.Mesh.from_trimesh(own).primitives[0].material.roughnessFactor == 0.5


@pytest.mark.parametrize(
    ("mode", "expected"), [(5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]), (6, [[0, 1, 2], [0, 2, 3], [0, 3, 4]])]
)
def test_strips_and_fans_are_taken_apart(mode, expected):
    assert pr.Primitive(np.zeros((5, 3)), mode=mode).triangles().tolist() == expected


def test_poses_of_nodes_are_products_along_the_tree():
    scene, parent = pr.Scene(), pr.Node(translation=[1, 2, 3])
    scene.add_node(parent)
    child = scene.add(pr.PointLight(), pose=away(5), parent_node=parent)
    assert scene.get_pose(child)[:3, 3].tolist() == [1, 2, 8]
    parent.rotation = [0, math.sqrt(0.5), 0, math.sqrt(0.5)]  # a quarter turn about y takes z to x
    assert np.allclose(scene.get_pose(child)[:3, 3], [6, 2, 3])
    assert np.allclose(pr.Node(matrix=scene.get_pose(child)).rotation, parent.rotation)
    scene.remove_node(parent)
    assert scene.nodes == set()


def test_sampled_outlines_are_mixed_in_the_numbers_of_the_picture():
    half = pr.Primitive([[-9, -9, 0], [0.01, -9, 0], [0.01, 9, 0], [-9, 9, 0]], indices=QUAD)
    half.material = pr.MetallicRoughnessMaterial(baseColorFactor=[1.0, 1.0, 1.0, 1.0])
    color, _ = draw(scene_of(half, bg_color=[0, 0, 0, 1]), pr.RenderFlags.FLAT)
    assert set(np.unique(color)) <= {0, 64, 128, 191, 255}
    assert len(np.unique(color)) == 3


BAD = {
    "yfov must be a number > 0": (lambda: pr.PerspectiveCamera(yfov=0), ValueError),
    "zfar must be larger than znear = 1, got 0.5": (lambda: pr.PerspectiveCamera(1, znear=1, zfar=0.5), ValueError),
    "aspectRatio is not set": (lambda: pr.PerspectiveCamera(1).get_projection_matrix(), ValueError),
    "innerConeAngle must lie in 0 to outerConeAngle": (lambda: pr.SpotLight(innerConeAngle=1), ValueError),
    "mode must be one of GLTF": (lambda: pr.Primitive([], mode=10), ValueError),
    "poses must have shape": (lambda: pr.Primitive([], poses=np.eye(3)), ValueError),
    "mesh must be a trimesh.Trimesh": (lambda: pr.Mesh.from_trimesh(None), TypeError),
    "material must be a MetallicRoughnessMaterial": (lambda: pr.Primitive([], material=3), TypeError),
    "camera must be a Camera": (lambda: pr.Node(camera=3), TypeError),
    "matrix must have shape": (lambda: pr.Node(matrix=np.eye(3)), ValueError),
    "rotation must be a quaternion of length 1": (lambda: pr.Node(rotation=[1, 2, 3, 4]), ValueError),
    "obj must be a Mesh, a Light or a Camera": (lambda: pr.Scene().add(None), TypeError),
    "parent_name must be that of one node": (lambda: pr.Scene().add(pr.PointLight(), parent_name="a"), ValueError),
    "scene must have a camera": (lambda: draw(pr.Scene()), ValueError),
    "alphaMode must be": (lambda: pr.MetallicRoughnessMaterial(alphaMode="x"), ValueError),
    "a texture needs a source": (lambda: pr.Texture(), ValueError),
}


@pytest.mark.parametrize("message", BAD)
def test_wrong_arguments_are_refused_in_words(message):
    call, kind = BAD[message]
    with pytest.raises(kind, match=message.replace("(", r"\(")):
        call()


@pytest.mark.parametrize(("flag", "word"), [("SHADOWS_DIRECTIONAL", "shadows"), ("ALL_WIREFRAME", "wireframes")])
def test_what_is_not_drawn_is_said(flag, word):
    with pytest.warns(UserWarning, match=f"draws no {word}"):
        draw(scene_of(), getattr(pr.RenderFlags, flag))


def test_depth_is_that_of_pyrender():
    """It keeps the first of four samples of a pixel: here the camera is moved by where OpenGL of Mesa has it."""
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    os.environ.setdefault("EGL_PLATFORM", "surfaceless")
    theirs = pytest.importorskip("pyrender")
    trimesh = pytest.importorskip("trimesh")
    found = []
    for module in (theirs, pr):
        scene = module.Scene()
        scene.add(module.Mesh.from_trimesh(trimesh.creation.icosphere(3)))
        camera = module.PerspectiveCamera(yfov=1.0)
        scene.add(camera, pose=away(3))
        if module is pr:
            plain = camera.get_projection_matrix
            shift = np.zeros((4, 4))
            shift[0, 2], shift[1, 2] = -0.25 / SIZE[0], -0.75 / SIZE[1]
            camera.get_projection_matrix = lambda *size: plain(*size) + shift  # noqa: B023
        renderer = module.OffscreenRenderer(*SIZE)
        found.append(renderer.render(scene, module.RenderFlags.DEPTH_ONLY))
        renderer.delete()
    expected, got = found
    assert_same(got > 0, expected > 0)
    is_close = np.abs(got - expected) <= 1e-4 * expected
    assert is_close.mean() > 0.99  # the steep rim of the ball is where vertices snap to


PROGRAM = """
import sys
import pyrender
from pyrender.constants import RenderFlags
scene = pyrender.Scene()
scene.add(pyrender.PerspectiveCamera(yfov=1.0))
print(sys.argv[1:], pyrender.OffscreenRenderer(4, 3).render(scene, RenderFlags.DEPTH_ONLY).shape)
"""


def test_program_runs_as_it_is(tmp_path, monkeypatch, capsys):
    path = tmp_path / "program.py"
    path.write_text(PROGRAM, encoding="utf-8")
    for name in ("pyrender", "pyrender.constants"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr(sys, "argv", sys.argv)
    monkeypatch.setattr(sys, "path", [*sys.path])
    assert main(["pyrender", str(path), "--size"]) == 0
    assert capsys.readouterr().out == "['--size'] (3, 4)\n"


@pytest.mark.parametrize("given", [[], ["pyrender"], ["blender", "x.py"], ["pyrender", "no_such_file.py"]])
def test_runner_says_how_it_is_called(given, capsys):
    assert main(given) == 2
    assert capsys.readouterr().err.startswith(
        ("usage: python -m topleft.compat NAME", "topleft.compat: there is no file")
    )


def test_primitive_with_alpha_per_vertex_keeps_it_in_bytes():
    colors = [[1, 0, 0, 0], [1, 0, 0, 0.5], [1, 0, 0, 1], [1, 0, 0, 2]]
    drawn = pr.Primitive(positions=WALL, indices=QUAD, color_0=np.array(colors)).drawn()
    assert drawn.colors[:, 3].tolist() == [0, 128, 255, 255]
