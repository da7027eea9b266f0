"""Polygons to draw: points on the grid of 1/256 pixels, so that every program gets the same shape."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
TASKS = ("mask", "labels", "area", "table")


@dataclass(frozen=True)
class PolygonCase:
    """Polygons, each of a list of rings, and the output to make."""

    name: str
    task: str
    title: str
    size: tuple[int, int]
    make: Callable[[tuple[int, int]], list[list[F64]]]


def on_grid(points: F64) -> F64:
    """Return points on the grid."""
    return np.round(points * 256) / 256


def gon(size: tuple[int, int], n: int, *, with_hole: bool = False) -> list[list[F64]]:
    """A polygon of n corners that fills the frame, and a hole in it."""
    rng = np.random.default_rng(0)
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles)], 1)
    rough = 1 + (0.05 * rng.uniform(-1, 1, (n, 1)) if with_hole else 0)
    middle, half = np.array(size) / 2, np.array(size) / 2
    rings = [on_grid(middle + 0.9 * half * rough * directions)]
    if with_hole:
        rings.append(on_grid(middle + 0.4 * half * directions[::-1]))
    return [rings]


def star(size: tuple[int, int], n: int) -> list[list[F64]]:
    """One ring of n corners with noise of 3 px."""
    rng = np.random.default_rng(0)
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    radius = size[0] * (0.366 + 0.085 * np.sin(9 * angles)) + rng.normal(0, 3, n)
    return [[on_grid(size[0] / 2 + radius[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1))]]


def cells(size: tuple[int, int], n: int) -> list[list[F64]]:
    """Voronoi cells that tile the frame, in random order."""
    from scipy.spatial import Voronoi

    rng = np.random.default_rng(0)
    seeds = rng.uniform(0, 1, (n, 2)) * size
    over = [2 * size[0], 0] + seeds * [-1, 1], [0, 2 * size[1]] + seeds * [1, -1]
    diagram = Voronoi(np.concatenate([seeds, seeds * [-1, 1], seeds * [1, -1], *over]))
    return [[on_grid(diagram.vertices[diagram.regions[diagram.point_region[i]]])] for i in range(n)]


def strewn(size: tuple[int, int], n: int) -> list[list[F64]]:
    """Polygons of 5 to 40 corners that lie over each other."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(n):
        k, middle, reach = rng.integers(5, 41), rng.uniform(0, 1, 2) * size, rng.uniform(5, 60)
        angles = np.sort(rng.uniform(0, 2 * np.pi, k))
        radius = reach * rng.uniform(0.4, 1, (k, 1))
        found.append([on_grid(middle + radius * np.stack([np.cos(angles), np.sin(angles)], 1))])
    return found


def _case(name: str, task: str, size: tuple[int, int], title: str, make: Callable[..., list[list[F64]]]) -> PolygonCase:
    return PolygonCase(name, task, f"{title}, {size[0]}x{size[1]}", size, make)


CASES = {
    case.name: case
    for case in (
        _case("gon", "mask", (3840, 2160), "mask of a 100-gon", lambda s: gon(s, 100)),
        _case("hole", "mask", (512, 512), "mask of a 400-gon with a hole", lambda s: gon(s, 400, with_hole=True)),
        _case("star", "mask", (4096, 4096), "mask of a ring of 1,000,000 corners", lambda s: star(s, 1_000_000)),
        _case("cells", "labels", (4000, 4000), "labels of 20,000 cells that tile", lambda s: cells(s, 20_000)),
        _case("strewn", "labels", (2000, 2000), "labels of 3,000 polygons", lambda s: strewn(s, 3000)),
        _case("parcels", "labels", (4096, 4096), "labels of 200,000 cells, random order", lambda s: cells(s, 200_000)),
        _case("star-area", "area", (4096, 4096), "areas of a ring of 1,000,000 corners", lambda s: star(s, 1_000_000)),
        _case("hole-area", "area", (512, 512), "areas of a 400-gon with a hole", lambda s: gon(s, 400, with_hole=True)),
        _case("table", "table", (4000, 4000), "shares of 2,000 of 20,000 cells", lambda s: cells(s, 20_000)[:2000]),
        _case("full-table", "table", (4000, 4000), "shares of 2,000 cells that tile", lambda s: cells(s, 2000)),
    )
}
