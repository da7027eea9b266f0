"""Animations of glTF: where nodes, skins and morph targets are at a time."""

import json
import warnings

import numpy as np
import pytest
from gltf_files import TRIANGLE, GltfFile

import topleft as tl
from topleft.errors import MeshError, MeshWarning

HALF = np.sqrt(0.5)
TURNED = [0, 0, HALF, HALF]
"""A quarter turn about z."""


def animation(file, path, times, values, interpolation=None, *, node=0, **more):
    """Add an animation of one channel."""
    sampler = {"input": file.accessor(np.array(times, np.float32)), "output": file.accessor(values, **more)}
    if interpolation:
        sampler["interpolation"] = interpolation
    channel = {"sampler": 0, "target": {"node": node, "path": path}}
    return file.add("animations", {"samplers": [sampler], "channels": [channel]})


@pytest.fixture
def load(tmp_path):
    def read(file, time=None, clip=None, load=tl.load):
        path = tmp_path / "a.glb"
        path.write_bytes(file.glb())
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return load(path, time=time, clip=clip)

    return read


def moved(*arguments, **more):
    file = GltfFile().shown()
    animation(file, *arguments, **more)
    return file


def corners(mesh):
    return mesh.vertices[mesh.triangles][0]


@pytest.mark.parametrize(
    ("interpolation", "expected"),
    [
        (None, {0: 2, 1: 2, 1.5: 3, 2: 4, 3: 2, 4: 0, 9: 0}),
        ("LINEAR", {0: 2, 1.25: 2.5, 2.5: 3}),
        ("STEP", {0: 2, 1: 2, 1.99: 2, 2: 4, 3.9: 4, 4: 0, 9: 0}),
    ],
)
def test_animated_translation_is_where_its_keys_say(load, interpolation, expected):
    file = moved("translation", [1, 2, 4], [[2, 0, 0], [4, 0, 0], [0, 0, 0]], interpolation)
    for time, x in expected.items():
        assert np.allclose(corners(load(file, time)), TRIANGLE + np.array([x, 0, 0]), atol=1e-6)


def test_animated_translation_of_a_spline_has_its_tangents(load):
    rows = [[0, 0, 0], [1, 0, 0], [0, 3, 0], [0, 0, 2], [5, 1, 0], [9, 9, 9]]  # in, value, out; in, value, out
    file = moved("translation", [1, 3], rows, "CUBICSPLINE")
    assert np.allclose(corners(load(file, 0)), TRIANGLE + np.array([1, 0, 0]))
    assert np.allclose(corners(load(file, 3)), TRIANGLE + np.array([5, 1, 0]))
    u, span = 0.25, 2  # at 1.5
    at = (2 * u**3 - 3 * u**2 + 1) * np.array([1, 0, 0]) + span * (u**3 - 2 * u**2 + u) * np.array([0, 3, 0])
    at += (3 * u**2 - 2 * u**3) * np.array([5, 1, 0]) + span * (u**3 - u**2) * np.array([0, 0, 2])
    assert np.allclose(corners(load(file, 1.5)), TRIANGLE + at, atol=1e-6)


@pytest.mark.parametrize("sign", [1, -1])
def test_animated_rotation_goes_the_short_way_evenly(load, sign):
    file = moved("rotation", [0, 1], [[0, 0, 0, 1], np.multiply(sign, TURNED)])
    for time in (0, 0.1, 0.5, 0.8, 1):
        angle = time * np.pi / 2
        second = corners(load(file, time))[1]  # which was (1, 0, 0)
        assert np.allclose(second, [np.cos(angle), np.sin(angle), 0], atol=1e-6)


def test_animated_rotation_of_little_is_even_too(load):
    angle = 0.02
    file = moved("rotation", [0, 1], [[0, 0, 0, 1], [0, 0, np.sin(angle / 2), np.cos(angle / 2)]])
    assert np.allclose(corners(load(file, 0.25))[1], [np.cos(angle / 4), np.sin(angle / 4), 0], atol=1e-6)


def test_animated_rotation_of_whole_numbers_and_of_splines_is_read(load):
    keys = np.array([[0, 0, 0, 127], [0, 0, 90, 90]], np.int8)
    second = corners(load(moved("rotation", [0, 1], keys, normalized=True), 1))[1]
    assert np.allclose(second, [0, 1, 0], atol=1e-6)
    zero = [0, 0, 0, 0]
    rows = [zero, [0, 0, 0, 1], zero, zero, TURNED, zero]
    second = corners(load(moved("rotation", [0, 2], rows, "CUBICSPLINE"), 1))[1]
    assert np.allclose(second, [HALF, HALF, 0], atol=1e-6)


