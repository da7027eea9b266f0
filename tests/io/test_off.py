"""OFF: each form of it in the smallest file that has it."""

import warnings

import numpy as np
import pytest

import topleft as tl
from topleft.errors import MeshError

SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
CHEVRON = "0 0 0\n4 0 0\n4 4 0\n2 1 0\n0 4 0\n"
"""A face with a corner that points inwards, of area 10."""


@pytest.fixture
def load(tmp_path):
    def read(text):
        (tmp_path / "a.off").write_bytes(text if isinstance(text, bytes) else text.encode())
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return tl.load(tmp_path / "a.off")

    return read


def area(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    return np.cross(b - a, c - a)[:, 2].sum() / 2


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 2 0\n{SQUARE}3 0 1 2\n3 0 2 3\n",
        f"OFF 4 1 0\n{SQUARE}4 0 1 2 3\n",
        f"4 1 0\n{SQUARE}4 0 1 2 3\n",
        f"# a square\nOFF\n\n4 1\n{SQUARE}4 0 1 2 3 # all of it\n",
        f"OFF\r\n4 1 0\r\n{SQUARE}4 0 1 2 3\r\n".replace("\n", "\r\n"),
        "OFF 4 1 0 0 0 0 1 0 0 1 1 0 0 1 0 4 0 1 2 3",
        f"OFF\n4 1 0\n{SQUARE}4 0\n1\n2\n3\n",
    ],
)  # fmt: skip
def test_off_square_is_read_in_every_form(load, text):
    mesh = load(text)
    assert area(mesh) == 1
    assert len(mesh.vertices) == 4


def test_off_concave_face_covers_what_it_covers(load):
    assert area(load(f"OFF\n5 1 0\n{CHEVRON}5 0 1 2 3 4\n")) == 10


@pytest.mark.parametrize(
    ("rows", "expected"), [("255 0 9", [255, 0, 9]), ("1.0 0.0 0.2", [255, 0, 51]), ("255 0 9 128", [255, 0, 9, 128])]
)
def test_off_colors_of_vertices_are_read(load, rows, expected):
    vertices = "".join(f"{row} {rows}\n" for row in SQUARE.splitlines())
    mesh = load(f"COFF\n4 1 0\n{vertices}4 0 1 2 3\n")
    assert mesh.colors[0].tolist() == expected


def test_off_colors_of_faces_end_at_their_edges(load):
    mesh = load(f"OFF\n4 2 0\n{SQUARE}3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n")
    assert mesh.colors[mesh.triangles][:, :, :3].tolist() == [[[255, 0, 0]] * 3, [[0, 0, 255]] * 3]


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ("255 0 0", "", [255, 255, 255, 255]),
        ("255 0 0", "0 255 0 128", [0, 255, 0, 128]),
        ("1.0 0.0 0.0", "0 1 0 0.2", [0, 255, 0, 51]),
        ("255 0 0 1", "0 128 0 0.2", [0, 128, 0, 51]),
    ],
)
def test_off_colors_and_opacity_of_some_faces_are_read(load, first, second, expected):
    mesh = load(f"OFF\n4 2 0\n{SQUARE}3 0 1 2 {first}\n3 0 2 3 {second}\n")
    assert mesh.colors[mesh.triangles[:, 0]].tolist() == [[255, 0, 0, 255], expected]


@pytest.mark.parametrize(
    ("vertex", "face", "message"),
    [
        ("", "7", "colours of faces by a map of colours not read"),
        (" 9 9 9", "255 0 0", "colours of faces beside those of vertices not drawn"),
    ],
)
def test_off_colors_that_are_not_read_are_told(tmp_path, vertex, face, message):
    rows = "".join(f"{row}{vertex}\n" for row in SQUARE.splitlines())
    (tmp_path / "a.off").write_text(f"{'C' if vertex else ''}OFF\n4 2 0\n{rows}3 0 1 2 {face}\n3 0 2 3 {face}\n")
    with pytest.warns(tl.MeshWarning, match=message):
        assert len(tl.load(tmp_path / "a.off").triangles) == 2


@pytest.mark.parametrize("rest", ["3 0 2 3\n", "3 0 2 3\n3 1 2 3\n"])
def test_off_faces_beyond_those_of_the_header_are_no_colors(tmp_path, rest):
    (tmp_path / "a.off").write_text(f"OFF\n4 1 0\n{SQUARE}3 0 1 2\n{rest}")
    with pytest.warns(tl.MeshWarning, match="numbers after the last face that its header counts not read"):
        mesh = tl.load(tmp_path / "a.off")
    assert mesh.colors is None
    assert mesh.triangles.tolist() == [[0, 1, 2]]


def test_off_normals_and_texture_coordinates_are_read(load):
    mesh = load("STNOFF\n3 1 0\n0 0 0 0 0 1 0.5 1\n1 0 0 0 0 1 0.25 1\n0 1 0 0 0 1 0 0\n3 0 1 2\n")
    assert mesh.normals.tolist() == [[0, 0, 1]] * 3
    assert mesh.uv.tolist() == [[0.5, 1], [0.25, 1], [0, 0]]


def test_off_without_faces_becomes_points(load):
    cloud = load("OFF\n2 0 0\n0 0 0\n1 2 3\n")
    assert isinstance(cloud, tl.Points)
    assert cloud.positions.tolist() == [[0, 0, 0], [1, 2, 3]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hello", "it does not begin with OFF"),
        ("OFF\nno", "it does not say how many vertices and faces it has"),
        ("4OFF\n1 0 0\n0 0 0 1\n", "its points have more than three dimensions"),
        (b"OFF BINARY\n\0\0\0\4", "it is a binary OFF: save it as text"),
        ("OFF\n4 1 0\n0 0 0\n", "it ends within its 4 vertices"),
        (f"OFF\n4 2 0\n{SQUARE}3 0 1 2\n", "it ends within its 2 faces"),
        (f"OFF\n4 1 0\n{SQUARE}4 0 1 2\n", "a face has fewer corners than it says"),
        (f"OFF\n4 1 0\n{SQUARE}3 0 1 x\n", "a number of it is none"),
        (f"OFF\n4 1 0\n{SQUARE}3 0 1 9\n", "a face names vertex 9 of 4"),
        (f"OFF\n4 1 0\n{SQUARE}3 0 1 2.5\n", "a corner of a face is 2.5, which is no index"),
        ("OFF\n999999999999 1 0\n0 0 0\n", "more than the 4194304 of max_vertices"),
    ],
)
def test_off_that_is_broken_is_told(load, text, message):
    with pytest.raises(MeshError, match=message):
        load(text)
