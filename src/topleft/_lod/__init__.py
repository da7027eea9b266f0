"""Levels of detail: coarser meshes, with bounds on how far they lie from the finest.

collapse.py          collapse: a mesh with fewer triangles, by fast-simplification, and what its vertices and triangle
detail.py            detail: the coarsest level of a mesh that a view cannot tell from it, within a tolerance in pixel
level_attributes.py  what the vertices and triangles of a coarser level take over: normals, colours, texture coordinat
levels.py            levels of detail: a mesh and coarser ones in its stead, each with a bound on how far it lies from
simplify.py          `simplify`: coarser levels of a mesh, each with a bound on its distance from the mesh
surface_distance.py  how far two surfaces lie apart: bounds on the two-sided Hausdorff distance, that hold for every p
"""
