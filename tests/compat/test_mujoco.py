"""`topleft.compat.mujoco`: shapes and pictures of a stand-in scene; and beside MuJoCo, where it is installed."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

from topleft.compat.mujoco import Renderer, hook, install, shapes

SIZE = (64, 48)
QUALITY = (28, 16)


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return (a * np.cross(b, c)).sum() / 6


def prism(n):
    """The area of a regular polygon of n corners in the unit circle."""
    return n / 2 * math.sin(2 * math.pi / n)


SHAPES = {
    "sphere": (shapes.SPHERE, (0.5, 0.5, 0.5), 4 / 3 * math.pi * 0.5**3),
    "ellipsoid": (shapes.ELLIPSOID, (0.5, 0.2, 0.3), 4 / 3 * math.pi * 0.03),
    "capsule": (shapes.CAPSULE, (0.3, 0.3, 0.4), math.pi * 0.09 * 0.8 + 4 / 3 * math.pi * 0.027),
    "cylinder": (shapes.CYLINDER, (0.3, 0.3, 0.4), prism(28) * 0.09 * 0.8),
    "box": (shapes.BOX, (0.1, 0.2, 0.3), 8 * 0.006),
}


@pytest.mark.parametrize(("kind", "size", "expected"), SHAPES.values(), ids=SHAPES)
def test_primitive_is_closed_with_its_outside_outside(kind, size, expected):
    mesh = shapes.primitive(kind, size, QUALITY)
    found = volume(mesh)
    assert 0.96 * expected < found <= expected * (1 + 1e-9)  # facets lie within round things
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    assert (np.linalg.norm(faces, axis=1) > 0).all()
    normals = mesh.normals[mesh.triangles].sum(axis=1)
    cosine = (faces * normals).sum(1) / np.linalg.norm(faces, axis=1) / np.linalg.norm(normals, axis=1)
    assert cosine.min() > 0.98


@pytest.mark.parametrize(("kind", "low", "high"), [(100, 0, 0.3), (101, 0, 0.3), (102, -0.3, 0.3)])
def test_arrow_is_as_long_as_half_of_its_size(kind, low, high):
    """Shaft and head: those with wedges are 1.75 times as wide at the head."""
    mesh = shapes.primitive(kind, (0.1, 0.1, 0.6), QUALITY)
    wide = 0.1 if kind == shapes.ARROW1 else 0.175
    assert np.allclose(mesh.bounds, [[-wide, -wide, low], [wide, wide, high]])


@pytest.mark.parametrize("kind", [shapes.SPHERE, shapes.CAPSULE])
def test_normals_of_round_ends_are_those_of_the_sphere(kind):
    mesh = shapes.primitive(kind, (0.3, 0.3, 0.3 if kind == shapes.SPHERE else 0.4), QUALITY)
    center = np.clip(mesh.vertices, [0, 0, -0.4], [0, 0, 0.4]) if kind == shapes.CAPSULE else 0
    away = mesh.vertices - center
    assert np.allclose(np.linalg.norm(away, axis=1), 0.3)
    assert np.allclose(mesh.normals / np.linalg.norm(mesh.normals, axis=1, keepdims=True), away / 0.3)


def test_plane_without_end_repeats_its_texture_each_two_units():
    mesh = shapes.plane((0, 2), 50)
    assert mesh.bounds[:, 0].tolist() == [-50, 50]
    assert mesh.bounds[:, 1].tolist() == [-2, 2]
    assert mesh.uv[:, 0].tolist() == [-25, 25, 25, -25]
    assert mesh.uv[:, 1].tolist() == [0, 0, 1, 1]


def test_texture_that_repeats_runs_down_from_the_top_of_the_mesh():
    """OpenGL's t = down (1 - v) + shift runs down, and v = 1 - t."""
    mesh = shapes.laid(shapes.plane((1, 1), 50), 3, 2, -0.5)
    assert mesh.uv[:, 0].tolist() == [-0.5, 2.5, 2.5, -0.5]
    assert mesh.uv[:, 1].tolist() == [-0.5, -0.5, 1.5, 1.5]


