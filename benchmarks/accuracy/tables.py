"""Tables of an accuracy record: time beside error, the mesh, anti-aliasing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from benchmarks.accuracy.stability import CHANGES, EXACT, FAR_PX
from benchmarks.harness.records import Record
from benchmarks.harness.turns import digits
from benchmarks.report.tables import commit_text, number

DEFAULT_BITS = "8"

Row = dict[str, Any]
Table = tuple[list[str], list[list[str]]]


def facts_text(record: Record) -> str:
    """The origin of the figures, and the peers that did not take part."""
    options, mesh = record["options"], record["mesh"]
    families = "; ".join(
        f"{family['name']}, {family['what']}: {family['n_timed']:,} timed, errors over {family['n_edge_px']:,} "
        f"edge pixels of {family['n_triangles']:,}"
        for family in record["families"]
    )
    return (
        f"{machine_text(record)}; CPU time of one thread, {options['rounds']} rounds. "
        f"Frame {options['frame_px']} px square. Triangles {families}. "
        f"Mesh: {mesh['n_triangles']:,} triangles, {mesh['n_edge_px']:,} edge pixels." + skipped_text(record)
    )


def machine_text(record: Record) -> str:
    """Machine, versions, instruction set, commits, dates."""
    machine = record["machine"]
    return (
        f"{machine['cpu']}, {machine['cpus']} CPUs, {machine['system']}, Python {machine['python']}, "
        f"topleft {record['versions']['topleft']} ({record['isa']}) at {commits_text(record)}"
    )


def commits_text(record: Record) -> str:
    """Commits of the checkout when the parts were measured, and the days."""
    parts = record["parts"].values()
    commits = dict.fromkeys(map(commit_text, parts))
    return f"{', '.join(commits)}, {' to '.join(sorted({part['date'][:10] for part in parts}))}"


def is_shown(row: Row) -> bool:
    """Tell whether pages show it: a method at its usual precision; of variants the one in float64 alone."""
    is_usual = not row["precision"].isdigit() or row["precision"] == DEFAULT_BITS
    return is_usual and ("/" not in row["method"] or row["precision"] == "float64")


def family_rows(record: Record, head: list[str], rows: Iterable[tuple[str, str, Row, str]], error: str) -> Table:
    """A row for each pair of names, the time and the error of every family; peers that sat out are left out."""
    cells: dict[tuple[str, str], list[str]] = {}
    for name, gives, row, error_text in rows:
        cells.setdefault((name, gives), [name, gives]).extend([number(row["ns_triangle"]), error_text])
    columns = [column for family in record["families"] for column in (f"{family['name']}: ns", error)]
    return head + columns, list(cells.values())


def coverage_rows(record: Record, keep: Callable[[Row], bool]) -> Table:
    """A row for each method and precision, time and error of every family."""
    rows = ((f"`{row['method']}`", row["precision"], row, wrong_text(record, row))
            for row in with_no_snap(record) if keep(row))  # fmt: skip
    return family_rows(record, ["method", "precision"], rows, "wrong")


def others_rows(record: Record, parts: Iterable[str]) -> Table:
    """A row for each peer or pure twin of these parts: time and error of every family."""
    rows = (
        (row.get("peer") or row["twin"], row.get("gives") or f"counts, Python, as `{row['method']}`", row,
         wrong_text(record, row))
        for part in parts
        for row in record[part]
        if "skipped" not in row
    )  # fmt: skip
    return family_rows(record, ["drawn by", "gives"], rows, "wrong")


def antialiasing_rows(record: Record) -> Table:
    """A row for each way to sample and each peer: time and RMS error of every family."""
    rows = (
        (f'`"{row["sampling"]}"`' if "sampling" in row else row["peer"], row.get("gives", "topleft"), row,
         f"{row['rms']:.2g}")
        for row in record["antialiasing"]
        if "skipped" not in row
    )  # fmt: skip
    return family_rows(record, ["sampling", "gives"], rows, "RMS")


def wrong_text(record: Record, row: Row) -> str:
    """Wrong pixels per million edge pixels of the family."""
    return per_million(row["wrong_px"], next(f["n_edge_px"] for f in record["families"] if f["name"] == row["family"]))


def with_no_snap(record: Record) -> list[Row]:
    """Return the rows of methods, and those of vertices that are not snapped: their time from that at 8 bits."""
    snapped = {row["family"]: row for row in record["coverage"] if (row["method"], row["precision"]) == ("auto", "8")}
    rows = []
    for row in record.get("no_snap", ()):
        times = {key: digits(row["times_8_bits"] * snapped[row["family"]][key]) for key in ("ns_triangle", "ns_px")}
        rows.append(row | times)
    return record["coverage"] + rows


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


def skipped_text(record: Record) -> str:
    """Peers that did not take part, with the reason."""
    rows = [row for row in record["peers"] + record["antialiasing"] if "skipped" in row]
    skipped = dict.fromkeys(f"{row['peer']} ({row['skipped']})" for row in rows)
    return f" Left out: {'; '.join(skipped)}." if skipped else ""


def changes_text(_: Record) -> str:
    """The meaning of the mesh's columns."""
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
