"""The methods of the literature as published, as compiled kernels; `topleft.methods.twins` is the same in Python.

A kernel draws triangles over a picture. They are compiled as one module, which has a stub.

_edges.pxi              sets up integer edge functions, for the kernels that step them
_target.pxi             holds the buffer that kernels draw into
bresenham_scanline.pxi  fills between two Bresenham lines, walked from the top down together
classic_kernels.pyx     draws by the kernel of any of the methods
edge_increment.pxi      steps integer edge functions over the bounding box by additions
float_barycentric.pxi   asks every pixel centre of the bounding box for its float weights
lerp_scanline.pxi       interpolates the two edges of each row in float32
point_in_triangle.pxi   takes three cross products for every pixel of the bounding box
row_crossing.pxi        asks the three edges of each row where they cross it, in float32
zigzag.pxi              steps edge functions and turns round at the sides of the triangle
"""
