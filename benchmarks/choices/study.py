"""The study of choices: its two halves."""

from __future__ import annotations

from benchmarks.choices import measure, plans, tables
from benchmarks.harness.records import Record, Save, read_record
from benchmarks.report.study import Study


def run(options: measure.ChoiceOptions, save: Save) -> Record:
    """Measure the ways to draw, or plans; rows of the record that are not measured stay."""
    old = read_record(options.record)
    return plans.run_plans(options, old) if options.plans else measure.run_choices(options, old, save)


STUDY = Study(
    "choices", "measure the planner's choices beside their alternatives", measure.ChoiceOptions, run, tables.lines,
    tables.PARTS, "benchmarks.choices.charts",
)  # fmt: skip
