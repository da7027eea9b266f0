"""Tables of a record of static scenes, for the terminal and, between markers, for docs/measured/static.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from benchmarks.harness.records import Record
from benchmarks.report.tables import facts_text, table_text

Row = dict[str, Any]


def lines(record: Record) -> Iterator[str]:
    """The report of one record, Markdown."""
    for name, text in PARTS.items():
        yield text(record)
        if name != list(PARTS)[-1]:
            yield ""


def is_whole(row: Row) -> bool:
    """Tell whether the mesh was drawn whole, not in clusters."""
    return not row["is_clustered"]


def faster(row: Row) -> float:
    """Return how many times as fast as whole, the median over the rounds."""
    return float(row["faster"][1])


def label_of(row: Row) -> str:
    """Name a scene and its call."""
    parts = [row["model"], row["view"]]
    parts += [f"cull {row['cull']}"] if row["cull"] != "none" else []
    parts += [row["sampling"]] if row["sampling"] != "center" else []
    parts += [row["verb"]] if row["verb"] != "rasterize" else []
    parts += ["{}x{}".format(*row["size"])] if row["size"][0] == 512 else []
    return ", ".join(parts)


def blobs_text(record: Record) -> str:
    """Times faster by number of triangles and culling in pictures of 1920x1080, a column for each view."""
    blobs = (row for row in record["rows"] if row["kind"] == "blob" and row["verb"] == "rasterize")
    own = [row for row in blobs if row["size"][0] != 512]
    views = list(dict.fromkeys(row["view"] for row in own))
    groups: dict[tuple[bool, int, str], dict[str, Row]] = {}
    for row in own:
        groups.setdefault((row["cull"] != "none", -row["n_triangles"], row["cull"]), {})[row["view"]] = row
    rows = [
        [f"{-n:,}", cull, *(cell_of(of_view.get(view)) for view in views)]
        for (_, n, cull), of_view in sorted(groups.items())
    ]
    return table_text(["triangles", "cull", *views], rows)


def cell_of(row: Row | None) -> str:
    """Return times faster, in parentheses where the mesh was drawn whole."""
    if row is None:
        return "-"
    return f"({faster(row):.2f})" if is_whole(row) else f"{faster(row):.2f}"


def models_text(record: Record) -> str:
    """The costs of clusters: time, memory, and pictures of the whole mesh in the same time."""
    rows = []
    for model in record["models"]:
        own = [row for row in record["rows"] if row["model"] == model["model"] and row["kind"] != "instances"]
        whole = next((row["whole_ms"][1] for row in own if row["view"] in ("whole", "above")), None)
        n = model["n_triangles"]
        rows.append(
            [model["model"], f"{n:,}", f"{model['n_clusters']:,}", f"{model['build_ms']:.3g}",
             "-" if whole is None else f"{model['build_ms'] / whole:.1f}", f"{1e6 * model['build_ms'] / n:.0f}",
             f"{model['kept_bytes'] / 1e6:.3g}", f"{model['kept_bytes'] / n:.0f}", f"{model['peak_bytes'] / n:.0f}"]
        )  # fmt: skip
    head = ["mesh", "triangles", "clusters", "ms to sort", "pictures", "ns a triangle", "MB kept", "bytes a triangle",
            "at most meanwhile"]  # fmt: skip
    return table_text(head, rows)


PARTS: Mapping[str, Callable[[Record], str]] = {
    "static-facts": facts_text,
    "static-blobs": blobs_text,
    "static-models": models_text,
}
"""The parts of the page by their markers."""
