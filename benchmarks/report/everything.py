"""All records that pages show, measured anew at one commit: tables and charts with them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from benchmarks.harness.machine import IMAGES, RECORDS, ROOT, describe_commit
from benchmarks.harness.records import tell

PINNED = "--pin 0,1"
EVERY = {
    "accuracy": ("accuracy", "measured/accuracy.md"),
    "atlas": ("atlas", "measured/atlas.md"),
    "batch": (f"batch {PINNED}", "measured/performance.md"),
    "choices": ("choices", "measured/choices.md"),
    "instances": ("instances --mapped 40", "measured/static.md"),
    "layers": ("layers", "measured/performance.md"),
    "pictures": (f"pictures --sheets {IMAGES}", "measured/pictures.md"),
    "polygons": ("polygons --clock cpu", "guide/polygons.md"),
    "scenes": (
        f"run --scene blob random frames large-4k fill labels --peer llvmpipe --threads 1 2 {PINNED}",
        "measured/performance.md ../README.md",
    ),
    "smooth": ("run --scene smooth --repeats 3 --seconds 0.05 --pin 1", "measured/performance.md"),
    "static": ("static", "measured/static.md"),
}
"""By the name of a record: its command, and the pages that show it; files of others have commands of their own."""


def measure_all(folder: Path | None, has_charts: Callable[[str], bool]) -> None:
    """Measure what a folder lacks; then records, tables and charts are those of the folder.

    Raises
    ------
    ValueError
        If the checkout has changes: no commit would name what was measured.
    """
    state = describe_commit()
    if state["changed"]:
        raise ValueError("the checkout must have no changes: a record names its commit")
    folder = folder or ROOT / "build" / f"records-{state['commit'][:8]}"
    run = lambda *words: subprocess.run([sys.executable, "-m", "benchmarks", *words], cwd=ROOT, check=True)  # noqa: E731
    for name, (command, _) in EVERY.items():
        done, part = folder / f"{name}.json", folder / f"{name}.part.json"
        if not done.exists():
            tell(f"{name}: {command}")
            run(*command.split(), "-o", str(part))
            part.rename(done)
    for name, (command, pages) in EVERY.items():
        record = RECORDS / f"{name}.json"
        record.write_bytes((folder / record.name).read_bytes())
        for page in pages.split():
            run("document", str(record), f"docs/{page}")
        if has_charts(command.split()[0]):
            run("charts", str(record))
