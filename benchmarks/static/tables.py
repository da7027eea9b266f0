"""Tables of a record of static scenes, for the terminal and, between markers, for docs/measured/static.md."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from benchmarks.harness.records import Record
from benchmarks.report.tables import facts_text, table_text

Row = dict[str, Any]

KINDS = (
    ("10,000,000 triangles seen whole", {"model": "blob 10M", "view": "whole", "cull": "none"}),
    ("the same, back faces culled", {"model": "blob 10M", "view": "whole", "cull": "back"}),
    ("10,000,000 triangles, 5 % of them in view", {"model": "blob 10M", "view": "5 % of it"}),
    ("10,000,000 triangles, seen from inside", {"model": "blob 10M", "view": "inside"}),
    ("200 instances in rows, mostly hidden", {"view": "200 in rows", "verb": "rasterize"}),
)
"""Kinds of scenes, and their rows."""


def lines(record: Record) -> Iterator[str]:
    """The report of one record, Markdown."""
    for name, text in PARTS.items():
        yield text(record)
        if name != list(PARTS)[-1]:
            yield ""


def kinds_text(record: Record) -> str:
    """How many times as fast each kind of scene is, at least and at most."""
    rows = []
    for name, wanted in KINDS:
        own = [row for row in record["rows"] if matches(row, wanted)]
        if own:
            rows.append([name, *least_cells(own)])
    own = record["rows"]
    rows.append(["any scene", *least_cells(own)])
    return table_text(["scene", "least", "where", "most"], rows)


def matches(row: Row, wanted: Mapping[str, Any]) -> bool:
    """Tell whether a row is one of those."""
    return all(row[key] == value for key, value in wanted.items())


def least_cells(rows: list[Row]) -> list[str]:
    """Return the least, where that is, and the most times faster."""
    ordered = sorted(rows, key=faster)
    return [f"{faster(ordered[0]):.2f}", label_of(ordered[0]), f"{faster(ordered[-1]):.3g}"]


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
    """Times faster by number of triangles, size of the picture and culling, a column for each view."""
    blobs = (row for row in record["rows"] if row["kind"] == "blob" and row["verb"] == "rasterize")
    own = [row for row in blobs if row["size"][0] != 512]
    views = list(dict.fromkeys(row["view"] for row in own))
    groups: dict[tuple[Any, ...], dict[str, Row]] = {}
    for row in own:
        groups.setdefault((*row["size"], row["cull"], row["n_triangles"]), {})[row["view"]] = row
    rows = [
        [f"{n:,}", f"{width}x{height}", cull, *(cell_of(of_view.get(view)) for view in views)]
        for (width, height, cull, n), of_view in sorted(groups.items(), key=place_of)
    ]
    return table_text(["triangles", "picture", "cull", *views], rows)


def place_of(item: tuple[tuple[Any, ...], Any]) -> tuple[Any, ...]:
    """Return where a group stands: large pictures first, those without culling first, large meshes first."""
    width, _, cull, n_triangles = item[0]
    return -width, cull != "none", -n_triangles


def cell_of(row: Row | None) -> str:
    """Return times faster, in parentheses where the mesh was drawn whole."""
    if row is None:
        return "-"
    return f"({faster(row):.2f})" if is_whole(row) else f"{faster(row):.2f}"


def details_text(record: Record, wanted: Callable[[Row], bool]) -> str:
    """Times of both ways, and the fates of the clusters."""
    rows = [
        [label_of(row), f"{row['n_triangles']:,}", f"{row['whole_ms'][1]:.3g}", f"{row['ms'][1]:.3g}",
         f"{faster(row):.2f}", "{:.2f} to {:.2f}".format(*row["faster"][::2]), *shares_of(row), paid_after(record, row)]
        for row in record["rows"]
        if wanted(row)
    ]  # fmt: skip
    head = ["scene", "triangles", "whole ms", "planner ms", "times faster", "quartiles"]
    head += ["outside", "turned away", "hidden", "drawn", "paid after"]
    return table_text(head, rows)


def shares_of(row: Row) -> list[str]:
    """Return percent of the clusters by their fates; of a mesh that was drawn whole, nothing."""
    if not row["is_clustered"]:
        return ["-"] * 4
    return [f"{100 * row['shares'][name]:.0f} %" for name in ("outside", "turned", "hidden", "drawn")]


def paid_after(record: Record, row: Row) -> str:
    """Return after how many pictures the clusters have taken less time than they have saved."""
    if not row["is_clustered"]:
        return "-"
    saved = row["whole_ms"][1] - row["ms"][1]
    if saved <= 0:
        return "never"
    build = next(model["build_ms"] for model in record["models"] if model["model"] == row["model"])
    return f"{math.ceil(build / saved) + (row['kind'] != 'instances')}"


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


def first_text(record: Record) -> str:
    """The first two pictures of a mesh, and those that follow."""
    rows = [
        [label_of(row), *(f"{ms:.3g}" for ms in firsts_of(row))]
        for row in record["rows"]
        if row["is_clustered"] and is_plain(row) and row["view"] in ("whole", "above", "200 in rows")
    ]
    return table_text(["scene", "first, whole", "first", "second", "those that follow"], rows)


def firsts_of(row: Row) -> list[float]:
    """Return the milliseconds of the first picture, whole; then of the first, the second and later ones."""
    return [*(float(row[name]) for name in ("whole_first_ms", "first_ms", "second_ms")), float(row["ms"][1])]


def kept_whole_text(record: Record) -> str:
    """Scenes that are drawn whole though clusters are there or could be, and the times with clusters."""
    rows = [
        [label_of(row), f"{row['whole_ms'][1]:.3g}", f"{faster(row):.2f}", f"{row['clusters_faster'][1]:.2f}"]
        for row in record["rows"]
        if is_whole(row) and is_plain(row)
    ]
    if not rows:
        return "There are none."
    return table_text(["scene", "whole ms", "planner: times faster", "clusters: times faster"], rows)


def is_plain(row: Row) -> bool:
    """Tell whether a row is of the verb on its own: HD, nothing culled, a sample a pixel."""
    return row["size"][0] != 512 and matches(row, {"cull": "none", "sampling": "center", "verb": "rasterize"})


def is_large(row: Row) -> bool:
    """Tell whether a row is of the largest blob."""
    return row["model"] == "blob 10M"


def is_instances(row: Row) -> bool:
    """Tell whether a row is of many instances."""
    return row["kind"] == "instances" and is_plain(row)


def is_other(row: Row) -> bool:
    """Tell whether a row is of another mesh, or lit."""
    return (row["kind"] in ("file", "hills", "soup") and is_plain(row)) or (
        row["kind"] == "blob" and row["verb"] == "render"
    )


PARTS: Mapping[str, Callable[[Record], str]] = {
    "static-facts": facts_text,
    "static-kinds": kinds_text,
    "static-blobs": blobs_text,
    "static-large": lambda record: details_text(record, is_large),
    "static-instances": lambda record: details_text(record, is_instances),
    "static-others": lambda record: details_text(record, is_other),
    "static-kept-whole": kept_whole_text,
    "static-models": models_text,
    "static-first": first_text,
}
"""The parts of the page by their markers."""
