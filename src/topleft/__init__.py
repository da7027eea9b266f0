"""Exact, watertight triangle rasterization on the CPU: NumPy arrays in, NumPy arrays out."""

from topleft import scenes
from topleft._isa import build_info
from topleft.api import Rasterizer, coverage, fill, overdraw, rasterize, wireframe
from topleft.batch import Job, render_batch
from topleft.camera import Camera
from topleft.classic import bresenham_line
from topleft.composite import composite
from topleft.depth_layers import DepthLayers, peel
from topleft.errors import MeshError, TopleftError
from topleft.files import load
from topleft.fragments import Fragments
from topleft.images import save_image
from topleft.memory import release_memory
from topleft.mesh import Mesh
from topleft.render import render, visibility
from topleft.scene import Instance, Scene
from topleft.scene_fragments import SceneDepthLayers, SceneFragments
from topleft.shade import shade
from topleft.silhouette import silhouette
from topleft.transparent import render_transparent, visible_layers
from topleft.view_layers import ViewLayers, render_layers

__version__: str = build_info()["version"]

__all__ = [
    "Camera",
    "DepthLayers",
    "Fragments",
    "Instance",
    "Job",
    "Mesh",
    "MeshError",
    "Rasterizer",
    "Scene",
    "SceneDepthLayers",
    "SceneFragments",
    "TopleftError",
    "ViewLayers",
    "__version__",
    "bresenham_line",
    "build_info",
    "composite",
    "coverage",
    "fill",
    "load",
    "overdraw",
    "peel",
    "rasterize",
    "release_memory",
    "render",
    "render_batch",
    "render_layers",
    "render_transparent",
    "save_image",
    "scenes",
    "shade",
    "silhouette",
    "visibility",
    "visible_layers",
    "wireframe",
]
