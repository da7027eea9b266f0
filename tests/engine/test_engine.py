"""The engine against the exact picture, on every instruction set: counts, ids, and depth to the last bit."""

from math import gcd

import numpy as np
import pytest
from comparing import assert_same
from engine_cases import DEPTH_TESTS, ON_EACH_ISA, THREADS, cases, check_all, exact_picture, mixed, on, one_by_one
from strategies import Scene, needles, perspective, soup

import topleft as tl
from topleft import scenes

BITS = one_by_one("bits", [0, 1, 4, 7, 8, 9, 12, 15, 16])

# ---- the timed scenes -----------------------------------------------------------------------------------------------

WIDE = (480, 270)


def blob(n, dtype, cull):
    vertices, triangles = scenes.blob(n)
    tilt, away = np.eye(4), np.eye(4)
    tilt[1:3, 1:3] = [[0.8, -0.6], [0.6, 0.8]]
    away[2, 3] = -3
    transform = np.diag([9 / 16, 1, 1, 1]) @ perspective(0.1, 10, focal=2.7) @ away @ tilt
    yield Scene(vertices.astype(dtype), triangles, WIDE, {"transform": transform, "cull": cull}), ("less",)


def strewn(n, size_px):
    vertices, triangles, _ = scenes.random_triangles(n, size_px, *WIDE)
    yield Scene(vertices, triangles, WIDE), ("less",)


def one_large():
    yield Scene(*scenes.large_triangle(1290, 730), (1290, 730)), (None,)


