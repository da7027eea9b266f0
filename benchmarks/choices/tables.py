"""Tables of a record of choices, for the terminal and, between markers, for docs/measured/choices.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from benchmarks.harness.records import Record
from benchmarks.report.tables import facts_text, table_text

Row = dict[str, Any]

NEAR, FAR = 1.15, 1.5
"""The limits of the mean over scenes, and of any scene."""

N_MISSES = 10
"""Scenes that the table of misses names, the worst first."""


def lines(record: Record) -> Iterator[str]:
    """The report of one record, Markdown."""
    yield facts_text(record)
    for name, text in PARTS.items():
        if name != "choice-facts":
            yield from ("", text(record))


def by_choice(record: Record) -> dict[str, list[Row]]:
    """Return the rows of each choice, in their order."""
    found: dict[str, list[Row]] = {}
    for row in record["rows"]:
        found.setdefault(row["choice"], []).append(row)
    return found


def mean(rows: list[Row]) -> float:
    """Return the mean ratio."""
    return sum(row["ratio"] for row in rows) / len(rows)


def summary_text(record: Record) -> str:
    """A row for each choice: how far from the best way, over all scenes and at worst."""
    rows = []
    for choice, own in by_choice(record).items():
        worst = max(own, key=lambda row: row["ratio"])
        gains = [1 / other["chosen_by_other"][1] for row in own for other in row["others"]]
        rows.append(
            [choice, ", ".join(dict.fromkeys(row["chosen"] for row in own)), ways_text(own), str(len(own)),
             f"{mean(own):.2f}",
             f"{worst['ratio']:.2f}", f"{label_of(worst)}" if worst["ratio"] > 1.02 else "-", f"{max(gains):.1f}"]
        )  # fmt: skip
    head = ["choice", "chosen", "against", "scenes", "mean", "worst", "where", "saves up to"]
    return table_text(head, rows)


def ways_text(rows: list[Row]) -> str:
    """Name the ways that were not chosen."""
    return ", ".join(dict.fromkeys(other["way"] for row in rows for other in row["others"]))


def label_of(row: Row) -> str:
    """Name a scene and its call."""
    return f"{row['scene']}, {asked_of(row)}"


def asked_of(row: Row) -> str:
    """Name the call of a scene."""
    return str(row["verb"]) if row["sampling"] == "center" else f"{row['verb']} {row['sampling']}"


def misses_text(record: Record) -> str:
    """The scenes in which another way takes a sixth less time or more."""
    rows = [
        [row["choice"], label_of(row), row["chosen"], best["way"], f"{row['ms'][1]:.3g}", f"{best['ms']:.3g}",
         f"{row['ratio']:.2f}", "{:.2f} to {:.2f}".format(*best["chosen_by_other"][::2])]
        for row in sorted(record["rows"], key=lambda row: -row["ratio"])
        if row["ratio"] > NEAR
        for best in [max(row["others"], key=lambda other: other["chosen_by_other"][1])]
    ]  # fmt: skip
    if not rows:
        return f"No way is {NEAR} times as fast as the chosen one in any scene."
    head = ["choice", "scene", "chosen", "best", "ms", "best ms", "ratio", "quartiles"]
    more = f"\n\n{n_more} more, of {len(record['rows']):,} rows." if (n_more := len(rows) - N_MISSES) > 0 else ""
    return table_text(head, rows[:N_MISSES]) + more


PARTS: Mapping[str, Callable[[Record], str]] = {
    "choice-facts": facts_text,
    "choice-summary": summary_text,
    "choice-misses": misses_text,
}
"""The parts of the page by their markers."""
