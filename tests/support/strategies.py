"""Scenes for the tests: hypothesis strategies, and seeded generators of the shapes that rasterizers get wrong."""

from dataclasses import dataclass, field
from math import gcd
from typing import Any

import numpy as np
from hypothesis import strategies as st


@dataclass(frozen=True)
class Scene:
    """The arguments of a call."""

    vertices: np.ndarray
    triangles: np.ndarray
    size: tuple[int, int]
    view: dict[str, Any] = field(default_factory=dict)

    @property
    def arrays(self):
        return self.vertices, self.triangles, self.size


def soup(vertices, size, **view):
    """A scene of separate triangles: three rows of `vertices` each."""
    vertices = np.asarray(vertices)
    return Scene(vertices, np.arange(len(vertices)).reshape(-1, 3), size, view)


def with_depth(scene, rng, *, flat=False):
    """The scene with depths: random ones per vertex, or one of eight a triangle, as separate triangles."""
    if not flat:
        z = rng.uniform(-2, 2, (len(scene.vertices), 1)) * 10.0 ** rng.integers(-3, 3)
        return Scene(np.hstack([scene.vertices, z]), scene.triangles, scene.size, scene.view)
    corners = np.asarray(scene.vertices, np.float64)[scene.triangles]
    z = np.repeat(rng.integers(0, 8, (len(corners), 1, 1)) / 8, 3, axis=1)
    return soup(np.concatenate([corners, z], -1).reshape(-1, 3), scene.size, **scene.view)


def turned(triangles, rng):
    """The triangles with corners rotated and reversed at random."""
    triangles = np.asarray(triangles).copy()
    for row in triangles:
        row[:] = np.roll(row, rng.integers(3))[:: rng.choice([1, -1])]
    return triangles


# ---- pixel space: seeded --------------------------------------------------------------------------------------------


def fan(rng, n=300, side=24):
    """A closed fan of hundreds of triangles; its hub is a pixel centre, next to one, or anywhere."""
    hub = (
        rng.integers(side // 3, 2 * side // 3, 2) + 0.5 + rng.choice([0, 1 / 256, rng.uniform()]) * rng.choice([-1, 1])
    )
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    radius = rng.uniform(0.3, 1.2, n) * side
    ring = hub + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    i = np.arange(n)
    triangles = turned(np.stack([np.full(n, n), i, (i + 1) % n], -1), rng)
    return Scene(np.vstack([ring, hub]), triangles, (side, side))


def jittered_grid(rng, n=7, side=28):
    """A grid of quads, corners pushed about, that covers the frame with each sample in one triangle."""
    line = np.linspace(-2, side + 2, n)
    xy = np.stack(np.meshgrid(line, line), -1)
    xy[1:-1, 1:-1] += rng.uniform(-0.15, 0.15, (n - 2, n - 2, 2)) * (line[1] - line[0])
    step = rng.choice([1, 0.5, 1 / 256])  # also onto pixel corners and centres; the quads stay convex
    xy = np.round(xy / step) * step
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1], i[:-1, 1:], i[1:, :-1], i[1:, 1:]
    diagonal = rng.integers(0, 2, a.shape)[..., None]
    first = np.where(diagonal, np.stack([a, b, d], -1), np.stack([a, b, c], -1))
    second = np.where(diagonal, np.stack([a, d, c], -1), np.stack([b, d, c], -1))
    return Scene(xy.reshape(-1, 2), turned(np.concatenate([first, second]).reshape(-1, 3), rng), (side, side))


def primitive_vector(rng, longest):
    """Two coprime integers."""
    while True:
        a, b = (int(v) for v in rng.integers(-longest, longest + 1, 2))
        if gcd(a, b) == 1:
            return a, b


def partner(a, b):
    """(c, d) with a*d - b*c = 1 for coprime a, b."""
    old_r, r, old_s, s, old_t, t = a, b, 1, 0, 0, 1
    while r:
        q = old_r // r
        old_r, r, old_s, s, old_t, t = r, old_r - q * r, s, old_s - q * s, t, old_t - q * t
    return -old_t * old_r, old_s * old_r


def slivers(rng, n=40, side=20):
    """Triangles of half a square sub-pixel, the least area there is, from a few to thousands of pixels long."""
    corners = []
    for _ in range(n):
        a, b = primitive_vector(rng, int(rng.choice([300, 5_000, 1_000_000])))
        c, d = partner(a, b)
        k = int(rng.integers(-1, 2))
        p = rng.integers(0, side * 256, 2) if rng.integers(2) else rng.integers(0, side, 2) * 256 + 128
        corners += [p, p + [a, b], p + [c + k * a, d + k * b]]
    return soup(np.array(corners) / 256, (side, side))


