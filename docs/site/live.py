"""Live pictures: `live.json` has the states of the explorer that stand over still pictures, by the pictures' names.

A Sphinx extension: it writes the explorer beside the site's pages, for static/live.js, where the kernels of WebAssembly
are built (`python packaging/wasm.py`). `python docs/site/live.py` saves the still pictures, docs/images/NAME.svg, from
the explorer in Chromium.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from topleft import explore
from topleft._apps.explore.content import content_of
from topleft._apps.explore.static import write_static
from topleft.errors import MissingPackageError

if TYPE_CHECKING:
    from sphinx.application import Sphinx

TABLE = Path(__file__).with_name("live.json")
IMAGES = Path(__file__).resolve().parents[1] / "images"


def save_stills(folder: Path) -> None:
    """Save what each picture shows before it is touched."""
    from playwright.sync_api import sync_playwright

    with explore(wait=False, browser=False) as explorer, sync_playwright() as running:
        page = running.chromium.launch(executable_path=shutil.which("chromium")).new_page()
        for name, one in json.loads(TABLE.read_text(encoding="utf-8")).items():
            page.goto("about:blank")
            page.goto(f"{explorer.url}#pixels={quote(json.dumps(one['state']))}")
            page.wait_for_function("() => document.querySelector('.explorer').app?.parts.pixels.drawn")
            with page.expect_download() as download:
                page.get_by_role("button", name="SVG").click()
            download.value.save_as(folder / f"{name}.svg")


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
    save_stills(IMAGES)
