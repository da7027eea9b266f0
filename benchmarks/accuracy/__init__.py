"""Time beside error of every method, peer and pure twin; docs/measured/accuracy.md and speed.md.

study.py         arguments, parts of the record, parts of the pages
options.py       how much to measure
filling.py       families of triangles: masks and anti-aliasing
stability.py     a mesh that is touched and drawn again
depth.py         two nearly coplanar sheets
sizes.py         time by area, and what memory takes
scaling.py       time by number of triangles and of threads
tutorial.py      pictures a second of the tutorials' triangles
pure.py          the pure twins
long_run.py      10^8 edge pixels of vertices that are not snapped
tables.py        time, error, mesh, anti-aliasing
speed_tables.py  depth and cost
charts.py        time against error, and the list of charts
speed_charts.py  depth and cost
"""
