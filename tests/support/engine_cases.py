"""What the engine must draw, and whether it does: on one instruction set and another, with any number of threads."""

import inspect
import pickle
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import lru_cache, wraps
from typing import NamedTuple

import numpy as np
import pytest
from comparing import assert_same
from strategies import soup

import topleft as tl
from topleft._core import engine
from topleft._core.raster import choices
from topleft._core.raster.clusters import Clusters
from topleft.methods.reference.integers import ExactPicture, projected, snapped

THREADS = (1, 2, 5)
DEPTH_TESTS = ("less", "greater", None)


def one_by_one(names, values):
    """A mark as `pytest.mark.parametrize`, of one test that takes each value in turn and notes which one failed.

    What a value has patched or forced is undone before the next.
    """
    names, rows = ((names,), [(value,) for value in values]) if isinstance(names, str) else (names, values)

    def mark(test):
        @wraps(test)
        def in_turn(**options):
            for row in rows:
                with pytest.MonkeyPatch.context() as patch, ExitStack() as stack:
                    own = {"monkeypatch": patch, "force": lambda **kw: stack.enter_context(choices.forced(**kw))}
                    given = dict(zip(names, row, strict=True))
                    try:
                        test(**options | {key: own[key] for key in own.keys() & options.keys()} | given)
                    except BaseException as error:
                        error.add_note(f"with {given}")
                        raise

        signature = inspect.signature(test)
        others = [each for each in signature.parameters.values() if each.name not in names]
        in_turn.__signature__ = signature.replace(parameters=others)
        return in_turn

    return mark


ON_EACH_ISA = one_by_one("isa", tl.build_info()["isa_available"])


def kept(exact):
    """A slow reference that keeps its answers: every instruction set is compared with the same one."""
    answers = {}

    def answer(*arguments, **options):
        key = pickle.dumps((arguments, options))
        if key not in answers:
            answers[key] = exact(*arguments, **options)
        return answers[key]

    return answer


@contextmanager
def on(isa):
    """Run on the kernels of one instruction set."""
    before = engine.isa_in_use()
    engine.use_isa(isa)
    try:
        yield
    finally:
        engine.use_isa(before)


def assert_same_everywhere(draw, size, windows=(), threads=THREADS):
    """Pictures have the same bits on each instruction set and with any threads, and windows hold their crops.

    `draw` takes a size and options of a view, and gives some pictures; windows are (origin, size).
    """
    whole = None
    for isa in tl.build_info()["isa_available"]:
        with on(isa):
            for n in threads:
                got = list(draw(size, threads=n))
                whole = whole or got
                for one, expected in zip(got, whole, strict=True):
                    assert_same(one, expected)
            for (x, y), (width, height) in windows:
                for one, expected in zip(draw((width, height), origin=(x, y), viewport=size), whole, strict=True):
                    assert_same(one, expected[y : y + height, x : x + width])


def flat_grid(side=129):
    """A square of equal triangles: (V, 3) vertices and triangles."""
    x, y = np.meshgrid(*[np.linspace(-1, 1, side)] * 2)
    corner = np.arange(side * side).reshape(side, side)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, :-1], corner[1:, 1:]
    return np.stack([x, y, 0 * x], -1).reshape(-1, 3), np.stack([a, c, b, b, c, d], axis=-1).reshape(-1, 3)


def small_views(rng, n):
    """Views in which a unit of space is few pixels, or part of one; in some, edges of a flat grid lie on samples."""
    for _ in range(n):
        eye = rng.normal(size=3) if rng.uniform() < 0.6 else np.array([0.0, 0.0, 1.0])
        eye *= rng.choice([3.0, 10.0, 30.0, 100.0, 400.0]) / np.linalg.norm(eye)
        size = tuple(rng.integers(1, (160, 120)).tolist())
        viewport = tuple(side * int(rng.choice([1, 1, 4])) for side in size)
        ortho_height = float(rng.choice([2, 3, 16, 128, size[1] / 8])) if rng.uniform() < 0.5 else None
        middle = rng.uniform(-0.5, 0.5, 3) * rng.choice([0, 1])
        camera = tl.Camera.look_at(eye, middle, (0.1, 1, 0), near=0.01, far=1e4, ortho_height=ortho_height)
        yield {
            "size": size,
            "transform": camera.clip_from_world(viewport),
            "viewport": viewport,
            "origin": tuple(rng.integers((-5, -5), np.subtract(viewport, size) + 6).tolist()),
            "cull": str(rng.choice(["none", "back", "front"])),
            "subpixel_bits": int(rng.choice([0, 4, 8, 8])),
        }  # fmt: skip


@dataclass(frozen=True)
class Expected:
    """Pictures of a scene; ids and depth by depth test."""

    counts: np.ndarray
    ids: dict
    depth: dict


