"""Polygons of rings: masks, labels, colours and exact shares of pixels, straight from edges.

rings.py     what the caller gives becomes points and offsets: arrays, lists, COCO, `__geo_interface__`, shapely
prepared.py  points snapped, polygons bounded and certified: ready to be drawn
draw.py      masks, labels and sums of shares in bands of rows
polygons.py  the call `polygons`
overlap.py   the call `overlap`, and its table
"""
