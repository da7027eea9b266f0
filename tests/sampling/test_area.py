"""Exact areas: within the bound that docs/design/area.md proves, and to the last bit where they must be."""

from fractions import Fraction
from functools import cache, lru_cache

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, assert_same_everywhere, mixed, on, one_by_one
from strategies import Scene, needles, perspective, soup

import topleft as tl
from topleft import scenes
from topleft._core import engine
from topleft._core.base.memory import KeptMemory
from topleft._core.raster import choices, sampling
from topleft._core.raster.snap import snap_mesh
from topleft._core.raster.view import View
from topleft.methods.reference import area as ref

UNIT = 2.0**-24
SIDE = 12


def draw(scene, verb=tl.overdraw, **view):
    return verb(*scene.arrays, sampling="area", **(scene.view | view))


# ---- against fractions ----------------------------------------------------------------------------------------------


def strewn(rng, n, bits=8):
    """Triangles of all sizes and shapes about a small frame, some of them slivers or with corners on pixel borders."""
    reach = rng.choice([0.2, 1, 3, 9, 40, 700], (n, 1, 1))
    xy = rng.uniform(-3, SIDE + 3, (n, 1, 2)) + rng.uniform(-0.5, 0.5, (n, 3, 2)) * reach
    kind = rng.integers(0, 6, n)
    xy[kind == 0] = np.round(xy[kind == 0] * 2) / 2
    on_edge = (xy[:, 0] + xy[:, 1]) / 2 + rng.integers(-2, 3, (n, 2)) * 2.0**-bits
    xy[kind == 1, 2] = on_edge[kind == 1]
    xy[kind == 2, 1, 0] = xy[kind == 2, 0, 0]
    return [soup(corners, (SIDE, SIDE), subpixel_bits=bits) for corners in xy]


def through_clip_planes(rng, n):
    """Clip-space triangles that reach behind the eye."""
    eye = perspective(0.5, 9)
    for corners in rng.uniform(-2, 2, (n, 3, 3)) - [0, 0, 1.5]:
        yield soup(corners @ eye[:, :3].T + eye[:, 3], (SIDE, SIDE))


def far_out(rng, n):
    """Triangles as large as fixed point allows, and as far away, that reach into the frame."""
    for k in range(n):
        reach = 2.0 ** rng.integers(12, 53, (3, 2))
        corners = rng.uniform(-1, 1, (3, 2)) * reach
        corners[k % 3] = rng.uniform(0, SIDE, 2)
        if k % 2:
            corners[k % 3 - 1] += 2 * (rng.uniform(0, SIDE, 2) - (corners[k % 3 - 1] + corners[k % 3 - 2]) / 2)
        if k % 5 == 0:  # rows of the frame that a single edge passes for 2**50 pixels and more
            corners = rng.uniform(0, SIDE, (3, 2))
            corners[:2, 0] *= [-(2.0**50), 2.0**50]
        yield soup(corners, (SIDE, SIDE))


