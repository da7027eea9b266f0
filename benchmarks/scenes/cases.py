"""The registry of cases: the scene, the number format, and the outputs of each.

Scenes come from `topleft.scenes`; this file names them and gives them a camera. Output: a `Scene` of plain arrays,
the same for every contestant, which travels to the children as files.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

HD = (1920, 1080)
UHD = (3840, 2160)

TASKS = {
    "visibility": "triangle id and depth of a mesh in object space: transform, clear and draw",
    "depth-2d": "triangle id and depth of triangles in pixels: snap, clear and draw",
    "mask": "which pixels are covered",
    "smooth": "how much of each pixel is covered, 0 to 255",
    "fill": "flat colours in painter's order",
    "labels": "triangle id in painter's order",
    "smooth-fill": "flat opaque colours in painter's order on black, anti-aliased",
    "empty": "a call that draws nothing",
    "views": "shaded pictures of a mesh from all sides, into memory",
    "views-png": "shaded pictures of a mesh from all sides, into PNG files",
}


ARRAYS = ("vertices", "triangles", "transform", "colors", "views", "normals")


@dataclass(frozen=True)
class Scene:
    """A scene: arrays, and the outputs to make.

    With many views `views` (N, 4, 4) are the eye from object of each, and `transform` is the clip from eye of all.
    """

    task: str
    size: tuple[int, int]
    vertices: NDArray[Any]
    triangles: NDArray[Any]
    transform: NDArray[np.float64] | None = None
    colors: NDArray[np.uint8] | None = None
    cull: str = "none"
    views: NDArray[np.float64] | None = None
    normals: NDArray[np.float32] | None = None

    def snapped(self) -> NDArray[np.float64]:
        """Return vertices in pixels, and their depth where they have one, after the snap to 1/256 pixel."""
        from topleft.methods.reference.integers import projected, snapped

        if self.transform is None:
            return snapped(self.vertices)
        return projected(self.vertices, self.size, transform=self.transform)

    def save(self, folder: Path) -> None:
        """Write the arrays, for a child to load."""
        facts = {"task": self.task, "size": self.size, "cull": self.cull}
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "scene.json").write_text(json.dumps(facts))
        for name in ARRAYS:
            if (array := getattr(self, name)) is not None:
                np.save(folder / f"{name}.npy", array)

    @classmethod
    def load(cls, folder: Path) -> Scene:
        """Read the files of `save`."""
        facts = json.loads((folder / "scene.json").read_text())
        arrays = {name: np.load(folder / f"{name}.npy") for name in ARRAYS if (folder / f"{name}.npy").exists()}
        return cls(task=facts["task"], size=tuple(facts["size"]), cull=facts["cull"], **arrays)


@dataclass(frozen=True)
class Case:
    """A scene with a name.

    `beside` names a case whose scene topleft also draws here, in turn with this one, so that the two compare.
    """

    name: str
    task: str
    make: Callable[[], Scene]
    beside: str | None = None


CASES: dict[str, Case] = {}
"""All cases by name, in the order of the report."""


def add(case: Case) -> None:
    """Register a case."""
    if case.name in CASES:
        raise ValueError(f"two cases are called {case.name}")
    CASES[case.name] = case


def orbit_camera(size: tuple[int, int]) -> NDArray[np.float64]:
    """Clip from object (4, 4): the camera of all mesh scenes, 3 units from the origin, 30 degrees round, 20 up."""
    from topleft._meshes.camera.camera import Camera
    from topleft._meshes.camera.matrices import orbit_view

    return Camera.perspective(orbit_view([0, 0, 0], 3.0, 30.0, 20.0), near=0.1, far=100.0).clip_from_world(size)


def blob_scene(n_triangles: int, *, wide: bool = False, cull: str = "back", size: tuple[int, int] = HD) -> Scene:
    """The bumpy sphere under the orbit camera, in float32 and int32, or `wide`: in float64 and int64."""
    from topleft import scenes

    vertices, triangles = scenes.blob(n_triangles)
    formats = (np.float64, np.int64) if wide else (np.float32, np.int32)
    return Scene(
        "visibility", size, vertices.astype(formats[0]), triangles.astype(formats[1]), orbit_camera(size), cull=cull
    )


def random_scene(task: str, n_triangles: int, size_px: float, size: tuple[int, int] = HD) -> Scene:
    """Triangles strewn over the frame, as they come: float64 pixels."""
    from topleft import scenes

    vertices, triangles, colors = scenes.random_triangles(n_triangles, size_px, *size)
    if task in ("fill", "smooth-fill"):
        return Scene(task, size, np.ascontiguousarray(vertices[:, :2]), triangles, colors=colors)
    return Scene(task, size, vertices, triangles)


def large_scene(task: str = "mask", size: tuple[int, int] = UHD) -> Scene:
    """One triangle over about half of the frame."""
    from topleft import scenes

    colors = None if task == "mask" else np.array([[200, 120, 40]], np.uint8)
    return Scene(task, size, *scenes.large_triangle(*size), colors=colors)


def frames_scene(n: int, *, is_near_first: bool, size: tuple[int, int] = HD) -> Scene:
    """Triangles that each cover the whole frame, one behind the other, a little inclined: float32 pixels."""
    width, height = size
    order = np.arange(n) if is_near_first else np.arange(n)[::-1]
    depth = (order[:, None] + np.array([0.1, 0.6, 0.4])) / n
    corners = np.tile([[-10.0, -10.0], [2 * width + 20, -10], [-10, 2 * height + 20]], (n, 1, 1))
    vertices = np.concatenate([corners, depth[:, :, None]], axis=2).reshape(-1, 3).astype(np.float32)
    return Scene("depth-2d", size, vertices, np.arange(3 * n, dtype=np.int32).reshape(-1, 3))


def planar_scene(task: str = "labels", n_points: int = 100_000, *, is_white: bool = False) -> Scene:
    """A mesh that tiles the frame."""
    from topleft import scenes

    vertices, triangles = scenes.planar_mesh(n_points, *HD)
    colors = None
    if task == "smooth-fill":
        colors = np.random.default_rng(7).integers(0, 256, (len(triangles), 3), np.uint8)
        colors = np.full_like(colors, 255) if is_white else colors
    return Scene(task, HD, vertices, triangles, colors=colors)


def singles_scene(n_across: int = 15, n_down: int = 10, size_px: int = 40, cell_px: int = 64) -> Scene:
    """White triangles in the cells of a grid, anywhere within a pixel, so that none meets another."""
    from topleft import scenes

    n = n_across * n_down
    vertices, triangles, _ = scenes.random_triangles(n, size_px, 0, 0)
    cell = np.stack([np.arange(n) % n_across, np.arange(n) // n_across], axis=-1)
    center_px = (cell + 0.5) * cell_px + np.random.default_rng(7).uniform(-0.5, 0.5, (n, 2))
    corners = np.ascontiguousarray(vertices[:, :2] + np.repeat(center_px, 3, axis=0))
    size = (n_across * cell_px, n_down * cell_px)
    return Scene("smooth-fill", size, corners, triangles, colors=np.full((n, 3), 255, np.uint8))


def views_scene(task: str, n_triangles: int, n_views: int, size: tuple[int, int]) -> Scene:
    """The bumpy sphere from `n_views` sides, all round, 20 degrees up, in float32 and int32."""
    from topleft import Mesh, scenes
    from topleft._meshes.camera.camera import Camera

    vertices, triangles = scenes.blob(n_triangles)
    mesh = Mesh(vertices.astype(np.float32), triangles)
    angles = [360 * i / n_views for i in range(n_views)]
    cameras = [Camera.framing(mesh, azimuth_deg=angle, elevation_deg=20, aspect=size[0] / size[1]) for angle in angles]
    return Scene(
        task, size, mesh.vertices, mesh.triangles, cameras[0].projection, cull="back",
        views=np.stack([camera.view for camera in cameras]), normals=mesh.vertex_normals().astype(np.float32),
    )  # fmt: skip


def empty_scene(size: tuple[int, int] = (64, 64)) -> Scene:
    """No triangle on a frame so small that clearing it takes no time."""
    return Scene("empty", size, np.zeros((0, 2)), np.zeros((0, 3), np.int32))


def _register() -> None:
    blobs = {"10k": 10_000, "100k": 100_000, "1m": 1_000_000, "10m": 10_000_000}
    for label, n in blobs.items():
        add(Case(f"blob-{label}", "visibility", lambda n=n: blob_scene(n)))
    for label, n in blobs.items():
        name = f"blob-{label}"
        add(Case(f"{name}-f64", "visibility", lambda n=n: blob_scene(n, wide=True), beside=name))
    for label, n in blobs.items():
        add(Case(f"blob-{label}-nocull", "visibility", lambda n=n: blob_scene(n, cull="none")))
    for n, px in ((1000, 400), (10_000, 100), (100_000, 10), (1_000_000, 4)):
        make = lambda n=n, px=px: random_scene("depth-2d", n, px)  # noqa: E731
        add(Case(f"random-{n}x{px}", "depth-2d", make))
    for name, is_near_first in (("near", True), ("far", False)):
        make = lambda near=is_near_first: frames_scene(40, is_near_first=near)  # noqa: E731
        add(Case(f"frames-{name}-first", "depth-2d", make))
    add(Case("large-4k", "mask", large_scene))
    for n, px in ((1000, 300), (20_000, 40), (200_000, 8)):
        make = lambda n=n, px=px: random_scene("fill", n, px)  # noqa: E731
        add(Case(f"fill-{n}x{px}", "fill", make))
    add(Case("fill-4k", "fill", lambda: large_scene("fill")))
    add(Case("labels-planar", "labels", planar_scene))
    for n, px in ((1000, 300), (20_000, 40), (200_000, 8)):
        add(Case(f"smooth-{n}x{px}", "smooth-fill", lambda n=n, px=px: random_scene("smooth-fill", n, px)))
    add(Case("smooth-planar", "smooth-fill", lambda: planar_scene("smooth-fill")))
    add(Case("smooth-4k", "smooth-fill", lambda: large_scene("smooth-fill")))
    add(Case("smooth-singles", "smooth-fill", singles_scene))
    add(Case("smooth-seams", "smooth-fill", lambda: planar_scene("smooth-fill", 2000, is_white=True)))
    add(Case("empty", "empty", empty_scene))
    add(Case("tiny", "visibility", lambda: blob_scene(200, size=(64, 48))))
    add(Case("tiny-fill", "fill", lambda: random_scene("fill", 20, 12, (64, 48))))
    add(Case("tiny-smooth", "smooth-fill", lambda: singles_scene(2, 2, 12, 20)))


_register()

TRIALS = ("tiny", "tiny-fill", "tiny-smooth")
"""Cases that try the machinery out; they run only when named."""
