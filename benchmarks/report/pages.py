"""Pages of the documentation that show parts of a record, between markers."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from benchmarks.harness.records import Record

MARKED = re.compile(r"(<!-- table: ([\w-]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def with_parts(text: str, record: Record, parts: Mapping[str, Callable[[Record], str | None]]) -> str:
    """Return a page with the text between its markers made anew by `parts`; a part that gives None stays.

    Raises
    ------
    ValueError
        If the page has no marker or an unknown one, or the record lacks rows of one.
    """

    def made(found: re.Match[str]) -> str:
        head, name, _, end = found.groups()
        if name not in parts:
            raise ValueError(f"a marker must be one of {', '.join(parts)}, got {name!r}")
        try:
            part = parts[name](record)
        except KeyError as key:
            raise ValueError(f"the record must hold {key} for {name!r}: measure that part") from None
        return found[0] if part is None else f"{head}{part}\n{end}"

    page, n = MARKED.subn(made, text)
    if not n:
        raise ValueError("the page must hold <!-- table: NAME --> and <!-- end --> after it")
    return page
