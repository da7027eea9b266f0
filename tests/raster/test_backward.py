"""Gradients of a visibility buffer beside differences, and exact areas beside a clipper."""

import re
from functools import cache

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, on

import topleft as tl
from topleft._core.gradients import tensors
from topleft._core.raster.backward import in_pixels

RNG = np.random.default_rng(7)


def by_differences(function, at, step=1e-5):
    """Central differences of a number."""
    found = np.zeros(at.shape)
    for place in np.ndindex(at.shape):
        values = []
        for sign in (1, -1):
            moved = at.astype(np.float64)
            moved[place] += sign * step
            values.append(function(moved))
        found[place] = (values[0] - values[1]) / (2 * step)
    return found


def clip_scene(seed=0):
    """Two triangles in clip space, of which one hides a part of the other."""
    rng = np.random.default_rng(seed)
    corners = np.array([[-0.7, -0.8, 0.1, 1], [0.9, -0.5, 0.2, 1], [0.0, 0.9, 0.1, 1],
                        [-0.9, 0.3, 0.5, 1], [0.8, 0.6, 0.5, 1], [0.1, -0.9, 0.6, 1]])  # fmt: skip
    return corners * rng.uniform(0.7, 1.5, (6, 1)), np.array([[0, 1, 2], [5, 4, 3]])


def attribute(frags, vertices, values):
    """An attribute and its derivatives in float64, of triangles that stay where they show."""
    pos = in_pixels(frags.corners._replace(vertices=vertices), vertices)[0]
    out, slopes = np.zeros((*frags.mask.shape, values.shape[1])), np.zeros((*frags.mask.shape, values.shape[1], 2))
    for y, x in np.argwhere(frags.mask):
        row = frags.corners.triangles[frags.triangle[y, x]]
        planes = np.linalg.inv(pos[row][:, [0, 1, 3]].T)
        parts = planes @ [x + 0.5, y + 0.5, 1]
        weights = parts / parts.sum()
        out[y, x] = weights @ values[row]
        by = (planes[:, :2] - np.outer(weights, planes[:, :2].sum(0))) / parts.sum()
        slopes[y, x] = values[row].T @ by
    return out, slopes


