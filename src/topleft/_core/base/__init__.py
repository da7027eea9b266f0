"""What every room stands on; it knows no triangle.

arrays.py      checks what the caller gives and makes contiguous native arrays of it
cluster.py     asks a Dask cluster whether its workers can draw, and what came of a task
color.py       converts sRGB to linear light and back, and makes a colour for each id
memory.py      gives arrays: new ones, ones that are kept from call to call, scratch of a thread
options.py     defines the enums behind the options that are strings in the API
remote.py      writes files behind URLs that fsspec reaches, whole or not at all
texels.py      looks up arrays at points, between texels and mip levels
threads.py     counts the threads that a call may use and runs parts of its work on them
whole_file.py  writes a file that is whole or not there
"""
