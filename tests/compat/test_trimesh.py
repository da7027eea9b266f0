"""`topleft.compat.trimesh`: scenes that look like trimesh's to it; and those of trimesh, where it is installed."""

import io
import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from comparing import assert_same
from PIL import Image

from topleft.compat import trimesh as ct
from topleft.compat.__main__ import main
from topleft.compat._arrays import dots_along

SIZE = (64, 48)
QUAD = [[0, 1, 2], [0, 2, 3]]
WALL = np.array([[-9.0, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]])


class Camera:
    """As trimesh's: a field of view (across, up) in degrees; focal lengths follow from the resolution."""

    name, z_near, z_far, fov = "camera", 0.01, 1000.0, np.array([50.0, 40.0])

    def __init__(self):
        self.resolution = np.array(SIZE)

    @property
    def focal(self):
        return np.asarray(self.resolution) / (2 * np.tan(np.radians(self.fov) / 2))


class Scene:
    """Geometries, each at a place, and a camera three units before the origin."""

    def __init__(self, *geometries, at=None, lights=None):
        self.geometry = dict(enumerate(geometries))
        self.poses = {k: np.eye(4) if at is None else at[k] for k in self.geometry}
        self.camera, self.camera_transform, self._lights = Camera(), away(3), lights
        self.bounds, self.scale = np.array([[-1.0, -1, -1], [1, 1, 1]]), math.sqrt(12)

    @property
    def graph(self):
        lights = {light.name: (light.pose, None) for light in self._lights or ()}
        own = {node: (pose, node) for node, pose in self.poses.items()}
        return type("Graph", (dict,), {"nodes_geometry": list(own)})({**own, **lights})


def away(distance):
    pose = np.eye(4)
    pose[2, 3] = distance
    return pose


def mesh(vertices=WALL, faces=QUAD, **visual):
    own = {"kind": None, **visual}
    return SimpleNamespace(
        vertices=np.asarray(vertices, float), faces=np.array(faces), _cache={}, visual=SimpleNamespace(**own)
    )


def draw(scene, resolution=None, **options):
    return np.asarray(Image.open(io.BytesIO(ct.save_image(scene, resolution, **options))))


def test_silhouette_is_where_rays_of_the_camera_meet_a_triangle():
    corners = np.array([[-0.9, -0.8, 0.3], [1.1, -0.3, -0.4], [0.1, 0.7, 0.2]])
    scene = Scene(mesh(corners, [[0, 1, 2]]))
    found = ct.silhouette(scene)
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2, SIZE[1] / 2 - np.arange(SIZE[1]) - 0.5)
    rays = np.stack([x / scene.camera.focal[0], y / scene.camera.focal[1], np.full(x.shape, -1.0)], axis=2)
    a, b, c = corners - [0, 0, 3]
    sides = np.stack([(rays * np.cross(p, q)).sum(2) for p, q in ((a, b), (b, c), (c, a))])
    assert_same(found, (sides < 0).all(0) | (sides > 0).all(0))
    assert 100 < found.sum() < 1000


def test_silhouette_of_nothing_is_empty():
    assert not ct.silhouette(Scene(), (4, 3)).any()
    assert ct.silhouette(Scene(), (4, 3)).shape == (3, 4)


def test_image_is_a_png_of_the_resolution_which_the_camera_keeps():
    scene = Scene(mesh())
    assert ct.save_image(scene, (20, 10)).startswith(b"\x89PNG")
    assert tuple(scene.camera.resolution) == (20, 10)
    assert draw(scene).shape == (10, 20, 4)


def test_default_lights_move_with_the_camera_and_add_up_in_the_numbers_of_the_picture():
    """0.2 and 60 / 255 twice from all sides, 60 / 255 along (1, 1, 1) in the space of the eye: on grey 102."""
    expected = 102 * (0.2 + 60 / 255 * (2 + 1 / math.sqrt(3)))
    scene = Scene(mesh())
    assert abs(float(draw(scene)[24, 32, 0]) - expected) < 1.5
    half_turn = np.diag([-1.0, 1, -1, 1])
    scene.camera_transform = half_turn @ away(3)
    scene.poses[0] = half_turn
    assert abs(float(draw(scene)[24, 32, 0]) - expected) < 1.5


COLORS = {
    "vertex": {"kind": "vertex", "vertex_colors": np.tile(np.array([200, 100, 0, 255], np.uint8), (4, 1))},
    "face": {"kind": "face", "face_colors": np.tile(np.array([200, 100, 0, 255], np.uint8), (2, 1))},
    "material": {
        "kind": "texture", "uv": None,
        "material": SimpleNamespace(
            diffuse=[0, 0, 0, 255], main_color=[200, 100, 0, 255], specular=None, glossiness=1.0, image=None
        ),
    },
    "texture": {
        "kind": "texture", "uv": np.zeros((4, 2)),
        "material": SimpleNamespace(
            diffuse=[9, 9, 9, 255], specular=None, glossiness=1.0, image=Image.new("RGB", (2, 2), (200, 100, 0))
        ),
    },
}  # fmt: skip


