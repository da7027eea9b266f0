"""The accuracy record: time beside error for every method, and what else is charted; measured part by part.

Out: a record for JSON. A part that is measured again replaces its rows; the rest of the record stays.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TextIO

from benchmarks.accuracy.depth import measure_depth
from benchmarks.accuracy.filling import measure_family
from benchmarks.accuracy.options import Options
from benchmarks.accuracy.scaling import measure_scaling
from benchmarks.accuracy.sizes import measure_sizes
from benchmarks.accuracy.stability import measure_stability
from benchmarks.accuracy.tutorial import measure_tutorial
from benchmarks.harness import machine
from benchmarks.scenes.families import FAMILIES, entries

SCHEMA = 2

Record = dict[str, Any]

PARTS: Mapping[str, Callable[[Options], Record]] = {
    **{name: partial(measure_family, family) for name, family in FAMILIES.items()},
    "mesh": lambda options: measure_stability(entries(options.methods), options.frame_px, options.scale),
    "depth": measure_depth,
    "sizes": measure_sizes,
    "scaling": measure_scaling,
    "tutorial": measure_tutorial,
}
"""What measures each part: it returns lists of rows, and objects of facts, by name."""


def run_accuracy(
    options: Options,
    parts: Sequence[str] = (),
    record: Record | None = None,
    progress: TextIO | None = None,
    save: Callable[[Record], None] | None = None,
) -> Record:
    """Measure the named parts, all for none, and return the record with them; `save` gets it after each.

    Raises
    ------
    ValueError
        If a part is unknown, or the record is of another machine, instruction set or version.
    """
    import topleft as tl

    chosen = list(parts) or list(PARTS)
    if unknown := [part for part in chosen if part not in PARTS]:
        raise ValueError(f"parts must be some of {', '.join(PARTS)}, got {', '.join(unknown)}")
    entries(options.methods)  # unknown names are refused before anything is measured
    facts: Record = {
        "schema": SCHEMA,
        "kind": "accuracy",
        "machine": {key: value for key, value in machine.describe_machine().items() if key != "load"},
        "versions": {"topleft": tl.build_info()["version"], "numpy": machine.version_of("numpy")},
        "isa": tl.build_info()["isa"],
        "options": {"rounds": options.rounds, "seconds": options.seconds, "frame_px": options.frame_px},
    }
    if record is None:
        record = facts | {"parts": {}}
    for key, value in facts.items():
        if record.get(key) != value:
            raise ValueError(f"the record must be of the same {key} to add to it, {value!r}, got {record.get(key)!r}")
    for part in chosen:
        if progress:
            print(f"{part} ...", file=progress, flush=True)
        measured = PARTS[part](options)
        for name, value in measured.items():
            record[name] = replace_rows(record.get(name, []), value) if isinstance(value, list) else value
        record["parts"][part] = {"date": machine.now(), **machine.describe_commit()}
        if save:
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
