"""PLY: text and binary, polygons and strips, what corners and faces say."""

import numpy as np
import pytest

import topleft as tl
from topleft.errors import MeshError, MeshWarning

XYZ = "property float x\nproperty float y\nproperty float z\n"
SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
FACES = "element face {}\nproperty list uchar int vertex_indices\n"


@pytest.fixture
def load(tmp_path):
    def read(header, body, form="ascii"):
        text = f"ply\nformat {form} 1.0\n{header}end_header\n"
        (tmp_path / "a.ply").write_bytes(text.encode() + (body if isinstance(body, bytes) else body.encode()))
        return tl.load(tmp_path / "a.ply")

    return read


@pytest.mark.parametrize("order", ["<", ">"])
def test_ply_binary_faces_of_mixed_sizes_are_read(load, order):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]], order + "f4")
    faces = bytes([4]) + np.array([0, 1, 2, 3], order + "i4").tobytes()
    faces += bytes([3]) + np.array([1, 4, 2], order + "i4").tobytes()
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    mesh = load("element vertex 5\n" + XYZ + FACES.format(2), points.tobytes() + faces, form)
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]


def test_ply_text_faces_of_mixed_sizes_are_read(load):
    mesh = load("element vertex 4\n" + XYZ + FACES.format(2), SQUARE + "4 0 1 2 3\n3 0 1 2\n")
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]


def test_ply_text_rows_with_more_numbers_than_the_header_says_are_read_and_told(load):
    header = "element vertex 4\n" + XYZ + FACES.format(2) + "property uchar red\n"
    with pytest.warns(MeshWarning, match="rows with more numbers than the header says"):
        mesh = load(header, SQUARE + "4 0 1 2 3 5 9 9\n3 0 1 2 5 9 9\n")
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]


def test_ply_text_rows_with_fewer_numbers_than_the_header_says_are_refused(load):
    with pytest.raises(MeshError, match="a row of face has 4 of 5 numbers"):
        load("element vertex 4\n" + XYZ + FACES.format(2), SQUARE + "4 0 1 2\n3 0 1 2\n")


@pytest.mark.parametrize("rows", ["3 0 1 2.5\n3 0 2 3\n", "4 0 1 2 3\n3 0 1 2.5\n", "3 0 1 2\n3 0 1 nan\n"])
def test_ply_text_corners_that_are_no_indices_are_refused(load, rows):
    with pytest.raises(MeshError, match=r"a corner of a face is (2\.5|nan), which is no index"):
        load("element vertex 4\n" + XYZ + FACES.format(2), SQUARE + rows)


def test_ply_strips_turn_one_way_and_end_at_minus_one(load):
    strips = "element tristrips 1\nproperty list int int vertex_indices\n"
    mesh = load("element vertex 4\n" + XYZ + strips, SQUARE + "9 0 1 3 2 -1 1 2 0 -1\n")
    assert mesh.triangles.tolist() == [[0, 1, 3], [3, 1, 2], [1, 2, 0]]


def test_ply_colors_keep_opacity_and_have_no_haze(load):
    rgba = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
    body = "0 0 0 200 0 0 128\n1 0 0 0 1 0 255\n0 1 0 0 0 1 0\n"
    mesh = load("element vertex 3\n" + XYZ + rgba + FACES.format(1), body + "3 0 1 2\n")
    assert mesh.colors.tolist() == [[200, 0, 0, 128], [0, 1, 0, 255], [0, 0, 1, 0]]
    assert mesh.materials == ()


@pytest.mark.parametrize(
    ("names", "attribute"),
    [
        ("diffuse_red diffuse_green diffuse_blue", "colors"),
        ("r g b", "colors"),
        ("normal_x normal_y normal_z", "normals"),
        ("texture_u texture_v", "uv"),
        ("u0 v0", "uv"),
    ],
)
def test_ply_other_names_of_properties_are_read(load, names, attribute):
    kind, values = ("uchar", [200, 0, 9]) if attribute == "colors" else ("float", [0, 1, 0])
    more = "".join(f"property {kind} {name}\n" for name in names.split())
    row = " ".join(map(str, values[: len(names.split())]))
    mesh = load(
        "element vertex 3\n" + XYZ + more + FACES.format(1), f"0 0 0 {row}\n1 0 0 {row}\n0 1 0 {row}\n3 0 1 2\n"
    )
    assert getattr(mesh, attribute)[0].tolist()[: len(names.split())] == values[: len(names.split())]


