"""Pictures that are drawn in bands of rows: the same as drawn at once, from triangles as they come."""

from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on, one_by_one

import topleft as tl
from topleft._core import engine
from topleft._core.raster import choices
from topleft._core.raster.sampling import SamplePass

SIZE = (333, 301)
TESTS = [None, "less", "greater"]


@contextmanager
def bands(*, are_drawn):
    """Draw in bands of few rows wherever that is possible, or nowhere."""
    rows = {"near_pixels": 0 if are_drawn else 1 << 40, "cleared_pixel": 1e6, "plane_bytes": 8 * 333 * 20}
    with choices.forced(rows_to_blend=lambda view, *_, **__: 13 if are_drawn else view.size[1], **rows):
        yield


def strewn(seed, n=300, size_px=60.0):
    """Triangles that reach beyond the picture, with depths of which many are equal, slivers among them."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-20, 350, (n, 1, 3)) + rng.normal(scale=size_px, size=(n, 3, 3))
    corners[: n // 4] = np.round(corners[: n // 4])
    corners[n // 4 : n // 3, 2] = corners[n // 4 : n // 3, 1] + 0.2
    corners[..., 2] = rng.integers(0, 4, (n, 3)) / 3
    return corners.reshape(-1, 3), np.arange(3 * n, dtype=np.int32).reshape(n, 3)


def as_arrays(found):
    """The arrays of a picture, or ids and depths of all samples."""
    return [found] if isinstance(found, np.ndarray) else [found.samples_triangle, found.samples_depth]


def assert_bands_change_nothing(draw):
    """Check that what is drawn at once has the bits of what is drawn in bands; returns its first array."""
    with bands(are_drawn=False):
        whole = as_arrays(draw())
    with bands(are_drawn=True):
        banded = as_arrays(draw())
    assert [one.tobytes() for one in banded] == [one.tobytes() for one in whole]
    return whole[0]


@ON_EACH_ISA
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("test", TESTS)
def test_ids_and_depth_in_bands_equal_the_whole(isa, test, threads):
    mesh = strewn(1)
    for cull in ("none", "back", "front"):
        draw = partial(tl.rasterize, *mesh, SIZE, depth_test=test, threads=threads, cull=cull)
        with on(isa):
            assert (assert_bands_change_nothing(draw) >= 0).any()


@ON_EACH_ISA
def test_counts_and_colours_in_bands_equal_the_whole(force, isa):
    vertices, triangles = strewn(2)
    colors = np.random.default_rng(0).random((len(triangles), 2), np.float32)
    force(saved_rows=0.0, saved_row=1e6)
    with on(isa):
        assert_bands_change_nothing(lambda: tl.overdraw(vertices, triangles, SIZE))
        assert_bands_change_nothing(lambda: tl.fill(vertices, triangles, colors, SIZE, per="triangle"))
        corners = np.repeat(colors, 3, 0)
        assert_bands_change_nothing(lambda: tl.fill(vertices[:, :2], triangles, corners, SIZE, per="vertex"))


@ON_EACH_ISA
@pytest.mark.parametrize("columns", [slice(0, 333), slice(90, 210)])
def test_samples_in_bands_equal_the_whole(isa, columns):
    vertices, triangles = strewn(5, 150, 25.0)
    vertices[:, 0] = vertices[:, 0] % (columns.stop - columns.start) + columns.start
    for sampling, test in (("msaa2", "less"), ("msaa4", "greater"), ("msaa8", None)):
        draw = partial(tl.rasterize, vertices, triangles, SIZE, sampling=sampling, depth_test=test, threads=2)
        with on(isa):
            assert (assert_bands_change_nothing(draw) >= 0).any()


@ON_EACH_ISA
@pytest.mark.parametrize("options", [
    {}, {"subpixel_bits": 0}, {"subpixel_bits": 16}, {"cull": "back"}, {"origin": (40, -30)}, {"threads": 3},
])  # fmt: skip
def test_areas_in_bands_equal_the_whole(force, isa, options):
    vertices, triangles = strewn(6)
    vertices[7] *= 1e7  # one triangle that lanes cannot take
    force(area_triangle=0.0, area_bytes=4 * engine.area_stride(SIZE[0]) * 8)
    draw = partial(tl.overdraw, vertices[:, :2], triangles, SIZE, sampling="area", **options)
    with on(isa):
        assert assert_bands_change_nothing(draw).max() > 2


@pytest.mark.parametrize("options", [
    {"subpixel_bits": 0}, {"subpixel_bits": 16}, {"subpixel_bits": "exact"}, {"method": "scanline"},
    {"origin": (40, -30)}, {"sampling": "msaa4"}, {"viewport": (500, 400)},
])  # fmt: skip
def test_rasterize_in_bands_with_options_equals_the_whole(options):
    assert (assert_bands_change_nothing(partial(tl.rasterize, *strewn(3, 120), SIZE, **options)) >= 0).any()


@pytest.mark.parametrize("threads", [1, 2])
def test_triangles_that_planes_cut(force, threads):
    mesh = np.random.default_rng(4).normal(size=(300, 3)) * [3, 3, 6], np.arange(300).reshape(-1, 3)
    camera = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1.02, -0.2], [0, 0, -1, 0]])
    options = {"transform": camera, "threads": threads}
    assert (assert_bands_change_nothing(partial(tl.rasterize, *mesh, SIZE, **options)) >= 0).any()
    force(area_triangle=0.0, area_bytes=4 * engine.area_stride(SIZE[0]) * 8)
    assert_bands_change_nothing(partial(tl.overdraw, *mesh, SIZE, sampling="area", **options))


def test_which_are_drawn_so():
    """Strewn triangles, and few of a mesh; not many of a mesh, nor tiny ones, nor small pictures."""

    def in_bands(vertices, triangles, size):
        return "one band after the other" in tl.plan(vertices, triangles, size).explain()

    wide, tall = 1920, 1080
    rng = np.random.default_rng(0)
    at = rng.random((30_000, 1, 3)) * [wide, tall, 1]
    triangles = np.arange(90_000).reshape(-1, 3)
    for px, is_so in ((40, True), (2, False)):
        vertices = (at + rng.uniform(-px, px, (30_000, 3, 3)) * [0.7, 0.7, 0]).reshape(-1, 3)
        assert in_bands(vertices, triangles, (wide, tall)) is is_so
        assert not in_bands(vertices * [0.1, 0.1, 1], triangles, (wide // 10, tall // 10))
    for n, is_so in ((100, True), (400, False)):
        x, y = np.meshgrid(np.linspace(0, wide, n + 1), np.linspace(0, tall, n + 1))
        grid = np.stack([x, y, x + y], -1).reshape(-1, 3)
        k = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
        cells = np.concatenate([k + [0, 1, n + 2], k + [0, n + 2, n + 1]], 1).reshape(-1, 3)
        assert in_bands(grid, cells, (wide, tall)) is is_so


def test_index_outside_the_vertices_is_refused_in_bands():
    vertices, triangles = strewn(5)
    triangles[17, 1] = len(vertices)
    with bands(are_drawn=True), pytest.raises(IndexError, match="17"):
        tl.rasterize(vertices, triangles, SIZE)


@ON_EACH_ISA
@pytest.mark.parametrize("sampling_", ["area", "center"])
@pytest.mark.parametrize(("channels", "blend"), [(4, "over"), (4, "replace"), (3, "replace"), (2, "over"), (1, "add")])
def test_fill_in_bands_equals_the_whole(isa, sampling_, channels, blend):
    vertices, triangles = strewn(6)
    colors = np.random.default_rng(1).integers(0, 256, (len(triangles), channels)).astype(np.uint8)
    colors[::2, -1] = 255
    options = {"per": "triangle", "sampling": sampling_, "blend": blend}
    for background, values in ((None, colors), (7, colors), (0.5, colors.astype(np.float32))):
        ground = None if background is None else np.full(channels, background, values.dtype)
        with on(isa):
            assert_bands_change_nothing(
                partial(tl.fill, vertices[:, :2], triangles, values, SIZE, background=ground, **options)
            )


SHAPES = {
    "steep": [[40.3, 10.7], [290.1, 150.3], [90.9, 290.2]],
    "flat": [[5.5, 20.25], [320.75, 80.5], [30.0, 110.125]],
    "level": [[20, 40], [300.5, 40], [120.25, 280]],
    "upright": [[60, 10], [60, 280.5], [300, 140]],
    "beyond": [[-200.5, -100.25], [900.0, 100.0], [100.0, 800]],
    "left": [[-120.5, 20.25], [150.0, 150.0], [-20.0, 290]],
    "thin": [[30, 5], [33.5, 295.5], [31.25, 150]],
    "far": [[-3e6, -2e6], [4e6, 1e5], [1e5, 5e6]],
    "centres": [[16.5, 16.5], [272.5, 144.5], [16.5, 272.5]],
}


@ON_EACH_ISA
@one_by_one("shape", SHAPES)
@one_by_one("blend", ["over", "replace", "multiply", "max"])
def test_large_triangles_by_area(isa, shape, blend):
    """A flat triangle has the bits of one whose vertices have that colour, which takes another way."""
    rng = np.random.default_rng(2)
    points = np.array(SHAPES[shape])
    for corners in (points, points[::-1]):
        for alpha in (255, 90):
            color = np.array([[200, 30, 99, alpha]], np.uint8)
            ground = rng.integers(0, 256, (SIZE[1], SIZE[0], 4)).astype(np.uint8)
            ground[::2, :, 3] = 255
            flat, smooth = ground.copy(), ground.copy()
            with on(isa):
                options = {"sampling": "area", "blend": blend}
                tl.fill(corners, [[0, 1, 2]], color, SIZE, per="triangle", out=flat, **options)
                tl.fill(corners, [[0, 1, 2]], np.repeat(color, 3, 0), SIZE, per="vertex", out=smooth, **options)
            assert (flat == smooth).all()
            assert (flat != ground).any()


@ON_EACH_ISA
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("sampling_", ["msaa4", "msaa16"])
@pytest.mark.parametrize("is_sorted", [True, False])
def test_samples_from_the_last_triangle_to_the_first(force, isa, threads, sampling_, is_sorted):
    """Flat colours, large triangles over small ones and under them, have the bits of colours of vertices."""
    force(pays_to_sort_labels=is_sorted)
    large, _ = strewn(7, 60, 200.0)
    small, _ = strewn(8, 400, 12.0)
    parts = [large[:90], small[:600], large[90:], small[600:], large[:30] + 3]
    vertices = np.concatenate(parts)[:, :2]
    triangles = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    rng = np.random.default_rng(9)
    ground = rng.integers(0, 256, (SIZE[1], SIZE[0], 4)).astype(np.uint8)
    for channels, background in ((4, None), (4, (9, 8, 7, 6)), (3, 50)):
        colors = rng.integers(0, 256, (len(triangles), channels)).astype(np.uint8)
        flat, smooth = ground[..., :channels].copy(), ground[..., :channels].copy()
        options = {"sampling": sampling_, "background": background, "threads": threads}
        with on(isa):
            tl.fill(vertices, triangles, colors, SIZE, per="triangle", out=flat, **options)
            tl.fill(vertices, triangles, np.repeat(colors, 3, 0), SIZE, per="vertex", out=smooth, **options)
        assert (flat == smooth).all()
        assert (flat != ground[..., :channels]).any()


@pytest.mark.parametrize(
    ("side", "size_px", "threads", "is_sorted"),
    [(64, 9, 1, False), (64, 9, 2, True), (300, 200, 1, True), (900, 9, 1, True)],
)
def test_flat_colours_of_samples_are_sorted_where_that_pays(side, size_px, threads, is_sorted, monkeypatch):
    sorting, seen = SamplePass.sort_bands, []
    monkeypatch.setattr(SamplePass, "sort_bands", lambda *a, **k: seen.append(a) or sorting(*a, **k))
    vertices, triangles, colors = tl.scenes.random_triangles(50, size_px, side, side)
    assert tl.fill(vertices, triangles, colors, side, sampling="msaa4", threads=threads).any()
    assert bool(seen) == is_sorted


@pytest.mark.parametrize(("side", "threads", "is_sorted"), [(256, 1, False), (257, 1, True), (256, 2, True)])
def test_picture_of_one_band_is_drawn_whole_by_one_thread(side, threads, is_sorted, monkeypatch):
    sorting, seen = SamplePass.sort_bands, []
    monkeypatch.setattr(SamplePass, "sort_bands", lambda *a, **k: seen.append(a) or sorting(*a, **k))
    vertices = [[1, 2, 0.5], [side - 3, 9, 0.2], [40, side - 2, 0.9]]
    frags = tl.rasterize(vertices, [[0, 1, 2]], side, sampling="msaa2", threads=threads)
    assert frags.samples_triangle.any()
    assert bool(seen) == is_sorted
