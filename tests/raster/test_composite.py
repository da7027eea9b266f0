"""Compositing of layers: "over" from front to back, exact but for one rounding, whatever the order of triangles."""

from fractions import Fraction

import numpy as np
import pytest
from comparing import assert_same, half_ulp
from engine_cases import ON_EACH_ISA, mixed, on

import topleft as tl
from topleft.methods.reference import peel as ref

SIZE = (24, 18)


def peeled(seed=1, n=900, layers=6):
    scene = mixed(np.random.default_rng(seed), n, SIZE)
    return scene, tl.peel(*scene.arrays, layers=layers, **scene.view)


def exact_over(ids, colors_of, background, one):
    """What the reference sees of each pixel, as numbers of the range [0, one]."""
    shape = ids.shape[:2]
    result = np.empty(shape, object)
    for pixel in np.ndindex(shape):
        layers = [[*map(Fraction, color[:-1]), Fraction(color[-1]) / one] for color in colors_of(pixel)]
        ground = None if background is None else [*background[:-1], Fraction(background[-1]) / one]
        *color, alpha = ref.over(layers, ground) if layers or ground else [0] * 4
        result[pixel] = [*color, alpha * one]
    return result


def palette_of(rng, n, dtype, channels=4):
    colors = rng.integers(0, 256, (n, channels)).astype(np.uint8)
    colors[: n // 4, -1] = 255
    colors[n // 4 : n // 3, -1] = 0
    return colors if dtype == np.uint8 else (colors / np.float32(255) + np.float32(0.001)).astype(np.float32)


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("background", [None, (10, 200, 30, 255), (9, 8, 7, 100)])
def test_composite_of_triangles_is_over_of_the_reference(isa, dtype, background):
    scene, layers = peeled()
    rng = np.random.default_rng(4)
    colors = palette_of(rng, len(scene.triangles), dtype)
    one = 255 if dtype == np.uint8 else 1
    ground = None if background is None or dtype == np.uint8 else tuple(float(np.float32(v / 255)) for v in background)
    ground = background if dtype == np.uint8 else ground
    with on(isa):
        got = tl.composite(layers, colors, background=ground)
    assert (got.dtype, got.shape) == (dtype, (*SIZE[::-1], 4))

    def colors_of(pixel):
        return [colors[i].tolist() for i in layers.triangle[pixel] if i >= 0]

    exact = exact_over(layers.triangle, colors_of, None if ground is None else list(map(Fraction, ground)), one)
    # float64 throughout: some 2**-50 of the largest number before the one rounding
    slack = Fraction(1, 2**40)
    for pixel in np.ndindex(exact.shape):
        for c in range(4):
            value = exact[pixel][c]
            allowed = Fraction(1, 2) if dtype == np.uint8 else half_ulp(value)
            assert abs(Fraction(float(got[pixel][c])) - value) <= allowed + slack
    assert len(np.unique(got)) > 50


@ON_EACH_ISA
def test_composite_does_not_depend_on_the_order_of_triangles(isa):
    scene = mixed(np.random.default_rng(2), 900, SIZE, level=False)
    order = np.random.default_rng(3).permutation(len(scene.triangles))
    colors = palette_of(np.random.default_rng(4), len(scene.triangles), np.uint8)
    with on(isa):
        pictures = [
            tl.composite(
                tl.peel(scene.vertices, scene.triangles[o], SIZE, layers=16), colors[o], background=(0, 0, 0, 255)
            )
            for o in (np.arange(len(order)), order)
        ]
    assert_same(*pictures)


def test_composite_two_halves_of_a_pixel():
    quad = [[0, 0, 1], [4, 0, 1], [0, 4, 1], [0, 0, 0], [4, 0, 0], [0, 4, 0]]
    layers = tl.peel(quad, [[0, 1, 2], [3, 4, 5]], (1, 1))
    red_behind_blue = np.array([[1, 0, 0, 0.5], [0, 0, 1, 0.25]])
    assert tl.composite(layers, red_behind_blue)[0, 0].tolist() == [np.float32(0.6), 0, np.float32(0.4), 0.625]
    over_white = tl.composite(layers, red_behind_blue, background=(1, 1, 1, 1))
    assert over_white[0, 0].tolist() == [0.75, 0.375, 0.625, 1]


def test_composite_opaque_colors_are_the_first_layer():
    scene, layers = peeled()
    colors = np.random.default_rng(5).integers(0, 256, (len(scene.triangles), 3), np.uint8)
    got = tl.composite(layers, colors, opacity=1)
    expected = np.where(layers.layer(0).mask[..., None], colors[layers.triangle[..., 0]], np.uint8(0))
    assert_same(got[..., :3], expected)
    assert_same(got[..., 3], np.where(layers.layer(0).mask, np.uint8(255), np.uint8(0)))


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_composite_of_vertices_is_that_of_their_interpolated_colors(isa, dtype, monkeypatch):
    scene, layers = peeled()
    colors = palette_of(np.random.default_rng(6), len(scene.vertices), dtype)
    background = (0, 0, 0, 255) if dtype == np.uint8 else (0, 0, 0, 1)
    with on(isa):
        got = tl.composite(layers, colors, background=background)
        pictures = np.stack([layers.layer(k).interpolate(colors) for k in range(6)], 2)
        module = __import__("sys").modules["topleft._core.raster.composite"]
        monkeypatch.setattr(module, "BAND_BYTES", 5000)
        monkeypatch.setattr(module, "MIN_PIXELS_PER_THREAD", 50)
        for threads in (None, 1, 3, 8):
            assert_same(tl.composite(layers, colors, background=background, threads=threads), got)
    if dtype == np.float32:
        assert_same(tl.composite(layers, pictures, background=background), got)
    else:
        scaled = tl.composite(layers, pictures / np.float32(255), background=(0, 0, 0, 1))
        assert np.abs(got - 255.0 * scaled).max() <= 0.5 + 1e-4  # the colours were rounded again


def test_composite_per_says_whose_colors():
    quad = [[0, 0, 1], [4, 0, 1], [0, 4, 1]]
    layers = tl.peel(quad, [[0, 1, 2]] * 3, (1, 1), layers=1)
    colors = np.eye(3)
    with pytest.raises(
        ValueError, match="colors fit triangles and vertices, 3 of each: say per='triangle' or 'vertex'"
    ):
        tl.composite(layers, colors, opacity=1)
    assert tl.composite(layers, colors, opacity=1, per="triangle")[0, 0].tolist() == [1, 0, 0, 1]
    assert tl.composite(layers, colors, opacity=1, per="vertex")[0, 0].tolist() == [0.75, 0.125, 0.125, 1]


def test_composite_out_holds_the_picture():
    scene, layers = peeled()
    colors = palette_of(np.random.default_rng(6), len(scene.triangles), np.uint8)
    out = np.zeros((18, 48, 4), np.uint8)[:, ::2]
    assert tl.composite(layers, colors, out=out) is out
    assert_same(out, tl.composite(layers, colors))


@pytest.mark.parametrize("size", [(0, 3), (3, 0)])
def test_composite_empty_picture_has_its_shape(size):
    layers = tl.peel([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], size)
    assert tl.composite(layers, [[1.0, 1]]).shape == (size[1], size[0], 2)


@pytest.mark.parametrize(
    ("colors", "options", "message"),
    [
        (np.zeros((2, 4)), {}, r"colors must have rows of shape .* got \(2,\)"),
        (np.zeros((2, 4)), {"per": "triangle"}, r"colors must have rows of shape \(1,\) for triangles, got \(2,\)"),
        (np.zeros((1, 1, 1, 4)), {}, r"colors must have rows of shape .* got \(1, 1, 1\)"),
        (np.zeros((1, 3)), {}, "colors must have 2 or 4 channels, alpha among them"),
        (np.zeros((1, 4)), {"opacity": 0.5}, "colors must have 1 or 3 channels, with opacity"),
        (np.zeros(4), {}, r"and shape \(T, C\), \(V, C\) or \(H, W, K, C\), got \(4,\)"),
        (np.zeros((1, 3)), {"opacity": 1.5}, r"opacity must lie in 0 to 1, got 1\.5"),
        (np.full((1, 4), 256), {}, r"colors must lie in 0\.\.255 when they are integers, got 256\.\.256"),
        (np.zeros((1, 4)), {"per": "edge"}, "per must be one of"),
        (np.zeros((1, 4)), {"background": (1, 2)}, r"background must be one number or have shape \(4,\), got \(2,\)"),
        (np.zeros((1, 4)), {"out": np.zeros((1, 1, 4))}, "out must have shape"),
        (np.zeros((1, 4)), {"threads": 0}, "threads must be at least 1, got 0"),
    ],
)
def test_composite_bad_values_are_refused(colors, options, message):
    layers = tl.peel([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], (1, 1))
    with pytest.raises(ValueError, match=message):
        tl.composite(layers, colors, **options)


def test_composite_bad_types_are_refused():
    layers = tl.peel([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], (1, 1))
    with pytest.raises(TypeError, match="layers must be the result of peel, got ndarray"):
        tl.composite(layers.triangle, np.zeros((1, 4)))
    with pytest.raises(TypeError, match="colors must be uint8 or float32, got dtype complex128"):
        tl.composite(layers, np.zeros((1, 4), complex))


@pytest.mark.parametrize("wrong", [10**8, 2**31 - 1, -(2**31)])
@pytest.mark.parametrize("per", ["triangle", "vertex"])
@ON_EACH_ISA
def test_composite_with_an_id_that_no_triangle_has_ends_the_layers_of_that_pixel(isa, per, wrong):
    _, layers = peeled()
    colors = palette_of(np.random.default_rng(2), layers.n_triangles if per == "triangle" else layers.n_vertices, "u1")
    y, x = np.argwhere(layers.count >= 2)[0]
    layers.planes[0][1, y, x] = -1
    with on(isa):
        ended = tl.composite(layers, colors, per=per)
        layers.planes[0][1, y, x] = wrong  # a public array
        assert_same(tl.composite(layers, colors, per=per), ended)
