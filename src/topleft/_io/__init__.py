"""Disk: meshes and pictures, read and written.

images.py         writes pictures and buffers to files
layer_files.py    writes layers to files: as they are, or as scaled integers in PNG
load.py           reads meshes and their materials, by trimesh
polygon_files.py  reads polygons from GeoJSON and COCO annotations
png.py            encodes PNG, with one filter and the fastest compressor there is
"""
