"""The study of polygons: every painter in turns on each case, one process, with its wrong pixels beside the time.

The right result is by topleft's scalar kernels in another way (a polygon at a time, the mask of each one), which the
tests hold against integers; of areas, from the table of the scalar kernels. A pixel is wrong where an area is off by
more than 1e-6.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.harness.arguments import Options, count, fraction, names, option, refuse_unknown
from benchmarks.harness.machine import describe, version_of
from benchmarks.harness.records import Record, Save, tell
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.polygons.cases import CASES, PolygonCase
from benchmarks.polygons.painters import PAINTERS
from benchmarks.report.study import Study

CLOCKS = {"wall": time.perf_counter, "cpu": time.process_time}


@dataclass(frozen=True)
class PolygonOptions(Options):
    cases: Sequence[str] = names("--case", f"of {', '.join(CASES)}", tuple(CASES))
    painters: Sequence[str] = names("--painter", f"of {', '.join(PAINTERS)}", tuple(PAINTERS))
    threads: int = count(1, "--threads", "of those that can use them")
    repeats: int = count(7, "--repeats", "rounds")
    seconds: float = fraction(0.05, "--seconds", "how long a turn is, at least a call")
    slow_s: float = fraction(1.0, "--slow", "calls that take longer are timed once, and take no turns")
    clock: str = option("wall", "--clock", "cpu is the time of the process", choices=tuple(CLOCKS))


def run(options: PolygonOptions, save: Save) -> Record:
    """Measure milliseconds of each call, in turns."""
    refuse_unknown("case", options.cases, CASES)
    refuse_unknown("painter", options.painters, PAINTERS)
    record: Record = {"kind": "polygons"} | describe() | {"threads": options.threads, "clock": options.clock}
    record |= {"rows": [], "skipped": []}
    for name in options.cases:
        measure(CASES[name], options, record)
        save(record)
    return record


def measure(case: PolygonCase, options: PolygonOptions, record: Record) -> None:
    """Add the rows of one case."""
    polygons = case.make(case.size)
    right = right_picture(polygons, case)
    calls, clock = {}, CLOCKS[options.clock]
    for name in options.painters:
        painter = PAINTERS[name]
        if case.task not in painter.n_lines or len(polygons[0][0]) > painter.most_corners:
            continue
        try:
            calls[name] = painter.prepare(polygons, case.size, case.task, options.threads)
            start = clock()
            made = calls[name]()
            took = clock() - start
            if took > options.slow_s:  # the first call may be slow for other reasons
                start = clock()
                made = calls[name]()
                took = min(took, clock() - start)
            wrong, worst = errors(made, right, case)
        except ImportError as error:
            record["skipped"].append({"case": case.name, "painter": name, "reason": str(error)})
            continue
        record["rows"].append(
            {
                "case": case.name,
                "painter": name,
                "version": version_of(painter.package),
                "lines": painter.n_lines[case.task],
                "wrong_px": wrong,
                "worst": worst,
                "ms": [round(1e3 * took, 5)],
            }
        )
        if took > options.slow_s:
            del calls[name]
        tell(f"{case.name}: {name} is ready")
    turns = [turn_of(call, clock) for call in calls.values()]
    for name, times in zip(calls, take_turns(turns, options.repeats, options.seconds), strict=True):
        (row,) = (row for row in record["rows"] if (row["case"], row["painter"]) == (case.name, name))
        row["ms"] = [round(float(t), 5) for t in times]


def right_picture(polygons: list[list[Any]], case: PolygonCase) -> Any:
    """Return the expected result."""
    import topleft as tl
    from topleft._core import engine

    before = engine.isa_in_use()
    engine.use_isa("scalar")
    try:
        if case.task == "table":
            table = tl.overlap(polygons, case.size, threads=1)
            return table.pixels, table.areas, table.starts
        if case.task == "area":
            (one,) = polygons
            return tl.polygons(one, case.size, sampling="area", threads=1)
        if case.task == "mask":
            (one,) = polygons
            return tl.polygons(one, case.size, threads=1)
        return tl.polygons(polygons, case.size, values="index", threads=1)
    finally:
        engine.use_isa(before)


def errors(made: Any, right: Any, case: PolygonCase) -> tuple[int, float]:
    """Return how many pixels, or entries of a table, are wrong, and by how much an area is off at most."""
    if case.task in ("mask", "labels"):
        return int((np.asarray(made) != right).sum()), 0.0
    if case.task == "area":
        off = abs(np.asarray(made, float) - right)
        return int((off > 1e-6).sum()), float(off.max())
    n = case.size[0] * case.size[1]

    def keyed(table: Any) -> tuple[np.ndarray, np.ndarray]:
        pixels, areas, starts = table
        keys = np.repeat(np.arange(len(starts) - 1), np.diff(starts)) * n + np.asarray(pixels, np.int64)
        order = np.argsort(keys, kind="stable")
        return keys[order], np.asarray(areas, float)[order]

    (keys, areas), (others, expected) = keyed(made), keyed(right)
    every = np.union1d(keys, others)
    off = np.zeros(len(every))
    off[np.searchsorted(every, keys)] += areas
    off[np.searchsorted(every, others)] -= expected
    return int((abs(off) > 1e-6).sum()), float(abs(off).max(initial=0))


def table(record: Record) -> Iterator[str]:
    """The rows in Markdown."""
    yield "| | | ms, median | shortest | quartiles | times topleft | wrong pixels | lines |"
    yield "|---|---|---|---|---|---|---|---|"
    last = None
    for row in record["rows"]:
        title = CASES[row["case"]].title if row["case"] != last else ""
        last = row["case"]
        ours = next(r for r in record["rows"] if r["case"] == row["case"])
        times = np.array(row["ms"])
        own = np.array(ours["ms"])
        ratio = float(np.median(times / own) if len(times) == len(own) else np.median(times) / np.median(own))
        low, high = np.quantile(times, [0.25, 0.75])
        wrong = f"{row['wrong_px']:,}" + (f" (at most {row['worst']:.0e})" if row["worst"] else "")
        yield (
            f"| {title} | {row['painter']} | {np.median(times):.3g} | {times.min():.3g} | {low:.3g} to {high:.3g} "
            f"| {ratio:.3g} | {wrong} | {row['lines']} |"
        )


def lines(record: Record) -> Iterator[str]:
    """The printed lines: machine, instruction set, threads, and the table."""
    yield facts(record)
    yield ""
    yield from table(record)
    for row in record["skipped"]:
        print(f"{row['case']}: {row['painter']} was skipped: {row['reason']}", file=sys.stderr)


def facts(record: Record) -> str:
    """The machine, in a line."""
    versions = {row["painter"]: row["version"] for row in record["rows"]}
    clock = record.get("clock", "wall")
    return (
        f"{record['machine']['cpu']}; {record['isa']}; {record['threads']} thread(s), {clock} time; {record['date']}; "
        f"commit {record['commit']}. " + ", ".join(f"{name} {version}" for name, version in versions.items()) + "."
    )


STUDY = Study(
    "polygons",
    "time masks, labels and areas of polygons beside other programs",
    PolygonOptions,
    run,
    lines,
    parts={"polygons": lambda record: "\n".join(table(record)), "polygons-facts": facts},
)
