"""Live pictures: `live.json` has the states of the explorer that stand over still pictures, by the pictures' names.

A Sphinx extension: it writes the explorer beside the site's pages, for static/live.js, where the kernels of WebAssembly
are built (`python packaging/wasm.py`). `python docs/site/live.py` draws the still pictures, docs/images/NAME.svg.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from topleft._apps.explore.content import content_of
from topleft._apps.explore.export import grid
from topleft._apps.explore.state import parse_state
from topleft._apps.explore.static import write_static
from topleft.errors import MissingPackageError

if TYPE_CHECKING:
    from sphinx.application import Sphinx

TABLE = Path(__file__).with_name("live.json")
IMAGES = Path(__file__).resolve().parents[1] / "images"


def draw_stills(folder: Path) -> list[Path]:
    """Draw what each picture shows before it is touched."""
    drawn = []
    for name, one in json.loads(TABLE.read_text(encoding="utf-8")).items():
        drawn.append(folder / f"{name}.svg")
        grid(parse_state(one["state"]), str(drawn[-1]))
    return drawn


def write_explorer(app: Sphinx, error: Exception | None) -> None:
    """Write the explorer and the table into the site."""
    if error is not None or app.builder.format != "html":
        return
    folder = Path(app.outdir, "_static", "explorer")
    try:
        write_static(folder, content_of(None, None, None))
    except MissingPackageError as missing:
        from sphinx.util import logging

        logging.getLogger(__name__).info(f"pictures are still: {missing}")
        return
    shutil.copyfile(TABLE, folder / TABLE.name)


def setup(app: Sphinx) -> dict[str, bool]:
    """Let Sphinx call `write_explorer` at the end."""
    app.add_js_file("live.js")
    app.connect("build-finished", write_explorer)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    draw_stills(IMAGES)
