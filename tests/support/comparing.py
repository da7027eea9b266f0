"""Compares the library with the exact reference, pixel by pixel, and counts the pixels compared."""

from collections import defaultdict
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from strategies import Scene

import topleft as tl
from topleft.methods import reference as ref

METHODS = ("edge", "scanline", "auto")
COLOR_SLACK = Fraction(1, 2**49)  # float64 weights of exact edge functions, times the largest value
# Weights come from exact edge functions in a dozen float64 operations on positive numbers: 2**-49 is ample for them,
# and their three products with values and two sums stay below 2**-48 of the largest value.
WEIGHT_SLACK = Fraction(1, 2**48)

n_pixels_compared = 0


def assert_same(got, expected):
    """Check that two pictures are equal to the last bit, dtype and shape included."""
    assert (got.dtype, got.shape) == (expected.dtype, expected.shape)
    if not np.array_equal(got, expected):
        wrong = np.argwhere(got != expected)
        first = tuple(wrong[0])
        raise AssertionError(f"{len(wrong)} pixels differ, first {first}: got {got[first]}, expected {expected[first]}")


def files_of(folder):
    """All files below a folder, with what they hold."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def assert_exact(got, expected):
    """The same, where `expected` comes from the exact reference: counts the pixels."""
    assert_same(got, expected)
    count_pixels(got)


def count_pixels(picture):
    global n_pixels_compared
    n_pixels_compared += picture.shape[0] * picture.shape[1]


def half_ulp(value):
    """Half a unit in the last place of the float32 next to an exact value."""
    magnitude = abs(Fraction(value))
    if magnitude == 0:
        return Fraction(1, 2**150)
    exponent = magnitude.numerator.bit_length() - magnitude.denominator.bit_length()
    exponent -= magnitude < ref.power_of_two(exponent)
    return ref.power_of_two(max(exponent, -126) - 24)


def assert_within(got, exact, slack):
    """`got` is a float32 that differs from an exact value by half a unit in the last place plus `slack`."""
    got = Fraction(float(got))
    allowed = half_ulp(max(abs(got), abs(exact))) + slack
    assert abs(got - exact) <= allowed, (
        f"got {float(got)!r}, expected {float(exact)!r}, off by {float(abs(got - exact))}"
    )


def check_overdraw(scene: Scene):
    expected = ref.overdraw(*scene.arrays, **scene.view)
    for method in METHODS:
        assert_exact(tl.overdraw(*scene.arrays, method=method, **scene.view), expected)
        assert_exact(tl.coverage(*scene.arrays, method=method, **scene.view), expected > 0)
    return expected


def check_painters_ids(scene: Scene):
    expected = ref.ids(*scene.arrays, depth_test=None, **scene.view)
    for method in METHODS:
        assert_exact(tl.rasterize(*scene.arrays, depth_test=None, method=method, **scene.view).triangle, expected)


def check_ids(scene: Scene, depth_test):
    """For depths that float64 computes exactly, such as one depth a triangle: every tie falls as in the reference."""
    expected = ref.ids(*scene.arrays, depth_test=depth_test, **scene.view)
    for method in METHODS:
        assert_exact(tl.rasterize(*scene.arrays, depth_test=depth_test, method=method, **scene.view).triangle, expected)


class Candidate(NamedTuple):
    """A triangle at a sample: its exact depth, how far float64 may be off, and half a unit of float32 twice more."""

    depth: Fraction
    slack: Fraction
    allowed: Fraction

    @classmethod
    def of(cls, fragment):
        depth, slack = fragment.depth(), depth_slack(fragment.piece)
        return cls(depth, slack, slack + 2 * half_ulp(depth))


def check_fragments(scene: Scene):
    """The triangle seen covers the sample, its depth is right, and no other is nearer by more than the bounds."""
    candidates = defaultdict(dict)
    for fragment in ref.fragments(*scene.arrays, **scene.view):
        by_id = candidates[fragment.row, fragment.column]
        if fragment.piece.triangle not in by_id:
            by_id[fragment.piece.triangle] = Candidate.of(fragment)
    for depth_test, towards_eye in (("less", -1), ("greater", 1), (None, 0)):
        frags = tl.rasterize(*scene.arrays, depth_test=depth_test, **scene.view)
        covered = np.zeros(frags.triangle.shape, bool)
        for pixel, by_id in candidates.items():
            covered[pixel] = True
            seen = by_id[int(frags.triangle[pixel])]
            assert_within(frags.depth[pixel], seen.depth, seen.slack)
            for other in by_id.values():
                assert towards_eye * (other.depth - seen.depth) <= seen.allowed + other.allowed
        assert_exact(frags.mask, covered)
        assert (frags.triangle[~covered] == -1).all()
        assert (frags.depth[~covered] == (-np.inf if depth_test == "greater" else np.inf)).all()
        for method in METHODS:
            other = tl.rasterize(*scene.arrays, depth_test=depth_test, method=method, **scene.view)
            assert_same(other.triangle, frags.triangle)
            assert_same(other.depth, frags.depth)


@lru_cache(maxsize=1)
def depth_slack(piece):
    """25 * 2**-53 * box / area of the largest difference of depths; slivers by their weights (docs/design/rules.md)."""
    a, b, c = piece.vertices
    area = abs(ref.edge_function(a.xy_fx, b.xy_fx, c.xy_fx))
    box = 1
    for axis in range(2):
        ends = [v.xy_fx[axis] for v in (a, b, c)]
        box *= max(ends) - min(ends)
    z = [Fraction(v.z) for v in (a, b, c)]
    ratio = min(Fraction(box, area), Fraction(2**12))
    return max(Fraction(25, 2**53) * ratio * (max(z) - min(z)), Fraction(1, 2**49) * max(map(abs, z)))


def check_attributes(scene: Scene, values):
    """Barycentric weights and interpolated values of the topmost triangles, in painter's order."""
    winners = ref.visible(*scene.arrays, depth_test=None, **scene.view)
    frags = tl.rasterize(*scene.arrays, depth_test=None, **scene.view)
    weights, pictures = frags.barycentric(), frags.interpolate(values, background=-7)
    corners = values[scene.triangles]
    for pixel, fragment in winners.items():
        exact = fragment.weights()
        at_corners = corners[fragment.piece.triangle]
        for k in range(3):
            assert_within(weights[pixel][k], exact[k], WEIGHT_SLACK)
        for c, channel in enumerate(at_corners.T.tolist()):
            slack = WEIGHT_SLACK * Fraction(max(map(abs, channel)))
            assert_within(pictures[pixel][c], sum(w * Fraction(v) for w, v in zip(exact, channel, strict=True)), slack)
    count_pixels(weights)
    empty = frags.triangle < 0
    assert (weights[empty] == 0).all()
    assert (pictures[empty] == -7).all()
    assert_same(frags.interpolate(corners, background=-7), pictures)


