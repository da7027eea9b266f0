"""Exact pictures to count errors against; nothing of topleft's engine.

pictures.py   the picture of a case after the snap, and how far another is from it
unsnapped.py  float64 vertices as they are: coverage and ids
clip.py       clip space, cut by the planes
area.py       the covered area of each pixel
"""
