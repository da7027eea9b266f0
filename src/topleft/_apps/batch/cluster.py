"""Hands the jobs of a batch to the workers of a Dask cluster.

Input: a `dask.distributed.Client`, and jobs. Output: futures of outcomes. A mesh is a task of its own: the client sends
it to the scheduler once, each worker that draws it gets it once, and when a worker dies another one makes it again.

Dask repeats a task when its worker dies. Jobs that were together when workers died over them are tried one by one, so
that the error names only the job that kills workers. Tasks that were lost with the scheduler, or cancelled by a restart
of the cluster, are sent again.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from typing import Any

from topleft import Mesh
from topleft._apps.batch.jobs import Job, JobRunner, Outcome
from topleft._apps.batch.workers import HeldScenes, Jobs, Workers, coarser_levels_of, needs_levels, runner_of
from topleft._apps.cluster import MOST_RESTARTS, check_workers, lost, quiet, result_of, send_again
from topleft.errors import MissingPackageError

MESH_KEY = "topleft-mesh"
"""The beginning of the keys of tasks that hold a mesh."""

GONE = ("cancelled", "lost", "error")
"""States of the future of a mesh that is gone."""

TASK_ITEMS = 12_000_000
"""Triangles and pixels of a task: about 200 ms, a hundred times as long as handing it over."""

MOST_TOGETHER = 64
UNKNOWN_TOGETHER = 4
"""Jobs of a task if only the worker reads the mesh."""

MOST_TRIALS = 2
"""Trials of a single job after workers died over it."""

GRACE_S = 5.0
"""How long a job may take to end once its time is over, before its process is ended."""


def hold_scene(held: Callable[[], Any]) -> Callable[[], Any]:
    """Keep a scene as the result of a task."""
    return held


class ClusterScenes(HeldScenes):
    """Scenes on a Dask cluster."""

    def __init__(self, client: Any, token: str) -> None:
        super().__init__()
        self._client, self._key = client, f"{MESH_KEY}-{token}"

    def put(self, held: Callable[[], Any]) -> Any:
        """Send a scene there, and return its future."""
        with quiet():
            return self._client.submit(hold_scene, held, key=f"{self._key}-{os.urandom(8).hex()}")


class ClusterWorkers(Workers):
    """Workers of a Dask cluster."""

    def __init__(self, client: Any, time_limit: float | None = None) -> None:
        self._client = client
        self._time_limit = time_limit
        self._lock = threading.RLock()
        self._ends = False
        self._suspects: deque[tuple[tuple[int, Job], Future[list[Outcome]], int]] = deque()
        self._is_trying = False
        self._dropped: set[Future[list[Outcome]]] = set()
        self._token = f"{os.getpid()}-{os.urandom(6).hex()}"
        self._scenes = ClusterScenes(client, self._token)
        self._together: dict[int, int] = {}

    @property
    def n_workers(self) -> int:  # type: ignore[override]
        """Threads of all workers, at least one: some may be still to come."""
        return max(1, sum(self._client.nthreads().values()))

    def start(self) -> None:
        """Look whether all workers have the package, of this version; errors as of `check_workers`."""
        check_workers(self._client)

    def prepare(self, jobs: Jobs) -> Jobs:
        """Return jobs, after making the levels of detail that are sent with their mesh."""
        if needs_levels(jobs[0][1]):
            coarser_levels_of(jobs[0][1].scene)
        return jobs

    def submit(self, jobs: Jobs) -> Future[list[Outcome]]:
        """Submit jobs together, their mesh by itself."""
        promise: Future[list[Outcome]] = Future()
        self._send(list(jobs), promise)
        return promise

    def _send(
        self, jobs: list[tuple[int, Job]], promise: Future[list[Outcome]], n_restarts: int = 0, n_trials: int = 0
    ) -> None:
        if n_restarts:
            self._scenes.forget(lambda future: future.status in GONE)
        held = self._scenes.hold(jobs[0][1].scene, needs_levels(jobs[0][1]))
        light = [(index, replace(job, scene=None) if held is not None else job) for index, job in jobs]
        with quiet():
            task = self._client.submit(
                draw_on_worker, self._token, light, held, self._time_limit, pure=False, retries=0
            )  # fmt: skip

        def end(done: Any) -> None:
            try:
                self._end(done, jobs, promise, n_restarts, n_trials)
            except BaseException as error:
                if not promise.done():
                    promise.set_exception(error)

        task.add_done_callback(end)

        def drop(made: Future[list[Outcome]]) -> None:
            if made.cancelled():
                task.cancel()
                if not made.running() and made not in self._dropped:
                    self._dropped.add(made)
                    made.set_running_or_notify_cancel()  # whoever waits learns of it

        promise.add_done_callback(drop)

    def _end(
        self, task: Any, jobs: list[tuple[int, Job]], promise: Future[list[Outcome]], n_restarts: int, n_trials: int
    ) -> None:
        """Hand on the outcome of a task, or try again."""
        if n_trials:
            self._is_trying = False
        if promise.done():
            return
        outcomes, error = came_of(task)
        if outcomes is not None:
            promise.set_result(outcomes)
        elif error is None and not self._ends and n_restarts < MOST_RESTARTS:
            self._is_trying = self._is_trying or n_trials > 0
            again = partial(self._send, jobs, promise, n_restarts + 1, n_trials)
            send_again(self._client, again, promise, lambda: self._ends)
        elif type(error).__name__ == "KilledWorker" and n_trials < MOST_TRIALS and not self._ends:
            self._suspect(jobs, promise, n_trials + 1)
        else:
            promise.set_exception(error or lost("the job", 1 + n_restarts))
        self._try_next()

    def _suspect(self, jobs: list[tuple[int, Job]], promise: Future[list[Outcome]], n_trials: int) -> None:
        """Let each job be tried by itself, and no two at a time: workers died over them, but maybe for another job."""
        if len(jobs) == 1:
            self._suspects.append((jobs[0], promise, n_trials))
            return
        parts: list[Future[list[Outcome]]] = [Future() for _ in jobs]
        outcomes: dict[int, Outcome] = {}

        def collect(i: int, part: Future[list[Outcome]]) -> None:
            try:
                (outcomes[i],) = part.result()
            except Exception as error:
                outcomes[i] = Outcome(jobs[i][0], error=error)
            if len(outcomes) == len(jobs) and not promise.done():
                promise.set_result([outcomes[k] for k in range(len(jobs))])

        for i, (part, job) in enumerate(zip(parts, jobs, strict=True)):
            part.add_done_callback(partial(collect, i))
            self._suspects.append((job, part, n_trials))

    def _try_next(self) -> None:
        """Send the next job that workers died over, if no other such job is on the way."""
        with self._lock:
            if self._is_trying or not self._suspects or self._ends:
                return
            self._is_trying = True
            job, promise, n_trials = self._suspects.popleft()
        self._send([job], promise, n_trials=n_trials)

    def together(self, job: Job, n_left: int | None) -> int:  # noqa: ARG002
        """The number of jobs of a scene in a task, from the size of the first job."""
        key = id(job.scene)
        if key not in self._together:
            self._together[key] = jobs_of_task(job)
        return self._together[key]

    def release(self, jobs: Jobs) -> None:
        """Free their mesh."""
        if jobs:
            self._scenes.release(jobs[0][1].scene, needs_levels(jobs[0][1]))

    def cancel(self, futures: Sequence[Future[Any]]) -> None:
        """Drop tasks that have not begun; tasks that are lost from now on are not sent again."""
        self._ends = True
        super().cancel(futures)

    def stop(self) -> None:
        """Free the meshes."""
        self._scenes.forget(lambda _: True)


def came_of(task: Any) -> tuple[list[Outcome] | None, BaseException | None]:
    """The outcomes of a task, or its error; neither where it was cancelled or lost with the scheduler."""
    outcomes, error = result_of(task)
    # workers died while a mesh was made again there, for whatever jobs
    is_of_mesh = type(error).__name__ == "KilledWorker" and str(getattr(error, "task", "")).startswith(MESH_KEY)
    return outcomes, None if error is None or is_of_mesh else told(error)


def told(error: BaseException) -> BaseException:
    """Return the error of a task, in one line where the worker lacks the package."""
    if isinstance(error, ModuleNotFoundError) and (error.name or "").partition(".")[0] == "topleft":
        return MissingPackageError("a worker that has joined the cluster has no topleft: install it there")
    return error


def jobs_of_task(job: Job) -> int:
    """How many jobs of this size have about `TASK_ITEMS` triangles and pixels together."""
    if not isinstance(job.scene, Mesh):
        return UNKNOWN_TOGETHER
    try:
        width, height = job.checked.size
    except (TypeError, ValueError):  # raised when the job is drawn
        return 1
    n_items = len(job.scene.triangles) + width * height
    return max(1, min(MOST_TOGETHER, TASK_ITEMS // max(1, n_items)))


def draw_on_worker(
    token: str, jobs: list[tuple[int, Job]], held: Callable[[], Any] | None, time_limit: float | None
) -> list[Outcome]:
    """Draw jobs on a worker."""
    runner = runner_of(token)
    own = [(index, replace(job, scene=held) if held is not None else job) for index, job in jobs]
    if time_limit is None:
        return runner.draw(own)
    return [outcome for one in own for outcome in draw_in_time(runner, one, time_limit)]


class _TimeIsOver(BaseException):
    """Raised in a thread when its job takes too long."""


def draw_in_time(runner: JobRunner, job: tuple[int, Job], time_limit: float) -> list[Outcome]:
    """Draw a job, or interrupt it after so many seconds; end the process if the job cannot be interrupted."""
    import ctypes

    thread, lock = threading.get_ident(), threading.Lock()
    is_done = False

    def give_up() -> None:
        with lock:
            if not is_done:
                raise_in = ctypes.pythonapi.PyThreadState_SetAsyncExc
                raise_in(ctypes.c_ulong(thread), ctypes.py_object(_TimeIsOver))

    timers = [threading.Timer(time_limit, give_up), threading.Timer(time_limit + GRACE_S, os._exit, (1,))]
    for timer in timers:
        timer.daemon = True
        timer.start()
    try:
        outcomes = runner.draw([job])
        with lock:
            is_done = True
        return outcomes
    except _TimeIsOver:
        error = TimeoutError(f"job {job[0]} took longer than its time limit of {time_limit:g} s")
        return [Outcome(job[0], error=error)]
    finally:
        is_done = True
        for timer in timers:
            timer.cancel()
