"""The engine at the ends of arrays: tails of vectors, pages that must not be touched, special vertices, threads."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import DEPTH_TESTS, ON_EACH_ISA, THREADS, Expected, cases, check_all, mixed, on, plain
from pages import before_a_page, behind_a_page
from strategies import Scene, perspective, soup

import topleft as tl
from topleft.methods import reference as ref

N_MAX = 70  # more than four vectors of the widest instruction set
N_LANES = {"scalar": 1, "simd128": 4, "avx2": 8, "avx512": 16}

# ---- tails of vectors -----------------------------------------------------------------------------------------------


def first_triangles():
    scene = mixed(np.random.default_rng(0), N_MAX, (33, 21), level=False)
    for n in range(N_MAX + 1):
        yield Scene(scene.vertices, scene.triangles[:n], scene.size), DEPTH_TESTS


@ON_EACH_ISA
def test_engine_each_number_of_triangles_equals_exact_picture(isa):
    check_all(isa, cases(first_triangles), THREADS)


KINDS = {
    "f32 xy": (np.float32, 2), "f64 xy": (np.float64, 2), "i64 xy": (np.int64, 2),
    "f32 xyz": (np.float32, 3), "f64 xyz": (np.float64, 3), "i64 xyz": (np.int64, 3),
    "f32 clip": (np.float32, 4), "f64 clip": (np.float64, 4),
    "f32 object": (np.float32, 3), "f64 object": (np.float64, 3),
}  # fmt: skip
EACH_KIND = pytest.mark.parametrize("kind", KINDS)


def few_vertices(kind, n, size=(19, 13)):
    """A scene of n vertices, all of them in use where there are at least three."""
    rng, (dtype, n_components) = np.random.default_rng(n), KINDS[kind]
    view = {"threads": 1}
    if kind.endswith(("xy", "xyz")):
        vertices = rng.uniform(-2, 21, (n, n_components))
    elif kind.endswith("clip"):
        vertices = np.hstack([rng.uniform(-1, 1, (n, 3)), np.ones((n, 1))]) * rng.uniform(0.5, 2, (n, 1))
    else:
        vertices = rng.uniform(-1, 1, (n, 3)) - [0, 0, 3]
        view["transform"] = perspective(1, 9, focal=2.0)
    ends = np.array([[n - 3, n - 2, n - 1], [0, n // 2, n - 1]])
    triangles = np.concatenate([ends, rng.integers(0, n, (30, 3))]) if n >= 3 else np.zeros((0, 3), np.int32)
    return Scene(vertices.astype(dtype), triangles.astype(np.int32), size, view)


def each_number_of_vertices(kind):
    for n in (*range(36), *range(62, N_MAX + 1)):  # each tail of up to two vectors of 16, and round 64
        scene = few_vertices(kind, n)
        yield scene, (None,) if kind.endswith("xy") else ("less", "greater")


@ON_EACH_ISA
@EACH_KIND
def test_engine_each_number_of_vertices_equals_exact_picture(kind, isa):
    check_all(isa, cases(each_number_of_vertices, kind))


# ---- pages that must not be touched ---------------------------------------------------------------------------------


def draw_all(scene, guard, *, with_colors):
    """Every verb and attribute, all arrays and results as `guard` places them."""
    rng = np.random.default_rng(0)
    vertices, triangles = guard(scene.vertices), guard(scene.triangles)
    shape = scene.size[::-1]

    def out(*channels, dtype):
        return guard(np.zeros(shape + channels, dtype))

    view = scene.view
    yield tl.coverage(vertices, triangles, scene.size, out=out(dtype=bool), **view)
    yield tl.overdraw(vertices, triangles, scene.size, out=out(dtype=np.int32), **view)
    for test in DEPTH_TESTS:
        pair = out(dtype=np.int32), out(dtype=np.float32)
        frags = tl.rasterize(vertices, triangles, scene.size, depth_test=test, out=pair, **view)
        yield from (frags.triangle, frags.depth)
    yield frags.barycentric()
    yield frags.interpolate(guard(rng.standard_normal((len(vertices), 3)).astype(np.float32)))
    for per, n in {"triangle": len(triangles), "vertex": len(vertices)}.items() if with_colors else ():
        for dtype, n_channels in [(np.uint8, 1), (np.uint8, 3), (np.uint8, 4), (np.float32, 2), (np.float32, 3)]:
            colors = guard(rng.integers(0, 256, (n, n_channels)).astype(dtype))
            yield tl.fill(vertices, triangles, colors, scene.size, per=per, out=out(n_channels, dtype=dtype), **view)


def check_page_ends():
    """Pictures from arrays between inaccessible pages are the usual ones; a stray access ends the process."""
    n_lanes = N_LANES[tl.build_info()["isa"]]
    # Each tail of up to two vectors, round four, and round 64.
    tails = sorted({*range(2 * n_lanes + 4), *range(4 * n_lanes - 1, 4 * n_lanes + 2), *range(62, N_MAX + 1)})
    for kind, n in product(KINDS, tails):
        print(f"{kind} {n}", flush=True)
        scene = few_vertices(kind, n, size=(1 + n, 1 + n % 7))
        scene = Scene(scene.vertices, np.tile(scene.triangles, (3, 1))[:n], scene.size, scene.view)
        with_colors = kind in ("f32 xy", "f64 clip")  # rows of colours are read by number, whatever the vertices are
        usual = list(draw_all(scene, np.copy, with_colors=with_colors))
        for guard in (before_a_page, behind_a_page):
            for one, expected in zip(draw_all(scene, guard, with_colors=with_colors), usual, strict=True):
                assert_same(one, expected)


@cache
def child_on(isa):
    """Exit code and output of a process that forks, draws in both, and then draws at the ends of pages."""
    code = "import test_engine_memory as t; print(*t.fork_and_draw(), flush=True); t.check_page_ends()"
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    environment = os.environ | {"TOPLEFT_ISA": isa, "PYTHONPATH": path}
    run = subprocess.run([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True, timeout=600)
    return run.returncode, run.stdout.splitlines()


@pytest.mark.skipif(sys.platform == "win32", reason="mprotect is POSIX")
@ON_EACH_ISA
def test_engine_arrays_at_page_ends_are_not_left(isa):
    status, lines = child_on(isa)
    assert (status, lines[-1]) == (0, f"f64 object {N_MAX}")


# ---- special vertices, whole vectors of them ------------------------------------------------------------------------


def run_lengths(rng, n, n_kinds):
    """A kind for each of n triangles: runs of 1 to 40 of a kind."""
    return np.repeat(rng.integers(0, n_kinds, n), rng.choice([1, 2, 5, 16, 24, 40], n))[:n]


def clip_kinds(seed, n=90, size=(15, 11)):
    """Inside; behind the eye; cut by the near plane; far to the side, in 128 bits; beyond the far plane; mixed."""
    rng = np.random.default_rng(seed)
    vertices = np.dstack([rng.uniform(-0.9, 0.9, (n, 3, 3)), np.ones((n, 3, 1))])
    kind = run_lengths(rng, n, 6)
    vertices[kind == 1, :, 3] = -1
    vertices[kind == 2, 0, 2] = -3
    vertices[kind == 3, :, :2] *= 2.0 ** rng.integers(20, 40, (np.sum(kind == 3), 3, 1))
    vertices[kind == 4, :, 2] = 3
    vertices[kind == 5] += rng.uniform(-1, 1, (np.sum(kind == 5), 3, 4))
    return soup(vertices.reshape(-1, 4), size)


def pixel_kinds(seed, n=90, size=(15, 11)):
    """In 64 bits; in 128 bits; one corner in 128 bits."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-3, 18, (n, 3, 2))
    kind = run_lengths(rng, n, 3)
    xy[kind == 1] *= 2.0 ** rng.integers(23, 45, (np.sum(kind == 1), 1, 1)) * rng.choice([1, -1], (3, 2))
    xy[kind == 2, 1] *= -(2.0**25)
    return soup(np.dstack([xy, rng.standard_normal((n, 3))]).reshape(-1, 3), size)


