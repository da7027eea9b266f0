"""What callers give to be drawn: paths, meshes of other libraries, meshes placed in one world.

adapt.py     makes a `Mesh` of a path, of a mesh of another library, of arrays
cells.py     makes triangles of faces and cells as other libraries keep them
scene.py     defines `Scene` and `Instance`; makes the `Mesh`, `Scene` or `Points` that is drawn of what is given
"""
