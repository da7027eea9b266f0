"""The study of choices: ways to draw."""

from __future__ import annotations

from benchmarks.choices import measure, tables
from benchmarks.harness.records import Record, Save, read_record
from benchmarks.report.study import Study


def run(options: measure.ChoiceOptions, save: Save) -> Record:
    """Measure the ways to draw; rows of the record that are not measured stay."""
    return measure.run_choices(options, read_record(options.record), save)


STUDY = Study(
    "choices", "measure the planner's choices beside their alternatives", measure.ChoiceOptions, run, tables.lines,
    tables.PARTS, "benchmarks.choices.charts",
)  # fmt: skip