def test_ply_properties_and_edges_that_are_not_read_are_told(load):
    more = "property float quality\n" + FACES.format(1) + "property uchar flags\nelement edge 1\nproperty int a\n"
    with pytest.warns(MeshWarning) as told:
        load("element vertex 3\n" + XYZ + more, "0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2 0\n0\n")
    assert [str(one.message).partition(": ")[2] for one in told] == [
        "properties of vertex not read: 'quality'", "properties of face not read: 'flags'", "lines not drawn",
    ]  # fmt: skip


@pytest.mark.parametrize(("kind", "value"), [("float", "0.5"), ("ushort", "32896"), ("double", "0.5")])
def test_ply_colors_of_other_numbers_become_bytes(load, kind, value):
    rgb = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
    one = "0" if kind == "ushort" else "1"
    body = f"0 0 0 {value} 0 {one}\n1 0 0 0 0 0\n0 1 0 0 0 0\n"
    colors = load("element vertex 3\n" + XYZ + rgb + FACES.format(1), body + "3 0 1 2\n").colors
    assert colors[0, 0] == 128


def test_ply_texture_and_corner_coordinates(load, tmp_path):
    from PIL import Image

    Image.new("RGB", (1, 1), (200, 0, 0)).save(tmp_path / "a b.png")
    header = "comment TextureFile a b.png\nelement vertex 4\n" + XYZ + FACES.format(2)
    faces = "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 .5 .5 1 1 0 1\n"
    mesh = load(header + "property list uchar float texcoord\n", SQUARE + faces)
    assert mesh.uv[mesh.triangles].tolist() == [[[0, 0], [1, 0], [1, 1]], [[0.5, 0.5], [1, 1], [0, 1]]]
    (material,) = mesh.materials
    assert material.specular == 0
    assert material.texture.image[0, 0].tolist() == [200, 0, 0, 255]


def test_ply_texture_that_is_missing_is_told(load):
    header = "comment TextureFile no.png\nelement vertex 3\n" + XYZ + "property float s\nproperty float t\n"
    with pytest.warns(MeshWarning, match="textures not found: 'no.png'"):
        mesh = load(header + FACES.format(1), "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n")
    assert mesh.uv is not None


def test_ply_cloud_of_points_becomes_points(load):
    rgb = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    cloud = load("element vertex 2\n" + XYZ + rgb, "0 0 0 9 8 7\n1 2 3 1 2 3\n")
    assert isinstance(cloud, tl.Points)
    assert cloud.positions.tolist() == [[0, 0, 0], [1, 2, 3]]
    assert cloud.colors.tolist() == [[9, 8, 7, 255], [1, 2, 3, 255]]


def test_ply_points_that_are_nowhere_are_left_out(load):
    with pytest.warns(MeshWarning, match="points that are not finite left out"):
        assert len(load("element vertex 2\n" + XYZ, "0 0 nan\n1 2 3\n")) == 1
    with pytest.raises(MeshError, match="has no points that are finite"):
        load("element vertex 1\n" + XYZ, "0 0 nan\n")


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("n", [4, 10**6, 10**15 - 1])
def test_ply_counts_that_lie_are_refused(load, form, n):
    with pytest.raises(MeshError, match=r"it ends within its|more than the 4194304 of max_vertices"):
        load(f"element vertex {n}\n" + XYZ + FACES.format(n), "0 0 0\n" if form == "ascii" else bytes(13), form)


def test_ply_lists_longer_than_the_file_are_refused(load):
    header = "element vertex 0\n" + XYZ + "element face 1\nproperty list uint int vertex_indices\n"
    with pytest.raises(MeshError, match="it ends within its 1 rows of face"):
        load(header, b"\xff\xff\xff\xff", "binary_little_endian")


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("element vertex x\n", "its header says 'element vertex x'"),
        ("property float x\n", "its header says 'property float x'"),
        ("element vertex 1\nproperty half x\n", "its header says 'property half x'"),
        ("", "it has no vertices"),
    ],
)
def test_ply_header_that_makes_no_sense_is_refused(load, header, message):
    with pytest.raises(MeshError, match=message):
        load(header, "")
