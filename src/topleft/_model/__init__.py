"""What is drawn: meshes, scenes, materials, textures and lights, and meshes of other libraries.

adapt.py     adapters: the meshes of other libraries, told by their attributes, as a `Mesh`; none of those libraries i
imported.py  materials of files: what trimesh reads of MTL and glTF, as `Material`, and OBJ text cut by material
environment.py  light from all around: a colour, a sky over a ground, a picture blurred once for every roughness
light.py     lights: directions and points that light comes from, and the depth cue; values, checked once
material.py  materials: what a surface is made of, as values
mesh.py      A triangle mesh as arrays: positions, indices, and what else is known of its surface; checked once, here
normals.py   faces: normals of triangles and of vertices, the side that these are on, the box round a mesh
scene.py     scenes: meshes that stand in one world, each placed by a matrix, as often as wanted
texture.py   textures: pictures of linear light and their halves, made once from an sRGB picture
"""
