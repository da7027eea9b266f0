"""Finds the triangles of each window of a raster: an index that one pass over the mesh makes.

Input: triangles, in blocks; how they come to pixels. Output: for each window the indices of the triangles that may
touch it, in order.

A triangle is listed once for each row of windows that it touches, with the first and the last of them: 12 bytes,
whether it covers one window of the row or all of them. Spans are sorted by rows as the blocks come (a counting sort),
and go to a file when they outgrow their memory.

Based on: the binning of tiled renderers: H. Fuchs et al., Pixel-Planes 5, 1989.
"""

from __future__ import annotations

import tempfile
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._tiles.blocks import BLOCK, Triangles

I32 = npt.NDArray[np.int32]
F64 = npt.NDArray[np.float64]

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
        """What the engine takes."""
        return self.width, self.height, self.window_width, self.window_height, self.subpixel_bits


@dataclass(frozen=True)
class _Run:
    """Spans of a block: those of row first_row + i lie from starts[i] to starts[i + 1]."""

    first_row: int
    starts: npt.NDArray[np.int64]
    spans: I32 | None  # None: in the file
    offset: int


@dataclass(frozen=True)
class _SortedRow:
    """Spans of a row of windows, sorted by their first window, and those that reach over several."""

    starts: npt.NDArray[np.int64]
    triangles: I32
    long: I32  # (N, 3)

    def of_column(self, column: int) -> I32:
        """The triangles of a window, ascending."""
        own = self.triangles[self.starts[column] : self.starts[column + 1]]
        crossing = self.long[(self.long[:, 1] < column) & (column < self.long[:, 2]), 0]
        if not len(crossing):
            return own
        return np.insert(own, np.searchsorted(own, crossing), crossing)  # both ascend


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
    ) -> None:
        """`check`: looks at the corners of each block, and gets what tells where one of its triangles is."""
        self.tiling = tiling
        self.counts = np.zeros((tiling.n_rows, tiling.n_columns), np.int32)
        self.n_spans = 0
        self._runs: list[_Run] = []
        self._memory, self._folder = memory, folder
        self._file: IO[bytes] | None = None
        self._lock = threading.Lock()
        self._kept: OrderedDict[int, _SortedRow] = OrderedDict()
        block = max(BLOCK, 4 * tiling.n_rows)  # so that the starts of all rows take less than the spans
        n_blocks = -(-triangles.n // block)
        for i in range(n_blocks):
            first = i * block

            def where(row: int, first: int = first, i: int = i) -> str:
                return f"in triangle {first + row}, block {i + 1} of {n_blocks}"

            corners = triangles.corners(slice(first, min(first + block, triangles.n)))
            check(corners, where)
            self._add(to_pixels(corners.reshape(-1, corners.shape[2])).reshape(-1, 3, 2), corners, first, where)

    @property
    def is_on_disk(self) -> bool:
        """Whether spans went to a file."""
        return self._file is not None

    def _add(self, corners_px: F64, corners: npt.NDArray[Any], first: int, where: Callable[[int], str]) -> None:
        numbers, n_rows = self.tiling.numbers, self.tiling.n_rows
        starts = np.zeros(n_rows + 1, np.int64)
        bad = _engine.list_spans(numbers, corners_px, first, starts, None)
        if bad >= 0:
            at = corners[bad].tolist()
            if not np.isfinite(corners[bad]).all():
                raise ValueError(f"vertices must be finite where a triangle uses them, got {at} {where(bad)}")
            bits = self.tiling.subpixel_bits
            raise ValueError(
                f"vertices must lie within 2**{62 - bits} pixels of 0 with {bits} sub-pixel bits, got {at} {where(bad)}"
            )
        np.cumsum(starts, out=starts)
        n = int(starts[-1])
        if not n:
            return
        spans = np.empty((n, 3), np.int32)
        _engine.list_spans(numbers, corners_px, first, starts[:-1].copy(), spans)
        rows = np.flatnonzero(np.diff(starts))
        low, high = int(rows[0]), int(rows[-1])
        self._count(spans, starts, rows)
        run = _Run(low, starts[low : high + 2].copy(), spans, SPAN_BYTES * self.n_spans)
        self.n_spans += n
        if self._file is None and SPAN_BYTES * self.n_spans > self._memory:
            self._file = tempfile.TemporaryFile(prefix="topleft-", dir=self._folder)  # noqa: SIM115
            self._runs = [self._to_file(earlier) for earlier in self._runs]
        self._runs.append(run if self._file is None else self._to_file(run))

    def _count(self, spans: I32, starts: npt.NDArray[np.int64], rows: npt.NDArray[np.int64]) -> None:
        """Add to the number of triangles of each window."""
        n_columns = self.tiling.n_columns
        for row in rows.tolist():
            own = spans[starts[row] : starts[row + 1]]
            steps = np.bincount(own[:, 1], minlength=n_columns + 1) - np.bincount(own[:, 2], minlength=n_columns + 1)
            self.counts[row] += np.cumsum(steps)[:n_columns].astype(np.int32)

    def _to_file(self, run: _Run) -> _Run:
        assert self._file is not None
        assert run.spans is not None
        self._file.write(run.spans.data)
        return _Run(run.first_row, run.starts, None, run.offset)

    def of_window(self, row: int, column: int) -> I32:
        """The triangles that may touch a window, ascending."""
        if not self.counts[row, column]:
            return np.empty(0, np.int32)
        with self._lock:
            found = self._kept.get(row)
            if found is None:
                found = self._kept[row] = self._sorted(row)
                while len(self._kept) > N_ROWS_KEPT:
                    self._kept.popitem(last=False)
        return found.of_column(column)

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
                self._file.seek(run.offset + SPAN_BYTES * first)
                content = self._file.read(SPAN_BYTES * (end - first))
                parts.append(np.frombuffer(content, np.int32).reshape(-1, 3))
        spans = parts[0] if len(parts) == 1 else np.concatenate(parts)
        columns = spans[:, 1]
        # NumPy sorts 16 bits by counting.
        key = columns.astype(np.uint16) if self.tiling.n_columns <= 1 << 16 else columns
        order = np.argsort(key, kind="stable")
        starts = np.zeros(self.tiling.n_columns + 1, np.int64)
        np.cumsum(np.bincount(columns, minlength=self.tiling.n_columns), out=starts[1:])
        return _SortedRow(starts, spans[:, 0][order], spans[spans[:, 2] - columns > 1])
