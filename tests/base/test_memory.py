"""Memory of arrays that have died is given to arrays to come: never one that lives, never more than a bound."""

import gc
import os
import pickle
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import topleft as tl
from topleft._core import engine
from topleft._core.base import memory

SIZE = (256, 128)
N_BYTES = 4 * 256 * 128
CORNERS = np.array([[0, 0, 0.5], [300, 0, 0.5], [0, 300, 0.25]], np.float32)
ONE = np.array([[0, 1, 2]], np.int32)


@pytest.fixture(autouse=True)
def _nothing_waits():
    gc.collect()
    tl.release_memory()
    yield
    tl.release_memory()


def address(array):
    return array.__array_interface__["data"][0]


def test_memory_of_a_dead_array_is_given_again():
    first = memory.empty(SIZE, np.int32)
    at = address(first)
    del first
    assert engine.waiting_memory() == N_BYTES
    assert address(memory.empty(SIZE, np.float32)) == at


def test_memory_waits_only_when_the_last_view_has_died():
    array = memory.empty(SIZE, np.int32)
    corner = array[::-2, 1:].T
    del array
    assert engine.waiting_memory() == 0
    assert not np.shares_memory(corner, memory.empty(SIZE, np.int32))
    del corner
    assert engine.waiting_memory() == 2 * N_BYTES


def test_memory_behind_a_memoryview_lives():
    array = memory.empty(SIZE, np.uint8)
    array[...] = 7
    view = memoryview(array)
    del array
    memory.empty(SIZE, np.uint8)[...] = 0
    assert view[0, 0] == 7


