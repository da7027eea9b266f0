"""Ways to draw the same bits, in this process and in turns: each puts values in the place of the library's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.turns import Clock, turn_of

Picture = tuple[NDArray[Any], ...]
Draw = Callable[[], Picture]
Forced = tuple[tuple[Any, str, Any], ...]

HOPELESS = 4.0
"""A way that takes so many times as long as the planner's sits out after the first round."""


@dataclass(frozen=True)
class Way:
    """A way to draw: its name, what draws, and what it puts in place of what."""

    name: str
    draw: Draw
    forced: Forced = ()

    @contextmanager
    def in_force(self) -> Iterator[None]:
        """Put values in place, and back."""
        kept = [(where, name, getattr(where, name)) for where, name, _ in self.forced]
        try:
            for where, name, value in self.forced:
                setattr(where, name, value)
            yield
        finally:
            for where, name, value in kept:
                setattr(where, name, value)


Ways = list[Way]
"""The planner's own way first; fewer than two where there is nothing to choose."""


def check_same_bits(label: str, ways: Ways) -> None:
    """Raise an AssertionError unless all ways draw the same."""
    with ways[0].in_force():
        expected = [array.copy() for array in ways[0].draw()]
    for way in ways[1:]:
        with way.in_force():
            for own, other in zip(expected, way.draw(), strict=True):
                if own.tobytes() != other.tobytes():
                    raise AssertionError(f"{label}: {way.name!r} draws other bits than {ways[0].name!r}")


def take_rounds(
    ways: Sequence[Way], n_rounds: int, seconds: float, clock: Clock, hopeless: float = HOPELESS
) -> list[NDArray[np.float64]]:
    """Return the least milliseconds of a call in each round, way by way; the order turns from round to round."""
    found: list[list[float]] = [[] for _ in ways]
    for i in range(n_rounds):
        for k in (np.arange(len(ways)) + i) % len(ways):
            if i and found[k][0] > hopeless * found[0][0]:
                continue
            with ways[k].in_force():
                found[k].append(least_ms(ways[k].draw, seconds, clock))
    return [np.array(took) for took in found]


def least_ms(draw: Draw, seconds: float, clock: Clock) -> float:
    """Return the least time of some calls, after one that does not count."""
    draw()
    return min(turn_of(draw, clock)(seconds))
