"""What the planner chooses beside what it could have; docs/measured/choices.md and planner.md.

study.py         arguments
measure.py       times the ways of each scene
scenes.py        the scenes
ways.py          the choices, each with its ways to draw
builds.py        ways that need another build of the kernels
plans.py         estimates of plans, and what plans take
tables.py        the page's tables
charts.py        a dot for each scene and choice
planner_page.py  writes docs/measured/planner.md
"""