def exact_picture(scene, tests=DEPTH_TESTS):
    """The exact picture of a scene in pixels or in clip space, after the snap."""
    view = dict(scene.view)
    bits, transform = view.get("subpixel_bits", 8), view.get("transform")
    if transform is not None or scene.vertices.shape[1] == 4:
        vertices = projected(scene.vertices, view.get("viewport", scene.size), bits, transform)
    else:
        vertices = snapped(scene.vertices, bits)
    options = {"origin": view.get("origin", (0, 0)), "cull": view.get("cull", "none"), "depth_tests": tests}
    return ExactPicture(vertices, scene.triangles, scene.size, **options)


def expect(scene, tests=DEPTH_TESTS):
    """Counts and ids of the exact picture, and the plain depths, which lie within their bound of its own."""
    picture = exact_picture(scene, tests)
    depth = {test: plain(scene, test).depth for test in tests}
    for test, ids in picture.ids.items():
        exact, largest = picture.depth(ids)
        with np.errstate(invalid="ignore", over="ignore"):
            half_ulp = np.spacing(abs(depth[test])).astype(np.float64) / 2
            assert not (abs(depth[test] - exact) > half_ulp + 2.0**-35 * largest).any()  # docs/design/rules.md, rule 8
    return Expected(picture.count, picture.ids, depth)


def plain(scene, test):
    """Fragments by the definition: on the scalar kernels, a triangle and a sample at a time."""
    with on("scalar"):
        view = scene.view | {"method": "edge", "threads": 1}
        return tl.rasterize(*scene.arrays, depth_test=test, **view)


@lru_cache(maxsize=1)
def cases(make, *arguments):
    """Scenes of a generator, each with what it must give: kept until every instruction set has drawn them."""
    return [(scene, expect(scene, tests)) for scene, tests in make(*arguments)]


@contextmanager
def sharing(is_sliced):
    """Threads share the triangles of any scene, or set up all of them in each."""
    with choices.forced(shared_setups=0 if is_sliced else 2**62):
        yield


def check(isa, scene, expected, threads=(1,)):
    """Every sink gives the expected picture; three threads and more share the triangles."""
    labels = np.arange(len(scene.triangles), dtype=np.float32)
    for n in threads:
        view = scene.view | {"threads": n}
        with on(isa), sharing(n > 2):
            assert_same(tl.overdraw(*scene.arrays, **view), expected.counts)
            assert_same(tl.coverage(*scene.arrays, **view), expected.counts > 0)
            for test, ids in expected.ids.items():
                frags = tl.rasterize(*scene.arrays, depth_test=test, **view)
                assert_same(frags.triangle, ids)
                assert_same(frags.depth.view(np.int32), expected.depth[test].view(np.int32))
            if None in expected.ids:
                got = tl.fill(*scene.arrays[:2], labels, scene.size, per="triangle", background=-1, **view)
                assert_same(got, expected.ids[None].astype(np.float32))


def check_all(isa, made, threads=(1,)):
    for scene, expected in made:
        check(isa, scene, expected, threads)


def mixed(rng, n, size, *, bits=8, level=True, **view):
    """Triangles of a tenth of a pixel to 130 pixels, slivers and degenerate ones too; depths with ties, or none."""
    reach = rng.choice([0.3, 1, 2, 4, 12, 64, 130], (n, 1, 1), p=[0.2, 0.25, 0.25, 0.15, 0.12, 0.02, 0.01])
    xy = rng.uniform(-20, np.add(size, 20), (n, 1, 2)) + rng.uniform(-0.5, 0.5, (n, 3, 2)) * reach
    kind = rng.integers(0, 50, n)
    along = rng.uniform(0, 1, (n, 1))
    on_edge = xy[:, 0] + along * (xy[:, 1] - xy[:, 0]) + rng.integers(-2, 3, (n, 2)) * 2.0**-bits
    xy[kind == 0, 2] = on_edge[kind == 0]
    xy[kind == 1, 2] = xy[kind == 1, 0]
    snap_ties = (np.floor(xy * 2.0**bits) + 0.5) * 2.0**-bits
    xy = np.where((kind % 5 == 2)[:, None, None], np.round(xy * 2) / 2, xy)  # centres, corners and middles of pixels
    xy = np.where((kind % 5 == 3)[:, None, None], snap_ties, xy) + np.array(view.get("origin", (0, 0)))
    z = np.repeat(rng.integers(-8, 56, (n, 1)) / 64, 3, 1) if level else rng.standard_normal((n, 3))
    return soup(np.dstack([xy, z]).reshape(-1, 3), size, subpixel_bits=bits, **view)


class Clustered(NamedTuple):
    """A mesh that does not change, drawn from these clusters."""

    vertices: np.ndarray
    triangles: np.ndarray
    clusters: Clusters

    @property
    def drawn_triangles(self):
        return self.triangles

    def find_clusters(self):
        return self.clusters
