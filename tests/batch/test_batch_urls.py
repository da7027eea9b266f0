"""Batches that write to URLs: files whole or not there, those that are there left out on request."""

import io
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from batch_jobs import BOX, SIZE, orbit, pictures
from PIL import Image

import topleft as tl
from topleft._apps.cli import main
from topleft._core.base.remote import RemotePath, location_of

fsspec = pytest.importorskip("fsspec", reason="the tiles extra is not installed")

from fsspec.implementations.memory import MemoryFileSystem  # noqa: E402


class SlowStore(MemoryFileSystem):
    """A file system on which a file shows while it is written, and whose connection may break."""

    protocol = "sftp"
    store: dict = {}  # noqa: RUF012
    pseudo_dirs = [""]  # noqa: RUF012
    breaks = False

    def pipe_file(self, path, value, **options):
        super().pipe_file(path, value[: len(value) // 2] if self.breaks else value, **options)
        if self.breaks:
            raise ConnectionResetError("the other side has closed the connection")


@pytest.fixture
def memory():
    """An empty store in memory."""
    found = fsspec.filesystem("memory")
    found.store.clear()
    found.pseudo_dirs[:] = [""]
    return found


@pytest.fixture
def shows_parts(monkeypatch):
    """What sftp:// names, for a test."""
    found = SlowStore()
    found.store.clear()
    monkeypatch.setattr("fsspec.core.url_to_fs", lambda url, **_: (found, "/" + url.partition("://")[2]))
    yield found
    SlowStore.breaks = False


def listed(pattern, n=4):
    return [tl.Job(BOX, camera, SIZE, {}, pattern.format(i)) for i, camera in enumerate(orbit(BOX, n))]


@pytest.mark.parametrize("executor", [None, 2])
def test_batch_writes_to_a_store(memory, executor):
    summary = tl.render_batch(listed("memory://bucket/a/{}.png"), executor=executor).finish()
    assert (summary.n_made, summary.failed) == (4, ())
    for i, wished in enumerate(pictures(4)):
        found = np.asarray(Image.open(io.BytesIO(memory.cat_file(f"/bucket/a/{i}.png"))))
        assert np.array_equal(found, wished)


def test_batch_resume_leaves_out_what_a_store_has(memory):
    jobs = listed("memory://bucket/{}.png")
    tl.render_batch(jobs[:3]).finish()
    memory.rm_file("/bucket/1.png")
    memory.pipe_file("/bucket/2.png", b"")  # an empty file is none
    results = list(tl.render_batch(jobs, resume=True))
    assert [result.is_skipped for result in results] == [True, False, False, False]


def test_layers_go_to_a_store(memory):
    job = tl.Job(BOX, None, SIZE, {}, "memory://b/{layer}.npy", ("depth", "triangle"))
    assert [str(file) for file in job.files] == ["memory://b/depth.npy", "memory://b/triangle.npy"]
    tl.render_batch([job]).finish()
    found = np.load(io.BytesIO(memory.cat_file("/b/triangle.npy")))
    assert np.array_equal(found, tl.render_layers(BOX, None, SIZE, layers=("triangle",))["triangle"])
    assert tl.render_batch([job], resume=True).finish().n_skipped == 1


def test_urls_of_this_machine_are_paths(tmp_path):
    assert location_of(f"file://{tmp_path}/a b.png") == tmp_path / "a b.png"
    assert location_of(f"file://{tmp_path}/a%20b.png") == tmp_path / "a b.png"
    job = tl.Job(BOX, None, SIZE, {}, f"file://{tmp_path}/new/a.png")
    tl.render_batch([job]).finish()
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.png"]


def test_processes_write_to_urls(tmp_path):
    from concurrent.futures import ProcessPoolExecutor

    with ProcessPoolExecutor(1) as pool:
        jobs = listed(f"file://{tmp_path}/{{}}.png", 2)
        assert tl.render_batch(jobs, executor=pool).finish().n_made == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.png", "1.png"]
    assert pickle.loads(pickle.dumps(RemotePath("memory://a/b.png"))).parent == RemotePath("memory://a")


def test_file_that_shows_while_it_is_written_gets_another_name_first(shows_parts):
    tl.save_image("sftp://host/a/x.png", np.zeros((4, 4), np.uint8))
    tl.save_image("sftp://host/a/x.png", np.ones((4, 4), np.uint8))
    assert [Path(name).name for name in shows_parts.ls("/host/a", detail=False)] == ["x.png"]
    assert Image.open(io.BytesIO(shows_parts.cat_file("/host/a/x.png"))).getpixel((0, 0)) == 1


def test_connection_that_breaks_leaves_no_half_file(shows_parts):
    SlowStore.breaks = True
    (failed,) = tl.render_batch(listed("sftp://host/a/{}.png", 1), on_error="collect").finish().failed
    assert isinstance(failed.error, ConnectionResetError)
    assert shows_parts.find("/host") == []
    SlowStore.breaks = False
    assert tl.render_batch(listed("sftp://host/a/{}.png", 1), resume=True).finish().n_made == 1


def test_command_writes_to_a_store_and_resumes(memory, capsys):
    how = ["render", "cube", "-o", "memory://thumbs/{name}.png", "--views", "3", "--size", "40x30"]
    assert main(how) == 0
    assert sorted(memory.ls("/thumbs", detail=False)) == [f"/thumbs/cube-00{i}.png" for i in range(3)]
    memory.rm_file("/thumbs/cube-001.png")
    made = memory.created("/thumbs/cube-002.png")
    assert main([*how, "--resume"]) == 0
    assert memory.created("/thumbs/cube-002.png") == made
    assert memory.size("/thumbs/cube-001.png") > 100
    assert main(["render", "cube", "-o", "memory://folder/", "--size", "40x30"]) == 0
    assert memory.ls("/folder", detail=False) == ["/folder/cube.png"]
    assert capsys.readouterr().err == ""


def test_command_writes_a_raster_to_a_store(memory, tmp_path, capsys):
    np.save(tmp_path / "v.npy", [[0.0, 0, 0], [30, 0, 0], [0, 30, 3]])
    np.save(tmp_path / "t.npy", [[0, 1, 2]])
    mesh = f"{tmp_path / 'v.npy'},{tmp_path / 't.npy'}"
    how = ["raster", mesh, "-o", "memory://b/a.zarr", "--pixel-size", "1", "--window", "16"]
    assert main(how) == 0
    memory.rm_file("/b/a.zarr/height_map/c/0/0")
    assert main([*how, "--resume"]) == 0
    assert "1 windows drawn, 3 kept" in capsys.readouterr().out.splitlines()[-1]
    assert main(["raster", mesh, "-o", "memory://b/a.tif", "--pixel-size", "1"]) == 2
    assert ".tif goes to a path of this machine, .zarr to a URL as well" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "nowhere://a/b.png"], "cannot write to nowhere://a: Protocol not known: nowhere"),
        (["-o", "memory://a/b.txt"], "OUT must end in one of .png"),
        (["-o", "memory://a/{nme}.png"], "{nme}"),
        (["-o", "memory://a/", "--sheet", "sheet.png"], "need pictures on this machine: OUT must be a path, not a URL"),
        (["--sheet", "memory://a/sheet.png"], "are written to this machine: give a path, not a URL"),
    ],
)
def test_wrong_urls_are_told_in_one_line(memory, arguments, message, capsys):
    try:
        status = main(["render", "cube", "--size", "40x30", *arguments])
    except SystemExit as error:
        status = error.code
    said = capsys.readouterr().err.strip()
    assert status == 2
    assert message in said
    assert "\n" not in said


