"""The exact picture of many triangles, fast: edge functions of blocks of triangles at once, as wide as needed.

In: vertices in pixels, float64, unchanged or after a snap (`snapped`, `projected`). Out: how many triangles cover each
sample, the visible triangle and its depth; the squares that an edge meets; the areas of triangles in squares.

A block holds triangles with boxes of about the same size. Coordinates are int64 where all of them are multiples of
2^-16 px and edge functions fit, otherwise float64: signs in doubt are decided again in fractions. They are
Python integers where centres of pixels are no float64. `topleft.methods.reference` tests a sample at a time in
fractions; tests compare the two modules.

Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988;
J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997;
R. Levien, font-rs, 2015 (an edge adds the area to the right of it).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft.methods import reference

Array = NDArray[Any]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Point = tuple[int, int]
Block = tuple[Array, I64, I64, int, int]  # triangles, first row and column of each box, rows and columns of a box

BLOCK_SAMPLES = 2**18  # at a time: they fit in the L2 cache
SIDES = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64])  # of boxes of a block
INT64_LIMIT = 2**29  # of coordinates from the first sample: products of two differences stay below 2^60
CENTER_LIMIT = 2**48  # sixteenths of a pixel are float64 below
ERROR_BOUND = (3 + 16 * 2.0**-53) * 2.0**-53  # Shewchuk's A: the greatest error in float64, of the sum of the products
DEPTH_ERROR = 2.0**-46  # the greatest error of a depth in float64, of the largest |z|, by exact edge functions
NOTHING = np.iinfo(np.int64).max


# ---- vertices -------------------------------------------------------------------------------------------------------


def snapped(vertices: Any, snap: int | str = 8) -> F64:
    """Return vertices (V, 2 or 3) after a snap of x and y to 2**-snap pixels, ties to even; depth does not change.

    Or to "px", the middle of their pixel by truncation, to "float32", or "exact": unchanged.
    """
    points: F64 = np.array(vertices, np.float64)
    xy = points[:, :2]
    if snap == "px":
        # From 2^52 px on there is no float64 between pixels: half a pixel more is the next even number, or none.
        points[:, :2] = np.trunc(xy) + 0.5
    elif snap == "float32":
        points[:, :2] = xy.astype(np.float32)
    elif snap != "exact":
        points[:, :2] = np.rint(xy * 2.0 ** int(snap)) * 2.0 ** -int(snap)
    return points


def projected(vertices: Any, viewport: Point, snap: int | str = 8, transform: Any = None) -> F64:
    """Return vertices of clip space, or of object space with a transform, as pixels and depth after a snap.

    Each operation rounds as the rules say; all vertices lie inside the clip planes.
    """
    points = np.asarray(vertices)
    if transform is not None:
        m, (x, y, z) = np.asarray(transform, points.dtype), points.T
        points = np.stack([((m[k, 0] * x + m[k, 1] * y) + m[k, 2] * z) + m[k, 3] for k in range(4)], -1)
    x, y, z, w = points.astype(np.float64).T
    if not ((w > 0) & (abs(z) <= w)).all():
        raise ValueError("vertices must lie inside the clip planes")
    x_px, y_px = (x / w + 1) * (viewport[0] / 2), (1 - y / w) * (viewport[1] / 2)
    return snapped(np.stack([x_px, y_px, (z / w + 1) * 0.5], -1), snap)


def turns(corners: Array) -> NDArray[np.int8]:
    """Return how triangles (T, 3, 2) turn, the sign of their area: 1 clockwise as seen (y down), 0 without an area."""
    a, b, c = corners.swapaxes(0, 1)
    return np.asarray(np.sign(side(a, b, c[:, 0], c[:, 1])), np.int8)


# ---- edges ----------------------------------------------------------------------------------------------------------


def terms(p: Array, q: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Return the two terms of the edge functions of p to q, (n, 2), at x and y, (n, ...): their difference is E."""
    far = (slice(None), *[None] * (x.ndim - 1))
    px, py, dx, dy = (a[far] for a in (p[:, 0], p[:, 1], q[:, 0] - p[:, 0], q[:, 1] - p[:, 1]))
    return dx * (y - py), dy * (x - px)