def test_directions_lie_in_the_square_that_opengl_has_for_them():
    """Rows 0 to 5 of squares: +x, -x, +y, -y, +z, -z; in +x what is up has the smaller t."""
    cube = shapes.on_cube(shapes.primitive(shapes.BOX, (1, 1, 1), QUALITY), texels=1000)
    middles = cube.vertices[cube.triangles].mean(axis=1)
    squares = np.floor(6 * (1 - cube.uv[cube.triangles].mean(axis=1)[:, 1])).astype(int)
    axis = np.abs(middles).argmax(axis=1)
    is_low = np.take_along_axis(middles, axis[:, None], 1)[:, 0] < 0
    assert_same(squares, 2 * axis + is_low)
    side = (cube.vertices[:, 0] == 1) & (6 * (1 - cube.uv[:, 1]) < 1)
    assert np.corrcoef(cube.vertices[side, 1], cube.uv[side, 1])[0, 1] > 0.99
    assert np.corrcoef(cube.vertices[side, 2], cube.uv[side, 0])[0, 1] < -0.99


def test_height_field_is_closed_and_as_high_as_its_data():
    data = np.arange(12) / 11
    own = {"hfield_nrow": [3], "hfield_ncol": [4], "hfield_adr": [0], "hfield_data": data}
    mesh = shapes.height_field(SimpleNamespace(**own, hfield_size=np.array([[2.0, 1, 0.5, 0.1]])), 0)
    assert mesh.bounds.tolist() == [[-2, -1, -0.1], [2, 1, 0.5]]
    cells = np.lib.stride_tricks.sliding_window_view(data.reshape(3, 4), (2, 2)).reshape(-1, 4)
    halves = (cells[:, [0, 1, 3]].mean(axis=1) + cells[:, [0, 2, 3]].mean(axis=1)) / 2  # cut from (0, 0) to (1, 1)
    assert np.isclose(volume(mesh), 8 * (0.5 * halves.mean() + 0.1))


@pytest.mark.parametrize("i", [2, 3])
def test_mesh_and_its_hull_are_those_of_their_rows(i):
    """Mesh 1 of a model, behind a mesh of one vertex."""
    own = {"mesh_vertadr": [0, 1], "mesh_vertnum": [1, 3], "mesh_vert": [[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]]}
    own |= {"mesh_faceadr": [0, 0], "mesh_facenum": [0, 1], "mesh_face": np.array([[0, 1, 2]])}
    own |= {"mesh_normaladr": [0, 1], "mesh_normal": [[1, 0, 0], [0, 0, 1]], "mesh_facenormal": np.array([[0, 0, 0]])}
    own |= {"mesh_graphadr": [0, 1], "mesh_graph": [7, 3, 1, *[7] * 12, 0, 1, 2], "mesh_texcoordadr": [-1, -1]}
    mesh = shapes.asset(SimpleNamespace(**own), i)
    assert mesh.vertices[mesh.triangles].tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    assert mesh.normals is None if i == 3 else mesh.normals.tolist() == [[0, 0, 1]] * 3


# A stand-in for MuJoCo: what it hands over for a floor, a ball and a box

F = np.float32


def geom(kind, size, pos, rgba, objid, **more):
    own = {
        "type": kind, "size": np.array(size, F), "pos": np.array(pos, F), "mat": np.eye(3, dtype=F), "dataid": -1,
        "rgba": np.array(rgba, F), "matid": -1, "texid": -1, "texrepeat": np.zeros(2, F), "texuniform": 0,
        "emission": 0.0, "specular": 0.0, "shininess": 0.5, "segid": objid, "objid": objid, "objtype": 5,
    }  # fmt: skip
    return SimpleNamespace(**{**own, **more})


def eye(pos, forward, up):
    frustum = {"center": 0.0, "width": 0.0, "bottom": -0.005, "top": 0.005, "near": 0.01, "far": 50.0}
    named = {f"frustum_{name}": value for name, value in frustum.items()}
    return SimpleNamespace(
        pos=np.array(pos, F), forward=np.array(forward, F), up=np.array(up, F), orthographic=0, **named
    )


def sun(**more):
    own = {"type": 1, "dir": np.array([0, 0, -1], F), "pos": np.zeros(3, F), "diffuse": np.full(3, 0.5, F)}
    own |= {"ambient": np.full(3, 0.1, F), "specular": np.zeros(3, F), "cutoff": 45.0, "exponent": 10.0}
    return SimpleNamespace(**{**own, "attenuation": np.array([1, 0, 0], F), **more})


