"""glTF 2.0 and GLB, read.

accessors.py   reads the arrays of a file
animations.py  moves nodes to where animations have them at a time
materials.py   reads materials, with their textures
reader.py      reads nodes, meshes, skins, morph targets, cameras
"""
