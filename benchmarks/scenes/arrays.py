"""Vertices and triangles of many kinds, without a camera: the parts of scenes in several studies."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.families import slivers
from topleft.scenes import blob, planar_mesh, random_triangles

Arrays = tuple[NDArray[Any], NDArray[Any]]


def shrunk(n: int, scale: float) -> int:
    """Return a number of triangles times a scale, at least 8 of them."""
    return max(8, round(n * scale))


def strewn_arrays(n: int, size_px: float, size: tuple[int, int], z: float | None = None, far: float = 1.0) -> Arrays:
    """Return triangles strewn over a frame, or over `far` times as much on each side; all at one depth if given."""
    width, height = (round(far * side) for side in size)
    vertices, triangles, _ = random_triangles(n, size_px, width, height)
    vertices[:, :2] -= [(width - size[0]) / 2, (height - size[1]) / 2]
    if z is not None:
        vertices[:, 2] = z
    return vertices, triangles


def sliver_arrays(n: int, size: tuple[int, int]) -> Arrays:
    """Return triangles 100 px long and up to 2 px thick."""
    vertices, triangles = slivers(n, 100, 1)
    center_px = np.random.default_rng(1).uniform(0, size, (n, 2))
    depth = np.repeat(np.random.default_rng(2).uniform(0, 1, n), 3)
    return np.column_stack([vertices + np.repeat(center_px, 3, axis=0), depth]), triangles


def blob_arrays(n: int, vertex: type = np.float32, index: type = np.int32) -> Arrays:
    """Return a bumpy sphere in object space."""
    vertices, triangles = blob(n)
    return vertices.astype(vertex), triangles.astype(index)


def map_arrays(n: int, size: tuple[int, int], *, is_whole: bool = False) -> Arrays:
    """Return a mesh that tiles the frame, its vertices whole pixels if wanted."""
    vertices, triangles = planar_mesh(n // 2, *size)
    return (np.rint(vertices) if is_whole else vertices), triangles


def grid_triangles(n_rows: int, n_columns: int) -> NDArray[np.int32]:
    """Return two triangles for each cell of a grid of vertices, row by row."""
    corner = np.arange(n_rows * n_columns, dtype=np.int32).reshape(n_rows, n_columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, :-1], corner[1:, 1:]
    return np.stack([a, c, b, b, c, d], axis=-1).reshape(-1, 3)


def terrain_arrays(n: int, height: float = 0.12) -> Arrays:
    """Return a terrain over [-1, 1] x [-1, 1], y up, rough at every scale: heights of a spectrum f ** -2.2."""
    side = max(2, round((n / 2) ** 0.5) + 1)
    k = 1 << (side - 1).bit_length()
    squares = np.fft.fftfreq(k)[:, None] ** 2 + np.fft.rfftfreq(k) ** 2
    squares[0, 0] = np.inf
    phases = np.random.default_rng(1).random(squares.shape)
    heights = np.fft.irfft2(squares**-1.1 * np.exp(2j * np.pi * phases), (k, k))[:side, :side]
    heights *= height / np.ptp(heights)
    x, z = np.meshgrid(*[np.linspace(-1, 1, side)] * 2)
    points = np.stack([x, heights - heights.min(), z], axis=-1).reshape(-1, 3)
    return points.astype(np.float32), grid_triangles(side, side)


def rounded(arrays: Arrays) -> Arrays:
    """Return the same with x and y rounded to whole pixels."""
    vertices = arrays[0].copy()
    vertices[:, :2] = np.rint(vertices[:, :2])
    return vertices, arrays[1]
