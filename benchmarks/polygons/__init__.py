"""Polygons beside what mask people use: time, wrong pixels, lines to write."""
