"""Talks to a Dask cluster: checks its workers, returns results of tasks, sends lost tasks again.

Input: a `dask.distributed.Client`, which is the caller's and is not imported for its name. Output: results and errors.
"""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any

from topleft import build_info
from topleft.errors import MissingPackageError, TopleftError

MOST_RESTARTS = 5
"""Most times that a task is sent that was cancelled or lost with the scheduler."""

WAIT_S = 0.05
"""Seconds between two looks at a client that has lost its scheduler."""


def is_client(executor: object) -> bool:
    """Whether an executor is a client of Dask; does not import Dask."""
    kinds = [(kind.__module__.partition(".")[0], kind.__name__) for kind in type(executor).__mro__]
    return ("distributed", "Client") in kinds


def check_workers(client: Any) -> None:
    """Look whether all workers have the package, of this version."""
    from importlib.util import find_spec

    for worker, spec in client.run(find_spec, "topleft").items():
        if spec is None:
            raise MissingPackageError(f"worker {worker} has no topleft: install it there")
    own = build_info()["version"]
    for worker, version in client.run(version_here).items():
        if version != own:
            raise TopleftError(f"worker {worker} has topleft {version}, and this is {own}: install one version")


def version_here() -> str:
    """Return the version of this process's package."""
    version: str = build_info()["version"]
    return version


@contextmanager
def quiet() -> Iterator[None]:
    """Keep Dask from warning that a mesh is large: it is sent once."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
        yield


def result_of(task: Any) -> tuple[Any, BaseException | None]:
    """Return a task's result, or its error; neither where it was cancelled or lost with the scheduler."""
    try:
        if task.status == "finished":
            return task.result(), None
        if task.status == "error":
            return None, task.exception()
    except BaseException as error:
        if "Cancelled" not in type(error).__name__:
            return None, error
    return None, None


def send_again(client: Any, send: Callable[[], None], promise: Future[Any], is_over: Callable[[], bool]) -> None:
    """Send a lost task once more as soon as there is a scheduler, in a thread; cancel its promise if all is over."""

    def again() -> None:
        try:
            while client.status == "connecting" and not is_over():  # such a client forgets tasks that it is given
                time.sleep(WAIT_S)
            if is_over() or promise.done():
                promise.cancel()
            else:
                send()
        except BaseException as error:
            if not promise.done():
                promise.set_exception(error)

    threading.Thread(target=again, daemon=True).start()


def lost(task: str, n_sent: int) -> TopleftError:
    """The error of a task that was lost too often."""
    return TopleftError(f"the cluster has lost {task} {n_sent} times")
