"""Levels of detail: coarser meshes, with bounds on their distance from the finest."""
