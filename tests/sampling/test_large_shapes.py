"""Fills of a few large triangles, which are written row by row, equal fills with so many that they are not."""

import numpy as np
import pytest
from engine_cases import one_by_one

import topleft as tl

SIZE = (769, 701)
N_OTHERS = 80
"""Triangles without area: no picture changes by them, but a mesh of so many is drawn triangle by triangle."""

SHAPES = {
    "one": [[30.3, 20.7], [700.1, 333.3], [120.9, 690.2]],
    "beyond": [[-4000.5, 200.25], [9000.0, -100.0], [300.0, 9e5]],
    "far": [[-1e12, 2e11], [3e12, -1e12], [1e11, 5e12]],
    "whole": [[-10, -10], [2000, -10], [-10, 2000]],
    "level": [[0, 100], [769, 100], [0, 600]],
    "sliver": [[1, 1], [768, 699.5], [768, 700]],
    "none": [[5, 5], [700, 5], [300, 5]],
    "outside": [[5, -5], [700, -5], [300, -50]],
}


def two_triangles() -> np.ndarray:
    """Return two that overlap."""
    return np.concatenate([SHAPES["one"], [[760.0, 3], [740.5, 660], [10, 400]]])


def meshes(vertices: object) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return triangles of their own vertices, and the same with others that show nowhere."""
    points = np.asarray(vertices, np.float64)
    triangles = np.arange(len(points)).reshape(-1, 3)
    return (points, triangles), (points, np.concatenate([triangles, np.zeros((N_OTHERS, 3), int)]))


def palette(n: int, channels: int, dtype: type) -> np.ndarray:
    """Return colours of n triangles and of those that show nowhere."""
    colors = np.random.default_rng(n).integers(0, 256, (n + N_OTHERS, channels))
    return colors.astype(dtype) if dtype is np.uint8 else (colors / 255).astype(dtype)


def assert_few_equal_many(vertices: object, colors: np.ndarray, **options: object) -> None:
    """Check that triangles are filled as if there were many."""
    few, many = meshes(vertices)
    options["per"] = "triangle"
    assert (tl.fill(*few, colors[:-N_OTHERS], SIZE, **options) == tl.fill(*many, colors, SIZE, **options)).all()


@pytest.mark.parametrize("sampling", ["center", "msaa2", "msaa4", "msaa8", "msaa16"])
@one_by_one("shape", SHAPES)
def test_fill_of_few_triangles_equals_that_of_many(shape, sampling):
    assert_few_equal_many(SHAPES[shape], palette(1, 4, np.uint8), sampling=sampling)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("blend", ["over", "add", "multiply", "max", "min"])
def test_blend_of_few_triangles_equals_that_of_many(blend, dtype):
    for channels in (2, 4):
        colors = palette(2, channels, dtype)
        background = np.full(channels, 0.25 if dtype is np.float32 else 9)
        for last in (0, 100, 255):
            colors[1, -1] = last if dtype is np.uint8 else last / 255
            for alpha in ("straight", "premultiplied"):
                assert_few_equal_many(two_triangles(), colors, background=background, blend=blend, alpha=alpha)


@one_by_one("shape", SHAPES)
@pytest.mark.parametrize("size", [SIZE, (800, 333), (61, 3000)])
def test_areas_of_few_triangles_equal_those_of_many(shape, size):
    few, many = meshes(np.concatenate([SHAPES[shape], SHAPES["level"]]))
    for verb in (tl.coverage, tl.overdraw):
        assert (verb(*few, size, sampling="area") == verb(*many, size, sampling="area")).all()


@pytest.mark.parametrize("blend", ["replace", "over", "add", "multiply"])
@one_by_one("shape", SHAPES)
def test_fill_by_area_over_a_background_equals_one_over_a_picture(shape, blend):
    """The same over a background as over a picture, and whole as by windows that are too narrow for runs."""
    vertices, triangles = meshes(np.concatenate([SHAPES[shape], SHAPES["level"]]))[0]
    for dtype, alpha in ((np.uint8, 255), (np.uint8, 100), (np.float32, 1)):
        colors = palette(2, 4, dtype)[:2]
        colors[:, 3] = alpha
        options = {"per": "triangle", "sampling": "area", "blend": blend}
        ground = [20, 40, 60, 255] if dtype is np.uint8 else [0.2, 0.4, 0.6, 1.0]
        picture = tl.fill(vertices, triangles, colors, SIZE, background=ground, **options)
        out = np.full((*SIZE[::-1], 4), ground, dtype)
        tl.fill(vertices, triangles, colors, SIZE, out=out, **options)
        assert (picture == out).all()
        for x in (0, 333, 700):
            size, part = (min(100, SIZE[0] - x), SIZE[1]), picture[:, x : x + 100]
            options["viewport"] = SIZE
            own = tl.fill(vertices, triangles, colors, size, background=ground, origin=(x, 0), **options)
            assert (own == part).all()


@pytest.mark.parametrize("options", [
    {}, {"threads": 3}, {"method": "edge"}, {"method": "scanline"}, {"cull": "back"}, {"cull": "front"},
    {"subpixel_bits": 0}, {"subpixel_bits": 16}, {"origin": (50, -70), "viewport": (900, 800)},
])  # fmt: skip
def test_fill_with_options(options):
    for sampling in ("center", "msaa4"):
        assert_few_equal_many(
            two_triangles(), palette(2, 4, np.uint8), background=(1, 2, 3, 4), sampling=sampling, **options
        )


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("sampling", ["center", "msaa2", "msaa4", "msaa16"])
def test_fill_has_the_colours_of_labels(sampling, dtype):
    for channels in (1, 2, 3, 4):
        options = {"background": np.full(channels, 0.25 if dtype is np.float32 else 9), "sampling": sampling}
        for alpha in ("straight", "premultiplied"):
            assert_few_equal_many(two_triangles(), palette(2, channels, dtype), alpha=alpha, **options)


def test_fill_averages_light_and_draws_a_fan_of_many_colours():
    angles = np.linspace(0, 2 * np.pi, 15)
    rim = np.stack([380 + 300 * np.cos(angles), 350 + 330 * np.sin(angles)], 1)
    fan = np.stack([np.broadcast_to([380.2, 351.3], (14, 2)), rim[:-1], rim[1:]], 1).reshape(-1, 2)
    for sampling in ("center", "msaa4", "msaa8"):
        if sampling != "center":
            assert_few_equal_many(two_triangles(), palette(2, 4, np.uint8), resolve="linear", sampling=sampling)
        for channels, dtype in ((3, np.uint8), (4, np.float32)):
            assert_few_equal_many(fan, palette(14, channels, dtype), sampling=sampling)


def test_pieces_of_a_triangle_that_planes_cut():
    vertices = np.array([[-3.0, -2, 0.1, 0.5], [4, -1, 0.3, 2], [0.5, 6, 0.2, -1.5]])
    triangles = np.array([[0, 1, 2]])
    many = np.concatenate([triangles, np.zeros((N_OTHERS, 3), int)])
    colors = palette(1, 4, np.uint8)
    for sampling in ("center", "msaa4"):
        options = {"sampling": sampling, "per": "triangle"}
        picture = tl.fill(vertices, triangles, colors[:1], SIZE, **options)
        assert picture.any()
        assert (picture == tl.fill(vertices, many, colors, SIZE, **options)).all()


def test_arrays_of_the_caller():
    few, many = meshes(SHAPES["one"])
    colors = palette(1, 4, np.uint8)
    picture = np.full((701, 769, 8), 77, np.uint8)
    tl.fill(*few, colors[:1], SIZE, per="triangle", background=5, out=picture[..., 4:])
    assert (picture[..., 4:] == tl.fill(*many, colors, SIZE, per="triangle", background=5)).all()
    assert (picture[..., :4] == 77).all()
    kept = np.full((701, 769, 4), 77, np.uint8)
    tl.fill(*few, colors[:1], SIZE, per="triangle", sampling="msaa4", out=kept)
    expected = np.full((701, 769, 4), 77, np.uint8)
    tl.fill(*many, colors, SIZE, per="triangle", sampling="msaa4", out=expected)
    assert (kept == expected).all()


@pytest.mark.parametrize("verb", ["coverage", "overdraw", "fill"])
def test_an_index_outside_the_vertices_is_refused(verb):
    vertices, colors = np.array(SHAPES["one"]), [np.zeros((1, 3), np.uint8)] if verb == "fill" else []
    for bad in (3, -1):
        with pytest.raises(IndexError, match="triangles"):
            getattr(tl, verb)(vertices, [[0, 1, bad]], *colors, SIZE)