@ON_EACH_ISA
@pytest.mark.parametrize("cull", ["back", "none"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("n", [2_000, 20_000])
def test_engine_blob_equals_exact_picture(n, dtype, cull, isa):
    check_all(isa, cases(blob, n, dtype, cull), THREADS)


@ON_EACH_ISA
@pytest.mark.parametrize(("n", "size_px"), [(100, 300), (1000, 70), (8_000, 10), (8_000, 4)])
def test_engine_strewn_triangles_equal_exact_picture(n, size_px, isa):
    check_all(isa, cases(strewn, n, size_px), THREADS)


@ON_EACH_ISA
def test_engine_large_triangle_equals_exact_picture(isa):
    check_all(isa, cases(one_large), THREADS)


# ---- triangles of all kinds mixed -----------------------------------------------------------------------------------

MIXED = {
    0: {}, 1: {"level": False}, 2: {"cull": "back"}, 3: {"cull": "front", "level": False},
    4: {"bits": 4, "origin": (-300, -77)}, 5: {"bits": 16, "level": False}, 6: {"bits": 0, "level": False},
    7: {"bits": 12, "cull": "back", "level": False, "origin": (100_000, -99_999)},
}  # fmt: skip


def six_thousand(seed):
    yield mixed(np.random.default_rng(seed), 6_000, (260, 150), **MIXED[seed]), DEPTH_TESTS


@one_by_one("seed", MIXED)
@ON_EACH_ISA
def test_engine_mixed_triangles_equal_exact_picture(seed, isa):
    check_all(isa, cases(six_thousand, seed), (1, 3))


def piles(n=5_000):
    """Triangles of every class upon each other, within one another's vectors, queues and lists."""
    for seed, side in enumerate([3, 17, 70]):
        rng = np.random.default_rng(seed)
        reach = rng.choice([2, 3, 5, 20, 61, 66, 200], (n, 1, 1))
        xy = rng.uniform(0, side, (n, 1, 2)) + rng.uniform(-0.5, 0.5, (n, 3, 2)) * reach
        z = np.repeat(rng.integers(0, 4, (n, 1)) / 4, 3, 1)
        yield soup(np.dstack([xy, z]).reshape(-1, 3), (side, side)), DEPTH_TESTS


@ON_EACH_ISA
def test_engine_piles_of_mixed_triangles_equal_exact_picture(isa):
    check_all(isa, cases(piles), THREADS)


# ---- every size of box and frame ------------------------------------------------------------------------------------

LARGEST_BOX = 70


def boxes():
    """A triangle in each box of 0x0 to 70x70 samples, all boxes apart; each width begins in each column modulo 16."""
    rng = np.random.default_rng(0)
    side = np.arange(LARGEST_BOX + 1)
    cols, rows = (a.ravel() for a in np.meshgrid(side, side))
    x = 16 * np.concatenate([[0], np.cumsum(side // 16 + 2)[:-1]])
    y = np.concatenate([[0], np.cumsum(side + 1)[:-1]])
    first = np.stack([x[cols] + (5 * cols + 7 * rows) % 16, y[rows]], -1) * 256 + 128
    n = np.stack([cols, rows], -1) * 256
    low = first - rng.choice([0, 1, 128, 255], n.shape)
    high = first + n - 256 + rng.choice([1, 128, 255, 256], n.shape)
    t = rng.choice([0, 0.5, 1, rng.uniform(), rng.uniform()], n.shape)
    middle = np.round(low + t * (high - low)).astype(np.int64)
    corners = np.stack([low, middle, high], 1)
    order = np.argsort(rng.uniform(size=corners.shape), axis=1)
    xy = np.take_along_axis(corners, order, 1)
    xyz = np.dstack([xy / 256, rng.standard_normal(order.shape[:2])])
    yield soup(xyz.reshape(-1, 3), (int(x[-1]) + LARGEST_BOX + 17, int(y[-1]) + LARGEST_BOX + 2)), ("less",)


@ON_EACH_ISA
def test_engine_boxes_of_each_size_equal_exact_picture(isa):
    check_all(isa, cases(boxes), (1, 3))


def quarters(n=8_000):
    """Triangles that cover 10 samples of a box of 4x4, and 6 of 3x3: whole vectors of samples for the list."""
    rng = np.random.default_rng(0)
    legs = rng.choice([3.99, 3.99, 3.99, 2.99], (n, 1, 1)) * rng.choice([-1, 1], (n, 1, 2))
    corner = rng.integers(0, 60, (n, 1, 2)) + 0.5 - np.sign(legs) / 256
    xy = corner + [[0, 0], [1, 0], [0, 1]] * legs
    yield soup(np.dstack([xy, rng.standard_normal((n, 3))]).reshape(-1, 3), (60, 60)), DEPTH_TESTS


@ON_EACH_ISA
def test_engine_fullest_small_boxes_equal_exact_picture(isa):
    check_all(isa, cases(quarters))


def frames():
    for width in range(1, 131):
        for size in {(width, 1 + 7 * width % 23), *[(1 + 5 * width % 37, width)] * (width % 4 == 1)}:
            rng = np.random.default_rng(width)
            yield mixed(rng, 50, size, level=bool(width % 2)), DEPTH_TESTS


@ON_EACH_ISA
def test_engine_frames_of_each_width_equal_exact_picture(isa):
    check_all(isa, cases(frames), (1, 3))


# ---- one unit on either side of each limit --------------------------------------------------------------------------


def with_extents(rng, extents, size, bits, origin=(0, 0), **view):
    """Triangles of these extents (n, 2), in units, that touch all sides of their boxes, somewhere in the window."""
    n = len(extents)
    low = rng.integers(-extents, np.array(size) << bits, extents.shape)
    middle = low + np.round(rng.choice([0, 1, rng.uniform(), rng.uniform()], extents.shape) * extents).astype(np.int64)
    corners = np.stack([low, middle, low + extents], 1)
    order = np.argsort(rng.uniform(size=corners.shape), axis=1)
    xy = np.take_along_axis(corners, order, 1) * 2.0**-bits + origin
    z = np.where(rng.integers(0, 2, (n, 1)), rng.standard_normal((n, 3)), rng.integers(-2, 3, (n, 1)))
    return soup(np.dstack([xy, z]).reshape(-1, 3), size, subpixel_bits=bits, origin=origin, **view)


def extents_at_limits(rng, bits, n=300):
    """Round powers of two, whole pixels up to 70, and 62 pixels of at most 8 bits."""
    powers = 2 ** np.arange(bits + 7)
    pixels = np.arange(1, 71) << bits
    usual = np.array([2, 3, 4, 5, 61, 62, 62, 62, 63, 64]) << min(bits, 8)
    extents = np.stack([rng.choice(rng.permutation(group), (n, 2)) for group in (powers, pixels, usual)])
    mixture = np.take_along_axis(extents, rng.integers(0, 3, (1, n, 2)), 0)[0]
    return np.maximum(mixture + rng.integers(-1, 2, (n, 2)), 0)


def limits_of(bits):
    rng = np.random.default_rng(bits)
    yield with_extents(rng, extents_at_limits(rng, bits), (150, 90), bits), DEPTH_TESTS


@BITS
@ON_EACH_ISA
def test_engine_extents_at_limits_equal_exact_picture(bits, isa):
    check_all(isa, cases(limits_of, bits), (1, 8))


def cut_by_windows(bits):
    rng = np.random.default_rng(bits)
    largest = 62 << min(bits, 8)
    for x in range(-63, 64, 3):
        size = tuple(rng.integers(1, 40, 2).tolist())
        extents = largest - rng.integers(0, 3, (40, 2))
        scene = with_extents(rng, extents, size, bits)
        shift = (x, int(rng.integers(-63, 64)))
        yield Scene(scene.vertices, scene.triangles, size, {"subpixel_bits": bits, "origin": shift}), DEPTH_TESTS


@ON_EACH_ISA
@pytest.mark.parametrize("bits", [0, 7, 8, 9, 16])
def test_engine_largest_boxes_cut_by_windows_equal_exact_picture(bits, isa):
    check_all(isa, cases(cut_by_windows, bits))


def windows_at(edge_px, bits):
    """Windows that end at, begin at and hold a coordinate, on either side of the picture's origin."""
    rng = np.random.default_rng(bits)
    size = (37, 21)
    for offset in [(-37, -21), (-36, 0), (-18, -10), (-1, -20), (0, 0), (1, 1)]:
        for x_sign, y_sign in [(1, 0), (0, -1), (-1, 1)]:
            near = (x_sign * edge_px + offset[0], y_sign * edge_px + offset[1])
            extents = np.concatenate([extents_at_limits(rng, bits, 20), rng.integers(0, 3 << bits, (20, 2))])
            scene = with_extents(rng, extents, size, bits, near)
            grid = scene.vertices[:, :2] * 2.0**bits
            limit = edge_px * 2.0**bits
            at_limit = (abs(abs(grid) - limit) < 2.0**bits) & (rng.integers(0, 3, grid.shape) == 0)
            grid = np.where(at_limit, np.sign(grid) * (limit + rng.integers(-1, 2, grid.shape)), grid)
            vertices = np.hstack([grid * 2.0**-bits, scene.vertices[:, 2:]])
            yield Scene(vertices, scene.triangles, size, scene.view), DEPTH_TESTS


@BITS
@ON_EACH_ISA
def test_engine_vertices_at_the_end_of_64_bits_equal_exact_picture(bits, isa):
    check_all(isa, cases(windows_at, 2**30 >> bits, bits))


@one_by_one("bits", [0, 8, 16])
@pytest.mark.parametrize("edge_px", [2**15, 2**22, 2**30, 2**31])
@ON_EACH_ISA
def test_engine_windows_at_limits_equal_exact_picture(edge_px, bits, isa):
    check_all(isa, cases(windows_at, edge_px, bits))


def edges_past_far_columns(rng, n, col):
    """Triangles whose right edges, 2**31 units high, pass the centre of a column or miss it by a unit."""
    for _ in range(n):
        dx, dy = 2 * rng.integers(0, 2**15) + 1, 2**31 - 2 * rng.integers(2, 2**15) - 1
        top = np.array([col - (dx - 1) // 2, -(dy - 1) // 2])
        yield [top + [rng.integers(-1, 2), 0], top + [dx, dy], [-5, rng.integers(0, 2)]]


@ON_EACH_ISA
def test_engine_rows_of_four_million_samples_end_exactly(isa):
    col = 2**22 - 2
    xy = np.array(list(edges_past_far_columns(np.random.default_rng(0), 12, col)))
    for corners in xy:
        arguments = corners, [[0, 1, 2]], (col + 20, 1)
        with on(isa):
            ends = [int(tl.coverage(*arguments, subpixel_bits=0, method=m).sum()) for m in ("auto", "scanline")]
        assert ends[0] == ends[1]
        assert col - 5 < ends[0] < col + 5


@one_by_one("bits", [8, 9, 16])
@ON_EACH_ISA
def test_engine_counts_each_pixel_of_a_large_tiled_picture_once(bits, isa):
    size = 1280, 720  # sorted into bands of rows where vertices have records: up to 8 bits
    with on(isa):
        assert (tl.overdraw(*scenes.planar_mesh(300, *size), size, subpixel_bits=bits, threads=1) == 1).all()


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def boxes_at_sliver_limit(rng):
    """Corners in units, at 0: boxes of 2**12 times the doubled area, and one unit more and less."""
    width = np.arange(11_000, 15_873)
    for area in rng.integers(30_000, 61_000, 9000).tolist():
        box = 4096 * area + int(rng.integers(-1, 2))
        for w in width[box % width == 0].tolist():
            h = box // w
            common = gcd(w, h)
            if h <= 15_872 and area % common == 0:
                y = area // common * pow(w // common, -1, h // common) % (h // common)
                x, more = (w * y - area) // h, w * y < area
                yield [(0, 0), (w, h), (x + more * w // common, y + more * h // common)]


def at_sliver_limit():
    """Depths that cancel at a covered sample: the plane and the exact weights differ in every bit, so both show."""
    rng = np.random.default_rng(0)
    xy = np.array(list(boxes_at_sliver_limit(rng)))
    xy += rng.integers(0, 600 * 256, (len(xy), 1, 2))
    size = (660, 660)
    ids = exact_picture(soup(xy.reshape(-1, 2) / 256, size), (None,)).triangle
    seen, pixel = np.unique(ids, return_index=True)
    xy, pixel = xy[seen[1:]], pixel[1:]
    sample = np.stack([pixel % size[0], pixel // size[0]], -1) * 256 + 128
    to_corners = xy - sample[:, None]
    weights = np.stack([cross(to_corners[:, k - 2], to_corners[:, k - 1]) for k in range(3)], -1)
    weights *= np.sign(weights.sum(1, keepdims=True))
    order = np.argsort(weights, axis=1)
    xy, weights = np.take_along_axis(xy, order[:, :, None], 1), np.take_along_axis(weights, order, 1)
    z = rng.uniform(1e6, 2e6, weights.shape)
    z[:, 2] = -(weights[:, 0] * z[:, 0] + weights[:, 1] * z[:, 1]) / weights[:, 2]
    turn = (np.arange(3) + rng.integers(0, 3, (len(xy), 1))) % 3
    xyz = np.take_along_axis(np.dstack([xy / 256, z]), turn[:, :, None], 1)
    assert len(xyz) > 300
    yield soup(xyz.reshape(-1, 3), size), ("less",)


@ON_EACH_ISA
def test_engine_slivers_at_the_limit_take_the_same_depth(isa):
    check_all(isa, cases(at_sliver_limit))


# ---- depths ---------------------------------------------------------------------------------------------------------

LARGEST = float(np.finfo(np.float32).max)
SPECIAL_DEPTHS = [0.0, -0.0, 1e-45, -1e-45, 1e-40, 1e-300, -1e-300, 1.0, -1.0, 3e38, -3e38, LARGEST, -LARGEST]


def special_depths():
    rng = np.random.default_rng(0)
    for size in [(40, 30), (130, 70)]:
        scene = mixed(rng, 3000, size)
        level = np.repeat(rng.choice(SPECIAL_DEPTHS, len(scene.triangles)), 3)
        yield Scene(np.column_stack([scene.vertices[:, :2], level]), scene.triangles, size), DEPTH_TESTS
        any_sign = rng.choice([-0.0, 0.0, 1.0, -1.0, 3e38, -3e38], len(scene.vertices))
        yield Scene(np.column_stack([scene.vertices[:, :2], any_sign]), scene.triangles, size), (None,)
        for exponent in (-130, -30, 0, 120):
            z = rng.standard_normal(len(scene.vertices)) * 2.0**exponent
            yield Scene(np.column_stack([scene.vertices[:, :2], z]), scene.triangles, size), DEPTH_TESTS


@ON_EACH_ISA
def test_engine_special_depths_equal_exact_picture(isa):
    check_all(isa, cases(special_depths))


@ON_EACH_ISA
@pytest.mark.parametrize("depth_test", DEPTH_TESTS)
@pytest.mark.parametrize("make", [lambda rng: mixed(rng, 500, (50, 40)), needles], ids=["mixed", "needles"])
def test_engine_depth_that_rounds_to_minus_zero_is_zero(make, depth_test, isa):
    scene = make(np.random.default_rng(1))
    for z in (-0.0, -1e-300):
        vertices = np.column_stack([scene.vertices[:, :2], np.full(len(scene.vertices), z)])
        with on(isa):
            frags = tl.rasterize(vertices, *scene.arrays[1:], depth_test=depth_test)
        assert frags.mask.any()
        assert not frags.depth[frags.mask].view(np.int32).any()


def hard_quotients(rng, n):
    """a / b in 53 bits, next to the middle of two float64 of which one is the middle of two float32."""
    while n:
        middle = (2 * int(rng.integers(2**23, 2**24)) + 1) * 2**29 + int(rng.choice([-1, 1]))  # in 2**-54
        side = int(rng.choice([-1, 1]))
        b = -side * pow(middle, -1, 2**54) % 2**54
        if 2**52 <= b < 2**53:
            yield (middle * b + side) >> 54, b
            n -= 1


@ON_EACH_ISA
@pytest.mark.parametrize("scale", [1, 2.0**970])  # up to the largest w there is
def test_engine_depths_of_hard_quotients_are_rounded_once_each(scale, isa):
    n = 200
    z, w = np.array(list(hard_quotients(np.random.default_rng(0), n))).T[:, :, None] * scale
    x = (np.arange(n)[:, None] + [0, 1, 0.5]) * 2 / n - 1
    positions = np.dstack([x * w, [1, 1, -1.5] * w, np.repeat(z, 3, 1), np.repeat(w, 3, 1)])
    scene = soup(positions.reshape(-1, 4), (n, 1))
    with on(isa):
        depth = tl.rasterize(*scene.arrays, clip_depth="zero_to_one").depth
    assert_same(depth, (z / w).T.astype(np.float32))


@ON_EACH_ISA
@pytest.mark.parametrize(("plane", "sign"), [("near_clip", -1), ("far_clip", 1)])
def test_engine_depth_without_a_plane_ends_at_the_largest_float32(plane, sign, isa):
    n = 40
    w = 1e-100
    x = (np.arange(n)[:, None] + [0, 1, 0.5]) * 2 / n - 1
    positions = np.dstack([x * w, [[w, w, -3 * w]] * n, np.full((n, 3), sign), np.full((n, 3), w)])
    with on(isa):
        depth = tl.rasterize(*soup(positions.reshape(-1, 4), (n, 1)).arrays, **{plane: False}).depth
    assert (depth == sign * LARGEST).all()


@ON_EACH_ISA
@pytest.mark.parametrize(("w", "is_seen"), [(2.0**-500, True), (np.nextafter(2.0**-500, 0), False)])
def test_engine_least_w_is_2_to_the_minus_500(w, is_seen, isa):
    scene = soup(np.tile([[-1, -1, 0, 1], [3, -1, 0, 1], [-1, 3, 0, 1]], (20, 1)) * w, (4, 4))
    with on(isa):
        assert_same(tl.coverage(*scene.arrays), np.full((4, 4), is_seen))


@ON_EACH_ISA
@pytest.mark.parametrize(("dtype", "z"), [(np.float32, 2.0**24), (np.float64, 2.0**53)])
def test_engine_transform_adds_from_left_to_right(dtype, z, isa):
    x, y = np.random.default_rng(0).integers(-8, 9, (2, 60)).astype(dtype)
    transform = np.array([[1, 0, 1, -z], [0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 8]])
    objects = soup(np.stack([x, y, np.full(60, z, dtype)], -1), (50, 50))
    clip = soup(np.stack([(x + dtype(z)) - dtype(z), y, 0 * x, 0 * x + 8], -1), (50, 50))
    assert (clip.vertices[:, 0] != x).any()
    with on(isa):
        assert_same(tl.overdraw(*objects.arrays, transform=transform), tl.overdraw(*clip.arrays))


# ---- either turn, either side ---------------------------------------------------------------------------------------


def both_turns(cull):
    """Each triangle in both turns, in front of and behind its twin; corners and their depths change places."""
    rng = np.random.default_rng(0)
    scene = mixed(rng, 600, (90, 60), level=False, cull=cull)
    corners = np.concatenate([scene.triangles, scene.triangles[:, [0, 2, 1]], scene.triangles[:, [2, 1, 0]]])
    shift = np.repeat([0, 0, 1e-3, -1e-3], len(scene.vertices))[:, None] * [0, 0, 1]
    vertices = np.tile(scene.vertices, (4, 1)) + shift
    corners = np.concatenate([corners + k * len(scene.vertices) for k in range(4)])
    yield Scene(vertices, rng.permutation(corners), scene.size, scene.view), DEPTH_TESTS


@ON_EACH_ISA
@pytest.mark.parametrize("cull", ["none", "back", "front"])
def test_engine_both_turns_equal_exact_picture(cull, isa):
    check_all(isa, cases(both_turns, cull))


# ---- windows --------------------------------------------------------------------------------------------------------


def windows():
    rng = np.random.default_rng(4)
    for scale in (1, 10, 1000, 100_000):
        for _ in range(12):
            origin, size = rng.integers(-80 * scale, 80 * scale, 2), tuple(rng.integers(1, 90, 2).tolist())
            yield mixed(rng, 150, size, level=False, origin=tuple(origin.tolist())), DEPTH_TESTS


@ON_EACH_ISA
def test_engine_windows_anywhere_equal_exact_picture(isa):
    check_all(isa, cases(windows), (1, 2))
