"""Rendering with several samples a pixel: smooth outlines, and each triangle shaded once in a pixel."""

import sys

import numpy as np
import pytest
from comparing import assert_same

import topleft as tl
from topleft._core.base.color import id_colors, srgb_tables
from topleft._core.raster.cluster_draw import ClusteredMesh
from topleft._meshes.picture.shade import GREY_OF_FARTHEST, GREY_OF_NEAREST
from topleft.methods.reference.sampling import mean

SIZE = (48, 36)
KNOT = tl.Mesh(*tl.scenes.shape("torus-knot"))
CLEAR = (0, 0, 0, 0)


@pytest.mark.parametrize("n", [2, 4, 8, 16])
def test_alpha_is_the_share_of_samples_with_a_triangle(n):
    got = tl.render(KNOT, size=SIZE, sampling=f"msaa{n}", background=CLEAR)
    frags = tl.rasterize_mesh(KNOT, size=SIZE, sampling=f"msaa{n}")
    assert_same(got[..., 3], np.rint(255 * (frags.samples_triangle >= 0).mean(-1)).astype(np.uint8))


@pytest.mark.parametrize("look", [{}, {"shading": "ids"}, {"cutoff": 0.5}, {"edges": True}, {"cull": "back"}])
def test_picture_of_a_mesh_that_is_drawn_again_has_the_same_bits(monkeypatch, force, look):
    """It is drawn from clusters then, a plane a sample, and what these show is snapped once for all samples."""
    vertices, triangles = tl.scenes.blob(30_000)
    holes = np.full((8, 8, 4), 255, np.uint8)
    holes[2:5, 2:5, 3] = 0
    look = look.copy()
    leaf = tl.Material(texture=tl.Texture(holes), alpha_cutoff=look.pop("cutoff", 0.0), double_sided=True)
    mesh = tl.Mesh(vertices.astype(np.float32), triangles, uv=3 * vertices[:, :2], materials=[leaf])
    near = tl.Camera.look_at((0.2, 0.1, 1.2), near=0.01, far=100)
    n_planes, draw_plane = [], ClusteredMesh.draw
    force(pays_to_draw_samples=True)
    monkeypatch.setattr(ClusteredMesh, "draw", lambda *a: n_planes.append(1) or draw_plane(*a))
    first, again = (tl.render(mesh, near, (200, 150), sampling="msaa4", **look) for _ in range(2))
    assert len(n_planes) == (0 if leaf.alpha_cutoff else 4)  # what has no holes is drawn as a mesh of its own
    assert_same(again, first)


@pytest.mark.parametrize("background", [CLEAR, (255, 255, 255, 255), (10, 200, 30, 100)])
def test_a_colour_per_triangle_is_the_mean_light_of_the_samples(background):
    got = tl.render(KNOT, size=SIZE, sampling="msaa4", shading="ids", background=background)
    ids = tl.rasterize_mesh(KNOT, size=SIZE, sampling="msaa4").samples_triangle
    samples = np.empty((*ids.shape, 4), np.uint8)
    samples[...] = background
    samples[ids >= 0] = np.column_stack([id_colors(ids[ids >= 0]), np.full((ids >= 0).sum(), 255)])
    expected = np.array([[mean(p, is_straight=True, tables=srgb_tables()) for p in row] for row in samples], np.uint8)
    is_clear = expected[..., 3] == 0  # whose colour is that of the background
    assert_same(got[~is_clear], expected[~is_clear])
    assert (got[is_clear] == background).all()


def test_outline_over_nothing_has_the_colour_of_the_surface():
    square = tl.Mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    camera = tl.Camera.look_at((0.1, 0.2, 5))
    got = tl.render(square, camera, SIZE, shading="flat", sampling="msaa8", background=CLEAR)
    assert len(np.unique(got[got[..., 3] > 0][:, :3], axis=0)) == 1
    assert len(np.unique(got[..., 3])) > 3


def test_a_triangle_is_shaded_once_in_a_pixel(monkeypatch):
    shaded = []

    def count(ids):
        shaded.append(len(ids))
        return id_colors(ids)

    monkeypatch.setattr(sys.modules["topleft._meshes.picture.shade"], "id_colors", count)
    tl.render(KNOT, size=SIZE, sampling="msaa8", shading="ids")
    ids = tl.rasterize_mesh(KNOT, size=SIZE, sampling="msaa8").samples_triangle
    pairs = sum(len(set(pixel) - {-1}) for row in ids.tolist() for pixel in row)
    assert sum(shaded) == pairs


def test_depth_has_one_range_for_all_samples():
    got = tl.render(KNOT, size=SIZE, sampling="msaa4", shading="depth", background=CLEAR)
    greys = got[got[..., 3] == 255][:, 0]
    assert GREY_OF_FARTHEST <= greys.min() < greys.max() <= GREY_OF_NEAREST
    center = tl.render(KNOT, size=SIZE, shading="depth", background=CLEAR)
    both = (got[..., 3] == 255) & (center[..., 3] == 255)
    assert np.abs(got[both].astype(int) - center[both]).mean() < 5  # samples near the centre; another range: 30


def test_empty_picture_and_picture_of_nothing():
    assert tl.render(KNOT, size=(0, 4), sampling="msaa4").shape == (4, 0, 4)
    away = tl.Camera.look_at((0, 0, 900), (0, 0, 1000))
    assert (tl.render(KNOT, away, SIZE, sampling="msaa4", background=(1, 2, 3)) == (1, 2, 3, 255)).all()


@pytest.mark.parametrize("sampling", ["area", "outer", "inner"])
def test_samplings_without_an_order_are_refused(sampling):
    with pytest.raises(ValueError, match=f"sampling '{sampling}' gives no ids"):
        tl.render(KNOT, size=SIZE, sampling=sampling)
