"""Points, drawn as discs or squares: arrays in pixels or clip space, and clouds seen by a camera.

cloud.py   draws clouds of points: their buffer, their picture and their layers
points.py  draws points of arrays, the nearest in every pixel, and holds which of them shows
"""
