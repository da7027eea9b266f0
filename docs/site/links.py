"""Links of the pages on the site: what lies outside of docs/ leads to its page here, or is text without a link.

The pages are written for readers of the repository, with links to files beside them. A Sphinx extension.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"

#: Files with a page on the site, by their path in the repository.
PAGES = {
    "README.md": "index.rst",
    "docs/README.md": "pages.txt",
    "docs/guide/examples.md": "gallery/index.txt",
    "CONTRIBUTING.md": "project/contributing.txt",
    "CHANGELOG.md": "project/changelog.txt",
    "SECURITY.md": "project/security.txt",
    "benchmarks/README.md": "project/benchmarks.txt",
}
CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"(!?)\[([^\[\]]*)\]\(([^()\s]+)\)")


def relinked(text: str, path: Path, page: Path) -> str:
    """Return the text of a file with its links as they must be where a page of the site shows it."""

    def link(match: re.Match[str]) -> str:
        mark, words, address = match.groups()
        if re.match(r"[a-z]+:|#", address):
            return match[0]
        name, _, part = address.partition("#")
        target = (path.parent / name).resolve()
        place = target.relative_to(ROOT).as_posix()
        if place in PAGES:
            target = DOCS / PAGES[place]
        elif found := re.fullmatch(r"examples/(\w+)\.py", place):
            target = DOCS / f"gallery/{found[1]}.rst"
        elif found := re.fullmatch(r"docs/images/example-(\w+\.png)", place):
            target = DOCS / "gallery" / found[1] if path.name == "examples.md" else target
        elif DOCS not in target.parents:
            return words
        words = "" if words == Path(name).name else words  # the title of the page stands for the name of its file
        return f"{mark}[{words}]({os.path.relpath(target, page.parent)}{'#' + part if part else ''})"

    parts, last = [], 0
    for code in CODE.finditer(text):  # a link may hold code, so it is put aside, not skipped
        parts += [text[last : code.start()], f"\0{code[0]}\0"]
        last = code.end()
    kept = [part for part in parts if part.startswith("\0")]
    marked = "".join("\1" if part.startswith("\0") else part for part in [*parts, text[last:]])
    done = iter(kept)
    return re.sub("\1", lambda _: next(done).strip("\0"), LINK.sub(link, marked))


def read(app: Sphinx, name: str, source: list[str]) -> None:
    """Mend the links of a page; of a .txt page, which names a file of the repository in its first line, put that in."""
    page = Path(app.env.doc2path(name))
    if page.suffix == ".txt":
        path, _, rest = source[0].partition("\n")
        source[0] = relinked((ROOT / path).read_text(encoding="utf-8"), ROOT / path, page) + rest
    elif page.suffix == ".md":
        source[0] = relinked(source[0], page, page)


def setup(app: Sphinx) -> dict[str, bool]:
    """Let Sphinx call `read` for each page."""
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
