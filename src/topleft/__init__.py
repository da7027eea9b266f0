"""Exact, watertight triangle rasterization on the CPU: NumPy arrays in, NumPy arrays out."""

from topleft import scenes
from topleft._isa import build_info
from topleft.api import Rasterizer, coverage, fill, overdraw, rasterize, wireframe
from topleft.camera import Camera
from topleft.classic import bresenham_line
from topleft.errors import MeshError, TopleftError
from topleft.files import load, save_image
from topleft.fragments import Fragments
from topleft.memory import release_memory
from topleft.mesh import Mesh
from topleft.planner import Plan, plan
from topleft.render import render, visibility
from topleft.shade import shade
from topleft.silhouette import silhouette

__version__: str = build_info()["version"]

__all__ = [
    "Camera",
    "Fragments",
    "Mesh",
    "MeshError",
    "Plan",
    "Rasterizer",
    "TopleftError",
    "__version__",
    "bresenham_line",
    "build_info",
    "coverage",
    "fill",
    "load",
    "overdraw",
    "plan",
    "rasterize",
    "release_memory",
    "render",
    "save_image",
    "scenes",
    "shade",
    "silhouette",
    "visibility",
    "wireframe",
]
