"""The table of costs: a field of `Costs` is a row, with its value, its unit, its meaning and where it was measured.

Choices follow from it (`choices.py`), and so do the estimates of plans; no bit of a picture does. In: shipped numbers,
or those that `topleft calibrate` has written to the user's cache folder. `docs/design/choices.md` derives the rows.
"""

# ruff: noqa: RUF009 (a row is a field with a value that cannot change)

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft._core.base.options import Sampling, Sink
from topleft._core.base.whole_file import write_whole

#: The terms of a draw's time, in this order: triangles by how they are drawn, samples, pixels of the picture.
FEATURES = (
    "hidden", "tiny", "small", "middle", "rows", "long", "64-bit", "128-bit", "point", "span", "pixel", "cold",
)  # fmt: skip
CALLS = ("coverage", "overdraw", "fill", "rasterize")
DTYPES = ("float32", "float64", "int64")

#: A fitted cost, or a difference, may be 0: no choice is made from it.
FITTED = ("clip", "beyond", "draw_mask", "draw_count", "draw_depth", "draw_samples", "draw_area")

#: A file's numbers are at most so many times above or below the shipped ones: beyond, it is damaged.
MOST_TIMES = 100.0

Census = Sequence[tuple[int, float, float]]
Numbers = tuple[float, ...]


def row(value: Any, unit: str, prices: str, scene: str = "topleft calibrate") -> Any:
    """Return a row of the table. Its scene, unless it is measured by `calibrate`, tells where the value was found."""
    return field(default=value, metadata={"unit": unit, "prices": prices, "scene": scene})


STUDY = "python -m benchmarks choices"
STATIC = "python -m benchmarks static"
HD = "1920x1080, Zen 4"
RAPIDS = "1920x1080, Sapphire Rapids"