def check_fill_uint8(scene: Scene, colors, per):
    expected = ref.fill(*scene.arrays[:2], colors, scene.size, per=per, background=7, **scene.view)
    for method in METHODS:
        got = tl.fill(*scene.arrays[:2], colors, scene.size, per=per, background=7, method=method, **scene.view)
        assert_exact(got, expected)


def check_fill_uint8_cut(scene: Scene, colors):
    """Where a plane has cut a triangle, colours at the cut are not integers: float64 may decide ties either way."""
    exact = ref.fill(*scene.arrays[:2], colors.astype(float), scene.size, per="vertex", background=7, **scene.view)
    got = tl.fill(*scene.arrays[:2], colors, scene.size, per="vertex", background=7, **scene.view)
    count_pixels(got)
    assert (abs(got.astype(object) - exact) <= Fraction(1, 2) + Fraction(1, 2**40)).all()
    for method in METHODS:
        options = {"per": "vertex", "background": 7, "method": method} | scene.view
        assert_same(tl.fill(*scene.arrays[:2], colors, scene.size, **options), got)


def check_fill_float32(scene: Scene, colors):
    """Gouraud colours obey the bound of depth, for they are computed alike; a cut rounds once more at its ends."""
    exact = ref.fill(*scene.arrays[:2], colors, scene.size, per="vertex", background=0.25, **scene.view)
    slack = 2 * COLOR_SLACK * Fraction(float(abs(colors).max()))
    got = tl.fill(*scene.arrays[:2], colors, scene.size, per="vertex", background=0.25, **scene.view)
    for value, expected in zip(got.ravel(), exact.ravel(), strict=True):
        assert_within(value, Fraction(expected), slack)
    count_pixels(got)
    for method in METHODS:
        options = {"per": "vertex", "background": 0.25, "method": method} | scene.view
        assert_same(tl.fill(*scene.arrays[:2], colors, scene.size, **options), got)


