"""Cameras: matrices, lenses, and where to stand."""
