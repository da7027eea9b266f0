"""The atlas: its arguments, and the scenes that it shrinks first failures to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.atlas import measure, shrink, tables
from benchmarks.harness.arguments import Options, names, option
from benchmarks.harness.records import Record, Save, write_text
from benchmarks.report.study import Study


@dataclass(frozen=True)
class AtlasOptions(Options):
    methods: Sequence[str] = names("--method", "rows; all unless given")
    families: Sequence[str] = names("--family", "families of scenes; all unless given")
    scenes: Path | None = option(
        None, "--scenes", "shrink first failures and write them into src/topleft/failure_scenes.json", type=Path,
        metavar="FILE.json",
    )  # fmt: skip


def run(options: AtlasOptions, save: Save) -> Record:
    """Draw and compare, and shrink if wanted."""
    record = measure.run_atlas(options.families, options.methods)
    save(record)
    if options.scenes:
        write_text(options.scenes, shrink.scenes_text(shrink.shrink_all(record)))
    return record


STUDY = Study(
    "atlas", "map where each method fails", AtlasOptions, run, tables.lines, tables.PARTS, "benchmarks.atlas.charts"
)