def limit_kinds(seed, n=40, size=(15, 11)):
    """Corners within two units of 2**29, 2**30 and 2**31, and edges from there through the window."""
    rng, bits = np.random.default_rng(seed), [8, 0, 16, 3][seed]
    corners = 2 ** rng.integers(29, 32, (n, 3, 2)) * rng.choice([-1, 1], (n, 3, 2)) + rng.integers(-2, 3, (n, 3, 2))
    origin = rng.integers(-(2**30), 2**30, 2) >> bits
    opposite = 2 * (origin + rng.integers(0, 12, (n, 2))) * 2**bits - corners[:, 0]
    corners[:, 1] = np.where(rng.integers(0, 4, (n, 1)) > 0, opposite, corners[:, 1])
    xyz = np.dstack([corners * 2.0**-bits, rng.standard_normal((n, 3))])
    return soup(xyz.reshape(-1, 3), size, subpixel_bits=bits, origin=tuple(origin.tolist()))


@cache
def special(make):
    """Scenes, each with counts and painted ids of the reference; the others are plain."""
    made = []
    for seed in range(4):
        scene = make(seed)
        painted = plain(scene, None)
        assert_same(painted.triangle, ref.ids(*scene.arrays, depth_test=None, **scene.view))
        counts = ref.overdraw(*scene.arrays, **scene.view)
        seen = {test: plain(scene, test) for test in DEPTH_TESTS}
        ids, depth = ({test: getattr(f, name) for test, f in seen.items()} for name in ("triangle", "depth"))
        made.append((scene, Expected(counts, ids, depth)))
    return made


