"""Values and heights of meshes on a grid.

field.py  resamples values of a mesh, and the heights of its surface, on a regular grid
grid.py   defines `Grid`: which part of the plane a picture shows, in units of the data
"""
