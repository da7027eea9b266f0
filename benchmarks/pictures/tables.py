"""Tables of a record of pictures, for the terminal and, between markers, for docs/measured/pictures.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from benchmarks.harness.records import Record
from benchmarks.report.tables import commit_text, table_text

HEAD = ["scene", "what", "triangles", "inside", "mean", "largest", "differ", "other outline", "other triangle",
        "off edge, px", "unexplained"]  # fmt: skip


def lines(record: Record) -> Iterator[str]:
    """The report of one record, Markdown."""
    yield from (facts_text(record), "", differences_text(record), "", outlines_text(record))


def facts_text(record: Record) -> str:
    """The versions of both renderers."""
    width, height = record["size"]
    switches = ", ".join(f"`{name}={value}`" for name, value in record["environment"].items())
    return (
        f"topleft {record['versions']['topleft']} at {commit_text(record)}, {record['isa']}; {record['renderer']}, "
        f"by moderngl {record['versions']['moderngl']}, with {switches}; {width}x{height} pixels; "
        f"{record['date'][:10]}."
    )


def differences_text(record: Record) -> str:
    """A row for each scene."""
    rows = [
        [f"`{row['scene']}`", row["what"], f"{row['n_triangles']:,}", f"{row['n_inside']:,}", f"{row['mean']:.4f}"]
        + [f"{row[key]:,}" for key in ("max", "n_other", "n_coverage", "n_triangle")]
        + [f"{row['max_distance_px']:.5f}" if row["n_coverage"] + row["n_triangle"] else "-", str(row["n_unexplained"])]
        for row in record["scenes"]
    ]
    return table_text(HEAD, rows)


def outlines_text(record: Record) -> str:
    """The differences over many views."""
    facts = record["outlines"]
    return (
        f"`headlight` from {facts['n_views']} sides has {facts['n_outline']:,} pixels on outlines. "
        f"{facts['n_coverage']} are covered by one renderer alone, {facts['n_triangle']} others show another triangle, "
        f"{facts['n_unexplained']} are unexplained: the farthest lies {facts['max_distance_px']:.5f} px from an edge. "
        f"The largest mean difference inside is {facts['mean']:.4f}."
    )


def sheets_text(record: Record) -> str:
    """The sheets."""
    return "\n".join(map(sheet_text, record["scenes"]))


def sheet_text(row: Record) -> str:
    """One of them, with its description."""
    address = f"../images/pictures-{row['scene']}.png"
    return f"![{row['scene']}, {row['what']}: topleft, llvmpipe, difference]({address})"


PARTS: Mapping[str, Callable[[Record], str]] = {
    "picture-facts": facts_text,
    "differences": differences_text,
    "outlines": outlines_text,
    "sheets": sheets_text,
}
"""The parts of the page by their markers."""
