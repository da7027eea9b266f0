"""The atlas: its arguments, and the scenes that it shrinks first failures to."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.atlas import measure, shrink, tables
from benchmarks.harness.arguments import add_names, add_out
from benchmarks.harness.records import Record, Save, write_text
from benchmarks.report.study import Study


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(methods=[], families=[])
    add_names(parser, "--method", "methods", "rows; all unless given")
    add_names(parser, "--family", "families", "families of scenes; all unless given")
    parser.add_argument("--scenes", type=Path, metavar="FILE.json",
                        help="shrink first failures and write them into src/topleft/failure_scenes.json")  # fmt: skip
    add_out(parser)


def run(arguments: argparse.Namespace, save: Save) -> Record:
    """Draw and compare, and shrink if wanted."""
    record = measure.run_atlas(arguments.families, arguments.methods)
    save(record)
    if arguments.scenes:
        write_text(arguments.scenes, shrink.scenes_text(shrink.shrink_all(record)))
    return record


STUDY = Study(
    "atlas", "map where each method fails", add_arguments, run, tables.lines, tables.PARTS, "benchmarks.atlas.charts"
)
