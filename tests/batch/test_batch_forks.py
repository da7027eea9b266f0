"""Batches and fork: parent and child both get all pictures."""

import os
import time

import numpy as np
import pytest
from batch_jobs import pictures, views

import topleft as tl


def run_in_fork(work):
    """Exit status of a forked child that calls `work`, within two minutes, in which other work may have the cores."""
    pid = os.fork()
    if pid == 0:
        try:
            work()
        except BaseException:
            os._exit(1)
        os._exit(0)
    until = time.monotonic() + 120
    while time.monotonic() < until:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(pid, 9)
    os.waitpid(pid, 0)
    raise AssertionError("the forked child hangs")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of fork beside threads, which is what is tested
@pytest.mark.parametrize("order", ["jobs", "completed"])
def test_batch_begun_before_a_fork_goes_on_in_parent_and_child(order):
    expected = pictures(20)
    results = tl.render_batch(views(20), executor=2, order=order)
    first = [next(results) for _ in range(5)]

    def rest():
        found = first + list(results)
        assert sorted(result.index for result in found) == list(range(20))
        assert all(np.array_equal(result.picture, expected[result.index]) for result in found)

    assert run_in_fork(rest) == 0
    rest()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_batch_begins_in_a_forked_child():
    tl.render_batch(views(5), executor=2).finish()

    def begin():
        assert tl.render_batch(views(5), executor=2).finish().n_made == 5

    assert run_in_fork(begin) == 0
