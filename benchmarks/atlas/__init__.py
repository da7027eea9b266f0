"""Where each method fails; docs/measured/atlas.md.

study.py      arguments
measure.py    draws families with every method, counts faults
families.py   scenes in pixels by one or two parameters, and maps of their faults
depth.py      scenes in clip space and with depth
shrink.py     from a first failure to a small scene
tables.py     the page's tables
charts.py     heat maps
magnified.py  the small scenes, magnified
"""
