"""Threads of a call: what they leave when one is interrupted, and what is done where there are none."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from topleft._core.base import threads
from topleft._core.base.threads import run_parts

AT_EXIT = """
import atexit, threading, time
import topleft as tl
mesh = tl.scenes.blob(10_000)
picture = tl.coverage(mesh[0][:, :2] * 30 + 30, mesh[1], (64, 64), threads=1)
def draw():
    assert (tl.coverage(mesh[0][:, :2] * 30 + 30, mesh[1], (64, 64), threads=4) == picture).all()
    print("drawn")
"""


def parts_of(n, n_parts):
    return run_parts(lambda first, end: (first, end), n, n_parts)


def interrupt_after(seconds, n_times=1):
    def interrupt():
        for _ in range(n_times):
            time.sleep(seconds)
            os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()


def test_run_parts_returns_the_results_in_the_order_of_the_parts():
    assert parts_of(10, 4) == [(0, 2), (2, 5), (5, 7), (7, 10)]
    assert parts_of(0, 4) == [(0, 0)]


def test_run_parts_by_one_thread_leaves_all_to_the_calling_one():
    def work(first, end):
        time.sleep(0.005)
        return first, end, threading.get_ident()

    assert run_parts(work, 4, 4, 1) == [(i, i + 1, threading.get_ident()) for i in range(4)]


@pytest.mark.parametrize("n_times", [1, 2])
def test_run_parts_interrupted_while_it_waits_raises_after_all_threads_are_done(n_times):
    done = threading.Event()

    def work(first, _):
        if threading.current_thread() is not threading.main_thread():
            time.sleep(0.3)
            done.set()
        else:
            time.sleep(0.05)  # so that another thread takes the other part

    interrupt_after(0.1, n_times)
    with pytest.raises(KeyboardInterrupt):
        run_parts(work, 2, 2)
    assert done.is_set()
    time.sleep(0.1)


def test_run_parts_with_an_error_in_another_thread_raises_it():
    def work(first, _):
        time.sleep(0.05)
        if first:
            raise ValueError("of another thread")

    with pytest.raises(ValueError, match="of another thread"):
        run_parts(work, 2, 2)


@pytest.mark.parametrize("n_started", [0, 1])
def test_run_parts_without_threads_lets_the_calling_thread_do_all(monkeypatch, n_started):
    start, n = threading.Thread.start, iter(range(100))

    def start_some(thread):
        if next(n) >= n_started:
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threads, "_pool", None)
    monkeypatch.setattr(threading.Thread, "start", start_some)
    assert parts_of(10, 4) == [(0, 2), (2, 5), (5, 7), (7, 10)]


@pytest.mark.parametrize("register", ["atexit.register(draw)", "draw(); atexit.register(draw)"])
def test_a_verb_while_python_ends_draws_in_the_calling_thread(register):
    ended = subprocess.run([sys.executable, "-c", AT_EXIT + register], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.split()[-1] == "drawn"
