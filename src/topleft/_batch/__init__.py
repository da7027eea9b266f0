"""Many pictures: jobs and workers.

batch.py    many pictures: jobs to files or arrays, on one thread, on several, or by worker processes
jobs.py     jobs: a scene, a camera and where the picture goes; and the studio that draws them, one after the other, i
workers.py  crews: who draws the jobs of a batch, threads or processes, and how meshes reach them
"""