def test_unknown_urls_are_told_by_the_batch(memory):
    (failed,) = tl.render_batch(listed("nowhere://a/{}.png", 1), on_error="collect").finish().failed
    assert str(failed.error) == "cannot write to nowhere://a/0.png: Protocol not known: nowhere"
    raster = tl.tiles(([[0, 0], [6, 0], [0, 6]], [[0, 1, 2]]), (6, 6))
    with pytest.raises(ValueError, match="cannot write to nowhere://a: Protocol not known"):
        raster.to_zarr("nowhere://a")
    for write in (raster.to_geotiff, raster.to_deepzoom):
        with pytest.raises(ValueError, match=r"path must be on this machine, got 'memory://a\.tif': to_zarr writes"):
            write("memory://a.tif")


def test_absent_package_is_hinted_at():
    code = (
        "import sys; sys.modules['fsspec'] = None; sys.modules['fsspec.core'] = None\n"
        "import topleft as tl, numpy as np\n"
        "from topleft._apps.cli import main\n"
        "try: tl.save_image('s3://a/b.png', np.zeros((2, 2), np.uint8))\n"
        "except tl.MissingPackageError as error: print(error)\n"
        "print(main(['render', 'cube', '-o', 's3://a/', '--size', '9x9']))"
    )
    source = str(Path(tl.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {source!r})\n{code}"],
        capture_output=True,
        text=True,
        check=True,
    )
    hint = "needs the package fsspec: pip install fsspec"
    assert done.stdout.splitlines() == [f"writing to s3://a/b.png {hint}", "2"]
    assert hint in done.stderr
