"""Run programs of other libraries on topleft: `python -m benchmarks clients pyrender=FOLDER mujoco=FOLDER`.

FOLDER is a checkout that the user has; nothing of it is kept.  pyrender: its unit tests, with `topleft.compat.pyrender`
for `import pyrender`.  mujoco: the models under FOLDER, each drawn by `mujoco.Renderer` and by topleft: pixels whose
object differs, depth away from outlines, and CPU time in turns.
"""

from __future__ import annotations

import os
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness.arguments import Options, count, option, switch
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.report.study import Study
from benchmarks.report.tables import table

MODES = ("color", "depth", "segmentation")
WANTED = 1e-4
"""How far depth may be off, relative."""


def run_pyrender(folder: Path, _: Any) -> Record:
    """The tests of a checkout of pyrender, each file by itself, on topleft."""
    rows = []
    for path in sorted(folder.glob("tests/unit/test_*.py")):
        command = [sys.executable, "-m", "topleft.compat", "pyrender", "-m", "pytest", "-q", "-c", os.devnull]
        command += ["--rootdir", str(folder), "-p", "no:cacheprovider", "-k", "not INCLUDE_RENDERING"]  # which says: do
        done = subprocess.run([*command, str(path.relative_to(folder))], cwd=folder, capture_output=True, text=True)
        last = (done.stdout.strip() or done.stderr.strip()).splitlines()[-1]
        passed, failed = (re.search(rf"(\d+) {word}", last) for word in ("passed", "(?:failed|error)"))
        rows.append(
            {"file": path.name, "passed": int(passed[1]) if passed else 0, "other": int(failed[1]) if failed else 0}
        )
    return {"tests": rows}


def run_mujoco(folder: Path, options: Any) -> Record:
    """Each model of a folder that MuJoCo loads, by both renderers."""
    os.environ.setdefault("MUJOCO_GL", "egl")
    os.environ.setdefault("EGL_PLATFORM", "surfaceless")
    import mujoco

    rows = []
    for path in sorted(folder.rglob("*.xml"))[: options.models]:
        try:
            model = mujoco.MjModel.from_xml_path(str(path))
        except ValueError:
            continue  # a part of another model, or of another version
        rows.append({"model": str(path.relative_to(folder)), **compare_model(mujoco, model, options)})
    return {"models": rows}


def compare_model(mujoco: Any, model: Any, options: Any) -> Record:
    """Pixels that differ, depth that is off, and milliseconds of a call."""
    from topleft.compat.mujoco import Renderer

    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 50)
    size = min(options.size, model.vis.global_.offheight, model.vis.global_.offwidth)
    drawn, times = [], {mode: ([], []) for mode in MODES}
    renderers = [mujoco.Renderer(model, size, size), Renderer(model, size, size)]
    for own in renderers:
        drawn.append({mode: draw(mujoco, own, data, mode, options.shadows) for mode in MODES})
    for mode in MODES:
        for _ in range(options.rounds):
            for own, found in zip(renderers, times[mode], strict=True):
                start = time.process_time()
                draw(mujoco, own, data, mode, options.shadows)
                found.append(time.process_time() - start)
    for own in renderers:
        own.close()
    theirs, ours = drawn
    ids = theirs["segmentation"]
    is_off = (ids != ours["segmentation"]).any(axis=2)
    windows = np.lib.stride_tricks.sliding_window_view(ids[..., 0], (3, 3))
    is_inside = np.pad((windows == windows[..., 1:2, 1:2]).all(axis=(2, 3)), 1)
    seen = is_inside & ~is_off & (ids[..., 0] >= 0)
    error = np.abs(theirs["depth"] - ours["depth"])[seen] / theirs["depth"][seen]
    return {
        "size": size, "geoms": int(model.ngeom),
        "off": int(is_off.sum()), "off_inside": int((is_off & is_inside).sum()),
        "depth_error": float(error.max(initial=0)), "depth_off": float((error > WANTED).mean()) if len(error) else 0.0,
        "color": float(np.abs(theirs["color"].astype(int) - ours["color"]).mean()),
        **{mode: [1e3 * statistics.median(found) for found in times[mode]] for mode in MODES},
    }  # fmt: skip


def draw(mujoco: Any, renderer: Any, data: Any, mode: str, shadows: bool) -> np.ndarray:
    """The picture of a renderer in a mode, after an update of its scene."""
    renderer.disable_depth_rendering()
    renderer.disable_segmentation_rendering()
    if mode != "color":
        getattr(renderer, f"enable_{mode}_rendering")()
    renderer.update_scene(data)
    if not shadows:
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
    return renderer.render()


CLIENTS = {"pyrender": run_pyrender, "mujoco": run_mujoco}


def run(options: Any, save: Save) -> Record:
    """The record of all clients."""
    record: Record = {"kind": "clients"} | describe() | {"shadows": options.shadows}
    for pair in options.clients:
        name, _, folder = pair.partition("=")
        if name not in CLIENTS or not Path(folder).is_dir():
            raise ValueError(f"a client must be NAME=FOLDER, NAME one of {', '.join(CLIENTS)}, got {pair!r}")
        record[name] = CLIENTS[name](Path(folder).resolve(), options)
        save(record)
    return record


def lines(record: Record) -> Iterator[str]:
    """A table for each client."""
    if "pyrender" in record:
        yield "tests of pyrender on topleft.compat.pyrender"
        rows = [[row["file"], str(row["passed"]), str(row["other"])] for row in record["pyrender"]["tests"]]
        yield from table(["file", "passed", "failed"], rows)
    if "mujoco" in record:
        yield f"models of MuJoCo beside its own renderer, shadows {'on' if record['shadows'] else 'off'}"
        head = ["model", "geoms", "pixels off", "inside", "depth off by", *(f"{mode}, ms, times" for mode in MODES)]
        rows = []
        for row in record["mujoco"]["models"]:
            speed = [f"{row[mode][1]:.2f}, {row[mode][0] / row[mode][1]:.1f}" for mode in MODES]
            counts = [str(row[name]) for name in ("geoms", "off", "off_inside")]
            rows.append([row["model"], *counts, f"{row['depth_error']:.1e}", *speed])
        yield from table(head, rows)


@dataclass(frozen=True)
class ClientOptions(Options):
    clients: Sequence[str] = option((), "", f"of {', '.join(CLIENTS)}", nargs="+", metavar="NAME=FOLDER")
    size: int = count(224, "--size", "of pictures of MuJoCo, pixels")
    rounds: int = count(5, "--rounds", "how often each is timed")
    models: int = count(100, "--models", "at most so many models")
    shadows: bool = switch("--shadows", "leave MuJoCo's shadows and reflections on")


STUDY = Study("clients", "run programs of other libraries on topleft", ClientOptions, run, lines)
