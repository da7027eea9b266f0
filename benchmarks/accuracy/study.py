"""The accuracy record: time beside error for every method, and the rows of other charts; measured part by part.

Out: a record for JSON. A part that is measured again replaces its rows; the rest of the record stays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from benchmarks.accuracy import speed_tables, tables
from benchmarks.accuracy.depth import measure_depth
from benchmarks.accuracy.filling import measure_family, measure_no_snap
from benchmarks.accuracy.options import AccuracyOptions
from benchmarks.accuracy.scaling import measure_scaling
from benchmarks.accuracy.sizes import measure_sizes
from benchmarks.accuracy.stability import measure_stability
from benchmarks.accuracy.tutorial import measure_tutorial
from benchmarks.harness import machine
from benchmarks.harness.arguments import refuse_unknown
from benchmarks.harness.records import Record, Save, forget, read_record, tell
from benchmarks.report.study import Study
from benchmarks.report.tables import table, table_text
from benchmarks.scenes.families import FAMILIES, NO_SNAP, Entry, entries

SCHEMA = 2


def mesh_entries(methods: Sequence[str]) -> list[Entry]:
    """Return every way to fill a mesh, vertices that are not snapped behind the others."""
    own = [Entry("auto", NO_SNAP)] if not methods or "auto" in methods else []
    return [*entries(methods), *own]


MEASURES: Mapping[str, Callable[[AccuracyOptions], Record]] = {
    **{name: partial(measure_family, family) for name, family in FAMILIES.items()},
    "no-snap": measure_no_snap,
    "mesh": lambda options: measure_stability(mesh_entries(options.methods), options.frame_px, options.scale),
    "depth": measure_depth,
    "sizes": measure_sizes,
    "scaling": measure_scaling,
    "tutorial": measure_tutorial,
}
"""The function that measures each part; it returns lists of rows, and objects of facts, by name."""


def run(options: AccuracyOptions, save: Save) -> Record:
    """Measure all parts, or those that are named and no other of the record."""
    return run_accuracy(options, read_record(options.record) if options.parts else None, save)


def run_accuracy(options: AccuracyOptions, record: Record | None = None, save: Save = forget) -> Record:
    """Measure the named parts, all for none, and return the record with them; `save` gets it after each.

    Raises
    ------
    ValueError
        If a part is unknown, or the record is of another machine, instruction set or version.
    """
    chosen = list(options.parts) or list(MEASURES)
    refuse_unknown("parts", chosen, MEASURES)
    entries(options.methods)  # unknown names are refused before anything is measured
    here = machine.describe()
    facts: Record = {
        "schema": SCHEMA,
        "kind": "accuracy",
        "machine": {key: value for key, value in here["machine"].items() if key != "load"},
        "versions": here["versions"],
        "isa": here["isa"],
        "options": {"rounds": options.rounds, "seconds": options.seconds, "frame_px": options.frame_px},
    }
    if record is None:
        record = facts | {"parts": {}}
    for key, value in facts.items():
        if record.get(key) != value:
            raise ValueError(f"the record must be of the same {key} to add to it, {value!r}, got {record.get(key)!r}")
    for part in chosen:
        tell(f"{part} ...")
        measured = MEASURES[part](options)
        for name, value in measured.items():
            record[name] = replace_rows(record.get(name, []), value) if isinstance(value, list) else value
        record["parts"][part] = {"date": machine.now(), **machine.describe_commit()}
        save(record)
    return record


def replace_rows(old: list[Record], new: list[Record]) -> list[Record]:
    """Return the rows with those of the same family taken out, families in their order."""
    families = {row.get("family", row.get("name")) for row in new}
    rows = [row for row in old if row.get("family", row.get("name")) not in families] + new
    order = list(FAMILIES)
    if not families <= set(order):
        return new
    return sorted(rows, key=lambda row: order.index(row.get("family", row.get("name"))))


def text_of(rows: Callable[..., Any], *more: Any) -> Callable[[Record], str]:
    """Return the function that makes the table of some rows."""
    return lambda record: table_text(*rows(record, *more))


PARTS: Mapping[str, Callable[[Record], str]] = {
    "facts": tables.facts_text,
    "coverage": text_of(tables.coverage_rows, tables.is_shown),
    "others": text_of(tables.others_rows, ("peers",)),
    "changes": tables.changes_text,
    "stability": text_of(tables.stability_rows, tables.is_shown),
    "scaling": text_of(speed_tables.scaling_rows),
    "tutorial-ratio": speed_tables.tutorial_text,
}
"""The parts of a page by their markers `<!-- table: NAME -->`."""


def lines(record: Record) -> Iterator[str]:
    """The report of one record, Markdown: every method at every precision, as far as the record goes."""
    yield tables.machine_text(record)
    for title, needs, rows in (
        ("Time and error", "coverage", partial(tables.coverage_rows, record, lambda _: True)),
        ("Peers and pure twins", "peers", partial(tables.others_rows, record, ("peers", "pure"))),
        ("Mesh: per million edge pixels", "stability", partial(tables.stability_rows, record, lambda _: True)),
        ("Anti-aliasing", "antialiasing", partial(tables.antialiasing_rows, record)),
        ("Time by number and threads", "scaling", partial(speed_tables.scaling_rows, record)),
    ):
        if needs in record:
            yield from ("", f"## {title}", "", *table(*rows()))


STUDY = Study(
    "accuracy", "measure time beside error, and stability, of every method", AccuracyOptions, run, lines, PARTS,
    "benchmarks.accuracy.charts",
)  # fmt: skip
