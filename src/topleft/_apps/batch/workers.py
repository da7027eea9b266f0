"""Hands the jobs of a batch to threads or processes, and meshes to processes through files.

Input: the `executor` of a batch, and jobs. Output: futures of outcomes.
"""

from __future__ import annotations

import os
import signal
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from topleft import Level, Levels, Mesh, Scene
from topleft._apps.batch.jobs import Held, Job, JobRunner, Outcome
from topleft.annex.pictures import keep_levels, levels_of
from topleft.errors import MissingPackageError

Jobs = Sequence[tuple[int, Job]]

MOST_OF_A_THREAD, SMALL_PX = 4, 1 << 20
"""Most jobs that a thread gets together, and the size of picture up to which it does."""

N_SPOOLED = 8
"""Files of meshes that are kept for jobs to come, besides files that a job on the way needs."""


@contextmanager
def signals_put_off() -> Iterator[None]:
    """Let SIGINT and SIGTERM wait for their handlers in Python, which may raise, until the block is left.

    A mask would not do: another thread gets the signal then, and the handler runs in the main thread all the same.
    """
    if threading.current_thread() is threading.main_thread():
        with _put_off(signal.SIGINT), _put_off(signal.SIGTERM):
            yield
    else:
        yield


@contextmanager
def _put_off(number: signal.Signals) -> Iterator[None]:
    handler = signal.getsignal(number)
    if not callable(handler):
        yield
        return
    came: list[int] = []
    try:
        signal.signal(number, lambda number, _: came.append(number))
        yield
    finally:
        signal.signal(number, handler)
        if came:
            signal.raise_signal(number)


def workers_of(executor: object) -> Workers | None:
    """Return the workers of an executor or of a number from 1 on, else an error; None for the calling thread."""
    if executor is None:
        return None
    if isinstance(executor, int) and not isinstance(executor, bool):
        if executor < 1:
            raise ValueError(f"executor must be at least 1 thread, got {executor}")
        return OwnThreads(executor)
    from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor  # which take multiprocessing with them

    if not isinstance(executor, Executor):
        raise TypeError(f"executor must be None, a number of threads or an Executor, got {type(executor).__name__}")
    if isinstance(executor, ThreadPoolExecutor):
        return BorrowedThreads(executor)
    return LocalProcesses(executor) if isinstance(executor, ProcessPoolExecutor) else RemoteWorkers(executor)