@pytest.mark.parametrize("visual", COLORS.values(), ids=COLORS)
def test_colors_of_vertices_faces_materials_and_textures_are_lit(visual):
    lit = 0.2 + 60 / 255 * (2 + 1 / math.sqrt(3))
    found = draw(Scene(mesh(**visual)))[24, 32].astype(float)
    assert np.abs(found - [200 * lit, 100 * lit, 0, 255]).max() < 2.5


def test_metallic_rough_material_shows_its_base_color():
    color = np.array([200, 100, 0, 128], np.uint8)
    numbers = {"baseColorFactor": color, "main_color": color, "alphaMode": "BLEND", "doubleSided": True}
    words = "baseColorTexture emissiveFactor emissiveTexture metallicFactor roughnessFactor metallicRoughnessTexture "
    words += "occlusionTexture normalTexture alphaCutoff"
    material = SimpleNamespace(**dict.fromkeys(words.split()), **numbers)
    found = draw(Scene(mesh(kind="texture", uv=None, material=material)), background=[0, 0, 0, 255])[24, 32]
    lit = 0.2 + 60 / 255 * (2 + 1 / math.sqrt(3))
    assert np.abs(found[:3].astype(float) - np.array([200, 100, 0]) * lit * 128 / 255).max() < 3  # half of it shows


def test_edges_by_which_faces_bend_are_sharp_and_faces_of_one_color_share_corners():
    """Two walls at a right angle: each has the light of its side all over."""
    corners = [[0, -1, 0], [1, -1, -1], [1, 1, -1], [0, 1, 0], [-1, -1, -1], [-1, 1, -1]]
    roof = mesh(
        corners, [[0, 1, 2], [0, 2, 3], [4, 0, 3], [4, 3, 5]], kind="face", face_colors=np.full((4, 4), 255, np.uint8)
    )
    picture = draw(Scene(roof))
    assert len(np.unique(picture[24, 25:29, 0])) == 1
    assert picture[24, 27, 0] != picture[24, 36, 0]
    own, _ = ct.drawn(roof, smooth=True)
    assert len(own.vertices) == 6


def test_background_shows_as_it_is_with_its_opacity():
    assert (draw(Scene(), background=[10, 20, 30, 0]) == [10, 20, 30, 0]).all()
    assert (draw(Scene(), background=[1.0, 0.0, 0.0]) == [255, 0, 0, 255]).all()
    assert (draw(Scene()) == 255).all()


def test_backs_are_culled_unless_the_flag_says_so():
    back = Scene(mesh(faces=np.array(QUAD)[:, ::-1]))
    assert (draw(back) == 255).all()
    assert (draw(back, flags={"cull": False})[..., 0] < 255).all()


def test_geometry_that_stands_twice_is_one_mesh_with_the_names_of_its_nodes():
    one = mesh(0.1 * WALL)
    found = ct.as_scene(Scene(one, one, at=[away(0), away(1)]))
    assert found[0].mesh is found[1].mesh
    assert [own.name for own in found] == ["0", "1"]
    assert found[1].transform[2, 3] == 1


def light(kind, pose, **more):
    values = {"name": kind, "pose": pose, "color": np.array([255, 0, 0, 255]), "intensity": 0.5}
    return type(kind, (), {**values, **more})()


LIGHTS = {
    "directional": (light("DirectionalLight", away(-9)), 0.5,
     0.5 + 0.508 * 0.5 * math.cos(math.atan(1 / 3) / 2) ** 51.2),
    "point": (light("PointLight", away(1)), 0.5, 0.5 / math.sqrt(2)),
    "spot": (light("SpotLight", away(1), innerConeAngle=0.1, outerConeAngle=0.2), 0.5, 0.0),
}  # fmt: skip


@pytest.mark.parametrize(("own", "front", "aside"), LIGHTS.values(), ids=LIGHTS)
def test_lights_of_a_scene_shine_from_their_nodes(own, front, aside):
    """Red light of 0.5: a third of it also from all sides; the pixel aside is a unit away, seen at 18 degrees."""
    blue = COLORS["vertex"] | {"vertex_colors": np.tile(np.array([255, 0, 255, 255], np.uint8), (4, 1))}
    scene = Scene(mesh(**blue), lights=[own])
    from_all_sides = 0.2 + 0.5 / 3
    column = 32 + round(scene.camera.focal[1] / 3)  # pixels are squares: the field of view up counts
    found = draw(scene).astype(float)
    assert abs(found[24, column, 0] / 255 - from_all_sides - aside) < 0.06
    assert found[24, 32, 0] / 255 > from_all_sides + front - 0.02
    assert abs(found[24, 32, 2] / 255 - from_all_sides) < 0.02 + (found[24, 32, 0] == 255) * 0.3  # highlights are white


