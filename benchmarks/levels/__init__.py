"""Levels of detail: time beside error.

study.py   arguments; measures each level near and far
page.py    docs/measured/levels.md
charts.py  its chart
"""