def test_animated_node_takes_its_children_and_cameras_with_it(load):
    file = GltfFile(cameras=[{"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 1, "zfar": 9}}])
    file.node(children=[1, 2], scale=[7, 7, 7])
    file.node(mesh=file.mesh(file.primitive()), translation=[1, 0, 0])
    file.node(camera=0)
    file.tree["scenes"] = [{"nodes": [0]}]
    animation(file, "scale", [0, 1], [[1, 1, 1], [3, 2, 1]])
    assert np.allclose(corners(load(file, 0.5)), (TRIANGLE + np.array([1, 0, 0])) * [2, 1.5, 1])
    file.tree["animations"][0]["channels"][0]["target"]["path"] = "translation"
    (camera,) = load(file, 1, load=tl.load_cameras)
    assert np.allclose(np.linalg.inv(camera.view)[:3, 3], [3, 2, 1])
    (camera,) = load(file, load=tl.load_cameras)
    assert np.allclose(np.linalg.inv(camera.view)[:3, 3], [0, 0, 0])


def test_cameras_of_an_animation_are_read_with_the_root_and_limits_of_load(tmp_path):
    file = GltfFile(cameras=[{"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 1, "zfar": 9}}])
    file.node(camera=0)
    file.tree["scenes"] = [{"nodes": [0]}]
    animation(file, "translation", [0, 1], [[1, 1, 1], [3, 2, 1]])
    (tmp_path / "meshes").mkdir()
    path = tmp_path / "meshes" / "a.gltf"
    (tmp_path / "a.bin").write_bytes(bytes(file.blob))
    file.tree["buffers"] = [{"byteLength": len(file.blob), "uri": "../a.bin"}]
    path.write_text(json.dumps(file.tree))
    with pytest.raises(MeshError):
        tl.load_cameras(path, time=1)
    (camera,) = tl.load_cameras(path, time=1, root=tmp_path)
    assert np.allclose(np.linalg.inv(camera.view)[:3, 3], [3, 2, 1])
    with pytest.raises(MeshError, match="more than the 0 of max_nodes"):
        tl.load_cameras(path, time=1, root=tmp_path, max_nodes=0)
    with pytest.raises(TypeError, match=r"limits are max_bytes, .*, got 'max_cameras'"):
        tl.load_cameras(path, max_cameras=1)


@pytest.mark.parametrize("interpolation", ["LINEAR", "CUBICSPLINE"])
def test_animated_weights_move_vertices(load, interpolation):
    file = GltfFile()
    targets = [{"POSITION": file.accessor(np.full((3, 3), x, np.float32))} for x in (1, 10)]
    file.node(mesh=file.mesh(file.primitive(targets=targets), weights=[1, 1]))
    keys = [[0, 0], [1, 0.5]]  # of both targets at 0, and at 2
    if interpolation == "CUBICSPLINE":
        keys = [[0, 0], keys[0], [0, 0], [0, 0], keys[1], [0, 0]]
    animation(file, "weights", [0, 2], np.ravel(keys).astype(np.float32), interpolation)
    assert np.allclose(corners(load(file, 0)), TRIANGLE)
    assert np.allclose(corners(load(file, 1)), TRIANGLE + 0.5 + 2.5)
    assert np.allclose(corners(load(file, 5)), TRIANGLE + 1 + 5)


def test_animated_joint_takes_its_skin_with_it(load):
    file = GltfFile()
    bind = file.accessor(np.eye(4, dtype=np.float32).reshape(1, 16))
    joints = {"JOINTS_0": np.zeros((3, 4), np.uint8), "WEIGHTS_0": [[1.0, 0, 0, 0]] * 3}
    file.node(
        mesh=file.mesh(file.primitive(**joints)), skin=file.add("skins", {"joints": [1], "inverseBindMatrices": bind})
    )
    file.node()
    animation(file, "translation", [0, 1], [[0, 0, 0], [0, 4, 0]], node=1)
    assert np.allclose(corners(load(file, 0.25)), TRIANGLE + np.array([0, 1, 0]))


def test_animations_are_at_rest_and_told_unless_a_time_is_given(tmp_path):
    (tmp_path / "a.glb").write_bytes(moved("translation", [0], [[5, 0, 0]]).glb())
    with pytest.warns(MeshWarning, match="animations not played: everything is at rest"):
        mesh = tl.load(tmp_path / "a.glb")
    assert np.allclose(corners(mesh), TRIANGLE)


def clips():
    """Three animations: two of the translation, one of the scale."""
    file = GltfFile().shown()
    for name, path, value in (("a", "translation", 1), ("b", "translation", 2), ("c", "scale", 3)):
        index = animation(file, path, [0], [[value] * 3])
        file.tree["animations"][index]["name"] = name
    return file


@pytest.mark.parametrize(
    ("clip", "expected"), [("a", (1, 1)), (1, (2, 1)), ("c", (0, 3)), (np.int64(2), (0, 3)), ("all", (1, 3))]
)
def test_clip_chooses_an_animation_by_index_or_name(load, clip, expected):
    shift, scale = expected
    assert np.allclose(corners(load(clips(), 0, clip)), TRIANGLE * scale + shift)


def test_first_animation_plays_and_others_are_told(tmp_path):
    (tmp_path / "a.glb").write_bytes(clips().glb())
    with pytest.warns(MeshWarning, match="animations not played: 'b', 'c'"):
        mesh = tl.load(tmp_path / "a.glb", time=0)
    assert np.allclose(corners(mesh), TRIANGLE + 1)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"time": -1}, ValueError, "time must be a number of seconds, 0 or more, got -1"),
        ({"time": float("nan")}, ValueError, "time must be a number of seconds, 0 or more, got nan"),
        ({"time": float("inf")}, ValueError, "time must be a number of seconds, 0 or more, got inf"),
        ({"time": "1"}, TypeError, "time must be a number, got '1'"),
        ({"clip": 0}, ValueError, "clip 0 needs a time"),
        ({"time": 1, "clip": 1.5}, TypeError, "clip must be an index or a name, got 1.5"),
        ({"time": 1, "clip": 3}, MeshError, r"clip must be 0 to 2, or one of 'a', 'b', 'c', got 3"),
        ({"time": 1, "clip": -1}, MeshError, r"clip must be 0 to 2, or one of 'a', 'b', 'c', got -1"),
        ({"time": 1, "clip": "d"}, MeshError, r"clip must be 0 to 2, or one of 'a', 'b', 'c', got 'd'"),
    ],
)
@pytest.mark.parametrize("load", [tl.load, tl.load_cameras])
def test_wrong_times_and_clips_are_named(tmp_path, load, options, error, message):
    (tmp_path / "a.glb").write_bytes(clips().glb())
    with pytest.raises(error, match=message):
        load(tmp_path / "a.glb", **options)


@pytest.mark.parametrize("load", [tl.load, tl.load_cameras])
def test_a_time_of_a_file_without_animations_is_refused(tmp_path, load):
    (tmp_path / "a.glb").write_bytes(GltfFile().shown().glb())
    with pytest.raises(MeshError, match=r"a.glb' has no animations, so it has no time=1"):
        load(tmp_path / "a.glb", time=1)
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(MeshError, match=r"a.obj' has no time=1: animations are read of glTF and GLB alone"):
        load(tmp_path / "a.obj", time=1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda row: row["samplers"][0].update(output=0), "has 9 numbers for 2 keys of translation"),
        (lambda row: row["samplers"][0].update(interpolation="CUBICSPLINE"), "has 6 numbers for 2 keys of translation"),
        (lambda row: row["samplers"][0].update(interpolation="SMOOTH"), "interpolation 'SMOOTH'"),
        (lambda row: row["samplers"][0].update(input=9), r"accessors\[9\] is not one of"),
        (lambda row: row["channels"][0].update(sampler=1), r"samplers\[1\] is not one of 1"),
        (lambda row: row["channels"][0]["target"].update(node=7), r"nodes\[7\] is not one of 1"),
        (lambda row: row["channels"][0]["target"].update(path="color"), "moves 'color'"),
        (lambda row: row.pop("channels"), "channels"),
    ],
)
def test_animations_that_lie_are_refused(tmp_path, change, message):
    file = moved("translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    change(file.tree["animations"][0])
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.raises(MeshError, match=message):
        tl.load(tmp_path / "a.glb", time=0.5)


@pytest.mark.parametrize("times", [[], [1, 0], [0, np.nan]])
def test_keys_that_do_not_go_up_are_refused(tmp_path, times):
    (tmp_path / "a.glb").write_bytes(moved("weights", times, np.zeros(2, np.float32)).glb())
    with pytest.raises(MeshError, match="its keys do not go up"):
        tl.load(tmp_path / "a.glb", time=0.5)


def test_a_step_at_the_very_key_is_taken(load):
    file = moved("translation", [0, 0.1], [[0, 0, 0], [1, 0, 0]], "STEP")  # 0.1 of the file is above 0.1
    assert np.allclose(corners(load(file, 0.1)), TRIANGLE + np.array([1, 0, 0]))


def test_channels_without_a_node_are_left_out(load):
    file = moved("translation", [0], [[1, 0, 0]])
    rows = file.tree["animations"][0]
    rows["channels"].append({"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {}}}})
    assert np.allclose(corners(load(file, 0)), TRIANGLE + np.array([1, 0, 0]))


def test_animated_node_with_a_matrix_stays_and_is_told(tmp_path):
    file = moved("translation", [0], [[1, 0, 0]])
    file.tree["nodes"][0]["matrix"] = np.diag([2.0, 2, 2, 1]).ravel().tolist()
    (tmp_path / "a.glb").write_bytes(file.glb())
    with pytest.warns(MeshWarning, match="animations of nodes that have a matrix not played"):
        mesh = tl.load(tmp_path / "a.glb", time=0)
    assert np.allclose(corners(mesh), 2 * TRIANGLE)


def morphed(n_targets, n_weights, n_keys=1, **more):
    """A triangle with morph targets that move it by 1, and an animation of so many weights a key, all at their most."""
    file = GltfFile()
    delta = file.accessor(np.ones((3, 3), np.float32))
    file.node(mesh=file.mesh(file.primitive(targets=[{"POSITION": delta}] * n_targets)))
    animation(file, "weights", np.arange(n_keys), np.full(n_weights * n_keys, 255, np.uint8), normalized=True, **more)
    return file


@pytest.mark.parametrize(("n_targets", "n_weights"), [(2, 1), (1, 2), (0, 1)])
def test_animated_weights_are_as_many_as_the_targets(load, n_targets, n_weights):
    message = f"an animation has {n_weights} numbers for 1 keys of {n_targets} morph targets"
    with pytest.raises(MeshError, match=message):
        load(morphed(n_targets, n_weights), 0)


def test_animated_weights_of_a_node_without_a_mesh_are_refused(load):
    file = morphed(1, 1)
    file.tree["animations"][0]["channels"][0]["target"]["node"] = file.node()
    with pytest.raises(MeshError, match="an animation has 1 numbers for 1 keys of 0 morph targets"):
        load(file, 0)


def test_animation_decodes_the_keys_about_its_time_alone(load):
    options = {"max_unpacked_bytes": 2 * 3 * 4}  # three weights of two keys, as float32
    for time in (0, 99.5, 999, 2000):
        mesh = load(morphed(3, 3, 1000), time, load=lambda path, **moment: tl.load(path, **moment, **options))
        assert (corners(mesh) == TRIANGLE + 3).all()


def test_animation_of_sparse_values_is_read(load):
    file = GltfFile().shown()
    animation(file, "translation", [0, 1, 2], np.zeros((3, 3), np.float32))
    row = file.tree["accessors"][-1]
    del row["bufferView"]
    places, rows = np.uint8([2]), np.float32([[0, 0, 7]])
    row["sparse"] = {"count": 1, "indices": {"bufferView": file.view(places.tobytes()), "componentType": 5121}}
    row["sparse"]["values"] = {"bufferView": file.view(rows.tobytes())}
    for time, z in {0: 0, 1: 0, 1.5: 3.5, 3: 7}.items():
        assert np.allclose(corners(load(file, time)), TRIANGLE + np.array([0, 0, z]))


def test_each_channel_of_an_animation_spends_its_keys_and_its_numbers(load):
    file = moved("translation", range(10), np.zeros((10, 3), np.float32))
    row = file.tree["animations"][0]
    row["channels"] = [{"sampler": 0, "target": {"node": file.node(), "path": "translation"}} for _ in range(20)]

    def read(path, **moment):
        return tl.load(path, **moment, max_vertices=13 * 20 - 1)

    with pytest.raises(MeshError, match="has 260 vertices, more than the 259 of max_vertices"):
        load(file, 0, load=read)
