"""The exact reference: the rules of the picture in Python integers and fractions, slow and obviously right.

In: vertices, triangles and options, as in the public calls, assumed valid.  Out: the exact value of each pixel.
Each pixel centre in the bounding box of each triangle is tested alone: three edge functions in integers, then the fill
rule.  After the snap nothing is rounded: depths, weights and attributes are fractions.  Vertices that are not snapped
(``subpixel_bits="exact"``) are float64 numbers as fractions.  Before the snap, clip space is float64 arithmetic in the
order that the rules state; Python's floats are IEEE doubles, so the results are equal to the bit.

Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (edge functions);
Microsoft, Direct3D 11.3 Functional Specification, 2015 (top-left rule);
I. E. Sutherland, G. W. Hodgman, Reentrant Polygon Clipping, 1974, and J. F. Blinn, M. E. Newell, Clipping Using
Homogeneous Coordinates, 1978 (clip before the divide);
P. S. Heckbert, H. P. Moreton, Interpolation for Polygon Texture Mapping and Shading, 1991 (perspective weights).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from functools import cache
from math import inf
from typing import Any, NamedTuple

import numpy as np

W_MIN = 2.0**-500  # the smallest w that is projected: 1/w stays far from overflow
PASSING_W = 2.0**-24  # without a near plane edges that pass the eye are cut at this share of w of the end in front
GUARD_FX = 2.0**60  # sub-pixels from the middle of the picture: inside, every projected vertex has a fixed-point form
FLOAT32_MAX = 2.0**128 - 2.0**104

Point = tuple[int, int]
Coordinate = Any  # int, or Fraction where nothing is snapped
Position = tuple[float, ...]  # in clip space: x, y, z, w and the weights b0, b1, b2 in the input triangle


class Vertex(NamedTuple):
    """A snapped vertex: fixed point (pixels where nothing is snapped), depth, w, its weights in the input triangle."""

    xy_fx: tuple[Coordinate, Coordinate]
    z: float
    w: float
    weights: Position


class Piece(NamedTuple):
    """A triangle that is drawn: an input triangle (its index in `triangle`), or a piece of it after clipping."""

    triangle: int
    vertices: tuple[Vertex, Vertex, Vertex]

    def denominator(self) -> int:
        """Return the power of two that makes all coordinates integers when they are multiplied by it."""
        return max(v.denominator for vertex in self.vertices for v in vertex.xy_fx)


class Fragment(NamedTuple):
    """A covered sample: pixel of the window, piece, and the edge functions opposite the vertices (their sum is > 0)."""

    row: int
    column: int
    piece: Piece
    edges: tuple[int, int, int]

    def depth(self) -> Fraction:
        """Return the depth of the plane through the snapped vertices."""
        return _dot(self.edges, [v.z for v in self.piece.vertices]) / sum(self.edges)

    def screen_weights(self) -> list[Fraction]:
        """Return the weights of the input triangle's vertices, linear on the screen: in proportion to E."""
        return self._weights_in_triangle([Fraction(e) for e in self.edges])

    def weights(self) -> list[Fraction]:
        """Return the weights of the input triangle's vertices, perspective-correct: in proportion to E/w."""
        inv_w = [1 / Fraction(v.w) for v in self.piece.vertices]
        return self._weights_in_triangle([e * q for e, q in zip(self.edges, inv_w, strict=True)])

    def _weights_in_triangle(self, shares: list[Fraction]) -> list[Fraction]:
        mixed = [_dot(shares, [v.weights[k] for v in self.piece.vertices]) for k in range(3)]
        total = sum(shares)
        return [m / total for m in mixed]


# ---- vertices -------------------------------------------------------------------------------------------------------


def snap(vertices: Any, subpixel_bits: int | str = 8) -> list[tuple[Coordinate, Coordinate]]:
    """Return ``(x_fx, y_fx)`` of pixel-space vertices ``(V, 2)`` or ``(V, 3)``, rounded to nearest, ties to even.

    Pixels as they are, as fractions, with "exact".

    Examples
    --------
    >>> snap([[0.5, 1.5], [-0.5, 2.25]], subpixel_bits=0)
    [(0, 2), (0, 2)]
    """
    if subpixel_bits == "exact":
        return [(Fraction(p[0]), Fraction(p[1])) for p in np.asarray(vertices).tolist()]
    scale = 2 ** int(subpixel_bits)
    return [(round(Fraction(p[0]) * scale), round(Fraction(p[1]) * scale)) for p in np.asarray(vertices).tolist()]


@cache
def power_of_two(exponent: int) -> Fraction:
    """Return 2**exponent."""
    return Fraction(2) ** exponent


