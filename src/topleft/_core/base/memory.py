"""Memory of a call: fresh arrays, arrays that are kept from call to call, and scratch that a thread keeps."""

from __future__ import annotations

import math
import sys
import threading
from collections import deque
from typing import Any, Protocol

import numpy as np
from numpy.typing import DTypeLike, NDArray

from topleft._core import engine

HUGE_PAGE = 2 << 20
CACHE_LINE = 64

#: NumPy allocates smaller arrays itself: the system keeps memory for them, without page faults.
MIN_BLOCK_BYTES = 4 << 10

#: Several arrays of so many bytes together are allocated at once before the first of them is written.
MIN_CHECKED_BYTES = 1 << 30

#: Most bytes of freed arrays that the process keeps for new ones: ids and depth of four samples a pixel
#: in a picture of 4096x4096.
MAX_WAITING_BYTES = 512 << 20

#: Most bytes that one name of a thread's scratch keeps between module-level calls.
MAX_SCRATCH_BYTES = 64 << 20

#: Bands of pictures, whose memory is kept for those of the next calls.
MOST_SPARE = 8


class Memory(Protocol):
    """Where arrays come from."""

    def empty(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an uninitialised array."""

    def scratch(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an uninitialised array that no result refers to: the next call may overwrite it."""

    def constant(self, name: str, n: int, value: int) -> NDArray[np.int32]:
        """Return n int32 that are all `value`; the caller restores it before it returns."""


class FreshMemory:
    """Every array is new: results stay valid for as long as anyone holds them."""

    def empty(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:  # noqa: ARG002
        """Return an uninitialised array."""
        return empty(shape, dtype)

    scratch = empty

    def constant(self, name: str, n: int, value: int) -> NDArray[np.int32]:  # noqa: ARG002
        """Return n int32 that are all `value`."""
        array: NDArray[np.int32] = empty((n,), np.int32)
        array.fill(value)
        return array


class KeptMemory:
    """One block of memory per name, which only grows: the next call overwrites the last result."""

    def __init__(self) -> None:
        self._blocks: dict[str, NDArray[np.uint8]] = {}
        self._constants: dict[str, NDArray[np.int32]] = {}

    def empty(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an uninitialised array at the start of the block of that name."""
        n_bytes = _size(shape, dtype)
        block = self._blocks.get(name)
        if block is None or block.size < n_bytes:
            block = self._blocks[name] = allocate(n_bytes)
        return block[:n_bytes].view(dtype).reshape(shape)

    scratch = empty

    def constant(self, name: str, n: int, value: int) -> NDArray[np.int32]:
        """Return n int32 that are all `value`: filled once, restored by callers."""
        block = self._constants.get(name)
        if block is None or block.size < n:
            block = self._constants[name] = FRESH.constant(name, n, value)
        return block[:n]


class ScratchMemory(FreshMemory):
    """Results are new; scratch belongs to the calling thread and is kept, up to `MAX_SCRATCH_BYTES` a name."""

    def __init__(self) -> None:
        self.threads = threading.local()  # `kept`: of each thread

    def scratch(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an uninitialised array, which the next call of the thread overwrites."""
        if _size(shape, dtype) > MAX_SCRATCH_BYTES:
            return empty(shape, dtype)
        return self._kept().empty(name, shape, dtype)

    def constant(self, name: str, n: int, value: int) -> NDArray[np.int32]:
        """Return n int32 that are all `value`."""
        if 4 * n > MAX_SCRATCH_BYTES:
            return super().constant(name, n, value)
        return self._kept().constant(name, n, value)

    def _kept(self) -> KeptMemory:
        kept: KeptMemory | None = getattr(self.threads, "kept", None)
        if kept is None:
            kept = self.threads.kept = KeptMemory()
        return kept

    def release(self) -> None:
        """Give the calling thread's scratch back."""
        self.threads.kept = None


class MemoryOf:
    """A memory with a suffix on each name: users of the bare names do not overwrite its buffers."""

    def __init__(self, memory: Memory, owner: str) -> None:
        self.memory, self.owner = memory, owner

    def empty(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an uninitialised array."""
        return self.memory.empty(f"{name} of {self.owner}", shape, dtype)

    def scratch(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return an uninitialised array that no result refers to."""
        return self.memory.scratch(f"{name} of {self.owner}", shape, dtype)

    def constant(self, name: str, n: int, value: int) -> NDArray[np.int32]:
        """Return n int32 that are all `value`."""
        return self.memory.constant(f"{name} of {self.owner}", n, value)


class SpareMemory:
    """Memory of calls that have ended, as they made it, for calls of the same needs; that of the last few is kept."""

    def __init__(self, most: int) -> None:
        self._kept: deque[tuple[object, Any]] = deque(maxlen=most)

    def take(self, need: object) -> Any:
        """Return what was put back for a need that is equal to this one, the last first; None if there is nothing."""
        for _ in range(len(self._kept)):
            try:
                own, made = self._kept.pop()
            except IndexError:  # another thread was faster
                return None
            if own == need:
                return made
            self._kept.appendleft((own, made))
        return None

    def put(self, need: object, made: object) -> None:
        """Keep the memory of a call that has ended, for calls of an equal need."""
        self._kept.append((need, made))

    def release(self) -> None:
        """Forget all."""
        self._kept.clear()


FRESH = FreshMemory()
SCRATCH = ScratchMemory()
SPARE = SpareMemory(MOST_SPARE)


engine.keep_blocks(MAX_WAITING_BYTES)


def empty(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Return an uninitialised array, in the memory of a freed array of about that size if there is one.

    Fresh memory costs a page fault every 4 KiB, which takes longer than drawing them. The array and all its views own
    the memory until they are freed; then it waits for another array, `MAX_WAITING_BYTES` at most.
    """
    n_bytes = math.prod(shape) * np.dtype(dtype).itemsize
    if n_bytes < MIN_BLOCK_BYTES:
        return np.empty(shape, dtype)
    if n_bytes > sys.maxsize:
        allocate(n_bytes)  # its error names the size
    return np.ndarray(shape, dtype, engine.lease_block(n_bytes, allocate))


def fits(shape: tuple[int, ...], *dtypes: DTypeLike) -> bool:
    """Whether the system has memory for arrays of a shape together.

    A check of one array at a time is too weak: Linux refuses a single array larger than all memory, but gives two of
    half that size and ends the process when they are written.
    """
    if 16 * len(dtypes) * math.prod(shape) >= MIN_CHECKED_BYTES:  # no number takes more than 16
        try:
            np.empty(sum(_size(shape, dtype) for dtype in dtypes), np.uint8)
        except (MemoryError, ValueError):
            return False
    return True


def check_fits(shape: tuple[int, ...], *dtypes: DTypeLike) -> None:
    """Raise a MemoryError unless the system has memory for arrays of a shape together."""
    if not fits(shape, *dtypes):
        n_bytes = sum(_size(shape, dtype) for dtype in dtypes)
        what = f"{len(dtypes)} arrays of {n_bytes:,} bytes together" if len(dtypes) > 1 else f"{n_bytes:,} bytes"
        raise MemoryError(f"no memory for {what}, which this size or scene needs")


def times_that_fit(most: int, shape: tuple[int, ...], *dtypes: DTypeLike) -> int:
    """Return how many times there is memory for arrays of a shape, `most` at most; a MemoryError where not once."""
    check_fits(shape, *dtypes)
    return next(n for n in range(most, 0, -1) if n == 1 or fits((n, *shape), *dtypes))


def release_memory() -> None:
    """Give back the memory that calls keep for calls to come.

    These are results that have died, 512 MiB of the process at most, and the scratch of `coverage`, `overdraw`, `fill`
    and `wireframe` for the calling thread: snapped vertices, converted indices, labels, cells and edges, at most 64 MiB
    each, nothing once the thread has ended; and that of the last eight bands of pictures whose gradients were computed.
    `Rasterizer` objects keep their own memory for as long as they live.

    Examples
    --------
    >>> import topleft as tl
    >>> _ = tl.coverage([(0, 0), (400, 0), (0, 400)], [(0, 1, 2)], (400, 400))
    >>> tl.release_memory()
    """
    SCRATCH.release()
    SPARE.release()
    engine.keep_blocks(0)
    engine.keep_blocks(MAX_WAITING_BYTES)


def allocate(n_bytes: int) -> NDArray[np.uint8]:
    """Return uninitialised memory that begins at a cache line, and that whole huge pages can back where it is large.

    NumPy asks the system for huge pages from 4 MiB on, but the system uses them only for aligned memory.
    """
    step = CACHE_LINE if n_bytes < 2 * HUGE_PAGE else HUGE_PAGE
    n_whole = -(-n_bytes // step) * step
    try:
        block = _fresh_bytes(n_whole + step)
    except (MemoryError, ValueError):  # ValueError: beyond the range of addresses
        raise MemoryError(f"no memory for an array of {n_bytes:,} bytes, which this size or scene needs") from None
    skip = -block.ctypes.data % step
    return block[skip : skip + n_whole]


def _fresh_bytes(n_bytes: int) -> NDArray[np.uint8]:
    """Return fresh memory; if there is none, unused blocks go back to the system first."""
    try:
        return np.empty(n_bytes, np.uint8)
    except MemoryError:
        engine.keep_blocks(0)
        engine.keep_blocks(MAX_WAITING_BYTES)
        return np.empty(n_bytes, np.uint8)


def _size(shape: tuple[int, ...], dtype: DTypeLike) -> int:
    return math.prod(shape) * np.dtype(dtype).itemsize