@ON_EACH_ISA
@pytest.mark.parametrize("transform", [None, np.diag([0.9, 1.1, 1.0, 1.2]) + 0.05])
@pytest.mark.parametrize("origin", [(0, 0), (3, 2)])
def test_interpolate_vjp_is_differences(isa, transform, origin):
    vertices, triangles = clip_scene()
    if transform is not None:
        vertices = vertices[:, :3]
    with on(isa):
        options = {"transform": transform, "origin": origin, "viewport": (14, 11), "subpixel_bits": 16}
        frags = tl.rasterize(vertices, triangles, (9, 8), **options)
        values = RNG.normal(size=(6, 2))
        g, g_slopes = RNG.normal(size=(8, 9, 2)), RNG.normal(size=(8, 9, 2, 2))
        by_values, by_vertices = frags.interpolate_vjp(values, g, grad_derivatives=g_slopes)

    def number(vertices, values):
        out, slopes = attribute(frags, vertices, values)
        return (g * out).sum() + (g_slopes * slopes).sum()

    assert set(np.unique(frags.triangle)) == {-1, 0, 1}
    np.testing.assert_allclose(attribute(frags, vertices, values)[0], frags.interpolate(values), atol=0.02)  # the snap
    np.testing.assert_allclose(by_values, by_differences(lambda v: number(vertices, v), values), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(by_vertices, by_differences(lambda v: number(v, values), vertices), rtol=1e-6, atol=1e-6)


@ON_EACH_ISA
@pytest.mark.parametrize("seed", [2, 6, 10])
def test_interpolate_vjp_of_centres_on_edges_is_that_of_centres_inside(isa, seed):
    rng = np.random.default_rng(seed)
    at = np.array([[0.5, 0.5], [7.5, 0.5], [7.5, 7.5], [0.5, 7.5]])  # sides and diagonal go through centres,
    w = rng.uniform(0.6, 1.2, 4)  # where rounding takes weights of 0 to either side
    vertices = np.c_[(at / 4 - 1) * [1, -1] * w[:, None], 0.1 * w, w]
    triangles, values, g = np.array([[0, 1, 2], [0, 2, 3]]), rng.normal(size=(4, 1)), rng.normal(size=(8, 8, 1))
    with on(isa):
        frags = tl.rasterize(vertices, triangles, (8, 8))
        _, by_vertices = frags.interpolate_vjp(values, g)
    assert (frags.barycentric()[frags.mask] == 0).any(-1).sum() == 19
    expected = by_differences(lambda v: (g * attribute(frags, v, values)[0]).sum(), vertices)
    np.testing.assert_allclose(by_vertices, expected, rtol=1e-6, atol=1e-6)


def test_interpolate_vjp_of_corners_and_of_one_attribute():
    vertices, triangles = clip_scene()
    frags = tl.rasterize(vertices, triangles, (12, 10))
    values, g = RNG.normal(size=6), RNG.normal(size=(10, 12))
    by_values, by_vertices = frags.interpolate_vjp(values, g)
    by_corners, same = frags.interpolate_vjp(values[triangles][..., None], g[..., None])
    np.testing.assert_allclose(same, by_vertices, rtol=1e-12)
    np.testing.assert_allclose(np.bincount(triangles.ravel(), by_corners.ravel()), by_values, rtol=1e-12)


def test_barycentric_vjp_is_that_of_an_attribute():
    vertices, triangles = clip_scene()
    frags, g = tl.rasterize(vertices, triangles, (12, 10)), RNG.normal(size=(10, 12, 3))
    corners = np.tile(np.eye(3), (2, 1, 1))
    np.testing.assert_allclose(frags.barycentric_vjp(g), frags.interpolate_vjp(corners, g)[1], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("columns", "options"),
    [(3, {}), (4, {}), (4, {"clip_depth": "zero_to_one"}), (3, {"transform": np.diag([0.9, 1.1, 1.0, 1.2]) + 0.05})],
)
def test_depth_vjp_is_differences(columns, options):
    vertices, triangles = clip_scene()
    vertices = vertices[:, :columns]
    if columns == 3 and not options:
        vertices = vertices * [6, 5, 1] + [6, 5, 0]
    frags, g = tl.rasterize(vertices, triangles, (12, 10), **options), RNG.normal(size=(10, 12))

    def depths(at):
        pos = in_pixels(frags.corners, at)[0]
        out = np.zeros(frags.mask.shape)
        for y, x in np.argwhere(frags.mask):
            row = triangles[frags.triangle[y, x]]
            parts = np.linalg.inv(pos[row][:, [0, 1, 3]].T) @ [x + 0.5, y + 0.5, 1]
            out[y, x] = (parts @ pos[row, 2]) / (parts @ pos[row, 3])
        is_half = (columns == 4 or "transform" in options) and "clip_depth" not in options
        return np.where(frags.mask, (out + 1) / 2, 0) if is_half else out

    np.testing.assert_allclose(depths(vertices)[frags.mask], frags.depth[frags.mask], atol=0.02)  # the snap
    expected = by_differences(lambda at: (g * depths(at)).sum(), vertices)
    np.testing.assert_allclose(frags.depth_vjp(g), expected, rtol=1e-6, atol=1e-6)


WAYS = [(how, "repeat") for how in ("nearest", "bilinear", "trilinear", "pixelated")]
WAYS += [("trilinear", "clamp"), ("bilinear", "mirror"), ("trilinear", "mirror")]


@pytest.mark.parametrize(("how", "wrap"), WAYS)
@pytest.mark.parametrize("size", [(4, 3), (15, 7), (1, 2)])
def test_sample_vjp_is_differences(how, wrap, size):
    vertices, triangles = clip_scene()
    frags = tl.rasterize(vertices, triangles, (9, 8), viewport=(14, 11), subpixel_bits=16)
    rng = np.random.default_rng(5)
    texture, uv, g = rng.normal(size=(*size[::-1], 2)), 1.7 * rng.normal(size=(6, 2)), rng.normal(size=(8, 9, 2))
    by_texture, by_uv, by_vertices = frags.sample_vjp(texture, uv, g, filter=how, wrap=wrap)

    def number(texture, uv):
        return (g * frags.sample(texture, uv, filter=how, wrap=wrap)).sum(dtype=np.float64)

    # Linear in the texture, and otherwise smooth but for edges of texels: most differences are derivatives.
    expected = by_differences(lambda at: number(at, uv), texture, step=1.0)
    np.testing.assert_allclose(by_texture, expected, atol=1e-5)
    steps = [by_differences(lambda at: number(texture, at), uv, step) for step in (3e-4, 1e-3)]
    is_smooth = np.isclose(*steps, rtol=0.02, atol=0.02)
    assert is_smooth.mean() > 0.5
    np.testing.assert_allclose(by_uv[is_smooth], steps[0][is_smooth], rtol=0.03, atol=0.05)
    assert bool(by_vertices.any()) == bool(by_uv.any())
    assert how == "pixelated" or by_uv.any() != (how == "nearest")  # of which some pixels look between texels


def test_sample_vjp_of_one_channel_and_of_a_texture():
    vertices, triangles = clip_scene()
    rng = np.random.default_rng(5)
    frags, uv, g = tl.rasterize(vertices, triangles, (12, 10)), rng.random((6, 2)), rng.normal(size=(10, 12))
    flat = frags.sample_vjp(rng.random((4, 4)), uv, g)
    assert [one.shape for one in flat] == [(4, 4), (6, 2), (6, 4)]
    own = tl.Texture(rng.integers(0, 256, (5, 4, 4)).astype(np.uint8))
    by_texture, *_ = frags.sample_vjp(own, uv, np.tile(g[..., None], 4))
    np.testing.assert_allclose(by_texture.sum(axis=(0, 1)), g[frags.mask].sum(), rtol=1e-9)  # weights sum to 1


def test_gradients_of_triangles_without_area_are_0():
    vertices = np.array([[0.0, 0], [8, 0], [0, 8], [2, 2], [4, 4], [6, 6]])
    frags = tl.rasterize(vertices, [[0, 1, 2], [3, 4, 5]], (8, 8))
    _, by_vertices = frags.interpolate_vjp(RNG.normal(size=6), np.ones((8, 8)))
    assert not by_vertices[3:].any()
    assert by_vertices[:3].any()
    assert not tl.area_vjp(vertices, [[3, 4, 5]], (8, 8), np.ones((8, 8))).any()


# silhouettes


def clip_area(polygon, x, y):
    """The area of a polygon in the unit square at (x, y)."""
    points = np.asarray(polygon, float) - (x, y)
    for axis, limit, sign in ((0, 0, 1), (0, 1, -1), (1, 0, 1), (1, 1, -1)):
        if not len(points):
            return 0.0
        depth = sign * (points[:, axis] - limit)
        kept = []
        for i, j in zip(range(len(points)), [*range(1, len(points)), 0], strict=True):
            if depth[i] >= 0:
                kept.append(points[i])
            if (depth[i] >= 0) != (depth[j] >= 0):
                kept.append(points[i] + (points[j] - points[i]) * (depth[i] / (depth[i] - depth[j])))
        points = np.array(kept)
    x, y = points.T if len(points) else (np.zeros(0), np.zeros(0))
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def areas(points, size):
    """Areas of a polygon by pixel."""
    return np.array([[clip_area(points, x, y) for x in range(size)] for y in range(size)])


@pytest.mark.parametrize("degrees", [0, 1e-5, 30, 44, 45 - 1e-6, 45, 45 + 1e-6, 46, 90, 211.3])
def test_antialias_of_a_long_edge_is_its_exact_area(degrees):
    along = np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))])
    middle, across = np.array([12.3, 11.8]), np.array([-along[1], along[0]])
    points = np.array([middle - 60 * along, middle + 60 * along, middle + 70 * across])
    frags = tl.rasterize(points, [[0, 1, 2]], (24, 24), subpixel_bits=16)
    smooth, inner = frags.antialias(frags.mask), (slice(1, -1), slice(1, -1))
    np.testing.assert_allclose(smooth[inner], areas(points, 24)[inner], rtol=0, atol=1e-10)
    g = np.pad(RNG.normal(size=(22, 22)), 1)
    _, by_points = frags.antialias_vjp(frags.mask, g)
    expected = by_differences(lambda ends: (g * areas([*ends, points[2]], 24)).sum(), points[:2], 1e-4)
    np.testing.assert_allclose(by_points[:2], expected, rtol=0, atol=1e-5 * np.abs(expected).max())


