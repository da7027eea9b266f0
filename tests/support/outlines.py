"""How far the outlines of two meshes are from each other in a picture, by masks of many samples a pixel."""

import numpy as np
import pytest

import topleft as tl

ndimage = pytest.importorskip("scipy.ndimage")

SIZE = (96, 64)
FINENESS = 8
"""Samples of a pixel along each axis, where outlines are compared."""

MARGIN = 16
"""Pixels round the frame that are looked at too: what shows at its edge may belong outside."""


def masks(mesh, matrix, sampling, margin):
    """The mask of a mesh in many samples a pixel, within the frame and a margin round it."""
    width, height = (FINENESS * n for n in SIZE)
    around = FINENESS * margin
    return tl.coverage(
        mesh.vertices, mesh.triangles, (width + 2 * around, height + 2 * around), transform=matrix,
        viewport=(width, height), origin=(-around, -around), sampling=sampling,
    )  # fmt: skip


def farthest_px(one, other, matrix):
    """How far a sample in the frame that one mesh covers is from where the other is, pixels."""
    inside = masks(one, matrix, "center", 0)
    around = masks(other, matrix, "outer", MARGIN)
    edge = FINENESS * MARGIN
    distance = ndimage.distance_transform_edt(~around)[edge:-edge, edge:-edge]
    return distance[inside].max(initial=0.0) / FINENESS


#: A point lies in a square of a sample whose middle is half a diagonal away; both surfaces are snapped to 1/256 of a
#: sample, by 1/512 along each axis.
SLACK = (np.sqrt(0.5) + 2 * np.sqrt(2) / 512) / FINENESS


def check_outlines(mesh, camera, tolerance):
    """Compare the outlines of a mesh and of what is drawn of it within a tolerance, both ways; return its level."""
    found = tl.choose_detail(mesh, camera, SIZE, tolerance=tolerance)
    assert found.bound_px <= tolerance
    matrix = camera.clip_from_world(SIZE)
    for one, other in ((mesh, found.mesh), (found.mesh, mesh)):
        assert farthest_px(one, other, matrix) <= found.bound_px + SLACK
    return found.level
