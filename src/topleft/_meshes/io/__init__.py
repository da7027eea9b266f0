"""Disk: meshes and pictures, read and written."""
