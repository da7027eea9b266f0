"""The study of choices: ways to draw, and estimates of plans."""

from __future__ import annotations

from benchmarks.choices import measure, tables
from benchmarks.harness.records import Record, Save, read_record
from benchmarks.report.study import Study


def run(options: measure.ChoiceOptions, save: Save) -> Record:
    """Measure the ways to draw, or estimates; rows of the record that are not measured stay."""
    old = read_record(options.record)
    return measure.measure_estimates(options, old) if options.plans else measure.run_choices(options, old, save)


STUDY = Study(
    "choices", "measure the planner's choices beside their alternatives", measure.ChoiceOptions, run, tables.lines,
    tables.PARTS, "benchmarks.choices.charts",
)  # fmt: skip
