"""Exact, watertight triangle rasterization on the CPU: NumPy arrays in, NumPy arrays out."""

from topleft import scenes
from topleft._isa import build_info
from topleft.adapt import as_mesh
from topleft.api import Rasterizer, coverage, fill, overdraw, rasterize, wireframe
from topleft.batch import Job, render_batch
from topleft.camera import Camera
from topleft.classic import bresenham_line
from topleft.errors import MeshError, TopleftError
from topleft.field import field, height_map
from topleft.files import load
from topleft.fragments import Fragments
from topleft.grid import Grid
from topleft.images import save_image
from topleft.lens import FisheyeLens, OpenCVLens
from topleft.memory import release_memory
from topleft.mesh import Mesh
from topleft.render import rasterize_mesh, render
from topleft.shade import shade
from topleft.silhouette import silhouette
from topleft.viewpoints import turntable, viewpoints

__version__: str = build_info()["version"]

__all__ = [
    "Camera",
    "FisheyeLens",
    "Fragments",
    "Grid",
    "Job",
    "Mesh",
    "MeshError",
    "OpenCVLens",
    "Rasterizer",
    "TopleftError",
    "__version__",
    "as_mesh",
    "bresenham_line",
    "build_info",
    "coverage",
    "field",
    "fill",
    "height_map",
    "load",
    "overdraw",
    "rasterize",
    "rasterize_mesh",
    "release_memory",
    "render",
    "render_batch",
    "save_image",
    "scenes",
    "shade",
    "silhouette",
    "turntable",
    "viewpoints",
    "wireframe",
]
