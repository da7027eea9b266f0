"""Huge rasters: drawn window by window, handed on to Dask, written to Zarr, GeoTIFF and Deep Zoom.

ahead.py      makes blocks and windows ahead of who takes them, on threads
blocks.py     reads meshes of any size: arrays, arrays in files, binary PLY and STL, blocks of triangles
cluster.py    writes windows on the workers of a Dask cluster
dask_array.py hands a raster to Dask, a chunk a window
deepzoom.py   writes pyramids of Deep Zoom
drawing.py    draws what a window shows: masks, counts, labels, depth, colours, fields, heights
folders.py    keeps chunks in a folder or behind a URL: each is whole or not there
geotiff.py    writes cloud-optimised GeoTIFF
levels.py     writes all windows of a raster and its coarser levels, once each
merge.py      merges visibility buffers of shares of the triangles
spans.py      finds the triangles of each window
tiles.py      defines `Tiles`: a raster that is drawn window by window
zarr_files.py writes Zarr, version 3
"""
