"""Chart (f): pictures a second of the eleven triangles that tutorials draw, 640x400, by method and pure twin.

Out: `tutorial` of a record. A picture is a call: checks, clear, eleven triangles. For the fills alone the triangles are
drawn many times over in one call, and what the call takes longer than that for one picture is divided by the copies.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from benchmarks.accuracy import pure
from benchmarks.accuracy.options import AccuracyOptions
from benchmarks.accuracy.sizes import DEFAULT_BITS
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.scenes.families import Entry, Triangles, entries

COPIES = 100
CLOCK_MS = 1e-6
"""The resolution of clocks."""
QUOTED = {"bresenham_scanline": 520, "point_in_triangle": 480}
"""Pictures a second, as one tutorial reports them; its window's call that sets a point takes most of that time."""


def eleven_triangles(copies: int = 1) -> Triangles:
    """Return the tutorials' scenes of one triangle as one scene, drawn so many times over."""
    from topleft.scenes import TUTORIAL_SCENES

    scenes = [scene for make in TUTORIAL_SCENES.values() if len((scene := make())[1]) == 1]
    vertices = np.concatenate([vertices for vertices, _ in scenes])
    triangles = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    return vertices, np.tile(triangles, (copies, 1))


def measure_tutorial(options: AccuracyOptions) -> dict[str, Any]:
    """Return `tutorial`: a row for each method and each pure twin."""
    import topleft as tl
    from topleft.scenes import TUTORIAL_SIZE

    rasterizer = tl.Rasterizer(TUTORIAL_SIZE, threads=1)
    copies = max(20, int(COPIES * options.scale))
    chosen = [entry for entry in entries(options.methods) if entry.bits in (None, DEFAULT_BITS)]

    def call(entry: Entry, n: int) -> partial[Any]:
        return partial(rasterizer.coverage, *entry.orient(eleven_triangles(n)), **entry.options())

    turns = [turn_of(call(entry, n)) for entry in chosen for n in (1, copies)]
    times = take_turns(turns, options.rounds, options.seconds)
    rows = []
    for entry, one, many in zip(chosen, times[::2], times[1::2], strict=True):
        fill_ms = float(np.median(many - one)) / (copies - 1)
        rows.append({"method": entry.method, "precision": entry.precision, "is_pure": False}
                    | per_second(float(np.median(one)), fill_ms))  # fmt: skip
    for twin in (twin for twin in pure.TWINS if twin.entry in chosen):
        ms = float(np.median(pure.times_ms(twin, eleven_triangles(), TUTORIAL_SIZE, options.rounds)))
        rows.append({"method": twin.name, "precision": twin.entry.precision, "is_pure": True} | per_second(ms, ms))
    return {"tutorial": rows}


def per_second(call_ms: float, fill_ms: float) -> dict[str, float]:
    """Pictures a second: by calls, and by fills alone; their difference may be lost in the noise."""
    fill_ms = max(fill_ms, CLOCK_MS)
    return {"calls": float(f"{1e3 / call_ms:.3g}"), "fills": float(f"{1e3 / fill_ms:.3g}")}
