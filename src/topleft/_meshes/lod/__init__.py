"""Levels of detail: coarser meshes, with bounds on how far they lie from the finest."""
