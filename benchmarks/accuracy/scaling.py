"""Chart (e): how time grows with triangles, a hundred to ten million, and shrinks with threads.

Out: `scaling` of a record. The scene is the bumpy sphere of the other benchmarks at 1920x1080, ids and depth, back
faces culled. Time is what passes, since threads share it; others on the machine would count, so of a turn the shortest
call is taken.
"""

from __future__ import annotations

import time
from functools import partial
from typing import Any

from benchmarks.accuracy.options import AccuracyOptions
from benchmarks.harness.turns import Turn, spread, take_turns, turn_of
from benchmarks.scenes.cases import HD, blob_scene

N_TRIANGLES = (100, 1000, 10_000, 100_000, 1_000_000, 10_000_000)


def thread_counts(n_max: int) -> list[int]:
    """1, 2, 4 ... and the machine's own number."""
    counts = [1]
    while counts[-1] * 2 < n_max:
        counts.append(counts[-1] * 2)
    return sorted({*counts, n_max})


def shortest_of(turn: Turn) -> Turn:
    """Return the turn that gives the shortest of its calls alone."""
    return lambda seconds: [min(turn(seconds))]


def measure_scaling(options: AccuracyOptions) -> dict[str, Any]:
    """Return `scaling`: a row for each number of triangles and of threads; different numbers of threads take turns."""
    import topleft as tl

    counts = thread_counts(options.max_threads)
    rasterizers = [tl.Rasterizer(HD, threads=n) for n in counts]
    rows = []
    for n in N_TRIANGLES:
        scene = blob_scene(max(100, int(n * options.scale)))
        view = {"transform": scene.transform, "cull": scene.cull}
        calls = [partial(own.rasterize, scene.vertices, scene.triangles, **view) for own in rasterizers]
        turns = [shortest_of(turn_of(call, time.perf_counter)) for call in calls]
        times = take_turns(turns, options.rounds, 5 * options.seconds)
        for n_threads, took in zip(counts, times, strict=True):
            row = {"scene": n, "n_triangles": len(scene.triangles), "threads": n_threads} | spread(took)
            rows.append(row | {"faster": float(f"{sorted(times[0] / took)[len(took) // 2]:.3g}")})
    return {"scaling": rows}
