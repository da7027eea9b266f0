"""Pictures of several samples a pixel: the mean of what each sample sees."""

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import ON_EACH_ISA, THREADS, mixed, on
from strategies import floor

import topleft as tl
from topleft._core.base.color import srgb_tables
from topleft.methods.reference.sampling import mean

COUNTS = (2, 4, 8, 16)
SQUARE = ([[0, 0], [0.5, 0], [0.5, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]])  # half of a pixel


def sampled(scene, n, colors, background):
    """The colour that each sample sees, (S, H, W, C), from ids of `rasterize`."""
    ids = tl.rasterize(*scene.arrays, depth_test=None, sampling=f"msaa{n}", **scene.view).samples_triangle
    return np.moveaxis(np.where((ids < 0)[..., None], np.asarray(background, colors.dtype), colors[ids]), 2, 0)


@ON_EACH_ISA
@pytest.mark.parametrize("n", COUNTS)
def test_flat_uint8_is_the_mean_to_nearest_ties_to_even(isa, n):
    rng = np.random.default_rng(n)
    scene = mixed(rng, 300, (120, 90))
    for channels in (1, 2, 3, 4):
        colors = rng.integers(0, 256, (len(scene.triangles), channels), np.uint8)
        expected = np.rint(sampled(scene, n, colors, 7).mean(0)).astype(np.uint8)  # exact: eighths and sixteenths
        for threads in THREADS:
            with on(isa):
                options = {"per": "triangle", "background": 7, "sampling": f"msaa{n}", "threads": threads}
                options |= {"alpha": "premultiplied"}
                assert_same(tl.fill(*scene.arrays[:2], colors, scene.size, **options, **scene.view), expected)


@pytest.mark.parametrize("n", COUNTS)
def test_flat_float32_is_the_mean_rounded_once(n):
    rng = np.random.default_rng(n)
    scene = mixed(rng, 100, (60, 50))
    colors = rng.standard_normal((len(scene.triangles), 3)).astype(np.float32)
    expected = np.zeros((*scene.size[::-1], 3))
    for plane in sampled(scene, n, colors, 0.25):
        expected += plane
    view = scene.view | {"sampling": f"msaa{n}"}
    got = tl.fill(*scene.arrays[:2], colors, scene.size, per="triangle", background=0.25, **view)
    assert_same(got, (expected / n).astype(np.float32))


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_runs_of_pixels_inside_of_one_triangle_are_its_colour(isa, dtype):
    vertices = [[-9.0, 2.3], [410.2, 5.1], [200.7, 39.9], [30.5, -20.0], [33.1, 60.0], [300.0, 20.2]]
    triangles, size = [[0, 1, 2], [3, 4, 5]], (400, 37)
    ids = tl.rasterize(vertices, triangles, size, depth_test=None, sampling="msaa4").samples_triangle
    rng = np.random.default_rng(7)
    for channels in (1, 2, 3, 4):
        colors = rng.integers(0, 256, (2, channels)).astype(dtype)
        seen = np.where((ids < 0)[..., None], dtype(9), colors[ids]).astype(np.float64)
        mean = seen.mean(2)
        options = {"per": "triangle", "background": 9, "sampling": "msaa4", "alpha": "premultiplied"}
        with on(isa):
            got = tl.fill(vertices, triangles, colors, size, **options)
        assert_same(got, np.rint(mean).astype(dtype) if dtype is np.uint8 else mean.astype(dtype))


@ON_EACH_ISA
@pytest.mark.parametrize("make", [lambda rng: mixed(rng, 60, (60, 50)), lambda rng: floor(rng, 4, 24)])
def test_gouraud_is_the_mean_of_the_samples(isa, make):
    rng = np.random.default_rng(5)
    scene = make(rng)
    colors = rng.standard_normal((len(scene.vertices), 2)).astype(np.float32)
    frags = tl.rasterize(*scene.arrays, depth_test=None, sampling="msaa4", **scene.view)
    with on(isa):
        options = {"per": "vertex", "sampling": "msaa4", "alpha": "premultiplied"}
        got = tl.fill(*scene.arrays[:2], colors, scene.size, **options, **scene.view)
    if scene.vertices.shape[1] == 4:  # colours are linear on the screen, attributes are not
        assert_same((got != 0).any(-1), (frags.samples_triangle >= 0).any(-1))
        return
    expected = sum(frags.sample(k).interpolate(colors).astype(np.float64) for k in range(4)) / 4
    assert abs(got - expected).max() < 2**-22 * abs(colors).max()


def test_out_is_what_uncovered_samples_hold():
    out = np.full((1, 2), 100, np.uint8)
    tl.fill(*SQUARE, np.array([200, 200], np.uint8), (2, 1), sampling="msaa8", out=out)
    assert out.tolist() == [[150, 100]]


def test_resolve_linear_averages_light():
    white = np.full((2, 4), 255, np.uint8)
    options = {"sampling": "msaa2", "background": (0, 0, 0, 0), "alpha": "premultiplied"}
    assert tl.fill(*SQUARE, white, (1, 1), **options).tolist() == [[[128] * 4]]
    assert tl.fill(*SQUARE, white, (1, 1), resolve="linear", **options).tolist() == [[[188, 188, 188, 128]]]


@ON_EACH_ISA
@pytest.mark.parametrize("resolve", ["values", "linear"])
@pytest.mark.parametrize("n_channels", [2, 4])
def test_straight_alpha_weighs_the_colours(n_channels, resolve, isa):
    rng = np.random.default_rng(n_channels)
    scene = mixed(rng, 80, (40, 30))
    colors = rng.integers(0, 256, (len(scene.triangles), n_channels), np.uint8)
    colors[::3, -1] = rng.choice([0, 255], len(colors[::3]))
    samples = np.moveaxis(sampled(scene, 4, colors, 0), 0, 2)
    with on(isa):
        view = scene.view | {"sampling": "msaa4"}
        got = tl.fill(*scene.arrays[:2], colors, scene.size, per="triangle", resolve=resolve, **view)
    tables = srgb_tables() if resolve == "linear" else None
    expected = [[mean(pixel, is_straight=True, tables=tables) for pixel in row] for row in samples]
    assert_same(got, np.array(expected, np.uint8))


def test_straight_alpha_weighs_float32_colours():
    red = np.full((2, 4), (1, 0.5, 0, 0.75), np.float32)
    got = tl.fill(*SQUARE, red, (1, 1), sampling="msaa2", background=(0, 1, 1, 0.25))
    assert got.tolist() == [[[0.75, 0.625, 0.25, 0.5]]]


def test_resolve_linear_leaves_a_single_colour_as_it_is():
    decode, encode = srgb_tables()
    assert encode[decode].tolist() == list(range(256))


def test_options_that_do_not_go_together_are_errors():
    colors = np.zeros((2, 3), np.float32)
    with pytest.raises(ValueError, match="resolve must be one of 'values', 'linear', got 'gamma'"):
        tl.fill(*SQUARE, colors, (1, 1), resolve="gamma")
    with pytest.raises(ValueError, match="resolve 'linear' takes sRGB colours of uint8, got float32"):
        tl.fill(*SQUARE, colors, (1, 1), resolve="linear", sampling="msaa4")


def test_kept_fragments_outlive_a_fill():
    rasterizer = tl.Rasterizer((2, 1))
    frags = rasterizer.rasterize(*SQUARE, sampling="msaa2")
    before = frags.samples_triangle.copy()
    rasterizer.fill([[0, 0], [0, 0], [9, 9]], [[0, 1, 2]], [9], per="triangle", sampling="msaa2")
    assert_same(frags.samples_triangle, before)