@ON_EACH_ISA
@pytest.mark.parametrize("edges", ["area", "silhouette"])
@pytest.mark.parametrize("axis", [0, 1])
def test_antialias_of_more_edges_than_are_found_at_once_is_their_exact_area(isa, edges, axis):
    lows = 3 * np.arange(500)[:, None] + [[1.25, 2.75, 2.75, 1.25]]  # a stripe over two pixels of three
    points = np.stack(np.broadcast_arrays(lows, [-5.0, -5, 9, 9]), 2).reshape(-1, 2)[:, :: 1 - 2 * axis]
    quads = 4 * np.arange(500)[:, None, None] + [[0, 1, 2], [0, 2, 3]]
    with on(isa):
        size = (4, 1501) if axis else (1501, 4)
        frags = tl.rasterize(points, quads.reshape(-1, 3), size)
        smooth = frags.antialias(frags.mask, edges=edges)
    assert np.array_equal((smooth.T if axis else smooth)[:, :1500], np.tile([0, 0.75, 0.75], (4, 500)))


def test_antialias_of_float32_in_either_byte_order_is_float32():
    frags = tl.rasterize([(1, 1), (7, 2), (2, 6)], [(0, 1, 2)], (8, 8))
    picture = np.where(frags.mask, np.float32(0.3), np.float32(0.7))
    swapped = frags.antialias(picture.astype(">f4"))
    assert swapped.dtype == np.float32
    assert_same(swapped, frags.antialias(picture))


