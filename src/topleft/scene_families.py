"""Families of scenes for the atlas, by one or two parameters, from scenes that all methods draw to the hardest.

Every scene of a family is a mesh without gaps that covers its frame, so a method has to draw each pixel once. Corners
come from a seeded generator and only the four operations and roots of IEEE arithmetic: equal bits on every machine.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

FRAME_PX = 64
MIDDLE_PX = 512.0
"""The default middle of the frame: no coordinate is negative, because truncation changes direction at 0."""


class PixelScene(NamedTuple):
    """Triangles in pixels and the window to draw; the triangles are drawn `copies` times, one over the other."""

    vertices: F64
    triangles: I32
    size: tuple[int, int] = (FRAME_PX, FRAME_PX)
    origin: tuple[int, int] = (int(MIDDLE_PX) - FRAME_PX // 2,) * 2
    copies: int = 1

    def drawn(self) -> I32:
        """Return the triangles of all copies."""
        return np.tile(self.triangles, (self.copies, 1))


@dataclass(frozen=True)
class Axis:
    """A parameter: its name, and the values by their texts, from mild to harsh."""

    what: str
    values: dict[str, Any]


@dataclass(frozen=True)
class Family:
    """Scenes by one or two parameters."""

    name: str
    what: str
    axes: Sequence[Axis]
    make: Callable[..., Any]
    n_seeds: int = 3


def walk(family: Family) -> Iterator[tuple[list[str], list[Any]]]:
    """Yield names and values of the parameters, from mild to harsh, the last parameter first."""
    for steps in itertools.product(*(axis.values.items() for axis in family.axes)):
        yield [name for name, _ in steps], [value for _, value in steps]


def power_of_ten(*exponents: int) -> dict[str, float]:
    """Return values by their names."""
    return {f"1e{e}": float(f"1e{e}") for e in exponents}


def power_of_two(*exponents: int) -> dict[str, float]:
    """Return negative powers of two by their names."""
    return {f"2^-{e}" if e else "1": 2.0**-e for e in exponents}


def direction(rng: np.random.Generator) -> F64:
    """Return a random unit vector."""
    t = rng.uniform(-1, 1)
    turned = np.array([(1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)])
    for _ in range(int(rng.integers(4))):
        turned = turned[::-1] * [-1, 1]
    return turned


def far(distance_px: float, seed: int) -> PixelScene:
    """Return a jittered grid around a point that far from the origin, as fine as float64 allows there."""
    rng = np.random.default_rng(seed)
    spacing = float(np.spacing(distance_px))
    middle = distance_px + (33 if spacing <= 1 else 0)
    cell = max(11.0, 8 * spacing)
    n = int(np.ceil(33 / cell))
    line = cell * np.arange(-n, n + 1)
    xy = np.stack(np.meshgrid(line, line), -1)
    jitter = rng.uniform(-0.35, 0.35, xy.shape) * cell
    jitter[[0, -1], :, 1] = jitter[:, [0, -1], 0] = 0  # the border stays a square
    if spacing > 1:
        jitter[n, n] = 0  # a corner in the middle of the frame, where there are so few
    origin = int(middle) - FRAME_PX // 2
    return PixelScene((middle + (xy + jitter)).reshape(-1, 2), grid_triangles(len(line)), origin=(origin, origin))


def dense(cell_px: float, seed: int) -> PixelScene:
    """Return a jittered grid of cells of that size, in a frame of a quarter of the side."""
    rng = np.random.default_rng(seed)
    side_px = FRAME_PX // 4
    line = np.arange(-cell_px, side_px + cell_px + cell_px / 2, cell_px)
    xy = np.stack(np.meshgrid(line, line), -1)
    xy[1:-1, 1:-1] += rng.uniform(-0.45, 0.45, (len(line) - 2, len(line) - 2, 2)) * cell_px
    origin = int(MIDDLE_PX)
    return PixelScene((MIDDLE_PX + xy).reshape(-1, 2), grid_triangles(len(line)), (side_px, side_px), (origin, origin))


def grid_triangles(n: int) -> I32:
    """Return two triangles for each cell of a grid of n by n points."""
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1], i[:-1, 1:], i[1:, :-1], i[1:, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)]).reshape(-1, 3)
    return triangles.astype(np.int32)


def fan_of(hub: F64, rim: F64, *, closed: bool) -> tuple[F64, I32]:
    """Return a fan of triangles from the hub to the rim."""
    n = len(rim)
    i = np.arange(n if closed else n - 1)
    triangles = np.stack([0 * i, 1 + i, 1 + (i + 1) % n], -1)
    return np.concatenate([[hub], rim]), triangles.astype(np.int32)


def square_rim(n: int, half_px: float, phase: float) -> F64:
    """Return n points round a square about the origin."""
    side, along = np.divmod((np.arange(n) + phase) * 4 / n % 4, 1)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    start, end = corners[side.astype(int)], corners[(side.astype(int) + 1) % 4]
    return half_px * (start + along[:, None] * (end - start))


def large(reach_px: float, seed: int) -> PixelScene:
    """Return a fan of nine triangles from within the frame to corners that far away."""
    rng = np.random.default_rng(seed)
    middle = FRAME_PX / 2
    hub = middle + rng.uniform(-8, 8, 2)
    rim = middle + square_rim(9, reach_px, rng.uniform()) * rng.uniform(0.8, 1, (9, 1))
    return PixelScene(*fan_of(hub, rim, closed=True), origin=(0, 0))


def sliver(thickness_px: float, seed: int, offset_px: float = 0) -> PixelScene:
    """Return a band of that thickness across the frame, cut into six slivers, and fans on either side."""
    rng = np.random.default_rng(seed)
    middle = MIDDLE_PX + offset_px
    along = direction(rng)
    across = along[::-1] * [-1, 1]
    at = along * (np.array([-96.0, -32, 32, 96]) + rng.uniform(-8, 8, 4))[:, None] + rng.uniform(-8, 8, 2)
    low, high = at - across * thickness_px / 2, at + across * thickness_px / 2
    vertices = middle + np.concatenate([low, high, [-160 * across, 160 * across]])
    triangles = [
        triangle
        for i in range(3)
        for triangle in ((i, i + 1, 4 + i), (i + 1, 5 + i, 4 + i), (8, i + 1, i), (9, 4 + i, 5 + i))
    ]
    origin = int(middle) - FRAME_PX // 2
    return PixelScene(vertices, np.array(triangles, np.int32), origin=(origin, origin))


HUBS: dict[str, tuple[float, float]] = {
    "centre": (0.5, 0.5), "corner": (0.0, 0.0), "side": (0.5, 0.0), "1/3": (1 / 3, 1 / 3),
    "2^-8 off": (0.5 + 2**-8, 0.5), "2^-9 off": (0.5 + 2**-9, 0.5), "2^-20 off": (0.5 + 2**-20, 0.5),
    "48 px": (-48.0, 0.0), "1e3 px": (-1e3, 0.0), "1e6 px": (-1e6, 0.0),
}  # fmt: skip
"""Places of the hub, from a pixel's corner in the middle of the frame; distances: left of it, outside."""


