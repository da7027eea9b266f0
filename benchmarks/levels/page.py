"""docs/measured/levels.md and its chart, from a record of levels of detail."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.harness.records import write_whole
from benchmarks.report.tables import table, table_text

HEAD = """\
# Levels of detail

A mesh of ten million triangles that is a hundred pixels high shows nothing that ten thousand would not. `tolerance=`
says by how many pixels an outline may be off, and the coarsest level is drawn that is sure to be within:

```python
picture = tl.render(mesh, camera, (1920, 1080), tolerance=0.5)    # levels are made at the first use, and kept
levels = tl.simplify(mesh)                                        # or beforehand
levels.save("mesh-levels.npz")
tl.Levels.load("mesh-levels.npz", mesh)
print(tl.plan(mesh, camera, (1920, 1080), tolerance=0.5).explain())
```

`pip install fast-simplification` gets [fast-simplification](https://pypi.org/project/fast-simplification/), which
collapses edges. It promises nothing about the result; the bound does: each level is measured against the mesh, and no
point of either surface is farther from the other than `level.bound`. What that is in pixels depends on the view, and
`tl.choose_detail` tells it: for each level the most that any point that shows can be off.

The chart shows, for each mesh and each height in the picture, all levels: how far outlines really are off, and what
drawing takes. Filled: the level that is drawn at a tolerance of {tolerance} px. All of this is made by
`python -m benchmarks levels`.

![Time against error of levels, by mesh and height](../images/levels.png)
"""


def rows_of(mesh: dict[str, Any], head: str = "mesh seen") -> tuple[list[str], list[list[str]]]:
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


def page(record: dict[str, Any]) -> str:
    """Return docs/measured/levels.md."""
    machine = record["machine"]
    width, height = record["size"]
    parts = [HEAD.format(tolerance=record["tolerance"])]
    parts.append(
        f"Measured {record['date'][:10]} on {machine['cpu']}, {record['isa']}: `rasterize` of {width}x{height} pixels "
        f'on one thread, on memory that is kept, the best of {record["rounds"]} rounds in turns. "Measured" is how '
        "far a sample of one outline lies from the other, to the spacing of samples (an eighth of a pixel for small "
        "pictures of the mesh, a whole one for the largest): one sample more or less counts as that, whatever the "
        'bound. "Full" and "level" are drawn from arrays, "in clusters" is the full mesh as one that is drawn '
        'again; "faster" is the level beside the first, and beside the second.\n'
    )
    for mesh in record["meshes"]:
        parts.append(f"## {mesh['name']}, {mesh['n_triangles']:,} triangles\n")
        parts.append(f"Levels were made in {mesh['made_s']:.1f} s of CPU time.\n")
        counts = [["level", *(str(i) for i in range(len(mesh["levels"])))]]
        counts.append(["triangles", *(f"{one['n_triangles']:,}" for one in mesh["levels"])])
        counts.append(["bound, of the size", *(f"{one['bound']:.1e}" for one in mesh["levels"])])
        counts.append(["known, of the size", *(f"{one['known']:.1e}" for one in mesh["levels"])])
        parts.append(table_text(counts[0], counts[1:]) + "\n")
        parts.append(table_text(*rows_of(mesh)) + "\n")
    return "\n".join(parts)


def lines(record: dict[str, Any]) -> Sequence[str]:
    """Return the tables."""
    found = []
    for mesh in record["meshes"]:
        found += ["", *table(*rows_of(mesh, f"{mesh['name']}, {mesh['n_triangles']:,}"))]
    return found


def write_page(record: dict[str, Any], docs: Path) -> list[Path]:
    """Write the page and its chart."""
    from benchmarks.levels.charts import chart_png

    found = {docs / "measured" / "levels.md": page(record).encode(), docs / "images" / "levels.png": chart_png(record)}
    for path, data in found.items():
        write_whole(path, data)
    return list(found)