def round_to_float32(value: Fraction) -> float:
    """Return the float32 nearest to an exact value, ties to even (infinity beyond the largest finite float32).

    Examples
    --------
    >>> round_to_float32(Fraction(2**24 + 1)) == 2**24, round_to_float32(Fraction(2**24 + 3)) == 2**24 + 4
    (True, True)
    """
    magnitude = abs(value)
    exponent = magnitude.numerator.bit_length() - magnitude.denominator.bit_length()
    if magnitude < power_of_two(exponent):
        exponent -= 1  # now 2**exponent <= magnitude < 2**(exponent + 1)
    ulp = power_of_two(max(exponent, -126) - 23)
    nearest = round(value / ulp) * ulp
    if abs(nearest) > FLOAT32_MAX:
        return inf if value > 0 else -inf
    return float(nearest)


def transform_to_clip(vertices: Any, matrix: Any) -> list[list[float]]:
    """Return clip space from object space: ``((m0*x + m1*y) + m2*z) + m3`` with each row of ``matrix``.

    ``vertices`` ``(V, 3)`` of float32 are transformed in float32, all others in float64; each operation rounds once.
    """
    points = np.asarray(vertices)
    rounded: Callable[[Fraction], float] = round_to_float32 if points.dtype == np.float32 else float
    rows = [[rounded(Fraction(m)) for m in row] for row in np.asarray(matrix).tolist()]

    def component(row: list[float], point: list[float]) -> float:
        x, y, z = (rounded(Fraction(m) * Fraction(p)) for m, p in zip(row[:3], point, strict=True))
        xy = rounded(Fraction(x) + Fraction(y))
        xyz = rounded(Fraction(xy) + Fraction(z))
        return rounded(Fraction(xyz) + Fraction(row[3]))

    return [[component(row, point) for row in rows] for point in points.tolist()]


# ---- clip space -----------------------------------------------------------------------------------------------------


class Projection(NamedTuple):
    """From clip space to snapped vertices."""

    half_px: tuple[float, float]  # half the size of the whole picture
    subpixel_bits: int | str
    zero_to_one: bool
    near_clip: bool
    far_clip: bool

    def distances(self, p: Position) -> list[float]:
        """Return signed distances from the planes w, near, far, -x, +x, -y, +y; inside is >= 0."""
        x, y, z, w = p[:4]
        x_guard, y_guard = (GUARD_FX / 2.0 ** grid_bits(self.subpixel_bits) / half for half in self.half_px)
        near = z if self.zero_to_one else z + w
        return [
            w - W_MIN, near if self.near_clip else 0.0, w - z if self.far_clip else 0.0,
            x_guard * w + x, x_guard * w - x, y_guard * w + y, y_guard * w - y,
        ]  # fmt: skip

    def clip(self, polygon: list[Position]) -> list[Position]:
        """Return a triangle clipped by Sutherland and Hodgman's walk; only planes that it crosses cut."""
        outside = [[d < 0 for d in plane] for plane in zip(*map(self.distances, polygon), strict=True)]
        if any(all(plane) for plane in outside):
            return []
        for k in (k for k, plane in enumerate(outside) if any(plane)):
            walked = []
            for here, there in zip(polygon, polygon[1:] + polygon[:1], strict=True):
                d_here, d_there = self.distances(here)[k], self.distances(there)[k]
                if d_here >= 0:
                    walked.append(here)
                if d_here >= 0 > d_there:
                    walked.append(self.cut(here, there, k))
                elif d_there >= 0 > d_here:
                    walked.append(self.cut(there, here, k))
            polygon = walked
        return polygon

    def cut(self, a: Position, b: Position, k: int) -> Position:
        """Return the cut by plane k between inside end a and outside end b, equal for all triangles of the edge.

        The coordinate that the plane fixes is set to its value, which rounding may have missed.
        """
        least_w = W_MIN if self.near_clip else max(W_MIN, a[3] * PASSING_W)
        da, db = (end[3] - least_w if k == 0 else self.distances(end)[k] for end in (a, b))
        of_a, of_b = -db / (da - db), da / (da - db)
        x, y, z, w, *weights = (p * of_a + q * of_b for p, q in zip(a, b, strict=True))
        x_guard, y_guard = (GUARD_FX / 2.0 ** grid_bits(self.subpixel_bits) / half for half in self.half_px)
        fixed = (
            (x, y, z, least_w), (x, y, 0.0 if self.zero_to_one else -w, w), (x, y, w, w),
            (-(x_guard * w), y, z, w), (x_guard * w, y, z, w), (x, -(y_guard * w), z, w), (x, y_guard * w, z, w),
        )  # fmt: skip
        return (*fixed[k], *weights)

    def vertex(self, p: Position) -> Vertex | None:
        """Divide by w, apply the viewport, snap; None when a cut has lost its digits and left the fixed-point range."""
        x, y, z, w = p[:4]
        if not w >= W_MIN / 2:
            return None
        z_px = z / w if self.zero_to_one else (z / w + 1.0) / 2.0
        z_px = max(z_px, 0.0 if self.near_clip else -FLOAT32_MAX)
        z_px = min(z_px, 1.0 if self.far_clip else FLOAT32_MAX)
        x_px, y_px = (x / w + 1.0) * self.half_px[0], (1.0 - y / w) * self.half_px[1]
        farthest = inf if self.subpixel_bits == "exact" else 2.0 ** (62 - grid_bits(self.subpixel_bits))
        if not max(abs(x_px), abs(y_px)) < farthest:
            return None
        return Vertex(snap([(x_px, y_px)], self.subpixel_bits)[0], z_px, w, p[4:])


