"""Many pictures: jobs to files or arrays, on one thread, on several, or by worker processes.

Input: jobs, as many as a generator gives. Output: results, in the order of the jobs or as they come.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from queue import SimpleQueue
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._apps.batch.jobs import Job, JobRunner, Outcome, as_job
from topleft._apps.batch.workers import Workers, signals_put_off, workers_of
from topleft._core.base.array_types import Array
from topleft._core.base.arrays import as_count, as_number, shown
from topleft._core.base.options import parse
from topleft.errors import MeshWarning, MissingPackageError
from topleft.typing import OnErrorOption, OrderOption

Progress = Callable[["Result"], object]


@dataclass(frozen=True, eq=False)
class Result:
    """The outcome of a job.

    Attributes
    ----------
    index : int
        The number of the job, from 0.
    job : Job
    made : ndarray, dict of str to ndarray, or None
        The picture, or the layers by name; None if they went to files or were not made.
    picture : ndarray (H, W, 4) uint8, or None
        The picture; for a job with layers its layer "color", if it has one.
    layers : dict of str to ndarray
        The layers by name; empty for a job without any.
    error : Exception or None
        The error of a job that failed.
    is_skipped : bool
        Whether the job was left out because its files hold its picture (`resume`).
    warnings : tuple of str
        The parts of the file that the mesh lacks, a line each: missing textures, say.
    seconds : float
        The time of the job on its worker; the first job of a shared mesh includes the reading.
    """

    index: int
    job: Job
    made: Array | dict[str, Array] | None = None
    error: Exception | None = None
    is_skipped: bool = False
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def picture(self) -> npt.NDArray[np.uint8] | None:
        """The picture (H, W, 4) uint8; None where it went to a file, or was not made."""
        return self.made.get("color") if isinstance(self.made, dict) else self.made

    @property
    def layers(self) -> dict[str, Array]:
        """The layers by name; empty for a job without any, and where they went to files."""
        return self.made if isinstance(self.made, dict) else {}

    def __repr__(self) -> str:
        """One line: the job and its outcome."""
        if self.error is not None:
            outcome = f"{type(self.error).__name__}: {self.error}"
        elif self.is_skipped:
            outcome = "skipped"
        elif self.layers:
            outcome = ", ".join(f"{name} {array.shape} {array.dtype}" for name, array in self.layers.items())
        elif self.picture is not None:
            outcome = f"picture {self.picture.shape} {self.picture.dtype}"
        else:
            outcome = "written"
        return f"Result({self.index}, {self.job.name}: {outcome})"


@dataclass(frozen=True)
class Summary:
    """The numbers of pictures that were made and left out, and the results of failed jobs."""

    n_made: int
    n_skipped: int
    failed: tuple[Result, ...]


def render_batch(
    jobs: Iterable[Job | tuple[Any, ...]],
    *,
    executor: Executor | int | Any = None,  # Any: a Client of Dask, which is not imported for its name
    progress: Progress | bool | None = None,
    on_error: OnErrorOption = "raise",
    order: OrderOption = "jobs",
    resume: bool = False,
    chunk: int | None = None,
    window: int | None = None,
    time_limit: float | None = None,
) -> Batch:
    """Return an iterator over the results of many jobs; a picture is drawn when its turn comes, not before.

    Parameters
    ----------
    jobs : iterable of Job, or of tuples (scene, camera, size, options, destination, layers), shorter ones too
        May be a generator without an end: no more than `window` times `chunk` pictures are on the way at any time.
    executor : None, int, concurrent.futures.Executor or dask.distributed.Client
        None: the calling thread. A number: so many threads, which end with the batch. An executor is left running. A
        `ProcessPoolExecutor` gets jobs pickled, and each mesh through a file, once for all jobs that share it. Other
        executors get whole jobs. The client of a Dask cluster sends a mesh once, and a worker that dies loses nothing;
        files go to a folder that all workers see. Never changes a bit.
    progress : function of a Result, or True, optional
        Called after each job. True shows a bar with rate and remaining time (tqdm).
    on_error : {"raise", "collect"}
        Whether the first error ends the batch, or results carry their errors.
    order : {"jobs", "completed"}
        Whether results come in the order of the jobs, or as soon as they are there.
    resume : bool
        Leave out a job if all its files are there and were made of equal scene, camera, size, options and layers, by
        this version; all else is drawn again. Each file has a record of them: a digest, and the names of the files that
        the mesh was read from, whose contents count. Functions count by their code and what they hold, not by what they
        call. Files are whole or not there, also after an interrupt. Each file behind a URL costs three requests.
    chunk : int, optional
        How many neighbouring jobs of one scene are handed to a worker together: less to send for each picture. Unless
        given 1; on threads up to 4 of a list of jobs, fewer towards its end, of pictures of a megapixel at most; on a
        cluster as many as should take 0.2 s, by the plan of the first job of each scene.
    window : int, optional
        How many chunks are on the way at a time; unless given, 2 a worker and 2 more.
    time_limit : float, seconds, optional
        For a cluster: a job that takes longer fails with a `TimeoutError`; a worker that does not come back from it is
        ended.

    Returns
    -------
    Batch
        An iterator of `Result`; `finish()` goes through all of them and counts. Use it in a `with` block, or close it,
        if you leave early: nothing new is begun then, and files that are being written are finished.

    Raises
    ------
    ValueError, TypeError
        If an option is none of those. Errors of jobs come as `on_error` says, with the job in their notes.

    Warns
    -----
    MeshWarning
        For each part of a file that a mesh lacks, once a batch.

    Notes
    -----
    Pictures are the unit of threading: each is drawn by one thread, unless its options say otherwise. Threads pay from
    a millisecond a picture on. Smaller pictures are drawn soonest by the calling thread; written to files, by a
    `ProcessPoolExecutor` with ``chunk=32``.

    Examples
    --------
    >>> import topleft as tl
    >>> mesh = tl.Mesh(*tl.scenes.shape("cube"))
    >>> cameras = [tl.Camera.framing(mesh, azimuth_deg=azimuth_deg) for azimuth_deg in range(0, 360, 90)]
    >>> jobs = (tl.Job(mesh, camera, (64, 48)) for camera in cameras)
    >>> [result.picture.shape for result in tl.render_batch(jobs, executor=2)]
    [(48, 64, 4), (48, 64, 4), (48, 64, 4), (48, 64, 4)]
    """
    n_chunk = None if chunk is None else as_count("chunk", chunk)
    n_window = None if window is None else as_count("window", window)
    if not isinstance(jobs, Iterable) or isinstance(jobs, str | bytes | Mapping | np.ndarray):
        raise TypeError(f"jobs must be an iterable of Job, got {shown(jobs)}")
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise TypeError(f"progress must be a function of a Result, True or None, got {shown(progress)}")
    wish = parse(OrderOption, "order", order)
    collects = parse(OnErrorOption, "on_error", on_error) == "collect"
    workers = workers_on(executor, time_limit)
    n_jobs = len(jobs) if isinstance(jobs, Sized) else None
    if workers is None:
        results = _one_by_one(iter(jobs), resume)
    else:
        in_flight = _InFlight(workers, n_window or 2 * workers.n_workers + 2, wish == "completed")

        def most(job: Job, index: int) -> int:
            return n_chunk or workers.together(job, None if n_jobs is None else n_jobs - index)

        chunks = _chunks(iter(jobs), most, resume)
        results = in_flight.results(chunks)
    bar = _bar(n_jobs) if progress is True else None
    return Batch(results, progress if callable(progress) else None, bar, collects=collects)


def workers_on(executor: object, time_limit: float | None) -> Workers | None:
    """Return the workers of a Dask cluster, which alone has a time limit, or of `workers_of`; else a `ValueError`."""
    limit = None if time_limit is None else as_number("time_limit", time_limit)
    if limit is not None and not limit > 0:
        raise ValueError(f"time_limit must be positive, got {time_limit}")
    if any(kind.__module__.partition(".")[0] == "distributed" for kind in type(executor).__mro__):
        from topleft._apps.batch.cluster import ClusterWorkers
        from topleft._apps.cluster import is_client

        if is_client(executor):
            return ClusterWorkers(executor, limit)
    if limit is not None:
        raise ValueError("time_limit is for a dask.distributed.Client: other executors cannot end jobs that hang")
    return workers_of(executor)


class Batch(Iterator[Result]):
    """The results of `render_batch`, drawn while it is iterated over."""

    def __init__(self, results: Iterator[Result], progress: Progress | None, bar: Any, *, collects: bool) -> None:
        self._results, self._progress, self._bar, self._collects = results, progress, bar, collects
        self._told: set[str] = set()

    def __iter__(self) -> Batch:
        return self

    def __next__(self) -> Result:
        try:
            result = next(self._results)
        except BaseException:
            self.close()
            raise
        for line in result.warnings:
            if line not in self._told:
                self._told.add(line)
                warnings.warn(line, MeshWarning, stacklevel=2)
        if self._bar is not None:
            self._bar.update()
        if self._progress is not None:
            self._progress(result)
        if result.error is not None and not self._collects:
            self.close()
            result.error.add_note(f"in job {result.index}: {result.job.name}")
            raise result.error
        return result

    def __enter__(self) -> Batch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End it: jobs that have not begun are dropped, begun jobs are finished."""
        self._results.close()  # type: ignore[attr-defined]
        if self._bar is not None:
            self._bar.close()

    def finish(self) -> Summary:
        """Go through all results and return how many there were; pictures that went to no file are lost."""
        n_made = n_skipped = 0
        failed = []
        for result in self:
            if result.error is not None:
                failed.append(result)
            else:
                n_made, n_skipped = n_made + (not result.is_skipped), n_skipped + result.is_skipped
        return Summary(n_made, n_skipped, tuple(failed))


