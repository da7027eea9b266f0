"""Threads: rows of one picture, drawn side by side. The pool costs nothing until it is used and survives ``fork``."""

from __future__ import annotations

import operator
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

__all__ = ["available_threads", "parse_threads", "run_bands"]

#: Below this many triangles a picture is drawn by the calling thread alone, unless the caller asks for more.
MIN_TRIANGLES_PER_THREAD = 2000

_pool: ThreadPoolExecutor | None = None


def _forget_pool() -> None:
    """Drop the pool in a forked child: its threads stayed with the parent."""
    global _pool
    _pool = None


os.register_at_fork(after_in_child=_forget_pool)


def available_threads() -> int:
    """Return how many threads this process may use: ``TOPLEFT_NUM_THREADS``, or the CPUs that it may run on."""
    text = os.environ.get("TOPLEFT_NUM_THREADS", "").strip()
    if not text:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not text.isdecimal() or int(text) < 1:
        raise ValueError(f"TOPLEFT_NUM_THREADS must be a positive integer, got {text!r}")
    return int(text)


def parse_threads(threads: object) -> int | None:
    """Return a positive number of threads, or None for "as many as pay"."""
    if threads is None:
        return None
    try:
        n = operator.index(threads)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"threads must be an integer or None, got {threads!r}") from None
    if n < 1:
        raise ValueError(f"threads must be at least 1, got {n}")
    return n


def run_bands(draw_rows: Callable[[int, int], None], n_rows: int, n_triangles: int, threads: int | None) -> None:
    """Call ``draw_rows(first_row, n_rows)`` on bands that together are all rows; the calling thread takes the first."""
    if threads is None:
        threads = min(available_threads(), max(1, n_triangles // MIN_TRIANGLES_PER_THREAD))
    n_bands = max(1, min(threads, n_rows))
    bounds = [n_rows * i // n_bands for i in range(n_bands + 1)]
    bands = [(first, end - first) for first, end in pairwise(bounds)]
    jobs = [_shared_pool().submit(draw_rows, *band) for band in bands[1:]]
    try:
        draw_rows(*bands[0])
    finally:
        for job in jobs:
            job.result()


def _shared_pool() -> ThreadPoolExecutor:
    global _pool
    if _pool is None:
        _pool = ThreadPoolExecutor(max_workers=os.cpu_count() or 1, thread_name_prefix="topleft")
    return _pool
