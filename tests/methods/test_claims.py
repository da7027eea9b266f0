"""What each method of the registry claims, both ways: who says yes never fails here, who says no is seen to fail."""

from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from strategies import turned

import topleft as tl
from topleft.methods import CLASSICS, METHODS
from topleft.methods import reference as ref

ALL = METHODS | CLASSICS
EVERY_METHOD = pytest.mark.parametrize("name", ALL)


# ---- scenes ---------------------------------------------------------------------------------------------------------


def soup(seed, side=16, n=6, *, step=0.0):
    """Separate triangles over the frame and round it, anywhere or on a lattice of `step` pixels."""
    xy = np.random.default_rng(seed).uniform(-side / 2, 1.5 * side, (3 * n, 2))
    return (np.round(xy / step) * step if step else xy), np.arange(3 * n).reshape(-1, 3), (side, side)


def mesh(seed, side=40):
    """A jittered grid that covers the frame and a border, corners in any order."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 11))
    line = np.linspace(-6, side + 6, n)
    xy = np.stack(np.meshgrid(line, line), -1)
    xy[1:-1, 1:-1] += rng.uniform(-0.3, 0.3, (n - 2, n - 2, 2)) * (line[1] - line[0])
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1], i[:-1, 1:], i[1:, :-1], i[1:, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)]).reshape(-1, 3)
    return xy.reshape(-1, 2), turned(triangles, rng), (side, side)


def edge_through_a_centre(seed):
    """Two triangles whose shared edge was meant to pass the centre of pixel (8, 8), but for the rounding."""
    rng = np.random.default_rng(seed)
    centre, along = np.array([8.5, 8.5]), rng.uniform(-30, 30, 2)
    across = along[::-1] * [-1, 1]
    k, m = rng.uniform(0.1, 1, 2)
    corners = np.array([centre - k * along, centre + across, centre + m * along, centre - across])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


#: Two triangles that share the edge from (8, 0) to (-2, 17); pixel (2, 10) lies inside, 4-neighbours included.
DROPOUT = np.array([[8.0, 0], [-2, 17], [1, 9], [6, 15]]), np.array([[0, 1, 2], [0, 1, 3]])


def draw(name, vertices, triangles, size):
    """Draw counts, every triangle turned the way that the method draws."""
    if ALL[name].claims.winding != "either":
        corners = np.trunc(vertices)[triangles]
        (ax, ay), (bx, by), (cx, cy) = (corners[:, k].T for k in range(3))
        is_clockwise = (bx - ax) * (cy - ay) > (by - ay) * (cx - ax)
        wrong = is_clockwise != (ALL[name].claims.winding == "clockwise")
        triangles = np.where(wrong[:, None], triangles[:, ::-1], triangles)
    return tl.overdraw(vertices, triangles, size, method=name)


# ---- exact pictures by rule -----------------------------------------------------------------------------------------


def inclusive(vertices, triangles, size):
    """Exact counts of the centres in closed triangles, those without area included."""
    points = [[Fraction(x) for x in p] for p in np.asarray(vertices).tolist()]
    counts = np.zeros(size[::-1], np.int32)
    for a, b, c in (tuple(points[i] for i in row) for row in np.asarray(triangles).tolist()):
        for i, j in np.ndindex(*counts.shape):
            p = (j + Fraction(1, 2), i + Fraction(1, 2))
            signs = [ref.edge_function(*edge, p) for edge in ((a, b), (b, c), (c, a))]
            is_in_box = all(min(a[k], b[k], c[k]) <= p[k] <= max(a[k], b[k], c[k]) for k in range(2))
            counts[i, j] += is_in_box and (min(signs) >= 0 or max(signs) <= 0)
    return counts


def expected_counts(name, vertices, triangles, size):
    """Exact counts under the method's rule, for the vertices that it works on."""
    if ALL[name].claims.integer_vertices:
        vertices = np.trunc(vertices) + 0.5  # the centre of the pixel that a vertex lies in
    if ALL[name].claims.top_left:
        return ref.overdraw(vertices, triangles, size)
    if name.endswith("bottom-right"):  # turned half round, bottom and right are top and left
        return ref.overdraw(np.array(size) - vertices, triangles, size)[::-1, ::-1]
    return inclusive(vertices, triangles, size)


@cache
def count_wrong_samples(name):
    scenes = [soup(seed, 12, 4) for seed in range(6)] + [soup(seed, 12, 4, step=0.5) for seed in range(4)]
    quads = [(*edge_through_a_centre(seed), (16, 16)) for seed in range(6)]
    return sum(int((draw(name, *s) != expected_counts(name, *s)).sum()) for s in scenes + quads)


@cache
def count_in_meshes(name):
    """Holes, and samples that were drawn more than once, inside meshes."""
    inside = [draw(name, *mesh(seed)).ravel() for seed in range(25)]
    inside.append(draw(name, *DROPOUT, (10, 20))[10, 2:3])
    inside += [draw(name, *edge_through_a_centre(seed), (16, 16))[8, 8:9] for seed in range(60)]
    counts = np.concatenate(inside)
    return int((counts == 0).sum()), int((counts > 1).sum())


