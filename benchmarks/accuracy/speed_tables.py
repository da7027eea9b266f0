"""Tables of an accuracy record: depth, and cost by size, number, threads and pictures a second."""

from __future__ import annotations

from benchmarks.accuracy.tables import machine_text
from benchmarks.accuracy.tutorial import QUOTED
from benchmarks.harness.records import Record
from benchmarks.report.tables import number

WRONG_SHARE = 1e-3
"""From which sheets count as told apart: one pixel in a thousand wrong."""
COARSE_STEP = 2
"""Every second of the areas is in the table."""

Table = tuple[list[str], list[list[str]]]


def speed_facts_text(record: Record) -> str:
    """The origin of the figures."""
    options = record["options"]
    return f"{machine_text(record)}; medians of {options['rounds']} rounds."


def depth_rows(record: Record) -> Table:
    """A row for each format: how close two sheets may be, by near/far ratio."""
    ratios = list(dict.fromkeys(row["ratio"] for row in record["depth"]))
    cells: dict[str, list[str]] = {}
    for name in dict.fromkeys(row["format"] for row in record["depth"]):
        own = cells.setdefault(name, [name, ""])
        for ratio in ratios:
            rows = [row for row in record["depth"] if (row["format"], row["ratio"]) == (name, ratio)]
            own.append(finest_gap(rows))
    return ["depth kept as", "", *(f"far/near {ratio:,}" for ratio in ratios)], list(cells.values())


def finest_gap(rows: list[Record]) -> str:
    """The last gap before sheets are mixed up."""
    bits = None
    for row in sorted(rows, key=lambda row: row["bits"]):
        if row["wrong_px"] > WRONG_SHARE * row["n_px"]:
            break
        bits = row["bits"]
    return f"1/{2**bits:,}" if bits is not None else "-"


def sizes_rows(record: Record) -> Table:
    """A row for each method, a column for each power of ten of pixels."""
    areas = sorted({row["area_px"] for row in record["sizes"]})[::COARSE_STEP]
    cells: dict[str, list[str]] = {}
    for row in record["sizes"]:
        if row["area_px"] in areas:
            own = cells.setdefault(row["method"], [f"`{row['method']}`", row["precision"]])
            own.append(number(row["ns_triangle"]))
    memory = record["memory"]
    floors = [
        ["memset, in the cache", "", *(number(area * memory["frame_ns_byte"]) for area in areas)],
        ["memset, in memory", "", *(number(area * memory["stream_ns_byte"]) for area in areas)],
    ]
    head = [f"{area:,.0f} px" if area >= 1 else f"{area:g} px" for area in areas]
    return ["method", "precision", *head], [*cells.values(), *floors]


def memory_text(record: Record) -> str:
    """The speed of memory in the same run."""
    memory = record["memory"]
    return (
        f"Memory, measured in the same run: `memset` of the frame's {memory['frame_bytes'] / 1e6:.0f} MB sets "
        f"{1 / memory['frame_ns_byte']:.0f} GB/s, of {memory['stream_bytes'] / 1e6:.0f} MB, more than the caches hold, "
        f"{1 / memory['stream_ns_byte']:.0f} GB/s."
    )


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


def tutorial_rows(record: Record) -> Table:
    """A row for each method and pure twin, without variants: pictures a second."""
    rows = [row for row in record["tutorial"] if "/" not in row["method"]]
    base = next((row["fills"] for row in rows if row["method"] == "point_in_triangle"), None)
    cells = []
    for row in rows:
        name = row["method"] if row["is_pure"] else f"`{row['method']}`"
        ratio = f"{row['fills'] / base:.3g}" if base else "-"
        cells.append([name, row["precision"], number(row["calls"]), number(row["fills"]), ratio])
    return ["method", "precision", "calls a second", "fills alone", "x point_in_triangle"], cells


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
