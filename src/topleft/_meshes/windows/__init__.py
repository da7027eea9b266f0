"""Rasters of any size: which triangles each window needs, and its pixels."""
