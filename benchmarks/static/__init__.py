"""Meshes that do not change, in clusters beside whole; docs/measured/static.md."""