@dataclass(frozen=True, slots=True)
class Costs:
    """The costs of one machine."""

    machine: str = row("AMD EPYC", "", "where it was measured")
    isa: str = row("avx512", "", "with which instruction set")
    date: str = row("2026-11-21", "", "when")
    residual: Numbers = row((1.112, 4.16, 105), "ratio", "estimates of scenes not fitted: median, worst, number")
    tuned: Numbers = row((1.0, 1.0, 0), "ratio", "choices over the best: before, after calibrating; number of them")

    # calls, vertices, threads
    call: Numbers = row((23840.0, 22330.0, 32590.0, 26360.0), "ns", "a call of each of CALLS, one triangle of 5 px")
    snap: Numbers = row((0.7809, 0.7636, 2.277), "ns", "a vertex in pixels, of each of DTYPES")
    affine: Numbers = row((1.289, 1.635), "ns", "a vertex, with a matrix and no divide")
    transform: Numbers = row((1.797, 2.444), "ns", "a vertex, with a matrix and a divide")
    project: Numbers = row((1.553, 1.634), "ns", "a vertex in clip space")
    index: float = row(0.4286, "ns", "a triangle, its indices made int32")
    clip: float = row(66.41, "ns", "a triangle that a plane cuts or leaves out, before the draw")
    beyond: float = row(19.49, "ns", "the same in the draw")
    touch: float = row(0.07796, "ns", "a byte of fresh memory")
    wake: float = row(31_250.0, "ns", "waking another thread")
    thread_wakes: float = row(7.04, "wakes", "the least work of a thread: 0.22 ms", f"132 calls of {STUDY}")
    shared_item: float = row(1.1, "ns", "a vertex that is snapped or triangle that is converted, by two threads", STUDY)
    shared_setups: float = row(1_000_000, "triangles x threads", "to set up all in each thread, and not shares", STUDY)
    parallel: float = row(1.272, "ratio", "two threads, by one")

    # the guess of the work of a draw: a row of a triangle, a covered sample, a pixel of the picture
    work_triangle: float = row(5.0, "ns", "a triangle", STUDY)
    work_bits: Numbers = row((4.0, 0.018, 0.014), "ns", "coverage", STUDY)
    work_counts: Numbers = row((6.0, 0.2, 0.3), "ns", "overdraw", STUDY)
    work_ids: Numbers = row((12.0, 0.4, 0.6), "ns", "ids and depth", STUDY)
    work_labels: Numbers = row((8.0, 0.1, 0.15), "ns", "ids alone", STUDY)
    work_area: Numbers = row((9.0, 0.0, 0.3), "ns", "areas", STUDY)
    near_row: float = row(4.0, "ns", "a row of a triangle at most, in a near cache", STUDY)
    near_pixel: float = row(0.15, "ns", "a pixel at most, in a near cache", STUDY)
    near_pixels: float = row(400_000, "pixels", "a picture that stays in a near cache while it is drawn", STUDY)

    # depth left out, bounds of depth, colours
    flat_call: float = row(12_000.0, "ns", "ids alone, then depth in a pass", "flat triangles of 8, 40, 400 px, Zen 4")
    flat_pixel: float = row(0.19, "ns", "a pixel of that pass", "the same")
    compared_sample: float = row(0.35, "ns", "a comparison of depths", "the same")
    compared_row: float = row(12.0, "ns", "a row of a triangle with them, beyond the near cache", "the same")
    bound_span: float = row(100.0, "pixels", "a row of a triangle, for bounds of depth to pay", f"40 frames, {HD}")
    bound_columns: float = row(256, "pixels", "a row of the picture, likewise", STUDY)
    bound_triangles: float = row(200_000, "triangles", "more are small where they show", STUDY)
    paint: float = row(0.375, "ns", "a pixel coloured from its label")
    direct_triangle: float = row(16.875, "ns", "a triangle seen, coloured as it comes, beyond labels", f"fill, {HD}")
    seen_pixel: float = row(0.45, "ns", "a pixel read to find which vertices show", f"render of 1e5 to 3e6, {HD}")

    # bands of rows that stay in a cache
    cleared_pixel: float = row(0.1, "ns", "saved: a pixel of ids and depth, cleared", RAPIDS)
    saved_row: float = row(8.0, "ns", "saved: a row of a triangle of ids and depth", RAPIDS)
    saved_sample: float = row(0.1, "ns", "saved: a sample of ids and depth", RAPIDS)
    saved_store: float = row(0.1, "ns", "saved: a sample of four bytes", RAPIDS)
    saved_rows: float = row(
        4.3, "rows", "triangles, on the mean, for rows to be saved", "250,000 of 7, 400,000 of 5 px"
    )
    sorted_triangle: float = row(10.0, "ns", "sorting a triangle that is seen", RAPIDS)
    outside_triangle: float = row(4.0, "ns", "sorting one that is not", RAPIDS)
    far_triangle: float = row(20.0, "ns", "the same, more where it lies far from the next", RAPIDS)
    far_pixels: float = row(1 << 17, "pixels", "a band that triangles near each other find in the cache", RAPIDS)
    blended_row: float = row(4.0, "ns", "saved: a row of a triangle, blended", f"fill of 8 to 300 px, {HD}")
    blended_pixel: float = row(0.1, "ns", "saved: a pixel met again", "the same")
    blended_triangle: float = row(0.5, "ns", "a triangle looked at in a band", "the same")
    blended_vertex: float = row(1.1, "ns", "a vertex, likewise", "the same")
    blended_strip: float = row(1000.0, "ns", "by area, a triangle that reaches into a band", "the same")
    blend_bytes: float = row(768 << 10, "bytes", "a band of colours", "the same")
    plane_bytes: float = row(512 << 10, "bytes", "a band of ids and depth of one sample", STUDY)
    far_bytes: float = row(
        16 << 20,
        "bytes",
        "buffers that bands are written to past the caches",
        "msaa4, 1,500 of 70 px, 800x800: 5.3 -> 3.8 ms",
    )
    split_bytes: float = row(256 << 10, "bytes", "the same, where a band is drawn for all samples at once", STUDY)
    unsplit: Numbers = row(
        (9e4, 8.0),
        "samples, of a triangle",
        "pictures whose samples are kept one by one",
        "render by msaa4 and 8 of 12 to 100,000 triangles, 64x64 to 1280x720: 0.7 to 1.0 of the time below, 1.1 above",
    )
    label_bytes: float = row(512 << 10, "bytes", "labels of all samples in a band", STUDY)
    label_planes: float = row(
        8 << 20, "bytes", "labels of all samples of a picture, past the cache", "fill by msaa4 and 8, 3 to 300 px"
    )
    label_pixels: float = row(1600.0, "pixels", "triangles, on the mean, that hide others row by row", "the same")
    area_bytes: float = row(1 << 20, "bytes", "cells of areas in a band", f"areas of 8 to 300 px, {RAPIDS}")
    area_triangle: float = row(36.0, "ns", "a triangle sorted into bands of areas", "the same")
    area_row: float = row(2.0, "ns", "saved: a row of a triangle in the nearer cache", "the same")
    area_pixel: float = row(
        0.2, "ns", "saved: a pixel summed in the nearer cache", "one triangle, 3840x2160: 2.3 ms, not 3.2"
    )

    # clusters, by (of how many triangles: fewer, the share outside without culling, with it)
    cluster_triangles: float = row(20_000, "triangles", "a mesh drawn again, for sorting to pay", STATIC)
    cluster_shaded: float = row(150_000, "triangles", "the same, where one call draws and shades it", "blobs, 512x512")
    cluster_instances: float = row(16, "instances", "one sorted before its first picture", STATIC)
    cluster_front: float = row(0.8, "share", "clusters that face the view, at most", STATIC)
    cluster_small: Numbers = row((60_000, 0.1, 0.6), "triangles, shares", "clusters outside, of small meshes", STATIC)
    cluster_middle: Numbers = row((1e6, 0.0, 0.33), "triangles, shares", "the same, of larger meshes", STATIC)
    cluster_layers: Numbers = row((3.0, 2.0), "layers", "instances behind each other: at least; that are drawn", STATIC)
    cluster_scene: Numbers = row((0.1, 0.33), "shares", "clusters outside, of scenes: one sample, several", STATIC)
    cluster_drawn: float = row(120_000, "ns", "an instance that is drawn from clusters, beside its triangles", "balls")
    scene_triangles: float = row(6_000, "triangles", "an instance, for threads to share a scene", STATIC)
    scene_rows: float = row(8, "rows", "the same", STATIC)
    cluster_test: float = row(160.0, "ns", "finding out whether a cluster shows", "balls of 1e6 and 1e7")
    cluster_hidden: float = row(
        0.6, "share", "the time of a cluster left out, by one that shows", "balls of 1e6 and 1e7"
    )
    exact_times: float = row(1.1, "ratio", "vertices that are not snapped, in a draw", "docs/design/exact.md")

    # several samples from clusters: triangles in view a pixel; triangles a sample or the share outside
    sampled_cluster: Numbers = row((0.06, 15_000, 0.1), "limits", "samples from clusters, both sides", STATIC)
    sampled_cluster_culled: Numbers = row((0.2, 1_500_000, 0.9), "limits", "the same, culled", STATIC)
    inside_samples: float = row(100, "samples", "for a triangle beyond the near or far plane, at most", "blobs, inside")
    inside_outside: float = row(0.7, "share", "clusters outside, likewise at least", "blobs, inside")

    # estimates of draws: each of FEATURES
    # fmt: off
    draw_mask: Numbers = row(
        (1.457, 3.75, 9.665, 17.63, 75.58, 258.9, 169.0, 83.46, 0.0, 0.02777, 0.02159, 0.01298), "ns", "coverage")
    draw_count: Numbers = row(
        (1.404, 4.166, 9.13, 18.27, 59.84, 298.7, 306.1, 12.36, 0.0, 0.05471, 0.05344, 0.2244), "ns", "overdraw, ids")
    draw_depth: Numbers = row(
        (1.476, 7.345, 19.51, 31.77, 125.7, 688.2, 363.2, 0.0, 0.0, 0.06051, 0.09855, 0.7371), "ns", "ids and depth")
    draw_samples: Numbers = row(
        (1.489, 7.698, 18.73, 33.7, 166.7, 897.1, 0.0, 1078.0, 0.0, 0.05254, 0.3331, 0.01485), "ns", "four samples")
    draw_area: Numbers = row(
        (1.303, 45.19, 31.42, 89.73, 238.7, 484.9, 0.0, 363.2, 0.0, 0.02413, 0.287, 0.02334), "ns", "areas")
    # fmt: on

    @property
    def source(self) -> str:
        """Say where the numbers come from and how far off they are."""
        within = f"half of all estimates within {100 * (self.residual[0] - 1):.0f} %"
        return f"{self.machine}, {self.isa}, {self.date}; {within}"

    @property
    def thread_ns(self) -> float:
        """The least work of a thread, a multiple of the time to wake it."""
        return self.thread_wakes * self.wake

    def vertex_ns(self, kind: str, dtype: str) -> float:
        """Return the time of a vertex: "snap", "affine", "transform" or "project"."""
        return float(getattr(self, kind)[DTYPES.index(dtype)])

    def draw_ms(self, group: str, counts: NDArray[np.float64], n_threads: int, *, is_sliced: bool) -> float:
        """Return the time of a draw: each thread has its rows, and sets up all triangles or a share of them."""
        ns: Numbers = getattr(self, f"draw_{group}")
        alone = float((np.array(ns) * counts).sum())
        if n_threads == 1:
            return alone / 1e6
        speedup = 1 + (n_threads - 1) * (self.parallel - 1)
        setup = 0.0 if is_sliced else float(ns[0] * counts[:6].sum())
        return (setup + (alone - setup) / speedup + (n_threads - 1) * self.wake) / 1e6


