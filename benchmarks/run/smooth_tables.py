"""Tables of a record of the smooth scenes, for docs/measured/performance.md, where they stand between markers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.harness.records import Record
from benchmarks.report.tables import commit_text, number, table_text

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
        f"{record['date'][:10]}; one thread each, medians of {options['repeats']} rounds, ms. "
        f"{versions}."
    )
    return text + (f" Skipped: {'; '.join(sorted(skipped))}." if skipped else "")


def times_text(record: Record) -> str:
    """A row for each contestant: the time of each scene, the error of single triangles, the seams of a mesh."""
    scenes = timed_scenes(record)
    exact = {scene["scene"]: scene for scene in record["scenes"] if scene["scene"] in (SINGLES, SEAMS)}
    names = list(dict.fromkeys(run["name"] for scene in scenes for run in scene["runs"]))
    rows = []
    for name in names:
        runs = [find_run(scene, name) for scene in scenes]
        gives = next(run["gives"] for run in runs if run)
        single, seams = (error_of(exact.get(key), name) for key in (SINGLES, SEAMS))
        errors = [f"{single['rms']:.2g}" if single else "-", f"{seams['wrong_px']:,}" if seams else "-"]
        rows.append([name, gives, *(number(run["median_ms"]) if run else "-" for run in runs), *errors])
    head = [*(column(scene) for scene in scenes), "RMS error", "seam pixels"]
    return table_text(["contestant", "gives", *head], rows)


def error_of(scene: dict[str, Any] | None, name: str) -> dict[str, Any]:
    """The error of a contestant's picture; nothing if it did not take part."""
    return ((find_run(scene, name) if scene else None) or {}).get("error") or {}


def column(scene: dict[str, Any]) -> str:
    """The name of a scene in a table."""
    return scene["scene"].removeprefix("smooth-")


def if_measured(text: Callable[[Record], str]) -> Callable[[Record], str | None]:
    """The same; None for a record without these scenes."""
    return lambda record: text(record) if timed_scenes(record) else None


PARTS: dict[str, Callable[[Record], str | None]] = {
    "smooth-facts": if_measured(facts_text),
    "smooth-times": if_measured(times_text),
}
"""The parts of the page by their markers `<!-- table: NAME -->`."""
