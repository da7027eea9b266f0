"""Converts arrays, a mesh, a file, the name of a scene, or a copied link to the content of the page."""

from __future__ import annotations

import os
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import Mesh, as_mesh, failure_scenes, scenes
from topleft._apps.explore.session import Content
from topleft._core.base.arrays import as_checked_triangles, as_size, as_vertices
from topleft.annex.files import Budget, arrays_of
from topleft.errors import MeshError

MAX_SIDE_PX, MAX_TRIANGLES, MAX_VERTICES = 256, 1000, 3000
"""Limits of scenes that are drawn magnified."""

BASICS = {
    "shared-edge": "two triangles that share an edge through pixel centres",
    "wide": "a triangle wider than tall", "tall": "a triangle taller than wide",
    "vertical-edge": "a triangle with a vertical edge", "horizontal-edge": "a triangle with a horizontal edge",
    "right-angled": "a triangle with a right angle", "coincident-vertices": "two vertices in one place: no area",
    "single-point": "all vertices in one place", "horizontal-sliver": "a sliver that lies",
    "vertical-sliver": "a sliver that stands", "horizontal-line": "three vertices on a horizontal line",
    "vertical-line": "three vertices on a vertical line",
}  # fmt: skip
FANS = {
    "tight-fan": "16 thin triangles round one vertex, downwards",
    "tight-fan-sideways": "the same fan, to the right",
}
SPLITS = {
    "two-triangles": "a square cut along a diagonal", "square-of-four": "the same square cut into four",
    "composite-major-right": "a triangle cut at its middle vertex: flat bottom, flat top; long edge on the right",
    "composite-major-left": "the same, long edge on the left",
}  # fmt: skip
KINDS = {"gap": "a pixel that nobody draws", "overdraw": "a pixel drawn twice", "wrong": "another triangle shows"}
FAMILIES = {
    "any": "random triangles", "far": "vertices {} px away", "large": "triangles of {} px",
    "dense": "triangles of {} px", "fan": "a fan of {}", "hub": "a hub of {}", "edge": "an edge {} px from a centre",
}  # fmt: skip

SCENES: tuple[str, ...] = (*BASICS, *FANS, *SPLITS, *failure_scenes.FAILURE_SCENES)
"""Names of the scenes that are drawn magnified, in the order of the page."""


def scene_groups() -> list[list[Any]]:
    """The scenes in the order of the page: [heading, [[name, description], ...]] each."""
    failures = {
        name: f"{KINDS[failure.kind]}: {FAMILIES[failure.family].format(failure.value)}"
        for name, failure in failure_scenes.FAILURE_SCENES.items()
    }
    groups = {"basics": BASICS, "fans": FANS, "splits": SPLITS, "failures of methods": failures}
    return [[heading, [[name, text] for name, text in rows.items()]] for heading, rows in groups.items()]


SHARED_EDGE = {
    "vertices": [[2.5, 2.5], [13.5, 1.5], [3.5, 11.5], [12.5, 10.5]], "triangles": [[0, 1, 2], [1, 3, 2]],
    "size": [16, 13], "origin": [0, 0], "other": "bresenham_scanline", "exact": True,
}  # fmt: skip
"""The first scene of the page: an edge through pixel centres, and the classic to compare with."""

