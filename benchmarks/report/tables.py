"""Markdown: tables, numbers, and the origin of figures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def number(value: float) -> str:
    """Three digits that count."""
    if value >= 100:
        return f"{value:,.0f}"
    return f"{value:.3g}" if value < 0.0995 else f"{value:.3f}" if value < 1 else f"{value:#.3g}"


def table(head: list[str], rows: list[list[str]]) -> Iterator[str]:
    """A Markdown table with columns in line; all but the first two to the right."""
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]

    def row_text(row: list[str]) -> str:
        cells = [
            cell.ljust(width) if i < 2 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        return "| " + " | ".join(cells) + " |"

    yield row_text(head)
    yield "|" + "|".join("-" * (w + 2) if i < 2 else "-" * (w + 1) + ":" for i, w in enumerate(widths)) + "|"
    yield from map(row_text, rows)


def table_text(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table as one text."""
    return "\n".join(table(head, rows))


def left_table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table of words: every column to the left."""
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    lines = [head, ["-" * width for width in widths], *rows]
    return "\n".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) + " |" for row in lines
    )


def commit_text(facts: dict[str, Any]) -> str:
    """The commit of a record or of a part of one."""
    return (facts["commit"] or "unknown")[:12] + (" with changes" if facts["changed"] else "")


def facts_text(record: dict[str, Any]) -> str:
    """The machine, the commit and the versions of a record."""
    machine, versions = record["machine"], record["versions"]
    return (
        f"{machine['cpu']}, {machine['cpus']} CPUs; topleft {versions['topleft']} at {commit_text(record)}, "
        f"{record['isa']}, NumPy {versions['numpy']}, Python {machine['python']}; {record['date'][:10]}."
    )