def sink_group(sink: Sink, sampling: Sampling) -> str:
    """Return which costs a draw has."""
    if sampling is Sampling.AREA:
        return "area"
    if sink is Sink.SAMPLES:
        return "samples"
    if sink in (Sink.PAINT, Sink.NEAREST, Sink.FARTHEST):
        return "depth"
    return "mask" if sink is Sink.MASK else "count"


def draw_features(census: Census, n_pixels: int) -> NDArray[np.float64]:
    """Return how often a draw meets each of `FEATURES`; `census`: of `Scene.count_classes`."""
    n = [one[0] for one in census]
    covered = [one[2] for one in census]
    drawn = [*n[4:9], n[9] + n[10], n[11] + n[12]]
    points, spans = sum(covered[4:6]), sum(covered[6:])
    met = n_pixels * -np.expm1(-(points + spans) / max(1, n_pixels))  # of pixels covered at random
    cold = met * max(0.0, 1 - cost_table().near_pixels / max(1, n_pixels))
    return np.array([sum(n[:4]), *drawn, points, spans, n_pixels, cold], np.float64)


_table: Costs | None = None


def cost_table() -> Costs:
    """Return the costs in use, read once: those measured on this machine, else the shipped ones."""
    return use_costs(load_costs()) if _table is None else _table


