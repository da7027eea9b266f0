"""Time beside error, for every method and precision: separate triangles, a watertight mesh, anti-aliasing.

Out: a record for JSON. Errors are counted against the exact picture of the vertices as they are, so that the snap
counts as an error, too. Methods take turns, A B C A B C ..., in one process on one thread; the time is CPU time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from benchmarks import machine
from benchmarks.exact_area import draw_area
from benchmarks.exact_unsnapped import draw_unsnapped
from benchmarks.families import FAMILIES, FRAME_PX, Entry, Family, Triangles, entries, in_cells, strewn
from benchmarks.stability import measure_stability

SCHEMA = 1


@dataclass(frozen=True)
class Options:
    """How much to do."""

    methods: Sequence[str] = ()
    rounds: int = 7
    seconds: float = 0.02
    edge_px: int = 1_000_000
    """Edge pixels of a family that errors are counted on, at least."""
    frame_px: int = FRAME_PX
    scale: float = 1.0
    """Of the numbers of triangles."""


def run_accuracy(options: Options, progress: TextIO | None = None) -> dict[str, Any]:
    """Measure, return the record."""
    import topleft as tl

    def tell(text: str) -> None:
        if progress:
            print(text, file=progress, flush=True)

    record: dict[str, Any] = {
        "schema": SCHEMA,
        "kind": "accuracy",
        "date": machine.now(),
        "machine": machine.describe_machine(),
        **machine.describe_commit(),
        "versions": {"topleft": tl.build_info()["version"], "numpy": machine.version_of("numpy")},
        "isa": tl.build_info()["isa"],
        "options": {"rounds": options.rounds, "seconds": options.seconds, "frame_px": options.frame_px},
    }
    chosen = entries(options.methods)
    record["families"], record["coverage"], record["antialiasing"] = [], [], []
    for family in FAMILIES.values():
        tell(f"{family.name}: errors")
        facts, wrong = count_errors(family, chosen, options)
        tell(f"{family.name}: times, {facts['n_edge_px']:,} edge pixels compared")
        timed = strewn(family, max(1, int(family.n_timed * options.scale)), options.frame_px)
        times = time_methods(chosen, timed, options)
        facts |= {"n_timed": len(timed[1]), "area_px": round(float(areas(timed).sum()))}
        record["families"].append(facts)
        for entry, n_wrong, took in zip(chosen, wrong, times, strict=True):
            row = {"family": family.name, "method": entry.method, "precision": entry.precision, "wrong_px": n_wrong}
            record["coverage"].append(row | per_unit(took, facts))
        record["antialiasing"] += measure_antialiasing(family, timed, options)
    tell("mesh: watertight, stable")
    record |= measure_stability(chosen, options.frame_px, options.scale)
    return record


def count_errors(family: Family, chosen: Sequence[Entry], options: Options) -> tuple[dict[str, Any], list[int]]:
    """Return what was compared, and how many pixels each entry got wrong; frames are drawn until there is enough."""
    import topleft as tl

    rasterizer = tl.Rasterizer((options.frame_px, options.frame_px), threads=1)
    wrong = [0] * len(chosen)
    n_edge_px = n_triangles = seed = 0
    while n_edge_px < options.edge_px:
        seed += 1
        scene = in_cells(family, seed, options.frame_px)
        exact = draw_unsnapped(*scene, rasterizer.size)
        n_edge_px += int(exact.is_edge.sum())
        n_triangles += len(scene[1])
        is_covered = exact.count > 0
        for i, entry in enumerate(chosen):
            drawn = rasterizer.coverage(*entry.orient(scene), **entry.options())
            wrong[i] += int((drawn != is_covered).sum())
    facts = {"name": family.name, "what": family.what, "n_triangles": n_triangles, "n_edge_px": n_edge_px}
    return facts, wrong


def time_methods(chosen: Sequence[Entry], scene: Triangles, options: Options) -> list[NDArray[np.float64]]:
    """Return the milliseconds of a mask of the scene, a median for each round."""
    import topleft as tl

    rasterizer = tl.Rasterizer((options.frame_px, options.frame_px), threads=1)
    calls = [partial(rasterizer.coverage, *entry.orient(scene), **entry.options()) for entry in chosen]
    return take_turns(calls, options.rounds, options.seconds)


def take_turns(calls: Sequence[Callable[[], object]], rounds: int, seconds: float) -> list[NDArray[np.float64]]:
    """Return the median of the milliseconds of each round, call by call; a turn lasts so long, at least one call.

    It is the time of the thread on its CPU: calls run on one thread, and what others do there does not count.
    """
    medians = np.empty((len(calls), rounds))
    for i_round in range(-1, rounds):  # the first round is for warming up
        for i, call in enumerate(calls):
            times_ms: list[float] = []
            while not times_ms or sum(times_ms) < 1e3 * seconds:
                start = time.thread_time()
                call()
                times_ms.append(1e3 * (time.thread_time() - start))
                if i_round < 0:
                    break
            if i_round >= 0:
                medians[i, i_round] = np.median(times_ms)
    return list(medians)


def per_unit(took_ms: NDArray[np.float64], facts: dict[str, Any]) -> dict[str, float]:
    """Median time and its quartiles for a triangle, and for a pixel of area."""
    low, middle, high = 1e6 * np.percentile(took_ms, [25, 50, 75])
    figures = {"ns_triangle": middle, "q1": low, "q3": high}
    per_triangle = {name: float(f"{ns / facts['n_timed']:.4g}") for name, ns in figures.items()}
    return per_triangle | {"ns_px": float(f"{middle / max(facts['area_px'], 1):.4g}")}


def areas(scene: Triangles) -> NDArray[np.float64]:
    """The area of each triangle."""
    vertices, triangles = scene
    a, b, c = vertices[triangles].swapaxes(0, 1)
    return np.abs((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])) / 2


def samplings() -> list[str]:
    """The ways to sample that the installed library has and that estimate how much of a pixel is covered."""
    from topleft.models import Sampling

    return [str(value) for value in Sampling if value not in ("outer", "inner")]


def measure_antialiasing(family: Family, timed: Triangles, options: Options) -> list[dict[str, Any]]:
    """Return time and error of each way to sample: root of the mean squared error of coverage over edge pixels."""
    import topleft as tl

    rasterizer = tl.Rasterizer((options.frame_px, options.frame_px), threads=1)
    scene = in_cells(family, 1, options.frame_px)
    exact, is_edge = draw_area(*scene, rasterizer.size), draw_unsnapped(*scene, rasterizer.size).is_edge
    ways = samplings()
    calls = [partial(rasterizer.coverage, *timed, sampling=way) for way in ways]
    rows = []
    for way, took in zip(ways, take_turns(calls, options.rounds, options.seconds), strict=True):
        error = rasterizer.coverage(*scene, sampling=way).astype(np.float64) - exact
        rms = float(np.sqrt((error[is_edge] ** 2).mean()))
        facts = {"n_timed": len(timed[1]), "area_px": float(areas(timed).sum())}
        row = {"family": family.name, "sampling": way, "rms": float(f"{rms:.4g}")}
        rows.append(row | per_unit(took, facts))
    return rows
