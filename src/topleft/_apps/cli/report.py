"""Reports results and errors: lines on stderr, and the report of `topleft render` as JSON.

Input: messages, results of jobs. Output: lines, a file.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from topleft._apps.batch.batch import Result
from topleft._apps.cli.arguments import UsageError
from topleft._core.base.arrays import as_size
from topleft._core.base.notes import listening
from topleft._core.base.remote import is_url
from topleft._core.base.whole_file import write_whole
from topleft.errors import TopleftError

MOST_LACKS = 8
"""Warnings in one line, without --warnings all."""

TOLD = (TopleftError, OSError, ValueError, MemoryError)
"""Errors with a sufficient message; for others the line begins with their type."""


def complain(message: str) -> None:
    """Print one line on stderr."""
    print(f"topleft: {message}", file=sys.stderr)


def complain_of_lacks(lines: Sequence[str], *, is_each_told: bool = False) -> None:
    """Print the parts of files that meshes lack: the first few in one line, or each in a separate line."""
    if is_each_told:
        for line in lines:
            complain(line)
    elif lines:
        n_more = len(lines) - MOST_LACKS
        complain("; ".join(lines[:MOST_LACKS]) + (f"; and {n_more} more (--warnings all)" if n_more > 0 else ""))


@contextmanager
def complaining() -> Iterator[list[str]]:
    """Collect what files lack, and print it in one line at the end, also when an error ends the command."""
    with listening() as lacks:
        try:
            yield lacks
        finally:
            complain_of_lacks(lacks)


def one_line(error: BaseException) -> str:
    """The error in one line, with the options of a shell where it names arguments of Python."""
    if isinstance(error, MemoryError):
        return "not enough memory for a mesh or picture of this size"
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: {error.filename!r}" if error.filename else error.strerror
    told = re.sub(r"\b([a-z]+)=True\b", r"--\1", " ".join(str(error).split()))
    return told if isinstance(error, TOLD) else f"{type(error).__name__}: {told}"


def check_report(path: str) -> None:
    """Raise a `UsageError` before any work if the report cannot be written where it is to go."""
    if is_url(path) or Path(path).suffix.lower() != ".json":
        raise UsageError(f"--report must be a file of this machine that ends in .json, got {path!r}")


def write_report(path: Path, sources: Iterable[str], results: Sequence[Result]) -> None:
    """Write the result of each picture; `sources` has the mesh of each."""
    rows = [_row(source, result) for source, result in zip(sources, results, strict=True)]
    document = {**Counter(written=0, skipped=0, failed=0), **Counter(row["status"] for row in rows), "pictures": rows}
    write_json(path, document, indent=1)


def write_json(path: Path, content: Any, indent: int | None = None) -> None:
    """Write a file that is whole or not there, and its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda file: file.write(json.dumps(content, indent=indent).encode()))


def _row(source: str, result: Result) -> dict[str, Any]:
    status = "failed" if result.error is not None else "skipped" if result.is_skipped else "written"
    files = list(result.job.files)
    sizes = [file.stat().st_size for file in files if isinstance(file, Path) and file.is_file()]
    return {
        "mesh": source,
        "status": status,
        "files": [str(file) for file in files] if status != "failed" else [],
        "size": list(as_size(result.job.size)),
        "bytes": sum(sizes) if status != "failed" else 0,
        "seconds": round(result.seconds, 4),
        "warnings": list(result.warnings),
        "error": None if result.error is None else one_line(result.error),
    }
