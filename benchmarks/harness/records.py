"""Records of measurements as files: JSON in which a row of figures takes a line."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

KINDS_OF_ROWS = ("accuracy", "atlas", "pictures", "choices", "static")


def write_record(path: Path, record: dict[str, Any]) -> None:
    """Write JSON."""
    write_text(path, record_text(record) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write beside the place, then move it there: never half a file."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def record_text(record: dict[str, Any]) -> str:
    """JSON; rows of figures take a line each."""
    if record.get("kind") not in KINDS_OF_ROWS:
        return json.dumps(record, indent=1)
    parts = []
    for key, value in record.items():
        is_rows = isinstance(value, list) and value
        text = "[\n  " + ",\n  ".join(map(json.dumps, value)) + "\n ]" if is_rows else json.dumps(value)
        parts.append(f" {json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}"
