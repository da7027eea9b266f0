"""Finds the triangles of each window of a raster: an index that one pass over the mesh makes.

Input: triangles, in blocks; how they come to pixels. Output: for each window the indices of the triangles that may
touch it, in order.

A triangle is listed once for each row of windows that it touches, with the first and the last of them: 12 bytes,
whether it covers one window of the row or all of them. Spans are sorted by rows as the blocks come (a counting sort),
and go to a file when they outgrow their memory.

Based on: the binning of tiled renderers: H. Fuchs et al., Pixel-Planes 5, 1989.
"""

from __future__ import annotations

import os
import tempfile
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I32
from topleft._core.base.memory import Memory, check_fits
from topleft._meshes.windows.ahead import in_order, kept_memory
from topleft._meshes.windows.blocks import BLOCK, Triangles

SPAN_BYTES = 12

#: Rows of windows that are kept sorted: the one that is drawn and the next.
N_ROWS_KEPT = 2


@dataclass(frozen=True)
class Tiling:
    """A raster cut into windows, in pixels."""

    width: int
    height: int
    window_width: int
    window_height: int
    subpixel_bits: int

    @property
    def n_columns(self) -> int:
        """Windows of a row."""
        return -(-self.width // self.window_width)

    @property
    def n_rows(self) -> int:
        """Rows of windows."""
        return -(-self.height // self.window_height)

    @property
    def numbers(self) -> tuple[int, int, int, int, int]:
        """The numbers in the order of the engine."""
        return self.width, self.height, self.window_width, self.window_height, self.subpixel_bits


@dataclass(frozen=True)
class _Run:
    """Spans of a block: row first_row + i has the spans from starts[i] to starts[i + 1]."""

    first_row: int
    starts: npt.NDArray[np.int64]
    spans: I32 | None  # None: in the file
    offset: int


@dataclass(frozen=True)
class _SortedRow:
    """The triangles of each window of a row, and the spans that reach over more windows than are listed singly."""

    starts: npt.NDArray[np.int64]
    triangles: I32
    long: I32  # (N, 3)

    def of_column(self, column: int) -> I32:
        """The triangles of a window, ascending."""
        short = self.triangles[self.starts[column] : self.starts[column + 1]]
        if not len(self.long):
            return short
        crossing = self.long[(self.long[:, 1] <= column) & (column < self.long[:, 2]), 0]
        if not len(crossing):
            return short
        return np.insert(short, np.searchsorted(short, crossing), crossing)  # both ascend


class WindowIndex:
    """Which triangles each window needs."""

    def __init__(
        self,
        triangles: Triangles,
        tiling: Tiling,
        to_pixels: Callable[[npt.NDArray[Any]], F64],
        check: Callable[[npt.NDArray[Any], Callable[[int], str]], None],
        *,
        memory: int,
        folder: str | None,
        n_threads: int = 1,
    ) -> None:
        """`check`: looks at the corners of each block, and gets a function that names a triangle of the block."""
        self.tiling = tiling
        check_fits((tiling.n_rows, tiling.n_columns + 1), np.int32, np.int32)
        self.counts = np.zeros((tiling.n_rows, tiling.n_columns), np.int32)
        self.n_spans = 0
        self._runs: list[_Run] = []
        self._memory, self._folder = memory, folder
        self._file: IO[bytes] | None = None
        self._pid, self._lock = os.getpid(), threading.Lock()
        self._kept: OrderedDict[int, _SortedRow] = OrderedDict()
        block = max(BLOCK, 4 * tiling.n_rows)  # so that the starts of all rows take less than the spans
        n_blocks = -(-triangles.n // block)
        steps = np.zeros((tiling.n_rows, tiling.n_columns + 1), np.int32)

        def list_block(i: int) -> _Run | None:
            first = i * block

            def where(row: int) -> str:
                return f"in triangle {first + row}, block {i + 1} of {n_blocks}"

            memory = kept_memory()
            corners = triangles.corners(slice(first, min(first + block, triangles.n)), memory)
            check(corners, where)
            corners_px = to_pixels(corners.reshape(-1, corners.shape[2])).reshape(-1, 3, 2)
            return self._listed(corners_px, corners, first, where, memory)

        for run in in_order(list_block, range(n_blocks), n_threads):
            if run is not None:
                self._add(run, steps)
        np.cumsum(steps[:, :-1], axis=1, dtype=np.int32, out=self.counts)
        if self._file is not None:
            self._file.flush()

    @property
    def is_on_disk(self) -> bool:
        """Whether spans went to a file."""
        return self._file is not None

    def _listed(
        self, corners_px: F64, corners: npt.NDArray[Any], first: int, where: Callable[[int], str], memory: Memory
    ) -> _Run | None:
        """The spans of a block, by rows; None if it has none."""
        numbers, n_rows = self.tiling.numbers, self.tiling.n_rows
        starts = np.zeros(n_rows + 1, np.int64)
        boxes: I32 = memory.empty("boxes", (len(corners), 4), np.int32)
        bad = engine.list_spans(numbers, corners_px, first, boxes, starts, None)
        if bad >= 0:
            at = corners[bad].tolist()
            if not np.isfinite(corners[bad]).all():
                raise ValueError(f"vertices must be finite where a triangle uses them, got {at} {where(bad)}")
            bits = self.tiling.subpixel_bits
            raise ValueError(
                f"vertices must lie within 2**{62 - bits} pixels of 0"
                + (f" with {bits} sub-pixel bits" if bits else "")
                + f", got {at} {where(bad)}"
            )
        np.cumsum(starts, out=starts)
        n = int(starts[-1])
        if not n:
            return None
        spans = np.empty((n, 3), np.int32)
        engine.list_spans(numbers, corners_px, first, boxes, starts[:-1].copy(), spans)
        low, end = int(np.searchsorted(starts, 1)) - 1, int(np.searchsorted(starts, n))
        return _Run(low, starts[low : end + 1].copy(), spans, 0)

    def _add(self, run: _Run, steps: I32) -> None:
        spans = run.spans
        assert spans is not None
        engine.count_windows(spans, run.starts, steps[run.first_row : run.first_row + len(run.starts) - 1])
        run = replace(run, offset=SPAN_BYTES * self.n_spans)
        self.n_spans += len(spans)
        if self._file is None and SPAN_BYTES * self.n_spans > self._memory:
            self._file = tempfile.TemporaryFile(prefix="topleft-", dir=self._folder)  # noqa: SIM115
            self._runs = [self._to_file(earlier) for earlier in self._runs]
        self._runs.append(run if self._file is None else self._to_file(run))

    def _to_file(self, run: _Run) -> _Run:
        assert self._file is not None
        assert run.spans is not None
        self._file.write(run.spans.data)
        return _Run(run.first_row, run.starts, None, run.offset)

    def of_window(self, row: int, column: int) -> I32:
        """The triangles that may touch a window, ascending."""
        if not self.counts[row, column]:
            return np.empty(0, np.int32)
        if self._pid != os.getpid():  # a forked child: the lock may be held by a thread that is not there
            self._pid, self._lock, self._kept = os.getpid(), threading.Lock(), OrderedDict()
        with self._lock:
            spans = self._kept.get(row)
            if spans is None:
                spans = self._kept[row] = self._sorted(row)
                while len(self._kept) > N_ROWS_KEPT:
                    self._kept.popitem(last=False)
        return spans.of_column(column)

    def _sorted(self, row: int) -> _SortedRow:
        parts = []
        for run in self._runs:
            i = row - run.first_row
            if not 0 <= i < len(run.starts) - 1 or run.starts[i] == run.starts[i + 1]:
                continue
            first, end = int(run.starts[i]), int(run.starts[i + 1])
            if run.spans is not None:
                parts.append(run.spans[first:end])
            else:
                assert self._file is not None
                content = read_at(self._file, run.offset + SPAN_BYTES * first, SPAN_BYTES * (end - first))
                parts.append(np.frombuffer(content, np.int32).reshape(-1, 3))
        starts = np.zeros(self.tiling.n_columns + 1, np.int64)
        n_long = sum(engine.sort_spans(part, starts, None) for part in parts)
        np.cumsum(starts, out=starts)
        names = np.empty(int(starts[-1]), np.int32)
        at = starts[:-1].copy()
        for part in parts:
            engine.sort_spans(part, at, names)
        long = [part[part[:, 2] - part[:, 1] > engine.SHORT_SPAN] for part in parts] if n_long else []
        return _SortedRow(starts, names, np.concatenate(long) if long else np.empty((0, 3), np.int32))


def read_at(file: IO[bytes], offset: int, n: int) -> bytes:
    """Return a part of a file; where the system can, without the place in it that forked processes share."""
    if not hasattr(os, "pread"):
        file.seek(offset)
        return file.read(n)
    parts = []
    while n > 0 and (part := os.pread(file.fileno(), n, offset)):  # 2 GB at most at a time
        parts.append(part)
        n, offset = n - len(part), offset + len(part)
    return b"".join(parts)
