"""What is drawn.

cases.py     the registry of cases: scenes with a camera, for every contestant
families.py  families of separate triangles, and methods at their precisions
arrays.py    vertices and triangles of many kinds, without a camera
"""