@pytest.mark.parametrize("n_asked", [N_BYTES - 4096, N_BYTES, 9 * N_BYTES // 10])
def test_memory_of_about_that_size_is_given(n_asked):
    at = address(memory.empty((N_BYTES,), np.uint8))
    assert address(memory.empty((n_asked,), np.uint8)) == at


@pytest.mark.parametrize("n_asked", [N_BYTES + 64, N_BYTES // 2])
def test_memory_of_another_size_waits_on(n_asked):
    memory.empty((N_BYTES,), np.uint8)
    array = memory.empty((n_asked,), np.uint8)
    assert array.size == n_asked
    assert engine.waiting_memory() == N_BYTES


def test_the_least_block_with_room_is_given():
    arrays = [memory.empty((n,), np.uint8) for n in (80_000, 70_016, 90_048)]
    at = address(arrays[1])
    del arrays
    assert address(memory.empty((70_000,), np.uint8)) == at


def test_sizes_near_2_63_fit_no_block_that_waits():
    def refuse(n_bytes):
        raise MemoryError(f"no {n_bytes:,} bytes")

    memory.empty(SIZE, np.int32)
    for n_asked in (2**63 - 1, 2**63 - 2**40):
        with pytest.raises(MemoryError, match=f"no {n_asked:,} bytes"):
            engine.lease_block(n_asked, refuse)
    assert engine.waiting_memory() == N_BYTES


def test_no_more_waits_than_the_bound_and_what_waited_longest_goes_first():
    engine.keep_blocks(2 * N_BYTES)
    arrays = [memory.empty(SIZE, np.int32) for _ in range(3)]
    oldest = address(arrays[0])
    for _ in range(3):
        arrays.pop(0)
    assert engine.waiting_memory() == 2 * N_BYTES
    assert oldest not in [address(array) for array in (memory.empty(SIZE, np.int32), memory.empty(SIZE, np.int32))]


def test_an_array_beyond_the_bound_is_not_kept():
    engine.keep_blocks(N_BYTES - 1)
    memory.empty(SIZE, np.int32)
    assert engine.waiting_memory() == 0


def test_at_most_256_blocks_wait():
    arrays = [memory.empty((4096,), np.uint8) for _ in range(300)]
    del arrays
    assert engine.waiting_memory() == 256 * 4096


def test_release_memory_leaves_nothing_waiting_and_results_alone():
    frags = tl.rasterize(CORNERS, ONE, SIZE)
    tl.rasterize(CORNERS, ONE, SIZE)
    assert engine.waiting_memory() >= 2 * N_BYTES
    tl.release_memory()
    assert engine.waiting_memory() == 0
    assert (frags.triangle[0] == 0).all()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of address space are those of Linux")
def test_memory_that_waits_is_given_back_before_an_array_has_none():
    program = """
import resource
from topleft._core import engine
from topleft._core.base import memory
large = memory.empty((400 << 20,), "u1")
del large
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + (100 << 20), resource.RLIM_INFINITY))
assert engine.waiting_memory() >= 400 << 20
assert memory.empty((300 << 20,), "u1").size == 300 << 20
assert engine.waiting_memory() < 400 << 20
try:
    memory.empty((2 << 30,), "u1")
except MemoryError as error:
    assert "2,147,483,648 bytes" in str(error)
else:
    raise AssertionError("no error")
"""
    where = str(Path(tl.__file__).parents[1])
    subprocess.run([sys.executable, "-c", program], check=True, env=os.environ | {"PYTHONPATH": where})


VERBS = {
    "coverage": lambda: tl.coverage(CORNERS[:, :2], ONE, SIZE),
    "overdraw": lambda: tl.overdraw(CORNERS[:, :2], ONE, SIZE),
    "fill": lambda: tl.fill(CORNERS[:, :2], ONE, [(1, 2, 3, 4)], SIZE),
    "area": lambda: tl.coverage(CORNERS[:, :2], ONE, SIZE, sampling="area"),
    "rasterize": lambda: tl.rasterize(CORNERS, ONE, SIZE),
    "msaa": lambda: tl.rasterize(CORNERS, ONE, SIZE, sampling="msaa4"),
    "wireframe": lambda: tl.wireframe(CORNERS[:, :2], ONE, SIZE),
    "render": lambda: tl.render(tl.Mesh(*tl.scenes.shape("cube")), size=SIZE),
    "interpolate": lambda: tl.rasterize(CORNERS, ONE, SIZE).interpolate([0.0, 1.0, 2.0]),
}


@pytest.mark.parametrize("verb", VERBS)
def test_results_of_a_verb_come_back_when_they_die_without_the_garbage_collector(verb):
    gc.disable()
    try:
        result = VERBS[verb]()
        before = engine.waiting_memory()
        del result
        assert engine.waiting_memory() >= before + 256 * 128
        now = engine.waiting_memory()
        for _ in range(3):
            VERBS[verb]()
            assert engine.waiting_memory() == now
    finally:
        gc.enable()


@pytest.mark.parametrize("verb", VERBS)
def test_a_result_that_is_held_is_not_overwritten(verb):
    def values():
        result = VERBS[verb]()
        return result.depth if isinstance(result, tl.Fragments) else result

    held = values()
    expected = held.copy()
    for _ in range(3):
        tl.rasterize(CORNERS * np.float32(0.5), ONE, SIZE)
        other = values()
        assert not np.shares_memory(held, other)
        other[...] = 1
    np.testing.assert_array_equal(held, expected)


def test_results_are_written_into_out_itself():
    out = np.empty(SIZE[::-1], np.int32)
    assert tl.overdraw(CORNERS[:, :2], ONE, SIZE, out=out) is out


def test_a_result_survives_a_pickle_and_leaves_its_memory():
    depth = tl.rasterize(CORNERS, ONE, SIZE).depth
    again = pickle.loads(pickle.dumps(depth, protocol=5))
    np.testing.assert_array_equal(again, depth)
    assert not np.shares_memory(again, depth)


def test_threads_never_share_memory():
    wrong = []

    def fill(value):
        for n in range(200):
            array = memory.empty((4096 + 64 * (n % 7),), np.uint8)
            array[...] = value
            if not (array == value).all():
                wrong.append(value)

    threads = [threading.Thread(target=fill, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_child_has_memory_of_its_own():
    held = memory.empty(SIZE, np.int32)
    held[...] = 1
    memory.empty(SIZE, np.int32)[...] = 2  # waits in both processes
    child = os.fork()
    if child == 0:
        array = memory.empty(SIZE, np.int32)
        array[...] = 3
        os._exit(0 if (held == 1).all() and (array == 3).all() else 1)
    own = memory.empty(SIZE, np.int32)
    own[...] = 4
    assert os.waitpid(child, 0)[1] == 0
    assert (held == 1).all()
    assert (own == 4).all()


@pytest.mark.parametrize("n_bytes", [4096, 5000, 4 << 20, 5 << 20])
def test_large_arrays_begin_at_a_cache_line(n_bytes):
    assert address(memory.empty((n_bytes,), np.uint8)) % 64 == 0
