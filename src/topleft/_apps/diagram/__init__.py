"""Diagrams: pictures of what a rasterizer decides."""
