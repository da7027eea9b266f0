"""What works where Pyodide runs Python: without threads, without processes, with one CPU and fewer modules."""

import subprocess
import sys

#: Takes away what Pyodide 314.0.7 (Python 3.14) lacks; it says so when asked by name.
PRELUDE = """
import builtins, os, subprocess, sys, tempfile, threading
from pathlib import Path

GONE = {"_multiprocessing", "_posixshmem", "_curses", "resource", "pwd", "grp"}
imported = builtins.__import__
def refusing(name, *given, **named):
    if name.partition(".")[0] in GONE:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return imported(name, *given, **named)
def start(*_):
    raise RuntimeError("can't start new thread")
def process(*_, **__):
    raise OSError(138, "emscripten does not support processes.")

builtins.__import__ = refusing
threading.Thread.start = start
subprocess.Popen.__init__ = os.fork = process
os.cpu_count = lambda: 1
del os.sched_getaffinity
sys.platform = "emscripten"

import numpy as np
import topleft as tl

folder = Path(tempfile.mkdtemp())
mesh = tl.Mesh(*tl.scenes.shape("octahedron"))
camera = tl.Camera.framing(mesh)
jobs = [tl.Job(mesh, size=(32, 24), destination=folder / f"{i}.png") for i in range(2)]
"""

WORKS = """
many = np.random.default_rng(0).uniform(0, 500, (30000, 2)), np.arange(30000).reshape(-1, 3), (500, 500)
assert (tl.overdraw(*many, threads=4) == tl.overdraw(*many, threads=1)).all()
picture = tl.render(mesh, camera, (64, 48), sampling="msaa4")
tl.save_image(folder / "a.png", picture)
(folder / "m.obj").write_text("v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
assert len(tl.load(folder / "m.obj").triangles) == 1
assert len(list(tl.render_batch(jobs))) == 2 and (folder / "1.png").exists()
assert tl.tiles(mesh, 3000).read(1000, 1000, 100, 100).shape == (100, 100)
"""


REFUSED = """
for call in (
    lambda: list(tl.render_batch(jobs, executor=2)),
    lambda: tl.tiles(mesh, 3000).to_geotiff(folder / "a.tif"),
    lambda: tl.explore(mesh),
):
    try:
        call()
    except Exception as error:
        print(f"{type(error).__name__}: {error}")
"""


def test_pictures_and_files_are_made_and_what_needs_threads_or_a_server_says_so():
    command = [sys.executable, "-c", PRELUDE + WORKS + REFUSED]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    batch, geotiff, explore = ended.stdout.splitlines()
    assert batch == geotiff == "RuntimeError: can't start new thread"
    assert explore.startswith(("MissingPackageError: the explorer needs ", batch))  # by what its packages import
