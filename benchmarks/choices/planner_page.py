"""The plans of docs/measured/planner.md: what `tl.plan` says of two scenes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.harness.arguments import option
from benchmarks.harness.machine import PAGES
from benchmarks.harness.records import Record, Save, write_text
from benchmarks.report.pages import with_parts
from benchmarks.report.study import Study
from topleft.scenes import blob, shape

PAGE = PAGES / "planner.md"
PERSPECTIVE = np.array([[0.6, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, -1, 1], [0, 0, -1, 3]])


def scenes() -> Iterator[tuple[str, tuple[Any, ...], dict[str, Any]]]:
    """Give a title, the arrays and size, and options."""
    size = (1920, 1080)
    yield "A knot in perspective", (*shape("torus-knot"), size), {"transform": PERSPECTIVE, "threads": 1}
    camera = tl.Camera.framing(mesh := tl.Mesh(*blob(1_000_000)), aspect=16 / 9)
    yield "A mesh of a million triangles, drawn again", (mesh, camera, size), {"threads": 1}


def plans_text(record: Record) -> str:
    """A section for each plan."""
    return "\n" + "\n".join(f"## {title}\n\n```\n{plan}\n```\n" for title, plan in record["plans"])


@dataclass(frozen=True)
class PlannerOptions:
    """Where the page goes."""

    out: Path = option(PAGE, "-o --out", type=Path, metavar="PAGE.md")


def run(options: PlannerOptions, _: Save) -> Record:
    """Make the plans, draw them, and write them into the page."""
    plans = [(title, tl.plan(*mesh, **asked).measure().explain()) for title, mesh, asked in scenes()]
    record = {"kind": "planner", "plans": plans}
    write_text(options.out, with_parts(PAGE.read_text(encoding="utf-8"), record, STUDY.parts))
    return record


STUDY = Study(
    "planner", "write the plans of two scenes into their page", PlannerOptions, run,
    lambda record: [plans_text(record)], {"plans": plans_text},
)  # fmt: skip
