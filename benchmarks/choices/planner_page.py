"""docs/measured/planner.md: what a plan says, of two scenes. `python -m benchmarks planner` writes it."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.harness.machine import PAGES
from benchmarks.harness.records import Record, Save, write_text
from benchmarks.report.study import Study
from topleft.scenes import blob, shape

PAGE = PAGES / "planner.md"

HEAD = """\
# What a scene needs, and why

`tl.plan` says how a scene is drawn before it is drawn: what is chosen at each stage, why, and what was left out.
The picture never changes: `tests/plan/test_choices.py` draws thousands of scenes with each choice forced on and off,
and compares bits. On the command line: `topleft explain MESH`.

```python
plan = tl.plan(vertices, triangles, (1920, 1080), transform=matrix)
print(plan.explain())
frags = tl.rasterize(vertices, triangles, (1920, 1080), transform=next_matrix, plan=plan)

print(tl.plan(mesh, camera, (1920, 1080)).explain())  # of a Mesh, which does not change
```

With `plan=` a verb takes the triangles that the plan has converted and checked, and the plan's threads. Vertices,
transform, origin and viewport may change from frame to frame; size, sampling, method, cull, sub-pixel bits, triangles
and the number of vertices may not (`ValueError`). The array of triangles that the plan was made from is taken to be
what it was then: the plan has a copy. After such a call, or `plan.measure()`, the column *measured* is filled.
`plan.to_dict()` holds all of it for JSON.

| row | what it tells |
|---|---|
| input | whether vertices and indices are read where they are or copied; the time includes the call itself |
| detail | of a mesh: the level of detail that is drawn, and how far off its outline may be ([levels.md](levels.md)) |
| clusters | of a mesh: what is left out of its clusters, or why it is drawn whole ([static.md](static.md)) |
| transform | none for pixels; the matrix; whether there is a divide by w |
| clip | how many triangles the near and far planes cut, and into how many pieces |
| snap | sub-pixel bits; the time is that of transform and snap, which are one pass over the vertices |
| arithmetic | how many triangles need 32, 64 or 128 bits |
| cull | how many triangles cannot cover a sample, and why |
| method | how many triangles each piece of drawing code takes; the time of the whole draw |
| depth | what is kept of a pixel, and whether depths are compared at all |
| sampling | where a pixel is sampled |
| shade | what is computed from ids afterwards, and for which outputs |
| threads | how many, and what each of them takes |
| memory | bytes of scratch, of results, and at most, before anything is allocated |

*Choices* and *estimates* follow from a table of costs per vertex, triangle and pixel. That of one machine ships with
the package; `topleft calibrate` measures yours within a minute, and keeps the result in `~/.cache/topleft/costs.json`
(`$XDG_CACHE_HOME`). The last line of each plan says whose costs they are, and how far off they were for scenes that
were not fitted. They are for memory that is kept, as a `Rasterizer` does, and for threads that have a core each.

[choices.md](choices.md) has each choice beside what could have been chosen, estimates beside measurements, and what a
plan takes.

The plans below were written by `python -m benchmarks planner`, measured on the machine that they name.
"""

PERSPECTIVE = np.array([[0.6, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, -1, 1], [0, 0, -1, 3]])


def scenes() -> Iterator[tuple[str, tuple[Any, ...], dict[str, Any]]]:
    """Give a title, the arrays and size, and options."""
    size = (1920, 1080)
    yield "A knot in perspective", (*shape("torus-knot"), size), {"transform": PERSPECTIVE, "threads": 1}
    camera = tl.Camera.framing(mesh := tl.Mesh(*blob(1_000_000)), aspect=16 / 9)
    yield "A mesh of a million triangles, drawn again", (mesh, camera, size), {"threads": 1}


def page() -> str:
    """Return the page."""
    parts = [HEAD]
    for title, arguments, options in scenes():
        plan = tl.plan(*arguments, **options).measure()
        parts.append(f"## {title}\n\n```\n{plan.explain()}\n```\n")
    return "\n".join(parts)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--out", type=Path, default=PAGE, metavar="PAGE.md")


def run(arguments: argparse.Namespace, _: Save) -> Record:
    """Write the page with the costs that ship; the record is where it is."""
    with TemporaryDirectory() as empty:
        os.environ["XDG_CACHE_HOME"] = empty
        write_text(arguments.out, page())
    return {"kind": "planner", "path": str(arguments.out)}


STUDY = Study("planner", "write the page of plans of two scenes", add_arguments, run, lambda record: [record["path"]])
