"""First calls as people write them, from the habits of other libraries: they draw, or say in a line what to write."""

import re

import numpy as np
import pytest
from PIL import Image

import topleft as tl

CUBE = tl.Mesh(*tl.scenes.shape("cube"))
CAMERA = tl.Camera.framing(CUBE, aspect=4 / 3)
SIZE = (32, 24)
QUAD = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def raises(kind, message):
    return pytest.raises(kind, match=re.escape(message))


def test_size_in_the_place_of_the_camera_is_told():
    for draw in (tl.render, tl.rasterize_mesh, tl.silhouette, tl.render_layers, tl.render_transparent):
        with raises(TypeError, "camera must be a Camera or a (4, 4) matrix, clip from world, got (640, 480); the size"):
            draw(CUBE, (640, 480))


def test_camera_in_the_place_of_the_size_is_told():
    with raises(TypeError, "got Camera; the camera comes before the size"):
        tl.render(CUBE, SIZE, CAMERA)


def test_direction_in_the_place_of_a_light_is_told():
    with raises(TypeError, "lights must be of Light, got tuple: a direction is Light((0, 1, 0))"):
        tl.render(CUBE, CAMERA, SIZE, lights=[(0, 1, 0)])


@pytest.mark.parametrize(("word", "right"), [("resolution", "size"), ("colour", "color"), ("light", "lights")])
def test_option_of_render_by_another_name_is_told(word, right):
    with raises(TypeError, f"render() got an unexpected keyword argument '{word}': {right}?"):
        tl.render(CUBE, CAMERA, **{word: (64, 48)})


def test_size_of_one_number_is_a_square():
    assert tl.render(CUBE, size=8).shape == (8, 8, 4)
    assert tl.coverage([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], 5).shape == (5, 5)
    assert CAMERA.clip_from_world(8).tolist() == CAMERA.clip_from_world((8, 8)).tolist()
    assert tl.Grid(3, (0, 1, 0, 1)).size == (3, 3)


def test_shape_of_a_picture_for_a_size_is_told_where_it_can_be():
    image = np.zeros((24, 32, 3), np.uint8)
    with raises(TypeError, "image.shape[1::-1] is its size"):
        tl.render(CUBE, CAMERA, image.shape)
    with raises(ValueError, "size is (width, height), shapes are (height, width)"):
        tl.silhouette(CUBE, CAMERA, image.shape[:2], out=np.empty(image.shape[:2], bool))


@pytest.mark.parametrize("ortho", [False, True])
def test_matrix_in_the_place_of_the_camera_draws_the_same(ortho):
    camera = tl.Camera.framing(CUBE, ortho=ortho, aspect=4 / 3)
    matrix = camera.clip_from_world(SIZE)
    ours, theirs = (tl.rasterize_mesh(CUBE, one, SIZE) for one in (camera, matrix))
    assert np.array_equal(ours.triangle, theirs.triangle)
    picture, other = (tl.render(CUBE, one, SIZE).astype(int) for one in (camera, 3 * matrix))
    assert np.abs(picture - other).max() <= 1  # the matrix is split in float64


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(3), "got ndarray of shape (3, 3); Camera.from_intrinsics takes those of OpenCV"),
        (np.eye(4), "clip_from_world must be a projection times a view, got a pose"),
        (np.zeros((4, 4)), "clip_from_world must not be singular"),
        ([[1, 0, 0, 0], [0, 1, 0, 0], [1, 0, -1, -2], [0, 0, -1, 0]], "depth along the view alone"),
    ],
)
def test_matrix_that_is_no_camera_is_told(matrix, message):
    with raises((TypeError, ValueError), message):
        tl.render(CUBE, np.array(matrix), SIZE)


@pytest.mark.parametrize("red", ["red", "#ff0000", "#f00", "rgb(255, 0, 0)", (255, 0, 0), (1.0, 0.0, 0.0), (1.0, 0, 0),
                                 np.array([1, 0, 0], np.float32), np.array([255, 0, 0])])  # fmt: skip
def test_color_in_each_notation_is_the_same_bytes(red):
    assert tl.render(CUBE, CAMERA, SIZE, color=red, shading="unlit")[12, 16].tolist() == [255, 0, 0, 255]
    assert tl.render(CUBE, CAMERA, SIZE, background=red)[0, 0].tolist() == [255, 0, 0, 255]
    assert tl.Material(red).color == tl.Light((0, 0, 1), color=red).color == tl.Fog(1, 2, red).color == (255, 0, 0)


