"""What callers give to be drawn: paths, meshes of other libraries, meshes placed in one world.

adapt.py     makes a `Mesh` of a path, of a mesh of another library, of arrays
cells.py     makes triangles of faces and cells as other libraries keep them
scene.py     defines `Scene` and `Instance`: meshes placed in one world
subject.py   makes of whatever is given the `Mesh`, `Scene` or `Points` that is drawn
"""
