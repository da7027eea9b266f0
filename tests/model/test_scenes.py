"""Scenes: deterministic to the bit, and built-in shapes that are closed and face outward."""

import hashlib
from collections import Counter

import numpy as np
import pytest
from engine_cases import one_by_one

from topleft import scenes

CLOSED = sorted(scenes.SHAPES)


def directed_edges(vertices, triangles):
    """Edges by position, so that a doubled vertex is no hole."""
    _, position = np.unique(vertices.round(9), axis=0, return_inverse=True)
    corners = position.reshape(-1)[triangles]
    return Counter(map(tuple, corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))


def test_large_triangle_default_is_the_published_one():
    vertices, triangles = scenes.large_triangle()
    assert vertices.tolist() == [[10.3, 5.7], [3819.9, 300.2], [700.9, 2149.6]]
    assert triangles.tolist() == [[0, 1, 2]]


def test_random_triangles_of_a_seed_keep_their_bits():
    vertices, triangles, colors = scenes.random_triangles(100, 20)
    assert (vertices.shape, triangles.shape, colors.shape) == ((300, 3), (100, 3), (100, 3))
    assert (triangles.dtype, colors.dtype) == (np.int32, np.uint8)
    # The generator alone decides the depth; sine and cosine may differ in the last bit between machines.
    assert hashlib.sha256(vertices[:, 2].tobytes() + colors.tobytes()).hexdigest()[:16] == "d7099b9156afa69d"


def test_random_triangles_lie_within_their_circle():
    vertices, triangles, _ = scenes.random_triangles(100, 20)
    corners = vertices[triangles][..., :2]
    assert np.ptp(corners, axis=1).max() <= 20
    assert (np.ptp(vertices[triangles][..., 2], axis=1) == 0).all()


def test_planar_mesh_covers_the_frame_once():
    vertices, triangles = scenes.planar_mesh(50, 64, 48)
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    twice_area = np.abs(np.cross(np.pad(b - a, ((0, 0), (0, 1))), np.pad(c - a, ((0, 0), (0, 1))))[:, 2])
    assert twice_area.sum() / 2 == pytest.approx(66 * 50)  # the frame and a border of one pixel


def test_blob_has_about_the_triangles_asked_for():
    vertices, triangles = scenes.blob(1000)
    assert triangles.shape == (2 * 15 * 32, 3)
    assert vertices.shape == (16 * 32, 3)
    assert triangles.dtype == np.int32


def test_to_pixels_of_a_clip_corner_is_the_frame_corner():
    clip = np.array([[-2.0, 2.0, -2.0, 2.0], [2.0, -2.0, 2.0, 2.0]])
    assert scenes.to_pixels(clip, 640, 480).tolist() == [[0, 0, 0], [640, 480, 1]]


def test_to_clip_applies_the_matrix_to_columns():
    matrix = np.arange(16.0).reshape(4, 4)
    assert scenes.to_clip(np.array([[1.0, 2.0, 3.0]]), matrix).tolist() == [(matrix @ [1, 2, 3, 1]).tolist()]


@one_by_one("name", CLOSED)
def test_shape_is_closed_and_consistently_wound(name):
    edges = directed_edges(*scenes.shape(name))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)


@one_by_one("name", CLOSED)
def test_shape_faces_outward(name):
    vertices, triangles = scenes.shape(name)
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    assert (a * np.cross(b, c)).sum() > 0  # six times the volume


@one_by_one("name", CLOSED)
def test_shape_has_no_empty_triangle_and_no_spare_vertex(name):
    vertices, triangles = scenes.shape(name)
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0
    assert np.array_equal(np.unique(triangles), np.arange(len(vertices)))


def test_icosahedron_is_regular():
    vertices, triangles = scenes.shape("icosahedron")
    assert np.ptp(np.linalg.norm(vertices[triangles] - vertices[np.roll(triangles, 1, axis=1)], axis=2)) < 1e-12


def test_shape_takes_parameters():
    assert len(scenes.shape("icosphere", subdivisions=1)[1]) == 80


def test_shape_unknown_names_the_choices():
    with pytest.raises(ValueError, match="no built-in shape 'dodo'; there are blob, cube, "):
        scenes.shape("dodo")