@ON_EACH_ISA
@pytest.mark.parametrize("make", [clip_kinds, pixel_kinds, limit_kinds])
def test_engine_vectors_of_special_vertices_equal_reference(make, isa):
    check_all(isa, special(make), (1, 3))


@ON_EACH_ISA
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind[0] == "f"])
def test_engine_each_place_of_a_bad_vertex_is_named(kind, isa):
    beyond = 2.0**60 if kind.endswith(("xy", "xyz")) else np.nan
    for n in (3, 17, 40):
        for place in range(n):
            scene = few_vertices(kind, n)
            bad, column = [(np.nan, 0), (np.inf, 1), (-np.inf, -1), (beyond, 1), (np.nan, 2)][place % 5]
            scene.vertices[place, min(column, KINDS[kind][1] - 1)] = bad
            used = np.append(scene.triangles, [[place, 0, n - 1]], axis=0)
            with on(isa), pytest.raises(ValueError, match=f"in row {place}$"):
                tl.rasterize(scene.vertices, used, scene.size, **scene.view)


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_engine_each_place_of_a_bad_index_is_named(dtype, isa):
    scene = few_vertices("f64 xy", 20)
    for n in (1, 17, 40):
        for place in range(3 * n):
            triangles = np.resize(scene.triangles, (n, 3)).astype(dtype)
            triangles.flat[place] = [-1, 20, 2**31 - 1, -(2**31)][place % 4]
            with on(isa), pytest.raises(IndexError, match=f"row {place // 3} is"):
                tl.coverage(scene.vertices, triangles, scene.size, threads=1)


# ---- threads and processes ------------------------------------------------------------------------------------------


@ON_EACH_ISA
def test_engine_rasterizers_in_four_threads_draw_as_one(isa):
    todo = [mixed(np.random.default_rng(seed), 4000, (97, 61), level=bool(seed % 2)) for seed in range(8)]
    expected = [plain(scene, "less") for scene in todo]

    def draw(scene):
        rasterizer = tl.Rasterizer(scene.size, threads=2)
        for _ in range(10):
            frags = rasterizer.rasterize(*scene.arrays[:2])
        return frags

    with on(isa), ThreadPoolExecutor(4) as pool:
        for got, one in zip(pool.map(draw, todo), expected, strict=True):
            assert_same(got.triangle, one.triangle)
            assert_same(got.depth, one.depth)


def fork_and_draw():
    """Exit code of a forked child that draws, and whether the parent still can."""
    scene = mixed(np.random.default_rng(0), 5000, (97, 61))
    before = tl.rasterize(*scene.arrays, threads=3).triangle
    child = os.fork()
    if child == 0:
        os._exit(not np.array_equal(tl.rasterize(*scene.arrays, threads=3).triangle, before))
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status), np.array_equal(tl.rasterize(*scene.arrays, threads=3).triangle, before)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="fork is POSIX")
@ON_EACH_ISA
def test_engine_forked_after_use_draws_in_both(isa):
    assert child_on(isa)[1][0] == "0 True"
