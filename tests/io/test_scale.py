"""`scale=`: units of a file, in `load`, `load_cameras`, jobs and on the command line."""

import numpy as np
import pytest

import topleft as tl

OBJ = "v 0 0 0\nv 1500 0 0\nv 0 2500 0\nv 0 0 700\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.fixture
def path(folder):
    folder.joinpath("part.obj").write_text(OBJ)
    return folder / "part.obj"


def test_load_multiplies_coordinates_and_keeps_the_rest(path):
    whole, small = tl.load(path), tl.load(path, scale=0.001)
    assert small.vertices.dtype == whole.vertices.dtype
    assert (small.vertices == (np.float64(whole.vertices) * 0.001).astype(whole.vertices.dtype)).all()
    assert (small.triangles == whole.triangles).all()
    np.testing.assert_allclose(small.vertex_normals(), whole.vertex_normals(), atol=1e-6)


def test_load_multiplies_points(folder):
    folder.joinpath("cloud.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n"
        "end_header\n0 1000 2\n5 5 5\n"
    )
    assert tl.load("cloud.ply", scale=0.001).positions.tolist() == [[0, 1, 0.002], [0.005, 0.005, 0.005]]


def test_jobs_read_their_file_in_another_unit(path):
    camera = tl.Camera.look_at((3, 2, 4), (0.5, 0.8, 0.2))
    job = tl.Job(str(path), camera, (32, 24), layers=("distance", "triangle"), scale=0.001)
    (found,) = tl.render_batch([job])
    expected = tl.render_layers(tl.load(path, scale=0.001), camera, (32, 24), layers=("distance", "triangle"))
    assert (found.layers["triangle"] >= 0).any()
    for name, layer in expected.items():
        assert (found.layers[name] == layer).all()


def test_jobs_of_one_file_in_two_units_are_two_meshes(path):
    camera = tl.Camera.look_at((3, 2, 4), (0.5, 0.8, 0.2))
    jobs = [tl.Job(str(path), camera, (32, 24), layers=("triangle",), scale=scale) for scale in (0.001, 0.0005)]
    first, second = (result.layers["triangle"] for result in tl.render_batch(jobs))
    assert (first != second).any()


def test_command_line_and_job_file_write_distances_in_the_unit(path, run, folder):
    words = "part.obj", "--size", "32x24", "--layers", "distance"
    assert run("render", *words, "-o", "mm.npy") == (0, [])
    assert run("render", *words, "-o", "m.npy", "--scale", "0.001") == (0, [])
    folder.joinpath("jobs.toml").write_text(
        '[[job]]\nmesh = "part.obj"\nsize = "32x24"\nlayers = "distance"\nout = "job.npy"\nscale = 0.001\n'
    )
    assert run("render", "--jobs-file", "jobs.toml") == (0, [])
    millimetres, metres, of_job = (np.load(name) for name in ("mm.npy", "m.npy", "job.npy"))
    assert np.isfinite(metres).any()
    np.testing.assert_allclose(metres, millimetres * 0.001, rtol=1e-5)
    assert (metres == of_job).all()


@pytest.mark.parametrize("scale", [0, -1, np.inf, np.nan])
def test_a_scale_that_is_not_positive_is_refused(path, scale):
    for read in (tl.load, tl.load_cameras):
        with pytest.raises(ValueError, match="scale must be a positive number, got"):
            read(path, scale=scale)
    with pytest.raises(ValueError, match="scale must be a positive number, got"):
        tl.Job(str(path), scale=scale)


def test_a_scale_of_a_job_without_a_path_is_refused():
    with pytest.raises(TypeError, match="scale is of a scene that is a path, got Mesh"):
        tl.Job(tl.Mesh(*tl.scenes.cube()), scale=2)
