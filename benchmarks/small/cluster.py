"""The costs of a Dask cluster, and the unit costs of plans: a job, a merged pixel, a triangle by itself.

`python -m benchmarks cluster` starts a scheduler and a worker of one thread, each a process, hands them so many tiny
jobs from a generator, and notes the client's resident memory on the way: it must not grow with their number. Then one
thread merges visibility buffers, draws separate triangles and lists them by windows: where workers that each draw a
share of the triangles are done sooner than workers that each look for the triangles of their window.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness.arguments import Options, count, option, positive
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study

MIB = 1 << 20


@contextmanager
def process_of_dask(*words: str) -> Iterator[None]:
    """A command of Dask that runs as long as it is needed."""
    source = str(Path(__file__).resolve().parents[2] / "src")
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([source, os.environ.get("PYTHONPATH", "")])}
    made = subprocess.Popen([sys.executable, "-m", *words], env=env, stdout=-3, stderr=-3)
    try:
        yield
    finally:
        made.terminate()
        made.wait()


@contextmanager
def client_of_processes() -> Iterator[Any]:
    """A client of a scheduler and a worker in processes of their own."""
    from distributed import Client

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{probe.getsockname()[1]}"
    host, port = address.split(":")
    with ExitStack() as stack:
        scheduler = ("distributed.cli.dask_scheduler", "--host", host, "--port", port, "--no-dashboard")
        stack.enter_context(process_of_dask(*scheduler))
        worker = ("distributed.cli.dask_worker", f"tcp://{address}", "--nthreads", "1", "--no-nanny", "--no-dashboard")
        stack.enter_context(process_of_dask(*worker))
        client = stack.enter_context(Client(f"tcp://{address}", timeout=300))
        client.wait_for_workers(1, timeout=300)
        yield client


def resident_bytes() -> int:
    """The resident memory of this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def draw_jobs(client: Any, n: int, chunk: int | None) -> list[dict[str, float]]:
    """Draw tiny jobs; after a tenth of them, after half and after all, how many there were, and the memory."""
    import topleft as tl

    mesh = tl.Mesh(*tl.scenes.shape("cube"))
    camera = tl.Camera.framing(mesh)
    jobs = (tl.Job(mesh, camera, (16, 16)) for _ in range(n))
    marks, rows = {max(1, n // 10), n // 2, n}, []
    begin = time.perf_counter()
    for i, _ in enumerate(tl.render_batch(jobs, executor=client, chunk=chunk), 1):
        if i in marks:
            rows.append({"jobs": i, "seconds": time.perf_counter() - begin, "bytes": resident_bytes()})
    return rows


def merge_ns() -> float:
    """Nanoseconds a pixel of a buffer that is merged, one thread; the fastest of five."""
    import topleft as tl

    vertices, triangles, _ = tl.scenes.random_triangles(20_000, 60, 3840, 2160)
    shares = range(0, 20_000, 5000)
    buffers = [tl.rasterize(vertices, triangles[first : first + 5000], (3840, 2160)) for first in shares]
    pairs = [(buffer.triangle, buffer.depth) for buffer in buffers]
    return fastest(lambda: tl.merge(pairs, triangles=shares, threads=1)) / (len(pairs) * 3840 * 2160) * 1e9


def triangle_ns() -> tuple[float, float]:
    """Nanoseconds a pixel and a triangle of 6 px, ids and depth at 3840 x 2160, one thread; the fastest of five."""
    import topleft as tl

    counts, seconds = (1, 2_000_000), []
    for n in counts:
        vertices, triangles, _ = tl.scenes.random_triangles(n, 6, 3840, 2160)
        seconds.append(fastest(lambda v=vertices, t=triangles: tl.rasterize(v, t, (3840, 2160), threads=1)))
    return seconds[0] / (3840 * 2160) * 1e9, (seconds[1] - seconds[0]) / counts[1] * 1e9


def index_ns() -> float:
    """Nanoseconds a triangle to find which windows it touches; the fastest of five."""
    import topleft as tl

    vertices, triangles, _ = tl.scenes.random_triangles(1_000_000, 6, 3840, 2160)
    return fastest(lambda: tl.tiles((vertices, triangles), (3840, 2160), window=1024, threads=1).index) / 1e6 * 1e9


def fastest(work: Any) -> float:
    """CPU seconds: others may use the machine."""
    found = []
    for _ in range(5):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return float(np.min(found))


def run(options: ClusterOptions, _: Save) -> Record:
    """Measure."""
    rows: list[dict[str, float]] = []
    with client_of_processes() as client:
        draw_jobs(client, 200, options.chunk)
        for n in options.jobs:
            rows += draw_jobs(client, n, options.chunk)
    pixel, triangle = triangle_ns()
    units = {"merge_ns": merge_ns(), "pixel_ns": pixel, "triangle_ns": triangle, "index_ns": index_ns()}
    return {"kind": "cluster", "chunk": options.chunk, "rows": rows, "units": units, **describe("distributed")}


def lines(record: Record) -> list[str]:
    """A table: jobs, seconds, memory of the client; then the unit costs."""
    chunk = record["chunk"]
    made = [f"pictures of 16 x 16 on a worker of one thread, {'planned' if chunk is None else chunk} a task", ""]
    made += ["| jobs | seconds | ms a job | client's memory, MiB |", "|---:|---:|---:|---:|"]
    for row in record["rows"]:
        each = 1e3 * row["seconds"] / row["jobs"]
        made.append(f"| {row['jobs']:,} | {row['seconds']:.1f} | {each:.2f} | {row['bytes'] / MIB:.1f} |")
    units = record["units"]
    made += ["", "| one thread, CPU time, 3840 x 2160 | ns |", "|---|---:|"]
    made.append(f"| `rasterize`, a pixel that is cleared | {units['pixel_ns']:.2f} |")
    made.append(f"| `rasterize`, a separate triangle of 6 px, of 2,000,000 | {units['triangle_ns']:.0f} |")
    made.append(f"| `merge`, a pixel of each buffer | {units['merge_ns']:.2f} |")
    made.append(f"| `tiles`, a triangle in the index | {units['index_ns']:.0f} |")
    made += ["", "| workers | a tree of merges, ms | sort-last pays from so many triangles on |", "|---:|---:|---:|"]
    for n in (2, 4, 16, 64):
        merged_ns = np.log2(n) * 2 * units["merge_ns"] * 3840 * 2160
        made.append(f"| {n} | {merged_ns / 1e6:.0f} | {merged_ns / units['index_ns'] / 1e6:.1f} million |")
    return made


@dataclass(frozen=True)
class ClusterOptions(Options):
    jobs: Sequence[int] = count((1000, 10_000), "--jobs", "batches of so many", nargs="+")
    chunk: int | None = option(None, "--chunk", "jobs of a task (as the plan says)", type=positive, metavar="N")


STUDY = Study("cluster", "costs of a Dask cluster: time of a job, memory of the client", ClusterOptions, run, lines)
