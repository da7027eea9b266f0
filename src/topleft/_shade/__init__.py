"""From a visibility buffer to light, and from light to sRGB.

look.py        prepares what the shading kernels read: materials, lights, the rays of a camera, a mesh as float32 rows
shade.py       shades the visible pixels of one mesh, resolves several samples a pixel, gives distances and normals
alpha_test.py  takes out of a visibility buffer what the textures of its triangles leave out
"""
