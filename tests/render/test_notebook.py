"""What results show of themselves in a notebook."""

import io

import numpy as np
from PIL import Image

import topleft as tl
from topleft._core.base.color import id_colors
from topleft._meshes.picture.notebook import MESH_SIZE

CUBE = tl.Mesh(*tl.scenes.shape("cube"))


def opened(png):
    return np.asarray(Image.open(io.BytesIO(png)))


def test_mesh_shows_its_picture():
    assert np.array_equal(opened(CUBE._repr_png_()), tl.render(CUBE, size=MESH_SIZE))


def test_fragments_show_their_triangles():
    frags = tl.rasterize_mesh(CUBE, size=(40, 30))
    picture = opened(frags._repr_png_())
    assert picture.shape == (30, 40, 4)
    assert np.array_equal(picture[..., 3] == 255, frags.mask)
    assert np.array_equal(picture[frags.mask][:, :3], id_colors(frags.triangle[frags.mask]))


def test_large_fragments_are_shown_smaller():
    frags = tl.rasterize([[0, 0], [3000, 0], [0, 9]], [[0, 1, 2]], (2049, 10))
    assert opened(frags._repr_png_()).shape == (4, 683, 4)


def test_mesh_or_picture_of_nothing_has_no_png():
    assert tl.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))._repr_png_() is None
    assert tl.rasterize_mesh(CUBE, size=(0, 5))._repr_png_() is None


def test_pictures_are_plain_arrays():
    assert type(tl.render(CUBE, size=(8, 6))) is np.ndarray
    assert type(tl.field(([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]]), [1.0], (2, 2))) is np.ndarray
