"""One contestant in a process of its own: makes a scene ready, then draws when it is told to.

Reads one JSON object a line from stdin and answers on stdout; whatever libraries print goes to stderr.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, TextIO

import numpy as np

from benchmarks.harness.machine import version_of
from benchmarks.peers import OURS, Drawing, load_peer
from benchmarks.scenes.cases import Scene

WARM_CALLS, WARM_SECONDS = 3, 2.0
MAX_CALLS = 10_000
CLOCKS = {"wall": perf_counter, "cpu": process_time}
"""The time that passes, or the CPU time of all threads of the process."""


def main() -> int:
    """Serve one contestant until stdin ends."""
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    order = json.loads(sys.stdin.readline())
    try:
        drawing, facts = make_ready(order)
    except Exception as error:
        traceback.print_exc()
        answer(answers, skip=_one_line(error))
        return 0
    answer(answers, **facts)
    peer, threads = order["peer"], order["threads"]
    gc.collect()
    gc.disable()
    for line in sys.stdin:
        order = json.loads(line)
        try:
            if order["do"] == "turn":
                wall, busy = perf_counter(), process_time()
                times = take_turn(drawing, order["seconds"], CLOCKS[order.get("clock", "wall")])
                answer(answers, times=times, cpu_share=(process_time() - busy) / (perf_counter() - wall))
            elif order["do"] == "scene":
                drawing = None  # its memory, before there is more
                drawing = load_peer(peer).prepare(Scene.load(Path(order["scene"])), threads)
                answer(answers)
            elif order["do"] == "picture":
                answer(answers, names=save_picture(drawing, Path(order["folder"])))
        except Exception as error:
            traceback.print_exc()
            answer(answers, skip=_one_line(error))
            return 0
    return 0


def answer(stream: TextIO, **facts: Any) -> None:
    """Write one line."""
    stream.write(json.dumps(facts) + "\n")
    stream.flush()


def make_ready(order: dict[str, Any]) -> tuple[Drawing, dict[str, Any]]:
    """Load the scene, set the contestant up and warm it; tell how long that took and how much memory."""
    if order["cpus"] and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, order["cpus"])
    peer = load_peer(order["peer"])
    scene = Scene.load(Path(order["scene"]))
    __import__(peer.MODULE)
    before = _reset_peak_memory()
    start = perf_counter()
    drawing = peer.prepare(scene, order["threads"], **order["options"])
    setup_ms = (perf_counter() - start) * 1e3
    start = perf_counter()
    for _ in range(WARM_CALLS):
        drawing.draw()
        if perf_counter() - start > WARM_SECONDS:
            break
    facts = {
        "gives": drawing.gives,
        "untimed": drawing.untimed,
        "setup_ms": setup_ms,
        "version": version_of(peer.DISTRIBUTION),
        "peak_mb": (_peak_memory() - before) / 1e6 if before is not None else None,
    }
    if order["peer"] == OURS:
        import topleft as tl

        facts |= {"isa": tl.build_info()["isa"], "version": tl.__version__}
    return drawing, facts


def take_turn(drawing: Drawing, seconds: float, clock: Callable[[], float] = perf_counter) -> list[float]:
    """Milliseconds of each call, for at least `seconds` and at least once; an untimed one first warms the caches."""
    draw = drawing.draw
    start = clock()
    draw()
    end = clock()
    times = []
    if end - start > max(1.0, 4 * seconds):  # so slow that it brings its own cold start
        return [(end - start) * 1e3]
    until = end + seconds
    while not times or (end < until and len(times) < MAX_CALLS):
        start = clock()
        draw()
        end = clock()
        times.append((end - start) * 1e3)
    return times


def save_picture(drawing: Drawing, folder: Path) -> list[str]:
    """Draw once more and write the picture's arrays into a folder; their names."""
    drawing.draw()
    picture = drawing.picture()
    folder.mkdir(parents=True, exist_ok=True)
    for name, array in picture.items():
        np.save(folder / f"{name}.npy", array)
    return list(picture)


def _reset_peak_memory() -> int | None:
    """Bytes resident now, after setting the high-water mark to them; None where the system has no such thing."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
        return _peak_memory()
    except OSError:
        return None


def _peak_memory() -> int:
    text = Path("/proc/self/status").read_text()
    return int(text.partition("VmHWM:")[2].split()[0]) * 1024


def _one_line(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:300]


if __name__ == "__main__":
    sys.exit(main())
