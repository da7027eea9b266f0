"""`object_masks`: full and visible masks of the objects of a scene, against draws of each by itself."""

import json

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.picture import placed
from topleft._meshes.picture.bend import bend

SIZE = (64, 48)
K = np.array([[60.0, 0, 31.5], [0, 60.0, 23.5], [0, 0, 1]])
POSE = np.eye(4)
POSE[2, 3] = 4.0
CAMERA = tl.Camera.from_intrinsics(K, POSE, SIZE)


def strewn(n=12, seed=0, spread=2.5):
    rng = np.random.default_rng(seed)
    mesh = tl.Mesh(np.float64(tl.scenes.icosphere(2)[0]), tl.scenes.icosphere(2)[1])
    places = np.tile(np.eye(4), (n, 1, 1))
    places[:, :3, :3] *= rng.uniform(0.2, 0.8, (n, 1, 1))
    places[:, :3, 3] = rng.uniform(-spread, spread, (n, 3)) * [1, 1, 0.5]
    return tl.Scene([(mesh, place) for place in places])


def bop_info(scene, i, visible):
    """What BOP's tools write in scene_gt_info.json: the object alone on a canvas of three widths and heights."""
    width, height = SIZE
    shifted = K + [[0, 0, width], [0, 0, height], [0, 0, 0]]
    camera = tl.Camera.from_intrinsics(shifted, POSE, (3 * width, 3 * height))
    large = tl.silhouette(tl.Scene([scene[i]]), camera, (3 * width, 3 * height))

    def box(mask, x, y):
        ys, xs = mask.nonzero()
        return [int(n) for n in (xs.min() - x, ys.min() - y, xs.max() - xs.min(), ys.max() - ys.min())]

    n_visible, n_all = int(visible.sum()), int(large.sum())
    return {
        "px_count_all": n_all,
        "px_count_valid": int(large[height : 2 * height, width : 2 * width].sum()),
        "px_count_visib": n_visible,
        "visib_fract": n_visible / n_all if n_all else 0.0,
        "bbox_obj": box(large, width, height) if n_visible else [-1] * 4,
        "bbox_visib": box(visible, 0, 0) if n_visible else [-1] * 4,
    }


@pytest.mark.parametrize("seed", range(6))
def test_info_is_that_of_the_tools_of_bop(seed):
    scene = strewn(seed=seed)
    found = tl.object_masks(scene, CAMERA, SIZE)
    ids = tl.rasterize_mesh(scene, CAMERA, SIZE).instance
    assert found.scene_gt_info() == [bop_info(scene, i, ids == i) for i in range(len(scene))]
    assert json.loads(json.dumps(found.scene_gt_info())) == found.scene_gt_info()


@pytest.mark.parametrize("lens", [{}, {"distortion": (-0.2, 0.05, 0, 0)}, {"fisheye": (0.1, 0, 0, 0)}])
def test_full_masks_are_those_of_the_objects_alone_and_hold_what_shows(lens):
    scene = strewn(seed=9)
    camera = tl.Camera.from_intrinsics(K, POSE, SIZE, **lens)
    found = tl.object_masks(scene, camera, SIZE)
    for i, one in enumerate(scene):
        assert (found.full(i) == tl.silhouette(tl.Scene([one]), camera, SIZE)).all()
        assert not (found.visible(i) & ~found.full(i)).any()
        assert found.visible(i).sum() == found.n_visible[i]
    assert found.rle() == [tl.to_rle(found.visible(i)) for i in range(len(scene))]
    assert found.rle("full") == [tl.to_rle(found.full(i)) for i in range(len(scene))]


@pytest.mark.parametrize("lens", [{"distortion": (-0.2, 0.05, 0, 0)}, {"fisheye": (0.1, 0, 0, 0)}])
def test_a_lens_bends_each_object_once_and_objects_count_beyond_the_picture(lens, monkeypatch):
    calls = []
    monkeypatch.setattr(placed, "bend", lambda *args, **options: calls.append(1) or bend(*args, **options))
    (width, height), mirrored = SIZE, np.diag([-0.5, 0.5, 0.5, 1])
    mirrored[:3, 3] = 2.5, 1, 0
    scene = tl.Scene([*strewn(seed=4), (strewn()[0].mesh, mirrored)])
    camera = tl.Camera.from_intrinsics(K, POSE, SIZE, **lens)
    found = tl.object_masks(scene, camera, SIZE, cull="back")
    assert len(calls) == len(scene)
    around = {"origin": (-width, -height), "viewport": SIZE, "cull": "back"}
    for i, one in enumerate(scene):
        alone = tl.rasterize_mesh(tl.Scene([one]), camera, (3 * width, 3 * height), **around).mask
        assert found.n_full[i] == alone.sum()


def test_an_object_round_the_eye_is_cut_at_the_canvas():
    wall = tl.Mesh([(-50, -50, 9), (50, -50, 9), (50, 50, -9), (-50, 50, -9)], [(0, 1, 2), (0, 2, 3)])
    found = tl.object_masks(tl.Scene([wall]), CAMERA, SIZE)
    assert (found.full(0) == tl.silhouette(wall, CAMERA, SIZE)).all()
    assert found.boxes_full[0, 0] == -64 and found.boxes_full[0, 2] == 128  # noqa: PT018


