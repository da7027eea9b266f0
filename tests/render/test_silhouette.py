"""Silhouettes are `coverage` through a camera."""

import numpy as np
from comparing import assert_same

import topleft as tl

SIZE = (40, 30)
TORUS = tl.Mesh(*tl.scenes.shape("torus"))
CUBE = tl.Mesh(*tl.scenes.shape("cube"))


def camera_of(mesh):
    return tl.Camera.framing(mesh, aspect=SIZE[0] / SIZE[1])


def test_silhouette_is_the_mask_of_what_is_visible():
    got = tl.silhouette(TORUS, camera_of(TORUS), SIZE)
    assert_same(got, tl.rasterize_mesh(TORUS, camera_of(TORUS), SIZE).mask)
    assert 0 < got.sum() < got.size


def test_silhouette_without_camera_frames_the_mesh():
    assert_same(tl.silhouette(TORUS, size=SIZE), tl.silhouette(TORUS, camera_of(TORUS), SIZE))


def test_silhouette_by_area_of_front_faces_is_that_of_many_samples():
    """The cube is convex, so its front faces do not overlap; 64 x 64 samples a pixel err by less than 1/64."""
    width, height = SIZE
    got = tl.silhouette(CUBE, camera_of(CUBE), SIZE, sampling="area", cull="back")
    fine = tl.silhouette(CUBE, camera_of(CUBE), (64 * width, 64 * height)).reshape(height, 64, width, 64)
    assert got.dtype == np.float32
    assert abs(got - fine.mean((1, 3))).max() < 1 / 64


def test_silhouette_by_area_counts_both_sides_of_the_outline_without_culling():
    one, both = (tl.silhouette(CUBE, camera_of(CUBE), SIZE, sampling="area", cull=c) for c in ("back", "none"))
    assert (both >= one).all()
    assert (both > one + 0.3).any()


def test_silhouette_window_is_the_crop():
    whole = tl.silhouette(TORUS, camera_of(TORUS), SIZE, sampling="area")
    window = tl.silhouette(TORUS, camera_of(TORUS), (20, 10), origin=(15, 12), viewport=SIZE, sampling="area")
    assert_same(window, whole[12:22, 15:35])


def test_silhouette_goes_to_out():
    out = np.ones(SIZE[::-1], bool)
    assert tl.silhouette(TORUS, camera_of(TORUS), SIZE, out=out) is out
    assert_same(out, tl.silhouette(TORUS, camera_of(TORUS), SIZE))
