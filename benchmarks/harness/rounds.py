"""Rounds: the contestants of a case take turns, A B C A B C ..., so that drift of the machine hits all alike."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness.arguments import Options, count, fraction, names, option, pinned
from benchmarks.harness.contestants import Child, Contestant, SkippedError, choose
from benchmarks.harness.errors import Picture, compare, draw_exact
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save, forget, tell
from benchmarks.peers import PEERS
from benchmarks.scenes.cases import CASES, Case, Scene

SCHEMA = 1


@dataclass(frozen=True)
class RunOptions(Options):
    scenes: Sequence[str] = names("--scene", "cases, or beginnings of their names")
    peers: Sequence[str] = names("--peer", "peers; all unless given, none: no names", tuple(PEERS), "*")
    isas: Sequence[str] = names("--isa", "scalar, avx2, avx512; all unless given")
    threads: Sequence[int] = count((1,), "--threads", nargs="+")
    repeats: int = count(9, "--repeats", "rounds")
    seconds: float = fraction(0.1, "--seconds", "length of a turn, at least a call")
    pin: Sequence[int] = pinned()
    check: bool = option(True, "--no-check", "leave the pictures uncompared", action="store_false")


def run_cases(options: RunOptions, save: Save = forget) -> Record:
    """Measure, return the record that the report reads; `save` gets it after each scene, as far as it goes."""
    record: dict[str, Any] = {
        "schema": SCHEMA,
        **describe(),
        "options": {"repeats": options.repeats, "seconds": options.seconds, "pin": list(options.pin)},
        "scenes": [],
    }
    with tempfile.TemporaryDirectory() as folder:
        for name in options.scenes:
            record["scenes"].append(run_case(CASES[name], options, Path(folder)))
            save(record)
    return record


def run_case(case: Case, options: RunOptions, folder: Path) -> Record:
    """All contestants of one case."""
    beside = CASES[case.beside] if case.beside else None
    tell(f"{case.name}: scene")
    scenes = {c.name: c.make() for c in (case, beside) if c}
    for name, scene in scenes.items():
        if not (folder / name).exists():
            scene.save(folder / name)
    contestants, skipped = choose(case, beside, options.peers, options.isas, options.threads)
    children: list[Child] = []
    try:
        for contestant in contestants:
            try:
                children.append(Child.start(contestant, folder / contestant.case.name, options.pin, folder))
                tell(f"{case.name}: {contestant.name} is ready")
            except SkippedError as reason:
                skipped.append({"name": contestant.name, "reason": str(reason)})
                tell(f"{case.name}: {contestant.name} sits out: {reason}")
        for i in range(options.repeats):
            turn_of_each(children, options.seconds, skipped)
            tell(f"{case.name}: round {i + 1} of {options.repeats}")
        errors = check_pictures(children, scenes, folder, skipped) if options.check else {}
        tell(f"{case.name}: pictures compared")
    finally:
        for child in children:
            child.stop()
    scene = scenes[case.name]
    return {
        "scene": case.name,
        "task": case.task,
        "beside": case.beside,
        "size": list(scene.size),
        "n_vertices": len(scene.vertices),
        "n_triangles": len(scene.triangles),
        "dtypes": [str(scene.vertices.dtype), str(scene.triangles.dtype)],
        "cull": scene.cull,
        "runs": [summarize(child, children[0], errors.get(child.contestant.name)) for child in children],
        "skipped": skipped,
    }


def turn_of_each(children: list[Child], seconds: float, skipped: list[dict[str, str]]) -> None:
    """One round: each in turn. Who fails leaves the list."""
    for child in list(children):
        try:
            child.take_turn(seconds)
        except SkippedError as reason:
            skipped.append({"name": child.contestant.name, "reason": str(reason)})
            children.remove(child)
            child.stop()


def check_pictures(
    children: list[Child], scenes: dict[str, Scene], folder: Path, skipped: list[dict[str, str]]
) -> dict[str, Any]:
    """Error of each contestant, by name."""
    exact: dict[str, Picture] = {}
    errors: dict[str, Any] = {}
    for child in children:
        contestant: Contestant = child.contestant
        key = contestant.case.name
        if key not in exact:
            exact[key] = draw_exact(scenes[key])
        if not exact[key]:
            continue
        try:
            picture = child.picture(folder / f"picture-{contestant.name.replace(' ', '-')}")
        except SkippedError as reason:
            skipped.append({"name": f"picture of {contestant.name}", "reason": str(reason)})
            continue
        errors[contestant.name] = compare(picture, exact[key]).as_dict()
    return errors


def summarize(child: Child, first: Child, error: dict[str, Any] | None) -> dict[str, Any]:
    """Figures of one contestant. A turn counts with the median of its calls."""
    medians = np.array([np.median(turn) for turn in child.turns])
    minima = np.array([min(turn) for turn in child.turns])
    base = np.array([np.median(turn) for turn in first.turns])
    contestant = child.contestant
    return {
        "name": contestant.name,
        "peer": contestant.peer,
        "threads": contestant.threads,
        "way": contestant.way,
        "scene": contestant.case.name,
        **child.facts,
        **spread(medians),
        "min_ms": float(minima.min()),
        "calls": sum(map(len, child.turns)),
        "ratio": float(np.median(medians / base)),
        "cpu_share": float(np.median(child.cpu_shares)),
        "turn_medians_ms": medians.round(6).tolist(),
        "turn_minima_ms": minima.round(6).tolist(),
        "error": error,
    }


def spread(values: np.ndarray) -> dict[str, float]:
    """Median and quartiles."""
    low, middle, high = np.percentile(values, [25, 50, 75])
    return {"median_ms": float(middle), "q1_ms": float(low), "q3_ms": float(high)}
