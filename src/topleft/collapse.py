"""Collapse: a mesh with fewer triangles, by fast-simplification, and what its vertices and triangles are made of.

In: points, triangles. Out: fewer of both, and which points have become one. How far they lie from what they were is
measured elsewhere: nothing here promises anything.

Based on: M. Garland, P. S. Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997 (what the package does).
"""

from __future__ import annotations

import threading
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft.errors import MissingPackageError

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]

#: The package keeps its mesh in a global variable.
_lock = threading.Lock()


class Collapsed(NamedTuple):
    """What is left: points (N, 3) float64, triangles (K, 3) int32; and `into` (V,), the row of `points` that each point
    went into, -1 where it vanished with all its triangles."""

    points: F64
    triangles: I32
    into: I32


def collapser() -> Any:
    """The package that collapses edges.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    try:
        import fast_simplification
    except ImportError:
        raise MissingPackageError(
            "levels of detail need fast-simplification: pip install 'topleft[simplify]'"
        ) from None
    return fast_simplification


def collapse(points: F64, triangles: I32, n_wanted: int, *, keeps_border: bool) -> Collapsed:
    """Fewer triangles, about as many as wanted; more where nothing can be collapsed.

    Parameters
    ----------
    points : (V, 3) float64
    triangles : (T, 3) int32
    n_wanted : int
    keeps_border : bool
        Leave the points of sides that have one triangle where they are.

    Notes
    -----
    The package collapses in rounds, what costs least first; the thresholds of the rounds are absolute. Points are
    scaled so that a picture with the wanted number of triangles needs the middle ones: the distance that a triangle
    less costs goes with its area. On the blob of 100,000 triangles that halves the bound.
    """
    package = collapser()
    low, high = points.min(axis=0), points.max(axis=0)
    center, size = low / 2 + high / 2, float((high - low).max()) or 1.0
    scale = max(n_wanted, 1) / size
    with _lock:
        moved, left, pairs = package.simplify(
            (points - center) * scale, triangles, target_count=n_wanted, preserve_border=keeps_border,
            return_collapses=True,
        )  # fmt: skip
    pairs = np.asarray(pairs).reshape(-1, 2)
    into = np.arange(len(points), dtype=np.int32)
    into[pairs[:, 1]] = pairs[:, 0]
    while True:  # a point that another went into may have gone into a third: each round halves the way
        further = into[into]
        if np.array_equal(further, into):
            break
        into = further
    corners = into[triangles]
    a, b, c = corners.T
    corners = corners[(a != b) & (b != c) & (c != a)]
    is_left = np.zeros(len(points), np.bool_)
    is_left[corners.ravel()] = True
    row = np.where(is_left, np.cumsum(is_left, dtype=np.int32) - 1, np.int32(-1)).astype(np.int32)
    if not np.array_equal(row[corners], left):
        raise RuntimeError("fast-simplification has returned other triangles than its collapses leave")
    return Collapsed(np.asarray(moved, np.float64) / scale + center, np.asarray(left, np.int32), row[into])
