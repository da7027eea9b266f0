"""Cameras: matrices, lenses, and where to stand.

camera.py       cameras: from world to clip space, as two 4x4 matrices made from words (eye, target, field of view, in
lens.py         lenses: from straight rays to the bent ones of a real camera, in float64
poses.py        poses: where a camera stands, as 4x4 matrices, and what it takes to have a subject in the frame
projections.py  projections: clip space from eye space, as 4x4 matrices, and the checks of numbers that cameras share
viewpoints.py   viewpoints: many cameras round one subject
"""
