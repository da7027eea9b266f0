"""STL: the colours of triangles, by both customs."""

import numpy as np
import pytest

import topleft as tl
from topleft._meshes.io.stl_off import ROWS

RED, GREEN, BLUE, OWN = 31 << 10, 31 << 5, 31, 1 << 15
"""By VisCAM; Magics has red and blue in each other's place."""


def colors_of(path, colors, header=b""):
    rows = np.zeros(len(colors), ROWS)
    rows["corners"] = np.arange(9 * len(colors)).reshape(-1, 9) ** 2
    rows["color"] = colors
    path.write_bytes(header.ljust(80, b"\0") + len(colors).to_bytes(4, "little") + rows.tobytes())
    mesh = tl.load(path)
    return None if mesh.colors is None else mesh.colors[mesh.triangles[:, 0]].tolist()


@pytest.mark.parametrize(
    ("header", "colors", "expected"),
    [
        (b"", [OWN | RED, OWN | GREEN, OWN | 16, BLUE], [[255, 0, 0], [0, 255, 0], [0, 0, 132], [255, 255, 255]]),
        (b"of Magics COLOR=\x09\x08\x07\xff", [RED, BLUE, OWN], [[0, 0, 255], [255, 0, 0], [9, 8, 7]]),
        (b"COLOR=\x09\x08\x07\x00,MATERIAL=", [0, 0], [[9, 8, 7], [9, 8, 7]]),
    ],
)
def test_stl_colors_of_triangles_are_read(tmp_path, header, colors, expected):
    assert colors_of(tmp_path / "a.stl", colors, header) == [[*color, 255] for color in expected]


def test_stl_opacity_of_magics_is_read(tmp_path):
    assert colors_of(tmp_path / "a.stl", [OWN], b"COLOR=\x09\x08\x07\x80") == [[9, 8, 7, 128]]


def test_stl_bits_without_a_colour_are_none(tmp_path):
    assert colors_of(tmp_path / "a.stl", [0, 1, RED]) is None
