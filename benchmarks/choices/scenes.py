"""Scenes that choices are measured on: geometry of many kinds, and the calls on it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.arrays import Arrays, blob_arrays, map_arrays, rounded, shrunk, sliver_arrays, strewn_arrays
from benchmarks.scenes.cases import HD, UHD, orbit_camera
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.matrices import orbit_view
from topleft.scenes import large_triangle


@dataclass(frozen=True)
class Scene:
    """Arrays, a picture, and a call."""

    name: str
    kind: str
    make: Callable[[], Arrays]
    size: tuple[int, int] = HD
    options: dict[str, Any] = field(default_factory=dict)
    verb: str = "rasterize"
    sampling: str = "center"
    threads: int | None = 1

    @property
    def arrays(self) -> Arrays:
        """Vertices and triangles, made once."""
        return made(self.make)

    @property
    def label(self) -> str:
        """The geometry and the call in words."""
        asked = self.verb if self.sampling == "center" else f"{self.verb} {self.sampling}"
        return f"{self.name}, {asked}"

    @property
    def has_depth(self) -> bool:
        """Whether vertices are in pixels with a depth."""
        return "transform" not in self.options and self.arrays[0].shape[1] == 3

    def colors(self) -> NDArray[np.uint8]:
        """A colour of four channels for each triangle."""
        n = len(self.arrays[1])
        return np.random.default_rng(3).integers(0, 256, (n, 4), np.uint8)

    def asked(self, **changes: Any) -> dict[str, Any]:
        """Return the options of the verb."""
        own = self.options | {"sampling": self.sampling, "threads": self.threads}
        return own | changes


@cache
def made(make: Callable[[], Arrays]) -> Arrays:
    """Call a maker once."""
    return make()


def forget_scenes() -> None:
    """Let go of all arrays."""
    made.cache_clear()


def inside_matrix(size: tuple[int, int]) -> NDArray[np.float64]:
    """Return clip from object for an eye within the sphere."""
    view = orbit_view([0, 0, 0], 0.7, 30.0, 20.0)
    return Camera.perspective(view, near=0.05, far=100.0).clip_from_world(size)


def geometries(scale: float) -> Iterator[Scene]:
    """Give scenes for `rasterize` with one sample a pixel; `scale`: of numbers of triangles and sides of the frame."""
    hd, uhd = ((max(16, round(scale * w)), max(16, round(scale * h))) for w, h in (HD, UHD))
    eye = {"transform": orbit_camera(hd)}
    n_of = lambda n: shrunk(n, scale)  # noqa: E731
    for label, n in (("1k", 1000), ("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)):
        yield Scene(f"mesh {label}", "mesh", lambda n=n: blob_arrays(n_of(n)), hd, eye)
    wide = lambda: blob_arrays(n_of(100_000), np.float64, np.int64)  # noqa: E731
    yield Scene("mesh 100k float64 int64", "mesh", wide, hd, eye)
    yield Scene(
        "mesh 100k in 3840x2160", "mesh", lambda: blob_arrays(n_of(100_000)), uhd, {"transform": orbit_camera(uhd)}
    )
    yield Scene(
        "mesh 1k in 64x64", "mesh", lambda: blob_arrays(n_of(1000)), (64, 64), {"transform": orbit_camera((64, 64))}
    )
    flat_eye = {"transform": np.diag([0.5, 0.9, 0.5, 1.0])}
    for label, n in (("10k", 10_000), ("1M", 1_000_000)):
        yield Scene(f"orthographic {label}", "orthographic", lambda n=n: blob_arrays(n_of(n)), hd, flat_eye)
    inside = {"transform": inside_matrix(hd)}
    for label, n in (("10k", 10_000), ("1M", 1_000_000)):
        yield Scene(f"clip-crossing {label}", "clip-crossing", lambda n=n: blob_arrays(n_of(n)), hd, inside)
    for n, px in ((1_000_000, 4), (200_000, 8), (20_000, 40), (5_000, 100), (1_000, 300), (100, 800), (50, 60)):
        yield Scene(f"random {n} of {px} px", "random", lambda n=n, px=px: strewn_arrays(n_of(n), px, hd), hd)
    for n, px in ((200_000, 8), (20_000, 40), (1_000, 300), (2_000, 8), (300, 60)):
        yield Scene(f"flat {n} of {px} px", "flat z", lambda n=n, px=px: strewn_arrays(n_of(n), px, hd, 0.5), hd)
    for n, px, side in ((2000, 20, 256), (1000, 40, 128), (50, 20, 64)):
        make = lambda n=n, px=px, side=side: strewn_arrays(n_of(n), px, (side, side), 0.5)  # noqa: E731
        yield Scene(f"flat {n} of {px} px in {side}x{side}", "flat z", make, (side, side))
    yield Scene("slivers 20000 of 100 px", "slivers", lambda: sliver_arrays(n_of(20_000), hd), hd)
    yield Scene(
        "partly outside 200000 of 20 px", "partly outside", lambda: strewn_arrays(n_of(200_000), 20, hd, None, 4.0), hd
    )
    few = lambda: strewn_arrays(n_of(200), 900, hd, None, 2.0)  # noqa: E731
    yield Scene("partly outside 200 of 900 px", "partly outside", few, hd)
    yield Scene("map of 100000", "map", lambda: map_arrays(n_of(100_000), hd), hd)
    yield Scene("whole pixels, map of 10000", "whole pixels", lambda: map_arrays(n_of(10_000), hd, is_whole=True), hd)
    whole = lambda: rounded(strewn_arrays(n_of(200_000), 8, hd))  # noqa: E731
    yield Scene("whole pixels, 200000 of 8 px", "whole pixels", whole, hd)
    yield Scene("one large", "single", lambda: large_triangle(*hd), hd)
    yield Scene("one large in 3840x2160", "single", lambda: large_triangle(*uhd), uhd)
    yield Scene("ten in 64x64", "single", lambda: strewn_arrays(10, 20, (64, 64)), (64, 64))


ASKED = (("rasterize", "center"), ("coverage", "center"))
"""Verbs and samplings that every scene is drawn with."""

ASKED_OF_SOME = (
    ("overdraw", "center"), ("fill", "center"),
    ("rasterize", "msaa4"), ("coverage", "msaa4"), ("fill", "msaa4"), ("coverage", "area"),
)  # fmt: skip
"""Of the smaller ones, too."""

MOST_TRIANGLES = 400_000


def scenes(scale: float = 1.0) -> Iterator[Scene]:
    """Give every geometry with its calls, those of one geometry one after the other."""
    for scene in geometries(scale):
        n = len(scene.arrays[1])
        for verb, sampling in ASKED + (ASKED_OF_SOME if n <= MOST_TRIANGLES else ()):
            yield replace(scene, verb=verb, sampling=sampling)
        forget_scenes()
