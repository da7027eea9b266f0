"""Tables of an accuracy record, for the terminal and for docs/accuracy.md, where they stand between markers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from benchmarks.report import number, table
from benchmarks.stability import CHANGES, EXACT, FAR_PX

DEFAULT_BITS = "8"
PRODUCTION = ("auto", "edge", "scanline")

Record = dict[str, Any]
Row = dict[str, Any]


def lines(record: Record) -> Iterator[str]:
    """The report of one record, Markdown: every method at every precision."""
    yield facts_text(record)
    for title, rows in (
        ("Time and error", coverage_rows(record, lambda _: True)),
        ("Mesh: per million edge pixels", stability_rows(record, lambda _: True)),
        ("Anti-aliasing", antialiasing_rows(record)),
    ):
        yield from ("", f"## {title}", "", *table(*rows))


def facts_text(record: Record) -> str:
    """What the figures belong to."""
    machine, options = record["machine"], record["options"]
    commit = (record["commit"] or "unknown")[:12] + (" with changes" if record["changed"] else "")
    families = "; ".join(
        f"{family['name']}, {family['what']}: {family['n_timed']:,} timed, errors over {family['n_edge_px']:,} "
        f"edge pixels of {family['n_triangles']:,}"
        for family in record["families"]
    )
    mesh = record["mesh"]
    return (
        f"{machine['cpu']}, {machine['system']}, Python {machine['python']}, topleft {record['versions']['topleft']} "
        f"({record['isa']}) at {commit}, {record['date'][:10]}; CPU time of one thread, {options['rounds']} rounds. "
        f"Frame {options['frame_px']} px square. Triangles {families}. "
        f"Mesh: {mesh['n_triangles']:,} triangles, {mesh['n_edge_px']:,} edge pixels."
    )


def is_default(row: Row) -> bool:
    """Whether it is a method at its usual precision."""
    return not row["precision"].isdigit() or row["precision"] == DEFAULT_BITS


def coverage_rows(record: Record, keep: Callable[[Row], bool]) -> tuple[list[str], list[list[str]]]:
    """A row for each method and precision, time and error of every family."""
    families = {family["name"]: family for family in record["families"]}
    head = ["method", "precision"]
    for name in families:
        head += [f"{name}: ns", "wrong"]
    cells: dict[tuple[str, str], list[str]] = {}
    for row in filter(keep, record["coverage"]):
        own = cells.setdefault((row["method"], row["precision"]), [f"`{row['method']}`", row["precision"]])
        own += [number(row["ns_triangle"]), per_million(row["wrong_px"], families[row["family"]]["n_edge_px"])]
    return head, list(cells.values())


def bits_rows(record: Record) -> tuple[list[str], list[list[str]]]:
    """Wrong pixels of the engine by sub-pixel bits, beside whole pixels and floats."""
    head = ["vertices", "as drawn by", *(family["name"] for family in record["families"])]
    n_edge_px = {family["name"]: family["n_edge_px"] for family in record["families"]}
    shown = {"auto": "{} bits", "point_in_triangle/top-left": "{}", "float_barycentric": "{}",
             "float_barycentric/float64": "{}"}  # fmt: skip
    cells: dict[str, list[str]] = {}
    for row in record["coverage"]:
        if row["method"] in shown:
            name = shown[row["method"]].format(row["precision"])
            own = cells.setdefault(name, [name, f"`{row['method']}`"])
            own.append(per_million(row["wrong_px"], n_edge_px[row["family"]]))
    return head, list(cells.values())


def stability_rows(record: Record, keep: Callable[[Row], bool]) -> tuple[list[str], list[list[str]]]:
    """A row for the exact picture, and one for each method and precision."""
    columns = ["missed", "overdrawn", "far_missed", "far_overdrawn", "wrong", *(change.name for change in CHANGES)]
    n = record["mesh"]["n_edge_px"]
    rows = [
        [f"`{row['method']}`" if row["method"] != EXACT else "exact picture", row["precision"]]
        + [per_million(row[column], n) for column in columns]
        for row in record["stability"]
        if row["method"] == EXACT or keep(row)
    ]
    return ["method", "precision", *(column.replace("_", " ") for column in columns)], rows


def antialiasing_rows(record: Record) -> tuple[list[str], list[list[str]]]:
    """A row for each way to sample: time and RMS error of every family."""
    head = ["sampling", ""]
    for family in record["families"]:
        head += [f"{family['name']}: ns", "RMS"]
    cells: dict[str, list[str]] = {}
    for row in record["antialiasing"]:
        own = cells.setdefault(row["sampling"], [f'`"{row["sampling"]}"`', ""])
        own += [number(row["ns_triangle"]), f"{row['rms']:.2g}"]
    return head, list(cells.values())


def changes_text(_: Record) -> str:
    """What the columns of the mesh say."""
    missed = "*missed*, *overdrawn*: pixels that no triangle of the mesh draws, or that are drawn more than once"
    far = f"*far*: the same with the mesh {FAR_PX:,} px from the origin, in x and y; `-` beyond the method's range"
    wrong = "*wrong*: pixels that do not show the triangle that the exact picture shows"
    changes = "The others: pixels that show another triangle after a change of the mesh"
    named = "; ".join(f"*{change.name}*, {change.what}" for change in CHANGES)
    return "\n".join(f"- {line}." for line in (missed, far, wrong, f"{changes}: {named}"))


def per_million(count: int | None, n: int) -> str:
    """A rate."""
    if count is None:
        return "-"
    return f"{1e6 * count / n:,.0f}" if count * 1e5 >= n or not count else f"{1e6 * count / n:.1f}"


PARTS: dict[str, Callable[[Record], str]] = {
    "facts": facts_text,
    "coverage": lambda record: "\n".join(table(*coverage_rows(record, is_default))),
    "bits": lambda record: "\n".join(table(*bits_rows(record))),
    "changes": changes_text,
    "stability": lambda record: "\n".join(table(*stability_rows(record, is_default))),
    "antialiasing": lambda record: "\n".join(table(*antialiasing_rows(record))),
}
"""What the markers `<!-- table: NAME -->` of a page stand for."""


def with_parts(text: str, record: Record, parts: Mapping[str, Callable[[Record], str]] = PARTS) -> str:
    """Return a page with what stands between its markers made anew.

    Raises
    ------
    ValueError
        If a part has no marker in the page.
    """
    for name, make in parts.items():
        head, start, rest = text.partition(f"<!-- table: {name} -->\n")
        _, end, tail = rest.partition("<!-- end -->")
        if not end:
            raise ValueError(f"the page must hold <!-- table: {name} --> and <!-- end --> after it")
        text = head + start + make(record) + "\n" + end + tail
    return text
