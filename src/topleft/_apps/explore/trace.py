"""Records how a method draws, step by step: for a teacher who plays, pauses and goes back.

In: triangles in pixels and the name of a method. Out: `Trace`, the steps of the method's pure twin with the numbers
that decide each of them. Nothing is computed here: what is shown is what the twin did.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import overdraw
from topleft._apps.explore.session import Reply, Request, Session
from topleft._core.base.arrays import as_size
from topleft.methods import CLASSICS, METHODS, find_method

#: The methods that have a pure twin with steps.
TRACED = (*(name for name in METHODS if name != "auto"), *CLASSICS)

MAX_STEPS = 40_000
"""Of a trace: 10 MB on the way to the page."""

MAX_ORIGIN_PX, MAX_SIDE_PX, MAX_TRIANGLES = 1024, 1024, 1000


class TraceStep(NamedTuple):
    """One thing that a twin did.

    Attributes
    ----------
    kind : str
        "triangle": it was set up. "row": a row begins. "line": a line passes a pixel. "test": a pixel was asked.
        "span": the pixels x to `last` were drawn.
    triangle : int
    x, y, last : int
        Pixels; `last` is x where it is one.
    is_drawn : bool
        Whether these pixels were drawn by this step.
    values : mapping of str to numbers
        What decided it.
    """

    kind: str
    triangle: int
    x: int
    y: int
    last: int
    is_drawn: bool
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Trace:
    """How a method draws triangles. Made by `trace`.

    Attributes
    ----------
    method : str
    size : (int, int)
    steps : tuple of TraceStep
    counts : ndarray of int32, shape (H, W)
        The picture of the twin: how often each pixel is drawn.
    """

    method: str
    size: tuple[int, int]
    steps: tuple[TraceStep, ...]
    counts: NDArray[np.int32]

    def picture(self, n_steps: int | None = None) -> NDArray[np.int32]:
        """Return how often each pixel has been drawn after so many steps, all of them unless given."""
        counts = np.zeros_like(self.counts)
        for step in self.steps[:n_steps]:
            if step.is_drawn:
                counts[step.y, step.x : step.last + 1] += 1
        return counts


class Recorder:
    """What a pure twin tells its steps to, of one triangle after the other."""

    def __init__(self, size: tuple[int, int], origin: tuple[int, int] = (0, 0)) -> None:
        """Take steps in that window of the picture."""
        self.steps: list[TraceStep] = []
        self.triangle = 0
        self._size, self._origin = size, origin

    def __call__(self, kind: str, x: int, y: int, **values: Any) -> None:
        """Take a step, or all those of a box."""
        if kind == "box":
            self._take_box(x, y, **values)
            return
        (width, height), (x0, y0) = self._size, self._origin
        first, last, row = max(x - x0, 0), min(values.pop("last", x) - x0, width - 1), y - y0
        if kind == "row" or kind == "triangle":
            first = last = x - x0
        elif first > last or not 0 <= row < height:
            return
        if kind == "row" and not 0 <= row < height:
            return
        is_drawn = bool(values.pop("is_drawn", kind == "span"))
        numbers = {name: plain(value) for name, value in values.items()}
        self._take(TraceStep(kind, self.triangle, first, row, last, is_drawn, numbers))

    def _take_box(self, x: int, y: int, is_drawn: NDArray[np.bool_], **values: NDArray[Any]) -> None:
        skipped = tuple(max(0, o - at) for o, at in zip(self._origin[::-1], (y, x), strict=True))
        part = np.s_[skipped[0] :, skipped[1] :]
        x, y, is_drawn = x + skipped[1] - self._origin[0], y + skipped[0] - self._origin[1], is_drawn[part]
        self._check(is_drawn.size)
        for (row, column), here in np.ndenumerate(is_drawn):
            numbers = {name: plain(array[part][row, column]) for name, array in values.items()}
            at = x + column
            self._take(TraceStep("test", self.triangle, at, y + row, at, bool(here), numbers))

    def _take(self, step: TraceStep) -> None:
        self._check(1)
        self.steps.append(step)

    def _check(self, n: int) -> None:
        if len(self.steps) + n > MAX_STEPS:
            raise ValueError(f"a trace must have {MAX_STEPS} steps at most: draw fewer triangles, or a smaller picture")


def plain(value: Any) -> Any:
    """Return a number, or numbers, as Python has them."""
    if isinstance(value, np.ndarray | tuple | list):
        return [plain(one) for one in value]
    return value.item() if isinstance(value, np.generic) else value


def find_twin(name: str, subpixel_bits: int) -> Callable[..., NDArray[np.int32]]:
    """Return the pure twin of a method: ``twin(vertices, triangles, size, record=...)`` gives counts.

    Raises
    ------
    ValueError
        If there is no such method, or it has no twin.
    """
    method = find_method(name)
    if name not in TRACED:
        raise ValueError(f"method must be one of {', '.join(map(repr, TRACED))} to be traced, got {name!r}")
    module, _, variant = name.partition("/")
    if method.code is not None:
        module, variant = "topleft.methods.twins.walks", name
    else:
        module = f"topleft.methods.twins.{module}"
    draw = import_module(module).overdraw
    options = {"subpixel_bits": subpixel_bits} if method.code is not None or method.has_subpixel_bits else {}

    def twin(vertices: Any, triangles: Any, size: tuple[int, int], record: Recorder) -> NDArray[np.int32]:
        return draw(vertices, triangles, size, variant, record, **options)

    return twin


def trace(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: tuple[int, int],
    *,
    method: str,
    subpixel_bits: int = 8,
    origin: tuple[int, int] = (0, 0),
) -> Trace:
    """Return how a method draws triangles, step by step.

    Parameters
    ----------
    vertices : array_like, shape (V, 2)
        Pixels.
    triangles : array_like of int, shape (T, 3)
    size : (width, height), pixels
    method : str
        One of `TRACED`.
    subpixel_bits : int
        Of a method that has any.
    origin : (x, y), pixels
        Where the window lies in the picture, 0 to 1024: a twin draws from the corner of the picture on.

    Raises
    ------
    ValueError
        As `topleft.overdraw`; for a method without a twin; and where there would be more than 40,000 steps.
    """
    size, draw = as_size(size), find_twin(method, subpixel_bits)
    x, y = (int(at) for at in origin)
    if not 0 <= min(x, y) <= max(x, y) <= MAX_ORIGIN_PX:
        raise ValueError(f"origin must lie in 0 to {MAX_ORIGIN_PX} to be traced, got {(x, y)}")
    if max(size) > MAX_SIDE_PX or len(np.asarray(triangles)) > MAX_TRIANGLES:
        raise ValueError(
            f"a trace must have {MAX_SIDE_PX} pixels a side and {MAX_TRIANGLES} triangles at most, got {size} and "
            f"{len(np.asarray(triangles))}"
        )
    xy = np.asarray(vertices, np.float64)[:, :2]
    found = find_method(method)
    options: dict[str, Any] = {"method": method, "origin": (x, y)}
    if found.code is not None or found.has_subpixel_bits:
        options["subpixel_bits"] = subpixel_bits
    overdraw(xy, triangles, size, **options)  # checks it all
    recorder, counts = Recorder(size, (x, y)), np.zeros((size[1], size[0]), np.int32)
    for i, row in enumerate(np.asarray(triangles).reshape(-1, 3).tolist()):
        recorder.triangle = i
        counts += draw(xy, [row], (x + size[0], y + size[1]), recorder)[y:, x:]
    return Trace(method, size, tuple(recorder.steps), counts)


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
        "about": f"{method.summary[0].upper()}{method.summary[1:]}. {method.source}.",
        "methods": TRACED,
        "outlines": [" ".join(f"{x},{y}" for x, y in corners[row].tolist()) for row in request["triangles"]],
    }
    return Reply(header, {"counts": made.counts})


HANDLERS = {"steps.trace": answer}
