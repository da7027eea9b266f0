"""Writes windows of a raster on the workers of a Dask cluster, to a folder that all of them see, or a store.

Input: a client, and windows as jobs that carry their triangles. Output: the chunks, and a future of each window. A
window is drawn elsewhere if its worker dies; jobs that a dead scheduler has lost are sent again.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from typing import Any

from topleft._apps.cluster import MOST_RESTARTS, check_workers, lost, quiet, result_of, send_again
from topleft._apps.tiles.dask_array import run_job


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


class ClusterWriters:
    """Workers of a cluster that write windows; errors as of `check_workers`."""

    def __init__(self, client: Any) -> None:
        check_workers(client)
        self._client = client
        self.n_most = 2 * max(1, sum(client.nthreads().values())) + 2
        """The number of windows on the way at a time."""

    def submit(self, job: WriteJob) -> Future[None]:
        """Return the future of a window.

        Its error is `KilledWorker` if workers die over it, `TopleftError` if the scheduler was lost too often.
        """
        promise: Future[None] = Future()
        promise.add_done_callback(_tell_waiters)
        self._send(job, promise, 1)
        return promise

    def _send(self, job: WriteJob, promise: Future[None], n_sent: int) -> None:
        with quiet():
            task = self._client.submit(run_job, job, pure=False)

        def end(done: Any) -> None:
            is_written, error = done.status == "finished", result_of(done)[1]
            if promise.done():
                return
            if is_written:
                promise.set_result(None)
            elif error is None and n_sent <= MOST_RESTARTS:
                send_again(self._client, partial(self._send, job, promise, n_sent + 1), promise, lambda: False)
            else:
                promise.set_exception(error or lost(f"the window in row {job.row}, column {job.column}", n_sent))

        promise.add_done_callback(lambda made: task.cancel() if made.cancelled() else None)
        task.add_done_callback(end)


def _tell_waiters(promise: Future[None]) -> None:
    """Let `wait` learn that a promise was cancelled, as an executor would."""
    if promise.cancelled():
        promise.set_running_or_notify_cancel()
