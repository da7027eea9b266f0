"""What batches draw: meshes that are read once, scenes, meshes of other libraries, through lenses, as glass."""

import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from batch_jobs import BOX, CORNERS, EXECUTORS, FACES, SIZE, orbit, pictures, views

import topleft as tl
from topleft._apps.batch import jobs
from topleft._apps.batch import workers as crews
from topleft._core.base.options import LAYER_NAMES
from topleft._meshes.io import load as files
from topleft._meshes.lod.levels import kept_levels
from topleft._meshes.scene import adapt


@pytest.fixture(scope="module")
def processes():
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        yield pool


class CountedMesh(tl.Mesh):
    """A mesh that counts how often it is pickled, and on which process it is read."""

    n_pickled = 0

    def __reduce__(self):
        type(self).n_pickled += 1
        return read_counted, (self.vertices, self.triangles)


def read_counted(vertices, triangles):
    mesh = CountedMesh(vertices, triangles)
    object.__setattr__(mesh, "token", os.urandom(8))
    return mesh


class ColorOfReader:
    """A camera maker that leaves a mark of the object that it was called with in a file."""

    def __init__(self, folder):
        self.folder = str(folder)

    def __call__(self, mesh, size):
        Path(self.folder, f"{os.getpid()}-{mesh.token.hex()}").touch()
        return tl.Camera.framing(mesh, aspect=size[0] / size[1])


# Meshes


def test_batch_pickles_a_shared_mesh_once_and_each_process_reads_it_once(processes, tmp_path):
    CountedMesh.n_pickled = 0
    mesh = CountedMesh(CORNERS, FACES)
    object.__setattr__(mesh, "token", b"")
    listed = [tl.Job(mesh, ColorOfReader(tmp_path), SIZE) for _ in range(30)]
    assert tl.render_batch(listed, executor=processes).finish().n_made == 30
    assert CountedMesh.n_pickled == 1
    pids = [path.name.partition("-")[0] for path in tmp_path.iterdir()]
    assert len(pids) == len(set(pids)) <= 2


def test_batch_spools_many_meshes_in_bounded_room(processes, monkeypatch):
    most = []
    release = crews.Spool.release

    def count(self, scene, with_levels=False):
        most.append(len(list(Path(self._folder).iterdir())))
        release(self, scene, with_levels)

    monkeypatch.setattr(crews.Spool, "release", count)
    listed = (tl.Job(tl.Mesh(BOX.vertices + i, BOX.triangles), None, SIZE) for i in range(40))
    results = list(tl.render_batch(listed, executor=processes, window=3))
    assert all(np.array_equal(result.picture, results[0].picture) for result in results[:2])
    assert max(most) <= crews.N_SPOOLED + 3
    assert len(most) == 40


def test_spool_has_all_meshes_in_use_and_few_others():
    meshes = [tl.Mesh(BOX.vertices + i, BOX.triangles) for i in range(crews.N_SPOOLED + 4)]
    spool = crews.Spool()
    try:
        places = [spool.hold(mesh) for mesh in meshes]
        assert all(np.array_equal(at().vertices, mesh.vertices) for at, mesh in zip(places, meshes, strict=True))
        for mesh in meshes:
            spool.release(mesh)
        assert spool.hold(meshes[-1]) == places[-1]
        assert len(list(Path(spool.token).iterdir())) == crews.N_SPOOLED
    finally:
        spool.close()


