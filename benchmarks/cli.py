"""Commands: `python -m benchmarks run`, `accuracy`, `atlas` and the other studies, `report`, `charts`, `document`."""

from __future__ import annotations

import argparse
import functools
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.accuracy.study import STUDY as ACCURACY
from benchmarks.atlas.study import STUDY as ATLAS
from benchmarks.choices.planner_page import STUDY as PLANNER
from benchmarks.choices.study import STUDY as CHOICES
from benchmarks.harness.arguments import add_options, options_of
from benchmarks.harness.machine import IMAGES
from benchmarks.harness.records import Record, forget, write_record, write_text
from benchmarks.lanes.study import STUDY as LANES
from benchmarks.levels.study import STUDY as LEVELS
from benchmarks.peers import PEERS
from benchmarks.pictures.study import STUDY as PICTURES
from benchmarks.polygons.study import STUDY as POLYGONS
from benchmarks.real_files.study import STUDY as REAL_FILES
from benchmarks.report.everything import measure_all
from benchmarks.report.pages import with_parts
from benchmarks.report.study import Study
from benchmarks.run.study import STUDY as RUN
from benchmarks.scenes.cases import CASES
from benchmarks.small.batch import STUDY as BATCH
from benchmarks.small.clients import STUDY as CLIENTS
from benchmarks.small.gate import STUDY as GATE
from benchmarks.small.instances import STUDY as INSTANCES
from benchmarks.small.pairs import STUDIES as PAIRS
from benchmarks.small.samplings import STUDY as SAMPLINGS
from benchmarks.small.tiles import STUDY as TILES
from benchmarks.static.study import STUDY as STATIC

STUDIES = {
    study.kind: study
    for study in (
        RUN, ACCURACY, BATCH, ATLAS, CHOICES, STATIC, PICTURES, LEVELS, SAMPLINGS, PLANNER, POLYGONS,
        REAL_FILES, LANES, GATE, TILES, CLIENTS, INSTANCES, *PAIRS,
    )
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the exit status."""
    options = parser().parse_args(arguments)
    try:
        options.action(options)
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2
    return 0


def parser() -> argparse.ArgumentParser:
    """The arguments."""
    root = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    commands = root.add_subparsers(required=True, metavar="COMMAND")
    for study in STUDIES.values():
        add = commands.add_parser(study.kind, help=study.help)
        add.set_defaults(action=functools.partial(measure, study))
        add_options(add, study.options)

    add = commands.add_parser("all", help="measure all records of the pages anew, and write tables and charts: hours")
    add.set_defaults(action=lambda options: measure_all(options.out, lambda kind: STUDIES[kind].charts is not None))
    add.add_argument("-o", "--out", type=Path, metavar="FOLDER", help="what it has is kept (build/records-COMMIT)")

    add = commands.add_parser("report", help="print tables again")
    add.set_defaults(action=report)
    add.add_argument("files", nargs="+", type=Path, metavar="FILE.json")

    with_charts = ", ".join(study.kind for study in STUDIES.values() if study.charts)
    add = commands.add_parser("charts", help=f"draw the charts of a record of {with_charts}")
    add.set_defaults(action=charts)
    add.add_argument("file", type=Path, metavar="FILE.json")
    add.add_argument("-o", "--out", type=Path, default=IMAGES, metavar="FOLDER")

    add = commands.add_parser("document", help="write the tables of a record into its page")
    add.set_defaults(action=document)
    add.add_argument("file", type=Path, metavar="FILE.json")
    add.add_argument("page", type=Path, metavar="PAGE.md")

    commands.add_parser("list", help="cases and peers").set_defaults(action=print_names)
    return root


def study_of(record: Record) -> Study:
    """Return the study that a record is of; those of `run` do not say."""
    return STUDIES[record.get("kind", RUN.kind)]


def parts_of(record: Record) -> dict[str, Callable[[Record], str | None]]:
    """Return the parts of a page by their markers; those of other studies stay."""
    return {name: lambda _: None for study in STUDIES.values() for name in study.parts} | dict(study_of(record).parts)


def measure(study: Study, arguments: argparse.Namespace) -> None:
    """Measure, write, print."""
    out = getattr(arguments, "record", None)
    save = functools.partial(write_record, out) if out else forget
    record = study.run(options_of(study.options, arguments), save)
    save(record)
    print(*study.lines(record), sep="\n")


def report(arguments: argparse.Namespace) -> None:
    """Print tables of records."""
    for path in arguments.files:
        record = json.loads(path.read_text())
        print(*study_of(record).lines(record), sep="\n")


def charts(arguments: argparse.Namespace) -> None:
    """Draw."""
    record = json.loads(arguments.file.read_text())
    print(*study_of(record).draw_charts(record, arguments.out), sep="\n")


def document(arguments: argparse.Namespace) -> None:
    """Replace the text between the markers of a page."""
    record = json.loads(arguments.file.read_text())
    text = arguments.page.read_text(encoding="utf-8")
    write_text(arguments.page, with_parts(text, record, parts_of(record)))


def print_names(_: argparse.Namespace) -> None:
    """Print the lists of cases and peers."""
    for name, case in CASES.items():
        print(f"{name:22} {case.task}")
    for name, what in PEERS.items():
        print(f"{name:22} {what}")
