"""Threads: rows of one picture, drawn side by side. The pool costs nothing until it is used and survives ``fork``."""

from __future__ import annotations

import operator
import os
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar

from topleft._core import engine
from topleft._core.base.memory import SCRATCH

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

Part = TypeVar("Part")

#: Triangles of a scene of instances, of lines or of arrays that are worth a thread; draws: `choices.threads_to_draw`.
MIN_TRIANGLES_PER_THREAD = 2000

#: Triangles or vertices that are worth one for less: a millisecond, where the first use of the pool takes four.
MIN_ROWS_PER_THREAD = 50_000


class ProcessLock:
    """A lock of this process: a child of ``fork`` finds it free, since the thread that held it stayed with the parent.

    `new`: `threading.Lock` or `threading.RLock`.
    """

    def __init__(self, new: Callable[[], Any] = threading.Lock) -> None:
        self._new, self._lock = new, new()
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._renew)

    def _renew(self) -> None:
        self._lock = self._new()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *error: object) -> None:
        self._lock.release()


_pool: ThreadPoolExecutor | None = None
_pool_lock = ProcessLock()


def _forget_pool() -> None:
    """Drop the pool in a forked child: its threads stayed with the parent."""
    global _pool
    _pool = None


def _hear_signals() -> None:
    """Let kernels answer Ctrl-C in the main thread, which in a child is the thread that forked."""
    engine.handle_signals_in(threading.main_thread().ident or 0, SCRATCH.threads)


_hear_signals()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)
    os.register_at_fork(after_in_child=_hear_signals)


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


def count_threads(threads: int | None, n_triangles: int) -> int:
    """Return how many threads a scene is worth."""
    if threads is None:
        return min(available_threads(), max(1, n_triangles // MIN_TRIANGLES_PER_THREAD))
    return threads


def threads_for(threads: object, n_triangles: int) -> int:
    """Return how many threads a scene is worth, of the number that a caller gave."""
    return count_threads(parse_threads(threads), n_triangles)


def threads_of_rows(n: int, threads: int | None = None) -> int:
    """Return how many threads are worth it to measure or move, not draw, some triangles or vertices."""
    if threads is not None:
        return threads
    return 1 if n < 2 * MIN_ROWS_PER_THREAD else min(count_threads(None, n), n // MIN_ROWS_PER_THREAD)


def run_parts(work: Callable[[int, int], Part], n: int, n_parts: int, n_threads: int | None = None) -> list[Part]:
    """Return ``work(first, end)`` of ranges that together are [0, n); the calling thread takes the first of them.

    A thread that is done takes the next part that none has begun; there is a thread for each part, or `n_threads`. The
    calling thread takes all of them where there are no threads, or no longer any, as while Python ends.
    """
    n_parts = max(1, min(n_parts, n))
    if n_parts == 1:  # of small pictures: lists of parts would take a tenth of the call
        return [work(0, n)]
    n_threads = n_parts if n_threads is None else min(n_threads, n_parts)
    parts = list(pairwise(n * i // n_parts for i in range(n_parts + 1)))
    if n_threads == 1:
        return [work(*part) for part in parts]
    waiting = deque(enumerate(parts))
    results: dict[int, Part] = {}

    def take() -> None:
        while waiting:
            try:
                i, part = waiting.popleft()
            except IndexError:  # another thread was faster
                return
            results[i] = work(*part)

    jobs: list[Future[None]] = []
    stop = engine.Stop()
    try:
        _start(lambda: stop.run(take), n_threads - 1, jobs)
        take()
        _finish(jobs)
    except BaseException:
        waiting.clear()
        stop.set()
        _finish_whatever_comes(jobs)  # never leave while another thread writes to the caller's memory
        raise
    return [results[i] for i in range(n_parts)]


def _start(take: Callable[[], None], n: int, jobs: list[Future[None]]) -> None:
    """Let up to n threads take parts; fewer if the system refuses them, or Python is shutting down."""
    try:
        pool = _shared_pool()
        for _ in range(n):
            jobs.append(pool.submit(take))
    except RuntimeError:  # "can't start new thread", "cannot schedule new futures after shutdown"
        return


def _finish(jobs: list[Future[None]]) -> None:
    """Wait for the jobs that have begun; raise their errors."""
    for job in jobs:
        if not job.cancel():
            job.result()


def _finish_whatever_comes(jobs: list[Future[None]]) -> None:
    """Wait for the jobs that have begun, through every further Ctrl-C."""
    for job in jobs:
        is_over = False
        while not is_over:
            with suppress(BaseException):  # an error is on its way already
                is_over = job.cancel() or (job.exception(), True)[1]


def _shared_pool() -> ThreadPoolExecutor:
    global _pool
    with _pool_lock:
        if _pool is None:
            from concurrent.futures import ThreadPoolExecutor  # 4 ms that one thread does without

            _pool = ThreadPoolExecutor(max_workers=os.cpu_count() or 1, thread_name_prefix="topleft")
        return _pool
