"""Blending: each pixel as in the reference, in painter's order, the same bits on every build and without seams."""

from functools import lru_cache
from itertools import product

import numpy as np
import pytest
from comparing import assert_exact, assert_same
from engine_cases import ON_EACH_ISA, assert_same_everywhere, mixed, on, one_by_one
from strategies import Scene, perspective, soup

import topleft as tl
from topleft._core.raster.sampling import POSITIONS
from topleft.methods.reference import blend as ref
from topleft.methods.reference.sampling import mean

MODES = ("replace", "over", "add", "multiply", "max", "min")
CHANNELS = (1, 2, 3, 4)
#: Every mode with every number of channels that it takes; where none is an alpha, its kind says nothing.
CASES = [
    (mode, alpha, n)
    for mode, alpha, n in product(MODES, ("straight", "premultiplied"), CHANNELS)
    if n in (2, 4) or (mode != "over" and alpha == "straight")
]


def random_colors(rng, shape, dtype, alpha):
    """Colours with many extremes; premultiplied ones do not exceed their alpha."""
    extreme = rng.choice([0, 1, 127, 128, 254, 255], shape)
    colors = np.where(rng.integers(0, 3, shape) == 0, extreme, rng.integers(0, 256, shape))
    if alpha == "premultiplied" and shape[-1] in (2, 4):
        colors = np.minimum(colors, colors[..., -1:])
    return colors.astype(np.uint8) if dtype == np.uint8 else (colors / 255).astype(np.float32)


def draw(scene, colors, **options):
    return tl.fill(*scene.arrays[:2], colors, scene.size, **(scene.view | options))


# ---- against the reference ------------------------------------------------------------------------------------------


@lru_cache(None)
def small_scenes():
    """A crowd of overlapping triangles of each class of size, and one whose triangles a clip plane cuts."""
    rng = np.random.default_rng(4)
    crowd = mixed(rng, 160, (41, 13))
    eye = perspective(0.5, 9)
    corners = rng.uniform(-2, 2, (24, 3)) - [0, 0, 1.5]
    return Scene(crowd.vertices[:, :2], *crowd.arrays[1:]), soup(corners @ eye[:, :3].T + eye[:, 3], (12, 12))


