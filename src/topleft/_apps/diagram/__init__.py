"""Diagrams: pictures of a rasterizer's decisions."""
