"""What is drawn: meshes, scenes, materials, textures and lights.

adapt.py     makes a `Mesh` of the meshes and materials of other libraries
environment.py  defines `Environment`: light from all around, with its blurred levels
light.py     defines `Light` and `Fog`
material.py  defines `Material`: what a surface is made of
mesh.py      defines `Mesh`: vertices, triangles and their attributes, checked once
normals.py   computes the normals of triangles, vertices and creased corners, and the box round triangles
points.py    defines `Points`: a cloud of points, drawn as discs or squares
polygons.py  cuts polygons into triangles
scene.py     defines `Scene` and `Instance`: meshes placed in one world
texture.py   defines `Texture`: a picture as linear light, with its mip levels
"""
