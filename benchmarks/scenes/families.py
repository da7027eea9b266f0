"""Families of triangles that methods are compared on, and the entries: each method at each precision that it has."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Triangles = tuple[NDArray[np.float64], NDArray[np.int32]]

BITS = (0, 4, 8, 12, 16)
NO_SNAP = "exact"
FRAME_PX = 2048
CELL_MARGIN_PX = 6
"""Between triangles in cells: pixels that any method draws beyond an edge stay clear of the neighbours."""


@dataclass(frozen=True)
class Family:
    """Separate triangles of one kind; `make` puts n of them round the origin."""

    name: str
    what: str
    size_px: int
    n_timed: int
    make: Callable[[int, float, int], Triangles]


def round_triangles(n: int, size_px: float, seed: int) -> Triangles:
    """Triangles in a circle of that diameter, corners in all directions."""
    from topleft import scenes

    vertices, triangles, _ = scenes.random_triangles(n, size_px, 0, 0, seed)
    return np.ascontiguousarray(vertices[:, :2]), triangles


def slivers(n: int, size_px: float, seed: int) -> Triangles:
    """Triangles of that length, any direction, from 2 px to 1/64 px thick."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, n)
    along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    third = along * rng.uniform(-0.5, 0.5, (n, 1)) * size_px + across * 2 ** rng.uniform(-6, 1, (n, 1))
    vertices = np.stack([-along * size_px / 2, along * size_px / 2, third], axis=1).reshape(-1, 2)
    return vertices, np.arange(3 * n, dtype=np.int32).reshape(n, 3)


FAMILIES = {
    family.name: family
    for family in (
        Family("small", "triangles of 4 px", 4, 100_000, round_triangles),
        Family("medium", "triangles of 40 px", 40, 10_000, round_triangles),
        Family("large", "triangles of 300 px", 300, 500, round_triangles),
        Family("slivers", "100 px long, 2 to 1/64 px thick", 100, 10_000, slivers),
    )
}


@dataclass(frozen=True)
class Entry:
    """A method of the registry at one precision."""

    method: str
    bits: int | str | None = None
    """Sub-pixel bits, NO_SNAP, None where the method has a precision of its own."""

    @property
    def precision(self) -> str:
        """What its vertices are when it draws: sub-pixel bits, "exact" where they stay, whole pixels, or floats."""
        from topleft.methods import find_method

        if self.bits is not None:
            return str(self.bits)
        if find_method(self.method).claims.integer_vertices:
            return "whole px"
        return "float64" if self.method.endswith("float64") else "float32"

    def options(self) -> dict[str, Any]:
        """Arguments of the verbs."""
        return {"method": self.method} | ({} if self.bits is None else {"subpixel_bits": self.bits})

    def orient(self, scene: Triangles) -> Triangles:
        """Return the scene with the winding that the method draws, counter-clockwise as seen if it draws either."""
        from topleft.methods import find_method

        vertices, triangles = scene
        a, b, c = vertices[triangles].swapaxes(0, 1)
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        is_wrong = area < 0 if find_method(self.method).claims.winding == "clockwise" else area > 0
        return vertices, np.where(is_wrong[:, None], triangles[:, [0, 2, 1]], triangles).astype(np.int32)


def entries(methods: Sequence[str] = ()) -> list[Entry]:
    """Every method that fills, or the named ones, at every precision."""
    from topleft.methods import CLASSICS, METHODS, find_method

    chosen = methods or [name for name in (METHODS | CLASSICS) if not name.endswith("/wireframe")]
    found = []
    for name in chosen:
        method = find_method(name)
        has_bits = method.code is not None or method.has_subpixel_bits
        found += [Entry(name, bits) for bits in BITS] if has_bits else [Entry(name)]
    return found


def in_cells(family: Family, seed: int, frame_px: int = FRAME_PX) -> Triangles:
    """Return triangles in the cells of a grid over the frame, anywhere within a pixel, so that none meets another."""
    cell_px = family.size_px + CELL_MARGIN_PX
    n_across = frame_px // cell_px
    n = n_across**2
    vertices, triangles = family.make(n, family.size_px, seed)
    cell = np.stack([np.arange(n) % n_across, np.arange(n) // n_across], axis=-1)
    center_px = (cell + 0.5) * cell_px + np.random.default_rng(seed).uniform(-0.5, 0.5, (n, 2))
    return vertices + np.repeat(center_px, 3, axis=0), triangles


def strewn(family: Family, n: int, frame_px: int = FRAME_PX, seed: int = 1) -> Triangles:
    """Return n triangles anywhere in the frame, whole."""
    vertices, triangles = family.make(n, family.size_px, seed)
    edge_px = family.size_px / 2 + 1
    center_px = np.random.default_rng(seed).uniform(edge_px, frame_px - edge_px, (n, 2))
    return vertices + np.repeat(center_px, 3, axis=0), triangles
