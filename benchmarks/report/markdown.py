"""The Markdown that our pages are written in, to HTML: no more of the language than they use.

Headings, paragraphs, lists, tables, code blocks, pictures, links, `code`, *emphasis* and **strong**; comments vanish.
"""

from __future__ import annotations

import html
import re
from collections.abc import Callable

COMMENT = re.compile(r"<!--.*?-->\n?", re.DOTALL)
CODE = re.compile(r"`([^`]+)`")
INLINE: tuple[tuple[re.Pattern[str], str], ...] = (
    (re.compile(r"\*\*(.+?)\*\*"), r"<strong>\1</strong>"),
    (re.compile(r"(?<!\w)\*(?!\s)([^*]+?)(?<!\s)\*(?!\w)"), r"<em>\1</em>"),
)
PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")
LINK = re.compile(r"\[([^\]]+)\]\(([^)]+)\)")

MANY_COLUMNS = 13
"""More than these have to be set smaller on paper."""

Resolve = Callable[[str], str]
"""From the address that a page has to the one that the report has; pictures and links."""


def to_html(text: str, picture: Resolve, link: Resolve) -> str:
    """Return a page as HTML, without head and body."""
    parts = []
    for block in blocks(COMMENT.sub("", text)):
        first = block[0]
        if first.startswith("```"):
            parts.append(f"<pre><code>{html.escape(chr(10).join(block[1:]))}</code></pre>")
        elif found := re.match(r"(#+) (.*)", first):
            level = len(found[1])
            parts.append(f"<h{level}>{inline(found[2], picture, link)}</h{level}>")
        elif first.startswith("|"):
            parts.append(table_html(block, picture, link))
        elif re.match(r"(-|\d+\.) ", first):
            parts.append(list_html(block, picture, link))
        else:
            content = inline(" ".join(block), picture, link)
            tag = "figure" if all(PICTURE.fullmatch(line) for line in block) else "p"
            parts.append(f"<{tag}>{content}</{tag}>")
    return "\n".join(parts)


def blocks(text: str) -> list[list[str]]:
    """Return the lines of each block; a block of code keeps its empty lines and its first mark."""
    found: list[list[str]] = [[]]
    is_code = False
    for line in text.splitlines():
        if line.startswith("```"):
            is_code = not is_code
            if is_code:
                found.append([line])
            else:
                found.append([])
        elif is_code:
            found[-1].append(line)
        elif not line.strip():
            found.append([])
        elif line.startswith("#"):
            found += [[line], []]
        else:
            if found[-1] and line.startswith("|") != found[-1][0].startswith("|"):
                found.append([])
            found[-1].append(line)
    return [block for block in found if block]


def inline(text: str, picture: Resolve, link: Resolve) -> str:
    """Return a line with its marks as HTML; what is between backquotes is taken as it is."""
    pieces = CODE.split(text)
    done = []
    for i, piece in enumerate(pieces):
        if i % 2:
            done.append(f"<code>{html.escape(piece)}</code>")
            continue
        piece = html.escape(piece, quote=False)
        for pattern, replacement in INLINE:
            piece = pattern.sub(replacement, piece)
        done.append(piece)
    joined = PICTURE.sub(lambda found: f'<img alt="{found[1]}" src="{picture(found[2])}">', "".join(done))
    return LINK.sub(lambda found: link_html(found[1], link(found[2])), joined)


def link_html(text: str, address: str) -> str:
    """Return a link, or the text alone where the report does not hold what it leads to."""
    return f'<a href="{address}">{text}</a>' if address else text


def list_html(block: list[str], picture: Resolve, link: Resolve) -> str:
    """Return a list; lines that are indented go on with their item."""
    items: list[str] = []
    for line in block:
        if found := re.match(r"(?:-|\d+\.) (.*)", line):
            items.append(found[1])
        else:
            items[-1] += " " + line.strip()
    tag = "ul" if block[0].startswith("-") else "ol"
    return f"<{tag}>" + "".join(f"<li>{inline(item, picture, link)}</li>" for item in items) + f"</{tag}>"


def table_html(block: list[str], picture: Resolve, link: Resolve) -> str:
    """Return a table; columns that are marked so stand to the right."""
    rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in block]
    head, marks, body = rows[0], rows[1], rows[2:]
    looks = [' class="n"' if mark.endswith(":") else "" for mark in marks]

    def row_html(cells: list[str], tag: str) -> str:
        filled = zip(looks, (inline(cell, picture, link) for cell in cells), strict=True)
        return "<tr>" + "".join(f"<{tag}{look}>{cell}</{tag}>" for look, cell in filled) + "</tr>"

    lines = "".join(row_html(row, "td") for row in body)
    kind = "wide many" if len(head) > MANY_COLUMNS else "wide"
    return f'<div class="{kind}"><table><thead>{row_html(head, "th")}</thead><tbody>{lines}</tbody></table></div>'
