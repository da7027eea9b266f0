"""A plan as text. In: the mapping of `Plan.to_dict`. Out: a string."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

WIDTH = 110
INDENT = " " * 12

#: Stages whose time contains the time of other stages.
WHOLE = ("snap", "method")


def as_text(plan: Mapping[str, Any]) -> str:
    """Return a plan as lines of at most 110 characters."""
    lines = [title(plan), ""]
    lines.append(f"{'stage':<12}{'choice':<{WIDTH - 24}}{'measured':>12}")
    for stage in plan["stages"]:
        first, *others = wrap(stage["choice"], WIDTH - 26)
        lines.append(f"{stage['name']:<12}{first:<{WIDTH - 24}}{time_of(stage):>12}".rstrip())
        lines += [INDENT + line for line in others]
        lines += paragraph("why: ", stage["why"])
        for rejected in stage["rejected"]:
            lines += paragraph("not: ", rejected)
    if plan["measured_ms"] is not None:
        lines.append(f"{'':<12}{'in all':<{WIDTH - 24}}{milliseconds(plan['measured_ms']):>12}")
    return "\n".join(lines)


def title(plan: Mapping[str, Any]) -> str:
    """Return the draw in a line: verb, outputs, sizes, threads."""
    width, height = plan["size"]
    n_threads = plan["threads"]
    return (
        f"{plan['verb']} -> {', '.join(plan['outputs'])}: {width}x{height} pixels, {plan['n_triangles']:,} triangles, "
        f"{plan['n_vertices']:,} vertices, {n_threads} thread{'s' * (n_threads > 1)}"
    )


def wrap(text: str, width: int) -> list[str]:
    """Return a text as lines, at least one."""
    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False) or [""]


def paragraph(head: str, text: str) -> list[str]:
    """Return a text with a hanging head."""
    first, *others = wrap(text, WIDTH - len(INDENT) - len(head))
    return [INDENT + head + first, *(INDENT + " " * len(head) + line for line in others)]


def time_of(stage: Mapping[str, Any]) -> str:
    """Return the measured time of a stage, or which stage it is a part of."""
    if stage["measured_ms"] is not None:
        return milliseconds(stage["measured_ms"])
    return f"in {stage['timed_in']}" if stage["timed_in"] in WHOLE else ""


def milliseconds(ms: float) -> str:
    """Return a time in a unit that fits it."""
    return f"{ms:.1f} ms" if ms >= 10 else f"{ms:.2f} ms" if ms >= 0.1 else f"{1000 * ms:.0f} us"