def grid_bits(subpixel_bits: int | str) -> int:
    """Return the sub-pixel bits that bound how far a vertex may lie: for "exact" the default bits."""
    return 8 if subpixel_bits == "exact" else int(subpixel_bits)


def _clip_turn(a: Position, b: Position, c: Position) -> int:
    """Return how a triangle turns as drawn (y down): the sign of its homogeneous determinant, in float64."""
    det = (a[0] * (b[1] * c[3] - b[3] * c[1]) - a[1] * (b[0] * c[3] - b[3] * c[0])) + a[3] * (b[0] * c[1] - b[1] * c[0])
    return (det < 0) - (det > 0)


def _fan(polygon: list[Vertex], source_turn: int = 0) -> list[tuple[Vertex, Vertex, Vertex]]:
    """Return the polygon as a fan of triangles, from the first apex where the snap has turned none of them over.

    Without such an apex (corners that lie next to each other have changed places): from the apex with the least area
    turned over, without the triangles that turn against the source triangle.
    """
    n = len(polygon)
    fans = [[(polygon[k], polygon[(k + i) % n], polygon[(k + i + 1) % n]) for i in range(1, n - 1)] for k in range(n)]
    for fan in fans:
        areas = [_signed_area(t) for t in fan]
        if min(areas) >= 0 or max(areas) <= 0:
            return fan
        source_turn = source_turn or (1 if sum(areas) >= 0 else -1)
    if not fans:
        return []
    best = min(fans, key=lambda fan: sum(max(0, -_signed_area(t) * source_turn) for t in fan))
    return [t for t in best if _signed_area(t) * source_turn > 0]


# ---- triangles ------------------------------------------------------------------------------------------------------


def pieces(
    vertices: Any, triangles: Any, size: Point, *, transform: Any = None, viewport: Point | None = None,
    subpixel_bits: int | str = 8, cull: str = "none", clip_depth: str = "minus_one_to_one", near_clip: bool = True,
    far_clip: bool = True,
) -> list[Piece]:  # fmt: skip
    """Return the snapped triangles that are drawn, in drawing order, without degenerate and culled triangles.

    Parameters
    ----------
    vertices : array_like, shape (V, 2), (V, 3) or (V, 4)
        Pixels, pixels with depth, or clip space; with ``transform``, ``(V, 3)`` is object space.
    triangles : array_like, shape (T, 3), integers
    size, transform, viewport, subpixel_bits, cull, clip_depth, near_clip, far_clip
        As in `topleft.coverage`.

    Returns
    -------
    list of Piece
    """
    points = np.asarray(vertices).tolist() if transform is None else transform_to_clip(vertices, transform)
    width, height = viewport or size
    view = Projection((width / 2.0, height / 2.0), subpixel_bits, clip_depth == "zero_to_one", near_clip, far_clip)
    drawn = []
    for index, triangle in enumerate(np.asarray(triangles).tolist()):
        ends = [(points[i], weights) for i, weights in zip(triangle, np.eye(3).tolist(), strict=True)]
        if len(points[triangle[0]]) == 4:
            projected = [view.vertex(p) for p in view.clip([(*map(float, p), *weights) for p, weights in ends])]
            polygon = [v for v in projected if v] if all(projected) else []
        else:
            polygon = [Vertex(snap([p], subpixel_bits)[0], (*p, 0)[2], 1.0, (*weights,)) for p, weights in ends]
        a, b, c = (tuple(p) for p, _ in ends)
        turn = _clip_turn(a, b, c) if len(a) == 4 else 0
        for corners in _fan(polygon, turn):
            area = _signed_area(corners)
            # Counter-clockwise to the eye is a negative area, because y points down.
            if area != 0 and cull != ("back" if area > 0 else "front"):
                drawn.append(Piece(index, corners))
    return drawn


