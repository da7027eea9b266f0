"""Talks to a Dask cluster: whether its workers can draw, and what came of a task.

Input: a `dask.distributed.Client`, which is the caller's and is not imported for its name. Output: results and errors.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from topleft import build_info
from topleft.errors import MissingPackageError, TopleftError

MOST_RESTARTS = 5
"""How often a task is sent again that was cancelled or lost with the scheduler."""

WAIT_S = 0.05
"""How often a client that has lost its scheduler is looked at."""


def is_client(executor: object) -> bool:
    """Whether it is a client of Dask, which is not imported for that."""
    kinds = [(kind.__module__.partition(".")[0], kind.__name__) for kind in type(executor).__mro__]
    return ("distributed", "Client") in kinds


def check_workers(client: Any) -> None:
    """Look whether all workers have the package, of this version.

    Raises
    ------
    MissingPackageError
        If one has not.
    TopleftError
        If one has another version.
    """
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


def wait_for_scheduler(client: Any, is_over: Callable[[], bool]) -> None:
    """Wait while a client has lost its scheduler, unless it is over: until then it forgets what it is given."""
    while client.status == "connecting" and not is_over():
        time.sleep(WAIT_S)
