"""Twins in Python of the classics and of the production walkers, written for reading.

A twin draws the pixels of its kernel in `topleft.methods.classics`, and tells a recorder of its steps.

_picture.py            holds what the twins share: a picture of counts, and spans that are clamped to it
bresenham_scanline.py  fills between two Bresenham lines, by generators
edge_increment.py      steps integer edge functions by additions, in whole numbers of any size
float_barycentric.py   asks all pixel centres of the bounding box at once for their float weights
lerp_scanline.py       interpolates the two edges of each row in float32
point_in_triangle.py   takes three cross products for all pixels of the bounding box at once
row_crossing.py        asks the three edges of each row where they cross it, in float32
walks.py               steps as the two production walkers do, in integers
zigzag.py              steps edge functions and turns round at the sides of the triangle
"""