def side(p: Array, q: Array, x: Array, y: Array) -> Array:
    """Return numbers of the signs of the edge functions of p to q, (n, 2), at x and y, (n, ...): no sign is wrong."""
    with np.errstate(over="ignore", invalid="ignore"):
        down, right = terms(p, q, x, y)
        value = down - right
        if value.dtype != np.float64:
            return np.asarray(value)
        bound = ERROR_BOUND * (abs(down) + abs(right)) + np.finfo(np.float64).tiny
        sign = (value > bound).astype(np.int8) - (value < -bound)
        doubted = np.argwhere(~(abs(value) > bound))
    x, y = np.broadcast_arrays(x, y)
    for i, *rest in doubted.tolist():
        at = Fraction(float(x[i, *rest])), Fraction(float(y[i, *rest]))
        start, end = ([Fraction(v) for v in corner] for corner in (p[i].tolist(), q[i].tolist()))
        exact = reference.edge_function(start, end, at)
        sign[i, *rest] = (exact > 0) - (exact < 0)
    return sign


class ExactPicture:
    """The samples of a window: a sample for each pixel, in sixteenths of a pixel from its centre.

    Parameters
    ----------
    vertices : array_like, shape (V, 2) or (V, 3)
        In pixels, with depth.
    triangles : array_like, shape (T, 3)
    size, origin, sample : (int, int)
    depth_tests : tuple of "less", "greater" or None
        The keys of `ids`; None: the last triangle is visible.
    cull : {"none", "back", "front"}
    rule : {"top-left", "bottom-right"}
        Which edges include the samples on them.

    Attributes
    ----------
    count : ndarray of int32, shape (H, W)
        How many triangles cover the sample.
    ids : dict of ndarray of int32, shape (H, W)
        The visible triangle by each depth test, -1 for none; of equal depths in float32 the lowest.
    """

    def __init__(
        self, vertices: Any, triangles: Any, size: Point, *, origin: Point = (0, 0), sample: Point = (0, 0),
        depth_tests: tuple[str | None, ...] = (None,), cull: str = "none", rule: str = "top-left",
    ) -> None:  # fmt: skip
        corners = np.asarray(vertices, np.float64)[np.asarray(triangles).reshape(-1, 3)]
        self.size, self.rule = size, rule
        self.z = corners[..., 2] if corners.shape[2] > 2 else np.zeros(corners.shape[:2])
        self.xy, self.first, self.step = in_units(corners[..., :2], origin, sample)
        turn = turns(self.xy)
        for numbers in (self.xy, self.z):  # now edge functions are positive inside
            numbers[turn < 0] = numbers[turn < 0][:, [0, 2, 1]]
        self.count: I32 = np.zeros(size[::-1], np.int32)
        self.ids: dict[str | None, I32] = {}
        keys = {test: np.full(size[::-1], NOTHING) for test in depth_tests}
        drawn = (turn != 0) & (turn != {"none": 0, "back": 1, "front": -1}[cull])
        for block in self.blocks(np.flatnonzero(drawn)):
            self._draw(block, keys)
        for test, key in keys.items():
            ids = -key if test is None else key & 0xFFFFFFFF
            self.ids[test] = np.where(key == NOTHING, -1, ids).astype(np.int32)

    @property
    def triangle(self) -> I32:
        """The visible triangle by the first depth test."""
        return next(iter(self.ids.values()))

    @cached_property
    def is_edge(self) -> NDArray[np.bool_]:
        """Whether an edge of a triangle, culled or not, meets the pixel's square, its border included: (H, W)."""
        met, half = np.zeros(self.size[::-1], bool), self.step / 2 if self.step == 1 else self.step // 2
        for block in self.blocks(np.arange(len(self.xy)), half):
            i, rows, cols = self._places(block)
            x, y = self._samples(rows, cols)
            for p, q in self._edges(i):
                is_met = y + half >= np.minimum(p[:, 1], q[:, 1])[:, None, None]
                is_met = is_met & (y - half <= np.maximum(p[:, 1], q[:, 1])[:, None, None])
                is_met = is_met & (x + half >= np.minimum(p[:, 0], q[:, 0])[:, None, None])
                is_met = is_met & (x - half <= np.maximum(p[:, 0], q[:, 0])[:, None, None])
                # Edge functions grow to the right where the edge goes up, and down where it goes to the right.
                grow_x, grow_y = (half * np.sign(d)[:, None, None] for d in (p[:, 1] - q[:, 1], q[:, 0] - p[:, 0]))
                is_met &= (side(p, q, x + grow_x, y + grow_y) >= 0) & (side(p, q, x - grow_x, y - grow_y) <= 0)
                k, row, col = np.nonzero(is_met)
                row, col = rows[k, row, 0], cols[k, 0, col]
                is_seen = (row < self.size[1]) & (col < self.size[0])
                met[row[is_seen], col[is_seen]] = True
        return met

    def depth(self, ids: I32) -> tuple[F64, F64]:
        """Return the depth of the triangles `ids` at their samples, NaN for -1; and the largest |z| of each."""
        row, col = np.nonzero(ids >= 0)
        i = ids[row, col]
        depth, largest = np.full(ids.shape, np.nan), np.full(ids.shape, np.nan)
        depth[row, col], largest[row, col] = self._depth(i, row, col), abs(self.z[i]).max(1)
        return depth, largest

    def blocks(self, chosen: Array, reach: Any = 0) -> Iterator[Block]:
        """Yield triangles in blocks; boxes hold the samples within `reach` of the triangle, or a few more."""
        if not len(chosen):
            return
        slack = self.step if self.xy.dtype == np.float64 else 0
        low = -((self.first + reach + slack - self.xy[chosen].min(1)) // self.step)
        high = (self.xy[chosen].max(1) + reach + slack - self.first) // self.step + 1
        limits = np.array(self.size)
        low, high = (np.minimum(np.maximum(a, 0), limits).astype(np.int64) for a in (low, high))
        cols, rows = (high - low).T
        is_seen = (cols > 0) & (rows > 0)
        is_small = is_seen & (cols <= SIDES[-1]) & (rows <= SIDES[-1])
        ceiling = SIDES[np.searchsorted(SIDES, np.where(is_small[:, None], high - low, 1))]
        for n_cols, n_rows in np.unique(ceiling[is_small], axis=0).tolist():
            alike = np.flatnonzero(is_small & (ceiling == (n_cols, n_rows)).all(1))
            n = max(1, BLOCK_SAMPLES // (n_cols * n_rows))
            for some in np.split(alike, range(n, len(alike), n)):
                yield chosen[some], low[some, 1], low[some, 0], n_rows, n_cols
        for k in np.flatnonzero(is_seen & ~is_small):
            n_rows = max(1, BLOCK_SAMPLES // int(cols[k]))
            for row in range(int(low[k, 1]), int(high[k, 1]), n_rows):
                n = min(n_rows, int(high[k, 1]) - row)
                yield chosen[k : k + 1], np.array([row]), low[k : k + 1, 0], n, int(cols[k])

    def _places(self, block: Block) -> tuple[Array, I64, I64]:
        """Return the triangles of a block, and rows (n, n_rows, 1) and columns (n, 1, n_cols) of their boxes."""
        i, row, col, n_rows, n_cols = block
        return i, (row[:, None] + np.arange(n_rows))[:, :, None], (col[:, None] + np.arange(n_cols))[:, None, :]

    def _samples(self, rows: I64, cols: I64) -> tuple[Array, Array]:
        """Return x and y of samples in units."""
        x, y = (
            at.astype(self.first.dtype) * self.step + first for at, first in zip((cols, rows), self.first, strict=True)
        )
        return x, y

    def _edges(self, i: Array) -> Iterator[tuple[Array, Array]]:
        for k in range(3):
            yield self.xy[i, k], self.xy[i, (k + 1) % 3]

    def _draw(self, block: Block, keys: dict[str | None, I64]) -> None:
        i, rows, cols = self._places(block)
        inside = (rows < self.size[1]) & (cols < self.size[0])
        x, y = self._samples(rows, cols)
        for p, q in self._edges(i):
            is_owner = (q[:, 1] < p[:, 1]) | ((q[:, 1] == p[:, 1]) & (q[:, 0] > p[:, 0]))
            is_other = (is_owner != (self.rule == "top-left")).astype(np.int8)[:, None, None]
            if self.xy.dtype == np.float64:
                inside &= side(p, q, x, y) >= is_other
            else:
                down, right = terms(p, q, x, y)
                inside &= (down >= right + is_other).astype(bool, copy=False)
        if len(i) == 1 and (self.z[i] == self.z[i, :1]).all():  # one depth: no list of samples
            box = slice(rows[0, 0, 0], rows[0, -1, 0] + 1), slice(cols[0, 0, 0], cols[0, 0, -1] + 1)
            inside = inside[0, : self.size[1] - box[0].start, : self.size[0] - box[1].start]
            self.count[box] += inside
            for test, key in keys.items():
                one = sort_key(test, self.z[i, 0].astype(np.float32), i)
                np.copyto(key[box], one, where=inside & (one < key[box]))
            return
        k, row, col = np.nonzero(inside)
        row, col, i = rows[k, row, 0], cols[k, 0, col], i[k]
        pixel = row * self.size[0] + col
        np.add.at(self.count.reshape(-1), pixel, 1)
        depth = None if set(keys) <= {None} else self._buffer_depth(i, row, col)
        for test, key in keys.items():
            np.minimum.at(key.reshape(-1), pixel, sort_key(test, depth, i))

    def _depth(self, i: Array, row: Array, col: Array) -> F64:
        """Return the depth of triangles at samples, by exact edge functions in float64, or by fractions."""
        if self.xy.dtype != np.int64:
            return np.array([float(self._exact_depth(*place)) for place in zip(i, row, col, strict=True)], np.float64)
        x, y = self._samples(row, col)
        e2, e0, e1 = (side(p, q, x, y) for p, q in self._edges(i))
        z0, z1, z2 = self.z[i].T
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(z0 + (e1 * (z1 - z0) + e2 * (z2 - z0)) / (e0 + e1 + e2))

    def _buffer_depth(self, i: Array, row: Array, col: Array) -> NDArray[np.float32]:
        """Return depths as a buffer holds them: rounded to float32, from fractions where float64 leaves a doubt."""
        level = (self.z[i] == self.z[i, :1]).all(1)
        if level.all():
            return self.z[i, 0].astype(np.float32)
        if self.xy.dtype == np.int64:
            depth = np.where(level, self.z[i, 0], self._depth(i, row, col))
            error = np.where(level, 0, DEPTH_ERROR * abs(self.z[i]).max(1))
            low, high = (depth - error).astype(np.float32), (depth + error).astype(np.float32)
        else:
            low, high = np.zeros(len(i), np.float32), np.ones(len(i), np.float32)
        for k in np.flatnonzero(~(low == high)):
            low[k] = reference.round_to_float32(self._exact_depth(i[k], row[k], col[k]))
        return low

    def _exact_depth(self, i: int, row: int, col: int) -> Fraction:
        first = map(Fraction, self.first.tolist())
        x, y = (start + int(at) * self.step for start, at in zip(first, (col, row), strict=True))
        a, b, c = ([Fraction(v) for v in p] for p in self.xy[i].tolist())
        weights = [reference.edge_function(p, q, (x, y)) for p, q in ((b, c), (c, a), (a, b))]
        return sum(w * Fraction(z) for w, z in zip(weights, self.z[i].tolist(), strict=True)) / sum(weights)


def in_units(corners: F64, origin: Point, sample: Point) -> tuple[Array, Array, int]:
    """Return corners, the first sample and the step between samples, as numbers in which edges are exact or sure."""
    first = [16 * o + 8 + s for o, s in zip(origin, sample, strict=True)]  # in sixteenths of a pixel
    largest = abs(corners).max(initial=0)
    for bits in (4, 8, 16):
        if (largest + max(map(abs, first))) * 2.0**bits < 2**52:
            units = np.rint(corners * 2.0**bits)
            shifted = units.astype(np.int64) - [n << (bits - 4) for n in first]
            if (units == corners * 2.0**bits).all() and abs(shifted).max(initial=0) < INT64_LIMIT:
                return shifted, np.zeros(2, np.int64), 1 << bits
    if max(map(abs, origin)) < CENTER_LIMIT:
        return corners, np.array(first) / 16, 1
    ratios = [[x.as_integer_ratio() for x in row] for row in corners.reshape(-1, 2).tolist()]
    unit = max([16, *(denominator for row in ratios for _, denominator in row)])
    whole = np.array([[n * (unit // d) for n, d in row] for row in ratios], object).reshape(corners.shape)
    return whole, np.array([n * (unit // 16) for n in first], object), unit


def sort_key(test: str | None, depth: NDArray[np.float32] | None, ids: Array) -> I64:
    """Return a number that is least for the triangle that wins: by depth, then by id; without a test the last."""
    if test is None or depth is None:
        return np.asarray(-ids)
    nearer = (depth if test == "less" else -depth) + np.float32(0)  # -0 and 0 are equal
    bits = nearer.view(np.int32)
    ordered = np.where(bits < 0, bits ^ 0x7FFFFFFF, bits).astype(np.int64)
    return np.asarray(ordered << 32 | ids)


# ---- areas ----------------------------------------------------------------------------------------------------------


def areas(vertices: Any, triangles: Any, size: Point) -> F64:
    """Return the area of triangles in each pixel, added up, (H, W); rounding stays below 1e-9 of a pixel."""
    picture = ExactPicture(vertices, triangles, size, depth_tests=())
    corners = np.asarray(vertices, np.float64)[np.asarray(triangles), :2]
    total: F64 = np.zeros(size[::-1])
    for block in picture.blocks(np.arange(len(corners)), picture.step):
        i, rows, cols = picture._places(block)
        signed: Any = sum(area_to_the_right(corners[i, k - 1], corners[i, k], cols, rows) for k in range(3))
        area, row, col = np.broadcast_arrays(abs(signed), rows, cols)
        is_seen = (row < size[1]) & (col < size[0])
        np.add.at(total, (row[is_seen], col[is_seen]), area[is_seen])
    return total


def area_to_the_right(p: F64, q: F64, column: Array, row: Array) -> F64:
    """Return the area of each pixel to the right of its edge, negative where the edge runs up.

    That is the height of the edge in the row times the mean share of the pixel's width to its right, a ramp
    from 0 to 1 along the edge.
    """
    (px, py), (qx, qy) = (end.T[:, :, None, None] for end in (p, q))
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.where(py == qy, 0.0, (qx - px) / (qy - py))
    y0, y1 = np.clip(py, row, row + 1), np.clip(qy, row, row + 1)
    left, right = np.minimum(px, qx), np.maximum(px, qx)
    u0, u1 = (column + 1 - np.clip(np.where(y == qy, qx, px + slope * (y - py)), left, right) for y in (y0, y1))
    low, high = np.minimum(u0, u1), np.maximum(u0, u1)
    low_in, high_in = np.clip(low, 0, 1), np.clip(high, 0, 1)
    spread = np.where(high > low, high - low, 1)
    mean = ((high_in - low_in) * (high_in + low_in) / 2 + np.maximum(high - np.maximum(low, 1), 0)) / spread
    return np.asarray((y1 - y0) * np.where(high > low, mean, low_in))
