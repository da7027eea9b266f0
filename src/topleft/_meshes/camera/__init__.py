"""Cameras: matrices, lenses, and where to stand.

camera.py        defines `Camera`: view, projection and lens, made from words
file_cameras.py  reads the cameras of a file
lens.py          defines the lenses of OpenCV: how they bend rays, and back
matrices.py      makes view and projection matrices, and finds what frames a subject
viewpoints.py    makes many cameras round one subject
"""