def needles(rng, n=40, side=24):
    """Triangles thousands of pixels long and about a sub-pixel to a pixel wide that cross the frame."""
    through = rng.uniform(0, side, (n, 2))
    angle = rng.uniform(0, 2 * np.pi, n)
    along = np.stack([np.cos(angle), np.sin(angle)], -1) * rng.uniform(1_000, 8_000, (n, 1))
    across = np.stack([-np.sin(angle), np.cos(angle)], -1) * rng.choice([1 / 256, 1 / 64, 1.0], (n, 1))
    return soup(
        np.stack([through - along, through + along * 1.5, through + along + across], 1).reshape(-1, 2), (side, side)
    )


def near_misses(rng, n=30, side=16):
    """Edges that pass a centre exactly, or miss it by one or two square sub-pixels."""
    corners = []
    for _ in range(n):
        centre = rng.integers(0, side, 2) * 256 + 128
        a, b = primitive_vector(rng, int(rng.choice([7, 500, 50_000])))
        c, d = partner(a, b)
        miss = int(rng.integers(-2, 3))
        start = centre + miss * np.array([c, d]) - int(rng.integers(0, 20)) * np.array([a, b])
        end = start + 40 * np.array([a, b])
        corners += [start, end, rng.integers(-side * 256, 2 * side * 256, 2)]
    return soup(np.array(corners) / 256, (side, side))


def on_centres(rng, n=30, side=12):
    """Vertices on pixel centres, corners and edges' middles: every edge passes samples."""
    step = rng.choice([1.0, 2.0])
    xy = rng.integers(-4, side + 4, (3 * n, 2)) + rng.choice([0.5, 0.5, 0.0], (3 * n, 2)) * step
    return soup(xy, (side, side), subpixel_bits=int(rng.choice([1, 4, 8, 16])))


def few_bits(rng, n=24, side=14):
    """0 to 16 sub-pixel bits; half of the coordinates are ties of the snap."""
    bits = int(rng.choice([0, 0, 1, 2, 7, 15, 16]))
    xy = rng.uniform(-side, 2 * side, (3 * n, 2))
    ties = (np.floor(xy * 2.0**bits) + 0.5) / 2.0**bits
    return soup(np.where(rng.integers(0, 2, xy.shape), xy, ties), (side, side), subpixel_bits=bits)


def far_away(rng, n=16, side=12):
    """Coordinates of 1e4 to 1e16 pixels, up to the edge of the range at 8 bits, with edges through the frame."""
    limit = 2.0**54 - 2
    corners = []
    for _ in range(n):
        reach = min(10.0 ** rng.uniform(4, 16.3), limit)
        xy = rng.uniform(-reach, reach, (3, 2))
        if rng.integers(2):  # an edge through the frame, so that rounding would show
            through = rng.uniform(0, side, 2)
            xy[1] = np.clip(2 * through - xy[0], -limit, limit)
        if rng.integers(3) == 0:
            xy[2] = rng.uniform(0, side, 2)
        corners.append(xy)
    return soup(np.concatenate(corners), (side, side))


def far_integers(rng, n=16, side=12):
    """int64 pixels beyond what float64 holds, up to the edge of the range."""
    bits = int(rng.choice([0, 4, 8]))
    limit = 2 ** (62 - bits) - 1
    xy = rng.integers(-limit, limit + 1, (3 * n, 2))
    xy[rng.integers(0, 3, 3 * n) == 0] >>= int(rng.integers(8, 60))
    xy[1::3] = np.where(rng.integers(0, 2, (n, 1)), side - xy[0::3], xy[1::3])
    return soup(xy, (side, side), subpixel_bits=bits)


def snap_degenerates(rng, n=40, side=10):
    """Triangles that are proper before the snap and lines or points, or turned over, after it."""
    a = rng.uniform(0, side, (n, 2))
    b = np.where(rng.integers(0, 2, (n, 1)), rng.uniform(0, side, (n, 2)), a + rng.uniform(-1, 1, (n, 2)) / 300)
    t = rng.uniform(0, 1, (n, 1))
    c = a + t * (b - a) + rng.uniform(-1, 1, (n, 2)) / 400
    return soup(np.stack([a, b, c], 1).reshape(-1, 2), (side, side), subpixel_bits=int(rng.choice([0, 2, 8])))


