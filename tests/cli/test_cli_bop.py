"""`topleft bop`: a folder in BOP's format, its objects told as its tools tell them."""

import json

import numpy as np
import pytest
from PIL import Image

import topleft as tl

SIZE = (64, 48)
K = [60.0, 0.0, 31.5, 0.0, 60.0, 23.5, 0.0, 0.0, 1.0]
TURN = [0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6]
POSES = {
    "3": [
        {"obj_id": 2, "cam_R_m2c": TURN, "cam_t_m2c": [0.0, 0.0, 900.0]},
        {"obj_id": 5, "cam_R_m2c": TURN, "cam_t_m2c": [30.0, 10.0, 700.0]},
        {"obj_id": 2, "cam_R_m2c": TURN, "cam_t_m2c": [450.0, 0.0, 900.0]},
    ],
    "10": [],
}


def write_ply(path, vertices, triangles):
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", *(f"property float {c}" for c in "xyz")]
    lines += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, map(float, row))) for row in vertices]
    lines += [f"3 {' '.join(map(str, row))}" for row in triangles.tolist()]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def scene(folder):
    for name in ("scene/depth", "models"):
        folder.joinpath(name).mkdir(parents=True)
    vertices, triangles = tl.scenes.icosphere(2)
    write_ply(folder / "models/obj_000002.ply", np.asarray(vertices) * 150, triangles)
    write_ply(folder / "models/obj_000005.ply", np.asarray(tl.scenes.cube()[0]) * 40, tl.scenes.cube()[1])
    folder.joinpath("scene/scene_gt.json").write_text(json.dumps(POSES))
    cameras = {key: {"cam_K": K, "depth_scale": 1.0} for key in POSES}
    folder.joinpath("scene/scene_camera.json").write_text(json.dumps(cameras))
    depth = np.zeros(SIZE[::-1], np.uint16)
    depth[:, :32] = 900
    for image in (3, 10):
        Image.fromarray(depth).save(folder / f"scene/depth/{image:06d}.png")
    return folder


def masks(scale=1.0):
    meshes = {i: tl.load(f"models/obj_{i:06d}.ply", scale=scale) for i in (2, 5)}
    poses = [(one["cam_R_m2c"], np.array(one["cam_t_m2c"]) * scale) for one in POSES["3"]]
    rotations = [(np.reshape(turn, (3, 3)), shift) for turn, shift in poses]
    ids = [one["obj_id"] for one in POSES["3"]]
    camera = tl.Camera.from_intrinsics(np.reshape(K, (3, 3)), np.eye(4), SIZE, near=scale, far=5000 * scale)
    return tl.object_masks(tl.Scene([(meshes[i], pose) for i, pose in zip(ids, rotations, strict=True)]), camera, SIZE)


def test_bop_writes_the_info_of_object_masks(scene, run):
    assert run("bop", "scene", "--models", "models", "-o", "out/info.json") == (0, [])
    depth = np.zeros(SIZE[::-1])
    depth[:, :32] = 900
    expected = masks().scene_gt_info(depth)
    assert json.loads(scene.joinpath("out/info.json").read_text()) == {"3": expected, "10": []}
    assert 0 < expected[0]["visib_fract"] < 1 == expected[1]["visib_fract"]
    assert expected[0]["px_count_valid"] < expected[0]["px_count_all"]


@pytest.mark.parametrize("scale", ["1", "0.001", "1e3", "0.0254"])
def test_bop_parts_surfaces_that_are_near_each_other_at_every_scale(scale, scene, run):
    """Of two cubes with sides 0.02 mm apart at 660 mm the nearer one shows whole."""
    behind, near = ({"obj_id": 5, "cam_R_m2c": np.eye(3).ravel().tolist(), "cam_t_m2c": [x, 0.0, z]}
                    for x, z in ((0.0, 700.02), (10.0, 700.0)))  # fmt: skip
    scene.joinpath("scene/scene_gt.json").write_text(json.dumps({"3": [behind, near]}))
    assert run("bop", "scene", "--models", "models", "-o", "info.json", "--scale", scale) == (0, [])
    shares = [one["visib_fract"] for one in json.loads(scene.joinpath("info.json").read_text())["3"]]
    assert 0 < shares[0] < 0.5
    assert shares[1] == 1


def test_bop_writes_masks_and_annotations(scene, run):
    options = "--coco", "coco.json", "--masks", "masks", "--size", "64x48"
    assert run("bop", "scene", "--models", "models", "-o", "info.json", *options) == (0, [])
    found = masks()
    content = json.loads(scene.joinpath("coco.json").read_text())
    assert content["annotations"] == found.annotations(3, [2, 5, 2])
    assert [image["id"] for image in content["images"]] == [3, 10]
    assert [one["id"] for one in content["categories"]] == [2, 5]
    for i in range(3):
        for name, mask in (("mask", found.full(i)), ("mask_visib", found.visible(i))):
            with Image.open(f"masks/{name}/000003_{i:06d}.png") as picture:
                assert (np.asarray(picture).astype(bool) == mask).all()


def test_scale_changes_units_and_no_pixel(scene, run):
    assert run("bop", "scene", "--models", "models", "-o", "mm.json") == (0, [])
    assert run("bop", "scene", "--models", "models", "-o", "m.json", "--scale", "0.001") == (0, [])
    assert scene.joinpath("m.json").read_text() == scene.joinpath("mm.json").read_text()


def broken(scene, name, content):
    scene.joinpath("scene", name).write_text(content)


@pytest.mark.parametrize(
    ("break_it", "message"),
    [
        (lambda s: broken(s, "scene_gt.json", "["), "cannot read 'scene/scene_gt.json'"),
        (lambda s: broken(s, "scene_gt.json", '{"a": []}'), "it must hold an object with the numbers of images"),
        (lambda s: broken(s, "scene_camera.json", "{}"), "'scene/scene_camera.json' has no image 3, which scene_gt"),
        (lambda s: broken(s, "scene_gt.json", '{"3": [{"obj_id": 2}]}'),
         "image 3 of 'scene' is not as BOP has it: the"),
        (lambda s: broken(s, "scene_camera.json", '{"3": {}, "10": {}}'),
         "image 3 of 'scene' is not as BOP has it: 'ca"),
        (lambda s: s.joinpath("models/obj_000005.ply").unlink(), "there is no file 'models/obj_000005.ply'"),
        (lambda s: s.joinpath("scene/depth/000003.png").unlink(),
         "--size is needed: 'scene' has no picture of image 3"),
        (
            lambda s: (
                Image.new("L", (9, 9)).save(s / "scene/rgb" / "000003.png")
                if s.joinpath("scene/rgb").mkdir() is None
                else None
            ),
            "'scene/depth/000003.png' has 64x48 pixels, not 9x9",
        ),
    ],
)  # fmt: skip
def test_a_folder_that_is_not_as_bop_has_it_is_told_in_one_line(scene, run, break_it, message):
    break_it(scene)
    status, lines = run("bop", "scene", "--models", "models", "-o", "info.json")
    assert (status, len(lines)) == (2, 1)
    assert message in lines[0]
    assert not scene.joinpath("info.json").exists()


@pytest.mark.parametrize("option", [("--scale", "0"), ("--beyond", "-1"), ("--size", "9x")])
def test_options_of_bop_are_checked(scene, run, option):
    status, lines = run("bop", "scene", "--models", "models", "-o", "info.json", *option)
    assert status == 2
    assert option[0] in lines[-1]
