"""What this machine needs per vertex, triangle and pixel: scenes are measured, and costs fitted to them.

In: seeded scenes. Out: `Costs`, with how far off their estimates are for scenes that were not fitted.
"""

from __future__ import annotations

import datetime
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.memory import KeptMemory, allocate
from topleft._core.base.options import Sink
from topleft._core.base.threads import available_threads, run_parts
from topleft._core.raster import choices
from topleft._core.raster.rasterize import draw
from topleft._core.raster.sampling import sample_positions, sum_areas
from topleft._core.raster.snap import Snapped, snap_mesh
from topleft._core.raster.verbs import Rasterizer
from topleft._core.raster.view import View, ViewOptions
from topleft._meshes.plan.costs import FEATURES, Costs, features
from topleft.scenes import blob, random_triangles
from topleft.typing import SamplingOption

GROUPS = {"mask": Sink.MASK, "count": Sink.COUNT, "depth": Sink.NEAREST, "samples": Sink.SAMPLES, "area": Sink.COUNT}

FRAMES = ((640, 360), (1280, 720), (1920, 1080))

#: Number and size in pixels of the triangles of the scenes that are fitted, and of those that are not.
FITTED = ((60_000, 2), (40_000, 3), (30_000, 6), (20_000, 10), (8_000, 16), (5_000, 28), (3_000, 45), (1_000, 90),
          (200, 250), (40, 700), (1, 400))  # fmt: skip
HELD_OUT = ((50_000, 4), (12_000, 12), (4_000, 35), (600, 150), (80, 500))


@dataclass(frozen=True, slots=True)
class Sample:
    """A scene as it is drawn, and what it took."""

    counts: NDArray[np.float64]
    ns: float


def calibrate(*, n_rounds: int = 7) -> Costs:
    """Measure this machine: some ten seconds, at one thread but for one draw at two.

    Parameters
    ----------
    n_rounds : int
        Each number is the least of so many measurements.

    Returns
    -------
    Costs
        With today's date, and the residual of scenes that were not fitted.
    """
    fits, ratios = {}, []
    for group, sink in GROUPS.items():
        fits[group] = fit([measure_draw(scene, view, group, sink, n_rounds) for scene, view in scenes(FITTED)])
        for scene, view in scenes(HELD_OUT, with_blob=True, seed=7):
            sample = measure_draw(scene, view, group, sink, n_rounds)
            ratio = float(sample.counts @ np.array(list(fits[group].values()))) / sample.ns
            ratios.append(max(ratio, 1 / ratio))
    return Costs(
        machine=processor(),
        isa=engine.isa_in_use(),
        date=datetime.datetime.now(datetime.UTC).date().isoformat(),
        call=measure_calls(n_rounds),
        vertex=measure_vertices(n_rounds),
        draw=fits,
        other=measure_others(n_rounds),
        parallel=measure_parallel(n_rounds),
        residual={"median": float(np.median(ratios)), "worst": max(ratios), "n_scenes": len(ratios)},
    )


def least_ns(work: Callable[[], object], n_rounds: int) -> float:
    """Return the least time of some runs, after one that does not count."""
    work()
    times = []
    for _ in range(n_rounds):
        start = time.perf_counter_ns()
        work()
        times.append(time.perf_counter_ns() - start)
    return float(min(times))


def repeat(work: Callable[[], object], n: int) -> None:
    """Do some work several times."""
    for _ in range(n):
        work()


def scenes(kinds: tuple[tuple[int, int], ...], *, with_blob: bool = False, seed: int = 1) -> Iterator[tuple[Any, View]]:
    """Give scenes of triangles of each size in two frames, some outside, some that need 64 and 128 bits."""
    for frame in FRAMES:
        view = View.parse(frame, {"threads": 1})
        for n, size_px in kinds:
            yield random_triangles(n, size_px, *frame, seed)[:2], view
        if with_blob:
            vertices, triangles = blob(20_000)
            yield (vertices * 0.4 * frame[1] + [frame[0] / 2, frame[1] / 2, 0], triangles), view
        else:
            vertices, triangles, _ = random_triangles(30_000, 8, *frame, seed)
            yield (vertices + [2 * frame[0], 0, 0], triangles), view
    edge = View.parse(FRAMES[0], {"threads": 1, "method": "scanline"})
    yield random_triangles(2_000, 40, *FRAMES[0], seed)[:2], edge
    vertices, triangles, _ = random_triangles(300, 40, *FRAMES[0], seed)
    vertices = np.where(np.arange(len(vertices))[:, None] % 3 == 0, [2.0**24, 0, 0], vertices)
    for size in (FRAMES[0], (640, 16)):
        yield (vertices, triangles), View.parse(size, {"threads": 1})


