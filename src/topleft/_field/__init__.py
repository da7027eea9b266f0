"""Values and heights of meshes on a grid.

field.py  fields: values on an unstructured mesh, and heights of its surface, on a regular grid
grid.py   regular grids over data: which part of the plane a picture shows, in units of the data
"""