def _one_by_one(jobs: Iterator[object], resume: bool) -> Iterator[Result]:
    """Results of jobs that the calling thread draws."""
    runner = JobRunner()
    for index, item in enumerate(jobs):
        job = as_job(item, index)
        if resume and runner.is_done(job):
            yield Result(index, job, is_skipped=True)
            continue
        (outcome,) = runner.draw([(index, job)])
        yield _result(job, outcome)


def _result(job: Job, outcome: Outcome) -> Result:
    return Result(outcome.index, job, outcome.picture, outcome.error, False, outcome.warnings, outcome.seconds)


@dataclass(eq=False)
class _Task:
    """Jobs that a worker gets together; `future` is None where all are done already."""

    jobs: list[tuple[int, Job]]
    future: Future[list[Outcome]] | None = None
    came: list[Outcome] | BaseException | None = None
    has_arrived: bool = False

    def end(self, future: Future[list[Outcome]]) -> None:
        """Keep the outcome; called where the task ends, so that the calling thread needs none of the future's locks."""
        try:
            self.came = future.result()
        except BaseException as error:  # told by `results`
            self.came = error

    def results(self) -> list[Result]:
        """The results of the jobs."""
        if self.came is None:
            return [Result(index, job, is_skipped=True) for index, job in self.jobs]
        if isinstance(self.came, Exception):  # a worker could not even send the outcomes
            return [Result(index, job, error=self.came) for index, job in self.jobs]
        if isinstance(self.came, BaseException):
            raise self.came
        return [_result(job, outcome) for (_, job), outcome in zip(self.jobs, self.came, strict=True)]


