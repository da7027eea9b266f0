"""Batches and rasters on a Dask cluster of processes: the same pictures, whatever dies."""

import contextlib
import functools
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from batch_jobs import BOX, SIZE, orbit, pictures, views
from comparing import files_of
from PIL import Image

import topleft as tl
from topleft._apps.batch.cluster import MESH_KEY, came_of, jobs_of_task
from topleft._apps.cli import main

distributed = pytest.importorskip("distributed", reason="the dask extra is not installed")

from cluster_jobs import hang, kill_always, kill_once, wait_a_little  # noqa: E402

SRC = str(Path(tl.__file__).parents[1])
SUPPORT = str(Path(__file__).resolve().parents[1] / "support")


@pytest.fixture(scope="module")
def cluster():
    """Two processes of one thread each, which find the package and the functions of these tests."""
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join([SRC, SUPPORT, *([before] if before else [])])
    settings = {
        "distributed.scheduler.allowed-failures": 1,
        "distributed.comm.timeouts.connect": "20s",
        "distributed.admin.log-format": "",
    }
    import dask

    with dask.config.set(settings):
        made = distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
        )  # fmt: skip
        yield made
        made.close()
    os.environ.pop("PYTHONPATH") if before is None else os.environ.update(PYTHONPATH=before)


@pytest.fixture
def client(cluster):
    with distributed.Client(cluster, set_as_default=False) as made:
        try:
            made.wait_for_workers(2, timeout=10)
        except TimeoutError:  # a nanny that did not start again what an earlier test has killed
            made.restart(timeout=40)
        yield made


@pytest.fixture(autouse=True)
def in_time():
    """A cluster whose workers do not come back fails a test and does not hold the rest up."""

    def end(signum, frame):
        raise TimeoutError("the cluster took longer than 180 s")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(180)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def pids(client):
    return client.run(os.getpid)


class Task:
    """A future of a cluster, which fails with an error if it has one."""

    def __init__(self, status, error=None):
        self.status, self.error = status, error

    def result(self):
        return ["drawn"]

    def exception(self):
        return self.error


def killed_worker(task):
    """As distributed tells of one."""
    return distributed.KilledWorker(task, None, 3)


@pytest.mark.parametrize(
    ("task", "outcomes", "error"),
    [
        (Task("finished"), ["drawn"], None),
        (Task("cancelled"), None, None),
        (Task("lost"), None, None),
        (Task("error", killed_worker(f"{MESH_KEY}-1")), None, None),
        (Task("error", killed_worker("draw-1")), None, distributed.KilledWorker),
        (Task("error", ValueError("no")), None, ValueError),
        (Task("error", ModuleNotFoundError("no", name="topleft")), None, tl.MissingPackageError),
    ],
)
def test_a_task_that_was_lost_or_died_over_its_mesh_is_no_error(task, outcomes, error):
    got, told = came_of(task)
    assert got == outcomes
    assert told is None if error is None else isinstance(told, error)


@pytest.mark.parametrize(("size", "n"), [((64, 64), 64), ((1000, 1000), 11), ((4000, 4000), 1), ("large", 1)])
def test_a_task_has_about_twelve_million_triangles_and_pixels(size, n):
    assert jobs_of_task(tl.Job(tl.Mesh(*tl.scenes.blob(60_000)), size=size)) == n


def test_pictures_are_those_of_one_thread(client):
    found = [result.picture for result in tl.render_batch(views(7), executor=client)]
    assert all(map(np.array_equal, found, pictures(7)))


def test_layers_and_files_are_those_of_one_thread(client, tmp_path):
    jobs = [tl.Job(BOX, camera, SIZE, destination=tmp_path / f"{i}.npz", layers=("depth", "triangle"))
            for i, camera in enumerate(orbit(BOX, 3))]  # fmt: skip
    assert tl.render_batch(jobs, executor=client).finish().n_made == 3
    for i, camera in enumerate(orbit(BOX, 3)):
        wished = tl.render_layers(BOX, camera, SIZE, layers=("depth", "triangle"))
        with np.load(tmp_path / f"{i}.npz") as found:
            assert np.array_equal(found["depth"], wished["depth"], equal_nan=True)
            assert np.array_equal(found["triangle"], wished["triangle"])
    again = tl.render_batch(jobs, executor=client, resume=True).finish()
    assert (again.n_made, again.n_skipped) == (0, 3)


