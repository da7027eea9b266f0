"""Maps of faults: a row for each method, a number for each value of the parameters of a family."""

from __future__ import annotations

from typing import Any, NamedTuple

from topleft.scene_families import Family


class Faults(NamedTuple):
    """Pixels of a picture."""

    wrong: int
    gaps: int
    overdrawn: int
    inexact: int


def tabulate(
    family: Family, n_px: list[int], cells: dict[str, list[list[Any]]]
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return facts, and rows with a list for each field: sums over scenes step by step, None where a method refuses."""
    facts = {"name": family.name, "what": family.what, "axes": {axis.what: list(axis.values) for axis in family.axes},
             "n_scenes": family.n_seeds, "n_px": n_px}  # fmt: skip
    maps = []
    for name, steps in cells.items():
        row: dict[str, Any] = {"family": family.name, "entry": name}
        refusals = [fault for faults in steps for fault in faults if isinstance(fault, str)]
        drawn = [None if any(isinstance(fault, str) for fault in faults) else faults for faults in steps]
        for field in Faults._fields:
            row[field] = [None if faults is None else sum(getattr(f, field) for f in faults) for faults in drawn]
        if getattr(steps[0][0], "ulp", None) is not None:
            row["ulp"] = [max(fault.ulp for fault in faults) for faults in steps]
        maps.append(row | ({"refused": refusals[0]} if refusals else {}))
    return facts, maps
