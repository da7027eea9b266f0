"""Counts wrong pixels of `subpixel_bits="exact"` against integers, on random triangles and on hostile ones, at length.

Run: ``PYTHONPATH=src python -m benchmarks.accuracy.long_run --edge-pixels 100000000``.  Out: a line a family of
triangles: edge pixels compared, wrong ones, which must be none.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.families import FAMILIES, NO_SNAP, in_cells
from topleft.methods.reference.integers import ExactPicture

FRAME_PX = 2048


def near_centres(vertices: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return vertices that each lie within three float64 steps of the nearest half pixel."""
    moved = np.round(vertices * 2) / 2
    for _ in range(3):
        moved = np.nextafter(moved, rng.choice([-np.inf, 0.0, np.inf], moved.shape))
    return moved


def compare(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> tuple[int, int]:
    """Return the edge pixels of a scene, and how many pixels the engine draws another number of times."""
    import topleft as tl

    exact = ExactPicture(vertices, triangles, (FRAME_PX, FRAME_PX))
    counts = tl.overdraw(vertices, triangles, (FRAME_PX, FRAME_PX), subpixel_bits=NO_SNAP)
    return int(exact.is_edge.sum()), int((counts != exact.count).sum())


def run(n_edge_px: int) -> int:
    """Compare so many edge pixels or more, print the counts, return the wrong ones."""
    names = [(name, hostile) for name in FAMILIES for hostile in (False, True)]
    n_seen, n_wrong = dict.fromkeys(names, 0), dict.fromkeys(names, 0)
    seed = 0
    while sum(n_seen.values()) < n_edge_px:
        seed += 1
        for name, hostile in names:
            vertices, triangles = in_cells(FAMILIES[name], seed, FRAME_PX)
            if hostile:
                vertices = near_centres(vertices, np.random.default_rng(seed))
            seen, wrong = compare(vertices, triangles)
            n_seen[name, hostile] += seen
            n_wrong[name, hostile] += wrong
    for key in names:
        what = f"{key[0]}{', corners beside half pixels' if key[1] else ''}"
        print(f"{what}: {n_seen[key]:,} edge pixels, {n_wrong[key]:,} wrong")
    print(f"in all: {sum(n_seen.values()):,} edge pixels, {sum(n_wrong.values()):,} wrong")
    return sum(n_wrong.values())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--edge-pixels", type=int, default=1_000_000, metavar="N", help="at least (%(default)s)")
    raise SystemExit(run(parser.parse_args().edge_pixels) > 0)
