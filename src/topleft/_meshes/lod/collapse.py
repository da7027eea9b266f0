"""Collapses the edges of a mesh by fast-simplification, and finds the points that each vertex of the result replaces.

In: points, triangles. Out: fewer of both, and the row of each old point. Without a bound on the distance: see
`distance.py`.

Based on: M. Garland, P. S. Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import F64, I32
from topleft._core.base.threads import ProcessLock
from topleft.errors import MissingPackageError

#: Scales to try in turn: the diameter of a mesh, per wanted triangle.
FINENESS = (10.0, 1.0)

#: A result with more than 1.25 times the wanted triangles is rejected, and the next scale is tried.
TOO_MANY = 1.25

#: A result with more than this share of the triangles is a failure: hardly any edge can be collapsed.
STUCK = 0.8

#: The package keeps its mesh in a global variable.
_lock = ProcessLock()


class Collapsed(NamedTuple):
    """The collapsed mesh: points (N, 3) float64, triangles (K, 3) int32, and the row (V,) of each old point's vertex.

    The row is -1 where a point vanished with all its triangles; `into` is None unless `with_pairs`.
    """

    points: F64
    triangles: I32
    into: I32 | None


def collapser() -> Any:
    """The package that collapses edges."""
    try:
        import fast_simplification  # type: ignore[import-not-found, import-untyped, unused-ignore]
    except ImportError:
        raise MissingPackageError(
            "levels of detail need fast-simplification: pip install fast-simplification"
        ) from None
    return fast_simplification


def wanted_of(triangles: I32, ratio: float, smallest: int) -> int:
    """The number of triangles of the next level; 0: there is none.

    Borders stay, and a border of n sides needs about n triangles: the ratio applies to all other triangles. Otherwise
    a level would have nothing but its borders.
    """
    n_fixed = len(border_points(triangles))
    n_free = int((len(triangles) - n_fixed) * ratio)
    n_wanted = n_fixed + n_free
    return n_wanted if smallest <= n_free and n_wanted <= STUCK * len(triangles) else 0


def collapse(points: F64, triangles: I32, n_wanted: int, *, with_pairs: bool = True) -> Collapsed:
    """Collapse to about `n_wanted` triangles; more where edges cannot be collapsed. Open borders do not change.

    Parameters
    ----------
    points : (V, 3) float64
    triangles : (T, 3) int32
    n_wanted : int
    with_pairs : bool
        Whether to compute `into`, which takes memory.

    Notes
    -----
    The package collapses in rounds, the cheapest edges first; the thresholds of the rounds are absolute. Points are
    scaled so that a mesh with the wanted number of triangles needs the middle thresholds: the distance by which a
    collapse moves the surface is proportional to the area of triangles. On the blob of 200,000 triangles the bounds
    are 1.1 to 7 times smaller than with a scale of 1. A finer scale may end the rounds early; then a coarser scale is
    tried, then a grid.

    The package moves open borders as if there were no surface outside: on the bunny, which is open below, bounds
    are 4 to 6 times smaller where borders stay.
    """
    for fineness in FINENESS:
        collapsed = collapse_at(points, triangles, n_wanted, fineness, with_pairs=with_pairs)
        if len(collapsed.triangles) <= TOO_MANY * n_wanted:
            return collapsed
    clustered = gather(points, triangles, n_wanted)
    if not 0 < n_wanted < len(clustered.triangles):
        return collapsed
    again = collapse_at(*clustered[:2], n_wanted, FINENESS[-1], with_pairs=with_pairs)
    return joined(clustered, again) if 0 < len(again.triangles) < len(collapsed.triangles) else collapsed


def joined(first: Collapsed, second: Collapsed) -> Collapsed:
    """The composition of two steps."""
    if first.into is None or second.into is None:
        return second
    return second._replace(into=np.where(first.into < 0, np.int32(-1), second.into[first.into]).astype(np.int32))


def gather(points: F64, triangles: I32, n_wanted: int) -> Collapsed:
    """The mesh with all points of a cell of a grid merged into one of these points; open borders do not change.

    The package does not collapse needles, as at the poles of a globe. Cells are a third of a side of the wanted
    triangles, so no shape is lost that the wanted triangles could show.

    References
    ----------
    J. Rossignac, P. Borrel, "Multi-resolution 3D Approximations for Rendering Complex Scenes", 1993.
    """
    a, b, c = points[triangles.T]
    area = float(np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)).mean()) / 2 * len(triangles)
    side = np.sqrt(4 / np.sqrt(3) * area / max(n_wanted, 1)) / 3
    low = points.min(axis=0)
    cell = np.floor((points - low) / side).astype(np.int64) if side > 0 else np.zeros(points.shape, np.int64)
    n_cells = cell.max(axis=0) + 1
    key = (cell[:, 0] * n_cells[1] + cell[:, 1]) * n_cells[2] + cell[:, 2]
    del cell
    on_border = border_points(triangles)
    key[on_border] = -1 - on_border
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    into = first[group].astype(np.int32)
    corners, row = left_of(triangles, into)
    return Collapsed(points[row >= 0], corners, row[into])


def left_of(triangles: I32, into: I32) -> tuple[I32, I32]:
    """The triangles that keep three different corners under `into`, and the new row of each used point; else -1."""
    corners = into[triangles]
    a, b, c = corners.T
    corners = corners[(a != b) & (b != c) & (c != a)]
    is_used = np.zeros(len(into), np.bool_)
    is_used[corners.ravel()] = True
    row: I32 = np.where(is_used, np.cumsum(is_used) - 1, -1).astype(np.int32)
    return row[corners], row


def border_points(triangles: I32) -> npt.NDArray[np.int64]:
    """The points of sides that belong to a single triangle."""
    return np.unique(open_sides(triangles))


def open_sides(triangles: I32) -> npt.NDArray[np.int64]:
    """The sides (N, 2) that belong to a single triangle, the lower of their points first."""
    n = len(triangles)
    key = np.empty(3 * n, np.int64)
    for k in range(3):
        a, b = triangles[:, k], triangles[:, (k + 1) % 3]
        key[k * n : (k + 1) * n] = np.minimum(a, b).astype(np.int64) << 32 | np.maximum(a, b)
    key.sort()
    is_new = np.ones(3 * n + 1, np.bool_)
    np.not_equal(key[1:], key[:-1], out=is_new[1:-1])
    open_keys = key[is_new[:-1] & is_new[1:]]
    return np.stack([open_keys >> 32, open_keys & 0xFFFFFFFF], axis=1)


def collapse_at(points: F64, triangles: I32, n_wanted: int, fineness: float, *, with_pairs: bool) -> Collapsed:
    """Fewer triangles, with thresholds of the rounds by `fineness`."""
    package = collapser()
    low, high = points.min(axis=0), points.max(axis=0)
    center, size = low / 2 + high / 2, float((high - low).max()) or 1.0
    scale = fineness * max(n_wanted, 1) / size
    with _lock:
        moved, left, *pairs = package.simplify(
            (points - center) * scale, triangles, target_count=n_wanted, preserve_border=True,
            return_collapses=with_pairs,
        )  # fmt: skip
    left = np.asarray(left, np.int32)
    into = rows_of_pairs(pairs[0], triangles, len(points), left) if with_pairs else None
    if with_pairs and into is None:
        return Collapsed(points, triangles, np.arange(len(points), dtype=np.int32))
    return Collapsed(np.asarray(moved, np.float64) / scale + center, left, into)


def rows_of_pairs(pairs: Any, triangles: I32, n_points: int, left: I32) -> I32 | None:
    """The new row of each old point, from pairs of points: the second was merged into the first.

    None where the pairs leave other triangles than the package does, as of a mesh that is a point or a line.
    """
    pairs = np.asarray(pairs).reshape(-1, 2)
    into = np.arange(n_points, dtype=np.int32)
    into[pairs[:, 1]] = pairs[:, 0]
    while True:  # chains of merges: each round halves their length
        further = into[into]
        if np.array_equal(further, into):
            break
        into = further
    corners, row = left_of(triangles, into)
    return row[into] if np.array_equal(corners, left) else None
