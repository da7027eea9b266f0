"""The methods of the literature as published: compiled kernels, and the same in Python, written for reading.

A kernel draws triangles over a picture; a twin does so in Python, and tells a recorder of its steps. The kernels are
compiled as one module, which has a stub.

_edges.pxi                  sets up integer edge functions, for the kernels that step them
_pure.py                    holds what the twins share: a picture of counts, and spans that are clamped to it
_target.pxi                 holds the buffer that kernels draw into
bresenham_scanline.pxi      fills between two Bresenham lines, walked from the top down together
bresenham_scanline_pure.py  does so with generators
classic_kernels.pyx         draws by the kernel of any of the methods
edge_increment.pxi          steps integer edge functions over the bounding box by additions
edge_increment_pure.py      does so in whole numbers of any size
float_barycentric.pxi       asks every pixel centre of the bounding box for its float weights
float_barycentric_pure.py   does so for the whole box at once
lerp_scanline.pxi           interpolates the two edges of each row in float32
lerp_scanline_pure.py       does so row by row
point_in_triangle.pxi       takes three cross products for every pixel of the bounding box
point_in_triangle_pure.py   does so for the whole box at once
row_crossing.pxi            asks the three edges of each row where they cross it, in float32
row_crossing_pure.py        does so row by row
zigzag.pxi                  steps edge functions and turns round at the sides of the triangle
zigzag_pure.py              does so in whole numbers of any size
"""
