"""Tables of a record of `run`: each scene with its contestants, and a summary."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from typing import Any

from benchmarks.report.tables import commit_text, number, table

HEAD = ["contestant", "gives", "median ms", "quartiles", "min of calls", "wrong px", "depth error", "peak MB"]


def lines(record: dict[str, Any]) -> Iterator[str]:
    """The report of one record, Markdown."""
    facts, options = record["machine"], record["options"]
    pin = ", ".join(map(str, options["pin"])) or "none"
    yield f"{facts['cpu']}; {facts['cpus']} CPUs, {facts['system']}, Python {facts['python']}"
    yield (
        f"topleft {record['versions']['topleft']}, checkout at {commit_text(record)}; {record['date']}; "
        f"{options['repeats']} rounds of {options['seconds']} s a turn; pinned to {pin}"
    )
    for scene in record["scenes"]:
        yield ""
        yield from scene_lines(scene)


def scene_lines(scene: dict[str, Any]) -> Iterator[str]:
    """One scene."""
    width, height = scene["size"]
    yield f"## {scene['scene']}"
    yield (
        f"{scene['task']}, {width}x{height}, {scene['n_triangles']:,} triangles, {' + '.join(scene['dtypes'])}, "
        f"cull {scene['cull']}"
    )
    yield ""
    runs = scene["runs"]
    if runs:
        yield from table([*HEAD[:5], f"x {runs[0]['name']}", *HEAD[5:]], [run_cells(run) for run in runs])
    crowded = [f"{run['name']} {run['cpu_share']:.0%}" for run in runs if is_crowded(run)]
    if crowded:
        yield ""
        yield "CPU time over time that passed, the rest went to others on that CPU or to waiting: " + ", ".join(crowded)
    if any(run.get("untimed") for run in runs):
        yield ""
        yield "Not in the time: " + "; ".join(
            f"{run['name']}: {run['untimed']} ({number(run['setup_ms'])} ms)" for run in runs if run.get("untimed")
        )
    if scene["skipped"]:
        yield ""
        yield "Skipped: " + "; ".join(f"{skip['name']}: {skip['reason']}" for skip in scene["skipped"])


def is_crowded(run: dict[str, Any]) -> bool:
    """Whether the contestant had its CPUs for less than 90 % of the time; unknown in old records."""
    share = run.get("cpu_share")
    return share is not None and share < 0.9 * run["threads"]


def ratio(run: dict[str, Any], other: dict[str, Any]) -> float:
    """How many times as long as the other a run takes, median of the rounds."""
    pairs = zip(run["turn_medians_ms"], other["turn_medians_ms"], strict=True)
    return statistics.median(mine / theirs for mine, theirs in pairs)


def run_cells(run: dict[str, Any]) -> list[str]:
    """One row."""
    error = run["error"] or {}
    worst = error.get("max_depth_error")
    peak = run.get("peak_mb")
    return [
        run["name"],
        run["gives"],
        number(run["median_ms"]),
        f"{number(run['q1_ms'])} to {number(run['q3_ms'])}",
        f"{number(run['min_ms'])} of {run['calls']}",
        f"{run['ratio']:.2f}" if run["ratio"] < 100 else f"{run['ratio']:.0f}",
        f"{error['wrong_px']:,}" if error else "",
        "" if worst is None else f"{worst:.2g}",
        "" if peak is None else f"{peak:.0f}",
    ]