def t_junctions(rng, side=20):
    """Two big triangles whose common edge is subdivided on one side, exactly on the grid or beside it."""
    a, b = np.array([-3, rng.integers(0, side)]), np.array([side + 5, rng.integers(0, side)])
    above, below = np.array([side // 2, -30]), np.array([side // 2, side + 30])
    t = np.sort(np.append(rng.integers(1, 64, 5), [0, 64]))
    on_edge = a + (b - a) * t[:, None] / 64  # multiples of 1/64 of a pixel: on the 8-bit grid
    if rng.integers(2):
        on_edge[1:-1] += rng.uniform(-1, 1, (5, 2)) / 128
    vertices = np.vstack([on_edge, above, below])
    n = len(t)
    triangles = [[0, n - 1, n]] + [[i, i + 1, n + 1] for i in range(n - 1)]
    return Scene(vertices, turned(triangles, rng), (side, side))


def window_of_soup(rng, n=12):
    """A soup seen through a window somewhere in the picture, culled or not."""
    size = tuple(int(v) for v in rng.integers(1, 20, 2))
    origin = tuple(int(v) for v in rng.integers(-200, 200, 2))
    xy = rng.uniform(-30, 50, (3 * n, 2)) + origin
    return soup(xy, size, origin=origin, cull=str(rng.choice(["none", "back", "front"])))


PIXEL_SCENES = {
    f.__name__: f
    for f in [
        fan, jittered_grid, slivers, needles, near_misses, on_centres, few_bits, far_away, far_integers,
        snap_degenerates, t_junctions, window_of_soup,
    ]
}  # fmt: skip


# ---- clip space: seeded ---------------------------------------------------------------------------------------------


def perspective(near=0.1, far=100.0, focal=1.0):
    """The OpenGL projection of an eye that looks along -z."""
    a, b = (far + near) / (near - far), 2 * far * near / (near - far)
    return np.array([[focal, 0, 0, 0], [0, focal, 0, 0], [0, 0, a, b], [0, 0, -1, 0]])


def rotation(rng):
    q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


def clip_soup(rng, n=16):
    """Positions round the origin of clip space: most triangles cross some plane."""
    size = tuple(int(v) for v in rng.integers(4, 16, 2))
    view = {
        "clip_depth": str(rng.choice(["minus_one_to_one", "zero_to_one"])),
        "near_clip": bool(rng.integers(4)), "far_clip": bool(rng.integers(4)),
        "cull": str(rng.choice(["none", "none", "back", "front"])),
        "subpixel_bits": int(rng.choice([0, 4, 8, 8, 16])),
    }  # fmt: skip
    if rng.integers(2):
        view |= {"viewport": (20, 17), "origin": tuple(int(v) for v in rng.integers(0, 12, 2))}
    return soup(rng.uniform(-1, 1.5, (3 * n, 4)), size, **view)


def small_w(rng, n=16, side=10):
    """w from 1e-3 down to 1e-300, of either sign, among ordinary ones."""
    positions = rng.uniform(-1, 1, (3 * n, 4))
    tiny = 10.0 ** -rng.choice([3, 6, 12, 30, 100, 150, 151, 300], 3 * n) * rng.choice([1, 1, -1], 3 * n)
    positions[:, 3] = np.where(rng.integers(0, 2, 3 * n), tiny, rng.uniform(0.5, 2, 3 * n))
    positions[rng.integers(0, 3, 3 * n) == 0, :3] *= 1e-3
    return soup(positions, (side, side), near_clip=bool(rng.integers(2)), far_clip=bool(rng.integers(2)))


def scaled_clip(rng, n=10, side=10):
    """The same picture at scales of 1e-100 to 1e100: homogeneous coordinates have no unit."""
    positions = rng.uniform(-1, 1, (3 * n, 4)) + [0, 0, 0, 1]
    return soup(positions * 10.0 ** rng.integers(-100, 100), (side, side))


def guard_band(rng, n=8, side=8):
    """x/w and y/w from 1e12 to 1e200: on both sides of the guard band."""
    positions = rng.uniform(-1, 1, (3 * n, 4)) * [1, 1, 0.5, 1]
    positions[:, 3] = rng.uniform(0.5, 1, 3 * n)
    far = rng.integers(0, 2, (3 * n, 2)) * rng.choice([12, 15, 16, 17, 18, 19, 30, 200], (3 * n, 2))
    positions[:, :2] *= 10.0**far
    return soup(positions, (side, side), subpixel_bits=int(rng.choice([0, 8, 16])))


def floor(rng, n=8, side=20):
    """A floor under the eye that runs through the near plane and behind the eye."""
    line = np.linspace(-60, 60, n) + rng.uniform(-1, 1)
    x, z = np.meshgrid(line, line)
    vertices = np.stack([x, np.full_like(x, -rng.uniform(0.5, 2)), z], -1).reshape(-1, 3)
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = (v.ravel() for v in (i[:-1, :-1], i[:-1, 1:], i[1:, :-1], i[1:, 1:]))
    triangles = turned(np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)]), rng)
    positions = np.hstack([vertices, np.ones((len(vertices), 1))]) @ perspective(0.1, 1000).T
    return Scene(positions, triangles, (side, side))


