"""Disk: meshes and pictures, read and written.

foreign.py         reads meshes by trimesh
gltf.py            reads glTF and GLB: nodes, meshes, skins, morph targets, cameras
gltf_accessors.py  reads the arrays of glTF files
gltf_materials.py  reads the materials of glTF files
images.py          writes pictures and buffers to files
layer_files.py     writes layers to files: as they are, or as scaled integers in PNG
load.py            reads a mesh from a file of any format
mtl.py             reads material libraries of OBJ files
notes.py           collects what a mesh lacks of its file, and warns of it
obj.py             reads OBJ
ply.py             reads PLY
polygon_files.py   reads polygons from GeoJSON and COCO annotations
png.py             encodes PNG, with one filter and the fastest compressor there is
references.py      reads the files that a mesh file names, from its folder and nowhere else
stl_off.py         reads STL and OFF
"""
