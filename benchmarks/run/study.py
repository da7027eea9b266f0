"""The study of the cases: who takes part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from benchmarks.harness.arguments import refuse_unknown
from benchmarks.harness.contestants import known_peers
from benchmarks.harness.records import Record, Save
from benchmarks.harness.rounds import RunOptions, run_cases
from benchmarks.report.study import Study
from benchmarks.run import scene_tables, smooth_tables, tables
from benchmarks.scenes.cases import CASES, TRIALS


def run(options: RunOptions, save: Save) -> Record:
    """Measure the cases of the options, checked."""
    import topleft as tl

    available = tl.build_info()["isa_available"]
    refuse_unknown("--isa", options.isas, available)
    refuse_unknown("--peer", options.peers, known_peers())
    isas, scenes = options.isas or available[::-1], find_scenes(options.scenes)
    return run_cases(replace(options, scenes=scenes, isas=isas), save)


def find_scenes(names: Sequence[str]) -> list[str]:
    """Cases by name, or by the beginning of it; all of them for none."""
    if not names:
        return [name for name in CASES if name not in TRIALS]
    found = []
    for name in names:
        matches = [name] if name in CASES else [case for case in CASES if case.startswith(name)]
        if not matches:
            raise ValueError(f"no scene {name!r}; there are {', '.join(CASES)}")
        found += [match for match in matches if match not in found]
    return found


STUDY = Study("run", "measure", RunOptions, run, tables.lines, {**scene_tables.PARTS, **smooth_tables.PARTS})
