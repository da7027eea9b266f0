"""Does work ahead of its caller: blocks of a mesh, windows of a raster, each on another thread.

Input: a function, and its arguments. Output: its results, in order.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import TypeVar

from topleft._core.base.memory import KeptMemory

Item = TypeVar("Item")
Made = TypeVar("Made")


def in_order(make: Callable[[Item], Made], items: Iterable[Item], n_threads: int, n_ahead: int = 0) -> Iterator[Made]:
    """Yield the results of a function for items, in their order, on so many threads.

    At most `n_ahead` are begun before they are taken, twice as many as there are threads unless given. With one thread
    the caller makes all, and nothing is begun ahead. In a forked child, without threads, the caller makes the rest.
    """
    if n_threads == 1:
        yield from map(make, items)
        return
    waiting: deque[tuple[Item, Future[Made] | None]] = deque()
    pool, pid, rest = ThreadPoolExecutor(n_threads, thread_name_prefix="topleft-tiles"), os.getpid(), iter(items)
    try:
        while True:
            while len(waiting) < (n_ahead or 2 * n_threads):
                try:
                    item = next(rest)
                except StopIteration:
                    break
                waiting.append((item, submitted(pool, make, item) if os.getpid() == pid else None))
            if not waiting:
                return
            item, future = waiting.popleft()
            yield make(item) if future is None or os.getpid() != pid else future.result()
    finally:
        if os.getpid() == pid:
            begun = [future for _, future in waiting if future is not None and not future.cancel()]
            wait(begun)
            pool.shutdown()


_kept = threading.local()


def kept_memory() -> KeptMemory:
    """Return memory that a thread keeps from block to block and from window to window."""
    memory: KeptMemory | None = getattr(_kept, "memory", None)
    if memory is None:
        memory = _kept.memory = KeptMemory()
    return memory


def submitted(pool: ThreadPoolExecutor, make: Callable[[Item], Made], item: Item) -> Future[Made] | None:
    """Hand an item to a thread; None where the system or a Python that ends gives none: the caller then makes it."""
    try:
        return pool.submit(make, item)
    except RuntimeError:  # "can't start new thread", "cannot schedule new futures after shutdown"
        return None
