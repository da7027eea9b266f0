"""Writes windows of a raster on the workers of a Dask cluster, to a folder that all of them see, or a store.

Input: a client, and windows as jobs that carry what they need. Output: the chunks; the windows that are there, as they
come. A window whose worker dies is drawn elsewhere; what was on the way when a scheduler died is sent again.
"""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from topleft._apps.cluster import MOST_RESTARTS, check_workers, quiet, result_of, wait_for_scheduler
from topleft.errors import TopleftError

Block = tuple[int, int, int]


@dataclass(frozen=True)
class WriteJob:
    """A window to be drawn and written elsewhere."""

    store: Any
    draw: Callable[[], Any]
    row: int
    column: int
    prepare: Callable[[Any], Any] | None

    def __call__(self) -> None:
        """Draw and write it."""
        pixels = self.draw()
        self.store.write(0, self.row, self.column, pixels if self.prepare is None else self.prepare(pixels))


def run_write(job: WriteJob) -> None:
    """Draw and write a window."""
    job()


def write_on_cluster(client: Any, make: Callable[[Block], WriteJob], blocks: Iterator[Block]) -> Iterator[Block]:
    """Write windows, two more than twice as many at a time as there are threads; yield each when it is there.

    Raises
    ------
    MissingPackageError, TopleftError
        If a worker lacks the package, or has another version; if the scheduler was lost too often.
    KilledWorker
        If workers die over a window.
    """
    check_workers(client)
    done: queue.SimpleQueue[Any] = queue.SimpleQueue()
    running: dict[str, tuple[Any, Block, int]] = {}  # the task, and how often its window was sent

    def send(block: Block, n_sent: int) -> None:
        with quiet():
            task = client.submit(run_write, make(block), pure=False)
        running[task.key] = task, block, n_sent
        task.add_done_callback(done.put)

    n_most = 2 * max(1, sum(client.nthreads().values())) + 2
    try:
        while True:
            while len(running) < n_most and (block := next(blocks, None)) is not None:
                send(block, 1)
            if not running:
                return
            task, block, n_sent = running.pop(done.get().key)
            is_written, error = task.status == "finished", result_of(task)[1]
            if error is not None:
                raise error
            if is_written:
                yield block
                continue
            if n_sent > MOST_RESTARTS:
                _, row, column = block
                raise TopleftError(f"the cluster has lost the window in row {row}, column {column} {n_sent} times")
            wait_for_scheduler(client, lambda: False)
            send(block, n_sent + 1)
    finally:
        if running:
            client.cancel([task for task, _, _ in running.values()])
