"""Meshlets: a mesh grown once into sets of triangles that share vertices, which draw its small triangles fastest.

In: a mesh in clusters, with float32 vertices; then a view of it. Out: ids and depths.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from topleft import _engine
from topleft._base.memory import CACHE_LINE, Memory
from topleft._base.threads import count_threads, run_parts

if TYPE_CHECKING:
    from topleft._raster.clusters import Clusters

__all__ = ["Meshlets"]


class Meshlets:
    """A copy of a mesh in meshlets: up to 64 vertices and 96 triangles each.

    Attributes
    ----------
    blocks : (N * MESHLET_BYTES,) uint8
        `tl_meshlet` of ``csrc/meshlets.h``: vertices, corners, and which triangle of the mesh each is.
    bounds : (MESHLET_BOUNDS, N + MESHLET_TAIL) float32
        What is known of each.
    counts : (N + MESHLET_TAIL,) uint8
        Their triangles, with the empty ones.
    n_bytes : int
        How much memory the copy takes.
    """

    def __init__(self, clusters: Clusters, threads: int | None = None) -> None:
        """Grow the triangles of clusters with float32 points, in the order that these have along a curve."""
        points, triangles, order = clusters.points, clusters.triangles, clusters.order
        n = len(triangles)
        source = _engine.Source(points)
        n_pieces = -(-n // _engine.MESHLET_PIECE)
        n_parts = min(n_pieces, count_threads(threads, n))

        def grow(first_piece: int, end_piece: int) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.uint8]]:
            first, end = first_piece * _engine.MESHLET_PIECE, min(end_piece * _engine.MESHLET_PIECE, n)
            most = _engine.most_meshlets(end - first)
            meshlets: NDArray[np.uint8] = np.empty(most * _engine.MESHLET_BYTES, np.uint8)
            records: NDArray[np.float32] = np.empty((most, _engine.MESHLET_BOUNDS), np.float32)
            n_triangles: NDArray[np.uint8] = np.empty(most, np.uint8)
            numbers: NDArray[np.int32] = np.full(len(points), -1, np.int32)
            room: NDArray[np.uint8] = np.empty(_engine.GROW_ROOM, np.uint8)
            place = first, end, numbers, room
            n_grown = _engine.grow_meshlets(source, triangles, order, *place, meshlets, records, n_triangles)
            return meshlets[: n_grown * _engine.MESHLET_BYTES], records[:n_grown], n_triangles[:n_grown]

        parts = run_parts(grow, n_pieces, n_parts)
        n_meshlets = sum(len(part[2]) for part in parts)
        meshlets = aligned(n_meshlets * _engine.MESHLET_BYTES)
        np.concatenate([part[0] for part in parts], out=meshlets)
        bounds: NDArray[np.float32] = np.zeros((_engine.MESHLET_BOUNDS, n_meshlets + _engine.MESHLET_TAIL), np.float32)
        np.concatenate([part[1].T for part in parts], axis=1, out=bounds[:, :n_meshlets])
        counts: NDArray[np.uint8] = np.zeros(n_meshlets + _engine.MESHLET_TAIL, np.uint8)
        np.concatenate([part[2] for part in parts], out=counts[:n_meshlets])
        middle, radius = np.abs(bounds[:3, :n_meshlets].astype(np.float64)), bounds[3, :n_meshlets].astype(np.float64)
        self.engine = _engine.Meshlets(meshlets, bounds, counts, (middle + radius).max(axis=1, initial=0).tolist())
        self.blocks, self.bounds, self.counts = meshlets, bounds, counts
        self.n_bytes = meshlets.nbytes + bounds.nbytes + counts.nbytes

    def __len__(self) -> int:
        return len(self.engine)

    def draw(
        self, memory: Memory, drawn: _engine.MeshletPass, n_triangles: int, height: int, n_parts: int, *, is_first: bool
    ) -> list[NDArray[np.int32]]:
        """Draw what a pass shows, in as many bands of rows; returns the triangles that are still to be drawn."""
        n = len(self)
        words = _engine.SEEN_BYTES // 4
        found: NDArray[np.int32] = memory.empty("meshlets found", (words * (n + 16),), np.int32)
        odd: NDArray[np.int32] = memory.empty("meshlets odd", (n + 16,), np.int32)

        def list_part(first: int, end: int) -> tuple[int, int, int]:
            first, end = first * 16, min(end * 16, n)
            return first, *drawn.find(first, end, found[words * first :], odd[first:])

        n_found = n_odd = 0
        for first, n_own, n_own_odd in run_parts(list_part, -(-n // 16), n_parts):
            if first:
                found[words * n_found : words * (n_found + n_own)] = found[words * first : words * (first + n_own)]
                odd[n_odd : n_odd + n_own_odd] = odd[first : first + n_own_odd]
            n_found += n_own
            n_odd += n_own_odd
        rows = [0, height] if n_parts == 1 else drawn.split_rows(found, n_found, n_parts)
        room: NDArray[np.int32] = memory.empty("meshlets sorted", (n_parts, words * (n_found + 1)), np.int32)
        others: NDArray[np.int32] = memory.empty("meshlets others", (n_parts, n_triangles + 1), np.int32)

        def draw_rows(i: int, _: int) -> NDArray[np.int32]:
            place = rows[i], rows[i + 1], is_first, room[i], others[i]
            return others[i, : drawn.draw(found, n_found, odd, n_odd, *place)].copy()

        return run_parts(draw_rows, n_parts, n_parts)


def aligned(n_bytes: int) -> NDArray[np.uint8]:
    """Return bytes that begin with a line of the cache."""
    block: NDArray[np.uint8] = np.empty(n_bytes + CACHE_LINE, np.uint8)
    first = -block.ctypes.data % CACHE_LINE
    return block[first : first + n_bytes]
