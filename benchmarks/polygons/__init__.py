"""Polygons beside other programs for masks: time, wrong pixels, lines to write."""