def at_limits(rng, n):
    """Triangles astride the limit between 32 and 64 bits, in windows on either side of the origin."""
    for bits, signs in [(b, s) for b in (0, 8, 16) for s in [(1, 0), (0, -1), (1, 1), (-1, -1), (-1, 1)]]:
        origin = tuple(sign * (2**30 >> bits) - SIDE // 2 for sign in signs)
        for scene in strewn(rng, n, bits):
            yield soup(scene.vertices + origin, scene.size, subpixel_bits=bits, origin=origin)


KINDS = {
    "strewn": lambda rng: strewn(rng, 300),
    "coarse": lambda rng: [s for bits in range(5) for s in strewn(rng, 25, bits)],
    "fine": lambda rng: [s for bits in (12, 16) for s in strewn(rng, 50, bits)],
    "clipped": lambda rng: through_clip_planes(rng, 50),
    "far": lambda rng: far_out(rng, 75),
    "limits": lambda rng: at_limits(rng, 8),
    "needles": lambda rng: [soup(c, (SIDE, SIDE)) for c in needles(rng, 50, SIDE).vertices.reshape(-1, 3, 2)],
}


@lru_cache(None)
def exact_areas(kind):
    made = list(KINDS[kind](np.random.default_rng(7)))
    return [(scene, ref.area(*scene.arrays, **scene.view)) for scene in made]


@ON_EACH_ISA
@pytest.mark.parametrize("kind", KINDS)
def test_area_of_one_triangle_is_within_bound(kind, isa):
    largest = n_partly = 0
    for scene, exact in exact_areas(kind):
        with on(isa):
            error = abs(draw(scene) - exact)
        n_partly += ((exact > 0) & (exact < 1)).sum()
        largest = max(largest, float(error.max()))
    assert n_partly > 100
    assert largest <= 1.503 * UNIT  # at most three edges in a pixel, 0.501 units each


@ON_EACH_ISA
def test_area_of_many_layers_is_within_bound(isa):
    """Past a sum of 1 float32 itself rounds by up to one unit in 2**24."""
    rng = np.random.default_rng(3)
    scene = soup(rng.uniform(-9, 9, (600, 2)) + [2, 1], (4, 2))
    exact, with_edges = cached_layers(scene.vertices.tobytes(), scene)
    with on(isa):
        got = draw(scene).astype(np.float64)
    assert exact.max() > 20
    assert (abs(got - exact) <= UNIT * (1.503 * with_edges + exact)).all()


LAYERS = {}


def cached_layers(key, scene):
    if key not in LAYERS:
        single = [ref.area(scene.vertices, [t], scene.size) for t in scene.triangles.tolist()]
        edges = sum(((a > 0) & (a < 1)).astype(int) for a in single)
        LAYERS[key] = sum(single).astype(np.float64), edges
    return LAYERS[key]


# ---- to the last bit ------------------------------------------------------------------------------------------------


@ON_EACH_ISA
@one_by_one("n", [1, 191, 192, 193, 255, 256, 4095, 4096, 65535, 65536])
def test_area_of_equal_layers_is_a_multiple(n, isa):
    one = soup([[0.3, -9], [4.6, 0], [0.7, 40]], (5, 3))
    many = Scene(one.vertices, np.repeat(one.triangles, n, 0), one.size)
    with on(isa):
        expected = (draw(one).astype(np.float64) * n).astype(np.float32)
        assert_same(draw(many), expected)
        assert_same(draw(many, tl.coverage), np.minimum(expected, 1))


@ON_EACH_ISA
@pytest.mark.parametrize("step", [1, -1])
def test_area_of_layers_that_begin_apart_is_their_number(step, isa):
    """The sum passes what 32 bits hold although no cell does, on the way up or down."""
    corners = np.tile([[0, -9], [0, 9], [60.0, -9], [60, -9], [0, 9], [60, 9]], (300, 1, 1))
    corners[:, [0, 1, 4], 0] = np.arange(300)[:, None] // 30
    layers = soup(corners.reshape(-1, 2) * [step, 1] + [20 - 20 * step, 0], (40, 3))
    expected = np.float32(30) * np.minimum(np.arange(40, dtype=np.float32) + 1, 10)
    with on(isa):
        assert_same(draw(layers), np.tile(expected[::step], (3, 1)))


def rotated_grid(n, angle, size):
    """A square grid of n by n cells, rotated about the middle of a frame that it covers, cells cut by a diagonal."""
    at = (np.stack(np.meshgrid(np.arange(n + 1), np.arange(n + 1)), -1).reshape(-1, 2) / n - 0.5) * 1.6 * max(size)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1)
    b, c, d = a + 1, a + n + 1, a + n + 2
    return Scene(at @ turn + np.array(size) / 2, np.concatenate([np.stack([a, b, c], 1), np.stack([d, b, c], 1)]), size)