# ---- the claims -----------------------------------------------------------------------------------------------------


@EVERY_METHOD
def test_claim_exact(name):
    assert (count_wrong_samples(name) == 0) == ALL[name].claims.exact


@EVERY_METHOD
def test_claim_watertight(name):
    holes, _ = count_in_meshes(name)
    assert (holes == 0) == ALL[name].claims.watertight


@EVERY_METHOD
def test_claim_overdraws_shared_edges(name):
    _, n_overdrawn = count_in_meshes(name)
    assert (n_overdrawn > 0) == ALL[name].claims.overdraws_shared_edges


@cache
def edge_samples(seed):
    """A triangle with corners in the middle of pixels, its exact counts, and which samples lie on its edges."""
    vertices, triangles, size = soup(seed, 14, 1, step=1.0)
    vertices = np.abs(vertices) + 0.5  # truncation moves nothing
    expected = ref.overdraw(vertices, triangles, size)
    bottom_right = ref.overdraw(np.array(size) - vertices, triangles, size)[::-1, ::-1]
    is_inside = (expected > 0) & (bottom_right > 0)
    return (vertices, triangles, size), expected, (inclusive(vertices, triangles, size) > 0) & ~is_inside


@EVERY_METHOD
def test_claim_top_left(name):
    n_wrong = 0
    for seed in range(25):
        scene, expected, is_on_edge = edge_samples(seed)
        n_wrong += int((draw(name, *scene) != expected)[is_on_edge].sum())
    assert (n_wrong == 0) == ALL[name].claims.top_left


@EVERY_METHOD
def test_claim_sub_pixel(name):
    scenes = [soup(seed, step=1.0) for seed in range(5)]
    is_moved = [(draw(name, v + 0.25, t, size) != draw(name, v, t, size)).any() for v, t, size in map(shifted, scenes)]
    assert any(is_moved) == ALL[name].claims.sub_pixel


def shifted(scene):
    """Right of and below the origin, where truncation is the floor."""
    vertices, *rest = scene
    return vertices + 8, *rest


@EVERY_METHOD
def test_claim_integer_vertices(name):
    scenes = [soup(seed) for seed in range(5)]
    is_same = [(draw(name, v, t, size) == draw(name, np.trunc(v), t, size)).all() for v, t, size in scenes]
    assert all(is_same) == ALL[name].claims.integer_vertices


@EVERY_METHOD
def test_claim_winding(name):
    vertices = [[2, 2], [14, 4], [5, 13]]  # clockwise as seen
    is_drawn = {
        winding: tl.coverage(vertices, [triangle], (16, 16), method=name).any()
        for winding, triangle in {"clockwise": [0, 1, 2], "counter-clockwise": [0, 2, 1]}.items()
    }
    claimed = ALL[name].claims.winding
    assert is_drawn == {winding: claimed in ("either", winding) for winding in is_drawn}


@EVERY_METHOD
def test_registry_entry_is_complete(name):
    method = ALL[name]
    assert method.name == name
    assert method.summary
    assert method.source or name == "auto"
    assert method.claims.integer_vertices != method.claims.sub_pixel


# ---- equal to the reference, pixel for pixel ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["edge_increment", "zigzag"])
@pytest.mark.parametrize("bits", [0, 1, 4, 8, 12, 16])
def test_subpixel_classic_equals_the_reference(name, bits):
    for seed in range(4):
        vertices, triangles, size = soup(100 + seed, 20, 8, step=[0, 0.5, 1 / 16, 2**-16][seed])
        expected = ref.overdraw(vertices, triangles, size, subpixel_bits=bits)
        got = tl.overdraw(vertices, triangles, size, method=name, subpixel_bits=bits)
        assert np.array_equal(got, expected)


@pytest.mark.parametrize("name", ["point_in_triangle/top-left", "edge_increment/integer"])
def test_integer_classic_equals_the_reference_of_pixel_centres(name):
    for seed in range(8):
        vertices, triangles, size = soup(200 + seed, 20, 8)
        expected = ref.overdraw(np.trunc(vertices) + 0.5, triangles, size)
        assert np.array_equal(tl.overdraw(vertices, triangles, size, method=name), expected)


def test_bottom_right_draws_other_samples_of_an_edge():
    vertices, square = [[0.5, 0.5], [3.5, 0.5], [3.5, 3.5], [0.5, 3.5]], [[0, 1, 2], [0, 2, 3]]
    for method, first in (("edge_increment", 0), ("edge_increment/bottom-right", 1)):
        expected = np.zeros((4, 4), np.int32)
        expected[first : first + 3, first : first + 3] = 1
        assert np.array_equal(tl.overdraw(vertices, square, (4, 4), method=method), expected)
