"""The atlas: its arguments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.atlas import measure, tables
from benchmarks.harness.arguments import Options, names
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study


@dataclass(frozen=True)
class AtlasOptions(Options):
    methods: Sequence[str] = names("--method", "rows; all unless given")
    families: Sequence[str] = names("--family", "families of scenes; all unless given")


def run(options: AtlasOptions, _: Save) -> Record:
    """Draw and compare."""
    return measure.run_atlas(options.families, options.methods)


STUDY = Study(
    "atlas", "map where each method fails", AtlasOptions, run, tables.lines, tables.PARTS, "benchmarks.atlas.charts"
)
