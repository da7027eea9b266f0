"""The exact picture of a small scene, in Python's integers: row ends by floor division, one for each edge and row.

In: vertices as they are, each the fraction that its float64 stands for. Out: who owns each sample, and how many cover
it. The pieces, the edge functions and the fill rule are those of `topleft.methods.reference`, which tests every sample
by itself and takes twenty times as long; `tests/explore/test_exact.py` holds one to the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft.methods import reference
from topleft.methods.reference import Piece, edge_function, is_top_left

SUB = 16
"""Samples lie on sixteenths of a pixel."""


class Run(NamedTuple):
    """Samples of a row that a piece covers: columns of the window from the first to before the end."""

    row: int
    first: int
    end: int
    piece: Piece


def runs(state_pieces: list[Piece], size: tuple[int, int], origin: tuple[int, int], sample: Any) -> Iterator[Run]:
    """Yield the runs of pieces whose vertices are fractions of pixels, in drawing order.

    `sample` lies so many sixteenths of a pixel from the centre.
    """
    for piece in state_pieces:
        unit = max(v.denominator for vertex in piece.vertices for v in vertex.xy_fx)
        a, b, c = ((int(SUB * unit * x), int(SUB * unit * y)) for x, y in (v.xy_fx for v in piece.vertices))
        edges = [(b, c), (c, a), (a, b)] if edge_function(a, b, c) > 0 else [(c, b), (a, c), (b, a)]
        least = [0 if is_top_left(*edge) else 1 for edge in edges]
        step, x = SUB * unit, (SUB * origin[0] + 8 + sample[0]) * unit
        low, high = (pick(a[1], b[1], c[1]) // step - origin[1] for pick in (min, max))
        for row in range(max(0, low), min(size[1], high + 1)):
            y = (SUB * (row + origin[1]) + 8 + sample[1]) * unit
            first, end = 0, size[0]
            for (p, q), at_least in zip(edges, least, strict=True):
                # Along the row the edge function falls by `fall` a column, and must stay at `at_least`.
                fall, room = (q[1] - p[1]) * step, edge_function(p, q, (x, y)) - at_least
                if fall > 0:
                    end = min(end, room // fall + 1)
                elif fall < 0:
                    first = max(first, -(room // -fall))
                elif room < 0:
                    end = 0
            if first < end:
                yield Run(row, first, end, piece)


def draw_exact(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    size: tuple[int, int],
    origin: tuple[int, int],
    samples: tuple[tuple[int, int], ...],
    *,
    cull: str = "none",
    depth_test: str = "less",
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return owners (-1: none) and counts, int32 (H, W, S), of vertices that are not snapped."""
    found = reference.pieces(vertices, triangles, size, subpixel_bits="exact", cull=cull)
    owners = np.full((size[1], size[0], len(samples)), -1, np.int32)
    counts = np.zeros_like(owners)
    for k, sample in enumerate(samples):
        nearest: dict[tuple[int, int], Piece] = {}
        for row, first, end, piece in runs(found, size, origin, sample):
            counts[row, first:end, k] += 1
            if vertices.shape[1] == 2:
                owners[row, first:end, k] = piece.triangle
                continue
            for column in range(first, end):
                before = nearest.get((row, column))
                at = (SUB * (column + origin[0]) + 8 + sample[0], SUB * (row + origin[1]) + 8 + sample[1])
                if before is None or is_nearer(piece, before, at, depth_test):
                    nearest[row, column] = piece
                    owners[row, column, k] = piece.triangle
    return owners, counts


def is_nearer(piece: Piece, other: Piece, at: tuple[int, int], depth_test: str) -> bool:
    """Tell which depth wins at a point, in sixteenths of a pixel, when both are rounded as a buffer holds them."""
    here, there = (reference.round_to_float32(depth_at(one, at)) for one in (piece, other))
    return here > there if depth_test == "greater" else here < there


def depth_at(piece: Piece, at: tuple[int, int]) -> Any:
    """The depth of the plane through the vertices, a fraction."""
    a, b, c = ((SUB * x, SUB * y) for x, y in (v.xy_fx for v in piece.vertices))
    weights = [edge_function(b, c, at), edge_function(c, a, at), edge_function(a, b, at)]
    depths = [Fraction(v.z) for v in piece.vertices]
    return sum(w * z for w, z in zip(weights, depths, strict=True)) / sum(weights)
