"""Threads and processes: whoever draws, and whoever draws beside it, the picture is the same, and nobody hangs."""

import multiprocessing
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from children import put_picture, render_in_child
from comparing import assert_same
from small_calls import differing

import topleft as tl

SUPPORT = Path(__file__).parents[1] / "support"
SIZE = (64, 48)

FORKS = """
import faulthandler, os, sys, threading, time
import numpy as np, topleft as tl

def pictures():
    vertices, triangles = tl.scenes.blob(4_000)
    texture = tl.Texture(np.arange(64 * 64 * 3, dtype=np.uint8).reshape(64, 64, 3))
    mesh = tl.Mesh(vertices, triangles, uv=vertices[:, :2], materials=(tl.Material(texture=texture),))
    image = tl.render(mesh, tl.Camera.framing(mesh), (64, 48), threads=2)
    return image.tobytes() + tl.coverage(vertices[:, :2] * 30 + 30, triangles, (60, 60), threads=2).tobytes()

expected = pictures()
def draw():
    while True:
        pictures()
for _ in range(3):
    threading.Thread(target=draw, daemon=True).start()
for i in range(20):
    time.sleep(0.002 * (i % 7))
    child = os.fork()
    if not child:
        faulthandler.dump_traceback_later(30, exit=True)
        os._exit(pictures() != expected)
    _, status = os.waitpid(child, 0)
    if status:
        sys.exit(f"fork {i}: {status}")
os._exit(0)
"""

EXIT = """
import sys, threading, time
import topleft as tl
vertices, triangles = tl.scenes.blob(20_000)
flat = vertices[:, :2] * 300 + 300
n = []
def draw():
    while True:
        tl.coverage(flat, triangles, (600, 600), threads=2)
        tl.fill(flat, triangles, vertices.astype("f4"), (600, 600), per="vertex", blend="max")
        n.append(1)
for _ in range(4):
    threading.Thread(target=draw, daemon=True).start()
while len(n) < 4:
    time.sleep(0.001)
"""


def new_mesh():
    return tl.Mesh(*tl.scenes.blob(4_000))


def picture_of(mesh, threads=2):
    return tl.render(mesh, tl.Camera.framing(mesh), SIZE, threads=threads)


def at_once(n, work):
    """What `work` returns in n threads that begin together."""
    barrier = threading.Barrier(n)

    def begin(i):
        barrier.wait()
        return work(i)

    with ThreadPoolExecutor(n) as pool:
        return list(pool.map(begin, range(n)))


def environment():
    """That of a child that finds the modules of these tests."""
    folders = [*map(os.path.abspath, os.environ.get("PYTHONPATH", "").split(os.pathsep)), str(SUPPORT)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}


def test_small_calls_of_eight_threads_are_those_of_one():
    assert differing(1_000, 8) == 0


def test_a_mesh_first_drawn_by_several_threads_at_once_gives_one_picture():
    expected = picture_of(new_mesh())
    for _ in range(5):
        mesh = new_mesh()
        for picture in at_once(6, lambda i, mesh=mesh: picture_of(mesh, threads=1 + i % 2)):
            assert_same(picture, expected)


def test_what_a_mesh_computes_once_is_the_same_for_threads_that_ask_at_once():
    expected = new_mesh()
    for _ in range(5):
        mesh = new_mesh()
        found = at_once(6, lambda _, mesh=mesh: (mesh.vertex_normals(), mesh.bounds, mesh.clusters.triangles))
        for normals, bounds, triangles in found:
            assert_same(normals, expected.vertex_normals())
            assert_same(np.asarray(bounds), np.asarray(expected.bounds))
            assert_same(triangles, expected.clusters.triangles)


def test_a_texture_first_sampled_by_several_threads_at_once_gives_one_picture():
    image = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    vertices, triangles = tl.scenes.blob(4_000)

    def draw(texture):
        mesh = tl.Mesh(vertices, triangles, uv=vertices[:, :2], materials=(tl.Material(texture=texture),))
        return picture_of(mesh)

    expected = draw(tl.Texture(image))
    for _ in range(3):
        texture = tl.Texture(image)
        for picture in at_once(6, lambda _, texture=texture: draw(texture)):
            assert_same(picture, expected)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of fork beside threads, which is what is tested
@pytest.mark.parametrize("how", multiprocessing.get_all_start_methods())
def test_a_child_of_a_process_that_has_drawn_draws(how):
    if how == "fork":
        expected = render_in_child()
        context = multiprocessing.get_context(how)
        queue = context.SimpleQueue()
        child = context.Process(target=put_picture, args=(queue,))
        child.start()
        assert queue.get() == expected
        child.join(60)
        assert child.exitcode == 0
        return
    script = (
        "import multiprocessing\nfrom children import put_picture, render_in_child\n"
        "if __name__ == '__main__':\n"
        "    expected = render_in_child()\n"
        f"    context = multiprocessing.get_context({how!r})\n"
        "    queue = context.SimpleQueue()\n"
        "    child = context.Process(target=put_picture, args=(queue,))\n"
        "    child.start()\n"
        "    print(queue.get() == expected)\n"
        "    child.join()\n"
    )
    run = [sys.executable, "-c", script]
    ended = subprocess.run(run, capture_output=True, text=True, timeout=120, env=environment())
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "True\n", "")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork on this system")
def test_a_child_forked_while_threads_draw_draws():
    ended = subprocess.run(
        [sys.executable, "-W", "ignore::DeprecationWarning", "-c", FORKS], capture_output=True, text=True, timeout=300
    )
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.parametrize("end", ["", "sys.exit(0)"])
def test_python_that_ends_while_threads_draw_ends(end):
    ended = subprocess.run([sys.executable, "-c", EXIT + end], capture_output=True, text=True, timeout=120)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_batch_ended_by_a_signal_never_hangs_wherever_a_lock_was_taken():
    run = [sys.executable, SUPPORT / "hostile/interrupted_batches.py"]
    ended = subprocess.run(run, capture_output=True, text=True, timeout=120, env=environment())
    assert ended.returncode == 0, ended.stderr
    assert int(ended.stdout.split()[0]) > 20
