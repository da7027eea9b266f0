"""Conservative coverage: the squares that triangles meet or hold, against the exact reference and int64 corners."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, kept, mixed, on, one_by_one, sharing
from strategies import CLIP_SCENES, PIXEL_SCENES, Scene, few_bits, floor, on_centres, soup

import topleft as tl
from topleft.methods.reference import sampling as ref

KINDS = {"outer": kept(ref.outer), "inner": kept(ref.inner)}
SCENES = PIXEL_SCENES | CLIP_SCENES


def draw(scene, kind, verb=tl.coverage, **view):
    return verb(*scene.arrays, **(scene.view | {"sampling": kind} | view))


@kept
def count_squares(scene, kind):
    """Overdraw of a pixel-space scene by every corner of every square, in int64."""
    bits, origin = scene.view.get("subpixel_bits", 8), scene.view.get("origin", (0, 0))
    fixed = np.rint(np.asarray(scene.vertices, np.float64)[:, :2] * 2.0**bits).astype(np.int64)
    x = ((np.arange(scene.size[0] + 1) + origin[0]) << bits)[None, :]
    y = ((np.arange(scene.size[1] + 1) + origin[1]) << bits)[:, None]
    counts = np.zeros(scene.size[::-1], np.int32)
    for a, b, c in fixed[scene.triangles]:
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        corners = (a, b, c) if area > 0 else (a, c, b)
        low, high = np.min(corners, 0), np.max(corners, 0)
        inside = (x[:, 1:] > low[0]) & (x[:, :-1] < high[0]) & (y[1:] > low[1]) & (y[:-1] < high[1])
        for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
            e = (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
            at = np.stack([e[:-1, :-1], e[:-1, 1:], e[1:, :-1], e[1:, 1:]])
            inside &= at.max(0) > 0 if kind == "outer" else at.min(0) >= 0
        counts += inside
    return counts


@ON_EACH_ISA
@pytest.mark.parametrize("name", SCENES)
def test_squares_are_those_of_the_reference(isa, name):
    scene = SCENES[name](np.random.default_rng(11))
    with on(isa):
        for kind, expected in KINDS.items():
            for method in ("auto", "edge", "scanline"):
                assert_same(draw(scene, kind, method=method), expected(*scene.arrays, **scene.view))


@ON_EACH_ISA
@one_by_one("bits", range(17))
def test_squares_each_precision_are_those_of_the_reference(isa, bits):
    rng = np.random.default_rng(bits)
    with on(isa):
        for make in (few_bits, on_centres):
            scene = make(rng, 8)
            view = scene.view | {"subpixel_bits": bits, "origin": (2, 3)}
            for kind, expected in KINDS.items():
                assert_same(draw(scene, kind, **view), expected(*scene.arrays, **view))


@ON_EACH_ISA
@pytest.mark.parametrize("bits", [0, 3, 8, 9, 16])
def test_counts_all_sizes_are_those_of_corners_in_int64(isa, bits):
    scene = mixed(np.random.default_rng(bits), 300, (190, 150), bits=bits, origin=(-40, 7))
    for kind in KINDS:
        expected = count_squares(scene, kind)
        with on(isa):
            for threads in THREADS:
                with sharing(threads > 2):
                    assert_same(draw(scene, kind, tl.overdraw, threads=threads), expected)
                    assert_same(draw(scene, kind, threads=threads), expected > 0)


@ON_EACH_ISA
def test_counts_extents_about_the_limit_of_lanes_are_those_of_corners_in_int64(isa):
    rng = np.random.default_rng(5)
    xy = rng.integers(0, 65 * 256, (60, 3, 2))
    extent = rng.integers(58 * 256, 63 * 256, (60, 2))
    xy[:, 0] = rng.integers(0, 256, (60, 2))
    xy[:, 1] = xy[:, 0] + extent
    scene = soup(xy.reshape(-1, 2) / 256, (66, 66))
    for kind in KINDS:
        with on(isa):
            assert_same(draw(scene, kind, tl.overdraw), count_squares(scene, kind))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", CLIP_SCENES)
def test_counts_cut_triangle_counts_once(name, kind):
    scene = CLIP_SCENES[name](np.random.default_rng(4))
    each = [draw(Scene(scene.vertices, row[None], scene.size, scene.view), kind) for row in scene.triangles]
    for method in ("auto", "edge"):
        assert_same(draw(scene, kind, tl.overdraw, method=method), np.sum(each, 0, dtype=np.int32))


def test_touching_is_not_meeting_and_the_border_is_inside():
    square = ([[1, 1], [3, 1], [3, 3], [1, 3]], [[0, 1, 2], [0, 2, 3]], (4, 4))
    assert tl.overdraw(*square, sampling="outer").tolist() == [[0, 0, 0, 0], [0, 2, 1, 0], [0, 1, 2, 0], [0, 0, 0, 0]]
    assert tl.overdraw(*square, sampling="inner").tolist() == [[0, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 0]]


@pytest.mark.parametrize("kind", KINDS)
def test_ids_and_depth_are_refused(kind):
    scene = floor(np.random.default_rng(1), 3, 8)
    with pytest.raises(ValueError, match=f"sampling '{kind}' gives no ids: rasterize takes 'center' and"):
        draw(scene, kind, tl.rasterize)
    with pytest.raises(ValueError, match=f"sampling '{kind}' gives no order: fill takes 'center', 'msaa2'"):
        tl.fill(*scene.arrays[:2], np.zeros(len(scene.triangles)), scene.size, sampling=kind, **scene.view)
