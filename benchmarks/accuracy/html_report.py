"""A report in one HTML file that needs nothing else: the pages of the documentation, with a record's own figures.

In: an accuracy record and the folder of the pages. Tables between markers are made anew from the record, charts are
drawn from it and embedded as SVG; other pictures are embedded as they are. A page that is not there is left out.
"""

from __future__ import annotations

import base64
import html
import posixpath
import re
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

from benchmarks.accuracy import tables
from benchmarks.accuracy.charts import CHARTS, chart_svg
from benchmarks.accuracy.study import PARTS
from benchmarks.report import pages
from benchmarks.report.markdown import to_html

PAGES = (
    "measured/accuracy.md", "measured/speed.md", "measured/atlas.md", "guide/methods.md",
    "measured/levels.md", "measured/pictures.md", "measured/choices.md", "measured/static.md",
)  # fmt: skip
"""In the order of the report."""

TYPES = {".svg": "image/svg+xml", ".png": "image/png", ".jpg": "image/jpeg"}

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; color: #1c1c1c; background: #fff;
       max-width: 70rem; margin: 2rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 3rem 0 .8rem; border-top: 2px solid #1c1c1c; padding-top: 1rem; }
header h1 { border: 0; margin-top: 0; padding-top: 0; font-size: 2.1rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; }
p, li { max-width: 46rem; }
li { margin: .25rem 0; }
img { max-width: 100%; height: auto; display: block; margin: 1rem 0; }
figure { margin: 1rem 0; max-width: 60rem; }
td img { margin: 0; image-rendering: pixelated; }
code, pre { font: .86em/1.45 ui-monospace, Consolas, "DejaVu Sans Mono", monospace; }
code { background: #f3f3f0; padding: .05em .25em; border-radius: 3px; }
td code { white-space: nowrap; }
td code, pre code { background: none; padding: 0; }
pre { background: #f6f6f3; padding: .8rem 1rem; overflow-x: auto; }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-size: .84rem; line-height: 1.3; }
th, td { padding: .22rem .55rem; text-align: left; border-bottom: 1px solid #e3e3de; }
th { border-bottom: 1.5px solid #1c1c1c; vertical-align: bottom; }
.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tbody tr:hover { background: #f7f7f2; }
a { color: #0b5a8f; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1.2rem; margin: 1rem 0; }
dt { color: #666; }
dd { margin: 0; }
nav > ul { display: flex; flex-wrap: wrap; gap: 0 2.5rem; padding: 0; list-style: none; }
nav li ul { padding-left: 1.1rem; font-size: .92rem; }
@media print {
  body { font-size: 10pt; max-width: none; margin: 0; }
  section + section h1 { break-before: page; }
  h2, h3 { break-after: avoid; } figure, tr { break-inside: avoid; } nav { display: none; }
  figure img { max-height: 15.5cm; }
  .wide { overflow: visible; } table { font-size: 6.6pt; } th, td { padding: .1rem .25rem; }
  .many table { font-size: 4pt; } .many th, .many td { padding: .1rem; } .many code { white-space: normal; }
}
"""


def make_report(record: dict[str, Any], folder: Path) -> str:
    """Return the report as HTML.

    Raises
    ------
    ValueError
        If the record lacks a part that a page shows.
    """
    found = [name for name in PAGES if (folder / name).is_file()]
    bodies, contents = [], []
    for name in found:
        text = (folder / name).read_text(encoding="utf-8")
        if pages.MARKED.search(text):
            text = with_own_parts(text, record)
        body = to_html(text, partial(picture_data, record, (folder / name).parent), partial(link_to, found, name))
        bodies.append(f'<section id="{anchor(name)}">\n{name_sections(body, name)}\n</section>')
        contents.append(contents_html(body, name))
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>topleft: speed and accuracy</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"<header>\n<h1>topleft: every method, its speed and its errors</h1>\n{facts_html(record)}\n"
        f"<nav><ul>{''.join(contents)}</ul></nav>\n</header>\n" + "\n".join(bodies) + "\n</body>\n</html>\n"
    )


def with_own_parts(text: str, record: dict[str, Any]) -> str:
    """Return the page with this record's figures; the markers of other records keep what they hold."""
    known = {name for _, name, _, _ in pages.MARKED.findall(text)} <= PARTS.keys()
    return pages.with_parts(text, record, PARTS) if known else text


def facts_html(record: dict[str, Any]) -> str:
    """Return what the figures belong to, as a list."""
    machine = record["machine"]
    rows = record.get("peers", []) + record.get("antialiasing", [])
    versions = dict.fromkeys(row["gives"].partition(",")[0] for row in rows if "gives" in row)
    facts = {
        "Machine": f"{machine['cpu']}; {machine['cpus']} CPUs, {machine['memory_gib']} GiB, {machine['architecture']}",
        "System": f"{machine['system']}, Python {machine['python']}, NumPy {record['versions']['numpy']}",
        "topleft": f"{record['versions']['topleft']}, instruction set {record['isa']}",
        "Measured": tables.commits_text(record),
        "Beside": ", ".join(versions) or "nothing",
    }
    items = "".join(f"<dt>{name}</dt><dd>{html.escape(text)}</dd>" for name, text in facts.items())
    return f"<dl>{items}</dl>"


def picture_data(record: dict[str, Any], folder: Path, address: str) -> str:
    """Return a picture as a data URI: a chart of the record by the name of its file, any other file as it is."""
    path = folder / address
    if path.stem in CHARTS:
        data, suffix = chart_svg(record, path.stem), ".svg"
    else:
        data, suffix = path.read_bytes(), path.suffix
    return f"data:{TYPES[suffix]};base64,{base64.b64encode(data).decode()}"


def link_to(found: list[str], page: str, address: str) -> str:
    """Return where a link of a page leads: to a page of the report, or out; nothing for files that it lacks."""
    target = posixpath.normpath(posixpath.join(posixpath.dirname(page), address.partition("#")[0]))
    if target in found:
        return f"#{anchor(target)}"
    return address if address.startswith(("https://", "http://")) else ""


def anchor(name: str) -> str:
    """Return the id of a page."""
    return PurePosixPath(name).stem


def name_sections(body: str, page: str) -> str:
    """Return the page with an id for each section."""
    numbers = iter(range(1, 1000))
    return re.sub("<h2>", lambda _: f'<h2 id="{anchor(page)}-{next(numbers)}">', body)


def contents_html(body: str, page: str) -> str:
    """Return an entry of the table of contents, with the sections of the page."""
    title = re.search("<h1>(.*?)</h1>", body)
    sections = re.findall("<h2>(.*?)</h2>", body)
    inner = "".join(f'<li><a href="#{anchor(page)}-{i}">{text}</a></li>' for i, text in enumerate(sections, 1))
    return f'<li><a href="#{anchor(page)}">{title[1] if title else page}</a><ul>{inner}</ul></li>'
