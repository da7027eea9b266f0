"""Calibrates the costs of this machine per vertex, triangle and pixel: measures scenes, and fits costs to them.

Costs that decide are then scaled, a choice after the other, so that less time is lost than with the shipped costs,
which are kept where this does not hold for other scenes.

In: seeded scenes. Out: `Costs`, with the errors of their estimates for scenes that were not fitted.
"""

from __future__ import annotations

import datetime
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
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
from topleft._core.raster.costs import FEATURES, Costs, cost_table, draw_features, use_costs
from topleft._core.raster.rasterize import draw
from topleft._core.raster.sampling import sample_positions, sum_areas
from topleft._core.raster.snap import Snapped, snap_mesh
from topleft._core.raster.verbs import Rasterizer
from topleft._core.raster.view import View, ViewOptions
from topleft.scenes import blob, random_triangles
from topleft.typing import SamplingOption

GROUPS = {"mask": Sink.MASK, "count": Sink.COUNT, "depth": Sink.NEAREST, "samples": Sink.SAMPLES, "area": Sink.COUNT}

#: The clock of work by several threads.
WALL = time.perf_counter_ns

FRAMES = ((640, 360), (1280, 720), (1920, 1080))

#: Number and size in pixels of the triangles of the scenes that are fitted, and of those that are not.
FITTED = ((60_000, 2), (40_000, 3), (30_000, 6), (20_000, 10), (8_000, 16), (5_000, 28), (3_000, 45), (1_000, 90),
          (200, 250), (40, 700), (1, 400))  # fmt: skip
HELD_OUT = ((50_000, 4), (12_000, 12), (4_000, 35), (600, 150), (80, 500))


@dataclass(frozen=True, slots=True)
class Sample:
    """The counts of a scene as drawn, and its time."""

    counts: NDArray[np.float64]
    ns: float


def calibrate(*, n_rounds: int = 5) -> Costs:
    """Measure this machine for half a minute; return costs with their errors for scenes that were not fitted."""
    fits: dict[str, Any] = {}
    ratios = []
    for group, sink in GROUPS.items():
        ns = fit([measure_draw(scene, view, group, sink, n_rounds) for scene, view in scenes(FITTED)])
        fits[f"draw_{group}"] = tuple(ns.tolist())
        for scene, view in scenes(HELD_OUT, with_blob=True, seed=7):
            sample = measure_draw(scene, view, group, sink, n_rounds)
            ratio = float(sample.counts @ ns) / sample.ns
            ratios.append(max(ratio, 1 / ratio))
    found = fits | measure_vertices(n_rounds) | measure_others(n_rounds)
    return tune(
        Costs(
            machine=processor(),
            isa=engine.isa_in_use(),
            date=datetime.datetime.now(datetime.UTC).date().isoformat(),
            call=measure_calls(n_rounds),
            parallel=measure_parallel(n_rounds),
            residual=(float(np.median(ratios)), max(ratios), len(ratios)),
            **found,
        ),
        n_rounds,
    )


def least_ns(work: Callable[[], object], n_rounds: int, clock: Callable[[], int] = time.thread_time_ns) -> float:
    """Return the least time of some runs, after one that does not count."""
    work()
    times = []
    for _ in range(n_rounds):
        start = clock()
        work()
        times.append(clock() - start)
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
    """Draw a scene; return its counts and its time."""
    memory = KeptMemory()
    samplings: dict[str, SamplingOption] = {"samples": "msaa4", "area": "area"}
    options: ViewOptions = {"threads": 1, "sampling": samplings.get(group, "center")}
    chosen = View.parse(view.size, options) if group in ("samples", "area") else view
    vertices, triangles = scene
    snapped = snap_mesh(memory, vertices, triangles, chosen, with_depth=group == "depth", out=None)
    width, height = view.size
    samples = sample_positions(4, chosen.grid_bits) if group == "samples" else None
    _, census = snapped.mesh.count_classes(sink, width, height, samples)
    return Sample(
        draw_features(census, width * height), least_ns(drawing(memory, snapped, chosen, group, sink), n_rounds)
    )


def drawing(memory: KeptMemory, snapped: Snapped, view: View, group: str, sink: Sink) -> Callable[[], object]:
    """Return a function that draws a scene once, on memory that is there."""
    shape = view.size[::-1]
    if group == "area":
        areas = memory.empty("pixels", shape, np.float32)
        return lambda: sum_areas(memory, snapped.mesh, areas, 1, is_clamped=True)
    dtype = {"mask": np.bool_, "samples": np.float32}.get(group, np.int32)
    pixels = memory.empty("pixels", shape, dtype)
    depth = memory.empty("depth", shape, np.float32) if group == "depth" else None
    return lambda: draw(memory, snapped, view, choices.drawing(view, snapped, sink), pixels, depth=depth)


def fit(samples: list[Sample]) -> NDArray[np.float64]:
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
    return ns