@pytest.fixture
def renderer(monkeypatch):
    """A renderer of a floor seen from above, with a red ball and a clear blue box on it."""
    scene = SimpleNamespace(
        geoms=[
            geom(shapes.PLANE, (3, 3, 1), (0, 0, 0), (0.8, 0.8, 0.8, 1), 0),
            geom(shapes.SPHERE, (0.5, 0.5, 0.5), (-0.7, 0, 0.5), (1, 0, 0, 1), 1),
            geom(shapes.BOX, (0.4, 0.4, 0.4), (0.8, 0, 0.4), (0, 0, 1, 0.5), 2),
        ],
        ngeom=3, lights=[sun()], nlight=1, flags=np.ones(10, np.uint8),
        camera=[eye((0, 0, 5), (0, 0, -1), (0, 1, 0))] * 2,
    )  # fmt: skip
    flags = SimpleNamespace(mjRND_CULL_FACE=0, mjRND_SKYBOX=1)
    fake = SimpleNamespace(MjvScene=lambda **_: scene, MjvOption=lambda: None, mjtRndFlag=flags)
    monkeypatch.setitem(sys.modules, "mujoco", fake)
    vis = SimpleNamespace(
        global_=SimpleNamespace(offwidth=640, offheight=480),
        quality=SimpleNamespace(numslices=28, numstacks=16, offsamples=4),
        map=SimpleNamespace(znear=0.01, zfar=50.0),
    )
    model = SimpleNamespace(vis=vis, stat=SimpleNamespace(extent=1.0, center=np.zeros(3)), ntex=0)
    return Renderer(model, *SIZE[::-1])


def test_colors_add_up_in_the_numbers_of_the_picture(renderer):
    """Floor of 0.8 in a light of 0.5 from above and 0.1 from all sides, and a box of half the opacity over it."""
    picture = renderer.render()
    assert (picture.shape, picture.dtype) == ((48, 64, 3), np.uint8)
    assert np.abs(picture[24, 32].astype(int) - round(255 * 0.8 * 0.6)).max() <= 2
    over = picture[24, 44].astype(int)
    assert np.abs(over[2] - 255 * 0.5 * 0.6 - 255 * 0.5 * 0.48).max() <= 3
    assert np.abs(over[:2] - 255 * 0.5 * 0.48).max() <= 3
    assert picture[24, 22, 0] > 2 * picture[24, 22, 1]


def test_light_that_falls_off_with_the_distance_is_as_bright_at_the_center(renderer):
    """A lamp two units over the floor: 1 / (0.5 + 0.25 * 2) of 0.5 there, and 0.1 from all sides, on 0.8."""
    lamp = {"type": 0, "pos": np.array([0, 0, 2], F), "cutoff": 180.0, "attenuation": np.array([0.5, 0.25, 0], F)}
    renderer.scene.lights = [sun(**lamp)]
    renderer.scene.ngeom = 1
    assert np.abs(renderer.render()[24, 32].astype(int) - round(255 * 0.8 * 0.6)).max() <= 2


def test_depth_is_the_distance_along_the_view_and_far_behind_everything(renderer):
    renderer.enable_depth_rendering()
    depth = renderer.render()
    assert depth.dtype == np.float32
    assert abs(depth[24, 32] - 5) < 5e-5  # planes are rounded to float32, as MuJoCo rounds them
    assert abs(depth[24, 44] - 4.2) < 5e-5
    renderer.scene.ngeom = 0
    assert np.abs(renderer.render() - 50).max() < 0.01  # as MuJoCo rounds it


def test_segmentation_has_number_and_type_and_minus_one_behind_everything(renderer):
    renderer.enable_segmentation_rendering()
    renderer.scene.camera[0].pos[:] = 0, 0, 9
    found = renderer.render()
    assert found[24, 32].tolist() == [0, 5]
    assert {tuple(own) for own in found.reshape(-1, 2).tolist()} == {(-1, -1), (0, 5), (1, 5), (2, 5)}
    renderer.scene.geoms[1].segid = -1
    assert 1 not in renderer.render()[..., 0]


def test_modes_replace_each_other(renderer):
    renderer.enable_depth_rendering()
    renderer.enable_segmentation_rendering()
    renderer.disable_depth_rendering()
    assert renderer.render().shape == (48, 64, 2)
    renderer.disable_segmentation_rendering()
    assert renderer.render().shape == (48, 64, 3)


def test_out_is_filled_and_returned(renderer):
    out = np.zeros((48, 64, 3), np.float64)
    assert renderer.render(out=out) is out
    assert_same(out.astype(np.uint8), renderer.render())
    with pytest.raises(ValueError, match=r"out must have shape \(48, 64, 3\), got \(2,\)"):
        renderer.render(out=np.zeros(2))


