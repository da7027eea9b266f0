"""Families of scenes with clip space or depth, which only the production methods take, and their errors on them.

In: vertices in clip space, or pixels with depth. Out: as `measure.py`, and how far depths are from those of the planes
through the snapped vertices, in units in the last place of float32. Scenes are the same bits on every machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.atlas.maps import tabulate
from benchmarks.scenes.families import NO_SNAP
from topleft._apps.explore.race import PRODUCTION
from topleft.methods import reference
from topleft.methods.reference.integers import ExactPicture
from topleft.scene_families import (
    MIDDLE_PX,
    Axis,
    Family,
    direction,
    power_of_ten,
    power_of_two,
    square_rim,
    walk,
)  # fmt: skip

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

SIZE = (32, 32)
PLANE_ERROR = Fraction(1, 2**35)
"""The error of a depth before it is rounded, by the largest |z| of a triangle (docs/design/rules.md, rule 8)."""


class DepthScene(NamedTuple):
    """Vertices in clip space (V, 4), or pixels with depth (V, 3)."""

    vertices: F64
    triangles: I32
    size: tuple[int, int] = SIZE
    origin: tuple[int, int] = (0, 0)


class DepthFaults(NamedTuple):
    """Pixels, and the largest error of a depth; None where depth is not looked at."""

    wrong: int
    gaps: int
    overdrawn: int
    inexact: int
    ulp: float | None = None


class Picture(NamedTuple):
    """The result of a method: ids, depths, how many triangles cover each centre."""

    ids: I32
    depth: NDArray[np.float32]
    counts: I32

    @property
    def key(self) -> bytes:
        """The same for equal pictures."""
        return b"".join(plane.tobytes() for plane in self)


@dataclass(frozen=True)
class DepthFamily(Family):
    """A family with depth: its judge of a picture that was drawn with so many bits."""

    judge: Callable[[DepthScene, Picture, int | str], DepthFaults] = field(kw_only=True)


def draw(scene: DepthScene, method: str, bits: int | str) -> Picture:
    """Draw with a depth test."""
    import topleft as tl

    options: dict[str, Any] = {"method": method, "subpixel_bits": bits, "threads": 1, "origin": scene.origin}
    frags = tl.rasterize(scene.vertices, scene.triangles, scene.size, **options)
    return Picture(frags.triangle, frags.depth, tl.overdraw(scene.vertices, scene.triangles, scene.size, **options))


# Clip space


def tube(near: float, seed: int) -> DepthScene:
    """Return a closed square tube round the eye, from behind it to w = 6, cut by a near plane at w = `near`."""
    rng = np.random.default_rng(seed)
    rim = square_rim(8, 1.0, 0.0)
    rings = np.array([-5.0, -1.5, 1.5, 4, 6])
    xy = np.repeat(rim[None], len(rings), axis=0)
    w = np.repeat(rings[:, None], 8, axis=1)
    w[1:-1] += rng.uniform(-0.8, 0.8, (len(rings) - 2, 8))
    u = direction(rng)
    turned = xy @ np.array([u, [-u[1], u[0]]])
    points = np.concatenate([turned * 1.5, w[..., None]], axis=-1).reshape(-1, 3)
    points = np.concatenate([points, [[0.0, 0, 6]]])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(len(rings) - 1), np.arange(8), indexing="ij"))
    a, b = i * 8 + j, i * 8 + (j + 1) % 8
    last = 8 * (len(rings) - 1)
    cap = np.stack([last + np.arange(8), last + (np.arange(8) + 1) % 8, np.full(8, len(points) - 1)], -1)
    triangles = np.concatenate([np.stack([a, b, a + 8], -1), np.stack([b, b + 8, a + 8], -1), cap])
    return in_clip(points, near, triangles)


def fan_at_the_eye(w: float, seed: int) -> DepthScene:
    """Return a fan round a point of the picture, every other corner of its rim at that w, before the near plane."""
    rng = np.random.default_rng(seed)
    rim = square_rim(8, 4.0, rng.uniform())
    points = np.concatenate([rim, np.where(np.arange(8) % 2, 1.0, w)[:, None]], axis=-1)
    hub = np.append(rng.uniform(-0.5, 0.5, 2), 1.0)
    i = np.arange(8)
    return in_clip(np.concatenate([[hub], points]), w / 2, np.stack([0 * i, 1 + i, 1 + (i + 1) % 8], -1))


def in_clip(points: F64, near: float, triangles: NDArray[Any]) -> DepthScene:
    """Return x, y, w in clip space: the near plane at w = `near`, none far."""
    x, y, w = points.T
    return DepthScene(np.stack([x, y, w - 2 * near, w], -1), triangles.astype(np.int32))


def judge_clip(scene: DepthScene, picture: Picture, bits: int | str) -> DepthFaults:
    """Compare the triangles that show, and how many cover each pixel, with the exact picture of the clip space."""
    counts = picture.counts
    true_ids, true_count = draw_clip(scene.vertices, scene.triangles, scene.size)
    own_count = draw_pieces(scene.vertices, scene.triangles, scene.size, bits)[1]
    return DepthFaults(
        int((picture.ids != true_ids).sum()), int((counts < true_count).sum()), int((counts > true_count).sum()),
        int((counts != own_count).sum()),
    )  # fmt: skip


def draw_clip(vertices: F64, triangles: I32, size: tuple[int, int]) -> tuple[I32, I32]:
    """Return the last triangle at each pixel centre (-1: none) and the count, both (H, W), for -w <= z <= w, w > 0.

    No divide, no cut, nothing snapped, nothing rounded. A pixel is a ray; its weights in a triangle are 3x3
    determinants of x, y and w, and what lies before the near or beyond the far plane is told at the point that the ray
    meets: M. Olano, T. Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997.
    """
    width, height = size
    ratios = [[x.as_integer_ratio() for x in row] for row in vertices.tolist()]
    unit = max(d for row in ratios for _, d in row)
    points = [[n * (unit // d) for n, d in row] for row in ratios]
    # A centre times (width * height): NDC with y up, and 1.
    columns = np.array([(2 * j + 1 - width) * height for j in range(width)], object)
    rows = np.array([(height - 2 * i - 1) * width for i in range(height)], object)
    ids, count = np.full((height, width), -1, np.int32), np.zeros((height, width), np.int32)
    for index, triangle in enumerate(triangles.tolist()):
        a, b, c = ([points[k][0], points[k][1], points[k][3]] for k in triangle)
        normals = [cross(b, c), cross(c, a), cross(a, b)]
        turn = sum(x * n for x, n in zip(a, normals[0], strict=True))
        if turn == 0:
            continue
        sign = 1 if turn > 0 else -1
        is_inside = np.ones((height, width), bool)
        weights = []
        for normal in normals:
            nx, ny, nw = (sign * x for x in normal)
            value = np.add.outer(ny * rows + nw * width * height, nx * columns)
            is_owner = nx > 0 or (nx == 0 and ny < 0)  # left; top, since y points up here
            is_inside &= (value >= 0 if is_owner else value > 0).astype(bool)
            weights.append(value)
        zs, ws = ([points[k][n] for k in triangle] for n in (2, 3))
        for distances in ([z + w for z, w in zip(zs, ws, strict=True)], [w - z for z, w in zip(zs, ws, strict=True)]):
            depth: Any = sum(value * d for value, d in zip(weights, distances, strict=True))
            is_inside &= (depth >= 0).astype(bool)
        ids[is_inside] = index
        count += is_inside
    return ids, count


def cross(p: list[int], q: list[int]) -> tuple[int, int, int]:
    """Return the cross product."""
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def draw_pieces(vertices: F64, triangles: I32, size: tuple[int, int], bits: int | str) -> tuple[I32, I32]:
    """Return the same of what the projection and the clip in float64 leave, after a snap to so many bits."""
    pieces = reference.pieces(vertices, triangles, size, subpixel_bits=bits)
    unit = 1 if bits == NO_SNAP else 2 ** int(bits)
    xy = np.array([[float(x / unit) for x in v.xy_fx] for piece in pieces for v in piece.vertices]).reshape(-1, 2)
    picture = ExactPicture(xy, np.arange(len(xy)), size)
    names = np.array([piece.triangle for piece in pieces] + [-1], np.int32)
    return names[picture.triangle], picture.count


# Pixels with depth


def sheet(rng: np.random.Generator, middle: F64, z: Callable[[F64], F64]) -> tuple[F64, I32]:
    """Return a square of two triangles that covers the frame, its depth a function of the place from the middle."""
    local = np.array([[-96.0, -96], [96, -96], [-96, 96], [96, 96]]) + rng.uniform(-16, 16, (4, 2))
    return np.concatenate([middle + local, z(local)[:, None]], axis=-1), np.array([[0, 1, 2], [1, 3, 2]], np.int32)


def two_sheets(first: tuple[F64, I32], second: tuple[F64, I32], middle: float) -> DepthScene:
    """Return both in one scene."""
    vertices = np.concatenate([first[0], second[0]])
    triangles = np.concatenate([first[1], second[1] + np.int32(4)])
    origin = int(middle) - SIZE[0] // 2
    return DepthScene(vertices, triangles, SIZE, (origin, origin))


def slope(per_px: float, seed: int, offset_px: float = 0) -> DepthScene:
    """Return two sheets that cut each other, as steep as that, one the mirror of the other."""
    rng = np.random.default_rng(seed)
    middle = MIDDLE_PX + offset_px
    along, shift = per_px * direction(rng), rng.uniform(-8, 8)
    sheets = [
        sheet(rng, np.array([middle, middle]), lambda local, sign=sign: sign * (local @ along + shift * per_px))
        for sign in (1, -1)
    ]
    return two_sheets(*sheets, middle)


def sheets(distance: float, seed: int) -> DepthScene:
    """Return two sheets one behind the other, that far apart, at depths from 0.5 to 1; the nearer one comes last."""
    rng = np.random.default_rng(seed)
    middle = np.array([MIDDLE_PX, MIDDLE_PX])
    along = direction(rng) / 1024
    far_sheet = sheet(rng, middle, lambda local: 0.75 + local @ along)
    near_sheet = far_sheet[0] - [0, 0, distance]
    return two_sheets(far_sheet, (near_sheet, far_sheet[1]), MIDDLE_PX)


def deep_layers(n: int, seed: int) -> DepthScene:
    """Return n squares in any order, at depths 1/n to 1."""
    rng = np.random.default_rng(seed)
    square = np.array([[4.0, 4], [28, 4], [4, 28], [28, 28]])
    z = (rng.permutation(n) + 1) / n
    vertices = np.concatenate([np.tile(square, (n, 1)), np.repeat(z, 4)[:, None]], axis=-1)
    triangles = (4 * np.arange(n)[:, None, None] + np.array([[0, 1, 2], [1, 3, 2]])).reshape(-1, 3)
    return DepthScene(vertices, triangles.astype(np.int32), (6, 6), (13, 13))


def judge_layers(scene: DepthScene, picture: Picture, _: int | str) -> DepthFaults:
    """Compare with the nearest layer, which is known, and its depth, which is that of its corners."""
    nearest = int(np.argmin(scene.vertices[::4, 2]))
    n = len(scene.triangles) // 2
    is_wrong = picture.ids // 2 != nearest
    is_inexact = (picture.counts != n) | (picture.depth != np.float32(scene.vertices[4 * nearest, 2]))
    n_gaps, n_overdrawn = int((picture.counts < n).sum()), int((picture.counts > n).sum())
    return DepthFaults(int(is_wrong.sum()), n_gaps, n_overdrawn, int(is_inexact.sum()))


def planes_at(scene: DepthScene, bits: int | str) -> NDArray[Any]:
    """Return the exact depths of the triangles that cover each pixel after a snap: dicts, (H, W)."""
    found = np.array([{} for _ in range(scene.size[0] * scene.size[1])], object).reshape(scene.size[::-1])
    view = {"origin": scene.origin, "subpixel_bits": bits}
    for fragment in reference.fragments(scene.vertices, scene.triangles, scene.size, **view):
        found[fragment.row, fragment.column][fragment.piece.triangle] = fragment.depth()
    return found


def judge_depth(scene: DepthScene, picture: Picture, bits: int | str) -> DepthFaults:
    """Compare ids with the exact picture of the planes as they are, depths with the planes after the snap.

    A depth beyond its bound is inexact, and so is a triangle that lies behind another by more than both may err.
    """
    ids, counts = picture.ids, picture.counts
    true = planes_at(scene, NO_SNAP)
    own = true if bits == NO_SNAP else planes_at(scene, bits)
    count, true_count = (np.vectorize(len, otypes=[int])(planes) for planes in (own, true))
    nearest = np.vectorize(lambda here: min(here, key=lambda k: (here[k], k), default=-1), otypes=[int])(true)
    is_inexact = counts != count
    largest_z = [max(abs(Fraction(z)) for z in scene.vertices[t, 2].tolist()) for t in scene.triangles]
    slack = PLANE_ERROR * max(largest_z)
    largest_ulp = 0.0
    for at in zip(*np.nonzero(ids >= 0), strict=True):
        here = own[at]
        exact = here.get(int(ids[at]))
        if exact is None:
            is_inexact[at] = True
            continue
        ulp = Fraction(float(np.spacing(np.abs(np.float32(exact)))))
        error = abs(Fraction(float(picture.depth[at])) - exact)
        largest_ulp = max(largest_ulp, float(error / ulp))
        is_off = error > ulp / 2 + PLANE_ERROR * largest_z[ids[at]]
        is_inexact[at] |= is_off or exact - min(here.values()) > ulp + 2 * slack
    return DepthFaults(
        int((ids != nearest).sum()), int((counts < true_count).sum()), int((counts > true_count).sum()),
        int(is_inexact.sum()), float(f"{largest_ulp:.3g}"),
    )  # fmt: skip


W_VALUES = power_of_ten(0, -1, -2, -3, -4, -6, -8, -10, -12)
SLOPES = power_of_ten(-6, -4, -2, -1, 0, 1, 2, 4, 6)

DEPTH_FAMILIES = {
    family.name: family
    for family in (
        DepthFamily("near", "a tube round the eye, cut by a near plane",
                    [Axis("w of the near plane", W_VALUES)], tube, judge=judge_clip),
        DepthFamily("eye", "a fan with corners close to the plane of the eye",
                    [Axis("w of the corners", W_VALUES)], fan_at_the_eye, judge=judge_clip),
        DepthFamily("slope", "two sheets that cut each other",
                    [Axis("depth slope, per px", SLOPES)], slope, judge=judge_depth),
        DepthFamily("sheets", "two parallel sheets at depths from 0.5 to 1",
                    [Axis("distance of the sheets", power_of_two(8, 12, 16, 18, 20, 22, 23, 24, 25, 26, 28, 32))],
                    sheets, judge=judge_depth),
        DepthFamily("depth-layers", "layers in any order, all at depths of their own",
                    [Axis("layers", {str(n): n for n in (1, 255, 256, 65535, 65536)})],
                    deep_layers, judge=judge_layers),
        DepthFamily("slope-far", "two sheets that cut each other, far from the origin",
                    [Axis("distance from the origin, px", {"0": 0.0} | power_of_ten(3, 5, 7, 9, 12)),
                     Axis("depth slope, per px", power_of_ten(-3, 0, 3))],
                    lambda offset, per_px, seed: slope(per_px, seed, offset), 2, judge=judge_depth),
    )
}  # fmt: skip


def measure_depth(family: DepthFamily, names: Sequence[str]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the scenes, and a map for each of the engine's rows, as `measure.map_family`."""
    cells: dict[str, list[list[DepthFaults | str]]] = {name: [] for name in names}
    n_px = []
    for _, values in walk(family):
        scenes = [family.make(*values, seed) for seed in range(family.n_seeds)]
        n_px.append(sum(width * height for width, height in (scene.size for scene in scenes)))
        judged: dict[tuple[int, int | str, bytes], DepthFaults] = {}
        for name in names:
            method, bits = PRODUCTION[name]
            faults: list[DepthFaults | str] = []
            for i, scene in enumerate(scenes):
                picture = draw(scene, method, bits)
                key = i, bits, picture.key
                judged[key] = judged.get(key) or family.judge(scene, picture, bits)
                faults.append(judged[key])
            cells[name].append(faults)
    return tabulate(family, n_px, cells)
