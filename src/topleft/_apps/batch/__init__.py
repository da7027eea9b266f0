"""Many pictures: jobs, and workers that draw them.

batch.py    draws many jobs, in order or as they are done, with a bounded number on the way
cluster.py  hands jobs and meshes to the workers of a Dask cluster
jobs.py     defines `Job` and draws one: a mesh, a camera and where the picture goes
workers.py  hands jobs to threads or processes, and meshes to processes
"""