def overdraw_int64(scene: Scene):
    """Overdraw and painter's ids of pixel-space scenes in NumPy's int64, for pictures of millions of pixels."""
    bits, (x_origin, y_origin) = scene.view.get("subpixel_bits", 8), scene.view.get("origin", (0, 0))
    fixed = 2 * np.rint(np.asarray(scene.vertices, np.float64)[:, :2] * 2.0**bits).astype(np.int64)
    assert abs(fixed).max() < 2**29, "the products of two differences must fit 62 bits"
    width, height = scene.size
    counts, seen = np.zeros((height, width), np.int32), np.full((height, width), -1, np.int32)
    x = ((2 * (np.arange(width) + x_origin) + 1) << bits)[None, :]
    y = ((2 * (np.arange(height) + y_origin) + 1) << bits)[:, None]
    for index, triangle in enumerate(scene.triangles):
        a, b, c = fixed[triangle]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        if area < 0:
            b, c = c, b
        low, high = fixed[triangle].min(0), fixed[triangle].max(0)
        box = (
            slice(*np.searchsorted(y[:, 0], [low[1], high[1] + 1])),
            slice(*np.searchsorted(x[0], [low[0], high[0] + 1])),
        )
        inside = True
        for p, q in ((a, b), (b, c), (c, a)):
            e = (q[0] - p[0]) * (y[box[0]] - p[1]) - (q[1] - p[1]) * (x[:, box[1]] - p[0])
            is_top_left = q[1] < p[1] or (q[1] == p[1] and q[0] > p[0])
            inside = inside & (e >= 0 if is_top_left else e > 0)
        counts[box] += inside
        seen[box][inside] = index
    return counts, seen


def buffers(scene: Scene, **options):
    """Every buffer that the library makes of a scene.

    Attributes are random numbers, a row for each vertex or triangle.
    """
    options = scene.view | options
    rng = np.random.default_rng(7)
    rows = {"vertex": np.arange(len(scene.vertices)), "triangle": np.arange(len(scene.triangles))}
    found = {"coverage": tl.coverage(*scene.arrays, **options), "overdraw": tl.overdraw(*scene.arrays, **options)}
    for depth_test in ("less", "greater", None):
        frags = tl.rasterize(*scene.arrays, depth_test=depth_test, **options)
        found |= {f"triangle {depth_test}": frags.triangle, f"depth {depth_test}": frags.depth}
    found["barycentric"] = frags.barycentric()
    found["interpolate"] = frags.interpolate(rng.standard_normal((1000, 2))[rows["vertex"]])
    for per, row in rows.items():
        for colors in (rng.integers(0, 256, (1000, 3), np.uint8), rng.standard_normal((1000, 2)).astype(np.float32)):
            name = f"fill per {per} {colors.dtype}"
            found[name] = tl.fill(*scene.arrays[:2], colors[row], scene.size, per=per, **options)
    return found


def assert_same_buffers(got, expected):
    assert got.keys() == expected.keys()
    for name in expected:
        assert_same(got[name], expected[name])
