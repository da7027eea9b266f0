"""Exact, watertight triangle rasterization on the CPU: NumPy arrays in, NumPy arrays out."""

from topleft._isa import build_info
from topleft.api import Rasterizer, coverage, fill, overdraw, rasterize
from topleft.fragments import Fragments

__version__: str = build_info()["version"]

__all__ = [
    "Fragments",
    "Rasterizer",
    "__version__",
    "build_info",
    "coverage",
    "fill",
    "overdraw",
    "rasterize",
]
