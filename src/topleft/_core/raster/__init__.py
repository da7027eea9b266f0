"""Arrays in, arrays out: the verbs of triangles. It has never heard of a mesh of the caller's, a camera or a file."""
