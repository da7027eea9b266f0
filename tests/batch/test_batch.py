"""Many pictures: the same ones whoever draws them, in bounded memory, and errors with their jobs."""

import gc
import itertools
import pickle
import sys
import threading
import weakref
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest
from batch_jobs import BOX, CORNERS, EXECUTORS, FACES, SIZE, orbit, pictures, views

import topleft as tl
from topleft._apps.batch import jobs
from topleft._apps.batch.jobs import JobRunner
from topleft._apps.batch.workers import workers_of
from topleft.errors import MissingPackageError


@pytest.fixture(scope="module")
def processes():
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        yield pool


def fail(mesh, size):
    raise ValueError("no camera today")


# Results


@pytest.mark.parametrize("executor", EXECUTORS)
@pytest.mark.parametrize("chunk", [1, 3, 100])
def test_batch_pictures_are_those_of_render_in_order(executor, chunk):
    results = list(tl.render_batch(views(7, shading="flat"), executor=executor, chunk=chunk))
    assert [result.index for result in results] == list(range(7))
    for result, expected in zip(results, pictures(7, shading="flat"), strict=True):
        assert np.array_equal(result.picture, expected)


def test_batch_of_processes_gives_the_same_pictures(processes):
    results = list(tl.render_batch(views(5), executor=processes, chunk=2))
    for result, expected in zip(results, pictures(5), strict=True):
        assert np.array_equal(result.picture, expected)


def test_batch_takes_the_threads_of_the_caller():
    with ThreadPoolExecutor(2) as pool:
        results = list(tl.render_batch(views(5), executor=pool))
        assert np.array_equal(results[4].picture, pictures(5)[4])
        assert pool.submit(int, 7).result() == 7  # left running


class Inline(Executor):
    """Nobody knows it: it calls at once, with what pickling leaves."""

    def __init__(self):
        self.sizes = []

    def submit(self, work, /, *arguments):
        self.sizes.append(len(arguments[-1]))
        future = Future()
        future.set_result(pickle.loads(pickle.dumps(work))(*pickle.loads(pickle.dumps(arguments))))
        return future


def test_batch_takes_any_executor():
    results = list(tl.render_batch(views(3), executor=Inline()))
    assert np.array_equal(results[2].picture, pictures(3)[2])


def test_batch_chunks_are_neighbours_of_one_scene():
    inline = Inline()
    other = tl.Mesh(CORNERS, FACES)
    listed = [*views(7), *views(2, other), *views(1)]
    assert tl.render_batch(listed, executor=inline, chunk=3).finish().n_made == 10
    assert inline.sizes == [3, 3, 1, 2, 1]


def test_batch_threads_get_several_small_pictures_of_a_list():
    threads, job = workers_of(2), views(1)[0]
    assert [threads.together(job, n) for n in (None, 7, 8, 16, 31, 32, 1000)] == [1, 1, 1, 2, 3, 4, 4]
    assert threads.together(replace(job, size=(1024, 1025)), 1000) == 1
    assert threads.together(replace(job, size="large"), 1000) == 1
    expected = pictures(41)
    for listed in (views(41), iter(views(41))):
        drawn = [result.picture for result in tl.render_batch(listed, executor=2)]
        assert np.array_equal(drawn, expected)


def test_batch_threads_get_pictures_one_by_one_at_the_end(monkeypatch):
    sizes = []
    draw = JobRunner.draw
    monkeypatch.setattr(JobRunner, "draw", lambda self, some: (sizes.append(len(some)), draw(self, some))[1])
    assert tl.render_batch(views(44), executor=2).finish().n_made == 44
    assert sorted(sizes, reverse=True) == [4, 4, 4, 4, 3, 3, 2, 2, 2, 2, 1, 1, 1, *7 * [1], *4 * [1]]


def test_batch_left_early_drops_what_has_not_begun():
    gate, begun = threading.Event(), []

    def slow(mesh, size):
        begun.append(size)
        assert gate.wait(30)
        return tl.Camera.framing(mesh)

    with ThreadPoolExecutor(1) as pool:
        results = tl.render_batch([tl.Job(BOX, None, SIZE), *[tl.Job(BOX, slow, SIZE)] * 6], executor=pool, window=5)
        next(results)
        threading.Timer(0.05, gate.set).start()
        results.close()
    assert len(begun) <= 1


def test_batch_left_early_does_not_wait_for_jobs_that_a_broken_pool_forgets():
    """A process pool that breaks leaves cancelled futures as they are: `wait` would wait for them for ever."""

    class Forgetful(Executor):
        def submit(self, draw, *arguments):
            future = Future()
            if not submitted:
                future.set_result(draw(*arguments))
            submitted.append(future)
            return future

    def leave_early():
        results = tl.render_batch(views(9), executor=Forgetful())
        next(results)
        results.close()

    submitted = []
    thread = threading.Thread(target=leave_early, daemon=True)
    thread.start()
    thread.join(60)
    assert not thread.is_alive()
    assert len(submitted) > 1
    assert all(future.cancelled() for future in submitted[1:])


