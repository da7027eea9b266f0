"""Tables of a record of levels of detail, for the terminal and, between markers, for docs/measured/levels.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from benchmarks.harness.records import Record
from benchmarks.report.tables import table_text


def meshes_text(record: Record) -> str:
    """A row for each mesh and height, with the level that is drawn."""
    head = ["mesh", "height", "level", "triangles", "bound, px", "measured, px", "full, ms", "in clusters, ms",
            "level, ms", "faster"]  # fmt: skip
    rows = []
    for mesh in record["meshes"]:
        for view in mesh["views"]:
            own, full = view["levels"][view["level"]], view["levels"][0]
            n = mesh["levels"][view["level"]]["n_triangles"]
            times = [min(one["turns_ms"]) for one in (full, own)]
            clustered = min(view["clustered_ms"])
            rows.append([
                f"{mesh['name']}, {mesh['n_triangles']:,}", f"{view['height_px']} px high", str(view["level"]),
                f"{n:,}", f"{own['bound_px']:.2f}", f"{own['error_px']:.2f}", f"{times[0]:.2f}", f"{clustered:.2f}",
                f"{times[1]:.2f}", f"{times[0] / times[1]:.1f} x, {clustered / times[1]:.1f} x",
            ])  # fmt: skip
    return table_text(head, rows)


def facts_text(record: Record) -> str:
    """The origin of the figures."""
    machine, (width, height) = record["machine"], record["size"]
    return (
        f"Measured {record['date'][:10]} on {machine['cpu']}, {record['isa']}: `rasterize` of {width}x{height} pixels, "
        f"the best of {record['rounds']} rounds in turns, at a tolerance of {record['tolerance']} px."
    )


def lines(record: Record) -> Iterator[str]:
    """The report: the table, and the time that making the levels took."""
    yield meshes_text(record)
    yield from (f"{mesh['name']}: levels were made in {mesh['made_s']:.1f} s of CPU time." for mesh in record["meshes"])


PARTS: Mapping[str, Callable[[Record], str]] = {"level-facts": facts_text, "levels": meshes_text}
"""The parts of the page by their markers."""
