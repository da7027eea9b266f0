"""The study of choices: its arguments, and which of its two halves is measured."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.choices import measure, plans, tables
from benchmarks.harness.arguments import add_names, add_number, add_out, add_scale, options_of, set_options
from benchmarks.harness.records import Record, Save, read_record
from benchmarks.report.study import Study


def add_arguments(parser: argparse.ArgumentParser) -> None:
    set_options(parser, measure.Options())
    add_names(parser, "--choice", "choices", "measure these alone; all unless given")
    add_names(parser, "--scene", "scenes", "scenes, or beginnings of their names")
    parser.add_argument("--plans", action="store_true", help="measure estimates and plans alone")
    parser.add_argument("--builds", type=Path, metavar="FOLDER",
                        help="build the library with other constants there unless it is, and measure it")  # fmt: skip
    add_number(parser, "--repeats", "rounds", "rounds")
    add_scale(parser)
    add_out(parser, "rows in it that are not measured stay")


def run(arguments: argparse.Namespace, save: Save) -> Record:
    """Measure the ways to draw, or plans."""
    options, old = options_of(measure.Options, arguments), read_record(arguments.record)
    return plans.run_plans(options, old) if arguments.plans else measure.run_choices(options, old, save)


STUDY = Study(
    "choices", "measure the planner's choices beside their alternatives", add_arguments, run, tables.lines,
    tables.PARTS, "benchmarks.choices.charts",
)  # fmt: skip