def test_batch_leaves_no_spool(processes, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with tl.render_batch(views(9), executor=processes) as results:
        next(results)
        assert len(list(tmp_path.iterdir())) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("executor", EXECUTORS)
def test_batch_reads_a_file_once(executor, tmp_path, monkeypatch):
    read = []
    monkeypatch.setattr(jobs, "load", lambda path, **_: read.append(path) or BOX)
    listed = [tl.Job(str(tmp_path / name), None, SIZE) for name in "aaabbb"]
    results = list(tl.render_batch(listed, executor=executor))
    assert sorted(read) == [str(tmp_path / "a"), str(tmp_path / "b")]
    assert np.array_equal(results[5].picture, tl.render(BOX, None, SIZE))


def test_batch_tries_a_broken_file_once(tmp_path, monkeypatch):
    read = []
    monkeypatch.setattr(jobs, "load", lambda path, **own: read.append(path) or files.load(path, **own))
    listed = [tl.Job(str(tmp_path / "gone.obj"), None, SIZE)] * 3
    summary = tl.render_batch(listed, executor=2, on_error="collect").finish()
    assert [str(result.error) for result in summary.failed] == [f"there is no file {str(tmp_path / 'gone.obj')!r}"] * 3
    assert len(read) == 1


# Scenes, meshes of other libraries, lenses, glass


def two_boxes():
    aside = np.eye(4)
    aside[:3, 3] = 3, 0.5, -1
    return tl.Scene([BOX, (BOX, aside)])


@pytest.mark.parametrize("executor", EXECUTORS)
def test_batch_draws_scenes_and_their_layers(executor):
    scene = two_boxes()
    listed = [tl.Job(scene, None, SIZE), tl.Job(scene, None, SIZE, {"shading": "flat"}, None, ("instance", "color"))]
    first, second = tl.render_batch(listed, executor=executor)
    whole, layers = first.picture, second.layers
    assert np.array_equal(whole, tl.render(scene, None, SIZE))
    assert np.array_equal(layers["color"], tl.render(scene, None, SIZE, shading="flat"))
    assert np.array_equal(layers["instance"], tl.rasterize_mesh(scene, None, SIZE).instance)
    assert np.unique(layers["instance"]).tolist() == [-1, 0, 1]


def test_batch_of_processes_draws_scenes(processes):
    scene = two_boxes()
    results = list(tl.render_batch([tl.Job(scene, None, SIZE)] * 3, executor=processes))
    assert all(np.array_equal(result.picture, tl.render(scene, None, SIZE)) for result in results)


@pytest.mark.parametrize("executor", EXECUTORS)
def test_batch_makes_a_mesh_of_another_library_ours_once(executor, monkeypatch):
    made = []
    monkeypatch.setattr(jobs, "as_mesh", lambda subject: made.append(subject) or adapt.as_mesh(subject))
    foreign, other = (SimpleNamespace(vertices=BOX.vertices * k, faces=BOX.triangles) for k in (1, 2))
    listed = [tl.Job(foreign, camera, SIZE) for camera in orbit(BOX, 4)] + [tl.Job(other, None, SIZE)]
    results = list(tl.render_batch(listed, executor=executor))
    assert len([subject for subject in made if subject is foreign]) == 1
    for result, camera in zip(results, orbit(BOX, 4), strict=False):
        assert np.array_equal(result.picture, tl.render(tl.as_mesh(foreign), camera, SIZE))
    assert np.array_equal(results[4].picture, tl.render(tl.as_mesh(other), None, SIZE))


def test_batch_takes_functions_and_processes_that_give_meshes_of_others(processes):
    pair = BOX.vertices, BOX.triangles
    expected = tl.render(pair, None, SIZE)
    assert np.array_equal(next(tl.render_batch([tl.Job(lambda: pair, None, SIZE)])).picture, expected)
    assert np.array_equal(next(tl.render_batch([tl.Job(pair, None, SIZE)], executor=processes)).picture, expected)


def test_batch_of_what_is_no_mesh_is_an_error_of_the_job():
    (result,) = tl.render_batch([tl.Job(7, None, SIZE)], on_error="collect")
    with pytest.raises(TypeError, match=r"mesh must be a Mesh, .*, got int"):
        raise result.error


def test_batch_draws_through_a_lens_and_leaves_no_matrix(tmp_path):
    intrinsics = [[40, 0, 20], [0, 40, 15], [0, 0, 1]]
    pose = np.diag([1.0, -1, -1, 1]) @ tl.Camera.look_at((2, 3, 9)).view
    camera = tl.Camera.from_intrinsics(intrinsics, pose, SIZE, near=1, far=30, distortion=[-0.2, 0.05, 0, 0])
    names = ("color", "distance", "triangle")
    (result,) = tl.render_batch([tl.Job(BOX, camera, SIZE, layers=names)])
    expected = tl.render_layers(BOX, camera, SIZE, layers=names)
    assert (expected["triangle"] >= 0).any()
    assert all(np.array_equal(result.layers[name], expected[name]) for name in names)
    tl.render_batch([tl.Job(BOX, camera, SIZE, {}, tmp_path / "a.npz", names)]).finish()
    with np.load(tmp_path / "a.npz") as arrays:
        assert sorted(arrays) == sorted(names)


def test_batch_draws_glass():
    options = {"opacity": 0.4, "background": (0, 0, 0, 0)}
    listed = [tl.Job(BOX, None, SIZE, options), tl.Job(BOX, None, SIZE, options, None, ("alpha", "color"))]
    first, second = tl.render_batch(listed)
    picture, layers = first.picture, second.layers
    expected = tl.render_transparent(BOX, None, SIZE, **options)
    assert np.array_equal(picture, expected)
    assert np.array_equal(layers["color"], expected)


def test_batch_layers_flow_to_the_camera_of_the_options():
    begin, end = orbit(BOX, 2)
    (result,) = tl.render_batch([tl.Job(BOX, begin, SIZE, {"camera_to": end}, None, ("flow",))])
    expected = tl.render_layers(BOX, begin, SIZE, layers="flow", camera_to=end)["flow"]
    assert np.array_equal(result.layers["flow"], expected, equal_nan=True)


def test_batch_layers_are_those_without_kept_memory():
    names = [name for name in LAYER_NAMES if name not in ("uv", "flow")]
    options = {"sampling": "msaa4", "shading": "flat", "cull": "back"}
    listed = [tl.Job(BOX, camera, SIZE, options, None, names) for camera in orbit(BOX, 3)]
    for result, camera in zip(list(tl.render_batch(listed)), orbit(BOX, 3), strict=True):
        expected = tl.render_layers(BOX, camera, SIZE, layers=names, **options)
        assert list(result.layers) == names
        assert all(np.array_equal(result.layers[n], expected[n], equal_nan=n != "color") for n in names)


@pytest.mark.parametrize("options", [{"shade": "flat"}, {"opacity": 0.5, "sampling": "msaa4"}])
def test_batch_layers_unknown_option_is_an_error_of_the_job(options):
    (name,) = options.keys() - {"opacity"}
    with pytest.raises(TypeError, match=f"there is no option '{name}' of a picture"):
        tl.render_batch([tl.Job(BOX, None, SIZE, options, None, ("depth",))]).finish()


def test_spooled_mesh_comes_with_its_levels():
    mesh = tl.Mesh(*tl.scenes.torus(segments=48, sections=24))
    spool = crews.Spool()
    try:
        found = spool.hold(tl.Scene([tl.Instance(mesh), tl.Instance(mesh)]), True)()
        plain = spool.hold(mesh)()
    finally:
        spool.close()
    assert found[0].mesh is found[1].mesh
    assert [one.bound for one in kept_levels(found[0].mesh)] == [one.bound for one in kept_levels(mesh)]
    assert kept_levels(plain) is None


def test_batch_in_processes_draws_levels_of_the_parent(processes):
    mesh = tl.Mesh(*tl.scenes.torus(segments=48, sections=24))
    found = list(tl.render_batch(views(3, mesh, tolerance=2), executor=processes))
    assert kept_levels(mesh) is not None
    for result, expected in zip(found, pictures(3, mesh, tolerance=2), strict=True):
        assert np.array_equal(result.picture, expected)


def test_levels_that_cannot_be_made_are_left_to_the_job(monkeypatch):
    monkeypatch.setitem(sys.modules, "fast_simplification", None)
    assert crews.coarser_levels_of(tl.Mesh(*tl.scenes.torus())) == []
    assert crews.coarser_levels_of("bunny.obj") == []