class Workers:
    """Workers of an executor that the caller owns; jobs are sent as they are."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self.n_workers: int = getattr(executor, "_max_workers", 0) or os.cpu_count() or 1

    def start(self) -> None:
        """Get ready; called before the first job."""

    def prepare(self, jobs: Jobs) -> Jobs:
        """Return jobs as they are submitted; slow work is done here, where signals are handled."""
        return jobs

    def submit(self, jobs: Jobs) -> Future[list[Outcome]]:
        """Submit jobs together, as `prepare` returns them."""
        raise NotImplementedError

    def together(self, job: Job, n_left: int | None) -> int:  # noqa: ARG002
        """The default number of jobs of a scene that are handed over together; of `n_left`, if that is known."""
        return 1

    def release(self, jobs: Jobs) -> None:
        """Free the resources of finished jobs."""

    def restart_after_fork(self) -> bool:
        """Return whether a fork had ended the workers, which have been started again."""
        return False

    def cancel(self, futures: Sequence[Future[Any]]) -> None:
        """Drop jobs that have not begun."""
        for future in futures:
            future.cancel()

    def stop(self) -> None:
        """Free the resources of the batch; called when all jobs that had begun are finished."""


class BorrowedThreads(Workers):
    """Threads of the caller's executor: they see the meshes as they are."""

    def start(self) -> None:
        """Get ready."""
        self._runner = JobRunner(max(4, 2 * self.n_workers))

    def submit(self, jobs: Jobs) -> Future[list[Outcome]]:
        """Submit jobs together."""
        return self._executor.submit(self._runner.draw, jobs)

    def together(self, job: Job, n_left: int | None) -> int:
        """Several if pictures are small and many: each time the caller is woken, workers wait for the GIL.

        Few jobs go one by one, so that no thread draws the last four while the others have nothing to do.
        """
        try:
            width, height = job.checked.size
        except (TypeError, ValueError):  # errors of a job appear when it is drawn
            return 1
        return max(1, min(MOST_OF_A_THREAD, (n_left or 0) // (4 * self.n_workers))) if width * height <= SMALL_PX else 1


class OwnThreads(BorrowedThreads):
    """Threads that the batch starts and ends."""

    def __init__(self, n_workers: int) -> None:
        self.n_workers = n_workers

    def start(self) -> None:
        """Start no thread yet: they come with the first jobs."""
        from concurrent.futures import ThreadPoolExecutor

        super().start()
        self._executor = ThreadPoolExecutor(self.n_workers, thread_name_prefix="topleft-batch")
        self._pid = os.getpid()

    def restart_after_fork(self) -> bool:
        """Start again in a forked child: the threads stayed with the parent, and so did locks that they held."""
        if self._pid == os.getpid():
            return False
        self.start()
        return True

    def stop(self) -> None:
        """End the threads."""
        if self._pid == os.getpid():
            self._executor.shutdown(cancel_futures=True)


class RemoteWorkers(Workers):
    """Workers that may be on other machines: each job carries all that it needs."""

    def submit(self, jobs: Jobs) -> Future[list[Outcome]]:
        """Submit jobs together."""
        return self._executor.submit(draw_in_process, str(os.getpid()), list(jobs))


class LocalProcesses(Workers):
    """Processes on this machine: meshes reach them through files that each reads once."""

    def start(self) -> None:
        """Get ready."""
        self._spool = Spool()

    def prepare(self, jobs: Jobs) -> Jobs:
        """Return jobs with their meshes replaced by files."""
        held = [(self._spool.hold(job.scene, needs_levels(job)) or job.scene) for _, job in jobs]
        return [(index, replace(job, scene=scene)) for (index, job), scene in zip(jobs, held, strict=True)]

    def submit(self, jobs: Jobs) -> Future[list[Outcome]]:
        """Submit jobs together."""
        return self._executor.submit(draw_in_process, self._spool.token, list(jobs))

    def release(self, jobs: Jobs) -> None:
        """Free their meshes."""
        for _, job in jobs:
            self._spool.release(job.scene, needs_levels(job))

    def stop(self) -> None:
        """Remove the files."""
        self._spool.close()


@dataclass(eq=False)
class WithLevels(Held):
    """A mesh or scene, and its coarser levels."""

    scene: Any
    coarser: list[tuple[Mesh, tuple[Level, ...], Any]]

    def __call__(self) -> Any:
        """Return it after giving it its levels."""
        for mesh, *levels in self.coarser:
            keep_levels(mesh, Levels(mesh, *levels))
        return self.scene


@dataclass
class _Place:
    scene: Any  # held, so that no other object gets its id
    at: Any
    n_users: int = 0


class HeldScenes:
    """Meshes and scenes where workers find them, each put there once; the meshes in use and the latest others."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._entries: OrderedDict[tuple[int, bool], _Place] = OrderedDict()

    def put(self, held: Callable[[], Any]) -> Any:
        """Put a function that returns a scene where workers find it, and return where that is."""
        raise NotImplementedError

    def drop(self, at: Any) -> None:
        """Free what `put` has returned."""

    def hold(self, scene: Any, with_levels: bool = False) -> Any:
        """Return where a scene is until it is released; None for names and functions, which stay as they are.

        Levels of detail are made here where they are needed, once, and not in each worker.
        """
        if isinstance(scene, str | os.PathLike) or callable(scene):
            return None
        key = id(scene), with_levels
        with self._lock:
            if key not in self._entries:
                at = self.put(WithLevels(scene, coarser_levels_of(scene) if with_levels else []))
                self._entries[key] = _Place(scene, at)
            entry = self._entries[key]
            self._entries.move_to_end(key)
            entry.n_users += 1
            idle = [key for key, one in self._entries.items() if not one.n_users]
            for key in idle[: max(0, len(self._entries) - N_SPOOLED)]:
                self.drop(self._entries.pop(key).at)
            return entry.at

    def release(self, scene: Any, with_levels: bool = False) -> None:
        """Count one user of the scene less."""
        with self._lock:
            entry = self._entries.get((id(scene), with_levels))
            if entry is not None:
                entry.n_users -= 1

    def forget(self, is_gone: Callable[[Any], bool]) -> None:
        """Forget the scenes that are gone from where they were; they are put there again."""
        with self._lock:
            for key in [key for key, entry in self._entries.items() if is_gone(entry.at)]:
                del self._entries[key]


@dataclass(frozen=True)
class SpooledMesh(Held):
    """A mesh that another process has put into a file, and its levels of detail."""

    path: str

    def __call__(self) -> Any:
        """Read it."""
        import pickle

        with open(self.path, "rb") as file:
            return pickle.load(file)()


class Spool(HeldScenes):
    """Meshes in files of a temporary folder."""

    def __init__(self) -> None:
        import tempfile

        super().__init__()
        self._pid = os.getpid()
        self._folder = tempfile.mkdtemp(prefix="topleft-")
        self._n_written = 0

    @property
    def token(self) -> str:
        """The name of this batch among others."""
        return self._folder

    def put(self, held: Callable[[], Any]) -> SpooledMesh:
        """Write a mesh and its levels to a file."""
        import pickle

        at = SpooledMesh(str(Path(self._folder, f"{self._n_written}.pickle")))
        self._n_written += 1
        with open(at.path, "xb") as file:
            pickle.dump(held, file, pickle.HIGHEST_PROTOCOL)
        return at

    def drop(self, at: SpooledMesh) -> None:
        """Remove a file."""
        os.unlink(at.path)

    def close(self) -> None:
        """Remove the files; in a forked child they are the parent's."""
        import shutil

        if self._pid == os.getpid():
            shutil.rmtree(self._folder, ignore_errors=True)


def coarser_levels_of(scene: Any) -> list[tuple[Mesh, tuple[Level, ...], Any]]:
    """The meshes of a scene, each with its coarser levels and parts; none if they cannot be made: the job raises."""
    if not isinstance(scene, Mesh | Scene):
        return []
    meshes = [scene] if isinstance(scene, Mesh) else [instance.mesh for instance in scene]
    try:
        return [(mesh, levels_of(mesh)[1:], levels_of(mesh).parts) for mesh in dict.fromkeys(meshes)]
    except MissingPackageError:
        return []


def needs_levels(job: Job) -> bool:
    """Return whether a job may be drawn with levels of detail."""
    return bool(job.options.get("tolerance", 0))


_runner: tuple[str, JobRunner] | None = None


def runner_of(token: str) -> JobRunner:
    """The runner of this process for a batch, which keeps the meshes that it has read for the rest of the batch."""
    global _runner
    known = _runner
    if known is None or known[0] != token:
        known = _runner = token, JobRunner()
    return known[1]


def draw_in_process(token: str, jobs: Jobs) -> list[Outcome]:
    """Draw jobs in a worker process."""
    return runner_of(token).draw(jobs)
