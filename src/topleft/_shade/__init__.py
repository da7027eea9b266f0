"""From a visibility buffer to light, and from light to sRGB.

look.py        prepares what the kernels read: materials, lights, the rays of a camera, a mesh as rows of float32
shade.py       shades the visible pixels of instances, all samples of them; colours by ids and distances; gives normals
"""