BOTH_WINDINGS = pytest.mark.parametrize("second", [[1, 0, 3], [0, 1, 3]])


@BOTH_WINDINGS
def test_antialias_of_a_surface_that_runs_on_is_the_picture_for_either_winding(second):
    points = np.array([[-50.0, -31, 0], [70, 55, 0], [50, -70, 5], [-40, 90, 5]])
    frags = tl.rasterize(points, [[0, 1, 2], second], (24, 24), subpixel_bits=16)
    assert set(frags.triangle.ravel()) == {0, 1}
    colours = frags.triangle + 1.0
    assert np.array_equal(frags.antialias(colours, edges="silhouette"), colours)


@BOTH_WINDINGS
def test_antialias_of_a_surface_that_folds_is_that_of_its_front_for_either_winding(second):
    points = np.array([[-50.0, -31, 0], [70, 55, 0], [50, -70, 0], [30, -40, 5]])
    frags = tl.rasterize(points, [[0, 1, 2], second], (24, 24), subpixel_bits=16)
    alone = tl.rasterize(points, [[0, 1, 2]], (24, 24), subpixel_bits=16)
    assert np.array_equal(frags.mask, alone.mask)
    expected = alone.antialias(alone.mask, edges="silhouette")
    assert (expected != alone.mask).any()
    assert np.array_equal(frags.antialias(frags.mask, edges="silhouette"), expected)


def test_antialias_beside_a_nearer_triangle_that_reaches_behind_the_eye_finds_the_edge_of_the_far_one():
    x = 4.25 / 4 - 1  # the edge of both, in a picture of 8 pixels
    near = [[x, -4, -0.5, 1], [x, 4, -0.5, 1], [1, 0, 0.5, -1]]
    far = [[x, -40, 0.5, 1], [x, 40, 0.5, 1], [-80, 0, 0.5, 1]]
    frags = tl.rasterize(np.array([*near, *far]), [[0, 1, 2], [3, 4, 5]], (8, 8))
    assert np.array_equal(frags.triangle, np.tile([1, 1, 1, 1, 0, 0, 0, 0], (8, 1)))
    smooth = frags.antialias(frags.triangle.astype(np.float64))
    np.testing.assert_allclose(smooth, np.tile([1, 1, 1, 1, 0.25, 0, 0, 0], (8, 1)), rtol=0, atol=1e-12)


def test_antialias_of_a_crease_of_flat_colours_is_exact():
    points = np.array([[-50.0, -31], [70, 55], [50, -70], [-40, 90]])
    triangles = np.array([[0, 1, 2], [1, 0, 3]])
    frags = tl.rasterize(np.column_stack([points, [0, 0, 5, 5.0]]), triangles, (24, 24), subpixel_bits=16)
    colours = np.array([1.0, 0.25])[frags.triangle]
    inner = (slice(1, -1), slice(1, -1))
    flat = frags.antialias(colours)
    assert np.array_equal(flat, colours)  # the surface runs on: no silhouette
    apart = tl.rasterize(np.column_stack([points[triangles.ravel()], np.zeros(6)]), [[0, 1, 2], [3, 4, 5]], (24, 24),
                         subpixel_bits=16)  # fmt: skip
    exact = areas(points[triangles[0]], 24) + 0.25 * areas(points[triangles[1]], 24)
    np.testing.assert_allclose(apart.antialias(colours)[inner], exact[inner], rtol=0, atol=1e-10)


def sphere(level, radius=13.0, middle=(18.2, 17.7)):
    """A sphere of triangles below a pixel, in pixels and depth."""
    vertices, triangles = tl.scenes.icosphere(level)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    unit = vertices @ turn
    return np.column_stack([unit[:, :2] * radius + middle, unit[:, 2]]), triangles, unit


