"""The protocol that every study keeps: a command that measures, a record, and the ways in which it is shown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from benchmarks.harness.records import Record, Save


@dataclass(frozen=True)
class Study:
    """Cases that are measured together."""

    kind: str
    """Of its record; and the command."""
    help: str
    options: type
    """A dataclass of `harness.arguments`; its field `record` is the file that the record goes to."""
    run: Callable[[Any, Save], Record]
    """Measure by options and return the record; the function that it gets takes the record as far as it goes.

    Raises a ValueError for options that are refused.
    """
    lines: Callable[[Record], Iterable[str]]
    """The printed lines of a record."""
    parts: Mapping[str, Callable[[Record], str | None]] = field(default_factory=dict)
    """The parts of its pages by their markers `<!-- table: NAME -->`; None: of another record than this one."""
    charts: str | None = None
    """The module that draws its charts; it needs matplotlib."""

    def draw_charts(self, record: Record, folder: Path) -> list[Path]:
        """Write the charts of a record into a folder, return where they are."""
        if self.charts is None:
            raise ValueError(f"there are no charts of a record of {self.kind}")
        return import_module(self.charts).draw_charts(record, folder)
