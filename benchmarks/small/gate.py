"""Compare two commits on the core scenes: instructions by callgrind, and time in turns.

Both are built in folders of their own.  Instructions are those of one call of each scene, after one that warms up, on
AVX2 (callgrind knows no AVX-512), and do not vary from run to run by more than a few thousand.  Time is that of the
thread on the widest instruction set, call by call in turns: median of the ratios.  Calls that take 3 % more are named.

As a program by itself (`python -m benchmarks.small.gate`) this file draws: a scene for each name on standard input.
"""

from __future__ import annotations

import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.harness.arguments import Options, count, names, option
from benchmarks.harness.machine import ROOT, describe
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study
from benchmarks.report.tables import table

LIMIT = 1.03
N_ROUNDS = 25
SIZE = (1000, 1000)


def scenes() -> dict[str, Callable[[], object]]:
    """Return a call for each scene, by the library that `import topleft` finds."""
    import topleft as tl

    rng = np.random.default_rng(1)

    def soup(n: int, extent: float) -> tuple[np.ndarray, np.ndarray]:
        middles = rng.random((n, 1, 2)) * SIZE
        corners = middles + (rng.random((n, 3, 2)) - 0.5) * extent
        return np.concatenate([corners, rng.random((n, 3, 1))], axis=2).reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)

    small, large, long = soup(20_000, 8), soup(500, 300), soup(300, 3000)
    colors = {n: rng.integers(0, 256, (n, 4)).astype(np.uint8) for n in (300, 500, 20_000)}
    vertices, triangles = tl.scenes.blob(100_000)
    mesh, fresh = tl.Mesh(vertices, triangles), vertices.astype(np.float32)
    camera, square = tl.Camera.framing(mesh), (512, 512)
    matrix = camera.clip_from_world((1280, 720))
    texture = tl.Texture(rng.integers(0, 256, (256, 256, 3)).astype(np.uint8))
    globe = tl.Mesh(*tl.scenes.shape("sphere"))
    around = tl.Mesh(
        globe.vertices, globe.triangles, uv=globe.vertices[:, :2], materials=[tl.Material(texture=texture)]
    )
    seen = tl.Camera.framing(around)
    one = {"threads": 1}

    def fill(scene: tuple[np.ndarray, np.ndarray], **options: object) -> object:
        return tl.fill(*scene, colors[len(scene[1])], SIZE, per="triangle", **one, **options)

    return {
        "rasterize, small": lambda: tl.rasterize(*small, SIZE, **one),
        "rasterize, large": lambda: tl.rasterize(*large, SIZE, **one),
        "rasterize, long": lambda: tl.rasterize(*long, SIZE, **one),
        "rasterize, msaa4": lambda: tl.rasterize(*small, SIZE, sampling="msaa4", **one),
        "rasterize, transform": lambda: tl.rasterize(fresh, triangles, (1280, 720), transform=matrix, **one),
        "coverage, small": lambda: tl.coverage(*small, SIZE, **one),
        "coverage, large": lambda: tl.coverage(*large, SIZE, **one),
        "coverage, area": lambda: tl.coverage(*small, SIZE, sampling="area", **one),
        "overdraw, large": lambda: tl.overdraw(*large, SIZE, **one),
        "fill, small": lambda: fill(small),
        "fill, over": lambda: fill(large, blend="over"),
        "fill, over, area": lambda: fill(small, blend="over", sampling="area"),
        "wireframe": lambda: tl.wireframe(*small, SIZE, antialias=True, **one),
        "mesh in clusters": lambda: tl.rasterize_mesh(mesh, camera, (1280, 720), **one),
        "render": lambda: tl.render(mesh, camera, square, **one),
        "render, texture": lambda: tl.render(around, seen, square, **one),
        "render, msaa4": lambda: tl.render(mesh, camera, square, sampling="msaa4", **one),
    }


def serve() -> None:
    """Draw the scene of each name that is read, twice for a name after "count", and tell the milliseconds.

    The two calls of "count" stand between calls of `getpriority`, at which callgrind writes its counts.
    """
    calls = scenes()
    for draw in calls.values():
        draw()
    print("ready", flush=True)
    for line in sys.stdin:
        word, _, name = line.strip().partition(" ")
        if word == "count":
            calls[name]()
            os.getpriority(os.PRIO_PROCESS, 0)
            calls[name]()
            os.getpriority(os.PRIO_PROCESS, 0)
            print("counted", flush=True)
        else:
            start = time.thread_time()
            calls[name]()
            print((time.thread_time() - start) * 1e3, flush=True)


