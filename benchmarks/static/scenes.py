"""Scenes that do not change from picture to picture: meshes seen whole, in part and from inside, and many instances."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import topleft as tl
from benchmarks.scenes.arrays import Arrays, blob_arrays, grid_triangles, shrunk
from benchmarks.scenes.cases import HD

Look = Callable[[Arrays, tuple[int, int]], tl.Camera]
"""From a mesh and the size of its picture to a camera."""

SMALL = (512, 512)
BLOBS = (("10M", 10_000_000), ("1M", 1_000_000), ("300k", 300_000), ("100k", 100_000), ("30k", 30_000), ("10k", 10_000))
MOST_IN_SMALL = 300_000
"""Triangles of the largest blob that is drawn in the small picture, too."""
ZOOMS = (("half of it", 0.5), ("20 % of it", 0.2), ("5 % of it", 0.05))
EYE = (0.0, 0.0, 3.0)
CULLS = ("none", "back")
DEPTHS = {"near": 0.01, "far": 100.0}
LOOKED_THROUGH = 100_000
"""Triangles, at most, that the share in a frustum is counted of."""


@dataclass(frozen=True)
class StaticScene:
    """A mesh or instances of one, its view, and its call."""

    model: str
    kind: str
    view: str
    make: Callable[[], Arrays]
    look: Look
    size: tuple[int, int] = HD
    cull: str = "none"
    sampling: str = "center"
    verb: str = "rasterize"
    places: tuple[tuple[float, float, float], ...] = ()
    """Where the instances stand; none: the mesh alone."""

    @property
    def label(self) -> str:
        """The scene and its call in words."""
        asked = [self.verb, *([self.sampling] if self.sampling != "center" else [])]
        width, height = self.size
        return f"{self.model}, {self.view}, cull {self.cull}, {' '.join(asked)}, {width}x{height}"

    @property
    def arrays(self) -> Arrays:
        """Vertices and triangles of the mesh."""
        return made(self.make)

    @property
    def camera(self) -> tl.Camera:
        """The camera."""
        return seen(self.look, self.make, self.size)

    def fresh(self) -> tl.Mesh | tl.Scene:
        """Return the mesh, or its instances, as if never drawn, of the same arrays."""
        mesh = tl.Mesh(*self.arrays)
        return tl.Scene([(mesh, shifted(place)) for place in self.places]) if self.places else mesh


@lru_cache(maxsize=1)
def made(make: Callable[[], Arrays]) -> Arrays:
    """Return the result of a maker; that of the last one is kept."""
    return make()


@lru_cache(maxsize=8)
def seen(look: Look, make: Callable[[], Arrays], size: tuple[int, int]) -> tl.Camera:
    """Return the camera of a view; those of the last mesh are kept, for each way to cull has the same."""
    return look(made(make), size)


def shifted(place: Sequence[float]) -> NDArray[np.float64]:
    """Return the matrix that moves a mesh."""
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return matrix


def share_in_view(points: NDArray[np.float64], triangles: NDArray[Any], clip: NDArray[np.float64]) -> float:
    """Return the share of triangles that no plane of the frustum excludes; some of many."""
    some = triangles[:: max(1, len(triangles) // LOOKED_THROUGH)]
    corners = points[some].astype(np.float64) @ clip[:, :3].T + clip[:, 3]
    x, y, z, w = np.moveaxis(corners, -1, 0)
    beyond = [(side > w).all(axis=1) for side in (x, -x, y, -y, z, -z)]
    return 1.0 - float(np.mean(np.any(beyond, axis=0)))


def looking(eye: Sequence[float], target: Sequence[float] = (0, 0, 0), fov_y_deg: float = 45.0) -> Look:
    """Return the maker of a fixed camera."""
    camera = tl.Camera.look_at(eye, target, fov_y_deg=fov_y_deg, **DEPTHS)
    return lambda *_: camera


def zoomed(share: float, arrays: Arrays, size: tuple[int, int]) -> tl.Camera:
    """Return a camera that looks at the origin with the field of view that a share of the triangles lies in."""
    low, high = 0.01, 120.0
    for _ in range(14):  # to a hundredth of a degree
        middle = (low + high) / 2
        clip = tl.Camera.look_at(EYE, fov_y_deg=middle, **DEPTHS).clip_from_world(size)
        low, high = (low, middle) if share_in_view(*arrays, clip) > share else (middle, high)
    return tl.Camera.look_at(EYE, fov_y_deg=(low + high) / 2, **DEPTHS)


VIEWS: dict[str, Look] = {
    "whole": looking(EYE),
    **{name: partial(zoomed, share) for name, share in ZOOMS},
    "inside": looking((0, 0, 0), (0, 0, 1)),
}
"""Ways to look at a closed mesh of radius 1 about."""
HILLS_VIEWS = {"above": looking((0, 3, 0.01)), "grazing": looking((0, 0.16, 1.1))}
SOUP_VIEWS = {"whole": looking((0, 0, 4.5)), "inside": VIEWS["inside"]}


def field_arrays(n: int) -> Arrays:
    """Return hills, an open mesh over [-1, 1] x [-1, 1]; y is up."""
    side = max(2, round((n / 2) ** 0.5) + 1)
    x, z = np.meshgrid(*[np.linspace(-1, 1, side)] * 2)
    y = 0.1 * np.sin(9 * x) * np.cos(7 * z) + 0.02 * np.sin(40 * x + 31 * z)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32), grid_triangles(side, side)


def soup_arrays(n: int, reach: float) -> Arrays:
    """Return triangles anywhere in a cube, turned anyhow, in no order, with corners of their own: nothing to sort."""
    rng = np.random.default_rng(5)
    corners = rng.uniform(-1, 1, (n, 1, 3)) + rng.uniform(-reach, reach, (n, 3, 3))
    return corners.reshape(-1, 3).astype(np.float32), np.arange(3 * n, dtype=np.int32).reshape(-1, 3)


@lru_cache(maxsize=8)
def file_arrays(path: Path) -> Arrays:
    """Return the mesh of a file, moved to the origin and scaled to a radius of 1."""
    mesh = tl.load(path)
    low, high = mesh.bounds
    points = (mesh.vertices - (low + high) / 2) / (np.linalg.norm(high - low) / 2)
    return points.astype(np.float32), mesh.triangles


def scenes(scale: float = 1.0, files: Sequence[Path] = ()) -> Iterator[StaticScene]:
    """Give all scenes, those of a mesh one after the other; `scale`: of triangles and of the sides of pictures."""
    hd, small = (tuple(max(16, round(scale * side)) for side in size) for size in (HD, SMALL))
    for name, n in BLOBS:
        yield from closed_scenes(f"blob {name}", "blob", partial(blob_arrays, shrunk(n, scale)), hd)
        if n <= MOST_IN_SMALL:
            yield from closed_scenes(f"blob {name}", "blob", partial(blob_arrays, shrunk(n, scale)), small)
    for path in files:
        yield from closed_scenes(path.stem, "file", partial(file_arrays, path), hd)
    for name, n in (("1M", 1_000_000), ("100k", 100_000)):
        yield from culled_scenes(f"hills {name}", "hills", partial(field_arrays, shrunk(n, scale)), hd, HILLS_VIEWS)
    for name, n, reach in (("small, 1M", 1_000_000, 0.01), ("small, 100k", 100_000, 0.02), ("large, 30k", 30_000, 0.3)):
        make = partial(soup_arrays, shrunk(n, scale), reach)
        yield from culled_scenes(f"soup, {name}", "soup", make, hd, SOUP_VIEWS)
    yield from instance_scenes("blob 70k", partial(blob_arrays, shrunk(70_000, scale)), hd)
    for path in files:
        yield from instance_scenes(path.stem, partial(file_arrays, path), hd)


def closed_scenes(model: str, kind: str, make: Callable[[], Arrays], size: Any) -> Iterator[StaticScene]:
    """Give the scenes of a closed mesh; some are lit, too."""
    for view, camera in VIEWS.items():
        for cull in CULLS:
            yield StaticScene(model, kind, view, make, camera, size, cull)
        if view in ("whole", "20 % of it") and model in ("blob 1M", "blob 100k") and size != SMALL:
            yield StaticScene(model, kind, view, make, camera, size, verb="render")


def culled_scenes(
    model: str, kind: str, make: Callable[[], Arrays], size: Any, views: dict[str, Look]
) -> Iterator[StaticScene]:
    """Give the scenes of a mesh from some sides, with each way to cull."""
    for view, look in views.items():
        for cull in CULLS:
            yield StaticScene(model, kind, view, make, look, size, cull)


def instance_scenes(model: str, make: Callable[[], Arrays], size: Any) -> Iterator[StaticScene]:
    """Give instances of a mesh of radius 1 about: 200 in rows, 16 side by side, 200 spread out."""
    rows = tuple((1.3 * (i - 4.5), 0.0, -1.3 * k) for k in range(20) for i in range(10))
    beside = tuple((2.0 * (i - 7.5), 0.0, 0.0) for i in range(16))
    spread = tuple((2.0 * (i - 9.5), 2.0 * (k - 4.5), 0.0) for k in range(10) for i in range(20))
    seen = (
        ("200 in rows", rows, looking((0, 0.2, 7.0), fov_y_deg=60)),
        ("16 side by side", beside, looking((0, 0, 22.0))),
        ("200 spread out", spread, looking((0, 0, 30.0))),
    )
    for view, places, camera in seen:
        for sampling in ("center", "msaa4"):
            yield StaticScene(model, "instances", view, make, camera, size, sampling=sampling, places=places)
        yield StaticScene(model, "instances", view, make, camera, size, "back", places=places)
        yield StaticScene(model, "instances", view, make, camera, size, verb="render", places=places)