def edge_function(a: Any, b: Any, p: Any) -> Any:
    """Return twice the signed area of a, b, p: positive where p lies inside the edge of a triangle of positive area."""
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


def is_top_left(a: Any, b: Any) -> bool:
    """Return whether an edge from a to b, of a triangle with positive signed area, is top or left."""
    is_top = b[1] == a[1] and b[0] > a[0]  # the edge function grows with y: the interior is below
    is_left = b[1] < a[1]  # the edge function grows with x: the interior is to the right
    return is_top or is_left


def _signed_area(corners: tuple[Vertex, Vertex, Vertex]) -> Coordinate:
    a, b, c = (v.xy_fx for v in corners)
    area: Coordinate = edge_function(a, b, c)  # twice the area
    return area


def fragments(
    vertices: Any, triangles: Any, size: Point, *, origin: Point = (0, 0), sample: Point = (0, 0), **view: Any
) -> Iterator[Fragment]:
    """Yield every covered sample of every piece, in drawing order; parameters as for `pieces`.

    The frame is the window of the whole picture at ``origin``.  Each pixel is sampled at its centre, or ``sample``
    sixteenths of a pixel from it, -8 to 7.  Coordinates are sixteenths of a sub-pixel, so that samples are integers
    even with 0 sub-pixel bits; of vertices that are not snapped, sixteenths of a power of two that divides all
    corners of a piece.
    """
    bits, (x_origin, y_origin) = view.get("subpixel_bits", 8), origin
    is_exact = bits == "exact"
    for piece in pieces(vertices, triangles, size, **view):
        unit = piece.denominator() if is_exact else 1 << bits
        scale = 16 * unit if is_exact else 16
        a, b, c = ((int(scale * v.xy_fx[0]), int(scale * v.xy_fx[1])) for v in piece.vertices)
        if edge_function(a, b, c) > 0:
            edges = [(b, c), (c, a), (a, b)]  # opposite the first, second and third vertex
        else:
            edges = [(c, b), (a, c), (b, a)]
        dy0, dy1, dy2 = (q[1] - p[1] for p, q in edges)
        least = [0 if is_top_left(*edge) else 1 for edge in edges]  # of integers: 1 is more than 0
        rows, columns = touched_pixels(piece, size, origin, 0 if is_exact else bits)
        for row in rows:
            y = (16 * (row + y_origin) + 8 + sample[1]) * unit
            at_0, at_1, at_2 = (edge_function(*edge, (0, y)) for edge in edges)  # at x = 0: each falls by dy a unit
            for column in columns:
                x = (16 * (column + x_origin) + 8 + sample[0]) * unit
                if (
                    (e0 := at_0 - dy0 * x) >= least[0]
                    and (e1 := at_1 - dy1 * x) >= least[1]
                    and (e2 := at_2 - dy2 * x) >= least[2]
                ):
                    yield Fragment(row, column, piece, (e0, e1, e2))


