"""Chart (d): time per triangle from a tenth of a pixel to a million pixels, each method, with the memory floor.

Out: `sizes` and `memory` of a record. A call clears the frame, too; that is measured as a call without triangles in the
same rounds and subtracted.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from benchmarks.accuracy.options import AccuracyOptions
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.scenes.families import Entry, Triangles, entries

AREAS_PX = tuple(float(f"{10 ** (step / 2):.3g}") for step in range(-2, 13))
LARGEST = 0.24
"""Of the frame's area: an equilateral triangle of that size turns in it."""
DEFAULT_BITS = 8
TIMED_PX = 2e6
MAX_TRIANGLES = 20_000
STREAM_BYTES = 1 << 28
"""Far more than any cache."""


def equilateral(n: int, area_px: float, frame_px: int, seed: int = 11) -> Triangles:
    """Return triangles of that area, turned and placed at random within the frame."""
    rng = np.random.default_rng(seed)
    radius_px = np.sqrt(area_px / (0.75 * np.sqrt(3)))
    angle = rng.uniform(0, 2 * np.pi, (n, 1)) + np.array([0, 2, 4]) * np.pi / 3
    center_px = rng.uniform(radius_px, frame_px - radius_px, (n, 1, 2))
    vertices = center_px + radius_px * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return vertices.reshape(-1, 2), np.arange(3 * n, dtype=np.int32).reshape(n, 3)


def measure_sizes(options: AccuracyOptions) -> dict[str, Any]:
    """Return `sizes`: a row for each method and area, at the usual precision; and `memory`: the cost of a fill."""
    import topleft as tl

    size = (options.frame_px, options.frame_px)
    rasterizer = tl.Rasterizer(size, threads=1)
    chosen = [entry for entry in entries(options.methods) if entry.bits in (None, DEFAULT_BITS)]
    nothing = np.zeros((0, 2)), np.zeros((0, 3), np.int32)
    rows = []
    for area_px in AREAS_PX:
        if area_px > LARGEST * options.frame_px**2:
            continue
        n = max(2, int(min(TIMED_PX / area_px, MAX_TRIANGLES) * options.scale))
        scene = equilateral(n, area_px, options.frame_px)

        def call(entry: Entry, scene: Triangles) -> partial[Any]:
            return partial(rasterizer.coverage, *entry.orient(scene), **entry.options())

        calls = [call(Entry("auto", DEFAULT_BITS), nothing), *(call(entry, scene) for entry in chosen)]
        clear, *times = take_turns([turn_of(call) for call in calls], options.rounds, options.seconds)
        for entry, took in zip(chosen, times, strict=True):
            ns = 1e6 * float(np.median(took - clear)) / n
            row = {"method": entry.method, "precision": entry.precision, "area_px": area_px, "n": n}
            rows.append(row | {"ns_triangle": float(f"{ns:.4g}")})
    return {"sizes": rows, "memory": measure_memory(options)}


def measure_memory(options: AccuracyOptions) -> dict[str, float]:
    """Return how long a byte takes to be set: in a mask of the frame, and in more memory than caches hold."""
    mask = np.zeros((options.frame_px, options.frame_px), np.uint8)
    much = np.zeros(max(int(STREAM_BYTES * min(options.scale, 1)), 1), np.uint8)
    turns = [turn_of(partial(array.fill, 1)) for array in (mask, much)]
    times = take_turns(turns, options.rounds, options.seconds)
    facts: dict[str, float] = {"frame_bytes": mask.size, "stream_bytes": much.size}
    for name, took in zip(("frame", "stream"), times, strict=True):
        facts[f"{name}_ns_byte"] = float(f"{1e6 * np.median(took) / facts[f'{name}_bytes']:.3g}")
    return facts