@pytest.mark.parametrize("executor", EXECUTORS)
def test_batch_takes_tuples_and_different_sizes(executor):
    shapes = [result.picture.shape for result in tl.render_batch([(BOX,), (BOX, None, (8, 9))], executor=executor)]
    assert shapes == [(480, 640, 4), (9, 8, 4)]


def test_batch_as_completed_gives_each_once():
    results = list(tl.render_batch(views(9), executor=3, order="completed"))
    assert sorted(result.index for result in results) == list(range(9))
    expected = pictures(9)
    assert all(np.array_equal(result.picture, expected[result.index]) for result in results)


def test_batch_as_completed_does_not_wait_for_the_slow():
    gate = threading.Event()

    def slow(mesh, size):
        assert gate.wait(30)
        return tl.Camera.framing(mesh)

    listed = [tl.Job(BOX, slow, SIZE), *views(3)]
    found = []
    for result in tl.render_batch(listed, executor=2, order="completed"):
        assert result.error is None
        found.append(result.index)
        if len(found) == 3:
            gate.set()
    assert found == [1, 2, 3, 0]


def test_batch_layers_are_copies_by_name():
    listed = [tl.Job(BOX, camera, SIZE, layers=("triangle", "color")) for camera in orbit(BOX, 3)]
    results = list(tl.render_batch(listed))
    for result, camera, color in zip(results, orbit(BOX, 3), pictures(3), strict=True):
        assert list(result.layers) == ["triangle", "color"]
        assert np.array_equal(result.layers["color"], color)
        assert np.array_equal(result.layers["triangle"], tl.rasterize_mesh(BOX, camera, SIZE).triangle)


@pytest.mark.parametrize("bits", [0, "exact"])
def test_batch_subpixel_bits_reach_pictures_layers_and_glass(bits):
    (camera,) = orbit(BOX, 1)
    glass = {"subpixel_bits": bits, "opacity": 0.25}
    jobs = [
        tl.Job(BOX, camera, SIZE, {"subpixel_bits": bits}),
        tl.Job(BOX, camera, SIZE, glass),
        tl.Job(BOX, camera, SIZE, {"subpixel_bits": bits}, layers=("triangle", "silhouette")),
    ]
    picture, through, layers = (result.made for result in tl.render_batch(jobs))
    assert np.array_equal(picture, tl.render(BOX, camera, SIZE, subpixel_bits=bits))
    assert np.array_equal(through, tl.render_transparent(BOX, camera, SIZE, **glass))
    frags = tl.rasterize_mesh(BOX, camera, SIZE, subpixel_bits=bits)
    assert np.array_equal(layers["triangle"], frags.triangle)
    assert np.array_equal(layers["silhouette"], frags.mask)


def test_batch_camera_may_be_made_of_mesh_and_size():
    (result,) = tl.render_batch([tl.Job(BOX, lambda mesh, size: tl.Camera.framing(mesh, aspect=4 / 3), SIZE)])
    assert np.array_equal(result.picture, tl.render(BOX, None, SIZE))


# Bounds


@pytest.mark.parametrize(("executor", "order"), [(None, "jobs"), (2, "jobs"), (2, "completed")])
def test_batch_of_an_endless_generator_is_bounded(executor, order):
    asked = itertools.count()
    endless = (tl.Job(BOX, None, (8, 8)) for _ in asked)
    with tl.render_batch(endless, executor=executor, order=order, window=4) as results:
        for _ in range(20):
            next(results)
        assert next(asked) <= 20 + 4 + 1
    assert list(results) == []


@pytest.mark.parametrize("order", ["jobs", "completed"])
def test_batch_pictures_end_with_the_last_who_holds_them(order):
    """Not with the next collection of cycles, which may be thousands of pictures later."""
    gc.disable()
    try:
        seen = [weakref.ref(result.picture) for result in tl.render_batch(views(24), executor=2, order=order)]
        assert sum(picture() is not None for picture in seen) <= 1  # `result` of the last
    finally:
        gc.enable()


def test_batch_begins_when_it_is_iterated():
    asked = itertools.count()
    tl.render_batch((tl.Job(BOX) for _ in asked), executor=2)
    assert next(asked) == 0


def test_batch_threads_end_with_it():
    with tl.render_batch(views(3), executor=2) as results:
        next(results)
        assert any(thread.name.startswith("topleft-batch") for thread in threading.enumerate())
    assert not any(thread.name.startswith("topleft-batch") for thread in threading.enumerate())


def test_studio_keeps_one_rasterizer_a_thread():
    runner = JobRunner()
    first = runner._rasterizer(SIZE)
    assert runner._rasterizer(SIZE) is first
    others = []
    thread = threading.Thread(target=lambda: others.append(runner._rasterizer(SIZE)))
    thread.start()
    thread.join()
    assert others[0] is not first
    assert first.threads == 1


