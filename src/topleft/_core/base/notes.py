"""Notes of parts of a mesh file that could not be read, one line a kind; given as warnings, or to a listener.

Input: kinds and names, and the files that were read, from the readers. Output: `MeshWarning`, or lines.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from topleft.errors import MeshWarning

N_NAMES = 3
"""Names of a kind that a line lists."""


class Heard(list[str]):
    """The lines that a listener gets."""

    def __init__(self) -> None:
        self.files: list[Path] = []
        """The files that were read, or looked for."""


_listener: ContextVar[Heard | None] = ContextVar("topleft_notes", default=None)


class Notes:
    """Parts of a file that its mesh lacks, by kind."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._names: dict[str, dict[str, None]] = {}

    def add(self, kind: str, name: str = "") -> None:
        """Note one thing of a kind; its name is listed once."""
        names = self._names.setdefault(kind, {})
        if name:
            names[name] = None

    def remove(self, kind: str) -> None:
        """Forget a kind."""
        self._names.pop(kind, None)

    @property
    def lines(self) -> list[str]:
        """A line for each kind, in the order of the first note of each."""
        return [f"{self._path!r}: {kind}{_list_of(list(names))}" for kind, names in self._names.items()]


def _list_of(names: list[str]) -> str:
    if not names:
        return ""
    more = f" and {len(names) - N_NAMES} more" if len(names) > N_NAMES else ""
    return ": " + ", ".join(f"{name[:80]!r}" for name in names[:N_NAMES]) + more


def tell(lines: Iterable[str], stacklevel: int) -> None:
    """Warn of each line, at the place of the caller's call; a listener gets them instead."""
    heard = _listener.get()
    if heard is not None:
        heard.extend(lines)
        return
    for line in lines:
        warnings.warn(line, MeshWarning, stacklevel=stacklevel + 1)


def level_outside() -> int:
    """The level, as `stacklevel` counts, of the first frame outside of topleft and of cached properties."""
    frame, n = sys._getframe(1), 1
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).startswith(("topleft.", "functools")):
        frame, n = frame.f_back, n + 1
    return n


def tell_files(files: Iterable[Path]) -> None:
    """Tell a listener of files that were read, or looked for."""
    heard = _listener.get()
    if heard is not None:
        heard.files.extend(files)


@contextmanager
def listening() -> Iterator[Heard]:
    """A list that gets the lines that this thread would be warned of."""
    heard = Heard()
    token = _listener.set(heard)
    try:
        yield heard
    finally:
        _listener.reset(token)
