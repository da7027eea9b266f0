"""Pictures of few triangles, whose colours are stored one after the other, and what lies under them."""

import numpy as np
import pytest
from engine_cases import one_by_one

import topleft as tl
from topleft.scenes import random_triangles

SIZE = (333, 401)
"""More rows than one band of a few triangles has, and rows that begin anywhere in a cache line."""


def few_triangles(n: int, channels: int):
    """Triangles of 150 px in no order, some beyond the frame, and colours."""
    vertices, triangles, _ = random_triangles(n, 150, *SIZE)
    colors = np.random.default_rng(n).integers(0, 256, (n, channels), np.uint8)
    return np.ascontiguousarray(vertices[:, :2]), triangles, colors


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@one_by_one("n", [1, 5, 63, 64, 300])
def test_fill_of_few_triangles_shows_the_later_one(n, channels):
    vertices, triangles, colors = few_triangles(n, channels)
    ids = tl.rasterize(vertices, triangles, SIZE).triangle
    ground = np.arange(7, 7 + channels, dtype=np.uint8)
    expected = np.concatenate([colors, ground[None]])[ids]
    picture = tl.fill(vertices, triangles, colors, SIZE, per="triangle", background=ground)
    assert (picture == expected).all()
    assert (ids >= 0).any()


@pytest.mark.parametrize("threads", [1, 3])
def test_fill_of_few_triangles_keeps_out_where_nothing_is(threads):
    vertices, triangles, colors = few_triangles(9, 4)
    ids = tl.rasterize(vertices, triangles, SIZE).triangle
    out = np.random.default_rng(1).integers(0, 256, (*SIZE[::-1], 4), np.uint8)
    expected = np.where((ids < 0)[..., None], out, colors[ids])
    tl.fill(vertices, triangles, colors, SIZE, per="triangle", out=out, threads=threads)
    assert (out == expected).all()


def test_fill_without_triangles_is_background():
    nothing = np.empty((0, 3), np.int32), np.empty((0, 4), np.uint8)
    picture = tl.fill(np.empty((0, 2)), *nothing, (5, 4), background=(1, 2, 3, 4))
    assert (picture == [1, 2, 3, 4]).all()


@pytest.mark.parametrize("width", [1, 63, 64, 65, 640, 1000])
def test_coverage_of_long_runs_of_one_value(width):
    vertices, triangles = [[0, 0], [2 * width, 0], [0, 200]], [[0, 1, 2]]
    mask = tl.coverage(vertices, triangles, (width, 150))
    assert (mask == (tl.overdraw(vertices, triangles, (width, 150)) > 0)).all()
    assert mask.view(np.uint8).max() == 1


def test_rasterize_flat_vertices_depth_is_made_when_asked_for():
    vertices, triangles, _ = few_triangles(4, 1)
    ids, depth = np.empty(SIZE[::-1], np.int32), np.empty(SIZE[::-1], np.float32)
    tl.rasterize(vertices, triangles, SIZE, out=(ids, depth))
    frags = tl.rasterize(vertices, triangles, SIZE)
    assert (frags.triangle == ids).all()
    assert frags.depth.dtype == np.float32
    assert (frags.depth == depth).all()
    assert set(np.unique(depth)) == {0, np.inf}


def test_rasterize_out_may_be_ids_alone():
    ids = np.empty((2, 3), np.int32)
    frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (3, 2), out=(ids, None))
    assert frags.triangle is ids
    assert ids.tolist() == [[0, 0, 0], [0, 0, -1]]


def test_rasterize_out_may_be_depth_alone():
    depth = np.empty((2, 3), np.float32)
    frags = tl.rasterize([[0, 0, 1], [4, 0, 1], [0, 4, 1]], [[0, 1, 2]], (3, 2), out=(None, depth))
    assert frags.depth is depth
    assert depth.tolist() == [[1, 1, 1], [1, 1, np.inf]]


LARGE = (1100, 1003)
"""Room for four triangles that are few: a triangle for 2**18 pixels."""


def large_triangles(kind: str, channels: int):
    """Four triangles over much of a picture, opaque and translucent, which share edges and reach beyond it."""
    vertices = np.array([[-90.3, 12.7], [1003.1, -40.2], [1234.5, 950.25], [300.4, 1090.6], [20.5, 500.5], [700, 510]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 3], [1, 4, 5]], np.int32)
    colors = np.random.default_rng(channels).integers(0, 256, (4, channels)).astype(np.uint8)
    colors[1::2, -1] = 255
    return vertices, triangles, colors if kind == "uint8" else (colors / 255).astype(np.float32)


@pytest.mark.parametrize("sampling", ["area", "center"])
@pytest.mark.parametrize(
    ("kind", "channels", "blend"),
    [
        (kind, channels, blend)
        for kind, channels in (("uint8", 3), ("uint8", 4), ("float32", 1), ("float32", 4))
        for blend in ("replace", "over", "premultiplied", "add", "multiply")
        if channels == 4 or blend not in ("over", "premultiplied")  # which need opacity
    ],
)
def test_fill_of_few_large_triangles_over_a_background_is_that_over_a_picture(kind, channels, sampling, blend):
    alpha = "premultiplied" if blend == "premultiplied" else "straight"
    options = {"sampling": sampling, "blend": "over" if blend == "premultiplied" else blend, "alpha": alpha}
    vertices, triangles, colors = large_triangles(kind, channels)
    ground = colors[0] // 2 if kind == "uint8" else colors[0] / 2
    out = np.empty((*LARGE[::-1], channels), colors.dtype)
    out[...] = ground
    tl.fill(vertices, triangles, colors, LARGE, per="triangle", out=out, **options)
    for threads in (1, 3):
        picture = tl.fill(
            vertices, triangles, colors, LARGE, per="triangle", background=ground, threads=threads, **options
        )
        assert (picture == out).all()


def test_fill_of_few_large_triangles_writes_nothing_beside_a_strided_out():
    vertices, triangles, colors = large_triangles("uint8", 3)
    around = np.full((LARGE[1], LARGE[0] + 5, 3), 9, np.uint8)
    tl.fill(
        vertices, triangles, colors, LARGE, per="triangle", background=1, blend="add", sampling="area",
        out=around[:, 2:-3],
    )  # fmt: skip
    assert (around[:, :2] == 9).all()
    assert (around[:, -3:] == 9).all()
    expected = tl.fill(vertices, triangles, colors, LARGE, per="triangle", background=1, blend="add", sampling="area")
    assert (around[:, 2:-3] == expected).all()