@pytest.mark.parametrize("level", [3, 4])
def test_antialias_of_a_fine_sphere_moves_with_its_radius(level):
    # 1,280 and 5,120 triangles: all of the rim is corners. Silhouettes of the triangles seen alone give 0.01 to 0.15.
    points, triangles, unit = sphere(level)
    frags = tl.rasterize(points, triangles, (36, 36), subpixel_bits=16)
    smooth = frags.antialias(frags.mask)
    y, x = np.mgrid[:36, :36] + 0.5
    error = np.abs(smooth - np.clip(13.5 - np.hypot(x - 18.2, y - 17.7), 0, 1))
    assert error[error > 0].mean() < 0.05  # from a circle, which the triangles do not fill
    assert smooth.sum() == pytest.approx(np.pi * 13**2, rel=0.01)
    by = {}
    for edges in ("area", "silhouette"):
        _, by_points = frags.antialias_vjp(frags.mask, np.ones((36, 36)), edges=edges)
        by[edges] = (by_points[:, :2] * unit[:, :2]).sum() / (2 * np.pi * 13)
    assert by["area"] == pytest.approx(1, abs=0.03)
    assert by["silhouette"] < 0.5


def test_straight_through_leaves_the_picture_and_moves_the_triangle_in_front():
    points = np.array([[4.0, -20, 0], [12.25, 8, 0], [4, 36, 0], [-90, -90, 1], [90, -90, 1], [0, 90, 1]])
    frags = tl.rasterize(points, [[0, 1, 2], [3, 4, 5]], (16, 16))
    picture = np.where(frags.triangle == 0, 1.0, 0.25)
    assert np.array_equal(frags.antialias(picture, edges="straight-through"), picture)
    g = RNG.normal(size=(16, 16))
    by_picture, by_points = frags.antialias_vjp(picture, g, edges="straight-through")
    assert np.array_equal(by_picture, g)
    assert not by_points[3:].any()
    expected = 0.0
    for y in range(16):
        for x in range(15):
            if frags.triangle[y, x] != frags.triangle[y, x + 1]:
                sign = 1 if frags.triangle[y, x] == 0 else -1
                expected += sign * 0.75 * (g[y, x] + g[y, x + 1]) / 2
    np.testing.assert_allclose(by_points[:, 0].sum(), expected, rtol=1e-12)


# areas


@cache
def slopes_of_a_clipper():
    """Triangles, weights of the pixels, and the derivatives; None where a line of the grid is between two of them."""
    rng = np.random.default_rng(5)
    made = []
    for _ in range(20):
        points = rng.uniform(-3, 15, (3, 2))
        if rng.random() < 0.3:
            points = np.round(points)
        g = rng.normal(size=(12, 12))
        # On a line of the grid central differences give the mean.
        on_line = (points == np.round(points)).any()
        slopes = None if on_line else by_differences(lambda p, g=g: (g * areas(p, 12)).sum(), points, 1e-5)
        made.append((points, g, slopes))
    return made


@ON_EACH_ISA
def test_area_vjp_is_that_of_a_clipper(isa):
    for points, g, slopes in slopes_of_a_clipper():
        with on(isa):
            found = tl.area_vjp(points, [[0, 1, 2]], (12, 12), g)
        if slopes is not None:
            np.testing.assert_allclose(found, slopes, rtol=1e-5, atol=1e-6)


def test_area_vjp_with_colours_is_the_sum_over_channels():
    points, triangles = RNG.uniform(0, 10, (6, 2)), np.array([[0, 1, 2], [3, 4, 5]])
    colours, g = RNG.random((2, 3)), RNG.normal(size=(10, 10, 3))
    found = tl.area_vjp(points, triangles, (10, 10), g, colors=colours)
    parts = [tl.area_vjp(points, [row], (10, 10), g @ colour) for row, colour in zip(triangles, colours, strict=True)]
    np.testing.assert_allclose(found, sum(parts), rtol=1e-12)


def test_area_vjp_of_any_threads_has_the_same_bits():
    points, triangles = RNG.uniform(0, 40, (60, 2)), RNG.integers(0, 60, (50, 3))
    g = RNG.normal(size=(40, 40))
    one = tl.area_vjp(points, triangles, 40, g, threads=1)
    for threads in (2, 3, 50, None):
        assert_same(tl.area_vjp(points, triangles, 40, g, threads=threads), one)
    alone = [tl.area_vjp(points, [row], 40, g, threads=1) for row in triangles]
    np.testing.assert_allclose(one, sum(alone), rtol=1e-12, atol=1e-12)


