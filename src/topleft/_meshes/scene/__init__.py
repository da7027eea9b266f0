"""What callers give to be drawn: paths, meshes of other libraries, meshes placed in one world."""