def fan(n, reach, size, rng):
    """Triangles about one point, out to a circle that holds the frame."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, n))
    angle[:4] = [0, 2, 4, 6]
    angle = np.sort(angle)
    rim = np.stack([np.cos(angle), np.sin(angle)], -1) * reach + np.array(size) / 2
    i = np.arange(n)
    middle = rng.uniform(0, size, (1, 2))
    return Scene(np.concatenate([rim, middle]), np.stack([i, (i + 1) % n, np.full(n, n)], 1), size)


def tilings():
    rng = np.random.default_rng(5)
    size = (90, 70)
    yield from (rotated_grid(n, angle, size) for n, angle in [(1, 0.3), (7, 0.1), (40, 1.0), (150, 0.7), (300, 0.0)])
    yield from (fan(60, reach, size, rng) for reach in (120, 20_000, 1e6, 2.0**40))
    vertices, triangles = scenes.planar_mesh(3000, *size)[:2]
    yield Scene(vertices, triangles, size)


@ON_EACH_ISA
@pytest.mark.parametrize("bits", [6, 8, 16])  # coarser snaps would fold the mesh
def test_area_of_a_tiling_is_one(bits, isa):
    for scene in tilings():
        with on(isa):
            assert (draw(scene, subpixel_bits=bits) == 1).all()


def crowd():
    """Triangles of every class, some of them huge, in a frame of odd size."""
    rng = np.random.default_rng(11)
    parts = [mixed(rng, 2500, (131, 67)), needles(rng, 60, 60)]
    vertices = np.concatenate([p.vertices[:, :2] for p in parts])
    return soup(np.concatenate([vertices, rng.uniform(-1e6, 1e6, (90, 2))]), (131, 67))


def test_area_is_the_same_everywhere():
    scene = crowd()

    def draw_there(size, **view):
        return [draw(Scene(scene.vertices, scene.triangles, size), **view)]

    windows = [(0, 0, 1, 1), (5, 7, 33, 20), (64, 1, 67, 66), (130, 66, 1, 1), (17, 40, 16, 3)]
    assert_same_everywhere(draw_there, scene.size, [(w[:2], w[2:]) for w in windows])


@ON_EACH_ISA
def test_area_of_a_window_far_away_is_the_same(isa):
    """Moved by a power of two, fixed point keeps every bit of a triangle."""
    rng = np.random.default_rng(2)
    scene = soup(rng.uniform(-9, 40, (120, 2)), (30, 20))
    with on(isa):
        for shift in (2**20, -(2**20)):
            moved = Scene(scene.vertices + shift, scene.triangles, scene.size)
            assert_same(draw(moved, origin=(shift, shift)), draw(scene))
        nothing = draw(scene, origin=(2**50, 0))
        assert not nothing.any()


@ON_EACH_ISA
def test_area_does_not_depend_on_order_or_turn(isa):
    scene = crowd()
    rng = np.random.default_rng(0)
    order = rng.permutation(scene.triangles)
    with on(isa):
        assert_same(draw(Scene(scene.vertices, order[:, [1, 0, 2]], scene.size)), draw(scene))


@ON_EACH_ISA
def test_area_of_both_sides_is_the_whole(isa):
    scene = crowd()
    scene = Scene(scene.vertices, scene.triangles[:200], (20, 20))
    with on(isa):
        back, front, whole = (draw(scene, cull=cull).astype(np.float64) for cull in ("back", "front", "none"))
    assert back.any()
    assert front.any()
    assert (abs(back + front - whole) <= UNIT * (4 + whole)).all()


# ---- the calls ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(0, 5), (5, 0), (3, 2)])
def test_area_of_nothing_is_zero(shape):
    empty = tl.coverage(np.zeros((0, 2)), np.zeros((0, 3), int), shape, sampling="area")
    assert (empty.shape, empty.dtype, empty.any()) == (shape[::-1], np.float32, False)


def test_area_rasterizer_leaves_its_cells_clear():
    one, other = crowd(), rotated_grid(9, 0.4, (131, 67))
    rasterizer = tl.Rasterizer((131, 67))
    for scene in (one, other, Scene(one.vertices, np.repeat(one.triangles[:40], 300, 0), one.size), one):
        got = rasterizer.overdraw(scene.vertices, scene.triangles, sampling="area")
        assert_same(got, draw(scene))


def test_area_after_a_bad_index_is_right():
    scene = rotated_grid(9, 0.4, (40, 30))
    for triangles in ([[0, 1, 2], [0, 1, 100]], [[0, 1, 2]] * 40 + [[0, -1, 2]]):
        with pytest.raises(IndexError, match=f"row {len(triangles) - 1}"):
            tl.coverage(scene.vertices, np.array(triangles, np.int32), scene.size, sampling="area")
        assert (draw(scene) == 1).all()


def test_area_goes_to_out():
    out = np.full((6, 4), 9, np.float32)[::2]
    assert draw(soup([[0, 0], [4, 0], [0, 1]], (4, 3)), tl.coverage, out=out) is out
    assert out.tolist() == [[0.875, 0.625, 0.375, 0.125], [0] * 4, [0] * 4]


def test_area_gives_no_ids():
    with pytest.raises(ValueError, match="sampling 'area' gives no ids"):
        tl.rasterize([[0, 0], [4, 0], [0, 1]], [[0, 1, 2]], (4, 3), sampling="area")


def test_area_reference_adds_up_to_the_triangle():
    assert ref.area([[0.5, 0.25], [7, 1], [3, 5.5]], [[0, 1, 2]], (8, 6)).sum() == Fraction(6.5 * 5.25 - 0.75 * 2.5) / 2


def test_shallow_edge_across_the_left_border_needs_no_wide_cells():
    corners = np.array([[0.82, 18.04], [-13.3, 15.85], [-7.85, 4.55]])
    view = View.parse((40, 30), {"sampling": "area"})
    snapped = snap_mesh(KeptMemory(), corners, np.array([[0, 1, 2]], np.int32), view, with_depth=False, out=None)
    cells = KeptMemory().constant("cells", 30 * engine.area_stride(40), engine.CELL_CLEAR)
    narrow, wide = np.empty((30, 40), np.float32), np.empty((30, 40), np.float32)
    assert snapped.mesh.draw_area(narrow, engine.as_bytes(cells), 0, 30, False, True) == -1
    wide_cells = np.zeros(len(cells), np.int64)
    assert snapped.mesh.draw_area(wide, engine.as_bytes(wide_cells), 0, 30, True, True) == -1
    assert (narrow == wide).all()
    assert narrow[:, 0].any()


@ON_EACH_ISA
def test_edges_across_the_right_border_need_no_wide_cells(isa):
    vertices, triangles, _ = scenes.random_triangles(100, 8, 40, 30)
    for width in range(1, 40):  # with vectors that end beside the window, and with none
        view = View.parse((width, 30), {"sampling": "area"})
        with on(isa):
            snapped = snap_mesh(KeptMemory(), vertices[:, :2], triangles, view, with_depth=False, out=None)
            cells = KeptMemory().constant("cells", 30 * engine.area_stride(width), engine.CELL_CLEAR)
            pixels = np.empty((30, width), np.float32)
            assert snapped.mesh.draw_area(pixels, engine.as_bytes(cells), 0, 30, False, True) == -1


# ---- large shapes ---------------------------------------------------------------------------------------------------

LARGE = np.array(
    [[3.3, 2.1], [180.7, 20.2], [70.4, 45.9], [10, 35], [199, 1], [210, 49], [100.5, 20], [100.6, 21], [115, 20]]
)
LARGE_TRIANGLES = np.arange(9).reshape(3, 3)


@cache
def areas_of_large_shapes():
    return np.array(sum(ref.area(LARGE, [row], (205, 49)) for row in LARGE_TRIANGLES.tolist()), float)


@ON_EACH_ISA
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("verb", [tl.coverage, tl.overdraw])
def test_large_shapes_have_the_same_areas_in_bands_of_any_height(isa, threads, verb):
    def draw_in(n_bytes):
        with choices.forced(area_bytes=n_bytes, area_triangle=0.0, near_pixels=0):
            return verb(LARGE, LARGE_TRIANGLES, (205, 49), sampling="area", threads=threads)

    with on(isa):
        whole = draw_in(1 << 30)
        for n_bytes in (1, 6000, 20_000):
            assert_same(draw_in(n_bytes), whole)
    expected = areas_of_large_shapes()
    error = np.abs((np.minimum(expected, 1) if verb is tl.coverage else expected) - whole).max()
    assert error < 2**-24 * (0.501 * 9 + 3)  # three edges of each triangle, and the sum


def test_bands_of_areas_stay_in_the_cache_or_are_as_few_as_threads():
    height, width = 2160, 3840
    assert sampling.area_band(height, width, 1, in_bands=True) == 64
    assert sampling.area_band(height, width, 1, in_bands=False) == height
    assert sampling.area_band(height, width, 2, in_bands=False) == height // 2
    assert sampling.area_band(height, width, 2, in_bands=True) == 64


def test_areas_of_tall_triangles_and_not_of_many_low_ones_are_summed_in_bands():
    def is_sorted(n, px):
        vertices, triangles, _ = scenes.random_triangles(n, px, 1920, 1080)
        return tl.plan(vertices[:, :2], triangles, (1920, 1080), outputs="overdraw", sampling="area").explain()

    said = "one band after the other"
    assert said in is_sorted(1000, 300)
    assert said in is_sorted(4000, 40)
    assert said not in is_sorted(40_000, 5)


def test_a_picture_beyond_the_bound_of_cells_is_summed_in_several_bands(monkeypatch):
    monkeypatch.setattr(sampling, "MAX_CELLS", 7 * engine.area_stride(40))
    vertices, triangles, _ = scenes.random_triangles(300, 20, 40, 30)
    whole = tl.overdraw(vertices[:, :2], triangles, (40, 30), sampling="area", threads=1)
    monkeypatch.undo()
    assert_same(tl.overdraw(vertices[:, :2], triangles, (40, 30), sampling="area", threads=2), whole)