def test_area_vjp_of_overdraw_on_the_grid_of_the_snap():
    points = np.round(RNG.uniform(1, 11, (3, 2)) * 2**16) / 2**16
    g, step = RNG.normal(size=(12, 12)), 2.0**-9

    def number(p):
        return (g * tl.overdraw(p, [[0, 1, 2]], (12, 12), sampling="area", subpixel_bits=16).astype(float)).sum()

    found = tl.area_vjp(points, [[0, 1, 2]], (12, 12), g)
    np.testing.assert_allclose(found, by_differences(number, points, step), atol=1e-2)


def test_area_vjp_of_huge_triangles_ends():
    points = np.array([[-1e9, -1e9], [1e9, 3.5], [-1e9, 1e12]])
    found = tl.area_vjp(points, [[0, 1, 2]], (8, 8), np.ones((8, 8)))
    assert np.isfinite(found).all()


# what is refused


FRAGS = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 2))


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: FRAGS.interpolate_vjp([1, 2, 3], np.ones((4, 2))), ValueError, "grad must have shape (2, 4)"),
        (lambda: FRAGS.interpolate_vjp([1, 2, 3], np.ones((2, 4)), grad_derivatives=np.ones((2, 4))), ValueError,
         "grad_derivatives must have shape (2, 4, 2)"),
        (lambda: FRAGS.barycentric_vjp(np.ones((2, 4))), ValueError, "grad must have shape (2, 4, 3)"),
        (lambda: FRAGS.sample_vjp([[1.0]], np.eye(3, 2), np.ones((4, 2))), ValueError, "grad must have shape (2, 4)"),
        (lambda: FRAGS.sample_vjp([[1.0]], np.eye(3), np.ones((2, 4))), ValueError, "uv must have two columns"),
        (lambda: FRAGS.sample_vjp([[1.0]], np.eye(3, 2), np.ones((2, 4)), wrap=("clamp", "repeat")), ValueError,
         "wrap must be the same for u and v where gradients are asked for"),
        (lambda: FRAGS.antialias(np.ones((3, 4))), ValueError, "picture must have shape (2, 4) or (2, 4, 'C')"),
        (lambda: FRAGS.antialias(np.ones((2, 4)), edges="all"), ValueError, "edges must be 'silhouette', 'area' or"),
        (lambda: tl.area_vjp(np.ones((3, 4)), [[0, 1, 2]], 4, np.ones((4, 4))), ValueError, "vertices must have shape"),
        (lambda: tl.area_vjp([[0, 0], [np.nan, 0], [0, 1]], [[0, 1, 2]], 4, np.ones((4, 4))), ValueError,
         "vertices must be finite, row 1 is not"),
        (lambda: tl.area_vjp([[0, 0], [1, 0], [0, 1]], [[0, 1, 3]], 4, np.ones((4, 4))), IndexError, "[0, 3)"),
        (lambda: tl.area_vjp([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], 4, np.ones(4)), ValueError, "grad must have shape"),
        (lambda: tl.area_vjp([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], 4, np.ones((4, 4)), colors=[1]), ValueError,
         "colors must have shape (1, C), got (1,)"),
    ],
)  # fmt: skip
def test_wrong_arguments_raise(call, kind, message):
    with pytest.raises(kind, match=re.escape(message)):
        call()


def test_layers_have_no_gradients():
    layers = tl.peel([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]], (4, 4))
    with pytest.raises(ValueError, match="gradients are those of rasterize and rasterize_mesh, not of layers"):
        layers.layer(0).antialias(np.ones((4, 4)))


def test_more_numbers_than_int32_counts_are_refused_before_they_are_read():
    many = np.broadcast_to(np.int32(0), (2**31 // 3 + 1, 3))
    with pytest.raises(ValueError, match=r"tri must have at most 2147483647 numbers a picture, got shape \(7158"):
        tensors.PixelGrid(many, 1, 2, 2)
    grid = tensors.PixelGrid(np.zeros((1, 3), np.int32), 1, 2, 2)
    attr, rast = np.broadcast_to(np.float32(0), (1, 2**29, 4)), np.zeros((1, 2, 2, 4), np.float32)
    with pytest.raises(ValueError, match="attr must have at most 2147483647 numbers a picture"):
        tensors.values(grid, attr, rast)
