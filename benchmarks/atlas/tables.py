"""Tables of an atlas, for the terminal and for docs/measured/atlas.md, where they stand between markers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from benchmarks.atlas.depth import DEPTH_FAMILIES
from benchmarks.atlas.measure import SAMPLED
from benchmarks.harness.records import Record
from benchmarks.report.tables import left_table, table_text
from topleft._apps.explore.race import PRODUCTION
from topleft.failure_scenes import FAILURE_SCENES

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


def families_text(record: Record) -> str:
    """The families of scenes."""
    rows = []
    for facts in record["families"]:
        axes = "; ".join(f"{what}: {values[0]} to {values[-1]}" for what, values in facts["axes"].items())
        n = f"{min(facts['n_px']):,} to {max(facts['n_px']):,}"
        rows.append([f"`{facts['name']}`", facts["what"], axes, str(facts["n_scenes"]), n])
    return left_table(["family", "what", "parameter, from mild to harsh", "scenes a step", "pixels"], rows)


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
    return left_table(head, list(cells.values()))


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


def production_text(record: Record) -> str:
    """The errors of the engine on every family: the worst of all steps."""
    rows = []
    for facts in record["families"]:
        for row in (
            row
            for row in record["maps"]
            if row["family"] == facts["name"] and row["entry"] in PRODUCTION and row["entry"] != COARSE
        ):
            steps, wrong = steps_of(facts), row["wrong"]
            worst = max((i for i, n in enumerate(wrong) if n is not None), key=lambda i: wrong[i] / facts["n_px"][i])
            share = f"{percent(wrong[worst], facts['n_px'][worst])}" + (f" at {steps[worst]}" if wrong[worst] else "")
            refused = next((steps[i] for i, n in enumerate(wrong) if n is None), NEVER)
            sums = [str(sum(n for n in row[field] if n)) for field in ("gaps", "overdrawn", "inexact")]
            ulp = f"{max(row['ulp']):.2g}" if "ulp" in row else ""
            rows.append([f"`{facts['name']}`", f"`{row['entry']}`", share, *sums, ulp, refused])
    head = ["family", "method", "wrong, at most", "gaps", "overdrawn", "inexact", "depth, ulp", "refuses from"]
    return table_text(head, merge_walkers(rows))


def merge_walkers(rows: list[list[str]]) -> list[list[str]]:
    """Put methods of the engine with the same figures into one row."""
    result: list[list[str]] = []
    for row in rows:
        same = next((other for other in result if other[0] == row[0] and other[2:] == row[2:]), None)
        if same:
            same[1] += f", {row[1]}"
        else:
            result.append(row)
    return result


def percent(count: int, n: int) -> str:
    """A share of the pixels."""
    share = 100 * count / max(n, 1)
    return "0" if not count else f"{share:.2g} %" if share < 10 else f"{share:.0f} %"


def not_applicable_text(record: Record) -> str:
    """Which rows are missing, and why."""
    reasons: dict[str, list[str]] = {}
    for name, why in record["not_applicable"].items():
        reasons.setdefault(why, []).append(f"`{name}`")
    return "\n".join(f"- {', '.join(names)}: {why}." for why, names in reasons.items())


def scenes_text(_: Record) -> str:
    """The scenes that are kept."""
    rows = []
    for scene in FAILURE_SCENES.values():
        methods = ", ".join(f"`{got.method}`" + ("" if got.subpixel_bits == 8 else f" ({got.subpixel_bits} bits)")
                            for got in scene.got)  # fmt: skip
        rows.append([f"`{scene.name}`", str(len(scene.triangles)), str(scene.subpixel_bits), methods])
    head = ["scene", "triangles", "bits", "who fails"]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


PARTS: dict[str, Callable[[Record], str]] = {
    "families": families_text,
    "first": first_text,
    "production": production_text,
    "not-applicable": not_applicable_text,
    "scenes": scenes_text,
}
"""The parts of the page by their markers `<!-- table: NAME -->`."""
