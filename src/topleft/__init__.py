"""Exact, watertight triangle rasterization on the CPU: NumPy arrays in, NumPy arrays out."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from topleft import scenes
from topleft._isa import build_info
from topleft.adapt import as_mesh
from topleft.api import Rasterizer, coverage, fill, overdraw, rasterize, wireframe
from topleft.camera import Camera
from topleft.classic import bresenham_line
from topleft.composite import composite
from topleft.depth_layers import DepthLayers, peel
from topleft.detail import Detail, choose_detail
from topleft.errors import MeshError, TopleftError
from topleft.field import field, height_map
from topleft.files import load
from topleft.fragments import Fragments
from topleft.grid import Grid
from topleft.images import save_image
from topleft.lens import FisheyeLens, OpenCVLens
from topleft.levels import Level, Levels
from topleft.light import Fog, Light
from topleft.material import Material
from topleft.memory import release_memory
from topleft.mesh import Mesh
from topleft.planner import Plan, plan
from topleft.render import rasterize_mesh, render
from topleft.scene import Instance, Scene
from topleft.scene_fragments import SceneDepthLayers, SceneFragments
from topleft.shade import shade
from topleft.silhouette import silhouette
from topleft.simplify import simplify
from topleft.texture import Texture
from topleft.viewpoints import turntable, viewpoints

if TYPE_CHECKING:
    from topleft.batch import Job, render_batch
    from topleft.transparent import render_transparent, visible_layers
    from topleft.view_layers import ViewLayers, render_layers

# What most programs do without is imported when it is asked for: a third of the time that the package takes.
_LATE = {
    "Job": "topleft.batch",
    "ViewLayers": "topleft.view_layers",
    "render_batch": "topleft.batch",
    "render_layers": "topleft.view_layers",
    "render_transparent": "topleft.transparent",
    "visible_layers": "topleft.transparent",
}

__version__: str = build_info()["version"]

__all__ = [
    "Camera",
    "DepthLayers",
    "Detail",
    "FisheyeLens",
    "Fog",
    "Fragments",
    "Grid",
    "Instance",
    "Job",
    "Level",
    "Levels",
    "Light",
    "Material",
    "Mesh",
    "MeshError",
    "OpenCVLens",
    "Plan",
    "Rasterizer",
    "Scene",
    "SceneDepthLayers",
    "SceneFragments",
    "Texture",
    "TopleftError",
    "ViewLayers",
    "__version__",
    "as_mesh",
    "bresenham_line",
    "build_info",
    "choose_detail",
    "composite",
    "coverage",
    "field",
    "fill",
    "height_map",
    "load",
    "overdraw",
    "peel",
    "plan",
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
    "turntable",
    "viewpoints",
    "visible_layers",
    "wireframe",
]


def __getattr__(name: str) -> Any:
    if name not in _LATE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_LATE[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
