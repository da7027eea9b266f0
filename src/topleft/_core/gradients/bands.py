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
Done = TypeVar("Done")


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

        def with_sums(band: Band) -> tuple[list[engine.GradientSums], int | None]:
            sums = sums_of(out.shape[1], out.shape[2], band, rows_per_px * self.width)
            found = work(band, sums)
            return [sums], found

        return max((bad for bad in self.add_up_all(with_sums, [out]) if bad is not None), default=-1)

    def add_up_all(
        self, work: Callable[[Band], tuple[Sequence[engine.GradientSums], Found]], outs: Sequence[Array]
    ) -> list[Found]:
        """Add the sums that `work` returns for each band to `outs`; returns its other results."""
        results: list[Found] = []
        at_a_time = self.threads * WAITING_BANDS if self.threads > 1 else 1
        for start in range(0, len(self.all), at_a_time):
            some = self.all[start : start + at_a_time]
            parts = run_parts(partial(work_on, work, some), len(some), self.threads)
            for band, (sums, found) in zip(some, chain.from_iterable(parts), strict=True):
                for own, out in zip(sums, outs, strict=True):
                    own.add_to(out[band.picture if len(out) > 1 else 0])
                results.append(found)
        return results


def work_on(work: Callable[[Band], Done], bands: Sequence[Band], first: int, end: int) -> list[Done]:
    """Return the results of `work` for bands [first, end)."""
    return [work(band) for band in bands[first:end]]


def sums_of(n_rows: int, n_columns: int, band: Band, width: int, name: str = "rows") -> engine.GradientSums:
    """Return room for the sums of a band that touches at most `width` of `n_rows` rows in each row of pixels."""
    slots = SCRATCH.constant(f"gradient {name}", n_rows, -1)[:n_rows]
    room = min(n_rows, (band.end - band.first) * width)
    return engine.GradientSums(slots, empty((room,), np.int32), empty((room, n_columns), np.float64))