@pytest.mark.parametrize(
    ("color", "message"),
    [
        ("redd", "color must be a name of CSS like 'red', or '#rrggbb', got 'redd'"),
        ((255.0, 0.0, 0.0), "color must be floats of 0 to 1 or integers of 0 to 255, got floats [255.0, 0.0, 0.0]"),
        ((1, 2), "color must be 3 numbers of 0 to 255, got (1, 2)"),
        ("#ff000080", "color must be 3 numbers of 0 to 255, got '#ff000080'"),
        (None, "color must be a name, '#rrggbb', 3 integers of 0 to 255 or floats of 0 to 1, got None"),
    ],
)
def test_color_that_is_none_is_told(color, message):
    with raises((TypeError, ValueError), message):
        tl.render(CUBE, CAMERA, SIZE, color=color)


def test_color_of_integers_that_may_be_shares_is_warned_of_at_the_call():
    told = re.escape("color (1, 1, 0) of integers is of 0 to 255, nearly black: write (1.0, 1.0, 0.0) for full")
    for make in (tl.Material, lambda color: tl.render(CUBE, CAMERA, SIZE, color=color)):
        with pytest.warns(UserWarning, match=told) as caught:
            make((1, 1, 0))
        assert {warning.filename for warning in caught} == {__file__}
    with pytest.warns(UserWarning, match=re.escape("background (1, 1, 1, 1) of integers")):
        tl.render(CUBE, CAMERA, SIZE, background=(1, 1, 1, 1))


def test_dark_colors_of_bytes_and_of_files_are_not_warned_of(tmp_path, recwarn):
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 0.004 0.004 0\n")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    assert tl.load(tmp_path / "a.obj").materials[0].color == (1, 1, 0)
    for dark in ((0, 0, 0), (0, 0, 2), "#010100", np.array([1, 1, 0], np.uint8)):
        tl.render(CUBE, CAMERA, SIZE, background=dark)
    assert not recwarn.list


def test_background_may_be_transparent():
    assert tl.render(CUBE, CAMERA, SIZE, background="transparent")[0, 0].tolist() == [0, 0, 0, 0]
    assert tl.render(CUBE, CAMERA, SIZE, background=(0.0, 0.0, 1.0, 0.5))[0, 0].tolist() == [0, 0, 255, 128]


def test_one_light_needs_no_list():
    light = tl.Light((0, 1, 1))
    assert np.array_equal(tl.render(CUBE, CAMERA, SIZE, lights=light), tl.render(CUBE, CAMERA, SIZE, lights=[light]))


def test_path_is_a_mesh(tmp_path):
    path = tmp_path / "quad.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    camera = tl.Camera.framing(path)
    for subject in (path, str(path), tl.load(path)):
        assert np.array_equal(tl.render(subject, camera, SIZE), tl.render(tl.load(path), camera, SIZE))
    assert tl.Scene([path, (str(path), np.diag([2, 2, 2, 1]), "large")])[1].name == "large"
    with raises(FileNotFoundError, "there is no file 'nothing.obj'"):
        tl.render("nothing.obj")


def test_scene_takes_what_as_mesh_takes():
    trimesh = pytest.importorskip("trimesh")
    box, arrays, place = trimesh.creation.box(), (CUBE.vertices, CUBE.triangles), np.diag([2.0, 2, 2, 1])
    scene = tl.Scene([box, (box, place), arrays, (arrays, place, "two"), (CUBE.vertices.tolist(), [[0, 1, 2]])])
    assert [len(one.mesh.triangles) for one in scene] == [12, 12, 12, 12, 1]
    assert [one.transform[0, 0] for one in scene] == [1, 2, 1, 2, 1]


def test_quads_are_cut_by_as_mesh_and_refused_by_mesh():
    assert tl.as_mesh((QUAD, [[0, 1, 2, 3]])).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert tl.Scene([(QUAD, [[0, 1, 2, 3]])]).n_triangles == 2
    with raises(ValueError, "(T, 3), got (1, 4); topleft.as_mesh((vertices, faces)).triangles cuts quads"):
        tl.Mesh(QUAD, [[0, 1, 2, 3]])


def test_mask_is_saved_black_and_white_and_ids_are_refused(tmp_path):
    frags = tl.rasterize_mesh(CUBE, CAMERA, SIZE)
    for name in ("mask.png", "mask.tif", "mask.webp"):
        tl.save_image(tmp_path / name, frags.mask)
    with Image.open(tmp_path / "mask.png") as image:
        assert np.array_equal(np.asarray(image), frags.mask * np.uint8(255))
    for array, cure in ((frags.triangle, "(ids + 1).astype('uint16')"), (frags.depth, "(255 * share).astype('uint8')")):
        with raises(tl.ImageError, f".tif and .npy hold ids and floats, .png holds {cure}"):
            tl.save_image(tmp_path / "a.png", array)
        tl.save_image(tmp_path / "a.tif", array)
        tl.save_image(tmp_path / "a.npy", array)
