"""Many pictures: views a second of one mesh, shaded, into memory and into PNG files, on one thread and on several.

Contestants take turns in processes of their own, as in `harness/rounds.py`; a call draws all views. Out: a record.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness.arguments import Options, count, names, pinned, refuse_unknown
from benchmarks.harness.contestants import Child, Contestant, SkippedError
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save, tell
from benchmarks.harness.rounds import turn_of_each
from benchmarks.peers import OURS, load_peer, why_not
from benchmarks.report.study import Study
from benchmarks.report.tables import facts_text, table_text
from benchmarks.scenes.cases import Case, views_scene

PEERS = ("llvmpipe", "riley", "deodr", "vtk")
TASKS = ("views", "views-png")


@dataclass(frozen=True)
class BatchOptions(Options):
    peers: Sequence[str] = names("--peer", ", ".join(PEERS), PEERS, "*")
    threads: Sequence[int] = count((1, 2), "--threads", nargs="+")
    n_triangles: int = count(70_000, "--triangles")
    n_views: int = count(100, "--views", "a call")
    frame_px: int = count(512, "--frame", "side", "PX")
    repeats: int = count(5, "--repeats", "rounds")
    pin: Sequence[int] = pinned()


def run(options: BatchOptions, _: Save) -> Record:
    """Measure, return the record that `lines` reads."""
    refuse_unknown("--peer", options.peers, PEERS)
    record: dict[str, Any] = {
        "schema": 1,
        "kind": "batch",
        **describe("pillow"),
        "n_views": options.n_views,
        "n_triangles": options.n_triangles,
        "size": [options.frame_px] * 2,
        "runs": [],
        "skipped": [],
    }
    children: list[Child] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            for contestant in _contestants(options, record["skipped"]):
                scene = folder / contestant.case.name
                if not scene.exists():
                    contestant.case.make().save(scene)
                try:
                    children.append(Child.start(contestant, scene, options.pin, folder))
                    tell(f"{_name(contestant)} is ready")
                except SkippedError as reason:
                    record["skipped"].append({"name": _name(contestant), "reason": str(reason)})
            for i in range(options.repeats):
                turn_of_each(children, 0.0, record["skipped"])
                tell(f"round {i + 1} of {options.repeats}")
            seen = {child.contestant: _seen(child, folder) for child in children}
        finally:
            for child in children:
                child.stop()
    ours = seen[children[0].contestant]
    record["runs"] = [
        _summary(child, children, options.n_views, int((seen[child.contestant] != ours).sum())) for child in children
    ]
    return record


def _contestants(options: BatchOptions, skipped: list[dict[str, str]]) -> Iterator[Contestant]:
    size = options.frame_px, options.frame_px
    for task in TASKS:
        case = Case(task, task, lambda task=task: views_scene(task, options.n_triangles, options.n_views, size))
        for name in (OURS, *options.peers):
            for threads in options.threads:
                contestant = Contestant(name, threads, case)
                reason = why_not(load_peer(name), task, threads)
                if reason is None:
                    yield contestant
                elif not reason.startswith("runs on one"):
                    skipped.append({"name": _name(contestant), "reason": reason})


def _seen(child: Child, folder: Path) -> np.ndarray:
    """Where the last view shows the mesh, bool (H, W)."""
    color = child.picture(folder / f"picture-{_name(child.contestant).replace(' ', '-')}")["color"]
    return (color != 0).any(axis=2)


def _summary(child: Child, children: Sequence[Child], n_views: int, n_different: int) -> dict[str, Any]:
    contestant = child.contestant
    seconds = np.array([np.median(turn) for turn in child.turns]) / 1e3
    alone = next((c for c in children if c.contestant == Contestant(contestant.peer, 1, contestant.case)), child)
    first = next(c for c in children if c.contestant.case.name == contestant.case.name)
    return {
        "name": contestant.peer,
        "task": contestant.case.name,
        "threads": contestant.threads,
        "gives": child.facts["gives"],
        "version": child.facts["version"],
        "views_per_s": float(n_views / np.median(seconds)),
        "best_views_per_s": float(n_views / seconds.min()),
        "ours_is_faster": float(np.median(seconds / [np.median(turn) / 1e3 for turn in first.turns])),
        "over_one_thread": float(np.median([np.median(turn) / 1e3 for turn in alone.turns] / seconds)),
        "cpu_share": float(np.median(child.cpu_shares)),
        "different_px": n_different,
        "turns_s": seconds.round(6).tolist(),
    }


def lines(record: dict[str, Any]) -> Iterator[str]:
    """The table, in Markdown."""
    width, height = record["size"]
    yield f"## {record['n_views']} views of {record['n_triangles']:,} triangles, {width}x{height}, shaded"
    yield ""
    yield facts_text(record)
    yield ""
    yield from views_text(record).splitlines()
    if record["skipped"]:
        yield ""
        yield "Skipped: " + "; ".join(f"{entry['name']}: {entry['reason']}" for entry in record["skipped"])


def views_text(record: Record) -> str:
    """A row for each contestant and number of threads, the fastest first: in memory, and as files."""
    found: dict[tuple[str, int], dict[str, Any]] = {}
    for run in sorted(record["runs"], key=lambda run: -run["views_per_s"]):
        found.setdefault((run["name"], run["threads"]), {})[run["task"]] = run
    rows = []
    for (name, threads), runs in found.items():
        run = next(iter(runs.values()))
        times = (cell for task in TASKS for cell in speed_cells(runs.get(task)))
        rows.append([name, run["gives"], str(threads), *times, f"{run['different_px']:,}"])
    head = ["", "gives", "threads", "views/s", "over one thread", "time over ours on 1"]
    return table_text([*head, "as PNG, views/s", "over one thread", "time over ours on 1", "other outline, px"], rows)


def speed_cells(run: dict[str, Any] | None) -> list[str]:
    """Views a second, the gain over one thread, the time over topleft's on one thread."""
    if run is None:
        return ["-"] * 3
    return [f"{run['views_per_s']:.0f}", f"{run['over_one_thread']:.2f}x", f"{run['ours_is_faster']:.2f}x"]


def _name(contestant: Contestant) -> str:
    return f"{contestant.name} {contestant.case.name}"


PARTS: dict[str, Callable[[Record], str | None]] = {"batch-facts": facts_text, "batch": views_text}
"""The parts of the page by their markers `<!-- table: NAME -->`."""

STUDY = Study("batch", "measure many pictures: views a second, in memory and as PNG", BatchOptions, run, lines, PARTS)