def test_wrong_jobs_are_told_and_the_rest_goes_on(client):
    jobs = [*views(2), tl.Job(BOX, None, (0, -1)), *views(2)]
    summary = tl.render_batch(jobs, executor=client, on_error="collect", chunk=5).finish()
    assert (summary.n_made, [result.index for result in summary.failed]) == (4, [2])
    with pytest.raises(ValueError, match="size must be"):
        tl.render_batch(jobs, executor=client).finish()


def test_worker_that_dies_loses_nothing(client, tmp_path):
    flag = tmp_path / "flag"
    camera = functools.partial(kill_once, str(flag))
    jobs = [tl.Job(BOX, camera if i == 3 else orbit(BOX, 8)[i], SIZE) for i in range(8)]
    results = list(tl.render_batch(jobs, executor=client, chunk=2, on_error="collect"))
    assert [result.error for result in results] == [None] * 8
    assert flag.exists()
    for i in (0, 1, 2, 4, 5, 6, 7):
        assert np.array_equal(results[i].picture, tl.render(BOX, orbit(BOX, 8)[i], SIZE))


def test_job_that_kills_workers_is_told_alone(client):
    jobs = [tl.Job(BOX, kill_always if i == 2 else camera, SIZE) for i, camera in enumerate(orbit(BOX, 6))]
    results = list(tl.render_batch(jobs, executor=client, chunk=3, on_error="collect"))
    assert [type(result.error).__name__ for result in results] == ["NoneType"] * 2 + ["KilledWorker"] + ["NoneType"] * 3


def test_job_that_hangs_is_given_up(client):
    jobs = [tl.Job(BOX, hang if i == 1 else camera, SIZE) for i, camera in enumerate(orbit(BOX, 4))]
    results = list(tl.render_batch(jobs, executor=client, on_error="collect", time_limit=1.0, chunk=2))
    assert [type(result.error).__name__ for result in results] == ["NoneType", "TimeoutError", "NoneType", "NoneType"]
    assert str(results[1].error) == "job 1 took longer than its time limit of 1 s"


def test_restart_of_the_cluster_loses_nothing(client):
    jobs = [tl.Job(BOX, wait_a_little, SIZE, {"shading": "ids"}) for _ in range(40)]
    batch = tl.render_batch(jobs, executor=client, chunk=1)
    found = [next(batch).picture]
    threading.Thread(target=client.restart, kwargs={"timeout": 60}).start()
    found += [result.picture for result in batch]
    wished = tl.render(BOX, None, SIZE, shading="ids")
    assert len(found) == 40
    assert all(np.array_equal(one, wished) for one in found)


def test_batch_that_is_left_early_goes_on_with_resume(client, tmp_path):
    jobs = [tl.Job(BOX, wait_a_little, SIZE, destination=tmp_path / f"{i}.png") for i in range(12)]
    with tl.render_batch(jobs, executor=client, chunk=1) as batch:
        for _ in range(4):
            next(batch)
    there = len(list(tmp_path.glob("*.png")))
    assert 4 <= there < 12
    summary = tl.render_batch(jobs, executor=client, resume=True).finish()
    assert summary.n_skipped >= there  # what a worker had begun it has finished
    assert summary.n_skipped + summary.n_made == 12


