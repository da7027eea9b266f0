"""Ways to draw the same bits, in this process and in turns: each forces choices of the library."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.turns import Clock, turn_of
from topleft._core.raster import choices

Picture = tuple[NDArray[Any], ...]
Draw = Callable[[], Picture]

HOPELESS = 4.0
"""A way that takes so many times as long as the planner's sits out after the first round."""


@dataclass(frozen=True)
class Way:
    """A way to draw: its name, its function, and the choices and costs that are forced."""

    name: str
    draw: Draw
    forced: Mapping[str, Any] = field(default_factory=dict)

    def in_force(self) -> AbstractContextManager[None]:
        """Force the choices while the context lasts."""
        return choices.forced(**self.forced)


Ways = list[Way]
"""The planner's own way first; fewer than two where there is nothing to choose."""


def answers_of(name: str, draw: Draw, **forced: Any) -> list[Any]:
    """Return the answers of a choice of the library during a draw."""
    found: list[Any] = []
    asked = getattr(choices, name)

    def spy(*arguments: Any, **options: Any) -> Any:
        found.append(asked(*arguments, **options))
        return found[-1]

    with choices.forced(**{name: spy}, **forced):
        draw()
    return found


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
