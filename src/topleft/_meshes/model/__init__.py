"""What is drawn: meshes, points, materials, textures and lights.

environment.py  defines `Environment`: light from all around, with its blurred levels
from_trimesh.py  makes a `Mesh` of a geometry of trimesh, with its material
joined.py    places the parts of a mesh and joins them to one
light.py     defines `Light` and `Fog`
material.py  defines `Material`: what a surface is made of
mesh.py      defines `Mesh`: vertices, triangles and their attributes, checked once
normals.py   computes normals of triangles, vertices and creased corners, and what a matrix makes of points and normals
points.py    defines `Points`: a cloud of points, drawn as discs or squares
polygons.py  cuts polygons into triangles
texture.py   defines `Texture`: a picture as linear light, with its mip levels
"""
