"""Disk: meshes and pictures, read and written.

images.py       pictures and buffers to files, whole or not at all
layer_files.py  layers to files: as they are where the format holds them, as scaled integers in PNG
load.py         files: meshes in. `load` reads what trimesh reads and returns one `Mesh`
png.py          PNG files: from a picture to the bytes of the file, with one fixed filter and the fastest compressor t
"""