def use_costs(costs: Costs) -> Costs:
    """Put costs in use in this process, and return them."""
    global _table
    _table = costs
    return costs


def cache_file() -> Path:
    """Return where the costs of this machine are kept: in ``$XDG_CACHE_HOME``, or ``~/.cache``."""
    folder = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(folder) if os.path.isabs(folder) else Path.home() / ".cache") / "topleft" / "costs.json"


def load_costs() -> Costs:
    """Return the measured costs of this machine, or the shipped ones if there are none that can be used."""
    try:
        if not cache_file().is_file():
            return Costs()
        import json  # few programs need it

        own = json.loads(cache_file().read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError, RuntimeError):  # RuntimeError: nobody's home folder
        return Costs()
    rows = fields(Costs)
    if not (isinstance(own, dict) and own.keys() == {one.name for one in rows}):
        return Costs()
    if not all(is_like(own[one.name], one.default, can_be_zero=one.name in FITTED) for one in rows):
        return Costs()
    values: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in own.items()}
    return Costs(**values)


def is_like(value: Any, shipped: Any, *, can_be_zero: bool) -> bool:
    """Tell whether a file's value has the type and length of the shipped one, and is not far from it."""
    if isinstance(shipped, str):
        return isinstance(value, str)
    if isinstance(shipped, tuple):
        fits = isinstance(value, (list, tuple)) and len(value) == len(shipped)
        return fits and all(is_like(*pair, can_be_zero=can_be_zero) for pair in zip(value, shipped, strict=True))
    if not isinstance(value, (int, float)) or isinstance(value, bool) or not math.isfinite(value):
        return False
    if can_be_zero or shipped == 0:
        return 0 <= value <= 1e12
    return bool(shipped / MOST_TIMES <= value <= shipped * MOST_TIMES)


def save_costs(costs: Costs, path: Path | None = None) -> Path:
    """Write costs to a file, whole or not at all, put them in use, and return the path."""
    import json

    target = cache_file() if path is None else path
    target.parent.mkdir(parents=True, exist_ok=True)
    rows = ",\n".join(f" {json.dumps(name)}: {json.dumps(rounded(value))}" for name, value in asdict(costs).items())
    write_whole(target, lambda file: file.write(f"{{\n{rows}\n}}\n".encode()))
    use_costs(costs)
    return target


def rounded(value: Any) -> Any:
    """Return numbers to six digits: more were never measured."""
    if isinstance(value, tuple):
        return [rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
