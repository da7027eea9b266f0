"""Where each method fails; docs/measured/atlas.md.

study.py      arguments
measure.py    draws the families of `topleft.scene_families` with every method, counts faults
maps.py       tables of faults by method and parameter
depth.py      scenes in clip space and with depth
shrink.py     from a first failure to a small scene
tables.py     the page's tables
charts.py     heat maps
magnified.py  the small scenes, magnified
"""
