"""Rings as bad as they come: what tests of polygons draw."""

import numpy as np
from hypothesis import strategies as st

import topleft as tl

SIZE = (7, 5)


def wild_ring(rng, size, bits=8):
    """A ring that may cross itself, repeat points, run back along itself, and reach far out of the frame."""
    width = size[0]
    n = int(rng.choice([3, 4, 5, 6, 8, 12]))
    kind = rng.integers(0, 6)
    if kind == 0:
        points = rng.uniform(-2, 2 + max(size), (n, 2))
    elif kind == 1:  # on a lattice of half pixels: vertices on centres and on borders, level edges
        points = rng.integers(-1, 2 * max(size) + 2, (n, 2)) / 2
    elif kind == 2:
        points = rng.integers(0, max(size) + 1, (n, 2)).astype(float)
    elif kind == 3:  # tall and narrow
        points = np.stack([rng.uniform(0, width, n), rng.uniform(-300, 300, n)], 1)
    elif kind == 4:  # a star: simple, not convex
        angles = np.sort(rng.uniform(0, 2 * np.pi, n))
        points = np.array(size) / 2 + rng.uniform(0.2, 4, (n, 1)) * np.stack([np.cos(angles), np.sin(angles)], 1)
    else:  # within few pixels
        points = rng.uniform(0, max(size), 2) + rng.integers(-60, 60, (n, 2)) / 64
    points = np.round(points * 2**bits) / 2**bits
    if rng.random() < 0.3:
        points = np.repeat(points, rng.integers(1, 3, n), axis=0)
    if rng.random() < 0.2:  # a spike
        k = rng.integers(0, len(points))
        points = np.insert(points, k, [points[k - 1], points[k - 1] + rng.integers(-3, 4, 2)], axis=0)
    if rng.random() < 0.2:  # a point on the way
        middle = np.round((points[0] + points[1]) / 2 * 2**bits) / 2**bits
        points = np.insert(points, 1, middle, axis=0)
    if rng.random() < 0.5:
        points = points[::-1]
    return points


def wild_polygon(rng, size=SIZE, bits=8):
    """Up to three rings; one may stand twice, or touch another at a corner."""
    rings = [wild_ring(rng, size, bits) for _ in range(int(rng.choice([1, 1, 1, 2, 3])))]
    if rng.random() < 0.1:
        rings.append(rings[0][:: rng.choice([-1, 1])].copy())
    if len(rings) > 1 and rng.random() < 0.2:
        rings[1][0] = rings[0][0]
    return rings


def square(x0, y0, x1, y1, turn=1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], float)[::turn]


wild_seeds = st.integers(0, 2**32 - 1)


def cells(n, size, seed=0):
    """Voronoi cells that tile the frame: points, ring offsets, polygon offsets, on the grid of 8 bits."""
    from scipy.spatial import Voronoi

    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 1, (n, 2)) * size
    w, h = size
    sides = [[2 * w, 0] + points * [-1, 1], [0, 2 * h] + points * [1, -1]]
    mirrored = [points, points * [-1, 1], points * [1, -1], *sides]
    diagram = Voronoi(np.concatenate(mirrored))
    rings = [np.round(256 * diagram.vertices[diagram.regions[diagram.point_region[i]]]) / 256 for i in range(n)]
    offsets = np.concatenate([[0], np.cumsum([len(r) for r in rings])])
    return np.concatenate(rings), offsets, np.arange(n + 1)


def star(n, side, noise=3.0, jitter=0.0, seed=0):
    """A ring of n corners round the middle of a square picture; with jitter it crosses itself."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False) + rng.normal(0, jitter, n)
    radius = side * (0.366 + 0.085 * np.sin(9 * angles)) + rng.normal(0, noise, n)
    return side / 2 + radius[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)


def draw(rings, size=SIZE, **options):
    return tl.polygons(rings, size, **options)
