"""Pictures in bands of rows for threads, with sums that do not depend on the threads.

A band sums up its pixels, in their order, in float64; bands are added in theirs. The bands depend on
the size of a picture alone, so every number of threads gives the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.memory import SCRATCH, empty
from topleft._core.base.threads import available_threads, parse_threads, run_parts

#: Pixels of a band, which has whole rows: a call of the engine costs 30 us more than its pixels.
BAND_PX = 1 << 16

#: Pixels that are worth a thread, and sums of bands that a thread holds until those before them are added.
MIN_PX_PER_THREAD = 1 << 15
WAITING_BANDS = 4

Array = NDArray[Any]
Found = TypeVar("Found")
Made = TypeVar("Made", bound=Sequence[Any])


class Band(NamedTuple):
    """Rows [first, end) of a picture."""

    picture: int
    first: int
    end: int


class Bands:
    """The bands of some pictures of one size."""

    def __init__(self, n_pictures: int, height: int, width: int, threads: int | None = None) -> None:
        rows = max(1, BAND_PX // max(1, width))
        self.all = [
            Band(picture, first, min(first + rows, height))
            for picture in range(n_pictures if width else 0)
            for first in range(0, height, rows)
        ]
        self.width = width
        n_px = n_pictures * height * width
        most = parse_threads(threads) or min(available_threads(), max(1, n_px // MIN_PX_PER_THREAD))
        self.threads = max(1, min(most, len(self.all)))

    def run(self, work: Callable[[Band], int | None]) -> int:
        """Call `work` of each band; returns the largest number that one returned, or -1."""
        parts = run_parts(lambda first, end: [work(b) for b in self.all[first:end]], len(self.all), self.threads)
        return max((bad for part in parts for bad in part if bad is not None), default=-1)

    def add_up(self, work: Callable[[Band, engine.GradientSums], int | None], out: Array, rows_per_px: int) -> int:
        """Add the sums of `work` in each band to `out` (B or 1, N, K), by row of `out`; returns as `run` does.

        rows_per_px: the most rows that a pixel has a share in.
        """
        found = self.add_up_all(
            lambda room: [room.sums("rows", out.shape[1], out.shape[2], rows_per_px)],
            lambda band, sums: work(band, *sums),
            [out],
        )
        return max((bad for bad in found if bad is not None), default=-1)

    def add_up_all(
        self, make: Callable[[Room], Made], work: Callable[[Band, Made], Found], outs: Sequence[Array]
    ) -> list[Found]:
        """Add sums of each band to `outs`; returns what `work` does.

        `make` returns what `work` takes beside a band, which some bands use one after the other: as many sums as there
        are `outs`, then others.
        """
        results: list[Found] = []
        at_a_time = min(len(self.all), self.threads * WAITING_BANDS if self.threads > 1 else 1)
        made = [make(Room(i, (self.all[0].end - self.all[0].first) * self.width)) for i in range(at_a_time)]
        for start in range(0, len(self.all), max(1, at_a_time)):
            some = list(zip(self.all[start : start + at_a_time], made, strict=False))
            parts = run_parts(partial(work_on, work, some), len(some), self.threads)
            results.extend(chain.from_iterable(parts))
            for band, own in some:
                for sums, out in zip(own, outs, strict=False):
                    sums.add_to(out[band.picture if len(out) > 1 else 0])
        return results


class Room(NamedTuple):
    """Memory of the bands that are worked on one after the other, of which none has more pixels."""

    number: int
    n_px: int

    def sums(self, name: str, n_rows: int, n_columns: int, rows_per_px: int) -> engine.GradientSums:
        """Return sums of `n_rows` rows, of which a pixel touches so many at most."""
        slots = SCRATCH.constant(f"gradient {name} {self.number}", n_rows, -1)
        room = min(n_rows, self.n_px * rows_per_px)
        return engine.GradientSums(slots, empty((room,), np.int32), empty((room, n_columns), np.float64))


def work_on(
    work: Callable[[Band, Made], Found], some: Sequence[tuple[Band, Made]], first: int, end: int
) -> list[Found]:
    """Return the results of `work` for some bands, of which [first, end)."""
    return [work(band, made) for band, made in some[first:end]]
