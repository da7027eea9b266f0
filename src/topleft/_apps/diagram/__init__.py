"""Diagrams: pictures of what a rasterizer decides.

pixel_grid.py  draws magnified pixels with the triangles on them, as SVG or PNG
"""
