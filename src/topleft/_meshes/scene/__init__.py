"""The subjects that callers give: paths, meshes of other libraries, meshes placed in one world."""
