"""glTF 2.0 and GLB, read.

accessors.py  reads the arrays of a file
materials.py  reads materials, with their textures
reader.py     reads nodes, meshes, skins, morph targets, cameras
"""
