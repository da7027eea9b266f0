"""Plans: estimated beside measured time, the time of `tl.plan`, and the time that drawing with one saves."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.choices.measure import ChoiceOptions, chosen_scenes, with_rows
from benchmarks.choices.scenes import Scene
from benchmarks.choices.ways import drawing, picture_of, verb_of
from benchmarks.harness.turns import digits
from benchmarks.harness.ways import Way, take_rounds

PLANNED = ("mesh 1k", "mesh 10k", "mesh 100k", "mesh 100k float64 int64", "mesh 1M", "one large", "ten in 64x64")
"""Scenes for timing plans."""

OUTPUTS = {"rasterize": ("triangle", "depth"), "coverage": ("coverage",), "overdraw": ("overdraw",), "fill": ("color",)}


def plan_of(scene: Scene, **changes: Any) -> tl.Plan:
    """Return the plan of a scene."""
    return tl.plan(*scene.arrays, scene.size, outputs=OUTPUTS[scene.verb], **scene.asked(**changes))


def run_plans(options: ChoiceOptions, record: dict[str, Any] | None) -> dict[str, Any]:
    """Return a record with estimates and plans measured anew."""
    return with_rows(record, []) | {"estimates": measure_estimates(options), "plans": measure_plans(options)}


def measure_estimates(options: ChoiceOptions) -> list[dict[str, Any]]:
    """Return estimated and measured milliseconds of every scene, on memory that is kept."""
    rows = []
    for scene in chosen_scenes(options):
        plan = plan_of(scene)
        [took] = take_rounds([Way("", drawing(scene))], options.rounds, options.seconds, time.thread_time)
        rows.append(
            {"scene": scene.name, "kind": scene.kind, "verb": scene.verb, "sampling": scene.sampling,
             "estimated_ms": digits(plan.estimated_ms), "measured_ms": digits(np.median(took))}
        )  # fmt: skip
    return rows


def measure_plans(options: ChoiceOptions) -> list[dict[str, Any]]:
    """Return the time of a plan, and of `rasterize` with it and without, for some scenes and both widths of indices."""
    rows = []
    for scene in chosen_scenes(options):
        if scene.name not in PLANNED or (scene.verb, scene.sampling) != ("rasterize", "center"):
            continue
        for dtype in (np.int32, np.int64):
            vertices, triangles = scene.arrays[0], scene.arrays[1].astype(dtype)
            asked = scene.asked()
            plan = tl.plan(vertices, triangles, scene.size, **asked)
            picture = picture_of(tl, scene.size)
            ways = [
                Way("without", verb_of(scene, picture, vertices, triangles, (), asked)),
                Way("with", verb_of(scene, picture, vertices, triangles, (), asked | {"plan": plan})),
                Way("plan", lambda v=vertices, t=triangles, s=scene: (tl.plan(v, t, s.size, **s.asked()),)),  # type: ignore[misc]
            ]
            took = take_rounds(ways, options.rounds, options.seconds, time.thread_time, hopeless=np.inf)
            without, with_plan, planning = (digits(np.median(some)) for some in took)
            rows.append(
                {"scene": scene.name, "n_triangles": len(triangles), "indices": np.dtype(dtype).name,
                 "plan_ms": planning, "without_ms": without, "with_ms": with_plan,
                 "saves_us": digits(1e3 * np.median(took[0] - took[1]))}
            )  # fmt: skip
    return rows
