"""Meshes that do not change, in clusters beside whole; docs/measured/static.md.

study.py   arguments; times both ways, counts clusters
scenes.py  the scenes
tables.py  the page's tables
charts.py  times faster
"""
