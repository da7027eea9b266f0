"""Polygons of rings: masks, labels, colours and exact shares of pixels, straight from edges."""
