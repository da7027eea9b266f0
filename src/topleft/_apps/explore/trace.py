"""Records how a method draws, step by step: for a teacher who plays, pauses and goes back.

In: triangles in pixels and the name of a method. Out: `Trace`, the steps of the method's kernel with the numbers that
decide each of them. Nothing is computed here: the kernel is compiled a second time with its steps told (steps.h).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import overdraw
from topleft._apps.explore.session import Reply, Request, Session
from topleft._core.base.arrays import as_size
from topleft.methods import CLASSICS, METHODS, Method, find_method
from topleft.methods.classics import classic_kernels

#: The methods that tell their steps.
TRACED = (*(name for name in METHODS if name != "auto"), *CLASSICS)

MAX_STEPS = 40_000
"""Of a trace: 10 MB on the way to the page."""

MAX_SIDE_PX, MAX_TRIANGLES = 1024, 1000
MAX_SUBPIXELS = 2**60
"""Of a vertex: sums of products of its coordinates have 128 bits."""

HEAD_WORDS, MOST_WORDS = 6, 24
"""Words of a step before its numbers, and with them; the set-up of a triangle has up to twice as many."""


class TraceStep(NamedTuple):
    """One thing that a method did."""

    kind: str  # a triangle set up, a row begun, a line that passes a pixel, a test of one, a span from x to last
    triangle: int
    x: int
    y: int
    last: int  # x where it is one pixel
    is_drawn: bool  # whether these pixels were drawn by this step
    values: Mapping[str, Any]  # what decided it


@dataclass(frozen=True)
class Trace:
    """How a method draws triangles. Made by `trace`."""

    method: str
    size: tuple[int, int]
    steps: tuple[TraceStep, ...]
    counts: NDArray[np.int32]  # (H, W): how often each pixel is drawn

    def picture(self, n_steps: int | None = None) -> NDArray[np.int32]:
        """Return how often each pixel has been drawn after so many steps, all of them unless given."""
        counts = np.zeros_like(self.counts)
        for step in self.steps[:n_steps]:
            if step.is_drawn:
                counts[step.y, step.x : step.last + 1] += 1
        return counts


def trace(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: tuple[int, int],
    *,
    method: str,
    subpixel_bits: int = 8,
    origin: tuple[int, int] = (0, 0),
) -> Trace:
    """Return how a method of `TRACED` draws triangles, step by step; arguments as of `topleft.overdraw`."""
    size, found = as_size(size), find_method(method)
    if method not in TRACED:
        raise ValueError(f"method must be one of {', '.join(map(repr, TRACED))} to be traced, got {method!r}")
    x, y = (int(at) for at in origin)
    if max(size) > MAX_SIDE_PX or len(np.asarray(triangles)) > MAX_TRIANGLES:
        raise ValueError(
            f"a trace must have {MAX_SIDE_PX} pixels a side and {MAX_TRIANGLES} triangles at most, got {size} and "
            f"{len(np.asarray(triangles))}"
        )
    xy = np.array(np.asarray(vertices, np.float64)[:, :2], order="C")
    corners = np.ascontiguousarray(triangles, np.int32).reshape(-1, 3)
    options: dict[str, Any] = {"method": method, "origin": (x, y)}
    if found.code is not None or found.has_subpixel_bits:
        options["subpixel_bits"] = subpixel_bits
    overdraw(xy, corners, size, **options)  # checks it all
    if found.code is not None and (far := abs(xy[corners]).max(initial=0) * 2.0**subpixel_bits) >= MAX_SUBPIXELS:
        raise ValueError(f"vertices must lie within 2**60 sub-pixels of 0 to be traced, got {far:.6g}")
    return Trace(method, size, *recorded(xy, corners, (x, y, *size), method, options.get("subpixel_bits", 8)))


def recorded(
    xy: NDArray[np.float64], triangles: NDArray[np.int32], window: tuple[int, int, int, int], method: str, bits: int
) -> tuple[tuple[TraceStep, ...], NDArray[np.int32]]:
    """Return the steps, and how often each pixel is drawn."""
    counts = np.zeros(window[:1:-1], np.int32)
    words = np.empty(MOST_WORDS * (MAX_STEPS + len(triangles)), np.int64)
    if (n := classic_kernels.trace(method, xy, triangles, counts, window, words, bits)) > MAX_STEPS:
        raise ValueError(f"a trace must have {MAX_STEPS} steps at most: draw fewer triangles, or a smaller picture")
    kinds, steps, at = classic_kernels.list_kinds(), [], 0
    for _ in range(n):
        kind, triangle, x, y, last, is_drawn = words[at : at + HEAD_WORDS].tolist()
        at += HEAD_WORDS
        name, side, is_real, numbers = kinds[kind]
        values: dict[str, Any] = {"side": side} if side else {}
        for number, length in numbers:
            pairs = words[at : at + 2 * length]
            at += 2 * length
            if is_real:
                own = pairs.view(np.float64)[::2].tolist()
            else:
                own = [(high << 64) + low % 2**64 for low, high in pairs.reshape(-1, 2).tolist()]
            values[number] = own[0] if length == 1 else own
        steps.append(TraceStep(name, triangle, x, y, last, bool(is_drawn), values))
    return tuple(steps), counts


def told(steps: Sequence[TraceStep]) -> Iterator[tuple[str, list[tuple[str, str, str]]]]:
    """Yield a sentence, and its values as name, text, and what it changed by since the last of its kind."""
    before: dict[tuple[str, int], Mapping[str, Any]] = {}
    for step in steps:
        x, y, values = step.x, step.y, step.values
        is_in = "drawn" if step.is_drawn else "inside" if values.get("is_inside") else "outside"
        sentence = {
            "triangle": f"Triangle {step.triangle} is set up.",
            "row": f"Row {y} of triangle {step.triangle}.",
            "line": f"The {values.get('side')} line passes pixel {x}, {y}.",
            "test": f"Pixel {x}, {y} of triangle {step.triangle}: {is_in}.",
            "span": f"Pixels {x} to {step.last} of row {y} are drawn.",
        }[step.kind]
        last = before.get((step.kind, step.triangle), {})
        numbers = {name: value for name, value in values.items() if name not in ("is_inside", "side")}
        yield sentence, [(name, text_of(value), change_of(last.get(name), value)) for name, value in numbers.items()]
        before[step.kind, step.triangle] = values


def text_of(value: Any) -> str:
    """Return a value as it is read."""
    if isinstance(value, list):
        return ", ".join(map(text_of, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def change_of(before: Any, value: Any) -> str:
    """Return by what a number has changed, "" where there is none to compare with."""
    if not (isinstance(before, int | float) and isinstance(value, int | float)):
        return ""
    return f"{value - before:+.6g}"


def about(method: Method) -> str:
    """What a page says of a method."""
    return f"{method.summary[0].upper()}{method.summary[1:]}. {method.source}."


def answer(_: Session, request: Request) -> Reply:
    """Answer the page: steps as lists [x, y, last, is drawn, triangle, kind, sentence, values], and the outlines."""
    origin = tuple(request.get("origin", (0, 0)))
    made = trace(
        request["vertices"],
        request["triangles"],
        tuple(request["size"]),
        method=request["method"],
        subpixel_bits=int(request.get("subpixel_bits", 8)),
        origin=origin,
    )
    method = find_method(made.method)
    corners = np.asarray(request["vertices"], np.float64)[:, :2] - origin
    steps = [
        (step.x, step.y, step.last, step.is_drawn, step.triangle, step.kind, *words)
        for step, words in zip(made.steps, told(made.steps), strict=True)
    ]
    header = {
        "size": made.size,
        "steps": steps,
        "about": about(method),
        "methods": TRACED,
        "outlines": [" ".join(f"{x},{y}" for x, y in corners[row].tolist()) for row in request["triangles"]],
    }
    return Reply(header, {"counts": made.counts})


HANDLERS = {"steps.trace": answer}