@lru_cache(None)
def expected_by_samples(mode, alpha, n_channels, dtype):
    rng = np.random.default_rng(n_channels)
    found = []
    for scene in small_scenes():
        colors = random_colors(rng, (len(scene.triangles), n_channels), dtype, alpha)
        ground = random_colors(rng, (scene.size[1], scene.size[0], n_channels), dtype, alpha)
        ground[:, : scene.size[0] // 2, -1] = 255 if dtype == np.uint8 else 1  # opaque, mixed and clear
        ground[:, -4:] = 0
        options = {"per": "triangle", "mode": mode, "alpha": alpha, "background": ground}
        found.append((scene, colors, ground, ref.blend(*scene.arrays[:2], colors, scene.size, **options, **scene.view)))
    return found


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@one_by_one(("mode", "alpha", "n_channels"), CASES)
def test_blend_flat_equals_reference(mode, alpha, n_channels, dtype, isa):
    for scene, colors, ground, expected in expected_by_samples(mode, alpha, n_channels, dtype):
        for method in ("auto", "edge"):
            with on(isa):
                got = draw(scene, colors, per="triangle", blend=mode, alpha=alpha, out=ground.copy(), method=method)
            assert_exact(got, expected)


@lru_cache(None)
def single_areas():
    """How much of each pixel every triangle of the scenes covers; `test_area.py` has the proof of it."""
    return [
        np.stack([tl.coverage(s.vertices, [t], s.size, sampling="area", **s.view) for t in s.triangles])
        for s in small_scenes()
    ]


@lru_cache(None)
def expected_by_areas(mode, alpha, n_channels, dtype):
    found = []
    for (scene, colors, ground, _), areas in zip(
        expected_by_samples(mode, alpha, n_channels, dtype), single_areas(), strict=True
    ):
        options = {"per": "triangle", "mode": mode, "alpha": alpha, "background": ground, "coverages": areas}
        found.append((scene, colors, ground, ref.blend(*scene.arrays[:2], colors, scene.size, **options)))
    return found


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@one_by_one(("mode", "alpha", "n_channels"), CASES)
def test_blend_by_area_equals_reference(mode, alpha, n_channels, dtype, isa):
    for scene, colors, ground, expected in expected_by_areas(mode, alpha, n_channels, dtype):
        with on(isa):
            got = draw(scene, colors, per="triangle", blend=mode, alpha=alpha, out=ground.copy(), sampling="area")
        assert_exact(got, expected)


@ON_EACH_ISA
@pytest.mark.parametrize(
    ("mode", "alpha", "n_channels"), [("over", "straight", 4), ("multiply", "straight", 3), ("add", "straight", 1)]
)
def test_blend_gouraud_equals_reference(mode, alpha, n_channels, isa):
    scene = small_scenes()[0]
    rng = np.random.default_rng(8)
    few = Scene(scene.vertices[:150], scene.triangles[:50], scene.size)
    colors = random_colors(rng, (150, n_channels), np.uint8, alpha)
    expected = ref.blend(*few.arrays[:2], colors, few.size, per="vertex", mode=mode, alpha=alpha, background=200)
    with on(isa):
        assert_exact(draw(few, colors, per="vertex", blend=mode, alpha=alpha, background=200), expected)


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_blend_gouraud_of_one_layer_is_the_fill(dtype, isa):
    """Added to black, colours are what `fill` gives; those of triangles that a clip plane has cut, too."""
    for scene in small_scenes():
        for triangle in scene.triangles[:30]:
            one = Scene(scene.vertices, [triangle], scene.size)
            colors = random_colors(np.random.default_rng(1), (len(scene.vertices), 3), dtype, "straight")
            with on(isa):
                assert_same(draw(one, colors, per="vertex", blend="add"), draw(one, colors, per="vertex"))


def every_pair():
    """Rows of 256 pixels: the old value is the column, the colour's the row."""
    y = np.arange(256)
    corners = np.stack([np.stack([0 * y - 9, y], 1), np.stack([0 * y - 9, y + 1], 1), np.stack([0 * y + 700, y], 1)], 1)
    return soup(corners.reshape(-1, 2), (256, 256)), np.arange(256)[None, :], np.arange(256)[:, None]


@ON_EACH_ISA
def test_blend_over_of_every_number_is_the_nearest(isa):
    scene, old, new = every_pair()
    ground = np.stack([np.broadcast_to(old, (256, 256)), np.full((256, 256), 255)], -1).astype(np.uint8)
    with on(isa):
        for a in range(256):
            colors = np.stack([np.arange(256), np.full(256, a)], -1).astype(np.uint8)
            got = draw(scene, colors, per="triangle", blend="over", out=ground.copy())
            assert_same(got[..., 0], ((old * (255 - a) + new * a + 127) // 255).astype(np.uint8))
            assert (got[..., 1] == 255).all()


@ON_EACH_ISA
def test_blend_multiply_and_add_of_every_number_are_right(isa):
    scene, old, new = every_pair()
    ground, colors = np.tile(np.arange(256, dtype=np.uint8), (256, 1)), np.arange(256, dtype=np.uint8)
    wish = {
        "multiply": (old * new + 127) // 255,
        "add": np.minimum(old + new, 255),
        "max": np.maximum(old, new),
        "min": np.minimum(old, new),
    }
    with on(isa):
        for mode, expected in wish.items():
            got = draw(scene, colors, per="triangle", blend=mode, out=ground.copy())
            assert_same(got, expected.astype(np.uint8))


@ON_EACH_ISA
def test_blend_over_translucent_is_the_nearest_even(isa):
    """Every pair of alphas, and colours at random."""
    scene, _, _ = every_pair()
    rng = np.random.default_rng(0)
    ground = rng.integers(0, 256, (256, 256, 4), np.uint8)
    ground[..., 3] = np.arange(256)
    colors = rng.integers(0, 256, (256, 4), np.uint8)
    colors[:, 3] = np.arange(256)
    with on(isa):
        got = draw(scene, colors, per="triangle", blend="over", out=ground.copy())
    above = 255 * colors[:, None, 3:].astype(int)
    below = ground[..., 3:].astype(int) * (255 - colors[:, None, 3:])
    total = above + below
    twice = 2 * (colors[:, None, :3] * above + ground[..., :3] * below) // np.maximum(total, 1)
    rest = 2 * (colors[:, None, :3] * above + ground[..., :3] * below) - twice * total
    nearest = (twice + (twice & 1)) // 2 - ((twice % 4 == 1) & (rest == 0))
    expected = np.concatenate([np.where(total == 0, ground[..., :3], nearest), (2 * total + 255) // 510], -1)
    assert_same(got, expected.astype(np.uint8))


# ---- to the last bit ------------------------------------------------------------------------------------------------


@lru_cache(None)
def crowd():
    """Triangles of every class, many over one another, with their colours."""
    rng = np.random.default_rng(6)
    many = mixed(rng, 4000, (157, 83))
    huge = rng.uniform(-3e5, 3e5, (30, 2))
    vertices = np.concatenate([many.vertices[:6000, :2], huge, many.vertices[6000:, :2]])
    return soup(vertices, (157, 83)), rng


def crowd_colors(dtype, n_channels, *, per_vertex=False):
    scene, _ = crowd()
    n = len(scene.vertices) if per_vertex else len(scene.triangles)
    return random_colors(np.random.default_rng(n_channels), (n, n_channels), dtype, "straight")


def crowd_picture(colors, **options):
    scene, _ = crowd()
    return draw(scene, colors, per="vertex" if len(colors) == len(scene.vertices) else "triangle", **options)


#: Mode, type, channels, whether colours are those of vertices, sampling.
KINDS = [
    ("over", np.uint8, 4, False, "center"),
    ("over", np.float32, 4, False, "center"),
    ("multiply", np.uint8, 3, False, "center"),
    ("over", np.uint8, 2, True, "center"),
    ("add", np.float32, 3, True, "center"),
    ("over", np.uint8, 4, False, "area"),
    ("replace", np.float32, 2, False, "area"),
    ("replace", np.uint8, 3, True, "area"),
    ("over", np.float32, 4, True, "area"),
]


@pytest.mark.parametrize(("mode", "dtype", "n_channels", "per_vertex", "sampling"), KINDS)
def test_blend_is_the_same_everywhere(mode, dtype, n_channels, per_vertex, sampling):
    scene, _ = crowd()
    colors = crowd_colors(dtype, n_channels, per_vertex=per_vertex)
    options = {"per": "vertex" if per_vertex else "triangle", "blend": mode, "background": 1, "sampling": sampling}

    def draw_there(size, **view):
        return [draw(Scene(scene.vertices, scene.triangles, size), colors, **options, **view)]

    windows = [(0, 0, 1, 1), (5, 7, 33, 20), (90, 1, 67, 82), (156, 82, 1, 1), (17, 40, 16, 3)]
    assert_same_everywhere(draw_there, scene.size, [(w[:2], w[2:]) for w in windows])


@ON_EACH_ISA
def test_blend_is_in_painters_order(isa):
    """What is drawn in two calls is what is drawn in one."""
    scene, _ = crowd()
    colors = crowd_colors(np.uint8, 4)
    for sampling in ("center", "area"):
        options = {"per": "triangle", "blend": "over", "sampling": sampling}
        with on(isa):
            expected = crowd_picture(colors, blend="over", background=(9, 9, 9, 90), sampling=sampling)
            for cut in (1, 7, 1999, 2010, 4005):
                got = np.full((83, 157, 4), (9, 9, 9, 90), np.uint8)
                for part in (slice(0, cut), slice(cut, None)):
                    tl.fill(scene.vertices, scene.triangles[part], colors[part], scene.size, out=got, **options)
                assert_same(got, expected)


@ON_EACH_ISA
def test_blend_by_area_of_vertex_colours_that_agree_is_flat(isa):
    """Also where a clip plane has cut the triangles, and pixel centres lie beside the pieces."""
    for scene in small_scenes():
        color = random_colors(np.random.default_rng(5), (1, 4), np.uint8, "straight")
        options = {"blend": "over", "sampling": "area", "background": 1}
        with on(isa):
            got = draw(scene, np.repeat(color, len(scene.vertices), 0), per="vertex", **options)
            flat = draw(scene, np.repeat(color, len(scene.triangles), 0), per="triangle", **options)
        assert_same(got, flat)


@ON_EACH_ISA
def test_blend_by_area_of_vertex_colours_is_the_fill_inside(isa):
    scene = soup([[1.3, 2.1], [60, 9.7], [20.2, 50]], (64, 64))
    colors = np.array([[0, 255], [255, 255], [90, 255]], np.uint8)
    with on(isa):
        fill = draw(scene, colors, per="vertex")
        got = draw(scene, colors, per="vertex", sampling="area", background=7)
        inside = tl.coverage(*scene.arrays, sampling="area") == 1
    assert inside.sum() > 500
    assert_same(got[inside], fill[inside])


@ON_EACH_ISA
def test_blend_by_area_takes_weights_below_zero_as_zero(isa):
    """The centre lies left of the triangle, half way up its edge: both colours there count, and the third does not."""
    scene = soup([[0.75, -8], [0.75, 9], [8, 0.5]], (1, 1))
    with on(isa):
        got = draw(scene, np.array([100, 200, 0], np.uint8), per="vertex", sampling="area", blend="max")
        color = (100 * 8.5 + 200 * 8.5) / 17
        area = float(tl.coverage(*scene.arrays, sampling="area")[0, 0])
    assert abs(int(got[0, 0]) - color * area) < 3


# ---- the calls ------------------------------------------------------------------------------------------------------

ONE = ([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]])


@lru_cache(None)
def mean_by_samples(mode, alpha, n_channels, dtype):
    """A scene to fill, and the mean of its pictures, each with the vertices moved to one of four samples."""
    rng = np.random.default_rng(n_channels)
    scene = mixed(rng, 90, (41, 13))
    vertices = np.round(scene.vertices[:, :2] * 256) / 256  # on the grid, so that moving them moves no corner
    colors = random_colors(rng, (len(scene.triangles), n_channels), dtype, alpha)
    options = {"per": "triangle", "background": random_colors(rng, (n_channels,), dtype, alpha), "alpha": alpha}
    pictures = [
        tl.fill(vertices - np.array(at) / 16, scene.triangles, colors, scene.size, blend=mode, **options)
        for at in POSITIONS[4]
    ]
    is_straight = n_channels in (2, 4) and alpha == "straight" and mode in ("over", "replace")
    samples = np.moveaxis(pictures, 0, 2)
    expected = [[mean(pixel, is_straight=is_straight) for pixel in row] for row in samples]
    return (vertices, scene.triangles, colors, scene.size), options, expected


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@one_by_one(("mode", "alpha", "n_channels"), CASES)
def test_blend_of_samples_is_the_mean_of_pictures_by_samples(mode, alpha, n_channels, dtype, isa):
    arrays, options, expected = mean_by_samples(mode, alpha, n_channels, dtype)
    for threads in (1, 3):
        with on(isa):
            got = tl.fill(*arrays, blend=mode, **options, sampling="msaa4", threads=threads)
        if dtype == np.uint8:
            assert_same(got, np.array(expected, np.uint8))
        else:
            assert abs(got - np.array(expected)).max() < 2**-22  # float64 sums rounded once, of numbers below 4


def test_blend_goes_to_out_of_any_layout():
    out = np.full((6, 4, 3), 10, np.uint8)[::2]
    assert tl.fill(*ONE, [[1, 2, 3]], (4, 3), blend="add", out=out) is out
    assert out[:, :, 2].tolist() == [[13, 13, 13, 10], [13, 13, 10, 10], [13, 10, 10, 10]]


@pytest.mark.parametrize("size", [(0, 5), (5, 0), (3, 2)])
def test_blend_of_nothing_is_the_background(size):
    got = tl.fill(np.zeros((0, 2)), np.zeros((0, 3), int), np.zeros((0, 4), np.uint8), size, blend="over", background=7)
    assert (got.shape, got.dtype, (got == 7).all()) == ((*size[::-1], 4), np.uint8, True)


@pytest.mark.parametrize("n", [1, 3])
def test_blend_over_without_alpha_raises(n):
    with pytest.raises(ValueError, match=f"colors must have 2 or 4 channels, .* got {n}"):
        tl.fill(*ONE, np.zeros((1, n), np.uint8), (4, 4), blend="over")


def test_blend_unknown_options_raise():
    with pytest.raises(ValueError, match=r"blend must be one of 'replace', 'over', .* got 'screen'"):
        tl.fill(*ONE, [[1]], (4, 4), blend="screen")
    with pytest.raises(ValueError, match="alpha must be one of 'straight', 'premultiplied', got 'none'"):
        tl.fill(*ONE, [[1]], (4, 4), alpha="none")


def test_blend_with_a_classic_raises():
    with pytest.raises(ValueError, match="blend must be 'replace' for method 'zigzag', got 'add'"):
        tl.fill(*ONE, [[1]], (4, 4), blend="add", method="zigzag")


def test_blend_bad_index_raises_and_leaves_out_alone():
    out = np.full((4, 4), 7, np.uint8)
    with pytest.raises(IndexError, match="row 1"):
        tl.fill(ONE[0], [[0, 1, 2], [0, 1, 3]], [1, 2], (4, 4), blend="add", out=out)
    assert (out == 7).all()
    with pytest.raises(IndexError, match="row 1"):
        tl.fill(ONE[0], [[0, 1, 2], [0, 1, 3]], [1, 2], (4, 4), blend="add")


# ---- each pixel by itself -------------------------------------------------------------------------------------------

HALF_A_ROW = [[-100, 0.5], [200, 0.5], [50, -200]], [[0, 1, 2]]  # the upper half of each pixel of row 0


def over_by_area(under, x, color, **options):
    view = {"per": "triangle", "sampling": "area", "origin": (x, 0)} | options
    return tl.fill(*HALF_A_ROW, [color], (under.shape[1], 1), **view, out=under.copy())


@ON_EACH_ISA
@pytest.mark.parametrize("blend", ["over", "replace"])
def test_blend_by_area_ignores_the_neighbours_of_a_pixel(blend, isa):
    under = np.zeros((1, 40, 4), np.uint8)
    under[..., 3] = 255
    under[0, [1, 17, 30], 3] = 128  # translucent
    with on(isa):
        whole = over_by_area(under, 0, [1, 1, 1, 255], blend=blend)
        for x in (1, 2, 3, 18):
            assert_same(over_by_area(under[:, x:], x, [1, 1, 1, 255], blend=blend), whole[:, x:])
    opaque = under[0, :, 3] == 255
    assert (whole[0, opaque] == [1, 1, 1, 255]).all()  # 0.5 is rounded up


@ON_EACH_ISA
@pytest.mark.parametrize(("blend", "color", "ground"), [("replace", 1.0, np.inf), ("multiply", -1.0, 0.0)])
def test_blend_by_area_of_a_whole_pixel_is_the_blend_without_area(blend, color, ground, isa):
    vertices, triangles = [[0.5, -50], [0.5, 50], [60, 0]], [[0, 1, 2]]  # a part of pixel 0, all of those beyond
    under = np.full((1, 32, 1), ground, np.float32)
    view = {"per": "triangle", "blend": blend}
    with on(isa):
        by_area = tl.fill(vertices, triangles, [[color]], (32, 1), **view, sampling="area", out=under.copy())
        plain = tl.fill(vertices, triangles, [[color]], (32, 1), **view, out=under.copy())
    assert by_area[0, 1:].tobytes() == plain[0, 1:].tobytes()


@ON_EACH_ISA
def test_blend_by_area_draws_the_least_area(isa):
    corners, under = [[0, 0], [2**-12, 0], [0, 2**-11]], np.zeros((1, 1, 1), np.float32)
    view = {"per": "triangle", "blend": "add", "sampling": "area", "subpixel_bits": 16}
    with on(isa):
        assert tl.fill(corners, [[0, 1, 2]], [[1.0]], (1, 1), **view, out=under).item() == 2.0**-24


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_areas_far_away_stay_in_their_own_cells(dtype, isa):
    """Strips of triangles beyond 2**30 sub-pixels are as wide as the window, however narrow the triangles are."""
    v = np.array([[95, 440], [95, -250], [96, -370], [119, -120], [119, 206], [317, 145]], np.float64)
    t, colors = [[0, 1, 2], [3, 4, 5]], np.array([[9, 99, 200, 80], [255, 3, 90, 160]]).astype(dtype)
    options = {"per": "triangle", "blend": "over", "sampling": "area", "background": 7}
    far = np.array([2**31 - 866, -(2**32) - 7])
    with on(isa):
        near = tl.fill(v, t, colors, (1500, 300), **options)
        for threads in (1, 2, 3):
            got = tl.fill(v + far, t, colors, (1500, 300), origin=tuple(far.tolist()), threads=threads, **options)
            assert (got == near).all()


@ON_EACH_ISA
@pytest.mark.parametrize("sampling", ["center", "msaa4", "area"])
@pytest.mark.parametrize("blend", ["replace", "over"])
def test_pixels_of_four_bytes_may_lie_at_any_address(blend, sampling, isa):
    """UndefinedBehaviorSanitizer watches in `.ci/sanitize core`."""
    options = {"per": "triangle", "blend": blend, "sampling": sampling}
    mesh = [[-5, -5], [300, 10], [40, 90.5], [70, -20]], [[0, 1, 2], [1, 3, 2]], np.array([[9, 9, 9, 255]] * 2, "u1")
    odd = np.zeros(40 * 200 * 4 + 1, np.uint8)[1:].reshape(40, 200, 4)
    with on(isa):
        tl.fill(*mesh, (200, 40), out=odd, **options)
        assert (odd == tl.fill(*mesh, (200, 40), **options)).all()


@ON_EACH_ISA
def test_a_narrow_triangle_far_beside_a_wide_window_draws_nothing(isa):
    far = [[5e6, 10], [5e6 + 30, 12], [5e6, 290]]
    with on(isa):
        for bits in (8, 16):
            got = tl.fill(far, [[0, 1, 2]], [[255]], (4000, 300), blend="add", sampling="area", subpixel_bits=bits)
            assert not got.any()
