"""The gallery: a page for each program of examples/, with its code and the picture that it makes now.

A Sphinx extension. It writes docs/gallery, which is not kept. A program whose packages are missing shows the picture
that the repository keeps, and the build says so.
"""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util import logging

ROOT = Path(__file__).resolve().parents[2]
GALLERY = ROOT / "docs/gallery"
LISTED = ROOT / "docs/guide/examples.md"

PAGE = """\
{title}
{line}

{text}

.. image:: {name}.png

.. literalinclude:: ../../examples/{name}.py
   :language: python
"""
INDEX = """\
docs/guide/examples.md

```{{toctree}}
:hidden:

{pages}
```
"""


def make(_: Sphinx) -> None:
    """Write the pages and pictures of the gallery."""
    GALLERY.mkdir(exist_ok=True)
    titles = {name: title for title, name in re.findall(r"^## (.*)\n\n\[examples/(\w+)\.py", LISTED.read_text(), re.M)}
    with ThreadPoolExecutor() as pool:
        for told in pool.map(draw, titles):
            if told:
                logging.getLogger(__name__).info(told)
    for name, title in titles.items():
        about = ast.get_docstring(ast.parse((ROOT / f"examples/{name}.py").read_text())) or ""
        text = re.sub(r"`([^`]*)`", r"``\1``", about)
        write(GALLERY / f"{name}.rst", PAGE.format(title=title, line="=" * len(title), text=text, name=name))
    write(GALLERY / "index.txt", INDEX.format(pages="\n".join(titles)))


def draw(name: str) -> str:
    """Run a program; returns what there is to say."""
    picture = GALLERY / f"{name}.png"
    command = [sys.executable, str(ROOT / f"examples/{name}.py"), "-o", str(picture)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return ""
    missing = re.search(r"^ModuleNotFoundError: (.*)$|^topleft.*MissingPackageError: (.*)$", done.stderr, re.M)
    if not missing:
        raise RuntimeError(f"examples/{name}.py: {done.stderr}")
    shutil.copyfile(ROOT / f"docs/images/example-{name}.png", picture)
    return f"gallery: {name} shows the kept picture: {missing[0]}"


def write(path: Path, text: str) -> None:
    """Write a page, unless it stands there: Sphinx reads again what is newer than its last look."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def setup(app: Sphinx) -> dict[str, bool]:
    """Let Sphinx call `make` before it reads."""
    app.connect("builder-inited", make)
    return {"parallel_read_safe": True}
