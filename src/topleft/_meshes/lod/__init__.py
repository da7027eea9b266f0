"""Levels of detail: coarser meshes, with bounds on how far they lie from the finest.

collapse.py  collapses edges, by fast-simplification, and tells what became of vertices and triangles
detail.py    chooses the coarsest level that a view cannot tell from the mesh
distance.py  bounds the two-sided Hausdorff distance of two surfaces
levels.py    defines `Levels`, which are kept with their mesh, and in a file
simplify.py  makes coarser levels of a mesh, with its attributes and a bound each
"""
