"""The origin of a figure: machine, versions, commit."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
RECORDS = ROOT / "benchmarks" / "records"
PAGES = ROOT / "docs" / "measured"
"""The pages that studies write or fill."""
IMAGES = ROOT / "docs" / "images"


def describe(*distributions: str) -> dict[str, Any]:
    """The origin of figures: date, machine, commit, instruction set, versions of topleft, NumPy and distributions."""
    import topleft as tl

    return {
        "date": now(),
        "machine": describe_machine(),
        **describe_commit(),
        "isa": tl.build_info()["isa"],
        "versions": {"topleft": tl.__version__, **{name: version_of(name) for name in ("numpy", *distributions)}},
    }


def describe_machine() -> dict[str, Any]:
    """The machine, in words that do not name it."""
    return {
        "cpu": cpu_model(),
        "cpus": os.cpu_count(),
        "architecture": platform.machine(),
        "system": platform.system(),
        "memory_gib": memory_gib(),
        "python": platform.python_version(),
        "load": [round(value, 2) for value in os.getloadavg()] if hasattr(os, "getloadavg") else None,
    }


def cpu_model() -> str:
    """The model of the CPU; with family and model numbers, since virtual machines often call all theirs the same."""
    try:
        text = Path("/proc/cpuinfo").read_text().partition("\n\n")[0]
    except OSError:
        return platform.processor() or "unknown"
    facts = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in text.splitlines())}
    numbers = [f"{key} {facts[key]}" for key in ("cpu family", "model", "stepping") if key in facts]
    return ", ".join([facts.get("model name", "unknown"), *numbers])


def memory_gib() -> float | None:
    """Memory of the machine."""
    try:
        return round(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30, 1)
    except (ValueError, OSError, AttributeError):
        return None


def describe_commit() -> dict[str, Any]:
    """The commit of this checkout, and whether it has changes."""
    commit = _git("rev-parse", "HEAD")
    return {"commit": commit, "changed": bool(_git("status", "--porcelain")) if commit else None}


def now() -> str:
    """Date and time, UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def version_of(distribution: str) -> str | None:
    """The version of an installed distribution."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def _git(*arguments: str) -> str | None:
    try:
        done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None