class Drawer:
    """A process that draws with the library of a folder."""

    def __init__(self, folder: Path, before: list[str] | None = None, **environment: str) -> None:
        env = os.environ | {"PYTHONPATH": f"{folder / 'src'}{os.pathsep}{ROOT}"} | environment
        command = [*(before or []), sys.executable, "-m", "benchmarks.small.gate"]
        self.process = subprocess.Popen(
            command,
            cwd=folder,
            env=env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.answer()

    def answer(self, question: str = "") -> str:
        """Return the answer of the process to a question."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        if question:
            self.process.stdin.write(question + "\n")
            self.process.stdin.flush()
        told = self.process.stdout.readline().strip()
        if not told:
            raise ValueError("a commit cannot draw the scenes of the gate: the process that draws has ended")
        return told

    def end(self) -> None:
        """Wait for the process."""
        self.process.communicate()


def build(commit: str, folder: Path) -> str:
    """Write the files of a commit to a folder, build the library there, and return the commit's short hash.

    Raises
    ------
    ValueError
        If there is no such commit, or it cannot be built.
    """
    found = subprocess.run(
        ["git", "rev-parse", "--verify", "--short", f"{commit}^{{commit}}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if found.returncode:
        raise ValueError(f"there is no commit {commit!r}")
    folder.mkdir()
    archive = subprocess.run(["git", "archive", found.stdout.strip()], cwd=ROOT, capture_output=True, check=True).stdout
    subprocess.run(["tar", "-x"], cwd=folder, input=archive, check=True)
    command = [sys.executable, "setup.py", "-q", "build_ext", "--inplace"]
    built = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if built.returncode:
        raise ValueError(f"{commit} cannot be built: {built.stderr.strip().splitlines()[-1]}")
    return found.stdout.strip()


def count_instructions(folder: Path, names: list[str]) -> dict[str, int]:
    """Return the instructions of one call of each scene."""
    with tempfile.TemporaryDirectory() as room:
        out = Path(room, "count")
        tool = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", "--dump-before=getpriority"]
        drawer = Drawer(folder, tool, TOPLEFT_ISA="avx2")
        found = {}
        for i, name in enumerate(names):
            drawer.answer(f"count {name}")
            # Dump 2i + 2 holds the counts between the two calls of getpriority.
            text = Path(f"{out}.{2 * i + 2}").read_text(encoding="utf-8")
            found[name] = int(re.findall(r"^(?:totals|summary): (\d+)", text, re.MULTILINE)[-1])
        drawer.process.kill()
        drawer.end()
    return found


def time_in_turns(folders: list[Path], names: list[str], n_rounds: int) -> dict[str, list[list[float]]]:
    """Return milliseconds of each folder and round, by scene."""
    drawers = [Drawer(folder) for folder in folders]
    found = {
        name: list(
            map(list, zip(*([float(d.answer(f"time {name}")) for d in drawers] for _ in range(n_rounds)), strict=True))
        )
        for name in names
    }
    for drawer in drawers:
        drawer.end()
    return found


@dataclass(frozen=True)
class GateOptions(Options):
    base: str = option("", "", "the commit to compare with", metavar="BASE")
    head: str = option("HEAD", "", "(%(default)s)", metavar="HEAD", nargs="?")
    rounds: int = count(N_ROUNDS, "--rounds")
    scenes: Sequence[str] = names("--scene", "beginnings of names (default: all)")


def run(options: GateOptions, _: Save) -> Record:
    """Build both commits, count and time."""
    wanted = tuple(options.scenes or [""])
    chosen = [name for name in scenes() if name.startswith(wanted)]
    if not chosen:
        raise ValueError(f"no scene begins with {' or '.join(wanted)}: there are {', '.join(scenes())}")
    with tempfile.TemporaryDirectory() as room:
        folders = [Path(room, "base"), Path(room, "head")]
        commits = [build(c, f) for c, f in zip((options.base, options.head), folders, strict=True)]
        counts = [count_instructions(f, chosen) for f in folders] if shutil.which("valgrind") else []
        times = time_in_turns(folders, chosen, options.rounds)
    rows = [{"scene": name, "instructions": [count[name] for count in counts], "ms": times[name]} for name in chosen]
    return {"kind": "gate"} | describe() | {"commits": commits, "rows": rows}


def ratios(row: dict[str, list]) -> tuple[float | None, float]:
    """Return head by base: instructions, and the median of the times of the rounds."""
    counts, (base, head) = row["instructions"], row["ms"]
    return counts[1] / counts[0] if counts else None, statistics.median(b / a for a, b in zip(base, head, strict=True))


def lines(record: Record) -> Iterator[str]:
    """The table, and the calls that got slower."""
    rows, slower = [], []
    for row in record["rows"]:
        more, longer = ratios(row)
        rows.append(
            [
                row["scene"],
                *(f"{n / 1e6:.2f}" for n in row["instructions"] or (np.nan, np.nan)),
                f"{more or np.nan:.3f}",
            ]
            + [f"{min(row['ms'][0]):.2f}", f"{min(row['ms'][1]):.2f}", f"{longer:.3f}"]
        )
        # Counts do not vary; times do, so they alone condemn only without counts.
        if (longer if more is None else more) > LIMIT:
            slower.append(row["scene"])
    base, head = record["commits"]
    titles = ["scene", f"{base}, M instructions", head, "ratio", f"{base}, ms", f"{head}, ms", "median ratio"]
    yield from table(titles, rows)
    yield ""
    yield f"slower by more than {LIMIT - 1:.0%}: {', '.join(slower) or 'nothing'}"


STUDY = Study("gate", "compare two commits: instructions, and time in turns", GateOptions, run, lines)

if __name__ == "__main__":
    serve()
