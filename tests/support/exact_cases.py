"""Triangles at which rounded edge functions go wrong: neighbouring floats, ties, needles, and numbers of all sizes."""

from math import inf, nextafter

import numpy as np
from hypothesis import strategies as st
from strategies import soup

SIZE = (24, 16)

#: L. Kettner, K. Mehlhorn, S. Pion, S. Schirra, C. Yap, Classroom Examples of Robustness Problems in Geometric
#: Computations, 2008, data set A1: in float64 three points see the fourth on the inner side of each of their edges.
KETTNER_A1 = np.array(
    [
        [7.3000000000000194, 7.3000000000000167], [24.000000000000068, 24.000000000000071],
        [24.00000000000005, 24.000000000000053], [0.50000000000001621, 0.50000000000001243],
        [8, 4], [4, 9], [15, 27], [25, 25], [19, 11],
    ]
)  # fmt: skip


#: Triangles of 60 px of which an edge passes a centre so near, and with such roundings, that bands a quarter as wide as
#: the proved ones decide a sample wrongly: 130 of 16 million that were tried. The third corner is (7.3, 3.3).
BITING_EDGES = np.array(
    [
        [[58.12057875958705, 6.336363721826274], [59.923222820893415, 49.873321857361624]],
        [[56.96231327198531, 4.331230389762911], [49.308901841333814, 47.08466060213783]],
        [[50.31371004274939, 13.2190182646945], [51.50236014650366, 37.54829660392549]],
        [[28.46021151395206, 9.461681578743427], [52.201732389873335, 36.29305985672594]],
        [[59.35150298236741, 3.7444067372841165], [45.87628096925911, 47.35227690082135]],
        [[59.27122068328202, 6.635061971217718], [14.266021326411916, 28.976457476260496]],
    ]
)


def kettner_grid(i, j):
    """The triangle of their figure 2: a corner i and j float64 steps from (1/2, 1/2), and two on the diagonal."""
    return np.array([[0.5 + i * 2.0**-53, 0.5 + j * 2.0**-53], [12, 12], [24, 24]])


def tilted_grid(n=12, side=2.0, step=2.0**-48):
    """Points of J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic, 1997, section 5: a grid tilted by a hair.

    Returns vertices and triangles of the whole grid, whose rows begin on centres of pixels.
    """
    row, col = np.mgrid[:n, :n]
    points = np.stack([0.5 + side * col + step * row, 0.5 + side * row - step * col], -1).reshape(-1, 2)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    return points, np.concatenate([np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + n + 1, i + n], 1)])


def steps(x, n):
    """The n-th float64 after x, or before it."""
    for _ in range(abs(n)):
        x = nextafter(x, inf if n > 0 else -inf)
    return x


NUDGES = st.integers(-3, 3)
HUGE_AND_TINY = st.sampled_from(
    [5e-324, -5e-324, 1e-310, 1e-200, -1e-140, 1e160, 1e300, -1e300, 1.7e308, -1.7e308, 0.0, 0.5, 1.5, 7.5, 1e15, -4e15]
)
NEAR = st.floats(-3, 27, allow_subnormal=False)


@st.composite
def on_lattice(draw):
    """Corners on centres or whole pixels, a few float64 steps away."""
    coordinates = st.builds(lambda n, k: steps(n / 2, k), st.integers(-4, 50), NUDGES)
    return draw(st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=3))


@st.composite
def nearly_collinear(draw):
    """The third corner on the line of the others but for rounding: as it comes out, or a few steps away."""
    (ax, ay), (bx, by) = draw(st.tuples(st.tuples(NEAR, NEAR), st.tuples(NEAR, NEAR)))
    u = draw(st.sampled_from([0.5, 0.25, 1 / 3, 0.1, -1.0, 2.0]) | st.floats(0, 1))
    x, y = ax + u * (bx - ax), ay + u * (by - ay)
    return [(ax, ay), (bx, by), (steps(x, draw(NUDGES)), steps(y, draw(NUDGES)))]


@st.composite
def through_a_centre(draw):
    """An edge through the centre of a pixel but for rounding, of any length."""
    sx, sy = draw(st.integers(0, 23)) + 0.5, draw(st.integers(0, 15)) + 0.5
    dx, dy = draw(st.tuples(NEAR, NEAR))
    u = draw(st.floats(0.1, 3))
    ends = [(sx + dx, sy + dy), (steps(sx - u * dx, draw(NUDGES)), steps(sy - u * dy, draw(NUDGES)))]
    return [*ends, draw(st.tuples(NEAR, NEAR))]


@st.composite
def nearly_level(draw):
    """An edge along a row or a column of centres, whose ends differ by a few steps or not at all."""
    at = draw(st.integers(0, 15)) + 0.5
    a, b, (cx, cy) = draw(NEAR), draw(NEAR), draw(st.tuples(NEAR, NEAR))
    ends = [(a, steps(at, draw(NUDGES))), (b, steps(at, draw(NUDGES)))]
    return [*(ends if draw(st.booleans()) else [(y, x) for x, y in ends]), (cx, cy)]


@st.composite
def needles(draw):
    """Two corners 1e-16 to 1e-9 px apart."""
    (ax, ay), (bx, by) = draw(st.tuples(st.tuples(NEAR, NEAR), st.tuples(NEAR, NEAR)))
    width = 10.0 ** draw(st.integers(-16, -9))
    return [(ax, ay), (bx, by), (bx + width * draw(st.floats(-1, 1)), by + width * draw(st.floats(-1, 1)))]


def anywhere(coordinates):
    """Three corners of such coordinates."""
    return st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=3)


TRIANGLES = st.one_of(
    on_lattice(), nearly_collinear(), through_a_centre(), nearly_level(), needles(), anywhere(NEAR),
    anywhere(st.floats(-3, 27, width=32)), anywhere(HUGE_AND_TINY), anywhere(HUGE_AND_TINY | NEAR),
    anywhere(st.floats(allow_nan=False, allow_infinity=False)),
)  # fmt: skip


def exact_scenes(n=4):
    """Scenes of up to n such triangles in a small picture, drawn with ``subpixel_bits="exact"``."""

    def scene(triangles):
        return soup(np.array(triangles, np.float64).reshape(-1, 2), SIZE, subpixel_bits="exact")

    return st.lists(TRIANGLES, min_size=1, max_size=n).map(scene)


def lattice(side, offset, n_steps, rng, size=(96, 64)):
    """A mesh of squares that covers a picture: corners n float64 steps from a lattice, diagonals either way."""
    x, y = (np.arange(-2 * side, extent + 3 * side, side) + offset for extent in size)
    points = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    for _ in range(n_steps):
        points = np.nextafter(points, rng.choice([-inf, inf], points.shape))
    n = len(x)
    i = (np.arange(len(y) - 1)[:, None] * n + np.arange(n - 1)).ravel()
    falls = rng.random((len(i), 1)) < 0.5
    upper = np.where(falls, np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + 1, i + n], 1))
    lower = np.where(falls, np.stack([i, i + n + 1, i + n], 1), np.stack([i + 1, i + n + 1, i + n], 1))
    return points, np.concatenate([upper, lower])
