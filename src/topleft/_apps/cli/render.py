"""`topleft render`: from arguments to files.

Every mesh is rendered; one that fails does not stop the rest, and is listed at the end.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import threading
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from topleft import save_image
from topleft._apps.batch.batch import Result, render_batch
from topleft._apps.batch.jobs import Job
from topleft._apps.cli.animation import check_animation, save_animation
from topleft._apps.cli.arguments import FAILED, REFUSED, UsageError
from topleft._apps.cli.job_file import read_jobs
from topleft._apps.cli.report import TOLD, check_report, complain, complain_of_lacks, one_line, write_report
from topleft._apps.cli.sheet import make_sheet
from topleft._apps.cli.targets import MeshJobs, check_targets, check_words, folders_of, plan_jobs, sheet_background
from topleft._core.base.defaults import PICTURE_SUFFIXES
from topleft._core.base.remote import is_url
from topleft.errors import MeshWarning, MissingPackageError

MOST_VIEWS_TOGETHER = 16
"""Views of a mesh that a process draws before it reports: it reads the mesh once for them."""


BROKEN, AT_REST = "members of its archive left out", ": everything is at rest"
"""Of warnings: a part of the input failed; the file has more moments than the one that is drawn, and lacks nothing."""

CONNECT_S = 20
"""Seconds that a scheduler has to answer."""


def run_render(options: argparse.Namespace) -> int:
    """Render meshes to pictures."""
    with ExitStack() as stack:
        groups = _plan(options, stack)
        animations = _animations(groups, options)
        extras = [path for path, _ in animations] + ([Path(options.sheet)] if options.sheet else [])
        for path, _ in animations:
            check_animation(path)
        if extras:
            _check_pictures(groups, options)
        if options.report:
            check_report(options.report)
            extras.append(Path(options.report))
        check_targets(groups, extras)
        results = _render(groups, options)
        if options.report:
            write_report(Path(options.report), (group.source for group in groups for _ in group.jobs), results)
        reasons = _reasons(groups, results)
        for message in dict.fromkeys(filter(None, reasons)):
            complain(message)
        drawn = [result for result in results if result.error is None]
        lacks = list(dict.fromkeys(line for result in drawn for line in result.warnings))
        complain_of_lacks(lacks, is_each_told=options.warnings == "all")
        failed = [group.source for group, reason in zip(groups, reasons, strict=True) if reason]
        if failed and len(groups) > 1:
            complain(f"{len(failed)} of {len(groups)} meshes failed: {' '.join(dict.fromkeys(failed))}")
        if not drawn:
            for error in (result.error for result in results):
                if error is not None and not isinstance(error, TOLD):  # a bug: its trace belongs in the report
                    raise error
            return REFUSED
        for path, group in animations:
            if all(file.is_file() for file in _color_files(group)):
                path.parent.mkdir(parents=True, exist_ok=True)
                asked = options.background  # frames that are opaque show none of it
                opaque = asked[:3] if asked is not None and asked[3] else (255, 255, 255)
                save_animation(path, _color_files(group), fps=options.fps, background=opaque)
        if options.sheet:
            Path(options.sheet).parent.mkdir(parents=True, exist_ok=True)
            files = [_color_files(group) for group in groups]
            sheet = make_sheet(files, captions_of(groups), reasons, sheet_background(options))
            save_image(options.sheet, sheet)
    is_broken = any(BROKEN in line for line in lacks)
    return FAILED if failed or is_broken or (options.strict and any(AT_REST not in line for line in lacks)) else 0


def _reasons(groups: Sequence[MeshJobs], results: Sequence[Result]) -> list[str]:
    """The error of each mesh, from its first failed job; empty for meshes without a failure."""
    left, reasons = iter(results), []
    for group in groups:
        errors = [error for error in (next(left).error for _ in group.jobs) if error is not None]
        reason = one_line(errors[0]) if errors else ""
        is_named = not reason or len(groups) == 1 or group.source in reason
        reasons.append(reason if is_named else f"{group.source}: {reason}")
    return reasons


def captions_of(groups: Sequence[MeshJobs]) -> list[str]:
    """The name of each mesh, or its file and folder where another mesh has that stem."""
    sources = [group.source for group in groups]
    n_of = Counter(Path(source).stem for source in sources)
    rows = zip(groups, folders_of(sources), strict=True)
    return [
        group.name if n_of[Path(group.source).stem] == 1 else Path(folder, Path(group.source).name).as_posix()
        for group, folder in rows
    ]


def _plan(options: argparse.Namespace, stack: ExitStack) -> list[MeshJobs]:
    """Return the jobs of the command line or the job file, by mesh."""
    if options.jobs_file and options.meshes:
        raise UsageError("a job file names its meshes itself: give MESH or --jobs-file, not both")
    if not options.jobs_file and not options.meshes:
        raise UsageError("there is nothing to render: give MESH or --jobs-file (try: topleft render --help)")
    given = read_jobs(Path(options.jobs_file), options) if options.jobs_file else [options]
    groups: list[MeshJobs] = []
    for each in given:
        if each.out is None:
            if not (options.sheet or options.animation):
                raise UsageError("say where pictures go: -o/--out, --sheet or --animation (try: topleft render --help)")
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="topleft-"))
            each.out = str(Path(folder, "{index}-{view}.png"))
        if each.threads is None and options.jobs > 1:
            each.threads = 1
        groups += plan_jobs(each, len(groups))
    return groups


def _render(groups: Sequence[MeshJobs], options: argparse.Namespace) -> list[Result]:
    """Render all, whatever fails; return the results in the order of the jobs."""
    jobs = [job for group in groups for job in group.jobs]
    if options.dask is not None:
        jobs = [_elsewhere(job) for job in jobs]
    with ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore", MeshWarning)  # results have them
        has_bar = len(jobs) > 1 and sys.stderr.isatty() and find_spec("tqdm") is not None  # somebody looks at it
        executor = (
            _executor(groups, options.jobs, stack)
            if options.dask is None
            else client_of(options.dask, options.jobs, stack)
        )
        chunk = min(MOST_VIEWS_TOGETHER, max(len(group.jobs) for group in groups))
        batch = stack.enter_context(
            render_batch(
                jobs, executor=executor, progress=has_bar, on_error="collect", order="completed",
                resume=options.resume, chunk=None if options.dask or isinstance(executor, int) else chunk,
            )
        )  # fmt: skip
        results = []
        for result in batch:
            if isinstance(result.error, BrokenExecutor):  # all later jobs fail alike
                raise result.error
            results.append(result)
    return sorted(results, key=lambda result: result.index)


def _executor(groups: Sequence[MeshJobs], n: int, stack: ExitStack) -> Executor | int | None:
    """Return processes for several meshes, since readers are Python and hold the GIL; else threads."""
    if n == 1 or len(groups) == 1:
        return n if n > 1 else None
    from concurrent.futures import ProcessPoolExecutor

    class Processes(ProcessPoolExecutor):
        """Processes that Ctrl-C does not reach, also while `submit` starts them, or the server that they fork from."""

        def submit(self, *arguments: Any, **options: Any) -> Any:
            with _interrupts_blocked():
                return super().submit(*arguments, **options)

    pool = Processes(min(n, len(groups)), initializer=_depend_on_parent)
    stack.callback(pool.shutdown, cancel_futures=True)
    return pool


def _elsewhere(job: Job) -> Job:
    """Return a job with absolute paths: workers may run in other folders."""
    scene, path = job.scene, job.destination
    if isinstance(scene, str | os.PathLike):
        scene = Path(scene).absolute()
    if path is not None and not is_url(path):
        path = Path(path).absolute()
    return replace(job, scene=scene, destination=path)


def client_of(address: str, n_workers: int, stack: ExitStack) -> Any:
    """Return a client of the cluster at an address, or of a cluster on this machine that ends with the command."""
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise MissingPackageError("--dask needs the package distributed: pip install distributed") from None
    if address == "local":
        stack.enter_context(dask.config.set({"distributed.comm.timeouts.connect": "30s"}))
        cluster = LocalCluster(
            n_workers=n_workers, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=40
        )  # fmt: skip
        stack.enter_context(cluster)
        return stack.enter_context(Client(cluster, set_as_default=False))
    if "://" not in address:
        raise UsageError(f"--dask {address}: must be local, or the address of a scheduler, tcp://HOST:PORT")
    try:
        return stack.enter_context(Client(address, timeout=CONNECT_S, set_as_default=False))
    except OSError as error:
        raise UsageError(f"--dask {address}: no scheduler answers there ({one_line(error)})") from None


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Let Ctrl-C wait; processes that are started meanwhile never see it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _depend_on_parent() -> None:
    """Leave Ctrl-C to the parent, which waits for pictures on the way; end when the parent has ended."""
    warnings.simplefilter("ignore", RuntimeWarning)  # as in `main`
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    import multiprocessing
    from multiprocessing.connection import wait

    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _animations(groups: Sequence[MeshJobs], options: argparse.Namespace) -> list[tuple[Path, MeshJobs]]:
    if not options.animation:
        return []
    check_words("--animation", Path(options.animation), ("name", "index"))
    if len(groups) > 1 and "{name}" not in options.animation and "{index}" not in options.animation:
        raise UsageError(f"several meshes need {{name}} in --animation, got {options.animation!r}")
    return [
        (Path(options.animation.replace("{name}", group.name).replace("{index}", f"{i:03d}")), group)
        for i, group in enumerate(groups)
    ]


def _check_pictures(groups: Sequence[MeshJobs], options: argparse.Namespace) -> None:
    """Raise an error if there are no pictures for a sheet or an animation."""
    if options.sheet and Path(options.sheet).suffix.lower() not in PICTURE_SUFFIXES:
        raise UsageError(f"--sheet must end in one of {' '.join(PICTURE_SUFFIXES)}, got {options.sheet!r}")
    if is_url(options.sheet) or is_url(options.animation):
        raise UsageError("--sheet and --animation are written to this machine: give a path, not a URL")
    for job in (job for group in groups for job in group.jobs):
        if is_url(job.destination):
            raise UsageError("--sheet and --animation need pictures on this machine: OUT must be a path, not a URL")
        if job.layers and "color" not in job.layers:
            raise UsageError(f"--sheet and --animation show the layer color, got --layers {','.join(job.layers)}")
        if Path(os.fspath(job.destination or "")).suffix.lower() not in PICTURE_SUFFIXES:
            known = " ".join(PICTURE_SUFFIXES)
            raise UsageError(f"--sheet and --animation need pictures: OUT must end in one of {known}")


def _color_files(group: MeshJobs) -> list[Path]:
    """The pictures of a mesh, view by view."""
    return [Path(os.fspath(job.destination or "").replace("{layer}", "color")) for job in group.jobs]