def test_geoms_that_move_move(renderer):
    before = renderer.render()
    renderer.scene.geoms[1].pos[:] = -0.7, 0.9, 0.5
    after = renderer.render()
    assert not np.array_equal(before, after)
    renderer.scene.geoms[1].pos[:] = -0.7, 0, 0.5
    assert_same(renderer.render(), before)


def test_geoms_that_change_their_look_are_drawn_anew(renderer):
    before = renderer.render()
    renderer.scene.geoms[1].rgba[:] = 0, 1, 0, 1
    after = renderer.render()
    assert before[24, 22, 0] > after[24, 22, 0]
    assert before[24, 22, 1] < after[24, 22, 1]
    renderer.scene.geoms[1].size[:] = 0.2
    assert not np.array_equal(after, renderer.render())
    renderer.scene.geoms[1].rgba[:], renderer.scene.geoms[1].size[:] = (1, 0, 0, 1), 0.5
    assert_same(renderer.render(), before)


def test_flex_is_drawn_where_it_is_now(renderer):
    scene = renderer.scene
    scene.geoms, scene.ngeom = [geom(shapes.FLEX, (0, 0, 0), (0, 0, 0), (1, 0, 0, 1), 0)], 1
    scene.flexfaceadr, scene.flexfaceused = [0], [1]
    scene.flexface, scene.flexnormal = np.array([-1, -1, 0, 1, -1, 0, 0, 1, 0], F), np.array([0, 0, 1] * 3, F)
    before = renderer.render()
    scene.flexface[::3] += 1
    assert not np.array_equal(before, renderer.render())


def test_plane_shows_through_from_below(renderer):
    renderer.scene.camera = [eye((0, 0, -5), (0, 0, 1), (0, 1, 0))] * 2
    renderer.scene.geoms[2].pos[:] = 0.8, 0, 1  # not in the plane
    renderer.scene.lights[0].ambient[:] = 0.5
    picture = renderer.render().astype(int)
    assert abs(picture[24, 32, 2] - 255 * 0.3 * 0.8 * 0.5) <= 2
    assert abs(picture[24, 26, 2] - 255 * (0.3 * 0.8 * 0.5 + 0.7 * 0.5 * 0.5)) <= 3


def test_closed_renderer_draws_nothing(renderer):
    with renderer:
        renderer.render()
    with pytest.raises(RuntimeError, match="render cannot be called after close"):
        renderer.render()


def test_picture_larger_than_the_buffer_of_the_model_is_refused(renderer):
    with pytest.raises(ValueError, match="width must be at most 640, that of the model's offscreen buffer, got 641"):
        Renderer(renderer.model, 48, 641)


@ON_EACH_ISA
def test_pictures_have_the_same_bits_on_each_isa(isa, renderer):
    with on("scalar"):
        expected = renderer.render()
    with on(isa):
        assert_same(renderer.render(), expected)


@pytest.fixture
def hooked(renderer, monkeypatch):
    """MuJoCo's module with the calls of topleft, a rectangle of the size, and the renderer."""
    for name in (*hook.PLATFORMS, *hook.OF_DM_CONTROL):
        monkeypatch.setitem(sys.modules, name, None)
    fake = sys.modules["mujoco"]
    fake.mjtRndFlag.mjRND_SEGMENT, fake.mjtDepthMap = 8, SimpleNamespace(mjDEPTH_ZEROFAR=1)
    renderer.scene.flags[8] = 0
    install()
    return fake, SimpleNamespace(width=SIZE[0], height=SIZE[1]), renderer


def test_calls_of_mujoco_fill_arrays_from_the_lowest_row(hooked):
    mujoco, rectangle, own = hooked
    con = mujoco.MjrContext(own.model, 150)
    mujoco.mjr_render(rectangle, own.scene, con)
    rgb, depth = np.zeros(SIZE[0] * SIZE[1] * 3, np.uint8), np.zeros(SIZE[::-1], np.float32)
    mujoco.mjr_readPixels(rgb, depth, rectangle, con)
    assert_same(rgb.reshape(48, 64, 3)[::-1], own.render())
    own.enable_depth_rendering()
    near, far = 0.01, 50.0
    distance = near / (1 - depth.astype(np.float64) * (1 - near / far))
    assert (np.abs(distance / own.render()[::-1] - 1) < 1e-4).all()
    con.readDepthMap = 1
    reversed_depth = np.zeros_like(depth)
    mujoco.mjr_readPixels(None, reversed_depth, rectangle, con)
    assert np.abs(1 - depth - reversed_depth).max() < 1e-7


