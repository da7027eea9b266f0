"""Polygons beside what mask people use: time, wrong pixels, lines to write.

cases.py      polygons: a 100-gon, a ring of many corners, cells that tile, strewn ones
painters.py   who draws them: topleft and others
study.py      the study: turns, errors, tables
"""
