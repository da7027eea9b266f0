"""Distances between surfaces by brute force: what the bounds of levels are compared with."""

import numpy as np


def nearest_squared(point, corners):
    """Squared distance of a point from triangles (T, 3, 3), the smallest: inside, or on the three sides, in float64."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    across = np.cross(b - a, c - a)
    area = (across**2).sum(axis=1)
    best = np.full(len(corners), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        side = q - p
        length = (side**2).sum(axis=1)
        t = np.divide(((point - p) * side).sum(axis=1), length, out=np.zeros(len(p)), where=length > 0).clip(0, 1)
        best = np.minimum(best, ((point - p - t[:, None] * side) ** 2).sum(axis=1))
    parts = [(np.cross(q - p, point - p) * across).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))]
    is_above = (area > 0) & (np.min(parts, axis=0) >= 0)
    height = np.divide(((point - a) * across).sum(axis=1), area, out=np.zeros(len(a)), where=area > 0)
    return np.where(is_above, np.minimum(best, height**2 * area), best).min()


def points_on(corners, n):
    """Points on triangles (T, 3, 3): a regular grid of n steps along each side, corners and sides too."""
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    return np.einsum("wk,tkx->twx", weights, corners).reshape(-1, 3)


def sampled_distance(one, other, n=6):
    """The largest distance of sample points of one surface from the other, both ways; both (T, 3, 3)."""
    ways = ((one, other), (other, one))
    return max(np.sqrt(nearest_squared(point, target)) for source, target in ways for point in points_on(source, n))


def corners_of(mesh):
    """Corners (T, 3, 3) float64 of the triangles of a mesh."""
    return np.asarray(mesh.vertices, np.float64)[mesh.triangles]
