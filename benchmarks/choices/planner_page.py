"""The plan of docs/measured/planner.md: what `tl.plan` says of a mesh that is drawn again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import topleft as tl
from benchmarks.harness.arguments import option
from benchmarks.harness.machine import PAGES
from benchmarks.harness.records import Record, Save, write_text
from benchmarks.report.pages import with_parts
from benchmarks.report.study import Study
from topleft.scenes import blob

PAGE = PAGES / "planner.md"
"""With the marker of the plan."""


def make_plan() -> tl.Plan:
    """Return the plan of the page."""
    camera = tl.Camera.framing(mesh := tl.Mesh(*blob(1_000_000)), aspect=16 / 9)
    return tl.plan(mesh, camera, (1920, 1080), threads=1)


def plan_text(record: Record) -> str:
    """The plan, as it is printed."""
    return f"```\n{record['plan']}\n```"


@dataclass(frozen=True)
class PlannerOptions:
    """Where the page goes."""

    out: Path = option(PAGE, "-o --out", type=Path, metavar="PAGE.md")


def run(options: PlannerOptions, _: Save) -> Record:
    """Make a plan, draw it, and write it into the page."""
    record = {"kind": "planner", "plan": make_plan().measure().explain()}
    write_text(options.out, with_parts(PAGE.read_text(encoding="utf-8"), record, STUDY.parts))
    return record


STUDY = Study(
    "planner", "write a plan into its page", PlannerOptions, run, lambda record: [plan_text(record)],
    {"plan": plan_text},
)  # fmt: skip