REDUCTION, THIN_PX = 10, 10
PRESET_SIZE = (scenes.TUTORIAL_SIZE[0] // REDUCTION, scenes.TUTORIAL_SIZE[1] // REDUCTION)
MARGIN_PX = 3


def content_of(vertices: Any, triangles: ArrayLike | None, size: Any) -> Content:
    """Return the content for the arguments of `topleft.explore`."""
    if vertices is None and triangles is None:
        return content_of_name(SCENES[0])
    if triangles is not None:
        return Content("pixels", magnified(vertices, triangles, size), name="arrays")
    if isinstance(vertices, (str, os.PathLike)):
        return content_of_name(os.fspath(vertices), size)
    mesh = as_mesh(vertices)
    return Content("mesh", mesh=mesh, name=getattr(mesh, "name", "") or "mesh")


def content_of_name(name: str, size: Any = None) -> Content:
    """Return the content for a word of the command line: a link, a scene, a shape or a file."""
    if "#" in name and (name.startswith(("#", "http://127.0.0.1:", "http://localhost:", "http://[::1]:"))):
        return Content(fragment=name.partition("#")[2])
    if name in SCENES:
        return Content("pixels", {**scene(name), "scene": name}, name=name)
    if name in scenes.SHAPES:
        return Content("mesh", mesh=Mesh(*scenes.shape(name)), name=name)
    path = Path(name)
    if path.suffix.lower() == ".npz":
        return content_of_arrays(path, size)
    if not path.exists():
        raise MeshError(f"{name}: neither a file nor a scene; scenes are {', '.join((*SCENES, *scenes.SHAPES))}")
    return Content("mesh", mesh=as_mesh(path), name=path.name)


def content_of_arrays(path: Path, size: Any) -> Content:
    """Return the content of an .npz file with `vertices`, `triangles` and maybe `size`: pixels, or a mesh."""
    try:
        with arrays_of(path, Budget(str(path))) as array:
            named = {name: array(name) for name in ("vertices", "triangles", "size")}
            arrays = {name: value for name, value in named.items() if value is not None}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        if isinstance(error, FileNotFoundError) or repr(str(path)) in str(error):
            raise
        raise MeshError(f"{path}: not an .npz file of arrays") from error
    if missing := [name for name in ("vertices", "triangles") if name not in arrays]:
        raise MeshError(f"{path}: must hold arrays vertices and triangles, {' and '.join(missing)} not among them")
    vertices, triangles = arrays["vertices"], arrays["triangles"]
    if size is None and "size" in arrays:
        size = tuple(arrays["size"].reshape(-1).tolist())
    if vertices.ndim == 2 and vertices.shape[1] == 3 and size is None:
        return Content("mesh", mesh=Mesh(vertices, triangles), name=path.name)
    return Content("pixels", magnified(vertices, triangles, size), name=path.name)


def magnified(vertices: ArrayLike, triangles: ArrayLike, size: Any) -> dict[str, Any]:
    """Return arrays as a state of the page, after every check."""
    points = as_vertices(vertices, has_transform=False).astype(np.float64)
    if points.shape[1] > 3:
        raise ValueError(f"vertices must be in pixels, (V, 2) or (V, 3), got shape {points.shape}")
    if not np.isfinite(points).all():
        row = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise ValueError(f"vertices must be finite, got {points[row].tolist()} in row {row}")
    corners = as_checked_triangles(triangles, len(points))
    if len(corners) > MAX_TRIANGLES or len(points) > MAX_VERTICES:
        raise ValueError(
            f"at most {MAX_TRIANGLES} triangles and {MAX_VERTICES} vertices are drawn magnified, got {len(corners)} "
            f"and {len(points)}: take those of a window"
        )
    origin = (0, 0)
    if size is None:
        origin, size = window_of(points)
    size = as_size(size, smallest=1)
    if max(size) > MAX_SIDE_PX:
        raise ValueError(f"size must be at most {MAX_SIDE_PX} pixels a side, got {size}: draw a window")
    return {"vertices": points.tolist(), "triangles": corners.tolist(), "size": list(size), "origin": list(origin)}


def window_of(points: NDArray[np.float64]) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return origin and size of the window that holds all vertices, with a margin."""
    if not len(points):
        return (0, 0), (16, 16)
    low = np.floor(points[:, :2].min(axis=0)) - MARGIN_PX
    high = np.ceil(points[:, :2].max(axis=0)) + MARGIN_PX
    x, y, width, height = (int(value) for value in (*low, *(high - low)))
    origin = (0 if 0 <= x + MARGIN_PX < 8 else x, 0 if 0 <= y + MARGIN_PX < 8 else y)
    return origin, (min(width + x - origin[0], MAX_SIDE_PX + 1), min(height + y - origin[1], MAX_SIDE_PX + 1))


def scene(name: str) -> dict[str, Any]:
    """Return a named scene as a state of the page.

    A single triangle of the tutorials is shown at a tenth of its size, except along an axis on which it is thin.
    """
    if name == SCENES[0]:
        return dict(SHARED_EDGE)
    if name in failure_scenes.FAILURE_SCENES:
        bad = failure_scenes.FAILURE_SCENES[name]
        origin, size = window_of(bad.shape()[0])
        if max(size) > PRESET_SIZE[0]:
            origin, size = bad.origin, bad.size
        wrong = [drawn for drawn in bad.got if drawn.subpixel_bits == bad.subpixel_bits] or list(bad.got)
        return {
            "vertices": [list(point) for point in bad.points], "triangles": [list(row) for row in bad.triangles],
            "size": list(size), "origin": list(origin), "method": wrong[0].method,
            "subpixel_bits": wrong[0].subpixel_bits, "exact": True,
        }  # fmt: skip
    if name not in scenes.TUTORIAL_SCENES:
        raise ValueError(f"scene must be one of {', '.join(SCENES)}, got {name[:40]!r}")
    vertices, triangles = scenes.TUTORIAL_SCENES[name]()
    low, extent = vertices.min(axis=0), vertices.max(axis=0) - vertices.min(axis=0)
    if len(triangles) == 1:
        thin = extent < THIN_PX
        vertices = np.where(thin, vertices - low + PRESET_SIZE[1] // 2, vertices / REDUCTION)
        size = PRESET_SIZE
    else:
        margin = 1 if name in FANS else MARGIN_PX  # at 1280 screen pixels a fan's pixels are 6 of them wide
        vertices = vertices - low + margin
        size = tuple((extent + 2 * margin).astype(int).tolist())
    return {"vertices": vertices.tolist(), "triangles": triangles.tolist(), "size": list(size), "origin": [0, 0]}
