"""Cuts polygons with any number of corners into triangles that cover just what the polygons cover.

Input: points, flat or in space, and faces as corners one after the other. Output: triangles, in the order of the faces.
Polygons in space are seen along their area vector. Convex ones become fans; of the others ears are cut off.

Based on: Meisters, G. H., "Polygons Have Ears", American Mathematical Monthly, 1975; Newell's area vector as in
Sutherland, Sproull and Schumacker, "A Characterization of Ten Hidden-Surface Algorithms", 1974.
"""

from __future__ import annotations

import numpy as np

from topleft._core.base.array_types import F64, I64, Array

FEW_POINTS = 24
"""Below that many points a loop of Python takes less time than NumPy."""

TURNS_TOO_SMALL = 1e-12
"""Of the area of a polygon: corners that turn by less are straight, whatever the rounding says."""


def triangulate(points: Array, corners: Array, n_corners: Array) -> tuple[I64, I64]:
    """Triangles of polygons.

    Parameters
    ----------
    points : (V, 2) or (V, 3) of real numbers
    corners : (C,) of integers
        Rows of points, the corners of one polygon after the other.
    n_corners : (F,) of integers
        How many each has; those with fewer than three have no triangles.

    Returns
    -------
    triangles : (T, 3) int64
        Rows of `corners`, in the order of the polygons and with their winding.
    faces : (T,) int64
        The polygon of each triangle.

    Raises
    ------
    IndexError
        If a corner is no point.
    """
    n_corners = n_corners.astype(np.int64)
    if (n_corners == 3).all():
        return np.arange(3 * len(n_corners)).reshape(-1, 3), np.arange(len(n_corners))
    starts = np.cumsum(n_corners) - n_corners
    n_triangles = np.maximum(n_corners - 2, 0)
    faces = np.repeat(np.arange(len(n_corners)), n_triangles)
    if len(corners) and not (0 <= corners.min() and corners.max() < len(points)):
        bad = int(((corners < 0) | (corners >= len(points))).argmax())
        raise IndexError(f"corner {bad} = {corners[bad]} must be one of {len(points)} points")
    first = np.cumsum(n_triangles) - n_triangles
    triangles = np.empty((len(faces), 3), np.int64)
    for k in np.unique(n_corners[n_corners >= 3]).tolist():
        own = np.flatnonzero(n_corners == k)
        rows = starts[own, None] + np.arange(k)
        if k == 3:
            local = np.broadcast_to(np.arange(3), (len(own), 1, 3))
        else:
            local = _cut(_in_space(points[corners[rows]]))
        triangles[first[own, None] + np.arange(k - 2)] = starts[own, None, None] + local
    return triangles, faces


def _in_space(points: Array) -> F64:
    points = points.astype(np.float64)
    return points if points.shape[-1] == 3 else np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)


def _cut(polygons: F64) -> I64:
    """Triangles (F, K - 2, 3) of polygons (F, K, 3) with K corners each."""
    n, k = polygons.shape[:2]
    fan = np.stack([np.zeros(k - 2, np.int64), np.arange(1, k - 1), np.arange(2, k)], axis=1)
    cut = np.tile(fan, (n, 1, 1))
    with np.errstate(all="ignore"):  # what is not finite is refused where the mesh is made
        relative = polygons - polygons[:, :1]
        area = np.cross(relative, np.roll(relative, -1, axis=1)).sum(axis=1)
        edges = np.roll(polygons, -1, axis=1) - polygons
        turns = (np.cross(np.roll(edges, 1, axis=1), edges) * area[:, None]).sum(axis=2)
        reflex = turns < -TURNS_TOO_SMALL * (area**2).sum(axis=1)[:, None]
    if k == 4:
        cut[reflex[:, 1] | reflex[:, 3]] = [[1, 2, 3], [1, 3, 0]]
        return cut
    for i in np.flatnonzero(reflex.any(axis=1)).tolist():
        cut[i] = _ears(_flattened(relative[i], area[i]))
    return cut


def _flattened(points: F64, normal: F64) -> F64:
    """The points (K, 2) seen from the end of a normal: x to the right and y up."""
    axis = int(np.abs(normal).argmax())
    flat = np.delete(points, axis, axis=1) / max(float(np.abs(points).max()), 1e-300)
    return flat if (normal[axis] < 0) == (axis == 1) else flat[:, ::-1]


def _ears(points: F64) -> I64:
    """Triangles (K - 2, 3) of one polygon (K, 2) that turns to the left."""
    x, y = points[:, 0].tolist(), points[:, 1].tolist()
    k = len(x)
    before = [k - 1, *range(k - 1)]
    after = [*range(1, k), 0]

    def turn(i: int) -> float:
        a, c = before[i], after[i]
        return (x[i] - x[a]) * (y[c] - y[a]) - (y[i] - y[a]) * (x[c] - x[a])

    reflex = {i for i in range(k) if turn(i) < 0}
    holding = _Reflex(points, reflex)
    triangles: list[tuple[int, int, int]] = []
    i, n_failed, left = 0, 0, k
    while left > 3:
        if n_failed > left or (i not in reflex and turn(i) >= 0 and not holding.are_in(before[i], i, after[i])):
            a, c = before[i], after[i]
            triangles.append((a, i, c))
            after[a], before[c] = c, a
            reflex.discard(i)
            for other in (a, c):
                if other in reflex and turn(other) >= 0:
                    reflex.discard(other)
            i, n_failed, left = c, 0, left - 1
        else:
            i, n_failed = after[i], n_failed + 1
    triangles.append((before[i], i, after[i]))
    return np.array(triangles)


class _Reflex:
    """The reflex corners of a polygon, of which ears get fewer."""

    def __init__(self, points: F64, corners: set[int]) -> None:
        self._points = points
        self._corners = corners
        self._at = np.zeros(0, np.int64)

    def are_in(self, a: int, b: int, c: int) -> bool:
        """Whether a triangle, with its border but not its corners, holds any of them."""
        if len(self._corners) <= FEW_POINTS:
            return self._few_are_in(a, b, c)
        if not len(self._at) or len(self._corners) < 0.8 * len(self._at):
            self._at = np.fromiter(self._corners, np.int64, len(self._corners))
            self._x, self._y = self._points[self._at].T.copy()
        inside = np.ones(len(self._at), np.bool_)
        for p, q in ((a, b), (b, c), (c, a)):
            (px, py), (qx, qy) = self._points[p], self._points[q]
            inside &= (qx - px) * (self._y - py) >= (qy - py) * (self._x - px)
            inside &= (self._x != px) | (self._y != py)
        return any(i in self._corners for i in self._at[inside].tolist())

    def _few_are_in(self, a: int, b: int, c: int) -> bool:
        (ax, ay), (bx, by), (cx, cy) = own = [tuple(self._points[i].tolist()) for i in (a, b, c)]
        for i in self._corners:
            px, py = self._points[i].tolist()
            if (
                (bx - ax) * (py - ay) >= (by - ay) * (px - ax)
                and (cx - bx) * (py - by) >= (cy - by) * (px - bx)
                and (ax - cx) * (py - cy) >= (ay - cy) * (px - cx)
                and (px, py) not in own
            ):
                return True
        return False
