"""Tables of an accuracy record: time by number and threads, the ratio that a tutorial reports."""

from __future__ import annotations

from benchmarks.accuracy.tutorial import QUOTED
from benchmarks.harness.records import Record
from benchmarks.report.tables import number

Table = tuple[list[str], list[list[str]]]


def scaling_rows(record: Record) -> Table:
    """A row for each number of triangles, time for each number of threads."""
    counts = sorted({row["threads"] for row in record["scaling"]})
    cells: dict[int, list[str]] = {}
    for row in record["scaling"]:
        own = cells.setdefault(row["scene"], [f"{row['n_triangles']:,}", ""])
        if row["threads"] == counts[0]:
            own += [number(row["ms"]), number(1e6 * row["ms"] / row["n_triangles"])]
        else:
            own += [number(row["ms"]), f"{row['faster']:.2f}x"]
    head = ["triangles", "", "1 thread: ms", "ns a triangle"]
    for n in counts[1:]:
        head += [f"{n} threads: ms", "faster"]
    return head, list(cells.values())


def tutorial_text(record: Record) -> str:
    """The two figures that a tutorial reports, beside the ratio of the fills."""
    fills = {row["method"]: row["fills"] for row in record["tutorial"]}
    if not QUOTED.keys() <= fills.keys():
        return "The methods that tutorials time were not measured."
    (scanline, other), (quoted, other_quoted) = QUOTED, QUOTED.values()
    return (
        f"One tutorial reports {quoted} pictures a second for its scanline and {other_quoted} for point-in-triangle, "
        f"{quoted / other_quoted:.2f} times as many. Most of that time went into its window's call that sets a point. "
        f"The fills alone: `{scanline}` draws {fills[scanline] / fills[other]:.1f} times as many as `{other}` here."
    )
