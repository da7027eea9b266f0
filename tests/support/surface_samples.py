"""Distances between surfaces by brute force: what the bounds of levels are compared with."""

import numpy as np


def squared(points, corners):
    """Squared distances (N,) of points (N, 3) from a triangle each (N, 3, 3), inside or on the sides, in float64."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    across = np.cross(b - a, c - a)
    area = (across**2).sum(axis=1)
    best = np.full(len(corners), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        side = q - p
        length = (side**2).sum(axis=1)
        t = np.divide(((points - p) * side).sum(axis=1), length, out=np.zeros(len(p)), where=length > 0).clip(0, 1)
        best = np.minimum(best, ((points - p - t[:, None] * side) ** 2).sum(axis=1))
    parts = [(np.cross(q - p, points - p) * across).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))]
    is_above = (area > 0) & (np.min(parts, axis=0) >= 0)
    height = np.divide(((points - a) * across).sum(axis=1), area, out=np.zeros(len(a)), where=area > 0)
    return np.where(is_above, np.minimum(best, height**2 * area), best)


def points_on(corners, n):
    """Points on triangles (T, 3, 3): a regular grid of n steps along each side, corners and sides too."""
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    return np.einsum("wk,tkx->twx", weights, corners).reshape(-1, 3)


def sampled_distance(one, other, n=6):
    """The largest distance of sample points of one surface from the other, both ways; both (T, 3, 3)."""
    ways = (one, other), (other, one)
    return max(np.sqrt(largest_squared(points_on(source, n), target)) for source, target in ways)


def largest_squared(points, corners):
    """The largest of the squared distances of points from triangles; of each point from those that may be nearest."""
    centers = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
    largest = 0.0
    for some in np.array_split(points, len(points) * len(corners) // 500_000 + 1):
        to_centers = np.linalg.norm(centers - some[:, None], axis=2)
        near = to_centers - radii <= to_centers.min(axis=1, keepdims=True) * (1 + 1e-9)  # a center is on its triangle
        which, triangle = np.nonzero(near)
        starts = np.searchsorted(which, np.arange(len(some)))
        largest = max(largest, np.minimum.reduceat(squared(some[which], corners[triangle]), starts).max())
    return largest


def corners_of(mesh):
    """Corners (T, 3, 3) float64 of the triangles of a mesh."""
    return np.asarray(mesh.vertices, np.float64)[mesh.triangles]