@pytest.mark.parametrize(("options", "threads"), [({}, 1), ({"threads": 3}, 3)])
def test_batch_draws_a_picture_on_one_thread_unless_told(monkeypatch, options, threads):
    found = []
    monkeypatch.setattr(jobs, "render", lambda *_, **given: found.append(given["threads"]))
    tl.render_batch([tl.Job(BOX, None, SIZE, options)]).finish()
    assert found == [threads]


def test_batch_pictures_stay_when_the_next_are_drawn():
    kept = list(tl.render_batch(views(4), executor=None))
    assert not np.array_equal(kept[0].picture, kept[1].picture)
    assert np.array_equal(kept[0].picture, pictures(4)[0])


# Errors


@pytest.mark.parametrize("executor", EXECUTORS)
def test_batch_raises_the_first_error_and_names_the_job(executor):
    listed = [*views(2), tl.Job(BOX, fail, SIZE), *views(50)]
    found = []
    with pytest.raises(ValueError, match="no camera today") as caught:
        found.extend(tl.render_batch(listed, executor=executor))
    assert caught.value.__notes__ == ["in job 2: Mesh"]


def test_batch_ends_with_the_error_that_it_raises():
    results = tl.render_batch([tl.Job(BOX, fail, SIZE), *views(5)], executor=2)
    with pytest.raises(ValueError, match="no camera today"):
        next(results)
    assert list(results) == []
    assert not any(thread.name.startswith("topleft-batch") for thread in threading.enumerate())


@pytest.mark.parametrize("executor", EXECUTORS)
def test_batch_collects_errors(executor):
    listed = [tl.Job(BOX, fail, SIZE), *views(2), tl.Job(BOX, None, SIZE, {"shading": "toon"})]
    results = list(tl.render_batch(listed, executor=executor, on_error="collect"))
    assert [result.error is None for result in results] == [False, True, True, False]
    assert results[0].picture is None
    summary = tl.render_batch(listed, executor=executor, on_error="collect").finish()
    assert (summary.n_made, summary.n_skipped) == (2, 0)
    assert [result.index for result in summary.failed] == [0, 3]


def test_batch_of_processes_collects_errors(processes):
    listed = [tl.Job(BOX, fail, SIZE), *views(1), tl.Job(BOX, lambda *_: None, SIZE)]
    results = list(tl.render_batch(listed, executor=processes, on_error="collect"))
    assert [type(result.error) for result in results][:2] == [ValueError, type(None)]
    assert "local object" in str(results[2].error)  # cannot be pickled


def test_batch_error_frees_the_pictures_of_its_frames():
    def fail_with_array(mesh, size):
        large = np.zeros(1000)
        raise ValueError(large.size)

    (result,) = tl.render_batch([tl.Job(BOX, fail_with_array, SIZE)], on_error="collect")
    trace = result.error.__traceback__
    frames = []
    while trace:
        frames.append(trace.tb_frame)
        trace = trace.tb_next
    assert frames[-1].f_code.co_name == "fail_with_array"
    assert frames[-1].f_locals == {}


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"executor": 0}, ValueError, "executor must be at least 1 thread, got 0"),
        ({"executor": "2"}, TypeError, "executor must be None, a number of threads or an Executor, got str"),
        ({"executor": True}, TypeError, "a number of threads or an Executor, got bool"),
        ({"on_error": "ignore"}, ValueError, "on_error must be .*'raise', 'collect', got 'ignore'"),
        ({"order": "random"}, ValueError, "order must be .*'jobs', 'completed', got 'random'"),
        ({"chunk": 0}, ValueError, "chunk must be at least 1, got 0"),
        ({"window": 0}, ValueError, "window must be at least 1, got 0"),
        ({"window": 1.5}, TypeError, "window must be an integer, got 1.5"),
    ],
)
def test_batch_impossible_option_is_refused_at_once(options, kind, message):
    with pytest.raises(kind, match=message):
        tl.render_batch([], **options)


@pytest.mark.parametrize("item", [BOX, (), (BOX,) * 7])
@pytest.mark.parametrize("executor", [None, 1])
def test_batch_of_no_jobs_is_refused(item, executor):
    message = r"jobs\[1\] must be a Job or a tuple \(scene, camera, size, options, destination, layers\), got "
    with pytest.raises(TypeError, match=message + type(item).__name__):
        list(tl.render_batch([(BOX,), item], executor=executor))


# Progress


def test_batch_progress_is_called_for_each_job():
    found = []
    tl.render_batch(views(4), executor=2, progress=found.append).finish()
    assert [result.index for result in found] == [0, 1, 2, 3]


def test_batch_progress_bar_shows_rate_and_time(capsys):
    pytest.importorskip("tqdm")
    tl.render_batch(views(4), progress=True).finish()
    assert "4/4" in capsys.readouterr().err


def test_batch_progress_bar_without_tqdm_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    with pytest.raises(MissingPackageError, match=r"progress=True needs tqdm: pip install tqdm"):
        tl.render_batch([], progress=True)