def test_beyond_says_how_far_objects_count():
    scene = strewn(seed=1)
    inside = tl.object_masks(scene, CAMERA, SIZE, beyond=0)
    assert inside.n_full.tolist() == [int(inside.full(i).sum()) for i in range(len(scene))]
    far = tl.object_masks(scene, CAMERA, SIZE, beyond=3)
    assert (far.n_full >= tl.object_masks(scene, CAMERA, SIZE).n_full).all()
    assert far.n_full.sum() > inside.n_full.sum()


def test_holes_of_materials_are_in_no_mask():
    alpha = np.zeros((2, 2, 4), np.uint8)
    alpha[:, 1, 3] = 255
    material = tl.Material(texture=tl.Texture(alpha, "nearest"), alpha_mode="mask")
    corners, faces = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)]
    half = tl.Mesh(corners, faces, uv=[(0, 0), (1, 0), (1, 1), (0, 1)], materials=(material,))
    back = np.eye(4)
    back[2, 3] = 1
    camera = tl.Camera.from_intrinsics(K, POSE, SIZE)
    found = tl.object_masks(tl.Scene([half, (tl.Mesh(corners, faces), back)]), camera, SIZE)
    whole = tl.object_masks(tl.Scene([tl.Mesh(corners, faces)]), camera, SIZE)
    assert found.n_full[0] == found.n_visible[0] == whole.n_full[0] // 2
    assert 0 < found.n_visible[1] < found.n_full[1]


def test_an_object_outside_and_one_without_triangles_have_no_pixels():
    cube, away = tl.Mesh(*tl.scenes.cube()), np.eye(4)
    away[0, 3] = 1000
    empty = tl.Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    found = tl.object_masks(tl.Scene([cube, (cube, away), (empty, np.eye(4))]), CAMERA, SIZE)
    assert found.n_full.tolist()[1:] == [0, 0]
    assert found.visible_share.tolist()[1:] == [0.0, 0.0]
    assert found.boxes_full.tolist()[1:] == found.boxes_visible.tolist()[1:] == [[0] * 4] * 2
    assert not found.full(1).any()
    assert tl.to_rle(found.full(2)) == found.rle("full")[2]


def test_valid_pixels_are_those_with_a_depth():
    scene = strewn(seed=2)
    depth = np.zeros(SIZE[::-1])
    depth[:, 30:] = 2.0
    depth[:, 50:] = np.inf
    found = tl.object_masks(scene, CAMERA, SIZE)
    counts = [one["px_count_valid"] for one in found.scene_gt_info(depth)]
    assert counts == [int(found.full(i)[:, 30:50].sum()) for i in range(len(scene))]


@pytest.mark.parametrize("which", ["visible", "full"])
def test_annotations_are_what_pycocotools_measures(which):
    coco = pytest.importorskip("pycocotools.mask")
    found = tl.object_masks(strewn(seed=3), CAMERA, SIZE)
    listed = found.annotations(7, list(range(20, 32)), first_id=100, which=which)
    assert listed
    assert [one["id"] for one in listed] == list(range(100, 100 + len(listed)))
    assert [one["category_id"] - 20 for one in listed] == np.flatnonzero(found.n_visible).tolist()
    for one in json.loads(json.dumps(listed)):
        assert int(coco.area(one["segmentation"])) == one["area"]
        assert coco.toBbox(one["segmentation"]).tolist() == one["bbox"]


def test_view_has_run_lengths_of_every_instance_of_its_scene():
    scene = strewn(seed=4)
    view = tl.render_layers(scene, CAMERA, SIZE, layers=("instance", "silhouette", "triangle", "distance"))
    assert view.rle("instance") == tl.object_masks(scene, CAMERA, SIZE).rle()
    assert view.rle(labels=[2]) == view.rle()[2:3]
    assert view.rle("silhouette") == tl.to_rle(view["silhouette"])
    with pytest.raises(TypeError, match="masks must be bool, got dtype int32; labels="):
        view.rle("triangle")
    with pytest.raises(ValueError, match="layer must be one of instance, silhouette, triangle, distance, got 'depth'"):
        view.rle("depth")


@pytest.mark.parametrize(
    ("ask", "error", "message"),
    [
        (lambda: tl.object_masks(strewn(), CAMERA, SIZE, beyond=-1), ValueError, "beyond must be a number of pictures"),
        (lambda: tl.object_masks(strewn(), CAMERA, SIZE, beyond=1e30), ValueError,
         "beyond must reach at most 1073741824"),
        (lambda: tl.object_masks(strewn(), CAMERA, SIZE).rle("all"), ValueError, "which must be"),
        (lambda: tl.object_masks(strewn(), CAMERA, SIZE).full(12), IndexError, "there are 12 objects, got 12"),
        (lambda: tl.object_masks(strewn(), CAMERA, SIZE).scene_gt_info(np.ones((2, 2))), ValueError,
         r"depth must have shape \(48, 64\), got \(2, 2\)"),
        (lambda: tl.object_masks(strewn(), CAMERA, SIZE).annotations(0, [1]), ValueError,
         "category_ids must be 12 integers, one of each object, got shape"),
    ],
)  # fmt: skip
def test_wrong_questions_are_refused(ask, error, message):
    with pytest.raises(error, match=message):
        ask()