def _chunks(
    jobs: Iterator[object], most: Callable[[Job, int], int], resume: bool
) -> Iterator[tuple[list[tuple[int, Job]], bool]]:
    """Yield neighbouring jobs of one scene, and whether their files are there.

    `most` returns how many go together, from the first job and its index.
    """
    together: list[tuple[int, Job]] = []
    n, runner = 1, JobRunner()
    for index, item in enumerate(jobs):
        job = as_job(item, index)
        if resume and runner.is_done(job):
            if together:
                yield together, False
                together = []
            yield [(index, job)], True
            continue
        if together and not _is_same(together[-1][1].scene, job.scene):
            yield together, False
            together = []
        if not together:
            n = most(job, index)
        together.append((index, job))
        if len(together) >= n:  # at once: the next job may be long in coming
            yield together, False
            together = []
    if together:
        yield together, False


def _is_same(one: object, other: object) -> bool:
    """Whether two jobs have equal scenes; meshes are compared by identity, names and functions by value."""
    return one is other or ((isinstance(one, (str, os.PathLike)) or callable(one)) and bool(one == other))


class _InFlight:
    """Tasks that are on the way, a bounded number of them.

    Futures and executors are touched while signals are put off: a handler that raises would leave their locks taken,
    and workers would wait for ever. Finished tasks arrive through a queue; waiting there can be interrupted.
    """

    def __init__(self, workers: Workers, window: int, as_completed: bool) -> None:
        self._workers = workers
        self._window = window
        self._as_completed = as_completed
        self._tasks: dict[_Task, None] = {}
        self._done: SimpleQueue[_Task] = SimpleQueue()
        self._pid = os.getpid()

    def results(self, chunks: Iterator[tuple[list[tuple[int, Job]], bool]]) -> Iterator[Result]:
        """Yield the results of all jobs."""
        self._workers.start()
        try:
            while self._fill(chunks):
                if self._workers.restart_after_fork():  # a fork took the workers away: tasks on the way begin again
                    self._pid, self._done = os.getpid(), SimpleQueue()
                    for task in self._tasks:
                        if task.future is not None and task.came is None:
                            self._submit(task)
                        elif not task.has_arrived:
                            self._done.put(task)
                task = self._next_done()
                del self._tasks[task]
                results = task.results()
                self._workers.release(task.jobs)
                task.future = task.came = None  # the future holds the task, and that the pictures
                yield from results
        finally:
            if self._pid == os.getpid():  # in a forked child nothing is on the way
                with signals_put_off():
                    self._workers.cancel([task.future for task in self._tasks if task.future is not None])
                while not all(task.future is None or task.came is not None for task in self._tasks):
                    self._done.get()
            self._workers.stop()

    def _fill(self, chunks: Iterator[tuple[list[tuple[int, Job]], bool]]) -> bool:
        """Put tasks on the way while there is room; tell whether there are any."""
        while len(self._tasks) < self._window:
            found = next(chunks, None)
            if found is None:
                break
            jobs, is_done = found
            task = _Task(jobs)
            if is_done:
                self._tasks[task] = None
                self._done.put(task)
            else:
                self._submit(task)
        return bool(self._tasks)

    def _submit(self, task: _Task) -> None:
        """Submit a task; it has failed already if one of the workers was killed."""
        sent, done = self._workers.prepare(task.jobs), self._done

        def end(future: Future[list[Outcome]]) -> None:
            task.end(future)
            done.put(task)

        with signals_put_off():
            try:
                task.future = self._workers.submit(sent)
            except BrokenExecutor as error:
                task.future = Future()
                task.future.set_exception(error)
            self._tasks[task] = None
            task.future.add_done_callback(end)

    def _next_done(self) -> _Task:
        """Wait for the next task: in the order of the jobs, or as they are done."""
        if self._as_completed:
            return self._done.get()
        task = next(iter(self._tasks))
        while not task.has_arrived:
            self._done.get().has_arrived = True
        return task


def _bar(n_jobs: int | None) -> Any:
    """A bar with rate and remaining time."""
    try:
        from tqdm import tqdm
    except ImportError:
        raise MissingPackageError("progress=True needs tqdm: pip install tqdm") from None
    return tqdm(total=n_jobs, unit="picture")
