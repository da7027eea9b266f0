"""The exact reference of the other kinds of sampling: several samples a pixel, and conservative coverage.

In: scenes, as in `reference`.  Out: the exact value of each sample, or pixel square.  Integers only: samples
count in sixteenths of a sub-pixel, squares in sub-pixels, and with vertices that are not snapped in a power of two
that divides all corners of a triangle.

Based on: Microsoft, Direct3D 11.3 Functional Specification, 2015 (standard sample patterns);
S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: A Hierarchical Structure for Rapid Interference Detection, 1996
(separating axes); J. Hasselgren, T. Akenine-Möller, L. Ohlsson, Conservative Rasterization, GPU Gems 2, 2005.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.methods import reference
from topleft.methods.reference import Piece, Point

# From the centre of the pixel, x right and y down, in sixteenths of a pixel.
SAMPLE_POSITIONS: dict[int, tuple[Point, ...]] = {
    1: ((0, 0),),
    2: ((4, 4), (-4, -4)),
    4: ((-2, -6), (6, -2), (-6, 2), (2, 6)),
    8: ((1, -3), (-1, 3), (5, 1), (-3, -5), (-5, 5), (-7, -1), (3, 7), (7, -7)),
    16: (
        (1, 1), (-1, -3), (-3, 2), (4, -1), (-5, -2), (2, 5), (5, 3), (3, -5),
        (-2, 6), (0, -7), (-4, -6), (-6, 4), (-8, 0), (7, -4), (6, 7), (-7, -8),
    ),
}  # fmt: skip


# ---- several samples a pixel ----------------------------------------------------------------------------------------


def sample_coverage(vertices: Any, triangles: Any, size: Point, n_samples: int, **view: Any) -> np.ndarray:
    """Return which samples are covered: bool, shape (H, W, S).

    Examples
    --------
    >>> sample_coverage([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], (2, 1), 4).astype(int)
    array([[[1, 1, 1, 1],
            [1, 0, 1, 0]]])
    """
    return _stack(reference.coverage, vertices, triangles, size, n_samples, **view)


def sample_ids(vertices: Any, triangles: Any, size: Point, n_samples: int, **options: Any) -> np.ndarray:
    """Return which triangle each sample sees: int32, shape (H, W, S), -1 for none; options of `reference.visible`."""
    return _stack(reference.ids, vertices, triangles, size, n_samples, **options)


def sample_depth(vertices: Any, triangles: Any, size: Point, n_samples: int, **options: Any) -> np.ndarray:
    """Return the depth at each sample: Fraction, shape (H, W, S), None for nothing."""
    return _stack(reference.depth, vertices, triangles, size, n_samples, **options)


def _stack(verb: Callable[..., np.ndarray], *scene: Any, **options: Any) -> np.ndarray:
    *arrays, n_samples = scene
    return np.stack([verb(*arrays, sample=at, **options) for at in SAMPLE_POSITIONS[n_samples]], axis=-1)


# ---- conservative coverage ------------------------------------------------------------------------------------------


def outer(vertices: Any, triangles: Any, size: Point, **view: Any) -> np.ndarray:
    """Return which pixel squares a triangle meets in positive area: bool, shape (H, W).

    Examples
    --------
    >>> outer([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], (3, 2)).astype(int)
    array([[1, 1, 0],
           [1, 0, 0]])
    """
    return _conservative(_meets, vertices, triangles, size, **view)


def inner(vertices: Any, triangles: Any, size: Point, **view: Any) -> np.ndarray:
    """Return which pixel squares lie wholly inside a single triangle, its border included: bool, shape (H, W).

    Each piece of a triangle that a clip plane cuts counts as a triangle.

    Examples
    --------
    >>> inner([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], (3, 2)).astype(int)
    array([[1, 0, 0],
           [0, 0, 0]])
    """
    return _conservative(_holds, vertices, triangles, size, **view)


def _conservative(
    test: Callable[[list[Point], list[Point]], bool], vertices: Any, triangles: Any, size: Point, *,
    origin: Point = (0, 0), **view: Any,
) -> np.ndarray:  # fmt: skip
    bits = view.get("subpixel_bits", 8)
    is_exact = bits == "exact"
    picture = np.zeros((size[1], size[0]), bool)
    for piece in reference.pieces(vertices, triangles, size, **view):
        unit = piece.denominator() if is_exact else 1 << bits
        corners = [(int(x * unit), int(y * unit)) if is_exact else (x, y) for x, y in _turned(piece)]
        for row, column in product(*reference.touched_pixels(piece, size, origin, 0 if is_exact else bits)):
            if not picture[row, column]:
                x, y = (column + origin[0]) * unit, (row + origin[1]) * unit
                far_x, far_y = x + unit, y + unit
                picture[row, column] = test(corners, [(x, y), (far_x, y), (far_x, far_y), (x, far_y)])
    return picture


def _turned(piece: Piece) -> list[Point]:
    """Return the corners in the order in which their signed area is positive."""
    a, b, c = (v.xy_fx for v in piece.vertices)
    return [a, b, c] if reference.edge_function(a, b, c) > 0 else [a, c, b]


def _meets(triangle: list[Point], square: list[Point]) -> bool:
    """Return whether the interiors meet: no edge of either has the other wholly outside or on its line."""
    return not any(
        all(reference.edge_function(a, b, p) <= 0 for p in other)
        for polygon, other in ((triangle, square), (square, triangle))
        for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True)
    )


def _holds(triangle: list[Point], square: list[Point]) -> bool:
    """Return whether every corner of the square is inside or on every edge."""
    edges = zip(triangle, triangle[1:] + triangle[:1], strict=True)
    return all(reference.edge_function(a, b, p) >= 0 for a, b in edges for p in square)


def mean(
    samples: npt.NDArray[Any],
    *,
    is_straight: bool,
    tables: tuple[npt.NDArray[np.int32], npt.NDArray[np.uint8]] | None = None,
) -> list[float]:
    """Return the mean of the colours (S, C) of a pixel's samples, of uint8 rounded to nearest, ties to even.

    `is_straight`: the last of 2 or 4 channels is alpha, and weights the colours. `tables`: from uint8 colours
    to light, and from light to colours.

    Examples
    --------
    >>> mean(np.array([[255, 255], [9, 0]], np.uint8), is_straight=True)
    [255, 128]
    """
    n_colors = samples.shape[1] - (samples.shape[1] in (2, 4))
    number: Callable[[Any], Any] = Fraction if samples.dtype.kind == "f" else int
    alpha = [number(a) for a in samples[:, -1].tolist()]
    is_weighted = is_straight and len(set(alpha)) > 1 and sum(alpha) != 0
    channels: list[float] = []
    for c, values in enumerate(samples.T):
        weights = alpha if is_weighted and c < n_colors else [1] * len(samples)
        light = tables[0][values] if tables and c < n_colors else values
        total = sum(w * number(v) for w, v in zip(weights, light.tolist(), strict=True))
        exact = Fraction(total) / sum(weights)
        if samples.dtype != np.uint8:
            channels.append(float(exact))
        else:
            channels.append(int(tables[1][round(exact)]) if tables and c < n_colors else round(exact))
    return channels