def test_segments_of_mujoco_are_numbers_in_three_bytes(hooked):
    mujoco, rectangle, own = hooked
    own.scene.flags[8] = 1
    own.scene.geoms[1].segid = 70000
    con = mujoco.MjrContext(own.model)
    mujoco.mjr_render(rectangle, own.scene, con)
    own.scene.flags[8] = 0  # as Gymnasium does it, before it reads
    rgb = np.zeros((48, 64, 3), np.uint8)
    mujoco.mjr_readPixels(rgb, None, rectangle, con)
    found = (rgb[::-1].astype(int) << [0, 8, 16]).sum(axis=2)
    own.enable_segmentation_rendering()
    assert_same(found, np.array([1, 70001, 3, 0])[own.render()[..., 0]])


def test_pixels_of_another_size_than_was_rendered_are_refused(hooked):
    mujoco, rectangle, own = hooked
    con = mujoco.MjrContext(own.model)
    with pytest.raises(ValueError, match=r"viewport must have the size of mjr_render's last picture, got \(64, 48\)"):
        mujoco.mjr_readPixels(np.zeros((48, 64, 3), np.uint8), None, rectangle, con)


def test_contexts_of_all_platforms_make_nothing_current(hooked):
    for name in hook.PLATFORMS:
        own = sys.modules[name].GLContext(640, 480)
        own.make_current()
        own.free()
    assert hooked[0].Renderer is Renderer


@pytest.mark.parametrize("package", ["gymnasium", "dm_control"])
def test_program_of_the_robots_page_runs(package):
    pytest.importorskip(package)
    page = Path(__file__).parents[2].joinpath("docs", "guide", "robots.md").read_text(encoding="utf-8")
    (program,) = [code for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if package in code]
    done = subprocess.run([sys.executable, "-c", f"{program}\nprint(frame.shape)"], capture_output=True, text=True)
    assert done.stdout.strip() in ("(480, 480, 3)", "(240, 320, 3)"), done.stderr


MODEL = """
<mujoco><visual><headlight ambient="0.1 0.1 0.1"/></visual>
<asset><texture name="t" type="2d" builtin="checker" rgb1=".2 .3 .4" rgb2=".6 .6 .6" width="64" height="64"/>
<texture type="skybox" builtin="gradient" rgb1=".3 .5 .7" rgb2="0 0 0" width="64" height="64"/>
<material name="m" texture="t" texrepeat="3 3"/></asset>
<worldbody><light pos="0 0 3" dir="0 0 -1"/><geom type="plane" size="2 2 .1" material="m"/>
<geom type="capsule" size=".2 .3" pos="0 0 .6" euler="40 20 0" rgba="1 .5 .2 1"/>
<geom type="sphere" size=".3" pos=".7 0 .3"/><geom type="box" size=".2 .2 .3" pos="-.7 0 .3" euler="0 0 30"/>
<geom type="ellipsoid" size=".2 .3 .1" pos="0 .8 .3"/><geom type="cylinder" size=".2 .3" pos="0 -.8 .3"/>
</worldbody></mujoco>
"""


def test_depth_segmentation_and_colors_are_those_of_mujoco():
    os.environ.setdefault("MUJOCO_GL", "egl")
    os.environ.setdefault("EGL_PLATFORM", "surfaceless")
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = []
    for kind in (mujoco.Renderer, Renderer):
        with kind(model, 240, 320) as own:
            own.update_scene(data)
            own.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
            color = own.render()
            own.enable_depth_rendering()
            depth = own.render()
            own.enable_segmentation_rendering()
            found.append((color, depth, own.render()))
    (color, depth, ids), (own_color, own_depth, own_ids) = found
    is_off = (ids != own_ids).any(axis=2)
    windows = np.lib.stride_tricks.sliding_window_view(ids[..., 0], (3, 3))
    is_inside = np.pad((windows == windows[..., 1:2, 1:2]).all(axis=(2, 3)), 1)
    assert not (is_off & is_inside).any()
    assert is_off.sum() < 100
    assert (np.abs(own_depth - depth) <= 1e-4 * depth)[is_inside].all()
    assert np.abs(own_color.astype(int) - color)[is_inside].mean() < 8