def test_points_are_squares_that_hide_and_are_hidden():
    cloud = SimpleNamespace(vertices=np.array([[0, 0, 1.0], [0.5, 0, -1]]), colors=np.array([[255, 0, 0, 255]] * 2))
    found = draw(Scene(mesh(), cloud), line_settings={"point_size": 4})
    assert (found == [255, 0, 0, 255]).all(axis=2).sum() == 16


def path(vertices, color=None):
    entity = SimpleNamespace(discrete=lambda points: points)
    colors = None if color is None else np.array([color])
    return SimpleNamespace(entities=[entity], vertices=np.array(vertices, float), colors=colors)


def test_line_on_a_wall_shows_and_one_behind_it_does_not():
    across = [[-1, 0, 0], [1, 0, 0]]
    found = draw(Scene(mesh(), path(across, [0, 255, 0, 255])), line_settings={"line_width": 2})
    is_green = (found == [0, 255, 0, 255]).all(axis=2)
    columns = np.flatnonzero(is_green.any(axis=0))
    focal = Camera().focal[1]
    assert columns[0] == pytest.approx(32 - focal / 3, abs=1.5)
    assert len(columns) == columns[-1] - columns[0] + 1
    assert np.flatnonzero(is_green.any(axis=1)).tolist() == [23, 24]
    behind = draw(Scene(mesh(), path(np.array(across) - [0, 0, 1])))
    assert_same(behind, draw(Scene(mesh())))


def test_flat_path_is_black_in_the_plane_of_its_place():
    found = draw(Scene(path([[-1, 0.2], [1, 0.2]])), line_settings={"line_width": 1})
    assert (found[..., 3] == 255).all()
    assert (found == [0, 0, 0, 255]).all(axis=2).sum() >= 30


def test_dots_lie_at_most_half_a_pixel_apart_in_the_picture_and_none_outside():
    rng = np.random.default_rng(0)
    segments = rng.normal(size=(50, 2, 3)) * 3
    scene = Scene()
    matrix = ct.as_camera(scene).clip_from_world(SIZE)
    dots, row = dots_along(segments, matrix, SIZE)
    clip = np.column_stack([dots, np.ones(len(dots))]) @ matrix.T
    assert (np.abs(clip[:, :3]) <= clip[:, 3:] * (1 + 1e-9)).all()
    px = clip[:, :2] / clip[:, 3:] * np.array(SIZE) / 2
    steps = np.linalg.norm(np.diff(px, axis=0), axis=1)[np.diff(row) == 0]
    assert steps.max() <= 0.5 + 1e-9
    a, b = segments[row, 0], segments[row, 1]
    off = np.linalg.norm(np.cross(dots - a, b - a), axis=1) / np.linalg.norm(b - a, axis=1)
    assert off.max() < 1e-9
    assert 10 < len(np.unique(row)) < 50


@pytest.mark.parametrize("word", ct.NOT_DRAWN)
def test_what_is_not_drawn_is_said(word):
    with pytest.warns(UserWarning, match=f"topleft.compat.trimesh draws no {word}"):
        draw(Scene(mesh()), flags={word: True})


def test_hook_holds_within_its_block(monkeypatch):
    kind = type("Scene", (Scene,), {"save_image": None})
    monkeypatch.setitem(sys.modules, "trimesh", SimpleNamespace(Scene=kind))
    with ct.installed():
        assert kind(mesh()).save_image(resolution=(5, 4), visible=True).startswith(b"\x89PNG")
    assert kind.save_image is None


def test_program_runs_as_it_is(tmp_path, monkeypatch, capsys):
    program = tmp_path / "program.py"
    program.write_text("import trimesh\nprint(trimesh.Scene.save_image.__module__)\n", encoding="utf-8")
    monkeypatch.setitem(sys.modules, "trimesh", SimpleNamespace(Scene=type("Scene", (), {})))
    monkeypatch.setenv("PYGLET_SHADOW_WINDOW", "1")
    monkeypatch.setattr(sys, "argv", sys.argv)
    monkeypatch.setattr(sys, "path", [*sys.path])
    assert main(["trimesh", str(program)]) == 0
    assert capsys.readouterr().out == "topleft.compat.trimesh\n"


def test_silhouette_and_picture_of_a_scene_of_trimesh_are_those_of_its_rays():
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene(trimesh.creation.box((1, 2, 1)))
    scene.set_camera(angles=(0.3, 0.4, 0.1), resolution=(40, 30))
    origins, rays, _ = scene.camera_rays()
    with np.errstate(divide="ignore"):
        near, far = ((np.array([0.5, 1, 0.5]) * side - origins) / rays for side in (-1, 1))
    is_met = np.minimum(near, far).max(axis=1) < np.maximum(near, far).min(axis=1)
    found = ct.silhouette(scene)
    assert_same(found.T.ravel(), is_met)
    with ct.installed():
        picture = np.asarray(Image.open(io.BytesIO(scene.save_image(resolution=(40, 40)))))
    assert picture.shape == (40, 40, 4)
    assert 0.2 < (picture[..., 0] < 200).mean() < 0.9