def touched_pixels(piece: Piece, size: Point, origin: Point, bits: int) -> tuple[range, range]:
    """Return the rows and the columns of the window that the bounding box of a piece touches."""
    x_px, y_px = ([v.xy_fx[k] // 2**bits for v in piece.vertices] for k in range(2))
    return (
        range(max(0, min(y_px) - origin[1]), min(size[1], max(y_px) + 1 - origin[1])),
        range(max(0, min(x_px) - origin[0]), min(size[0], max(x_px) + 1 - origin[0])),
    )


# ---- pictures -------------------------------------------------------------------------------------------------------


def coverage(vertices: Any, triangles: Any, size: Point, **view: Any) -> np.ndarray:
    """Return which samples are covered: bool, shape (H, W).

    Examples
    --------
    >>> coverage([[0, 0], [3, 0], [0, 3]], [[0, 1, 2]], (3, 3)).astype(int)
    array([[1, 1, 0],
           [1, 0, 0],
           [0, 0, 0]])
    """
    return overdraw(vertices, triangles, size, **view) > 0


def overdraw(vertices: Any, triangles: Any, size: Point, **view: Any) -> np.ndarray:
    """Return how many triangles cover each sample: int32, shape (H, W)."""
    counts = np.zeros((size[1], size[0]), np.int32)
    for fragment in fragments(vertices, triangles, size, **view):
        counts[fragment.row, fragment.column] += 1
    return counts


def visible(
    vertices: Any, triangles: Any, size: Point, *, depth_test: str | None = "less", **view: Any
) -> dict[Point, Fragment]:
    """Return the fragment that wins each covered pixel, by ``(row, column)``.

    Depths are compared as the buffer holds them, rounded to float32.  A fragment must be nearer than the pixel's depth,
    so the lower triangle index wins a tie.  Without a test, or without depth (``(V, 2)`` vertices), the last wins.
    """
    if np.shape(vertices)[1] == 2:
        depth_test = None
    towards_eye = 1 if depth_test == "greater" else -1
    winners: dict[Point, Fragment] = {}
    nearest: dict[Point, float] = {}
    for fragment in fragments(vertices, triangles, size, **view):
        pixel = (fragment.row, fragment.column)
        nearness = inf if depth_test is None else towards_eye * round_to_float32(fragment.depth())
        if depth_test is None or nearness > nearest.get(pixel, -inf):
            winners[pixel], nearest[pixel] = fragment, nearness
    return winners


def ids(vertices: Any, triangles: Any, size: Point, **options: Any) -> np.ndarray:
    """Return the visible triangle: int32, shape (H, W), -1 where there is none; options as for `visible`."""
    winners = visible(vertices, triangles, size, **options)
    return _picture(size, -1, {p: f.piece.triangle for p, f in winners.items()}).astype(np.int32)


def depth(vertices: Any, triangles: Any, size: Point, **options: Any) -> np.ndarray:
    """Return the depth of each pixel: Fraction, shape (H, W), None where nothing is; options as for `visible`."""
    return _picture(size, None, {p: f.depth() for p, f in visible(vertices, triangles, size, **options).items()})


def barycentric(vertices: Any, triangles: Any, size: Point, **options: Any) -> np.ndarray:
    """Return the weights of the triangle's three vertices: Fraction, shape (H, W, 3), 0 where there is nothing.

    Perspective-correct in clip space; in pixel space every w is 1, and the formula is linear on the screen.
    """
    winners = visible(vertices, triangles, size, **options)
    return _picture(size, [0, 0, 0], {p: f.weights() for p, f in winners.items()})


def interpolate(vertices: Any, triangles: Any, values: Any, size: Point, **options: Any) -> np.ndarray:
    """Return the attributes of each pixel: Fraction, shape (H, W, K), 0 where there is nothing.

    ``values`` has shape (V, K), per vertex, or (T, 3, K), per corner; options as for `visible`.
    """
    values = np.asarray(values)
    corners = (values if values.ndim == 3 else values[np.asarray(triangles)]).tolist()
    winners = visible(vertices, triangles, size, **options)
    seen = _picture(size, [Fraction(0)] * values.shape[-1], {})
    for pixel, fragment in winners.items():
        weights = fragment.weights()
        seen[pixel] = [_dot(weights, v) for v in zip(*corners[fragment.piece.triangle], strict=True)]
    return seen


def fill(
    vertices: Any, triangles: Any, colors: Any, size: Point, *, per: str, background: float = 0, **view: Any
) -> np.ndarray:
    """Return the picture in painter's order, shape (H, W, C): uint8, or Fraction for ``colors`` of a floating type.

    ``colors`` has shape (T, C) with ``per="triangle"``, or (V, C) with ``per="vertex"``: these are linear on the
    screen, and uint8 is rounded to nearest, ties to even.
    """
    colors, triangles = np.asarray(colors), np.asarray(triangles)
    is_float = colors.dtype.kind == "f"
    values = {}
    for pixel, fragment in visible(vertices, triangles, size, depth_test=None, **view).items():
        index = fragment.piece.triangle
        corners = colors[[index] * 3 if per == "triangle" else triangles[index]].tolist()
        weights = fragment.screen_weights()
        mixed = [_dot(weights, channel) for channel in zip(*corners, strict=True)]
        values[pixel] = mixed if is_float else [round(m) for m in mixed]
    picture = _picture(size, [background] * colors.shape[1], values)
    return picture if is_float else picture.astype(np.uint8)


def _dot(weights: Iterable[Fraction | int], values: Iterable[float]) -> Fraction:
    return sum((w * Fraction(v) for w, v in zip(weights, values, strict=True) if v), Fraction(0))


def _picture(size: Point, background: Any, values: dict[Point, Any]) -> np.ndarray:
    picture = np.empty((size[1], size[0], *np.shape(background)), object)
    picture[...] = background
    for pixel, value in values.items():
        picture[pixel] = value
    return picture
