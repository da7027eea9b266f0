"""Exact, watertight triangle rasterization on the CPU: NumPy arrays in, NumPy arrays out."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, get_type_hints

from topleft import scenes
from topleft._base.memory import release_memory
from topleft._camera.camera import Camera
from topleft._camera.file_cameras import load_cameras
from topleft._camera.lens import FisheyeLens, OpenCVLens
from topleft._camera.viewpoints import turntable, viewpoints
from topleft._engine.isa import build_info
from topleft._field.field import field, height_map
from topleft._field.grid import Grid
from topleft._io.images import save_image
from topleft._io.load import load
from topleft._lod.detail import Detail, choose_detail
from topleft._lod.levels import Level, Levels
from topleft._lod.simplify import simplify
from topleft._model.environment import Environment
from topleft._model.light import Fog, Light
from topleft._model.material import Material
from topleft._model.mesh import Mesh
from topleft._model.points import Points
from topleft._model.texture import Texture
from topleft._plan.plan import Plan, plan
from topleft._points.points import PointFragments, points
from topleft._polygons.overlap import Overlap, overlap
from topleft._polygons.polygons import polygons
from topleft._raster.classic import bresenham_line
from topleft._raster.composite import composite
from topleft._raster.fragments import Fragments
from topleft._raster.peel import DepthLayers, peel
from topleft._raster.poses import FragmentsBatch
from topleft._raster.verbs import Rasterizer, coverage, fill, overdraw, rasterize, wireframe
from topleft._render.fragments import SceneDepthLayers, SceneFragments
from topleft._render.render import rasterize_mesh, render
from topleft._render.scene_shade import shade
from topleft._render.silhouette import silhouette
from topleft._scene.adapt import as_mesh
from topleft._scene.scene import Instance, Scene
from topleft.errors import ImageError, MeshError, MeshWarning, MissingPackageError, TopleftError

if TYPE_CHECKING:
    from topleft._batch.batch import render_batch
    from topleft._batch.jobs import Job
    from topleft._diagram.pixel_grid import pixel_grid
    from topleft._explore.open import Explorer, explore
    from topleft._render.transparent import render_transparent, visible_layers
    from topleft._render.view_layers import ViewLayers, render_layers
    from topleft._tiles.merge import merge
    from topleft._tiles.tiles import Tiles, Window, tiles

# What most programs do without is imported when it is asked for: a third of the time that the package takes.
_LATE = {
    "Explorer": "topleft._explore.open",
    "Job": "topleft._batch.jobs",
    "Tiles": "topleft._tiles.tiles",
    "ViewLayers": "topleft._render.view_layers",
    "Window": "topleft._tiles.tiles",
    "explore": "topleft._explore.open",
    "merge": "topleft._tiles.merge",
    "pixel_grid": "topleft._diagram.pixel_grid",
    "render_batch": "topleft._batch.batch",
    "render_layers": "topleft._render.view_layers",
    "render_transparent": "topleft._render.transparent",
    "tiles": "topleft._tiles.tiles",
    "visible_layers": "topleft._render.transparent",
}

__version__: str = build_info()["version"]

__all__ = [
    "Camera",
    "DepthLayers",
    "Detail",
    "Environment",
    "Explorer",
    "FisheyeLens",
    "Fog",
    "Fragments",
    "FragmentsBatch",
    "Grid",
    "ImageError",
    "Instance",
    "Job",
    "Level",
    "Levels",
    "Light",
    "Material",
    "Mesh",
    "MeshError",
    "MeshWarning",
    "MissingPackageError",
    "OpenCVLens",
    "Overlap",
    "Plan",
    "PointFragments",
    "Points",
    "Rasterizer",
    "Scene",
    "SceneDepthLayers",
    "SceneFragments",
    "Texture",
    "Tiles",
    "TopleftError",
    "ViewLayers",
    "Window",
    "__version__",
    "as_mesh",
    "bresenham_line",
    "build_info",
    "choose_detail",
    "composite",
    "coverage",
    "explore",
    "field",
    "fill",
    "height_map",
    "load",
    "load_cameras",
    "merge",
    "overdraw",
    "overlap",
    "peel",
    "pixel_grid",
    "plan",
    "points",
    "polygons",
    "rasterize",
    "rasterize_mesh",
    "release_memory",
    "render",
    "render_batch",
    "render_layers",
    "render_transparent",
    "save_image",
    "scenes",
    "shade",
    "silhouette",
    "simplify",
    "tiles",
    "turntable",
    "viewpoints",
    "visible_layers",
    "wireframe",
]


def _publish(value: Any) -> Any:
    """Let a class or function say that it is of `topleft`: its pickles, reprs and tracebacks name no room."""
    if isinstance(value, type):
        hints = get_type_hints(value)  # while the module that they are looked up in is that of their file
        value.__annotations__ = {name: hints[name] for name in vars(value).get("__annotations__", ())}
        if "__firstlineno__" in vars(value):  # Python 3.13 would show that line of this file as its source
            del value.__firstlineno__  # type: ignore[attr-defined]
    value.__module__ = __name__
    return value


def __getattr__(name: str) -> Any:
    if name not in _LATE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import_module(_LATE[name])
    for late, file in _LATE.items():  # what came along says so, too
        if hasattr(sys.modules.get(file), late):
            globals()[late] = _publish(getattr(sys.modules[file], late))
    return globals()[name]


def __dir__() -> list[str]:
    return sorted(__all__)


for _name in __all__:
    if callable(globals().get(_name)):
        _publish(globals()[_name])