def fan(n: int, hub: tuple[float, float], seed: int) -> PixelScene:
    """Return a fan of n triangles round its hub, or, from a hub to the left of the frame, side by side."""
    rng = np.random.default_rng(seed)
    start = MIDDLE_PX + 2.0**20 * (hub[0] < -512)  # no coordinate is negative
    origin = (int(start) - FRAME_PX // 2, int(MIDDLE_PX) - FRAME_PX // 2)
    middle = np.array([start, MIDDLE_PX])
    distance = -hub[0]
    if distance < FRAME_PX / 2:
        rim = middle + square_rim(n, 200.0, rng.uniform())
        return PixelScene(*fan_of(middle + np.array(hub), rim, closed=True), origin=origin)
    half_px = 64 * (96 + distance) / (distance - 32)  # at the left side of the frame still 64 px
    rim = np.stack([np.full(n + 1, 96.0), np.linspace(-1, 1, n + 1) * half_px], -1)
    rim[1:-1, 1] += rng.uniform(-0.3, 0.3, n - 1) * (2 * half_px / n)
    vertices, triangles = fan_of(middle + np.array(hub) + [0, rng.uniform(-8, 8)], middle + rim, closed=False)
    vertices[:, 1] += max(0.0, np.ceil(half_px) - MIDDLE_PX)
    return PixelScene(
        vertices, triangles, origin=(origin[0], origin[1] + max(0, int(np.ceil(half_px)) - int(MIDDLE_PX)))
    )


STEPS = [(1, 0), (0, 1), (1, 1), (-1, 1), (3, 1), (2, 5), (-5, 2), (-7, 3), (1, 4)]
"""Directions of edges that pass through pixel centres again and again."""


def edge(distance_px: float, seed: int) -> PixelScene:
    """Return two triangles with a common edge that passes pixel centres at that distance."""
    rng = np.random.default_rng(seed)
    step = np.array(STEPS[seed % len(STEPS)], float)
    norm = np.sqrt((step**2).sum())
    across = step[::-1] * [-1, 1] / norm
    centre = MIDDLE_PX + 0.5 + rng.integers(-4, 5, 2)
    reach = np.ceil(128 / norm)
    ends = centre + across * distance_px + step * reach * np.array([[-1.0], [1.0]])
    sides = MIDDLE_PX + across * np.array([[-160.0], [160.0]])
    triangles = np.array([[0, 1, 2], [1, 0, 3]], np.int32)
    return PixelScene(np.concatenate([ends, sides]), triangles)


def layers(n: int, seed: int) -> PixelScene:
    """Return a square of two triangles, n times."""
    rng = np.random.default_rng(seed)
    vertices = np.array([[4.0, 4], [28, 4], [4, 28], [28, 28]]) + rng.uniform(-2, 2, (4, 2))
    return PixelScene(vertices, np.array([[0, 1, 2], [1, 3, 2]], np.int32), (6, 6), (13, 13), n)


DISTANCES = Axis("distance from the origin, px", power_of_ten(0, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18))
THICKNESSES = Axis("thickness, px", power_of_two(0, 1, 2, 4, 6, 7, 8, 9, 10, 12, 14, 16))

FAMILIES = {
    family.name: family
    for family in (
        Family("far", "a mesh far from the origin", [DISTANCES], far, 12),
        Family("large", "triangles with corners far away", [
            Axis("distance of the corners, px", power_of_ten(2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18))], large, 24),
        Family("sliver", "a band of slivers across the frame", [THICKNESSES], sliver, 24),
        Family("dense", "a mesh of small triangles", [
            Axis("cell of the mesh, px", {"8": 8.0, "4": 4.0, "2": 2.0} | power_of_two(0, 1, 2))], dense, 4),
        Family("fan", "a fan round a point of the frame", [
            Axis("triangles", {str(n): n for n in (3, 4, 8, 16, 32, 64, 128, 256, 512)})],
            lambda n, seed: fan(n, tuple(np.random.default_rng(seed + 9).uniform(-1, 1, 2)), seed), 4),
        Family("hub", "a fan of 32 triangles by where its hub lies", [Axis("hub", HUBS)],
               lambda hub, seed: fan(32, hub, seed), 9),
        Family("edge", "an edge near pixel centres", [
            Axis("distance of the edge from centres, px",
                 power_of_two(1, 2, 4, 6, 8, 9, 10, 12, 16, 20, 24, 32, 40) | {"0": 0.0})], edge, 27),
        Family("layers", "the same square again and again", [
            Axis("layers", {str(n): n for n in (1, 255, 256, 65535, 65536)})], layers, 1),
        Family("far-sliver", "a band of slivers, far from the origin", [
            Axis("distance from the origin, px", {"0": 0.0} | power_of_ten(3, 5, 7, 9, 12, 15)),
            Axis("thickness, px", power_of_two(0, 4, 8, 12, 16))],
            lambda offset, thickness, seed: sliver(thickness, seed, offset), 6),
        Family("fan-hub", "fans by size and hub", [
            Axis("triangles", {str(n): n for n in (4, 16, 64, 256)}),
            Axis("hub", {name: HUBS[name] for name in ("centre", "corner", "1/3", "2^-9 off", "48 px", "1e6 px")})],
            fan, 2),
    )
}  # fmt: skip