def measure_draw(scene: Any, view: View, group: str, sink: Sink, n_rounds: int) -> Sample:
    """Draw a scene and count what it is made of."""
    memory = KeptMemory()
    samplings: dict[str, SamplingOption] = {"samples": "msaa4", "area": "area"}
    options: ViewOptions = {"threads": 1, "sampling": samplings.get(group, "center")}
    chosen = View.parse(view.size, options) if group in ("samples", "area") else view
    vertices, triangles = scene
    snapped = snap_mesh(memory, vertices, triangles, chosen, with_depth=group == "depth", out=None)
    width, height = view.size
    samples = sample_positions(4, chosen.grid_bits) if group == "samples" else None
    _, census = snapped.mesh.count_classes(sink, width, height, samples)
    return Sample(features(census, width * height), least_ns(drawing(memory, snapped, chosen, group, sink), n_rounds))


def drawing(memory: KeptMemory, snapped: Snapped, view: View, group: str, sink: Sink) -> Callable[[], object]:
    """Return what draws a scene once, on memory that is there."""
    shape = view.size[::-1]
    if group == "area":
        areas = memory.empty("pixels", shape, np.float32)
        return lambda: sum_areas(memory, snapped.mesh, snapped.n_triangles, areas, 1, is_clamped=True)
    dtype = {"mask": np.bool_, "samples": np.float32}.get(group, np.int32)
    pixels = memory.empty("pixels", shape, dtype)
    depth = memory.empty("depth", shape, np.float32) if group == "depth" else None
    return lambda: draw(memory, snapped, view, choices.drawing(view, snapped, sink), pixels, depth=depth)


def fit(samples: list[Sample]) -> dict[str, float]:
    """Return costs that are not negative, with the least sum of squared relative errors."""
    counts = np.stack([sample.counts / sample.ns for sample in samples])
    ns = np.zeros(len(FEATURES))
    kept: NDArray[np.bool_] = np.asarray(counts.any(axis=0))
    while kept.any():
        ns[:] = 0
        ns[kept] = np.linalg.lstsq(counts[:, kept], np.ones(len(counts)), rcond=None)[0]
        if ns.min() >= 0:
            break
        kept[int(np.argmin(ns * counts.sum(axis=0)))] = False
    return dict(zip(FEATURES, ns.tolist(), strict=True))


def measure_calls(n_rounds: int) -> dict[str, float]:
    """Return the time of each verb for one triangle of a few pixels."""
    small = Rasterizer((8, 8), threads=1)
    vertices, triangles = np.array([[1.0, 1, 0], [6, 1, 0.5], [1, 6, 1]]), np.array([[0, 1, 2]], np.int32)
    colors = np.array([[1, 2, 3, 4]], np.uint8)
    verbs: dict[str, Callable[[], object]] = {
        "coverage": lambda: small.coverage(vertices, triangles),
        "overdraw": lambda: small.overdraw(vertices, triangles),
        "fill": lambda: small.fill(vertices, triangles, colors),
        "rasterize": lambda: small.rasterize(vertices, triangles),
    }
    return {name: least_ns(partial(repeat, verb, 50), n_rounds) / 50 for name, verb in verbs.items()}


