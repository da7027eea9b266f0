"""Tables of a record of the smooth scenes, for docs/measured/performance.md, where they stand between markers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.harness.records import Record
from benchmarks.peers import OURS
from benchmarks.report.tables import commit_text, number, table_text
from benchmarks.run.tables import ratio

Run = dict[str, Any]

TASK = "smooth-fill"
SINGLES, SEAMS = "smooth-singles", "smooth-seams"
"""Scenes for pictures that are compared with exact areas."""


def timed_scenes(record: Record) -> list[dict[str, Any]]:
    """Scenes that are there for their times."""
    return [scene for scene in record["scenes"] if scene["task"] == TASK and scene["scene"] not in (SINGLES, SEAMS)]


def find_run(scene: dict[str, Any], name: str) -> Run | None:
    """The contestant's figures, if it took part."""
    return next((run for run in scene["runs"] if run["name"] == name), None)


def facts_text(record: Record) -> str:
    """The origin of the figures, and the missing contestants."""
    machine, options = record["machine"], record["options"]
    runs = {run["peer"]: run for scene in timed_scenes(record) for run in scene["runs"]}
    versions = ", ".join(f"{name} {run['version']}" for name, run in runs.items())
    skipped = {f"{skip['name']}: {skip['reason']}" for scene in timed_scenes(record) for skip in scene["skipped"]}
    text = (
        f"{machine['cpu']}, {machine['system']}, Python {machine['python']}, at {commit_text(record)}, "
        f"{record['date'][:10]}; one thread each, medians of {options['repeats']} rounds with their quartiles, ms. "
        f"{versions}."
    )
    return text + (f" Skipped: {'; '.join(sorted(skipped))}." if skipped else "")


def times_text(record: Record) -> str:
    """A row for each contestant, a column for each scene."""
    scenes = timed_scenes(record)
    names = list(dict.fromkeys(run["name"] for scene in scenes for run in scene["runs"]))
    rows = []
    for name in names:
        runs = [find_run(scene, name) for scene in scenes]
        gives = next(run["gives"] for run in runs if run)
        rows.append([name, gives, *(time_text(run) for run in runs)])
    return table_text(["contestant", "gives", *(column(scene) for scene in scenes)], rows)


def column(scene: dict[str, Any]) -> str:
    """The name of a scene in a table."""
    return scene["scene"].removeprefix("smooth-")


def time_text(run: Run | None) -> str:
    """Median and quartiles."""
    return f"{number(run['median_ms'])} ({number(run['q1_ms'])} to {number(run['q3_ms'])})" if run else "-"


def ratios_text(record: Record) -> str:
    """How many times as long as each of our ways the fastest peer takes, and which that is."""
    scenes = timed_scenes(record)
    ours = list(dict.fromkeys(run["name"] for scene in scenes for run in scene["runs"] if run["peer"] == OURS))
    rows = []
    for name in ours:
        cells = []
        for scene in scenes:
            own, peers = find_run(scene, name), [run for run in scene["runs"] if run["peer"] != OURS]
            best = min(peers, key=lambda run: run["median_ms"], default=None)
            cells.append(f"{ratio(best, own):#.3g} ({best['name']})" if own and best else "-")
        rows.append(["fastest peer over", name, *cells])
    return table_text(["", "", *(column(scene) for scene in scenes)], rows)


def errors_text(record: Record) -> str:
    """Error over partly covered pixels of single triangles, and seams of a mesh."""
    scenes = {scene["scene"]: scene for scene in record["scenes"]}
    names = list(dict.fromkeys(run["name"] for key in (SINGLES, SEAMS) for run in scenes[key]["runs"]))
    rows = []
    for name in names:
        single, seams = (find_run(scenes[key], name) for key in (SINGLES, SEAMS))
        error = (single or {}).get("error") or {}
        seam = (seams or {}).get("error") or {}
        rows.append([
            name,
            (single or seams or {})["gives"],
            f"{error['rms']:.2g}" if error else "-",
            f"{error['worst']:.2g}" if error else "-",
            f"{seam['wrong_px']:,}" + (f" ({255 * seam['darkest']:.0f})" if seam["wrong_px"] else "") if seam else "-",
        ])  # fmt: skip
    return table_text(["contestant", "gives", "RMS error", "largest", "seam pixels (darkest)"], rows)


def if_measured(text: Callable[[Record], str]) -> Callable[[Record], str | None]:
    """The same; None for a record without these scenes."""
    return lambda record: text(record) if timed_scenes(record) else None


PARTS: dict[str, Callable[[Record], str | None]] = {
    "smooth-facts": if_measured(facts_text),
    "smooth-times": if_measured(times_text),
    "smooth-ratios": if_measured(ratios_text),
    "smooth-errors": if_measured(errors_text),
}
"""The parts of the page by their markers `<!-- table: NAME -->`."""
