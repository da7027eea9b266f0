"""Hashes of what every verb, sampling and layer makes of 60 seeded scenes, and the file of those that must stay.

`python tests/support/golden.py` writes the file anew, with one hash for each buffer of all scenes: only for a change
that is to change pictures, and that says so.
"""

import hashlib
import json
import pathlib
from collections.abc import Iterator
from typing import get_args

import numpy as np

import topleft as tl
from topleft._core.base.options import LAYER_NAMES
from topleft.testing import HARD_SCENES, SIZE, hard_scenes, words_of
from topleft.typing import SamplesOption

FILE = pathlib.Path(__file__).with_name("golden.json")
SAMPLINGS = get_args(SamplesOption)

VIEW = np.array([[1.0, 0, 0, 0], [0, 0.75, 0.5, 0], [0, -0.5, 0.75, -3], [0, 0, 0, 1]])
PROJECTION = np.array([[1.5, 0, 0, 0], [0, 2.0, 0, 0], [0, 0, -1.5, -1.0], [0, 0, -1, 0]])


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
    names = [name for name in LAYER_NAMES if name != "flow"]  # which needs two cameras
    for sampling in ("center", "msaa4"):
        frags = tl.rasterize_mesh(mesh, camera, SIZE, sampling=sampling, threads=threads)
        yield f"mesh triangle {sampling}", frags.triangle
        yield f"mesh depth {sampling}", frags.depth
    found = tl.render_layers(mesh, camera, SIZE, layers=names, threads=threads)
    yield from ((f"layer {name}", found[name]) for name in found)
    yield "silhouette", tl.silhouette(mesh, other, SIZE, threads=threads)


def hashes(threads: int = 1) -> dict[str, str]:
    """Return the hashes by the name of the buffer."""
    sums: dict[str, hashlib._Hash] = {}
    for kind in HARD_SCENES:
        for vertices, triangles in hard_scenes(kind):
            for name, buffer in buffers(vertices, triangles, threads):
                sums.setdefault(name, hashlib.sha256()).update(words_of(buffer))
    for name, buffer in layers(threads):
        sums[name] = hashlib.sha256(words_of(buffer))
    return {name: each.hexdigest()[:12] for name, each in sums.items()}


if __name__ == "__main__":
    FILE.write_text(json.dumps(hashes(), indent=1) + "\n")
