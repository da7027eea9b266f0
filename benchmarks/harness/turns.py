"""Turns: who is measured draws for a while, then the next one does, A B C A B C ..., so that drift hits all alike.

A turn is a function that takes seconds and returns the milliseconds of each call that it made, at least of one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Turn = Callable[[float], list[float]]
Clock = Callable[[], float]

SLOW_MS, SLOW_ROUNDS = 1000.0, 2


def turn_of(call: Callable[[], object], clock: Clock = time.thread_time) -> Turn:
    """Return the turn of a call in this process; unless told otherwise, time is that of the thread on its CPU.

    Other work on that CPU does not count, so this is for calls that run on one thread.
    """

    def turn(seconds: float) -> list[float]:
        times_ms: list[float] = []
        while not times_ms or sum(times_ms) < 1e3 * seconds:
            start = clock()
            call()
            times_ms.append(1e3 * (clock() - start))
        return times_ms

    return turn


def take_turns(turns: Sequence[Turn], rounds: int, seconds: float) -> list[NDArray[np.float64]]:
    """Return the median of the milliseconds of each round, turn by turn; a turn lasts so long, at least one call.

    Who takes longer than `SLOW_MS` for a call sits out after `SLOW_ROUNDS` rounds, and has fewer medians for that.
    """
    medians: list[list[float]] = [[] for _ in turns]
    for i_round in range(-1, rounds):  # the first round is for warming up
        for turn, own in zip(turns, medians, strict=True):
            if i_round >= SLOW_ROUNDS and own[-1] > SLOW_MS:
                continue
            times_ms = turn(seconds if i_round >= 0 else 0.0)
            if i_round >= 0:
                own.append(float(np.median(times_ms)))
    return [np.array(own) for own in medians]


def spread(took_ms: NDArray[np.float64], scale: float = 1.0, unit: str = "ms") -> dict[str, float]:
    """Median and quartiles of the rounds, times `scale`, to four digits."""
    low, middle, high = quartiles(scale * took_ms)
    return {unit: middle, "q1": low, "q3": high}


def quartiles(values: NDArray[np.float64]) -> list[float]:
    """Return the first quartile, the median and the third."""
    return [digits(value) for value in np.percentile(values, [25, 50, 75])]


def digits(value: float) -> float:
    """Return a number to four digits."""
    return float(f"{value:.4g}")
