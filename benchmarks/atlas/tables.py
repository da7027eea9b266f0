"""Tables of an atlas, for the terminal and for docs/measured/atlas.md, where they stand between markers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from benchmarks.atlas.depth import DEPTH_FAMILIES
from benchmarks.atlas.maps import Faults
from benchmarks.atlas.measure import SAMPLED
from benchmarks.harness.records import Record
from benchmarks.report.tables import left_table
from topleft._apps.explore.race import PRODUCTION

Row = dict[str, Any]

NEVER = "-"

COARSE = "auto, 0 bits"
"""Whole pixels: the first table says where it fails; its figures are those of the snap alone."""


def lines(record: Record) -> Iterator[str]:
    """The report of one record, Markdown."""
    for name, make in PARTS.items():
        yield from (f"## {name}", "", make(record), "")


def steps_of(facts: Row) -> list[str]:
    """Return the values of a family as `families.walk` takes them, parameters joined by a comma."""
    names = [""]
    for values in facts["axes"].values():
        names = [f"{head}, {value}" if head else value for head in names for value in values]
    return names


def first_text(record: Record) -> str:
    """Where each method first leaves gaps, overdraws, shows wrong triangles, and refuses."""
    flat = [facts for facts in record["families"] if facts["name"] not in DEPTH_FAMILIES]
    families = [facts for facts in flat if len(facts["axes"]) == 1]
    cells: dict[str, list[str]] = {}
    for facts in families:
        for row in (row for row in record["maps"] if row["family"] == facts["name"]):
            if row["entry"] in [entry.name for entry in SAMPLED]:
                continue
            own = cells.setdefault(row["entry"], [f"`{row['entry']}`"])
            own.append(first_cell(row, steps_of(facts)))
    head = ["method", *(f"`{facts['name']}`" for facts in families)]
    return left_table(head, merge_methods(cells.values()))


def first_cell(row: Row, steps: list[str]) -> str:
    """Gaps, overdraw, wrong pixels, refusal: the first value of each, those that come at once first."""
    found = []
    for field, word in (("gaps", "**gaps**"), ("overdrawn", "overdraws"), ("wrong", "wrong")):
        step = next((i for i, count in enumerate(row[field]) if count), None)
        if step is not None and not (field == "wrong" and found):
            found.append(f"{word} from {steps[step]}" if step else word)
    step = next((i for i, count in enumerate(row["wrong"]) if count is None), None)
    if step is not None:
        found.append(f"refuses from {steps[step]}")
    return ", ".join(found) or NEVER


def merge_methods(rows: Iterable[list[str]]) -> list[list[str]]:
    """Put methods with the same cells into one row."""
    names: dict[tuple[str, ...], list[str]] = {}
    for name, *own in rows:
        names.setdefault(tuple(own), []).append(name)
    return [[", ".join(same), *own] for own, same in names.items()]


def families_text(record: Record) -> str:
    """A row for each family: its parameter, and the worst step of the engine."""
    rows = []
    for facts in record["families"]:
        axes = "; ".join(f"{what}: {values[0]} to {values[-1]}" for what, values in facts["axes"].items())
        names = (facts["name"], "auto")
        row = next((row for row in record["maps"] if (row["family"], row["entry"]) == names), None)
        rows.append([f"`{facts['name']}`", facts["what"], axes, *(engine_cells(row, facts) if row else [NEVER] * 3)])
    head = ["family", "what", "parameter, from mild to harsh", "wrong, at most", "depth, ulp", "refuses from"]
    return left_table(head, rows)


def engine_cells(row: Row, facts: Row) -> list[str]:
    """The largest share of wrong pixels and its step, the largest error of depth, the first step that is refused."""
    steps, wrong = steps_of(facts), row["wrong"]
    worst = max((i for i, n in enumerate(wrong) if n is not None), key=lambda i: wrong[i] / facts["n_px"][i])
    share = percent(wrong[worst], facts["n_px"][worst]) + (f" at {steps[worst]}" if wrong[worst] else "")
    refused = next((steps[i] for i, n in enumerate(wrong) if n is None), NEVER)
    return [share, f"{max(row['ulp']):.2g}" if "ulp" in row else "", refused]


def engine_text(record: Record) -> str:
    """The faults of the production methods but whole pixels, over all families."""
    rows = [row for row in record["maps"] if row["entry"] in PRODUCTION and row["entry"] != COARSE]
    gaps, overdrawn, inexact = (sum(n for row in rows for n in row[key] if n) for key in Faults._fields[1:])
    return (
        f"{', '.join(f'`{name}`' for name in dict.fromkeys(row['entry'] for row in rows))} over all scenes: "
        f"{gaps:,} gaps, {overdrawn:,} pixels drawn more than once, {inexact:,} inexact."
    )


def percent(count: int, n: int) -> str:
    """A share of the pixels."""
    share = 100 * count / max(n, 1)
    return "0" if not count else f"{share:.2g} %" if share < 10 else f"{share:.0f} %"


PARTS: dict[str, Callable[[Record], str]] = {"families": families_text, "engine": engine_text, "first": first_text}
"""The parts of the page by their markers `<!-- table: NAME -->`."""
