"""Many cameras round one subject."""

import numpy as np
import pytest

from topleft import scenes
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.viewpoints import turntable, viewpoints
from topleft._meshes.model.mesh import Mesh

KNOT = Mesh(*scenes.shape("torus-knot"))
BOX = [(-1.0, -2, -3), (1, 2, 3)]


def eyes(cameras):
    return np.array([-camera.view[:3, :3].T @ camera.view[:3, 3] for camera in cameras])


def test_turntable_goes_round_in_equal_steps():
    cameras = turntable(BOX, 4, azimuth_deg=0, elevation_deg=0)
    directions = eyes(cameras) / np.linalg.norm(eyes(cameras), axis=1)[:, None]
    assert directions == pytest.approx(np.array([[0, 0, 1], [1, 0, 0], [0, 0, -1], [-1, 0, 0.0]]), abs=1e-12)


@pytest.mark.parametrize("fit", ["sphere", "box"])
def test_turntable_first_camera_is_that_of_framing(fit):
    first = turntable(KNOT, 3, up="z", fit=fit, aspect=1.5)[0]
    assert first.view == pytest.approx(Camera.framing(KNOT, up="z", fit=fit, aspect=1.5).view, abs=1e-12)


@pytest.mark.parametrize("n", [1, 2, 50])
def test_viewpoints_share_the_sphere_evenly(n):
    directions = eyes(viewpoints(BOX, n))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    samples = np.random.default_rng(1).normal(size=(200_000, 3))
    owner = np.argmax(samples @ directions.T, axis=1)
    share = np.bincount(owner, minlength=n) / len(samples) * n
    assert share.min() > 0.75
    assert share.max() < 1.25


@pytest.mark.parametrize("n", [1, 2, 3, 100])
def test_viewpoints_stand_as_high_above_as_below(n):
    heights = eyes(viewpoints([(-1.0, -1, -1), (1, 1, 1)], n))[:, 1]
    assert np.sort(heights) == pytest.approx(-np.sort(heights)[::-1], abs=1e-9)
    assert len(set(np.diff(np.sort(heights)).round(9))) <= 1


def test_viewpoints_all_see_the_whole_subject():
    for camera in viewpoints(KNOT, 20, aspect=4 / 3):
        x, y, depth = camera.project(KNOT.vertices, (400, 300)).T
        assert 0 < x.min() < x.max() < 400
        assert 0 < y.min() < y.max() < 300
        assert 0 <= depth.min() < depth.max() <= 1


@pytest.mark.parametrize("make", [turntable, viewpoints])
def test_viewpoints_of_nothing_are_refused(make):
    with pytest.raises(ValueError, match="n must be at least 1, got 0"):
        make(BOX, 0)
    with pytest.raises(TypeError, match=r"n must be an integer, got 2\.5"):
        make(BOX, 2.5)
    with pytest.raises(ValueError, match="nothing to frame"):
        make(np.empty((0, 3)), 2)
