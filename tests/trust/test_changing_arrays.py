"""Arrays that another process writes to during a call: any picture or error will do, a crash will not."""

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from changing_arrays import Changing, between_closed_pages
from draws import Draw, FromRandom

import topleft as tl
from topleft._core.base.arrays import as_checked_triangles

FUZZER = Path(__file__).parents[1] / "support/hostile/changing.py"

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="fork and mprotect are POSIX")


def run_cases(n, *kinds):
    """Run the fuzzer, which ends where something crashes: so many cases of each kind, or of any."""
    command = [sys.executable, FUZZER, "--cases", str(n), "--seconds", "3600", *(["--kind", *kinds] if kinds else [])]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, f"{ended.stdout[-1500:]}\n{ended.stderr[:3000]}"
    assert f"{n * max(1, len(kinds))} cases, none that must not be" in ended.stdout


def test_calls_whose_arrays_change_do_not_crash():
    run_cases(30)


def test_gradients_and_grids_whose_arrays_change_do_not_crash():
    run_cases(10, "gradients", "backward", "grids")


@pytest.mark.parametrize("kind", ["torch", "jax"])
def test_operations_whose_tensors_change_do_not_crash(kind):
    pytest.importorskip(kind)
    run_cases(3, kind)


def test_arrays_change_while_a_call_may_read_them():
    changing = Changing(Draw(FromRandom(0)))
    shared = [changing.numbers(str(i), (50, 3), 0, 1) for i in range(8)]
    seen = [set() for _ in shared]
    latest = time.monotonic() + 60  # the other process may have to wait for a core
    with changing.changed():
        while sum(len(contents) > 1 for contents in seen) < 4 and time.monotonic() < latest:
            for contents, array in zip(seen, shared, strict=True):
                contents.add(array.tobytes())
    assert sum(len(contents) > 1 for contents in seen) >= 4


@pytest.mark.parametrize("is_at_end", [False, True])
def test_a_step_beside_a_shared_array_ends_the_program(is_at_end):
    code = f"""
import sys; sys.path.insert(0, {str(FUZZER.parent)!r})
import ctypes, numpy as np
from changing_arrays import between_closed_pages
own, _ = between_closed_pages(np.arange(5.0), is_at_end={is_at_end})
print(ctypes.c_double.from_address(own.ctypes.data + {8 * 4 if is_at_end else 0}).value, flush=True)
ctypes.c_double.from_address(own.ctypes.data + {8 * 5 if is_at_end else -8}).value
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ended.stdout == ("4.0\n" if is_at_end else "0.0\n")
    assert ended.returncode != 0


def test_what_is_written_beside_a_shared_array_is_found():
    changing = Changing(Draw(FromRandom(0)))
    own = changing.share("numbers", np.arange(5.0))
    _, beside = between_closed_pages(own, is_at_end=True)
    assert len(beside) % 8 == 0
    assert not beside.any()
    with pytest.raises(AssertionError, match="beside"), changing.changed():
        changing._beside[0][0] = 1


@pytest.mark.parametrize("index", [3, -1, 2**31 - 1])
def test_fragments_of_a_triangle_whose_index_left_the_vertices_have_no_weights(index):
    vertices = np.array([[0, 0, 1], [8, 0, 1], [0, 8, 1], [5, 5, 1], [6, 6, 1]], np.float32)
    triangles = np.array([[0, 1, 2]], np.int32)
    frags = tl.rasterize(vertices[:3], triangles, (8, 8))
    assert frags.barycentric().any()
    triangles[0, 2] = index
    assert not frags.barycentric().any()


@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_checked_triangles_are_vertices_whatever_another_process_writes(dtype):
    n_taken = 0
    for seed in range(4):
        changing = Changing(Draw(FromRandom(seed)))
        shared = changing.share("triangles", np.full((300, 3), 5, dtype), 6)
        with changing.changed():
            for _ in range(1000):
                with suppress(IndexError):
                    checked = as_checked_triangles(shared, 6)
                    n_taken += 1
                    assert 0 <= checked.min() <= checked.max() <= 5
    assert n_taken
