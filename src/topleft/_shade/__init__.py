"""From a visibility buffer to light, and from light to sRGB.

cutout.py         cut-outs: a visibility buffer without what the textures of its triangles leave out
eye.py            eye space: distances of the visible pixels as the camera has them
frame.py          frames: how a camera sees the space that light is computed in: rays of pixels, and the turn to eye s
look.py           looks: materials, lights and a camera as numbers for the shading kernels
multisample.py    pictures of several samples a pixel: each triangle is shaded once in a pixel, and colours are averag
pixel_normals.py  normals of visible pixels, by the kernel that has them for the light
shade.py          shading: from the visibility buffer to colours, for the pixels in which a triangle shows
surface.py        surfaces: the arrays of a mesh as the shading kernels read them, made once per mesh
"""
