"""What things cost on a machine, fitted to measurements, and estimates of scenes from it.

In: a JSON file, the one in the user's cache folder if `topleft calibrate` has written it, else the one that ships.
Out: milliseconds. Nothing that is drawn depends on it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft._core.base.options import Sampling, Sink
from topleft._core.base.whole_file import write_whole
from topleft._core.raster.choices import NEAR_PIXELS

#: What the time of a draw is made of, in this order: triangles by how they are drawn, samples, pixels of the picture.
FEATURES = (
    "hidden", "tiny", "small", "middle", "rows", "long", "64-bit", "128-bit", "point", "span", "pixel", "cold",
)  # fmt: skip

Census = Sequence[tuple[int, float, float]]


@dataclass(frozen=True, slots=True)
class Costs:
    """Nanoseconds per thing on one machine.

    Attributes
    ----------
    machine, isa, date : str
        Where and when they were measured.
    call : dict
        Per call of a verb.
    vertex : dict
        Per vertex, by what is done with it.
    draw : dict of dict
        Per thing of `FEATURES`, by what happens to a covered sample.
    other : dict
        index: a triangle converted to int32; clip, beyond: a triangle outside of a clip plane, before and in the draw;
        paint: a pixel of `fill`; flat: a pixel of depth without a test; wake: another thread; touch: a byte of fresh
        memory.
    parallel : float
        How much faster two threads draw than one, 2 at best.
    residual : dict
        Of estimates of scenes that were not fitted: median and largest ratio of estimate and measurement, either way.
    """

    machine: str
    isa: str
    date: str
    call: Mapping[str, float]
    vertex: Mapping[str, float]
    draw: Mapping[str, Mapping[str, float]]
    other: Mapping[str, float]
    parallel: float
    residual: Mapping[str, float]

    @property
    def source(self) -> str:
        """Say where the numbers come from and how far off they are."""
        median = self.residual["median"]
        return f"{self.machine}, {self.isa}, {self.date}; half of all estimates within {100 * (median - 1):.0f} %"

    def draw_ms(self, group: str, counts: NDArray[np.float64], n_threads: int, *, is_shared: bool) -> float:
        """Return the time of a draw: each thread has its rows, and sets up all triangles or a share of them."""
        ns = np.array([self.draw[group][name] for name in FEATURES])
        alone = float(ns @ counts)
        if n_threads == 1:
            return alone / 1e6
        speedup = 1 + (n_threads - 1) * (self.parallel - 1)
        setup = 0.0 if is_shared else float(self.draw[group]["hidden"] * counts[:6].sum())
        return (setup + (alone - setup) / speedup + (n_threads - 1) * self.other["wake"]) / 1e6


def sink_group(sink: Sink, sampling: Sampling) -> str:
    """Return which costs a draw has."""
    if sampling is Sampling.AREA:
        return "area"
    if sink is Sink.SAMPLES:
        return "samples"
    if sink in (Sink.PAINT, Sink.NEAREST, Sink.FARTHEST):
        return "depth"
    return "mask" if sink is Sink.MASK else "count"


def features(census: Census, n_pixels: int) -> NDArray[np.float64]:
    """Return how often a draw meets each of `FEATURES`; `census`: of `Scene.count_classes`."""
    n = [row[0] for row in census]
    covered = [row[2] for row in census]
    drawn = [*n[4:9], n[9] + n[10], n[11] + n[12]]
    points, spans = sum(covered[4:6]), sum(covered[6:])
    met = n_pixels * -np.expm1(-(points + spans) / max(1, n_pixels))  # of pixels covered at random
    cold = met * max(0.0, 1 - NEAR_PIXELS / max(1, n_pixels))
    return np.array([sum(n[:4]), *drawn, points, spans, n_pixels, cold], np.float64)


def cache_file() -> Path:
    """Return where the costs of this machine are kept: in ``$XDG_CACHE_HOME``, or ``~/.cache``."""
    folder = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(folder) if os.path.isabs(folder) else Path.home() / ".cache") / "topleft" / "costs.json"


def load_costs() -> Costs:
    """Return the costs of this machine, or those that ship if none, or none that can be read, have been measured."""
    import json  # what few programs need is not imported with topleft

    shipped = json.loads(Path(__file__).with_name("costs.json").read_text(encoding="utf-8"))
    try:
        own = json.loads(cache_file().read_text(encoding="utf-8")) if cache_file().is_file() else None
    except (OSError, ValueError, RecursionError):
        own = None
    return Costs(**(own if own is not None and is_like(own, shipped) else shipped))


def is_like(value: Any, shipped: Any) -> bool:
    """Tell whether what a file says has the names of what ships, with words and finite numbers in the same places."""
    if isinstance(shipped, dict):
        same_names = isinstance(value, dict) and value.keys() == shipped.keys()
        return same_names and all(is_like(value[name], shipped[name]) for name in shipped)
    if isinstance(shipped, str):
        return isinstance(value, str)
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def save_costs(costs: Costs, path: Path | None = None) -> Path:
    """Write costs to a file, whole or not at all, and return its path."""
    import json

    target = cache_file() if path is None else path
    target.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(rounded(asdict(costs)), indent=1) + "\n"
    write_whole(target, lambda file: file.write(text.encode()))
    return target


def rounded(value: Any) -> Any:
    """Return numbers to four digits: more were never measured."""
    if isinstance(value, dict):
        return {name: rounded(item) for name, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value
