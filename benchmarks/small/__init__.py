"""Studies of one file each.

batch.py      many pictures: views a second
cluster.py    what a Dask cluster costs: a job, the client's memory
fresh.py      results of their own beside `Rasterizer`
gate.py       two commits: instructions, and time in turns
instances.py  thousands of instances, and a mesh from a memory map
large.py      one large triangle beside a fill of the same memory
layers.py     each layer of a view beside its picture
no_snap.py    vertices that are not snapped beside snapped ones, verb by verb
field.py      a field beside matplotlib, datashader and SciPy
samples.py    ids and depth of several samples beside one
samplings.py  one scene in every sampling, as a picture
explorer.py   frames a second of the explorer in a headless browser
growth.py     memory after thousands of calls
tolerance.py  `tolerance=` beside the same without it
tiles.py      huge rasters by windows, beside rasterio, GDAL and datashader
memset.py     a yardstick: memset of the 4K pictures
"""
