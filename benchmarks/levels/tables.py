"""Tables of a record of levels of detail, for the terminal and, between markers, for docs/measured/levels.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from benchmarks.harness.records import Record
from benchmarks.report.tables import table, table_text


def rows_of(mesh: Record, head: str = "mesh seen") -> tuple[list[str], list[list[str]]]:
    """Return a table of one mesh: a row for each height, with the level that is drawn."""
    header = [head, "level", "triangles", "bound, px", "measured, px", "full, ms", "in clusters, ms", "level, ms",
              "faster"]  # fmt: skip
    rows = []
    for view in mesh["views"]:
        own, full = view["levels"][view["level"]], view["levels"][0]
        n = mesh["levels"][view["level"]]["n_triangles"]
        times = [min(one["turns_ms"]) for one in (full, own)]
        clustered = min(view["clustered_ms"])
        rows.append([
            f"{view['height_px']} px high", str(view["level"]), f"{n:,}", f"{own['bound_px']:.2f}",
            f"{own['error_px']:.2f}", f"{times[0]:.2f}", f"{clustered:.2f}", f"{times[1]:.2f}",
            f"{times[0] / times[1]:.1f} x, {clustered / times[1]:.1f} x",
        ])  # fmt: skip
    return header, rows


def facts_text(record: Record) -> str:
    """The origin of the figures."""
    machine, (width, height) = record["machine"], record["size"]
    return (
        f"Measured {record['date'][:10]} on {machine['cpu']}, {record['isa']}: `rasterize` of {width}x{height} pixels, "
        f"the best of {record['rounds']} rounds in turns, at a tolerance of {record['tolerance']} px."
    )


def meshes_text(record: Record) -> str:
    """A section for each mesh: its levels, and the one that is drawn at each height."""
    parts = []
    for mesh in record["meshes"]:
        parts.append(f"\n## {mesh['name']}, {mesh['n_triangles']:,} triangles\n")
        parts.append(f"Levels were made in {mesh['made_s']:.1f} s of CPU time.\n")
        counts = [["triangles", *(f"{one['n_triangles']:,}" for one in mesh["levels"])]]
        for name in ("bound", "known"):
            counts.append([f"{name}, of the size", *(f"{one[name]:.1e}" for one in mesh["levels"])])
        parts.append(table_text(["level", *map(str, range(len(mesh["levels"])))], counts) + "\n")
        parts.append(table_text(*rows_of(mesh)))
    return "\n".join(parts) + "\n"


def lines(record: Record) -> Iterator[str]:
    """Give the tables."""
    for mesh in record["meshes"]:
        yield ""
        yield from table(*rows_of(mesh, f"{mesh['name']}, {mesh['n_triangles']:,}"))


PARTS: Mapping[str, Callable[[Record], str]] = {"level-facts": facts_text, "levels": meshes_text}
"""The parts of the page by their markers."""