def measure_vertices(n_rounds: int) -> dict[str, float]:
    """Return the time of a vertex, by where it comes from."""
    n = 200_000
    rng = np.random.default_rng(3)
    triangles = np.zeros((1, 3), np.int32)
    points = rng.uniform(0, 640, (n, 3))
    ortho = np.diag([1e-3, 1e-3, 1e-3, 1])
    eye = np.array([*ortho[:3], [0, 0, 1e-3, 1]])
    clip = np.concatenate([points * 1e-3, np.full((n, 1), 2.0)], axis=1)
    found = {}
    for dtype in (np.float32, np.float64, np.int64):
        kinds: dict[str, tuple[NDArray[Any], Any]] = {"snap": (points, None)}
        if dtype is not np.int64:
            kinds |= {"transform": (points, eye), "affine": (points, ortho), "project": (clip, None)}
        for name, (values, matrix) in kinds.items():
            array = values.astype(dtype)
            view = View.parse((640, 360), {"threads": 1, "transform": matrix})
            work = partial(snap_mesh, KeptMemory(), array, triangles, view, with_depth=True, out=None)
            found[f"{name} {array.dtype}"] = least_ns(work, n_rounds) / n
    return found


def measure_others(n_rounds: int) -> dict[str, float]:
    """Return the costs of what is neither a vertex nor a draw."""
    n = 200_000
    wide: NDArray[np.int64] = np.zeros((n, 3), np.int64)
    narrow: NDArray[np.int32] = np.zeros((n, 3), np.int32)
    clip, beyond = measure_beyond(n_rounds)
    ids, depth = np.zeros((360, 640), np.int32), np.zeros((360, 640), np.float32)
    vertices, triangles, _ = random_triangles(10, 300, 640, 360)
    picture = Rasterizer((640, 360), threads=1)
    colors = np.zeros((10, 4), np.uint8)
    painted = least_ns(lambda: picture.fill(vertices, triangles, colors), n_rounds)
    counted = least_ns(lambda: picture.overdraw(vertices, triangles), n_rounds)
    fresh = 32 << 20
    return {
        "index": least_ns(lambda: engine.narrow_triangles(wide, 1, narrow), n_rounds) / n,
        "clip": clip,
        "beyond": beyond,
        "paint": max(0.0, painted - counted) / ids.size,
        "flat": least_ns(lambda: engine.set_flat_depth(ids, depth, 0, 360, True, 0.5, 1.0), n_rounds) / ids.size,
        "wake": least_ns(lambda: [run_parts(lambda first, _: first, 2, 2) for _ in range(20)], n_rounds) / 20,
        "touch": least_ns(lambda: allocate(fresh).fill(0), n_rounds) / fresh,
    }


def measure_beyond(n_rounds: int) -> tuple[float, float]:
    """Return what a triangle outside of a clip plane costs before the draw, beyond its vertices, and in the draw."""
    n = 30_000
    vertices = np.random.default_rng(4).uniform(-0.5, 0.5, (3 * n, 4))
    vertices[:, 3] = 1
    triangles = np.arange(3 * n, dtype=np.int32).reshape(n, 3)
    memory, view = KeptMemory(), View.parse((64, 64), {"threads": 1})
    inside = least_ns(partial(snap_mesh, memory, vertices, triangles, view, with_depth=False, out=None), n_rounds)
    vertices[np.arange(3 * n) % 150 != 0, 2] -= 3  # one triangle of fifty is cut, not dropped
    outside = least_ns(partial(snap_mesh, memory, vertices, triangles, view, with_depth=False, out=None), n_rounds)
    snapped = snap_mesh(memory, vertices, triangles, view, with_depth=False, out=None)
    drawn = least_ns(drawing(memory, snapped, view, "count", Sink.COUNT), n_rounds)
    return max(0.0, outside - inside) / n, drawn / n


def measure_parallel(n_rounds: int) -> float:
    """Return how much faster two threads draw than one; 1 where there is one CPU."""
    if available_threads() == 1:
        return 1.0
    vertices, triangles, _ = random_triangles(60_000, 12)
    pair = [Rasterizer(FRAMES[-1], threads=n) for n in (1, 2)]
    one, two = (least_ns(partial(picture.rasterize, vertices, triangles), 5 * n_rounds) for picture in pair)
    return min(2.0, max(1.0, one / two))


def processor() -> str:
    """Return the name of the CPU."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