def test_client_that_is_killed_goes_on_with_resume(cluster, client, tmp_path):
    """A process that draws a batch is killed; another one draws what is not there."""
    script = (
        "import sys; from pathlib import Path; from distributed import Client; import topleft as tl\n"
        "from batch_jobs import BOX, SIZE; from cluster_jobs import wait_a_little\n"
        "jobs = [tl.Job(BOX, wait_a_little, SIZE, destination=Path(sys.argv[2], f'{i}.png')) for i in range(30)]\n"
        "if __name__ == '__main__':\n"
        "    with Client(sys.argv[1], set_as_default=False) as client:\n"
        "        print(tl.render_batch(jobs, executor=client, chunk=1, resume=True).finish())\n"
    )
    out = tmp_path / "out"
    (tmp_path / "draw.py").write_text(script)
    command = [sys.executable, str(tmp_path / "draw.py"), cluster.scheduler_address, str(out)]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([SRC, SUPPORT])}
    with subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as killed:
        while len(list(out.glob("[0-9]*.png"))) < 3:
            assert killed.poll() is None
            time.sleep(0.01)
        killed.kill()
    there = {path.name: path.stat().st_mtime_ns for path in out.glob("[0-9]*.png")}
    assert 3 <= len(there) < 30
    jobs = [tl.Job(BOX, wait_a_little, SIZE, destination=out / f"{i}.png") for i in range(30)]
    summary = tl.render_batch(jobs, executor=client, resume=True).finish()
    assert summary.n_skipped >= len(there)  # what a worker had begun it has finished
    assert summary.n_skipped + summary.n_made == 30
    assert all((out / name).stat().st_mtime_ns == time_ns for name, time_ns in there.items())
    wished = tl.render(BOX, tl.Camera.framing(BOX, aspect=4 / 3), SIZE)
    assert all(np.array_equal(np.asarray(Image.open(out / f"{i}.png")), wished) for i in range(30))


def test_no_more_is_on_the_way_than_the_window(client):
    begun = []

    def jobs():
        for i, camera in enumerate(orbit(BOX, 60)):
            begun.append(i)
            yield tl.Job(BOX, camera, SIZE)

    most = 0
    for result in tl.render_batch(jobs(), executor=client, chunk=2, window=3):
        most = max(most, len(begun) - result.index)
    assert most <= 2 * 3 + 2


def test_mesh_is_sent_once_a_worker(client):
    vertices, triangles = tl.scenes.shape("icosphere", subdivisions=4)
    mesh = tl.Mesh(vertices, triangles)
    assert tl.render_batch(views(30, mesh), executor=client, chunk=1).finish().n_made == 30
    held = client.run(lambda dask_worker: [key for key in dask_worker.data if "topleft-mesh" in str(key)])
    assert sum(map(len, held.values())) <= 2


def test_raster_is_that_of_one_process(client):
    rng = np.random.default_rng(1)
    mesh = rng.uniform(0, 200, (80, 3)), rng.integers(0, 80, (90, 3))
    raster = tl.tiles(mesh, 200, window=64)
    array = raster.to_dask()
    assert array.chunks == ((64, 64, 64, 8), (64, 64, 64, 8))
    assert np.array_equal(client.compute(array, sync=True), raster[:])
    assert np.array_equal(client.compute(array[70:130, 5:9], sync=True), raster[70:130, 5:9])


def test_raster_in_files_sends_names_alone(client, tmp_path):
    rng = np.random.default_rng(3)
    points, triangles = rng.uniform(0, 300, (1000, 3)), rng.integers(0, 1000, (2000, 3))
    np.save(tmp_path / "v.npy", points)
    np.save(tmp_path / "t.npy", triangles)
    raster = tl.tiles((tmp_path / "v.npy", tmp_path / "t.npy"), 300, window=100)
    assert raster.is_mapped
    assert np.array_equal(client.compute(raster.to_dask(), sync=True), raster[:])


def raster_of_soup(side=1000, kind="labels", **options):
    rng = np.random.default_rng(4)
    mesh = rng.uniform(0, side, (300, 3)), rng.integers(0, 300, (300, 3))
    return tl.tiles(mesh, side, window=128, kind=kind, **options)


