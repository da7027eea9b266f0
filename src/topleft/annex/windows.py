"""Draws rasters window by window: triangles in blocks, extents, sizes of windows."""

from topleft._meshes.windows.blocks import open_triangles
from topleft._meshes.windows.raster import INDEX_BYTES, WINDOW, WindowedRaster, extent_of

__all__ = ["INDEX_BYTES", "WINDOW", "WindowedRaster", "extent_of", "open_triangles"]
