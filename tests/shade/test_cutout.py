"""Textures with holes: what is behind them shows, whatever the order, threads, window and instruction set."""

from dataclasses import replace

import numpy as np
import pytest
import shading_reference as reference
from comparing import assert_same
from leaf_cases import CAMERA, HOLES, LEAF, N_LAYERS, SIZE, cut, layers

import topleft as tl
from topleft import _engine
from topleft._engine.isa import build_info
from topleft._render.holes import cut_of, cut_out


def expected_ids(mesh):
    """Each layer drawn and tested by itself; the nearest that is left, of all pixels."""
    nearest, ids = np.full(SIZE[::-1], np.inf), np.full(SIZE[::-1], -1)
    for k in range(N_LAYERS + 1):
        own = replace(mesh, triangles=mesh.triangles[2 * k : 2 * k + 2], materials=(), material_of_triangle=None)
        frags = tl.rasterize_mesh(own, CAMERA, SIZE)
        w = reference.Weights(frags, own, CAMERA, SIZE)
        opacity = reference.sample(LEAF.texture, w.of(own.uv), w.slopes_of(own.uv))[:, 3]
        is_left = np.zeros(SIZE[::-1], bool)
        is_left[w.rows, w.cols] = (opacity >= 0.5) | (k == N_LAYERS)
        is_left &= frags.depth < nearest
        nearest[is_left] = frags.depth[is_left]
        ids[is_left] = frags.triangle[is_left] + 2 * k
    return ids


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1)])
def test_cutout_shows_the_nearest_that_is_left(order):
    mesh = layers(order)
    got, expected = cut(mesh).triangle, expected_ids(mesh)
    assert len(np.unique(expected)) == 2 * (N_LAYERS + 1) + 1
    # float32 opacity of 0.5 to a few units in the last place: no pixel of these scenes is that close.
    assert_same(got, expected.astype(np.int32))


def test_cutout_without_holes_is_the_visibility_buffer():
    mesh = layers((0, 1, 2, 3))
    full = replace(mesh, materials=(tl.Material(texture=LEAF.texture, alpha_cutoff=1e-6), mesh.materials[1]))
    solid = np.full_like(HOLES, 255)
    solid[0, 0, 3] = 254
    full = replace(full, materials=(replace(full.materials[0], texture=tl.Texture(solid)), mesh.materials[1]))
    before, after = tl.rasterize_mesh(full, CAMERA, SIZE), cut(full)
    assert_same(after.triangle, before.triangle)
    assert_same(after.depth, before.depth)


@pytest.mark.parametrize("sampling", ["center", "msaa4"])
def test_cutout_threads_and_windows_change_no_bit(sampling):
    mesh = layers((2, 0, 3, 1))
    whole = cut(mesh, threads=1, sampling=sampling)
    three = cut(mesh, threads=3, sampling=sampling)
    part = cut(mesh, (40, 33), origin=(21, 17), viewport=SIZE, sampling=sampling)
    assert_same(three.samples_triangle, whole.samples_triangle)
    assert_same(three.samples_depth, whole.samples_depth)
    assert_same(part.samples_triangle, whole.samples_triangle[17:50, 21:61])


def test_cutout_each_isa_gives_the_same_bits():
    mesh, name, found = layers((2, 0, 3, 1)), build_info()["isa"], []
    try:
        for isa in _engine.isa_available():
            _engine.use_isa(isa)
            found.append(cut(mesh, sampling="msaa4").samples_triangle)
    finally:
        _engine.use_isa(name)
    for other in found[1:]:
        assert_same(other, found[0])


def test_cutout_of_a_triangle_that_the_near_plane_cuts():
    floor = [[-9, 0, 8], [9, 0, 8], [0, 0, -60]]
    mesh = tl.Mesh(floor, [[0, 1, 2]], uv=np.array(floor)[:, [0, 2]] / 4, materials=(LEAF,))
    camera = tl.Camera.look_at((0, 1, 5), (0, 0.2, 0), near=0.1, far=1000)
    frags = tl.rasterize_mesh(mesh, camera, SIZE)
    before = frags.mask
    cut_out(frags, mesh, camera, cut_of(mesh))
    assert not (frags.mask & ~before).any()
    assert 0.3 < frags.mask.sum() / before.sum() < 0.8  # 7 of 15 diagonals, and the far end is the mean of all


def test_render_cuts_holes_out():
    mesh = layers((0, 1, 2, 3))
    alone = replace(mesh, triangles=mesh.triangles[:2], materials=(LEAF,), material_of_triangle=None)
    picture = tl.render(alone, CAMERA, SIZE, background=(0, 0, 0, 0))
    assert_same(picture[..., 3] == 255, cut(alone).mask)
    assert 0.2 < (picture[..., 3] == 255).sum() / tl.rasterize_mesh(alone, CAMERA, SIZE).mask.sum() < 0.8
