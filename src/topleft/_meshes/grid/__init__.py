"""Meshes on grids of voxels and of texels."""
