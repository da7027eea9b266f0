"""The parts of an accuracy record that pages of the documentation show, between markers, and the report in full."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping

from benchmarks.accuracy import speed_tables
from benchmarks.accuracy import tables as accuracy_tables
from benchmarks.accuracy.tables import Record, is_default
from benchmarks.report.tables import table

PARTS: Mapping[str, Callable[[Record], str]] = {
    "facts": accuracy_tables.facts_text,
    "coverage": lambda record: "\n".join(table(*accuracy_tables.coverage_rows(record, is_default))),
    "bits": lambda record: "\n".join(table(*accuracy_tables.bits_rows(record))),
    "others": lambda record: "\n".join(table(*accuracy_tables.others_rows(record))),
    "skipped": accuracy_tables.skipped_text,
    "changes": accuracy_tables.changes_text,
    "stability": lambda record: "\n".join(table(*accuracy_tables.stability_rows(record, is_default))),
    "antialiasing": lambda record: "\n".join(table(*accuracy_tables.antialiasing_rows(record))),
    "depth": lambda record: "\n".join(table(*speed_tables.depth_rows(record))),
    "speed-facts": speed_tables.speed_facts_text,
    "sizes": lambda record: "\n".join(table(*speed_tables.sizes_rows(record))),
    "memory": speed_tables.memory_text,
    "scaling": lambda record: "\n".join(table(*speed_tables.scaling_rows(record))),
    "tutorial": lambda record: "\n".join(table(*speed_tables.tutorial_rows(record))),
    "tutorial-ratio": speed_tables.tutorial_text,
}
"""What the markers `<!-- table: NAME -->` of a page stand for."""

MARKED = re.compile(r"(<!-- table: ([\w-]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def lines(record: Record) -> Iterator[str]:
    """The report of one record, Markdown: every method at every precision, as far as the record goes."""
    yield accuracy_tables.machine_text(record)
    for title, needs, rows in (
        ("Time and error", "coverage", lambda: accuracy_tables.coverage_rows(record, lambda _: True)),
        ("Peers and pure twins", "peers", lambda: accuracy_tables.others_rows(record)),
        ("Mesh: per million edge pixels", "stability", lambda: accuracy_tables.stability_rows(record, lambda _: True)),
        ("Anti-aliasing", "antialiasing", lambda: accuracy_tables.antialiasing_rows(record)),
        ("Depth: sheets told apart", "depth", lambda: speed_tables.depth_rows(record)),
        ("Time by area, ns a triangle", "sizes", lambda: speed_tables.sizes_rows(record)),
        ("Time by number and threads", "scaling", lambda: speed_tables.scaling_rows(record)),
        ("Pictures a second", "tutorial", lambda: speed_tables.tutorial_rows(record)),
    ):
        if needs in record:
            yield from ("", f"## {title}", "", *table(*rows()))


def with_parts(text: str, record: Record, parts: Mapping[str, Callable[[Record], str]] = PARTS) -> str:
    """Return a page with what stands between its markers made anew, by `parts`.

    Raises
    ------
    ValueError
        If the page has no marker or an unknown one, or the record lacks what one needs.
    """

    def made(found: re.Match[str]) -> str:
        head, name, _, end = found.groups()
        if name not in parts:
            raise ValueError(f"a marker must be one of {', '.join(parts)}, got {name!r}")
        try:
            return f"{head}{parts[name](record)}\n{end}"
        except KeyError as key:
            raise ValueError(f"the record must hold {key} for {name!r}: measure that part") from None

    page, n = MARKED.subn(made, text)
    if not n:
        raise ValueError("the page must hold <!-- table: NAME --> and <!-- end --> after it")
    return page