def measure_calls(n_rounds: int) -> tuple[float, ...]:
    """Return the time of each verb for one triangle of a few pixels."""
    small = Rasterizer((8, 8), threads=1)
    vertices, triangles = np.array([[1.0, 1, 0], [6, 1, 0.5], [1, 6, 1]]), np.array([[0, 1, 2]], np.int32)
    colors = np.array([[1, 2, 3, 4]], np.uint8)
    verbs = (
        lambda: small.coverage(vertices, triangles),
        lambda: small.overdraw(vertices, triangles),
        lambda: small.fill(vertices, triangles, colors),
        lambda: small.rasterize(vertices, triangles),
    )  # in the order of CALLS
    return tuple(least_ns(partial(repeat, verb, 50), n_rounds) / 50 for verb in verbs)


def measure_vertices(n_rounds: int) -> dict[str, Any]:
    """Return the time of a vertex, by where it comes from."""
    n = 200_000
    rng = np.random.default_rng(3)
    triangles = np.zeros((1, 3), np.int32)
    points = rng.uniform(0, 640, (n, 3))
    ortho = np.diag([1e-3, 1e-3, 1e-3, 1])
    eye = np.array([*ortho[:3], [0, 0, 1e-3, 1]])
    clip = np.concatenate([points * 1e-3, np.full((n, 1), 2.0)], axis=1)
    found: dict[str, Any] = {}
    for dtype in (np.float32, np.float64, np.int64):
        kinds: dict[str, tuple[NDArray[Any], Any]] = {"snap": (points, None)}
        if dtype is not np.int64:
            kinds |= {"transform": (points, eye), "affine": (points, ortho), "project": (clip, None)}
        for name, (values, matrix) in kinds.items():
            array = values.astype(dtype)
            view = View.parse((640, 360), {"threads": 1, "transform": matrix})
            work = partial(snap_mesh, KeptMemory(), array, triangles, view, with_depth=True, out=None)
            found[name] = *found.get(name, ()), least_ns(work, n_rounds) / n
    return found


def measure_others(n_rounds: int) -> dict[str, float]:
    """Return the costs that belong neither to vertices nor to a draw."""
    n = 200_000
    wide: NDArray[np.int64] = np.zeros((n, 3), np.int64)
    narrow: NDArray[np.int32] = np.zeros((n, 3), np.int32)
    clip, beyond = measure_beyond(n_rounds)
    width, height = FRAMES[-1]
    ids, depth = np.zeros((height, width), np.int32), np.zeros((height, width), np.float32)
    vertices, triangles, _ = random_triangles(10, 300, width, height)
    picture, colors = Rasterizer((width, height), threads=1), np.zeros((10, 4), np.uint8)
    with choices.forced(is_direct=False, fills_large_shapes=False, draws_large_shapes=False):
        painted = least_ns(lambda: picture.fill(vertices, triangles, colors), n_rounds)
        counted = least_ns(lambda: picture.overdraw(vertices, triangles), n_rounds)
    fresh = 32 << 20
    return {
        "index": least_ns(lambda: engine.narrow_triangles(wide, 1, narrow), n_rounds) / n,
        "clip": clip,
        "beyond": beyond,
        "paint": max(0.01, (painted - counted) / ids.size),
        "flat_pixel": least_ns(lambda: engine.set_flat_depth(ids, depth, 0, height, True, 0.5, 1.0), n_rounds)
        / ids.size,
        "wake": least_ns(lambda: [run_parts(lambda first, _: first, 2, 2) for _ in range(20)], n_rounds, WALL) / 20,
        "touch": least_ns(lambda: allocate(fresh).fill(0), n_rounds) / fresh,
    }


def measure_beyond(n_rounds: int) -> tuple[float, float]:
    """Return the cost of a triangle outside of a clip plane: before the draw, beyond its vertices, and in the draw."""
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
    one, two = (least_ns(partial(picture.rasterize, vertices, triangles), 5 * n_rounds, WALL) for picture in pair)
    return min(2.0, max(1.0, one / two))


@dataclass(frozen=True, slots=True)
class Tuned:
    """A choice between two ways: the rows that decide it, and scenes of triangles, their number and size in pixels."""

    choice: str
    rows: tuple[str, ...]
    verb: str
    scenes: tuple[tuple[int, int], ...]
    ways: tuple[Any, Any] = (False, True)
    threads: int | None = 1
    z: float | None = None

    def draws(self, seed: int) -> Iterator[Callable[[], object]]:
        """Yield for each scene a function that draws it, all on the memory of one `Rasterizer`."""
        picture = Rasterizer(FRAMES[-1], threads=self.threads)
        for n, size_px in self.scenes:
            vertices, triangles, colors = random_triangles(n, size_px, *FRAMES[-1], seed)
            if self.z is not None:
                vertices[:, 2] = self.z
            extra = (colors,) if self.verb == "fill" else ()
            yield partial(getattr(picture, self.verb), vertices, triangles, *extra)


