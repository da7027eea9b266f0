"""Bounds the two-sided Hausdorff distance of two surfaces, for every point of both.

In: points and triangles of two surfaces. Out: `DistanceBounds`: a lower and an upper bound of the distance.

The kernels (`csrc/mesh/nearest.c`, `csrc/mesh/reach.c`) search triangles by branch and bound; this file sorts the
triangles of a surface along a curve that keeps neighbours together, cuts the work in blocks, and adds a bound on
rounding.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I32
from topleft._core.base.cached import cached_property
from topleft._core.base.threads import available_threads, run_parts
from topleft._meshes.model.mesh import coincident

#: The upper bound may exceed the lower by this share of it ...
SHARE = 1 / 16

#: ... or by this share of the size of the surface: half a pixel of a picture in which it is 131,072 pixels wide.
LEAST = 2.0**-18

#: Errors of float64, as a share of the largest coordinate: a cut moves a corner by less than four roundings of 2**-53,
#: a foot by less than 64, and squares and roots lose less than 2**-45 of the distance.
ROUNDING_OF_CUT, ROUNDING_OF_FOOT, ROUNDING_OF_ROOT = 2.0**-51, 2.0**-47, 2.0**-45

#: Points or triangles of a block, which a single thread computes: the result does not depend on the threads.
BLOCK = 4096

#: The most points whose distances are computed before the triangles'.
MOST_SAMPLES = 1 << 18

#: Bits of the place of a triangle along each axis. With the 31 bits of its index they fill 64.
PLACE_BITS = 11


class DistanceBounds(NamedTuple):
    """Bounds on the distance of surfaces, in their unit: `known <= distance <= bound`, up to rounding on the left."""

    known: float
    bound: float


class Reach(NamedTuple):
    """Bounds of the distance of triangles from a surface, and the most pieces that a triangle was cut into."""

    known: float
    bound: float
    n_pieces: int


class TriangleTree:
    """Triangles (T, 3) int32 of points (V, 3) float64, at least one triangle, to search for the nearest.

    Vertices at equal places should share an index: it decides which triangles are neighbours.
    """

    def __init__(self, points: F64, triangles: I32) -> None:
        self.points, self.triangles = np.ascontiguousarray(points), np.ascontiguousarray(triangles)

    @classmethod
    def of_mesh(cls, vertices: npt.NDArray[Any], triangles: I32, center: F64) -> TriangleTree:
        """The surface of a mesh, without unused vertices, moved so that `center` is the origin."""
        points, corners = welded(vertices, triangles)
        return cls(points - center, corners)

    @cached_property
    def order(self) -> npt.NDArray[np.int64]:
        """The triangles along a curve that fills space (Z-order, G. M. Morton, 1966), neighbours near each other."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        scale = (2**PLACE_BITS - 1) / np.where(high > low, high - low, 1)
        key = np.arange(len(self.triangles), dtype=np.uint64)
        for axis in range(3):
            column = (self.points[:, axis] - low[axis]) * (scale[axis] / 3)
            place = sum(column[self.triangles[:, k]] for k in range(3)).astype(np.uint64)
            for bit in range(PLACE_BITS):
                key |= ((place >> np.uint64(bit)) & np.uint64(1)) << np.uint64(31 + 3 * bit + axis)
        key.sort()
        return (key & np.uint64(2**31 - 1)).astype(np.int64)

    @cached_property
    def in_order(self) -> I32:
        """The triangles (T, 3), sorted by `order`."""
        return self.triangles[self.order]

    @cached_property
    def tree(self) -> engine.Tree:
        """The tree of boxes of the sorted triangles; boxes are a little wider than their triangles."""
        slack = float(np.abs(self.points).max()) * 2.0**-22
        return engine.Tree(self.points, self.in_order, slack)

    def farthest(self, points: F64) -> float:
        """How far the farthest of points is from the surface."""
        nearest = np.empty(len(points), np.int32)

        def find(first: int, end: int) -> float:
            return max(self.tree.find_nearest(points, *block, nearest) for block in blocks(first, end, len(points)))

        return max(run_parts(find, n_blocks(len(points)), available_threads()))


def measure(surface: TriangleTree, other_surface: TriangleTree) -> DistanceBounds:
    """Bounds on the Hausdorff distance of two surfaces: of the point farthest from the other surface, either way.

    `bound` holds for every point of both, rounding included.
    """
    ends = [(surface, other_surface), (other_surface, surface)]
    at_corners = max(target.farthest(some_points(source)) for source, target in ends)
    size = max(float(np.ptp(surface.points, axis=0).max()) for surface, _ in ends)
    reaches = [reach(source, target, at_corners, LEAST * size) for source, target in ends]
    known, bound, n_pieces = (max(numbers) for numbers in zip(*reaches, strict=True))
    largest = max(float(np.abs(surface.points).max()) for surface, _ in ends)
    # Pieces are cut from pieces: a corner is rounded at most once for each piece.
    rounding = (ROUNDING_OF_CUT * n_pieces + ROUNDING_OF_FOOT) * largest
    return DistanceBounds(known, bound * (1 + ROUNDING_OF_ROOT) + rounding)


def reach(source: TriangleTree, target: TriangleTree, known: float, least: float) -> Reach:
    """The `Reach` of the triangles of a surface from another."""
    n, tree = len(source.triangles), target.tree

    def find(first: int, end: int) -> Reach:
        rows = [
            tree.find_reach(source.points, source.in_order, *block, known, SHARE, least)
            for block in blocks(first, end, n)
        ]
        return Reach(*(max(column) for column in zip(*rows, strict=True)))

    rows = run_parts(find, n_blocks(n), available_threads())
    return Reach(*(max(column) for column in zip(*rows, strict=True)))


def n_blocks(n: int) -> int:
    """How many blocks n points or triangles have."""
    return -(-n // BLOCK)


def blocks(first: int, end: int, n: int) -> list[tuple[int, int]]:
    """The ranges of blocks [first, end) of n points or triangles."""
    return [(i, min(i + BLOCK, n)) for i in range(first * BLOCK, min(end * BLOCK, n), BLOCK)]


def some_points(surface: TriangleTree) -> F64:
    """About `MOST_SAMPLES` points of a surface at most: their distances only save work."""
    step = max(1, len(surface.points) // MOST_SAMPLES)
    return np.ascontiguousarray(surface.points[::step])


def welded(vertices: npt.NDArray[Any], triangles: I32) -> tuple[F64, I32]:
    """The places (N, 3) float64 of used points, without duplicates, and the triangles with these indices.

    Triangles with two corners at equal places are dropped, since they cover nothing; unless all are such.
    """
    first, group = coincident(vertices)
    corners = group[triangles]
    a, b, c = corners.T
    is_whole = (a != b) & (b != c) & (c != a)
    if is_whole.any():
        corners = corners[is_whole]
    is_used = np.zeros(len(first), np.bool_)
    is_used[corners.ravel()] = True
    rows = np.cumsum(is_used) - 1
    return vertices[first[is_used]].astype(np.float64), rows[corners].astype(np.int32)