def sphere_round_the_eye(rng, n=8, side=20):
    """A closed surface with the eye inside: every sample is covered exactly once."""
    theta, phi = np.linspace(0, np.pi, n + 1)[:, None], np.linspace(0, 2 * np.pi, 2 * n, endpoint=False)[None]
    sphere = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta) + 0 * phi, np.sin(theta) * np.sin(phi)], -1)
    sphere[0], sphere[-1] = [0, 1, 0], [0, -1, 0]
    vertices = sphere.reshape(-1, 3) @ rotation(rng).T * 10 + rng.uniform(-3, 3, 3)
    i, j = (v.ravel() for v in np.meshgrid(np.arange(n), np.arange(2 * n), indexing="ij"))
    index = lambda row, column: np.where(row == 0, 0, np.where(row == n, n * 2 * n, row * 2 * n + column % (2 * n)))  # noqa: E731
    a, b, c, d = index(i, j), index(i, j + 1), index(i + 1, j), index(i + 1, j + 1)
    triangles = np.concatenate([np.stack([a, b, c], -1)[i > 0], np.stack([b, d, c], -1)[i < n - 1]])
    return Scene(vertices, turned(triangles, rng), (side, side), {"transform": perspective(focal=rng.uniform(0.3, 2))})


def transformed(rng, n=16, side=14):
    """Object space through a transform, in float32 or float64."""
    dtype = rng.choice([np.float32, np.float64])
    vertices = (rng.uniform(-2, 2, (3 * n, 3)) - [0, 0, 2]).astype(dtype)
    matrix = perspective(0.3, 5, rng.uniform(0.5, 2)) @ np.block(
        [[rotation(rng) * 0.2 + np.eye(3), np.zeros((3, 1))], [0, 0, 0, 1]]
    )
    return soup(vertices, (side, side + 3), transform=matrix)


CLIP_SCENES = {
    f.__name__: f for f in [clip_soup, small_w, scaled_clip, guard_band, floor, sphere_round_the_eye, transformed]
}


# ---- hypothesis -----------------------------------------------------------------------------------------------------

BITS = st.sampled_from([0, 1, 4, 8, 8, 8, 16])
SIZES = st.tuples(st.integers(1, 14), st.integers(1, 14))


def coordinates(bits):
    """Pixel coordinates: on the fixed-point grid round the frame, at and next to centres, anywhere, far away."""
    unit = 2.0**-bits
    near = st.integers(-4 * 2**bits, 18 * 2**bits).map(lambda i: i * unit)
    centre = st.tuples(st.integers(-1, 15), st.sampled_from([-1, 0, 0, 0, 1])).map(lambda t: t[0] + 0.5 + t[1] * unit)
    whole = st.integers(-2, 16).map(float)
    anywhere = st.floats(-40, 60, allow_subnormal=False)
    far = st.floats(-1e6, 1e6) | st.floats(-(2.0 ** (61.9 - bits)), 2.0 ** (61.9 - bits))
    return near | centre | whole | anywhere | far


@st.composite
def pixel_scenes(draw, n_components=2):
    bits, size = draw(BITS), draw(SIZES)
    xy = coordinates(bits)
    components = [xy, xy] + [st.floats(-1e3, 1e3, width=32) | st.sampled_from([0.0, 0.25, 0.5, 1.0])] * (
        n_components - 2
    )
    vertices = draw(st.lists(st.tuples(*components), min_size=3, max_size=9))
    index = st.integers(0, len(vertices) - 1)
    triangles = draw(st.lists(st.tuples(index, index, index), min_size=1, max_size=8))
    view = {"subpixel_bits": bits, "cull": draw(st.sampled_from(["none", "none", "back", "front"]))}
    if draw(st.booleans()):
        view["origin"] = draw(st.tuples(st.integers(-8, 8), st.integers(-8, 8)))
    return Scene(np.array(vertices, np.float64), np.array(triangles, np.int32), size, view)


@st.composite
def clip_scenes(draw):
    part = st.floats(-2, 2, width=32) | st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0]) | st.floats(-1e30, 1e30)
    w = (
        st.floats(0.125, 4, width=32)
        | st.sampled_from([0.0, 1.0, 1.0, 1e-3, 1e-30, 1e-300, -1e-3, -1.0, 1e30])
        | st.floats(-2, 2)
    )
    vertices = draw(st.lists(st.tuples(part, part, part, w), min_size=3, max_size=8))
    index = st.integers(0, len(vertices) - 1)
    triangles = draw(st.lists(st.tuples(index, index, index), min_size=1, max_size=6))
    view = {
        "subpixel_bits": draw(BITS),
        "clip_depth": draw(st.sampled_from(["minus_one_to_one", "zero_to_one"])),
        "near_clip": draw(st.booleans()), "far_clip": draw(st.booleans()),
        "cull": draw(st.sampled_from(["none", "none", "back", "front"])),
    }  # fmt: skip
    return Scene(np.array(vertices, np.float64), np.array(triangles, np.int32), draw(SIZES), view)
