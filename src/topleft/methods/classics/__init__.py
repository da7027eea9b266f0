"""The methods of the literature as published, each a compiled kernel that draws triangles over a picture.

bresenham_scanline.pyx      fills between two Bresenham lines, walked from the top down together
edge_increment.pyx          steps integer edge functions over the bounding box by additions
float_barycentric.pyx       asks every pixel centre of the bounding box for its float weights
lerp_scanline.pyx           interpolates the two edges of each row in float32
point_in_triangle.pyx       takes three cross products for every pixel of the bounding box
row_crossing.pyx            asks the three edges of each row where they cross it, in float32
zigzag.pyx                  steps edge functions and turns round at the sides of the triangle
*_pure.py                   draw the same in Python, written for reading; edge_increment and zigzag have the reference
_pure.py                    holds what these share: a picture of counts, and spans that are clamped to it
_target.pxi                 holds the buffer that kernels draw into; every kernel includes it
_edges.pxi                  sets up integer edge functions; included by those that step them
bresenham_scanline.pyi      types the one kernel that is imported by name
"""