def all_rows(view: View, *_: object, **__: object) -> int:
    """Blend all rows at once."""
    return view.size[1]


def band_rows(_: object, __: object, row_bytes: int, **___: object) -> int:
    """Blend a band of rows after the other."""
    return max(1, int(cost_table().blend_bytes) // row_bytes)


TUNED = (
    Tuned("pays_without_depth", ("compared_sample", "compared_row"), "rasterize",
          ((100, 60), (300, 60), (1_000, 60), (2_000, 8), (8_000, 8), (30_000, 8), (100, 300)), z=0.5),
    Tuned("is_direct", ("direct_triangle",), "fill", ((8_000, 8), (20_000, 40), (40_000, 12), (80_000, 8))),
    Tuned("pays_to_sort", ("sorted_triangle", "outside_triangle", "far_triangle"), "rasterize",
          ((100, 60), (1_000, 300), (20_000, 40), (200_000, 8), (300_000, 6), (400_000, 5))),
    Tuned("rows_to_blend", ("blended_triangle", "blended_vertex"), "fill",
          ((1_000, 100), (1_000, 300), (10_000, 40), (30_000, 20)), (all_rows, band_rows)),
    Tuned("pays_to_bound", ("bound_span",), "rasterize", ((300, 1_000), (1_000, 400), (1_000, 200), (5_000, 100))),
    Tuned("threads_to_draw", ("thread_wakes",), "rasterize",
          ((1, 60), (20, 60), (20, 200), (1_000, 20), (4_000, 20), (50, 400)), (1, 2), threads=None),
    Tuned("is_sliced", ("shared_setups",), "coverage", ((100_000, 2), (300_000, 2), (700_000, 2)), threads=2),
    Tuned("pays_to_share", ("shared_item",), "coverage", ((20_000, 2), (50_000, 2), (100_000, 2)), threads=2),
)  # fmt: skip

#: Factors that rows are multiplied by, to find the best for a machine.
FACTORS = (1.0, 0.25, 0.5, 0.71, 1.41, 2.0, 4.0)

#: The least share of time that tuned costs must save on scenes that they were not chosen by.
LEAST_GAIN = 0.01


def tune(own: Costs, n_rounds: int) -> Costs:
    """Return the costs that lose the least time in each choice, on other scenes no more than the shipped ones."""
    shipped, n_scenes = Costs(), 0
    lost = np.zeros(2)
    for one in TUNED if available_threads() > 1 else [one for one in TUNED if one.threads == 1]:
        kept = replace(own, **{name: getattr(shipped, name) for name in (*one.rows, *MEASURED.get(one.choice, ()))})
        tables = [kept, *(scaled(table, one.rows, by) for table in (own, kept) for by in FACTORS)]
        fitted, others = (
            np.stack([losses(one, draw, tables, min(3, n_rounds)) for draw in one.draws(seed)]) for seed in (1, 2)
        )
        best = int(np.argmin(fitted.mean(axis=0)))
        if others[:, best].mean() > others[:, 0].mean() - LEAST_GAIN:
            best = 0
        own = tables[best]
        lost += others[:, [0, best]].sum(axis=0)
        n_scenes += len(others)
    return replace(own, tuned=(*np.exp(lost / n_scenes).tolist(), n_scenes))


#: Rows that `calibrate` measures, by the choice that they decide: kept only if `tune` prefers them.
MEASURED = {"pays_without_depth": ("flat_pixel",), "is_direct": ("paint",), "threads_to_draw": ("wake",)}


def scaled(costs: Costs, rows: tuple[str, ...], factor: float) -> Costs:
    """Return costs with some rows multiplied."""
    return replace(costs, **{name: factor * getattr(costs, name) for name in rows})


def losses(one: Tuned, draw: Callable[[], object], tables: list[Costs], n_rounds: int) -> NDArray[np.float64]:
    """Return the logarithm of the time that each table's choice takes, over that of the better way."""
    decide, in_use = getattr(choices, one.choice), cost_table()
    picked: list[int] = []

    def spy(*arguments: Any, **options: Any) -> Any:
        answers = []
        for table in tables:
            use_costs(table)
            answers.append(decide(*arguments, **options))
        use_costs(in_use)
        if not picked:
            low = one.ways[0](*arguments, **options) if callable(one.ways[0]) else one.ways[0]
            picked.extend(int(answer != low) for answer in answers)
        return answers[0]

    with choices.forced(**{one.choice: spy}):
        draw()
    if not picked:
        return np.zeros(len(tables))
    took = np.full(2, np.inf)
    for _ in range(n_rounds):
        for i, way in enumerate(one.ways):
            with choices.forced(**{one.choice: way}):
                took[i] = min(took[i], least_ns(draw, 1, time.thread_time_ns if one.threads == 1 else WALL))
    return np.asarray(np.log(took[picked] / took.min()))


def processor() -> str:
    """Return the name of the CPU."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
