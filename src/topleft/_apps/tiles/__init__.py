"""Huge rasters: drawn window by window, handed on to Dask, written to Zarr, GeoTIFF and Deep Zoom."""
