"""The tables of a run, printed and in the documentation."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.harness.records import Record
from benchmarks.report.tables import facts_text, left_table, number, table_text

N_EXAMPLES = 2
"""Files that a row of a table of lines names."""

Row = dict[str, Any]


def folders(record: Record) -> dict[str, list[Row]]:
    """The rows of each folder."""
    found: dict[str, list[Row]] = {}
    for row in record["files"]:
        found.setdefault(row["folder"], []).append(row)
    return found


def summary(record: Record) -> str:
    """A row a folder: files, their outcomes, and seconds."""
    rows = []
    every = folders(record)
    for label, of_folder in [*every.items(), *([("all", record["files"])] if len(every) > 1 else [])]:
        drawn = [row for row in of_folder if row["outcome"] == "drawn"]
        seconds = sorted(row["command_s"] for row in drawn)
        rows.append([
            label, f"{len(of_folder):,}", f"{len(drawn):,}", f"{sum(bool(row['line']) for row in drawn):,}",
            *(f"{sum(row['outcome'] == kind for row in of_folder):,}" for kind in ("refused", "crashed")),
            f"{sum(not row['covered'] for row in drawn):,}",
            *([number(median(seconds)), number(seconds[-1])] if seconds else ["", ""]),
        ])  # fmt: skip
    return table_text(
        ["folder", "files", "drawn", "with a warning", "refused", "crashed", "blank", "median s", "longest s"], rows
    )


def lines_of(record: Record, outcome: str) -> str:
    """A row for each kind of line that a command printed, of most files first, with the first of them."""
    kinds: dict[str, list[str]] = {}
    for row in record["files"]:
        if row["outcome"] == outcome:
            for kind in dict.fromkeys(kinds_of(row["line"], row["file"], outcome)):
                kinds.setdefault(kind, []).append(Path(row["file"]).name)
    rows = [
        [f"`{kind}`", str(len(files)), ", ".join(list(dict.fromkeys(files))[:N_EXAMPLES])]
        for kind, files in sorted(kinds.items(), key=lambda entry: (-len(entry[1]), entry[0]))
    ]
    return left_table(["line", "files", "such as"], rows) if rows else "None."


def kinds_of(line: str, file: str, outcome: str) -> Iterator[str]:
    """The parts of a line that are the same from file to file."""
    for part in filter(None, line.split("; ")) if outcome == "drawn" else [line]:
        text = part.replace(repr(Path(file).name), "FILE").replace("`", "'").replace("|", "/")
        if outcome == "drawn":
            yield text.partition(": ")[0] if "extensions not read" not in text else text
        elif text:
            yield re.sub(r"\b\d+\b", "N", re.sub(r"^cannot (read|draw) FILE: ", "", text))[:160]


def lines(record: Record) -> Iterator[str]:
    """The printed lines."""
    yield summary(record)
    for outcome in ("crashed", "refused", "drawn"):
        yield f"\n{outcome}\n"
        yield lines_of(record, outcome)


PARTS = {"folders": summary, "facts": facts_text}
