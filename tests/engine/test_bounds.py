"""Bounds of depth: large triangles leave out hidden spans, and no bit of a picture changes."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, on
from pages import before_a_page, behind_a_page

import topleft as tl
from topleft._core import engine
from topleft._core.base.memory import FreshMemory
from topleft._core.base.options import Sink
from topleft._core.raster import choices
from topleft._core.raster.choices import Route
from topleft._core.raster.rasterize import draw_fragments, fragment_options
from topleft._core.raster.snap import snap_mesh
from topleft._core.raster.view import View

SIZES = [(700, 90), (1000, 40), (260, 200), (129, 33), (64, 64)]


def sheets(rng, n, size):
    """Triangles much larger than the picture, some equal, some level, some crossing, in any order."""
    corners = rng.uniform(-1.5, 2.5, (n, 3, 2)) * size
    depth = rng.uniform(0, 1, (n, 1)) + rng.choice([0.0, 0.01, 0.5], (n, 1)) * rng.uniform(-1, 1, (n, 3))
    return corners, depth


def mixture(rng, n, size):
    """Large triangles beside small ones, slivers and twins, whose depths meet those of others exactly."""
    corners, depth = sheets(rng, n, size)
    small = rng.uniform(size=n) < 0.4
    corners[small] = corners[small, :1] + rng.uniform(-20, 20, (small.sum(), 3, 2))
    thin = rng.uniform(size=n) < 0.1
    corners[thin, 2] = (corners[thin, 0] + corners[thin, 1]) / 2 + rng.uniform(-0.1, 0.1, (thin.sum(), 2))
    depth[rng.uniform(size=n) < 0.3] = 0.5
    twins = rng.integers(0, n, (2, n // 5))
    corners[twins[0]], depth[twins[0]] = corners[twins[1]], depth[twins[1]]
    return corners, depth


def scene(rng, n, size):
    corners, depth = rng.choice([sheets, mixture])(rng, n, np.array(size))
    order = rng.choice(["any", "front", "back"])
    if order != "any":
        rows = np.argsort(depth.mean(axis=1) * (1 if order == "front" else -1), kind="stable")
        corners, depth = corners[rows], depth[rows]
    points = np.concatenate([corners, depth[..., None]], axis=-1).reshape(-1, 3).astype(np.float32)
    return points, np.arange(3 * n, dtype=np.int32).reshape(-1, 3)


def draw(points, triangles, size, *, bounded, force, test="less", out=None, **view):
    pays = []
    force(pays_to_bound=lambda *_: pays.append(1) or bounded)
    view = View.parse(size, view)
    frags = draw_fragments(FreshMemory(), points, triangles, view, fragment_options(view, test, None, out))
    assert pays
    return frags


def assert_same_fragments(got, expected):
    assert_same(got.triangle, expected.triangle)
    assert_same(got.depth.view(np.int32), expected.depth.view(np.int32))


@ON_EACH_ISA
@pytest.mark.parametrize("seed", range(4))
def test_picture_has_the_same_bits(isa, seed, force):
    rng = np.random.default_rng(seed)
    with on(isa):
        for i in range(30):
            size = SIZES[i % len(SIZES)]
            mesh = scene(rng, int(rng.integers(2, 40)), size)
            options = {
                "test": str(rng.choice(["less", "greater"])),
                "origin": tuple(int(k) for k in rng.integers(-50, 50, 2)),
                "subpixel_bits": int(rng.choice([0, 4, 8, 8, 12, 16])),
                "cull": str(rng.choice(["none", "back"])),
                "method": str(rng.choice(["auto", "auto", "scanline", "edge"])),
            }
            expected = draw(*mesh, size, bounded=False, force=force, threads=1, **options)
            place = before_a_page if i % 2 else behind_a_page
            out = place(np.zeros(size[::-1], np.int32)), place(np.zeros(size[::-1], np.float32))
            threads = THREADS[i % len(THREADS)]
            got = draw(*mesh, size, bounded=True, force=force, threads=threads, out=out, **options)
            assert_same_fragments(got, expected)


@ON_EACH_ISA
def test_shares_of_triangles_keep_the_bounds_of_their_rows(isa, force):
    force(is_sliced=True)
    size, rng = (600, 80), np.random.default_rng(3)
    with on(isa):
        for _ in range(10):
            mesh = scene(rng, 50, size)
            expected = draw(*mesh, size, bounded=False, force=force, threads=1)
            assert_same_fragments(draw(*mesh, size, bounded=True, force=force, threads=3), expected)


@ON_EACH_ISA
def test_equal_depth_behind_a_bound_goes_to_the_lower_index(isa, force):
    whole = np.array([[-10, -10, 0.5], [2000, -10, 0.5], [-10, 2000, 0.5]], np.float32)
    points = np.concatenate([whole, whole, whole + [0, 0, 0.25]]).astype(np.float32)
    triangles = np.array([[6, 7, 8], [3, 4, 5], [0, 1, 2]], np.int32)
    with on(isa):
        frags = draw(points, triangles, (300, 8), bounded=True, force=force)
        assert (frags.triangle == 1).all()
        frags = draw(points, triangles[::-1], (300, 8), bounded=True, force=force)
        assert (frags.triangle == 0).all()


def test_what_lies_behind_is_not_drawn_at_all():
    """A buffer that claims to hold only what is nearest at all keeps what it holds."""
    whole = np.array([[-10, -10, 0.5], [2000, -10, 0.5], [-10, 2000, 0.5]], np.float32)
    size = 300, 8
    view = View.parse(size, {})
    mesh = snap_mesh(FreshMemory(), whole, np.array([[0, 1, 2]]), view, with_depth=True, out=None).mesh
    ids, depth = np.empty(size[::-1], np.int32), np.empty(size[::-1], np.float32)
    bounds = np.empty(engine.Target.bounds_shape(*size[::-1]), np.float32)
    target = engine.Target(Sink.NEAREST, ids, depth, None, bounds=bounds)
    mesh.draw(target, 0, size[1])
    assert (ids == 0).all()
    assert (bounds[:, :4] == 0.5).all()
    assert (bounds[:, 4] == np.inf).all()  # 44 columns of 64
    bounds[...] = 0.25
    ids[...], depth[...] = 7, 1.0
    mesh.draw_listed(target, 0, size[1], np.zeros(1, np.int32), True)
    assert (ids == 7).all()


@pytest.mark.parametrize(
    ("n", "reach", "width", "pays"), [(300, 500, 1280, True), (3000, 30, 1280, False), (300, 500, 128, False)]
)
def test_bounds_are_kept_for_large_triangles(n, reach, width, pays):
    rng, size = np.random.default_rng(1), (width, 720)
    corners = rng.uniform(0, 1, (n, 1, 2)) * size + rng.uniform(-reach, reach, (n, 3, 2))
    points = np.concatenate([corners, rng.uniform(size=(n, 3, 1))], axis=-1).reshape(-1, 3)
    view = View.parse(size, {})
    snapped = snap_mesh(FreshMemory(), points, np.arange(3 * n).reshape(-1, 3), view, with_depth=True, out=None)
    route, drawing = choices.route(view, snapped.work, "less", wants_depth=False)
    assert (route, drawing.is_bounded) == (Route.DEPTH, pays)


def test_plan_tells_of_bounds():
    points, triangles, _ = tl.scenes.random_triangles(300, 400, 1280, 720)
    plan = tl.plan(points, triangles, (1280, 720))
    assert "leave out hidden spans" in next(row.choice for row in plan.stages if row.name == "depth")