def test_workers_write_a_raster_and_one_of_them_is_killed(client, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    raster = raster_of_soup()
    raster.to_zarr(tmp_path / "alone.zarr", levels=3, compression="none")
    killed = []

    def kill_a_worker(step):
        if step.n_done == 20 and not killed:
            killed.append(next(iter(pids(client).values())))
            os.kill(killed[0], signal.SIGKILL)

    written = raster.to_zarr("many.zarr", levels=3, compression="none", executor=client, progress=kill_a_worker)
    assert (written.n_drawn, len(killed)) == (64, 1)
    assert files_of(tmp_path / "many.zarr") == files_of(tmp_path / "alone.zarr")
    (tmp_path / "many.zarr/labels/c/3/3").unlink()
    again = raster.to_zarr("many.zarr", levels=3, compression="none", executor=client, resume=True)
    assert (again.n_drawn, again.n_kept) == (1, 63)


@pytest.mark.parametrize("name", ["a.tif", "a.dzi"])
def test_workers_write_files_of_one_raster(client, tmp_path, name):
    kinds = {"a.tif": ("height_map", "to_geotiff", {"tile": 64}), "a.dzi": ("labels", "to_deepzoom", {"tile": 64})}
    kind, write, how = kinds[name]
    raster = raster_of_soup(300, kind)
    for folder, executor in (("alone", None), ("many", client)):
        (tmp_path / folder).mkdir()
        getattr(raster, write)(tmp_path / folder / name, executor=executor, **how)
    assert files_of(tmp_path / "many") == files_of(tmp_path / "alone")


def test_wrong_executors_of_a_raster_are_told_before_a_byte_is_written(tmp_path):
    with pytest.raises(TypeError, match=r"executor must be a dask\.distributed\.Client or None, got 2"):
        raster_of_soup().to_zarr(tmp_path / "a.zarr", executor=2)
    assert list(tmp_path.iterdir()) == []


def test_command_writes_a_raster_on_a_cluster(tmp_path, cluster, capsys):
    np.save(tmp_path / "v.npy", [[0.0, 0, 0], [300, 0, 0], [0, 300, 3]])
    np.save(tmp_path / "t.npy", [[0, 1, 2]])
    how = ["raster", f"{tmp_path / 'v.npy'},{tmp_path / 't.npy'}", "--pixel-size", "1", "--window", "64"]
    assert main([*how, "-o", str(tmp_path / "alone.zarr")]) == 0
    assert main([*how, "-o", str(tmp_path / "many.zarr"), "--dask", cluster.scheduler_address]) == 0
    assert files_of(tmp_path / "many.zarr") == files_of(tmp_path / "alone.zarr")
    assert main([*how, "-o", str(tmp_path / "b.zarr"), "--dask", "here"]) == 2
    assert "--dask here: must be local, or the address" in capsys.readouterr().err


def test_worker_without_the_package_is_told_in_one_line(tmp_path):
    """A cluster of a Python that finds Dask and not topleft."""
    script = tmp_path / "cluster.py"
    script.write_text(
        "import os, sys\n"
        f"sys.path.insert(0, {SRC!r})\n"
        "def main():\n"
        "    import topleft as tl\n"
        "    from distributed import Client, LocalCluster\n"
        "    os.environ.pop('PYTHONPATH', None)\n"
        "    with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None,\n"
        "                      silence_logs=50, preload=[os.path.abspath(sys.argv[1])]) as a, Client(a) as client:\n"
        "        try:\n"
        "            tl.render_batch([(tl.Mesh(*tl.scenes.shape('cube')),)],\n"
        "                            executor=client).finish()\n"
        "        except tl.MissingPackageError as error:\n"
        "            print('said:', error)\n"
        "if __name__ == '__main__':\n"
        "    main()\n"
    )
    (tmp_path / ("hide" + ".py")).write_text(
        "import sys\n"
        "class Without:\n"
        "    def __init__(self, finder):\n"
        "        self.finder = finder\n"
        "    def find_spec(self, name, *rest):\n"
        "        return None if name.partition('.')[0] == 'topleft' else self.finder.find_spec(name, *rest)\n"
        "sys.modules.pop('topleft', None)\n"
        "sys.meta_path[:] = [Without(finder) for finder in sys.meta_path]\n"
    )
    done = subprocess.run(
        [sys.executable, str(script), "hide" + ".py"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=120,
        check=False,
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("said:")]
    assert len(lines) == 1, done.stderr
    assert "has no topleft: install it there" in lines[0]


def free_port():
    """A port that no outgoing connection of another process takes: systems give those higher ones."""
    for port in random.Random(os.getpid()).sample(range(20000, 32000), 100):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise RuntimeError("none of 100 ports from 20000 to 32000 is free")


class Processes:
    """A scheduler and a worker in processes that a test kills and starts again."""

    def __init__(self):
        self.port = free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.scheduler, self.worker = self.started("scheduler"), self.started("worker")

    def started(self, what):
        env = {**os.environ, "PYTHONPATH": os.pathsep.join([SRC, SUPPORT])}
        command = [sys.executable, f"{SUPPORT}/dask_processes.py", what, str(self.port)]
        with tempfile.TemporaryFile() as errors:
            made = subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=errors)
            if what == "scheduler" and made.stdout.readline() != b"ready\n":
                errors.seek(0)
                raise RuntimeError(f"no scheduler at port {self.port}: {errors.read().decode()[-2000:]}")
        return made

    def restart_scheduler(self):
        """Kill it, and start another one where it was."""
        self.scheduler.kill()
        self.scheduler.wait()
        self.scheduler.stdout.close()
        self.scheduler = self.started("scheduler")

    def close(self):
        for one in (self.worker, self.scheduler):
            one.kill()
            one.wait()
            one.stdout.close()


@pytest.fixture(scope="module")
def processes():
    made = Processes()
    yield made
    made.close()


@pytest.fixture
def own_client(processes):
    with distributed.Client(processes.address, timeout=30, set_as_default=False) as made:
        made.wait_for_workers(1, timeout=30)
        yield made


def test_batch_goes_on_with_another_scheduler(processes, own_client, tmp_path):
    jobs = [tl.Job(BOX, wait_a_little, SIZE, destination=tmp_path / f"{i}.png") for i in range(24)]
    batch = tl.render_batch(jobs, executor=own_client, chunk=1)
    assert [next(batch).index for _ in range(3)] == [0, 1, 2]
    processes.restart_scheduler()
    assert [result.index for result in batch] == list(range(3, 24))
    wished = tl.render(BOX, tl.Camera.framing(BOX, aspect=4 / 3), SIZE)
    assert all(np.array_equal(np.asarray(Image.open(tmp_path / f"{i}.png")), wished) for i in range(24))


def test_raster_goes_on_with_another_scheduler(processes, own_client, tmp_path):
    raster = raster_of_soup(1500, "coverage", sampling="area")
    raster.to_zarr(tmp_path / "alone.zarr", compression="none")
    restarted = []

    def restart(step):
        if step.n_done >= 5 and not restarted:
            restarted.append(step.n_done)
            processes.restart_scheduler()

    raster.to_zarr(tmp_path / "many.zarr", compression="none", executor=own_client, progress=restart)
    assert restarted == [5]
    assert files_of(tmp_path / "many.zarr") == files_of(tmp_path / "alone.zarr")


@pytest.mark.parametrize("limit", [0, -1.0, float("nan")])
def test_wrong_time_limits_are_told(client, limit):
    with pytest.raises(ValueError, match="time_limit must be positive"):
        tl.render_batch([], executor=client, time_limit=limit)
    with pytest.raises(ValueError, match=r"time_limit is for a dask\.distributed\.Client"):
        tl.render_batch([], executor=2, time_limit=1.0)


def test_command_draws_on_a_cluster(tmp_path, cluster, capsys):
    save = tmp_path / "box.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in BOX.vertices.tolist()]
    save.write_text("\n".join([*rows, *(f"f {a} {b} {c}" for a, b, c in (BOX.triangles + 1).tolist())]))
    how = ["--size", "40x30", "--views", "5"]
    assert main(["render", str(save), "-o", str(tmp_path / "one/{index}-{view}.png"), *how]) == 0
    address = cluster.scheduler_address
    assert main(["render", str(save), "-o", str(tmp_path / "many/{index}-{view}.png"), *how, "--dask", address]) == 0
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert len(names) == 5
    for name in names:
        one, many = (np.asarray(Image.open(tmp_path / folder / name)) for folder in ("one", "many"))
        assert np.array_equal(one, many)
    assert main(["render", str(save), "-o", str(tmp_path / "a.png"), "--dask", "here"]) == 2
    assert "--dask here: must be local, or the address of a scheduler" in capsys.readouterr().err
