"""Pictures in bands of rows for threads, with sums that do not depend on the threads.

A band sums up its pixels, in their order, in float64; bands are added in theirs. The bands depend on
the size of a picture alone, so every number of threads gives the same bits.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from topleft._core import engine
from topleft._core.base.memory import FRESH, SPARE, empty
from topleft._core.base.threads import available_threads, parse_threads, run_parts

#: Pixels of a band, which has whole rows: a call of the engine costs 30 us more than its pixels, and four rows more.
#: Wide pictures have up to twice as many, as long as these are no more than so many rows.
BAND_PX, BAND_ROWS = 1 << 16, 128

#: Pixels that are worth a thread.
MIN_PX_PER_THREAD = 1 << 15

#: Most bytes of a band that are kept for the next calls; of three attributes and 100,000 triangles it has 90 MB, of
#: which it uses a few.
MAX_SPARE_BYTES = 128 << 20

Array = NDArray[Any]
Found = TypeVar("Found")


class Band(NamedTuple):
    """Rows [first, end) of a picture, and how many bands come before."""

    picture: int
    first: int
    end: int
    number: int


class Sums(NamedTuple):
    """Sums of the rows of a tensor, of which a pixel touches so many at most."""

    n_rows: int
    n_columns: int
    rows_per_px: int


class Room(NamedTuple):
    """Memory of bands of at most `n_px` pixels: sums, and arrays by shape and dtype."""

    n_px: int
    sums: tuple[Sums, ...]
    arrays: tuple[tuple[tuple[int, ...], DTypeLike], ...] = ()

    def make(self) -> list[Any]:
        """Return the sums, then the arrays: of a call that has ended where there are such."""
        kept: list[Any] | None = SPARE.take(self)
        if kept is not None:
            return kept
        made: list[Any] = []
        for n_rows, n_columns, rows_per_px in self.sums:
            n = min(n_rows, self.n_px * rows_per_px)
            slots = FRESH.constant("slots", n_rows, -1)
            made.append(engine.GradientSums(slots, empty((n,), np.int32), empty((n, n_columns), np.float64)))
        return made + [empty(shape, dtype) for shape, dtype in self.arrays]

    def put_back(self, made: list[Any]) -> None:
        """Let other calls have what `make` returned."""
        if bytes_of(self) <= MAX_SPARE_BYTES:
            SPARE.put(self, made)


@lru_cache(64)
def bytes_of(room: Room) -> int:
    """Return how large the memory of a band is."""
    sums = sum(4 * n + min(n, room.n_px * per_px) * (4 + 8 * n_columns) for n, n_columns, per_px in room.sums)
    return sums + sum(math.prod(shape) * np.dtype(dtype).itemsize for shape, dtype in room.arrays)


@lru_cache(16)
def bands_of(n_pictures: int, height: int, width: int) -> tuple[Sequence[Band], int]:
    """Return the bands of some pictures of one size, and the pixels of the largest."""
    most = BAND_PX // max(1, width)
    rows = max(1, most, min(BAND_ROWS, 2 * most))
    firsts = [(picture, first) for picture in range(n_pictures if width else 0) for first in range(0, height, rows)]
    bands = [Band(picture, first, min(first + rows, height), i) for i, (picture, first) in enumerate(firsts)]
    return bands, min(rows, height) * width


class Bands:
    """The bands of some pictures of one size."""

    def __init__(self, n_pictures: int, height: int, width: int, threads: int | None = None) -> None:
        self.all, self.n_px = bands_of(n_pictures, height, width)
        n_px = n_pictures * height * width
        n_threads = parse_threads(threads) or min(available_threads(), max(1, n_px // MIN_PX_PER_THREAD))
        self.threads = max(1, min(n_threads, len(self.all)))

    def run(self, work: Callable[[Band], Found]) -> list[Found]:
        """Return what `work` does of each band."""
        n = len(self.all)
        return run_parts(lambda i, _: work(self.all[i]), n, n, self.threads) if n else []

    def add_up(
        self, room: Room, work: Callable[[Band, list[Any]], Found], outs: Sequence[tuple[Array, ...]]
    ) -> list[Found]:
        """Return what `work` does of each band, and add its sums to arrays (B or 1, N, K), in the order of bands.

        The first sums of `room` have the columns of the first of `outs`, one array after the other, and so on. A band
        that is done while those before it are not waits with its memory; the thread that adds one adds those that wait
        for it.
        """
        done: dict[int, list[Any]] = {}
        free: list[list[Any]] = []
        adding = threading.Lock()
        n_added = 0

        def add() -> None:
            nonlocal n_added
            if not adding.acquire(blocking=False):
                return
            try:
                while n_added in done:
                    made, picture = done.pop(n_added), self.all[n_added].picture
                    for sums, arrays in zip(made, outs, strict=False):
                        sums.add_to(tuple(out[picture if len(out) > 1 else 0] for out in arrays))
                    free.append(made)
                    n_added += 1
            finally:
                adding.release()

        def work_on(band: Band) -> Found:
            try:
                made = free.pop()
            except IndexError:
                made = room.make()
            found = work(band, made)
            done[band.number] = made
            add()
            return found

        results = self.run(work_on)
        add()  # those that were done while another thread was about to end
        for made in free:
            room.put_back(made)
        return results
