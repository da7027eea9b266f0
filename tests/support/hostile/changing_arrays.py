"""Arrays that another process writes to while a call reads them.

Each lies in shared memory between two pages that nobody may touch, so that a step beside it ends the program with or
without a sanitizer. The other process is a fork, which has no lock of the interpreter in common with the call. It ends
with the call, also where that is killed.
"""

import ctypes
import mmap
import os
import random
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from draws import Draw

ODD_NUMBERS = [np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-40, -1e-3, 1e-3, 1e6, -1e9, 2.0**31, 2.0**43, 1e30, 3e38]
ODD_INTEGERS = [-1, 0, 2**15, 10**6, -(10**9), 2**31 - 1, -(2**31), 2**44, 2**63 - 1, -(2**63)]


class Changing:
    """The arrays of a case, and what another process writes to them.

    That is rows of one of several contents: as they were made, in another order, and with few or many odd numbers among
    them. It writes single rows, several or whole arrays all the time, or seldom and shortly, so that a check passes and
    the kernel behind it meets what was to be refused.
    """

    def __init__(self, draw: Draw) -> None:
        self.draw, self.rng = draw, draw.rng()
        self._is_tame = draw.chance(4)  # each row is a valid one: no check ever finds anything
        self._pace = draw.of(["seldom", "often", "one", "whole"])
        self._names: list[str] = []
        self._arrays: list[tuple[np.ndarray, list[np.ndarray]]] = []
        self._beside: list[np.ndarray] = []

    def __repr__(self) -> str:
        return f"{self._pace}{' tame' * self._is_tame}: {' '.join(self._names) or 'nothing'}"

    def share(self, name: str, array: np.ndarray, n_rows: int | None = None) -> np.ndarray:
        """An array that mostly changes; for indices of so many rows `n_rows` is wrong."""
        own, beside = between_closed_pages(array, is_at_end=self.draw.chance(2))
        self._beside.append(beside)
        if self.draw.chance(5) or not array.size:
            return own
        contents = [array.copy(), self.rng.permutation(array)]
        for one_in in () if self._is_tame else (2, 50, array.size):
            odd = array.copy().reshape(-1)
            chosen = self.rng.integers(0, one_in, array.size) == 0
            odd[chosen] = self.rng.choice(odd_values(array.dtype, n_rows), np.count_nonzero(chosen))
            contents.append(odd.reshape(array.shape))
        self._arrays.append((own, contents))
        self._names.append(f"{name}:{array.dtype.str[1:]}{list(array.shape)}".replace(" ", ""))
        return own

    def numbers(
        self, name: str, shape: tuple[int, ...], low: float, high: float, dtypes: str = "f4", n_rows: int | None = None
    ) -> np.ndarray:
        """Such an array, of one of the dtypes."""
        return self.share(name, self.rng.uniform(low, high, shape).astype(self.draw.of(dtypes.split())), n_rows)

    @contextmanager
    def changed(self) -> Iterator[None]:
        """Let another process write to the arrays meanwhile; an AssertionError if something was written beside them."""
        child = self._begin_to_write(self.draw.source.integer(0, 65535))
        try:
            yield
        finally:
            end_process(child)
        if any(beside.any() for beside in self._beside):
            raise AssertionError("a write beside an array")

    def _begin_to_write(self, seed: int) -> int:
        """Fork the process that writes; again, where a lock that a thread had when it was forked lets it not begin."""
        has_begun, parent = mmap.mmap(-1, 1), os.getpid()
        while True:
            child = os.fork()
            if child == 0:
                try:
                    self._write_while(parent, random.Random(seed), has_begun)
                finally:
                    os._exit(0)
            latest = time.monotonic() + 2
            while time.monotonic() < latest:
                if has_begun[0] or not self._arrays:
                    return child
                time.sleep(1e-4)
            end_process(child)

    def _write_while(self, parent: int, rng: random.Random, has_begun: mmap.mmap) -> None:
        while self._arrays and os.getppid() == parent:
            own, contents = rng.choice(self._arrays)
            first, end = 0, len(own)
            if self._pace != "whole":
                first = rng.randrange(end)
                end = first + 1 if self._pace == "one" else rng.randint(first + 1, end)
            own[first:end] = rng.choice(contents)[first:end]
            has_begun[0] = 1
            if self._pace == "seldom":
                time.sleep(rng.random() * 1e-3)
                own[first:end] = contents[0][first:end]
                time.sleep(rng.random() * 2e-3)


def end_process(child: int) -> None:
    """Kill a process that this one has forked, and wait for its end."""
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def between_closed_pages(array: np.ndarray, *, is_at_end: bool) -> tuple[np.ndarray, np.ndarray]:
    """The same numbers in shared memory that ends, or begins, at a closed page; and the zeros on the other side."""
    page = mmap.PAGESIZE
    n = -(-array.nbytes // page) * page
    memory = mmap.mmap(-1, n + 2 * page)
    address = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for closed in (address, address + page + n):
        if ctypes.CDLL(None).mprotect(ctypes.c_void_p(closed), ctypes.c_size_t(page), 0):
            raise OSError("mprotect")
    n_beside = n - array.nbytes
    first, beside = (page + n_beside, page) if is_at_end else (page, page + array.nbytes)
    own = np.frombuffer(memory, array.dtype, array.size, first).reshape(array.shape)
    own[...] = array
    return own, np.frombuffer(memory, np.uint8, n_beside, beside)


def odd_values(dtype: np.dtype[Any], n_rows: int | None) -> np.ndarray:
    """Numbers that a check may refuse, or that nobody has thought of."""
    if dtype.kind == "f":
        with np.errstate(all="ignore"):
            return np.array(ODD_NUMBERS).astype(dtype)
    if dtype.itemsize == 1:
        return np.arange(256, dtype=np.uint8).view(dtype)
    info, more = np.iinfo(dtype), [] if n_rows is None else [n_rows, n_rows, n_rows + 1, n_rows - 1]
    return np.array([each for each in [*ODD_INTEGERS, *more] if info.min <= each <= info.max], dtype)
