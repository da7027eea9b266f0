"""Squares of pixels that triangles meet or hold, whose vertices are not snapped: against fractions."""

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, kept, on, one_by_one
from exact_cases import exact_scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import CLIP_SCENES, Scene, soup

import topleft as tl
from topleft.methods.reference import sampling

EXACT = {"subpixel_bits": "exact"}
SQUARES = {"outer": kept(sampling.outer), "inner": kept(sampling.inner)}


def count(scene, kind, **view):
    """How many triangles meet, or hold, each square."""
    return tl.overdraw(*scene.arrays, **scene.view | EXACT | {"sampling": kind} | view)


def count_each(scene, kind):
    """The same of the reference: every triangle by itself."""
    view = scene.view | EXACT
    each = [SQUARES[kind](scene.vertices, row[None], scene.size, **view) for row in scene.triangles]
    return np.sum(each, axis=0)


@ON_EACH_ISA
@pytest.mark.parametrize("kind", SQUARES)
@settings(max_examples=60)
@given(scene=exact_scenes())
def test_squares_of_hostile_floats_are_those_of_the_reference(isa, kind, scene):
    with on(isa):
        found = tl.coverage(*scene.arrays, **scene.view, sampling=kind)
    assert (found == SQUARES[kind](*scene.arrays, **scene.view)).all()


@ON_EACH_ISA
@settings(max_examples=30)
@given(scene=exact_scenes(), x=st.integers(-12, 20), y=st.integers(-9, 12), width=st.integers(1, 30))
def test_window_of_squares_holds_the_crop(isa, scene, x, y, width):
    for kind in SQUARES:
        with on(isa):
            whole = count(soup(scene.vertices, (64, 48)), kind, origin=(-16, -16))
            part = count(soup(scene.vertices, (width, 20)), kind, origin=(x, y))
        assert (part == whole[y + 16 : y + 36, x + 16 : x + 16 + width]).all()


@ON_EACH_ISA
@pytest.mark.parametrize("kind", SQUARES)
@one_by_one("side", [0.75, 3, 11, 30, 61, 90])
def test_squares_of_all_sizes_are_those_of_the_reference(isa, kind, side):
    """Lanes for boxes of up to 4x4, 16x16 and 62x62 pixels, and triangles by themselves."""
    rng = np.random.default_rng(int(side * 4))
    corners = rng.uniform(-4, 40, (16, 1, 2)) + rng.uniform(-0.5, 0.5, (16, 3, 2)) * side
    corners[::3] = np.nextafter(np.round(corners[::3]), rng.choice([-np.inf, 0, np.inf], corners[::3].shape))
    corners[1::3] = np.round(corners[1::3] * 4) / 4
    scene = soup(corners.reshape(-1, 2), (40, 30))
    with on(isa):
        assert (count(scene, kind) == count_each(scene, kind)).all()


@pytest.mark.parametrize("kind", SQUARES)
@pytest.mark.parametrize("make", CLIP_SCENES.values(), ids=CLIP_SCENES)
def test_squares_of_clip_space_count_a_cut_triangle_once(kind, make):
    scene = make(np.random.default_rng(4))
    scene = Scene(scene.vertices, scene.triangles[:40], scene.size, scene.view)
    expected = count_each(scene, kind)
    for isa in tl.build_info()["isa_available"]:
        with on(isa):
            assert (count(scene, kind) == expected).all()


def test_squares_beside_an_edge_know_the_last_bit():
    """A square whose right side is x: it is held, and one that begins there is not met, but for one float64 step."""
    for x, held, met in [(3.0, 3, 3), (np.nextafter(3.0, 4), 3, 4), (np.nextafter(3.0, 2), 2, 3)]:
        box = [[0, 0], [x, 0], [x, 4], [0, 4]], [[0, 1, 2], [0, 2, 3]], (6, 4)
        rows = tl.coverage(*box, sampling="outer", **EXACT)
        assert rows.sum(axis=1).tolist() == [met] * 4
        half = [[0, -9], [x, -9], [x, 99], [0, 99]], [[0, 1, 2], [0, 2, 3]], (6, 4)
        apart = [[-9, -9], [x, -9], [x, 9]], [[0, 1, 2]], (6, 2)
        assert tl.coverage(*half, sampling="outer", **EXACT)[0].sum() == met
        assert tl.coverage(*apart, sampling="inner", **EXACT)[0].sum() == held
