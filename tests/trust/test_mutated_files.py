"""Pictures, job files and levels that nobody meant: read, or told in one line; never a traceback.

Meshes are in `tests/io/test_hostile_files.py`. `TOPLEFT_MUTATIONS=500` reads 500 of each kind instead of a sample.
"""

import io
import json
import os
import warnings

import numpy as np
import pytest
from mutations import N_MUTATIONS, mutated_bytes, mutated_tree
from PIL import Image

import topleft as tl
from topleft._apps.cli.targets import read_texture
from topleft.errors import ImageError, MeshError

N = int(os.environ.get("TOPLEFT_MUTATIONS", str(N_MUTATIONS // 2)))
TEXTURES = [
    "png",
    "palette.png",
    "interlaced.png",
    "jpeg",
    "progressive.jpeg",
    "webp",
    "bmp",
    "tiff",
    "gif",
    "tga",
    "ppm",
]
JOB = {
    "size": "8x6",
    "job": [
        {"mesh": "cube", "out": "v/", "views": 2, "color": "red"},
        {"mesh": ["tetrahedron"], "out": "b.png", "azimuth": 30},
    ],
}
TOML = (
    b'size = "8x6"\n[[job]]\nmesh = "cube"\nout = "v/"\nviews = 2\ncolor = "red"\n\n'
    b'[[job]]\nmesh = ["tetrahedron"]\nout = "b.png"\nazimuth = 30.5\n'
)


def picture_file(kind):
    """A picture of 12 x 9 pixels in a format."""
    image = Image.fromarray(np.random.default_rng(0).integers(0, 256, (9, 12, 3), dtype=np.uint8))
    suffix, options = kind.rpartition(".")[2], {}
    if kind.startswith("palette"):
        image = image.convert("P")
    if kind.startswith("progressive"):
        options = {"progressive": True}
    if suffix == "tiff":
        options = {"compression": "tiff_adobe_deflate"}
    file = io.BytesIO()
    image.save(file, format=suffix.upper(), **options)
    return file.getvalue()


@pytest.mark.parametrize("kind", TEXTURES)
def test_textures_of_mutated_files_are_read_or_refused_in_one_line(folder, kind):
    content, lines = picture_file(kind), set()
    (folder / "a").write_bytes(content)
    assert read_texture("a").image.shape == (9, 12, 4)
    for seed in range(N // 5 + 1 if "TOPLEFT_MUTATIONS" not in os.environ else N):
        (folder / "a").write_bytes(mutated_bytes(np.random.default_rng(seed), content))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                texture = read_texture("a")
                assert texture.image.dtype == np.uint8
            except ImageError as error:
                lines.add(str(error))
    assert lines
    assert [line for line in lines if "\n" in line or len(line) > 300] == []


@pytest.mark.parametrize("suffix", [".json", ".toml"])
def test_render_of_mutated_job_files_draws_or_says_why_in_one_line(run, folder, suffix):
    (folder / f"a{suffix}").write_bytes(TOML if suffix == ".toml" else json.dumps(JOB).encode())
    assert run("render", "--jobs-file", f"a{suffix}") == (0, [])
    statuses = set()
    for seed in range(N):
        rng = np.random.default_rng(seed)
        if suffix == ".toml" or rng.random() < 0.3:
            content = mutated_bytes(rng, TOML if suffix == ".toml" else json.dumps(JOB).encode())
        else:
            content = json.dumps(mutated_tree(rng, JOB)).encode()
        (folder / f"a{suffix}").write_bytes(content)
        status, lines = run("render", "--jobs-file", f"a{suffix}")
        statuses.add(status)
        assert status in (0, 1, 2), (seed, lines)  # 1: a mesh of several failed
        assert len(lines) <= (1 if status == 2 else 3 * status), (seed, lines)
        assert not any("Traceback" in line or "Error:" in line for line in lines), (seed, lines)
        assert list(folder.rglob("*.part")) == []
    assert 2 in statuses


def test_levels_of_mutated_files_are_read_or_refused_in_one_line(folder):
    mesh = tl.Mesh(*tl.scenes.torus(segments=12, sections=8))
    levels, camera = tl.simplify(mesh, smallest=20), tl.Camera.framing(mesh)
    levels.save("a.npz")
    content = (folder / "a.npz").read_bytes()
    arrays = dict(np.load("a.npz"))
    n_read, refusals = 0, []
    for seed in range(N):
        rng = np.random.default_rng(seed)
        if seed % 2:
            (folder / "b.npz").write_bytes(mutated_bytes(rng, content))
        else:
            np.savez("b.npz", **mutated_arrays(rng, arrays))
        try:
            found = tl.Levels.load("b.npz", mesh)
            n_read += 1
        except MeshError as error:
            refusals.append(str(error))
        else:
            for level in found:
                tl.rasterize_mesh(level.mesh, camera, (12, 9))
    assert n_read
    assert refusals
    assert [line for line in refusals if "\n" in line] == []


def mutated_arrays(rng, arrays):
    """Arrays of another dtype or shape, with numbers that do not belong there, or without one of them."""
    arrays = dict(arrays)
    name = list(arrays)[int(rng.integers(len(arrays)))]
    array = arrays[name]
    match int(rng.integers(6)):
        case 0:
            del arrays[name]
        case 1:
            arrays[name] = array[..., None]
        case 2:
            arrays[name] = array.astype([np.float16, np.int64, np.uint8, np.complex64][int(rng.integers(4))]) if (
                array.dtype.kind in "fiu") else np.array(7)  # fmt: skip
        case 3:
            arrays[name] = array[:0] if array.ndim else np.array("other")
        case 4 if array.ndim and array.size:
            arrays[name] = array.copy()
            wrong = [np.nan, -1, 1e300, np.inf] if array.dtype.kind == "f" else [-1, 10**8, 2**31 - 1]
            arrays[name].reshape(-1)[int(rng.integers(array.size))] = wrong[int(rng.integers(len(wrong)))]
        case _:
            arrays[name] = np.array([1, 2, 3])
    return arrays
