"""Hashes of what every verb, sampling and layer makes of 60 seeded scenes, and the file of those that must stay.

`python tests/support/golden.py` writes the file anew, with one hash for each kind of scene and buffer: only for a
change that is to change pictures, and that says so.
"""

import hashlib
import json
import pathlib
from collections.abc import Iterator

import numpy as np

import topleft as tl
from topleft._render.layers import LAYERS

SIZE = (61, 47)
FILE = pathlib.Path(__file__).with_name("golden.json")
SAMPLINGS = ("center", "msaa2", "msaa4", "msaa8", "msaa16")
SEEDS = range(5)

#: Kinds of scenes: the extent of triangles in pixels, and how many there are.
PIXEL_SCENES = {
    "dust": (0.7, 900),
    "small": (3.0, 400),
    "middle": (12.0, 120),
    "large": (70.0, 40),
    "huge": (1e5, 20),
    "wide": (1e12, 12),
}
CLIP_SCENES = {"near": (0.5, 60), "cut": (2.0, 40), "behind": (8.0, 30)}
LATTICE = ("lattice", "shared", "slivers")

VIEW = np.array([[1.0, 0, 0, 0], [0, 0.75, 0.5, 0], [0, -0.5, 0.75, -3], [0, 0, 0, 1]])
PROJECTION = np.array([[1.5, 0, 0, 0], [0, 2.0, 0, 0], [0, 0, -1.5, -1.0], [0, 0, -1, 0]])


def scenes(kind: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield vertices and triangles of the scenes of a kind."""
    for seed in SEEDS:
        rng = np.random.default_rng([len(kind), ord(kind[0]), seed])
        if kind in PIXEL_SCENES:
            extent, n = PIXEL_SCENES[kind]
            corners = rng.random((n, 1, 3)) * [*SIZE, 1] + (rng.random((n, 3, 3)) - 0.5) * [extent, extent, 1]
            yield corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)
        elif kind in CLIP_SCENES:
            extent, n = CLIP_SCENES[kind]
            corners = (rng.random((3 * n, 4)) - [0.5, 0.5, 0.5, 0.3]) * [2 * extent, 2 * extent, 2, 1]
            yield corners, np.arange(3 * n).reshape(-1, 3)
        elif kind == "lattice":  # vertices on centres and sides of pixels: every tie there is
            vertices = rng.integers(-4, 2 * np.array([*SIZE, 2]), (200, 3)) / 2
            yield vertices, rng.integers(0, 200, (150, 3))
        elif kind == "shared":
            yield rng.random((40, 3)).astype(np.float32) * np.float32(60), rng.integers(0, 40, (200, 3))
        else:
            ends = rng.random((80, 2, 3)) * [*SIZE, 1]
            corners = np.concatenate([ends, ends[:, :1] + [0.01, 0.02, 0]], axis=1)
            yield corners.reshape(-1, 3), np.arange(240).reshape(-1, 3)


def buffers(vertices: np.ndarray, triangles: np.ndarray, threads: int) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and contents of what each verb makes of a scene."""
    scene, view = (vertices, triangles), {"size": SIZE, "threads": threads}
    rng = np.random.default_rng(7)
    bytes_of = rng.integers(0, 256, (len(triangles), 4), dtype=np.uint8)
    floats_of = rng.random((len(vertices), 3)).astype(np.float32)
    for sampling in (*SAMPLINGS, "area", "outer", "inner"):
        yield f"coverage {sampling}", tl.coverage(*scene, sampling=sampling, **view)
        yield f"overdraw {sampling}", tl.overdraw(*scene, sampling=sampling, **view)
    for sampling in (*SAMPLINGS, "area"):
        for blend in ("replace", "over"):
            picture = tl.fill(*scene, bytes_of, per="triangle", blend=blend, sampling=sampling, **view)
            yield f"fill {blend} {sampling}", picture
        yield f"fill vertices {sampling}", tl.fill(*scene, floats_of, per="vertex", sampling=sampling, **view)
    for blend in ("add", "multiply", "max", "min"):
        yield f"fill {blend}", tl.fill(*scene, bytes_of, per="triangle", blend=blend, background=90, **view)
    for sampling in SAMPLINGS:
        frags = tl.rasterize(*scene, sampling=sampling, **view)
        yield f"triangle {sampling}", frags.triangle
        yield f"depth {sampling}", frags.depth
    for depth_test in ("greater", None):
        yield f"triangle {depth_test}", tl.rasterize(*scene, depth_test=depth_test, **view).triangle
    frags = tl.rasterize(*scene, **view)
    yield "barycentric", frags.barycentric()
    yield "interpolate", frags.interpolate(floats_of)
    for antialias in (False, True):
        yield f"wireframe {antialias}", tl.wireframe(*scene, antialias=antialias, **view)
        yield f"wireframe hidden {antialias}", tl.wireframe(*scene, antialias=antialias, depth=frags, **view)
    layers = tl.peel(*scene, **view)
    yield "peel", layers.triangle
    yield "peel depth", layers.depth
    yield "composite", tl.composite(layers, bytes_of, per="triangle", threads=threads)


def layers(threads: int) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and contents of the layers of a mesh, seen by a camera of exact numbers."""
    camera, other = (tl.Camera(VIEW + shift, PROJECTION) for shift in (0, 0.125 * np.eye(4, k=3)))
    vertices, triangles = tl.scenes.shape("octahedron")
    uv = np.arange(2 * len(vertices), dtype=np.float32).reshape(-1, 2) / 8
    mesh = tl.Mesh(vertices, triangles, uv=uv)
    names = [name for name in LAYERS if name != "flow"]  # which needs two cameras
    for sampling in ("center", "msaa4"):
        frags = tl.rasterize_mesh(mesh, camera, SIZE, sampling=sampling, threads=threads)
        yield f"mesh triangle {sampling}", frags.triangle
        yield f"mesh depth {sampling}", frags.depth
    found = tl.render_layers(mesh, camera, SIZE, layers=names, threads=threads)
    yield from ((f"layer {name}", found[name]) for name in found)
    yield "silhouette", tl.silhouette(mesh, other, SIZE, threads=threads)


def hashes(threads: int = 1) -> dict[str, dict[str, str]]:
    """Return the hashes, by the kind of the scenes and the name of the buffer."""
    found: dict[str, dict[str, str]] = {}
    for kind in (*PIXEL_SCENES, *CLIP_SCENES, *LATTICE):
        sums: dict[str, hashlib._Hash] = {}
        for vertices, triangles in scenes(kind):
            for name, buffer in buffers(vertices, triangles, threads):
                sums.setdefault(name, hashlib.sha256()).update(words_of(buffer))
        found[kind] = {name: each.hexdigest()[:12] for name, each in sums.items()}
    found["octahedron"] = {name: hashlib.sha256(words_of(buffer)).hexdigest()[:12] for name, buffer in layers(threads)}
    return found


def words_of(buffer: np.ndarray) -> bytes:
    """Return dtype, shape and contents; all NaN as one, for their bits are the CPU's."""
    if buffer.dtype.kind == "f":
        buffer = np.where(np.isnan(buffer), buffer.dtype.type(np.nan), buffer)
    return f"{buffer.dtype.str} {buffer.shape} ".encode() + np.ascontiguousarray(buffer).tobytes()


if __name__ == "__main__":
    FILE.write_text(json.dumps(hashes(), indent=1) + "\n")
