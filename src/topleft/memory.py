"""Memory of a call: fresh arrays, or arrays that are kept from call to call."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

__all__ = ["FreshMemory", "KeptMemory"]

HUGE_PAGE = 2 << 20


class FreshMemory:
    """Every array is new: results stay valid for as long as anyone holds them."""

    def empty(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:  # noqa: ARG002
        """Return an uninitialised array."""
        return np.empty(shape, dtype)


class KeptMemory:
    """One block of memory per name, which only grows: the next call overwrites what this one returned."""

    def __init__(self) -> None:
        self._blocks: dict[str, NDArray[np.uint8]] = {}

    def empty(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an uninitialised array at the start of the block of that name."""
        n_bytes = math.prod(shape) * np.dtype(dtype).itemsize
        block = self._blocks.get(name)
        if block is None or block.size < n_bytes:
            block = self._blocks[name] = allocate(n_bytes)
        return block[:n_bytes].view(dtype).reshape(shape)


def allocate(n_bytes: int) -> NDArray[np.uint8]:
    """Return uninitialised memory that whole huge pages can back, where it is large.

    NumPy asks the system for huge pages from 4 MiB on, but the system uses them only for what is aligned to them. A frame
    of random small triangles is drawn 1.4 times faster with them: each sample is another page.
    """
    if n_bytes < HUGE_PAGE:
        return np.empty(n_bytes, np.uint8)
    n_whole = -(-n_bytes // HUGE_PAGE) * HUGE_PAGE
    block = np.empty(n_whole + 2 * HUGE_PAGE, np.uint8)
    skip = -block.ctypes.data % HUGE_PAGE
    return block[skip : skip + n_whole]
