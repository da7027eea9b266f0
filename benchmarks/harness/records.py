"""Records of measurements as files: JSON in which a row of figures takes a line."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

Record = dict[str, Any]
Save = Callable[[Record], None]
"""Takes a record as far as it goes."""


def forget(_: Record) -> None:
    """Save nothing."""


def tell(text: str) -> None:
    """Tell how far a run has come."""
    print(text, file=sys.stderr, flush=True)


def read_record(path: Path | None) -> Record | None:
    """Return the record of a file, None where there is none yet."""
    return json.loads(path.read_text()) if path and path.exists() else None


def write_record(path: Path, record: Record) -> None:
    """Write JSON."""
    write_text(path, record_text(record) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write text, never half of it."""
    write_whole(path, text.encode())


def write_whole(path: Path, data: bytes) -> None:
    """Write beside the place, then move it there: never half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def record_text(record: Record) -> str:
    """JSON; rows of figures take a line each, but for a record of `run`, whose rows are long."""
    if "kind" not in record:
        return json.dumps(record, indent=1)
    parts = []
    for key, value in record.items():
        is_rows = isinstance(value, list) and value
        text = "[\n  " + ",\n  ".join(map(json.dumps, value)) + "\n ]" if is_rows else json.dumps(value)
        parts.append(f" {json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}"
